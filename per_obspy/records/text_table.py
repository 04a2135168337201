"""Plain tables of samples, one or several samples per row, whose layout the user describes."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from obspy import Stream, UTCDateTime

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, RecordRejected
from per_obspy.formats.text.lines import LONGEST_NUMBER
from per_obspy.formats.text.vocabulary import (
    channel_direction,
    coordinates,
    horizontal,
    is_direction,
    trace,
)
from per_obspy.units import motion_unit

#: largest deviation of a time from even spacing, as a fraction of the interval (tables round times)
_UNEVENNESS = 0.05

#: order of the samples in a table: one row per sample, or rows that follow each other
TABLE_LAYOUTS = ("columns", "rows")

#: number of a line, and its fields
_Row = tuple[int, list[str]]


def read_columns(
    path: str | Path,
    *,
    station: str,
    latitude: float,
    longitude: float,
    units: str,
    channels: Mapping[str, int],
    network: str = "",
    azimuths: Mapping[str, float] | None = None,
    separator: str | None = None,
    skip: int = 0,
    time_column: int | None = None,
    dt: float | None = None,
    start: str | None = None,
    raw: bool = False,
    layout: str | None = None,
) -> Stream:
    """
    Read a plain table as one Stream in m/s2.

    Parameters
    ----------
    path : str or Path
        Text file, all rows with as many values; empty lines at the end and everything after ``#``
        are ignored.
    station, network : str
        Codes.
    latitude, longitude : float
        Of the station, degrees.
    units : str
        Of the samples, an acceleration: ``m/s2``, ``cm/s^2``, ``gal``, ``g`` and so on.
    channels : mapping of str to int
        Channel code -> column, counted from 0.
    azimuths : mapping of str to float, optional
        Channel code -> degrees clockwise from north. Codes of SEED that end in N, E, Z and words
        as ``UP``, ``L``, ``TRAN`` need none.
    separator : str, optional
        Between columns; white space if not given.
    skip : int
        Lines before the first sample, dimensionless.
    time_column : int, optional
        Column of time, s; it must be evenly spaced.
    dt : float, optional
        Sampling interval, s; either this or ``time_column``.
    start : str, optional
        Time of the first sample, ISO 8601, UTC.
    raw : bool
        Whether the record still has to be corrected.
    layout : str, optional
        ``columns``: one row per sample, one column per channel. ``rows``: samples of the only
        channel, packed several to a row and read one row after the other; the last row may be
        shorter, ``channels`` names column 0 and ``dt`` is set. Not set: ``columns``, unless
        both would fit.

    Returns
    -------
    stream : Stream
        One trace per channel, in the words of ``formats/text/vocabulary.py``.

    Raises
    ------
    ValueError
        If an argument is wrong.
    CatalogError
        If the file cannot be read.
    RecordRejected
        If a row has more or fewer values than the first one, lacks a column, holds no number or
        breaks the spacing; or if ``layout`` is not given and both layouts fit.
    """
    factor = _checked_factor(units, layout, channels, time_column, dt)
    site = _site(latitude, longitude)
    directions = _directions(channels, azimuths or {})
    # Read the samples and their interval
    file = str(path)
    rows = _rows(file, separator, skip, layout)
    if layout is None and time_column is None and list(channels.values()) == [0]:
        _require_one_value(file, *rows[0])
    if time_column is not None:
        dt = _step(file, rows, time_column)
    step = float(checks.positive("dt", dt or 0.0))
    common = {
        "network": network,
        "station": station,
        "starttime": None if start is None else UTCDateTime(start),
        "units": "m/s2",
        "quantity": "acceleration",
        "processing_level": "raw" if raw else "processed",
        "coordinates": site,
    }
    # One trace per channel, in m/s2
    stream = Stream()
    for code, column in channels.items():
        samples = factor * _column(file, rows, column, code)
        stream.append(trace(samples, step, common | directions[code] | {"channel": code}))
    return stream


def _checked_factor(
    units: str,
    layout: str | None,
    channels: Mapping[str, int],
    time_column: int | None,
    dt: float | None,
) -> float:
    """Return a unit of acceleration in m/s2; refuse an interval or a layout that does not fit."""
    unit = motion_unit(units)
    if unit is None or unit.quantity != "acceleration":
        raise ValueError(f"units must be one of m/s2, cm/s2, gal, g, got {units!r}")
    if (time_column is None) == (dt is None):
        problem = f"exactly one of time_column and dt must be given, got {time_column} and {dt}"
        raise ValueError(problem)
    if layout not in (None, *TABLE_LAYOUTS):
        raise ValueError(f"layout must be one of {', '.join(TABLE_LAYOUTS)}, got {layout!r}")
    # Packed samples belong to one channel and have no times
    if layout == "rows" and time_column is not None:
        raise ValueError(f"layout = rows needs dt and no time_column, got column {time_column}")
    if layout == "rows" and list(channels.values()) != [0]:
        raise ValueError(f"layout = rows needs one channel, in column 0, got {dict(channels)}")
    return unit.factor


def _site(latitude: float, longitude: float) -> dict[str, float | None]:
    """Return the coordinates of a station, checked, degrees."""
    return coordinates(
        float(checks.between("latitude", latitude, -90, 90)),
        float(checks.between("longitude", longitude, -180, 180)),
    )


def _directions(
    channels: Mapping[str, int], azimuths: Mapping[str, float]
) -> dict[str, dict[str, float]]:
    """Return the orientation of every channel, from its azimuth or its code."""
    if not channels:
        raise ValueError("channels must name at least one column")
    if unknown := set(azimuths) - set(channels):
        raise ValueError(f"azimuths must belong to channels, got {sorted(unknown)}")
    # An azimuth comes before the code
    directions = {code: channel_direction(code) for code in channels}
    directions |= {code: horizontal(float(azimuth)) for code, azimuth in azimuths.items()}
    if unclear := [code for code, known in directions.items() if not is_direction(known)]:
        raise ValueError(
            f"azimuths must contain the direction of {unclear}: expected codes of SEED that end in "
            f"N, E or Z, or words as NS, UP, L, TRAN"
        )
    return directions


def _rows(path: str, separator: str | None, skip: int, layout: str | None) -> list[_Row]:
    """Return the fields of every line with samples; of packed samples one row per sample."""
    try:
        content = Path(path).read_text(encoding="latin-1")
    except OSError as error:
        raise CatalogError(path, f"cannot be read: {error.strerror}") from error
    lines = [line.split("#")[0] for line in content.rstrip().splitlines()]
    # Lines are numbered from 1, the skipped ones included
    numbered = enumerate(lines[skip:], skip + 1)
    rows = [(number, line.split(separator)) for number, line in numbered if line.strip()]
    _refuse_unequal_rows(path, rows, layout)
    # Packed samples follow each other from row to row
    if layout == "rows":
        rows = [(number, [field]) for number, fields in rows for field in fields]
    if len(rows) < 2:
        problem = f"{len(rows)} rows of samples after {skip} lines, a record needs two"
        raise RecordRejected(path, problem)
    return rows


def _refuse_unequal_rows(path: str, rows: Sequence[_Row], layout: str | None) -> None:
    """Refuse the first row whose number of values is not that of the first row."""
    expected = len(rows[0][1]) if rows else 0
    # The last row of packed samples may be shorter
    is_shorter = layout == "rows" and rows and len(rows[-1][1]) < expected
    for line, fields in rows[:-1] if is_shorter else rows:
        if len(fields) != expected:
            problem = f"{len(fields)} values, expected {expected} as on line {rows[0][0]}"
            # Samples that are packed into rows look like a table with a short last row
            if layout != "rows":
                problem += '; if the samples are packed into rows, set layout = "rows"'
            raise RecordRejected(path, f"line {line}: {problem}")


def _require_one_value(path: str, line: int, fields: Sequence[str]) -> None:
    """Refuse several values per row of a single channel, which may be packed samples or not."""
    if len(fields) > 1:
        problem = f"{len(fields)} values per row for one channel without a column of time"
        mend = 'set layout = "rows" for packed samples, "columns" to read the first value alone'
        raise RecordRejected(path, f"line {line}: {problem}; {mend}")


def _column(path: str, rows: Sequence[_Row], column: int, name: str) -> FloatArray:
    """Return the numbers of a column, which must be finite."""
    line, fields = rows[0]
    if not 0 <= column < len(fields):
        problem = f"no column {column}, there are {len(fields)}"
        raise RecordRejected(path, f"line {line}, {name}: {problem}")
    values = np.array([_number(fields[column].strip()) for _, fields in rows])
    finite = np.isfinite(values)
    # Name the first that is none
    if not finite.all():
        line, fields = rows[int(np.argmin(finite))]
        problem = f"{fields[column].strip()[:LONGEST_NUMBER]!r} is not a finite number"
        raise RecordRejected(path, f"line {line}, {name}: {problem}")
    return values


def _number(word: str) -> float:
    """Return a number; not a number for text and words too long for one."""
    try:
        return float(word) if len(word) <= LONGEST_NUMBER else np.nan
    except ValueError:
        return np.nan


def _step(path: str, rows: Sequence[_Row], column: int) -> float:
    """Return the mean interval of times that must be evenly spaced, s."""
    times = _column(path, rows, column, "time")
    dt = float(times[-1] - times[0]) / (len(times) - 1)
    uneven = np.abs(np.diff(times) - dt) > _UNEVENNESS * abs(dt)
    if dt <= 0 or uneven.any():
        # Name the first time that breaks the spacing
        first = int(np.argmax(uneven))
        step = f"{times[first]:g} s is followed by {times[first + 1]:g} s"
        problem = f"{step}, the mean interval is {dt:g} s"
        raise RecordRejected(path, f"line {rows[first + 1][0]}, time: {problem}")
    return float(f"{dt:.9g}")  # times are rounded, so more digits would be noise
