"""GeoNet (New Zealand): V1A (uncorrected) and V2A (corrected), three components a file."""

import re
from typing import Any

from obspy import Stream, Trace

from per_obspy.checks import FloatArray
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    block_lines,
    count,
    fixed_block,
    head_lines,
    interval,
    line_at,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import channel_code, coordinates, orientation, trace, utc

_TEXT_LINES, _INTEGER_LINES, _HEADER_LINES = 16, 4, 26
_WIDTH, _PER_LINE = 8, 10
_TITLE = re.compile(r"(Uncorrected|Corrected) accelerogram \S+_(\w+)_(\w+)\b")
_ANGLE = r"(\d{1,3})\s+(\d{1,2})\s+(\d{1,2})([NSEW])"
_SITE = re.compile(rf"Site (\S+)\s+{_ANGLE}\s+{_ANGLE}")
_EPICENTRE = re.compile(
    rf"Epicentre\s+{_ANGLE}\s+{_ANGLE}.*?(?:Depth\s*{DECIMAL}\s*km)?(?:\s+M\w?\s*{DECIMAL})?\s*"
)
_UNIT = re.compile(rf"units of {DECIMAL} mm/s/s")
_PEAK = re.compile(rf"Acceleration:\s*peak\s*{DECIMAL}\s*mm/s/s", re.IGNORECASE)
_BANDS = re.compile(rf"bands are {DECIMAL}-{DECIMAL} Hz and {DECIMAL}-{DECIMAL} Hz")
_SENSOR = re.compile(rf"Instr Period:\s*{DECIMAL}\s*s\s+Damping:\s*{DECIMAL}")
_MILLIMETRE = 0.001  # m


def is_geonet(file: WaveformFile) -> bool:
    """Tell whether a file starts like GeoNet V1A or V2A."""
    lines = head_lines(file, 300)
    return len(lines) > 2 and bool(_TITLE.match(lines[0])) and lines[1].startswith("Site ")


def read_geonet(file: WaveformFile, **_unused: Any) -> Stream:
    """Read GeoNet V1A or V2A: acceleration of all components, m/s2."""
    text = read_text(file)
    stream, line = Stream(), 0
    while line < len(text.lines):
        component, line = _component(text, line)
        stream.append(component)
    if len(stream) % 3:
        refuse(text, len(text.lines) - 1, "components", f"{len(stream)}, an instrument has three")
    return stream


def _component(text: Text, first: int) -> tuple[Trace, int]:
    line_at(text, first + _HEADER_LINES, "samples")
    lines = text.lines[first : first + _TEXT_LINES]
    title = _TITLE.match(lines[0])
    if title is None:
        refuse(text, first, "title", f"{lines[0].strip()[:60]!r} is not that of a component")
    numbers = first + _TEXT_LINES
    integers = fixed_block(text, numbers, 10 * _INTEGER_LINES, _WIDTH, _PER_LINE)
    reals = fixed_block(text, numbers + _INTEGER_LINES, 60, _WIDTH, _PER_LINE)
    dt = interval(text, numbers + _INTEGER_LINES + 2, "interval", float(reals[25]))
    values, line = _samples(text, first, integers)
    words = (
        _station(text, first)
        | _source(lines)
        | orientation(lines[12].removeprefix("Component").split("  ")[0])
    )
    words |= {
        "starttime": _start(text, numbers, integers),
        "units": "m/s2",
        "quantity": "acceleration",
    }
    words |= {
        "processing_level": "raw" if title[1] == "Uncorrected" else "processed",
        "location": title[3],
    }
    words["channel"] = channel_code(1 / dt, words)
    return trace(_unit(text, first, title[1]) * values, dt, words), line


def _samples(text: Text, first: int, integers: FloatArray) -> tuple[FloatArray, int]:
    """Read acceleration; velocity and displacement follow in V2A and must be whole."""
    promised = re.search(r"Number of points\s+(\S+)", text.lines[first + 9])
    if promised is None:
        refuse(text, first + 9, "number of points", f"{text.lines[first + 9].strip()!r} gives none")
    samples = count(text, first + 9, "number of points", promised[1])
    sizes = [int(size) for size in integers[33:36]]
    if sizes[0] != samples:
        refuse(
            text,
            first + _TEXT_LINES + 3,
            "number of points",
            f"{sizes[0]}, but {samples} on line {first + 10}",
        )
    line = first + _HEADER_LINES
    blocks = []
    for size in sizes:
        if size > 0:
            blocks.append(fixed_block(text, line, size, _WIDTH, _PER_LINE))
            line += block_lines(size, _PER_LINE)
    return blocks[0], line


def _unit(text: Text, first: int, title: str) -> float:
    if title == "Corrected":
        return _MILLIMETRE
    unit = _UNIT.search(text.lines[first + 10])
    if unit is None:
        refuse(
            text,
            first + 10,
            "unit",
            f"{text.lines[first + 10].strip()!r} names no multiple of mm/s/s",
        )
    return float(unit[1]) * _MILLIMETRE


def _degrees(degrees: str, minutes: str, seconds: str, letter: str) -> float:
    """Return signed degrees; the numeric header has lost the sign of the southern hemisphere."""
    size = int(degrees) + int(minutes) / 60 + int(seconds) / 3600
    return -size if letter in "SW" else size


def _station(text: Text, first: int) -> dict[str, Any]:
    site = _SITE.match(text.lines[first + 1])
    if site is None:
        refuse(
            text,
            first + 1,
            "site",
            f"{text.lines[first + 1].strip()!r} has no code and coordinates",
        )
    place = coordinates(_degrees(*site.groups()[1:5]), _degrees(*site.groups()[5:9]))
    return {
        "network": "NZ",
        "station": site[1],
        "coordinates": place,
        "station_name": text.lines[first + 2].strip() or None,
    }


def _source(lines: list[str]) -> dict[str, Any]:
    """Event, instrument, corners and peak, as far as the text tells them."""
    epicentre, bands, sensor = (
        _EPICENTRE.match(lines[8]),
        _BANDS.search(lines[11]),
        _SENSOR.search(lines[4]),
    )
    peak = _PEAK.match(lines[13])
    where = epicentre.groups() if epicentre else (None,) * 10
    period = float(sensor[1]) if sensor else 0.0
    model, _, serial = lines[3].removeprefix("Instrument").strip().partition("_")
    return {
        "event": {
            "name": lines[6].strip() or None,
            "latitude": _degrees(*where[:4]) if epicentre else None,
            "longitude": _degrees(*where[4:8]) if epicentre else None,
            "depth": float(where[8]) * 1000 if where[8] else None,
            "magnitude": float(where[9]) if where[9] else None,
        },
        "instrument": {
            "model": model or None,
            "serial": serial or None,
            "natural_frequency": 1 / period if period > 0 else None,
            "damping": float(sensor[2]) if sensor else None,
        },
        "corners": {"highpass": float(bands[2]), "lowpass": float(bands[3])} if bands else {},
        "header_peak": abs(float(peak[1])) * _MILLIMETRE if peak else None,
    }


def _start(text: Text, line: int, integers: FloatArray) -> Any:
    year, month, day, hour, minute, milliseconds = (
        int(integers[index]) for index in (8, 9, 18, 19, 38, 39)
    )
    return utc(text, line, "start", (year, month, day), (hour, minute, milliseconds / 1000))
