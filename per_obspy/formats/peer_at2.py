"""
PEER AT2 (acceleration, g), VT2 (velocity, cm/s) and DT2 (displacement, cm).

A file holds one component.
"""

import re
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from obspy import Stream, Trace, UTCDateTime
from obspy.core.trace import Stats

from per_obspy.checks import FloatArray
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.formats.text.header import full_year, utc
from per_obspy.formats.text.lines import (
    Text,
    WaveformFile,
    count,
    free_block,
    head_lines,
    interval,
    line_at,
    quoted,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import channel_code, orientation, trace

_QUANTITY = re.compile(
    r"(ACCELERATION|VELOCITY|DISPLACEMENT) TIME (?:SERIES|HISTORY) IN UNITS OF (G|CM/S|CM)\b"
)
_NUMBER = r"([-+\d.Ee*]++)"
_NAMED_SIZE = re.compile(rf"\s*+NPTS\s*+=\s*+{_NUMBER}\s*+,\s*+DT\s*+=\s*+{_NUMBER}", re.IGNORECASE)
_PLAIN_SIZE = re.compile(rf"\s*+{_NUMBER}\s++{_NUMBER}\s*+,?\s*+NPTS\s*+,\s*+DT", re.IGNORECASE)
#: event, date, perhaps a time of unknown zone, station, orientation
_TITLE = re.compile(
    r"(.*?)[,\s]*+\b(\d{1,2})/(\d{1,2})/(\d{4}|\d{2})\b(?:\s++\d{1,2}:?\d{2})?\s*+,(.*),([^,]*+)"
)
#: corners in the units line: HP=0.1 Hz LP=30.0 Hz
_POINTS = re.compile(r"\b([HL])P\s*+=\s*+(\d{1,20}\.?\d{0,20}|\.\d{1,20})\s*+HZ")
#: corners in the line of sizes: 5 POLE @ 30.00000 HZ, -5 POLE @ .10000 HZ; a high-pass filter has
#: a negative number of poles, and the line may end before the last unit
_POLES = re.compile(r"([-+]?)(\d{1,20})\s*+POLES?\s*+@\s*+(\d{1,20}\.?\d{0,20}|\.\d{1,20})")

#: quantity and unit of the header -> unit of the samples, factor to it
_UNITS = {
    ("ACCELERATION", "G"): ("m/s2", STANDARD_GRAVITY),
    ("VELOCITY", "CM/S"): ("m/s", 0.01),
    ("DISPLACEMENT", "CM"): ("m", 0.01),
}

#: numbers of a full line in a file that is written
_PER_LINE = 5


def is_at2(file: WaveformFile) -> bool:
    """Check whether a file starts like a PEER record."""
    lines = head_lines(file, 1000)
    return (
        len(lines) > 3
        and lines[0].startswith("PEER")
        and bool(_QUANTITY.match(lines[2].strip()))
        and "NPTS" in lines[3].upper()
    )


def read_at2(file: WaveformFile, **_unused: Any) -> Stream:
    """Read one PEER record: a Stream of one trace in m/s2, m/s or m, processed as PEER did."""
    text = read_text(file)
    units = _QUANTITY.match(line_at(text, 2, "units").strip())
    if units is None or units.groups() not in _UNITS:
        refuse(text, 2, "units", f"{quoted(text, 2)} is not a PEER quantity and unit")
    unit, factor = _UNITS[units[1], units[2]]
    samples, dt = _size(text)
    values = factor * free_block(text, 4, samples)
    # Words of the header
    words = {"units": unit, "quantity": units[1].lower(), "processing_level": "processed"}
    words |= _title(text) | {"corners": _corners(text)}
    return Stream([trace(values, dt, words, text.name)])


def _size(text: Text) -> tuple[int, float]:
    """Return the number of samples and their interval, s."""
    line = line_at(text, 3, "NPTS, DT")
    size = _NAMED_SIZE.match(line) or _PLAIN_SIZE.match(line)
    if size is None:
        problem = f"{quoted(text, 3)} names no number of samples and no interval"
        refuse(text, 3, "NPTS, DT", problem)
    return count(text, 3, "NPTS", size[1]), interval(text, 3, "DT", size[2])


def _title(text: Text) -> dict[str, Any]:
    """Return event, date, station and orientation of the second line."""
    title = _TITLE.fullmatch(text.lines[1].strip())
    if title is None:
        name, *parts = text.lines[1].split(",")
        # Without a date the direction may still be the last word
        direction = orientation(parts[-1]) if parts else {}
        is_named = bool(direction) and len(channel_code(1.0, direction)) == 3
        known = direction if is_named else {}
        return {"station": _code(name), "station_name": name.strip(), **known}
    event, month, day, year, station, component = title.groups()
    start = utc(text, 1, "date", (full_year(year), int(month), int(day)))
    # The format has no station codes
    words = {
        "station": _code(station),
        "station_name": station.strip(),
        "event": {"name": event or None},
        "starttime": start,
    }
    return words | orientation(component)


def _code(name: str) -> str:
    """Return a station code made from a name."""
    return re.sub(r"[^A-Z0-9]", "", name.upper())


def _corners(text: Text) -> dict[str, float]:
    """Return the corners of PEER's filter that the header has, Hz; none that contradict."""
    corners = {}
    for letter, corner in _POINTS.findall(text.lines[2].upper()):
        corners[{"H": "highpass", "L": "lowpass"}[letter]] = float(corner)
    for sign, poles, corner in _POLES.findall(text.lines[3].upper()):
        # No poles: no filter was applied here, but a low-pass corner may be that of earlier
        # processing, as of digitized film; the cautious answer keeps it
        if sign == "-" and int(poles) > 0:
            corners["highpass"] = float(corner)
        elif sign != "-" and float(corner) > 0:
            corners["lowpass"] = float(corner)
    contradictory = corners.get("lowpass", np.inf) <= corners.get("highpass", 0.0)
    return {} if contradictory else corners


def write_at2(stream: Stream, filename: str | Path | BinaryIO, **_unused: Any) -> None:
    """
    Write one trace of acceleration in m/s2 as PEER AT2, to seven digits.

    Raises
    ------
    ValueError
        If the stream has not exactly one trace, or it is not acceleration in m/s2
        (``stats.units``).
    """
    if len(stream) != 1:
        raise ValueError(f"an AT2 file holds one trace, got {len(stream)}")
    content = _at2_text(stream[0]).encode("ascii", "replace")
    if hasattr(filename, "write"):
        filename.write(content)
    else:
        Path(filename).write_bytes(content)


def _at2_text(component: Trace) -> str:
    """Return the content of a file."""
    _require_acceleration(component)
    stats = component.stats
    top = [
        "PEER NGA STRONG MOTION DATABASE RECORD",
        _title_line(stats),
        "ACCELERATION TIME SERIES IN UNITS OF G",
        f"NPTS= {len(component.data):6d}, DT= {stats.delta:.9g} SEC",
    ]
    return "\n".join(top + _rows(component.data / STANDARD_GRAVITY)) + "\n"


def _require_acceleration(component: Trace) -> None:
    """Refuse a trace that is not finite acceleration in m/s2."""
    units = component.stats.get("units")
    if units != "m/s2":
        raise ValueError(
            f"an AT2 file holds acceleration, stats.units must be 'm/s2', got {units!r}"
        )
    if not np.isfinite(component.data).all():
        raise ValueError(f"{component.id} has samples that are not finite")


def _title_line(stats: Stats) -> str:
    """Return the second line: event and date where they are known, station, orientation."""
    station = stats.get("station_name", stats.station).replace(",", " ")
    title = f"{station}, {_component(stats)}"
    # ObsPy's default start is a mark for unknown
    if stats.starttime == UTCDateTime(0):
        return title
    event = stats.get("event", {}).get("name", "")
    date = f"{stats.starttime.month}/{stats.starttime.day}/{stats.starttime.year}"
    return f"{event}, {date}, {title}"


def _rows(values: FloatArray) -> list[str]:
    """Return the lines of a block of numbers."""
    words = [f"{value:15.7E}" for value in values]
    return ["".join(words[first : first + _PER_LINE]) for first in range(0, len(words), _PER_LINE)]


def _component(stats: Stats) -> str:
    """Return the orientation, or the channel code where it is unknown."""
    if abs(stats.get("sensor_dip", 0.0)) == 90:
        return "UP" if stats.sensor_dip < 0 else "DWN"
    return f"{stats.sensor_azimuth:03.0f}" if "sensor_azimuth" in stats else stats.channel
