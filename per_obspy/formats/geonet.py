"""GeoNet (New Zealand): V1A (uncorrected) and V2A (corrected), three components per file."""

import re
from datetime import UTC, datetime
from typing import Any

from obspy import Stream, Trace, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.formats.text.header import (
    MONTHS,
    corners,
    epicentre_place,
    number_in,
    place_pattern,
    scale,
    station_place,
    utc,
)
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    block_lines,
    fixed_block,
    head_lines,
    interval,
    line_at,
    match_line,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import Words, orientation, read_components, trace
from per_obspy.formats.text.volumes import promised_points, sensor_constants

_TEXT_LINES, _INTEGER_LINES, _HEADER_LINES = 16, 4, 26
_INTEGERS, _REALS = 40, 60
_WIDTH, _PER_LINE = 8, 10
_TITLE = re.compile(r"^(Uncorrected|Corrected) accelerogram \S+_(\w+)_(\w++)\b")
_PLACE = place_pattern(r"\d{1,3}\s++\d{1,2}\s++\d{1,2}", r"\s++")
_SITE = re.compile(rf"^Site (\S++)\s++{_PLACE}")
_EPICENTRE = re.compile(rf"Epicentre\s++{_PLACE}")
_ORIGIN = re.compile(
    r"(\d{4})\s++([A-Za-z]{3,9})\s++(\d{1,2})\s++(\d{2}:\d{2}:\d{2}(?:\.\d{1,6})?)\s++UT"
)
_DEPTH = re.compile(rf"Depth\s*+{DECIMAL}\s*+km")
_MAGNITUDE = re.compile(rf"\sM\w?\s*+{DECIMAL}")
_POINTS = re.compile(r"Number of points\s++(\S+)")
_UNIT = re.compile(rf"units of {DECIMAL} mm/s/s")
_PEAK = re.compile(rf"Acceleration:\s*+peak\s*+{DECIMAL}\s*+mm/s/s", re.IGNORECASE)
_BANDS = re.compile(rf"bands are {DECIMAL}-{DECIMAL} Hz and {DECIMAL}-{DECIMAL} Hz")
_MILLIMETRE = 0.001  # m


def is_geonet(file: WaveformFile) -> bool:
    """Check whether a file starts like GeoNet V1A or V2A."""
    lines = head_lines(file, 300)
    return len(lines) > 2 and bool(_TITLE.match(lines[0])) and lines[1].startswith("Site ")


def read_geonet(file: WaveformFile, **_unused: Any) -> Stream:
    """Read GeoNet V1A or V2A: acceleration of all components, m/s2."""
    text = read_text(file)
    stream = read_components(text, _component)
    if len(stream) % 3:
        refuse(text, len(text.lines) - 1, "components", f"{len(stream)}, an instrument has three")
    return stream


def _component(text: Text, first: int) -> tuple[Trace, int]:
    """Return a component and the line after it."""
    line_at(text, first + _HEADER_LINES, "samples")
    title = match_line(text, first, "title", _TITLE, "{} is not that of a component")
    # Integers and reals of the header
    numbers = first + _TEXT_LINES
    integers = [int(size) for size in fixed_block(text, numbers, _INTEGERS, _WIDTH, _PER_LINE)]
    numbers += _INTEGER_LINES
    reals = fixed_block(text, numbers, _REALS, _WIDTH, _PER_LINE)
    dt = interval(text, numbers + 2, "interval", float(reals[25]))
    values, line = _samples(text, first, integers[33:36])
    factor, level = _unit(text, first + 10, title[1])
    # The name of the instrument is the last part of the title
    words = _station(text, first) | {"location": title[3], "processing_level": level}
    words |= _motion(text.lines[first : first + _TEXT_LINES])
    words["starttime"] = _start(text, first + _TEXT_LINES, integers)
    return trace(factor * values, dt, words), line


def _unit(text: Text, line: int, state: str) -> tuple[float, str]:
    """Return the unit of the samples, m/s2, and the level of processing."""
    if state == "Corrected":
        return _MILLIMETRE, "processed"
    unit = match_line(text, line, "unit", _UNIT, "{} names no multiple of mm/s/s")
    return float(unit[1]) * _MILLIMETRE, "raw"


def _start(text: Text, line: int, integers: list[int]) -> UTCDateTime:
    """Return the time of the first sample, whose parts are at three places among the integers."""
    year, month, day, hour = integers[8:10] + integers[18:20]
    clock = (hour, integers[38], integers[39] / 1000)
    return utc(text, line, "start", (year, month, day), clock)


def _samples(text: Text, first: int, sizes: list[int]) -> tuple[FloatArray, int]:
    """
    Return acceleration and the line after the component.

    Velocity and displacement follow in V2A and must be whole.
    """
    samples = promised_points(text, first + 9, _POINTS)
    if sizes[0] != samples:
        problem = f"{sizes[0]}, but {samples} on line {first + 10}"
        refuse(text, first + _TEXT_LINES + 3, "number of points", problem)
    # Blocks of acceleration, velocity and displacement, of which V1A has the first
    line = first + _HEADER_LINES
    blocks = []
    for size in sizes:
        if size > 0:
            blocks.append(fixed_block(text, line, size, _WIDTH, _PER_LINE))
            line += block_lines(size, _PER_LINE)
    return blocks[0], line


def _motion(lines: list[str]) -> Words:
    """Return corners, peak and direction, as far as the text has them."""
    # The corners lie where the transition bands end: inside the pass band
    return {
        "corners": corners(_BANDS.search(lines[11]), 2),
        "header_peak": scale(number_in(_PEAK.match(lines[13])), _MILLIMETRE),
        **orientation(lines[12].removeprefix("Component").split("  ")[0]),
    }


def _station(text: Text, first: int) -> Words:
    """Return codes, name, place and instrument of the station, and the event."""
    lines = text.lines[first : first + _TEXT_LINES]
    site = match_line(text, first + 1, "site", _SITE, "{} has no code and coordinates")
    # Depth in km
    event = {
        "name": lines[6].strip() or None,
        "time": _origin_time(_ORIGIN.match(lines[7])),
        **epicentre_place(_EPICENTRE.match(lines[8])),
        "depth": scale(number_in(_DEPTH.search(lines[8])), 1000),
        "magnitude": number_in(_MAGNITUDE.search(lines[8])),
    }
    model, _, serial = lines[3].removeprefix("Instrument").strip().partition("_")
    # Words without a value are dropped from the trace
    return {
        "network": "NZ",
        "station": site[1],
        "station_name": lines[2].strip() or None,
        "coordinates": station_place(site, event),
        "event": event,
        "instrument": {
            "model": model or None,
            "serial": serial or None,
            **sensor_constants(lines[4]),
        },
    }


def _origin_time(origin: re.Match[str] | None) -> UTCDateTime | None:
    """Return the origin time, UTC; None where it is no time."""
    month = MONTHS.get(origin[2][:3].upper()) if origin else None
    if origin is None or month is None:
        return None
    # A day or clock that does not exist is no time
    words = f"{origin[1]}-{month:02d}-{int(origin[3]):02d}T{origin[4]}"
    try:
        return UTCDateTime(datetime.fromisoformat(words).replace(tzinfo=UTC))
    except ValueError:
        return None
