"""Plain tables of samples, one or several samples per row, whose layout the user describes."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from obspy import Stream, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.config import Columns
from per_obspy.errors import RecordRejected
from per_obspy.files import reading
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

#: number of a line, and its fields
_Row = tuple[int, list[str]]


def read_columns(path: str | Path, **description: Any) -> Stream:
    """
    Read a plain table as one Stream in m/s2.

    Parameters
    ----------
    path : str or Path
        Text file, all rows with as many values; empty lines at the end and everything after ``#``
        are ignored.
    **description
        Keys of ``[[records.columns]]``, see :class:`per_obspy.config.Columns`: ``station``,
        ``latitude`` and ``longitude`` (degrees), ``units``, ``channels``, and one of
        ``time_column`` and ``dt`` (s) are needed. With ``layout = "rows"`` samples of the only
        channel are packed several to a row and read one row after the other; the last row may be
        shorter. Without a layout it is one row per sample, unless both would fit.

    Returns
    -------
    stream : Stream
        One trace per channel, in the words of ``formats/text/vocabulary.py``.

    Raises
    ------
    ValueError
        If a key is wrong.
    CatalogError
        If the file cannot be read.
    RecordRejected
        If a row has more or fewer values than the first one, lacks a column, holds no number or
        breaks the spacing; or if ``layout`` is not given and both layouts fit.
    """
    return read_described(Columns(file=Path(path), **description))


def read_described(table: Columns) -> Stream:
    """Read a table by its description; result and errors are those of :func:`read_columns`."""
    directions, unit = _directions(table), motion_unit(table.units)
    assert unit is not None  # Columns demands one of acceleration
    rows, time = _rows(table), table.time_column
    words = {
        "network": table.network,
        "station": table.station,
        "starttime": None if table.start is None else UTCDateTime(table.start),
        "processing_level": "raw" if table.raw else "processed",
        "coordinates": coordinates(table.latitude, table.longitude),
    }
    # One trace per channel, in m/s2
    dt = (table.dt or 0.0) if time is None else _step(table, rows, time)
    stream = Stream()
    for code, column in table.channels.items():
        samples = unit.factor * _column(table, rows, column, code)
        stream.append(trace(samples, dt, words | directions[code] | {"channel": code}))
    return stream


def _directions(table: Columns) -> dict[str, dict[str, float]]:
    """Return the orientation of every channel, from its azimuth or its code."""
    if not table.channels:
        raise ValueError("channels must name at least one column")
    if unknown := set(table.azimuths) - set(table.channels):
        raise ValueError(f"azimuths must belong to channels, got {sorted(unknown)}")
    # An azimuth comes before the code
    directions = {code: channel_direction(code) for code in table.channels}
    directions |= {code: horizontal(azimuth) for code, azimuth in table.azimuths.items()}
    if unclear := [code for code, known in directions.items() if not is_direction(known)]:
        raise ValueError(
            f"azimuths must contain the direction of {unclear}: expected codes of SEED that end in "
            f"N, E or Z, or words as NS, UP, L, TRAN"
        )
    return directions


def _rows(table: Columns) -> list[_Row]:
    """Return the fields of every line with samples; of packed samples one row per sample."""
    with reading(table.file):
        content = table.file.read_text(encoding="latin-1")
    lines = [line.split("#")[0] for line in content.rstrip().splitlines()]
    # Lines are numbered from 1, the skipped ones included
    numbered = enumerate(lines[table.skip :], table.skip + 1)
    rows = [(number, line.split(table.separator)) for number, line in numbered if line.strip()]
    _require_layout(table, rows)
    # Packed samples follow each other from row to row
    if table.layout == "rows":
        rows = [(number, [field]) for number, fields in rows for field in fields]
    if len(rows) < 2:
        problem = f"{len(rows)} rows of samples after {table.skip} lines, a record needs two"
        raise RecordRejected(str(table.file), problem)
    return rows


def _require_layout(table: Columns, rows: Sequence[_Row]) -> None:
    """Refuse the first row whose number of values does not fit the layout."""
    first, expected = next(((line, len(fields)) for line, fields in rows), (0, 0))
    # The last row of packed samples may be shorter
    is_packed = table.layout == "rows"
    for line, fields in rows:
        is_shorter = is_packed and line == rows[-1][0] and len(fields) < expected
        if len(fields) != expected and not is_shorter:
            problem = f"{len(fields)} values, expected {expected} as on line {first}"
            # Samples that are packed into rows look like a table with a short last row
            mend = "" if is_packed else '; if the samples are packed into rows, set layout = "rows"'
            raise RecordRejected(str(table.file), f"line {line}: {problem}{mend}")
    # Several values per row of a single channel may be packed samples or not
    is_doubtful = table.layout is None and table.time_column is None and len(rows) > 1
    if is_doubtful and expected > 1 and [*table.channels.values()] == [0]:
        problem = f"{expected} values per row for one channel without a column of time"
        mend = 'set layout = "rows" for packed samples, "columns" to read the first value alone'
        raise RecordRejected(str(table.file), f"line {first}: {problem}; {mend}")


def _column(table: Columns, rows: Sequence[_Row], column: int, name: str) -> FloatArray:
    """Return the numbers of a column, which must be finite."""
    line, fields = rows[0]
    if not 0 <= column < len(fields):
        problem = f"no column {column}, there are {len(fields)}"
        raise RecordRejected(str(table.file), f"line {line}, {name}: {problem}")
    values = np.array([_number(fields[column]) for _, fields in rows])
    # Name the first that is none
    if not np.isfinite(values).all():
        line, fields = rows[int(np.argmin(np.isfinite(values)))]
        problem = f"{fields[column].strip()[:LONGEST_NUMBER]!r} is not a finite number"
        raise RecordRejected(str(table.file), f"line {line}, {name}: {problem}")
    return values


def _number(word: str) -> float:
    """Return a number; not a number for text and words too long for one."""
    try:
        return float(word) if len(word.strip()) <= LONGEST_NUMBER else np.nan
    except ValueError:
        return np.nan


def _step(table: Columns, rows: Sequence[_Row], column: int) -> float:
    """Return the mean interval of times that must be evenly spaced, s."""
    times = _column(table, rows, column, "time")
    dt = float(times[-1] - times[0]) / (len(times) - 1)
    uneven = np.abs(np.diff(times) - dt) > _UNEVENNESS * abs(dt)
    if dt <= 0 or uneven.any():
        # Name the first time that breaks the spacing
        first = int(np.argmax(uneven))
        step = f"{times[first]:g} s is followed by {times[first + 1]:g} s"
        problem = f"line {rows[first + 1][0]}, time: {step}, the mean interval is {dt:g} s"
        raise RecordRejected(str(table.file), problem)
    return float(f"{dt:.9g}")  # times are rounded, so more digits would be noise
