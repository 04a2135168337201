"""USC (Los Angeles network): volume 1 (uncorrected) and volume 2 (corrected)."""

import re
from typing import Any

from obspy import Stream, Trace, UTCDateTime

from per_obspy.constants import GAL, STANDARD_GRAVITY
from per_obspy.formats.text.film import pair_lines, read_pairs
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    count,
    head_lines,
    line_at,
    read_text,
    refuse,
)
from per_obspy.formats.text.number_blocks import titled_block
from per_obspy.formats.text.vocabulary import channel_code, coordinates, orientation, trace, utc

_VOLUME_1 = re.compile(r"FILE\s+\d+ OF UNCORRECTED ACCELEROGRAM DATA OF VOLUME I:")
_VOLUME_1_LINES, _VOLUME_2_LINES = 27, 45
_ANGLE = r"(\d{1,3})\s+(\d{1,2})\s+(\d{1,2})([NSEW])"
_STATION = re.compile(rf"STATION USC#\s*(\S+)\s+{_ANGLE},\s*{_ANGLE}")
_EPICENTRE = re.compile(rf"EPICENTER\s*-\s*{_ANGLE},\s*{_ANGLE}")
_DATE = re.compile(r"([A-Z]{3})\S* (\d{1,2}), (\d{4})\s*-\s*(\d\d)(\d\d) GMT")
_MONTHS = ("JAN", "FEB", "MAR", "APR", "MAY", "JUN", "JUL", "AUG", "SEP", "OCT", "NOV", "DEC")
_SENSOR = re.compile(rf"INSTR PERIOD\s*=\s*{DECIMAL}\s*SEC\s+DAMPING\s*=\s*{DECIMAL}")
_POINTS = re.compile(r"NO\. OF POINTS\s*=\s*(\S+)")
_BANDS = re.compile(rf"BETWEEN\s*{DECIMAL}-\s*{DECIMAL} AND\s*{DECIMAL}-\s*{DECIMAL} HZ")
_PEAK = re.compile(rf"PEAK ACCELERATION =\s*{DECIMAL}\s*CMS?/SEC/SEC")


def is_usc(file: WaveformFile) -> bool:
    """Tell whether a file starts like volume 1 or 2 of USC."""
    lines = head_lines(file, 200)
    corrected = lines[0].startswith("CORRECTED ACCELEROGRAM ") and len(lines) > 2
    return bool(_VOLUME_1.match(lines[1 if corrected else 0]))


def read_usc(file: WaveformFile, **_unused: Any) -> Stream:
    """Read volume 1 or 2 of USC: acceleration of all components, m/s2."""
    text = read_text(file)
    stream, line = Stream(), 0
    while line < len(text.lines):
        corrected = text.lines[line].startswith("CORRECTED ACCELEROGRAM ")
        component, line = _volume_2(text, line) if corrected else _volume_1(text, line)
        stream.append(component)
    return stream


def _volume_1(text: Text, first: int) -> tuple[Trace, int]:
    line_at(text, first + _VOLUME_1_LINES, "samples")
    words = _words(text, first)
    if not text.lines[first + 11].startswith("UNITS ARE SEC AND G/10"):
        refuse(text, first + 11, "unit", f"{text.lines[first + 11].strip()[:40]!r} is not g/10")
    points = _POINTS.match(text.lines[first + 10])
    if points is None:
        refuse(
            text, first + 10, "number of points", f"{text.lines[first + 10].strip()!r} gives none"
        )
    samples = count(text, first + 10, "number of points", points[1])
    values, dt = read_pairs(_shifted(text), first + _VOLUME_1_LINES, samples)
    words |= {"processing_level": "raw"}
    return trace(STANDARD_GRAVITY / 10 * values, dt, words), first + _VOLUME_1_LINES + pair_lines(
        samples
    )


def _shifted(text: Text) -> Text:
    """Return the file without its first column, FORTRAN's blank for the line printer."""
    return Text(text.name, [line[1:] if line.startswith(" ") else line for line in text.lines])


def _volume_2(text: Text, first: int) -> tuple[Trace, int]:
    line_at(text, first + _VOLUME_2_LINES, "samples")
    words = _words(text, first + 1)
    line = first + _VOLUME_2_LINES
    if "CM/SEC/SEC" not in text.lines[line]:
        refuse(text, line, "unit", f"{text.lines[line].strip()!r} does not say cm/sec/sec")
    values, dt, line = titled_block(text, line, "ACC", 8, 10)
    for kind in ("VEL", "DIS"):
        others, _, line = titled_block(text, line, kind, 8, 10)
        if len(others) != len(values):
            refuse(text, line - 1, kind, f"{len(others)} samples, acceleration has {len(values)}")
    bands, peak = _BANDS.search(text.lines[first + 14]), _PEAK.match(text.lines[first + 17])
    words |= {
        "processing_level": "processed",
        "corners": {"highpass": float(bands[2]), "lowpass": float(bands[3])} if bands else {},
        "header_peak": abs(float(peak[1])) * GAL if peak else None,
    }
    return trace(GAL * values, dt, words | {"channel": channel_code(1 / dt, words)}), line


def _words(text: Text, first: int) -> dict[str, Any]:
    """Words of the twelve lines that both volumes share."""
    lines = text.lines[first : first + 13]
    if not _VOLUME_1.match(lines[0]):
        refuse(text, first, "title", f"{lines[0].strip()[:60]!r} is not that of a component")
    station, sensor = _STATION.match(lines[4]), _SENSOR.match(lines[9])
    period = float(sensor[1]) if sensor else 0.0
    place = coordinates(*_angles(station.groups()[1:])) if station else {}
    words: dict[str, Any] = {"units": "m/s2", "quantity": "acceleration", "coordinates": place}
    words |= {
        "station": station[1] if station else None,
        "station_name": re.split(r"\s{2,}|\d+$", lines[5].strip())[0] or None,
        "instrument": {
            "natural_frequency": 1 / period if period > 0 else None,
            "damping": float(sensor[2]) if sensor else None,
        },
        "event": _event(text, first, lines),
    }
    direction = re.match(r"COMP\s+(\S+)", lines[6])
    return words | (orientation(direction[1]) if direction else {})


def _angles(parts: tuple[str, ...]) -> tuple[float, float]:
    sizes = [
        int(parts[first]) + int(parts[first + 1]) / 60 + int(parts[first + 2]) / 3600
        for first in (0, 4)
    ]
    return sizes[0] * (-1 if parts[3] == "S" else 1), sizes[1] * (-1 if parts[7] == "W" else 1)


def _event(text: Text, first: int, lines: list[str]) -> dict[str, Any]:
    place, date = _EPICENTRE.match(lines[8]), _DATE.match(lines[2])
    latitude, longitude = _angles(place.groups()) if place else (None, None)
    name = re.split(r"\s{2,}", lines[1].strip())[0]
    return {
        "name": name or None,
        "time": _origin(text, first + 2, date) if date else None,
        "latitude": latitude,
        "longitude": longitude,
    }


def _origin(text: Text, line: int, date: re.Match[str]) -> UTCDateTime | None:
    if date[1] not in _MONTHS:
        return None
    day = (int(date[3]), _MONTHS.index(date[1]) + 1, int(date[2]))
    return utc(text, line, "date", day, (float(date[4]), float(date[5])))
