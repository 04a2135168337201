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

from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.formats.text.header import header_time, word_in
from per_obspy.formats.text.lines import (
    Text,
    WaveformFile,
    count,
    free_block,
    head_lines,
    interval,
    line_at,
    match_line,
    quote,
    read_text,
    refuse,
    write_content,
)
from per_obspy.formats.text.vocabulary import Words, channel_code, orientation, trace

_QUANTITY = re.compile(
    r"(ACCELERATION|VELOCITY|DISPLACEMENT) TIME (?:SERIES|HISTORY) IN UNITS OF (G|CM/S|CM)\b"
)
_NUMBER = r"([-+\d.Ee*]++)"
_SIZE = re.compile(
    rf"^\s*+(?:NPTS\s*+=\s*+{_NUMBER}\s*+,\s*+DT\s*+=\s*+{_NUMBER}|"
    rf"{_NUMBER}\s++{_NUMBER}\s*+,?\s*+NPTS\s*+,\s*+DT)",
    re.IGNORECASE,
)
#: event, date, perhaps a time of unknown zone, station, orientation
_TITLE = re.compile(
    r"(.*?)[,\s]*+\b(?P<month>\d{1,2})/(?P<day>\d{1,2})/(?P<year>\d{4}|\d{2})\b"
    r"(?:\s++\d{1,2}:?\d{2})?\s*+,(?P<station>.*),(?P<component>[^,]*+)"
)
#: corners in the units line: HP=0.1 Hz LP=30.0 Hz
_CORNERS = {"H": "highpass", "L": "lowpass"}
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
        refuse(text, 2, "units", f"{quote(text, 2)} is not a PEER quantity and unit")
    unit, factor = _UNITS[units[1], units[2]]
    # Number of samples, and their interval, s
    size = match_line(text, 3, "NPTS, DT", _SIZE, "{} names no number of samples and no interval")
    samples, step = filter(None, size.groups())
    dt = interval(text, 3, "DT", step)
    values = factor * free_block(text, 4, count(text, 3, "NPTS", samples))
    # Words of the header
    words = {"units": unit, "quantity": units[1].lower(), "processing_level": "processed"}
    words |= _title(text) | {"corners": _corners(text)}
    return Stream([trace(values, dt, words, text.name)])


def _title(text: Text) -> Words:
    """Return event, date, station and orientation of the second line."""
    title = _TITLE.fullmatch(text.lines[1].strip())
    if title is None:
        name, *parts = text.lines[1].split(",")
        # Without a date the direction may still be the last word
        direction = orientation(parts[-1]) if parts else {}
        words = direction if direction and len(channel_code(1.0, direction)) == 3 else {}
    else:
        name = title["station"]
        words = {
            "event": {"name": word_in(title)},
            "starttime": header_time(text, 1, "date", title),
            **orientation(title["component"]),
        }
    # The format has no station codes
    code = re.sub(r"[^A-Z0-9]", "", name.upper())
    return {"station": code, "station_name": name.strip(), **words}


def _corners(text: Text) -> dict[str, float]:
    """Return the corners of PEER's filter that the header has, Hz; none that contradict."""
    points = _POINTS.findall(text.lines[2].upper())
    corners = {_CORNERS[letter]: float(corner) for letter, corner in points}
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
    write_content(filename, _at2_text(stream[0]).encode("ascii", "replace"))


def _at2_text(component: Trace) -> str:
    """Return the content of a file; refuse a trace that is not finite acceleration in m/s2."""
    units = component.stats.get("units")
    if units != "m/s2":
        raise ValueError(
            f"an AT2 file holds acceleration, stats.units must be 'm/s2', got {units!r}"
        )
    if not np.isfinite(component.data).all():
        raise ValueError(f"{component.id} has samples that are not finite")
    # Four lines of header, then the samples in g
    words = [f"{value:15.7E}" for value in component.data / STANDARD_GRAVITY]
    lines = [
        "PEER NGA STRONG MOTION DATABASE RECORD",
        _title_line(component.stats),
        "ACCELERATION TIME SERIES IN UNITS OF G",
        f"NPTS= {len(words):6d}, DT= {component.stats.delta:.9g} SEC",
        *("".join(words[first : first + 5]) for first in range(0, len(words), 5)),
    ]
    return "\n".join(lines) + "\n"


def _title_line(stats: Stats) -> str:
    """Return the second line: event and date where they are known, station, orientation."""
    component = f"{stats.sensor_azimuth:03.0f}" if "sensor_azimuth" in stats else stats.channel
    if abs(stats.get("sensor_dip", 0.0)) == 90:
        component = "UP" if stats.sensor_dip < 0 else "DWN"
    station = stats.get("station_name", stats.station).replace(",", " ")
    # ObsPy's default start is a mark for unknown
    start = stats.starttime
    if start == UTCDateTime(0):
        return f"{station}, {component}"
    event = stats.get("event", {}).get("name", "")
    return f"{event}, {start.month}/{start.day}/{start.year}, {station}, {component}"
