"""GeoNet (New Zealand): V1A (uncorrected) and V2A (corrected), three components per file."""

import re
from datetime import UTC, datetime
from typing import Any

from obspy import Stream, Trace, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.formats.text.conversions import MONTHS, metres, sexagesimal, utc
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
    quoted,
    read_text,
    refuse,
)
from per_obspy.formats.text.places import Angle, epicentre_place, station_place
from per_obspy.formats.text.vocabulary import (
    channel_code,
    corners,
    orientation,
    sensor_constants,
    trace,
)

_TEXT_LINES, _INTEGER_LINES, _HEADER_LINES = 16, 4, 26
_INTEGERS, _REALS = 40, 60
_POINTS_LINE, _UNIT_LINE = 9, 10
_WIDTH, _PER_LINE = 8, 10
_TITLE = re.compile(r"(Uncorrected|Corrected) accelerogram \S+_(\w+)_(\w++)\b")
_ANGLE = r"(\d{1,3})\s++(\d{1,2})\s++(\d{1,2})([NSEW])"
_SITE = re.compile(rf"Site (\S++)\s++{_ANGLE}\s++{_ANGLE}")
_EPICENTRE = re.compile(rf"Epicentre\s++{_ANGLE}\s++{_ANGLE}")
_ORIGIN = re.compile(
    r"(\d{4})\s++([A-Za-z]{3,9})\s++(\d{1,2})\s++(\d{2}:\d{2}:\d{2}(?:\.\d{1,6})?)\s++UT"
)
_DEPTH = re.compile(rf"Depth\s*+{DECIMAL}\s*+km")
_MAGNITUDE = re.compile(rf"\sM\w?\s*+{DECIMAL}")
_POINTS = re.compile(r"Number of points\s++(\S+)")
_UNIT = re.compile(rf"units of {DECIMAL} mm/s/s")
_PEAK = re.compile(rf"Acceleration:\s*+peak\s*+{DECIMAL}\s*+mm/s/s", re.IGNORECASE)
_BANDS = re.compile(rf"bands are {DECIMAL}-{DECIMAL} Hz and {DECIMAL}-{DECIMAL} Hz")
_SENSOR = re.compile(rf"Instr Period:\s*+{DECIMAL}\s*+s\s++Damping:\s*+{DECIMAL}")
_MILLIMETRE = 0.001  # m


def is_geonet(file: WaveformFile) -> bool:
    """Check whether a file starts like GeoNet V1A or V2A."""
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
    """Return a component and the line after it."""
    line_at(text, first + _HEADER_LINES, "samples")
    state, instrument = _title(text, first)
    # Integers and reals of the header
    numbers = first + _TEXT_LINES
    integers = fixed_block(text, numbers, _INTEGERS, _WIDTH, _PER_LINE)
    reals = fixed_block(text, numbers + _INTEGER_LINES, _REALS, _WIDTH, _PER_LINE)
    dt = interval(text, numbers + _INTEGER_LINES + 2, "interval", float(reals[25]))
    values, line = _samples(text, first, integers)
    # Words of the header
    words = _station(text, first) | _described(text.lines[first : first + _TEXT_LINES])
    words["starttime"] = _start(text, numbers, integers)
    words |= {"units": "m/s2", "quantity": "acceleration"}
    words["processing_level"] = "raw" if state == "Uncorrected" else "processed"
    words["location"] = instrument
    words["channel"] = channel_code(1 / dt, words)
    return trace(_unit(text, first, state) * values, dt, words), line


def _title(text: Text, line: int) -> tuple[str, str]:
    """Return state (Uncorrected, ...) and instrument, the last part of the name in the title."""
    title = _TITLE.match(text.lines[line])
    if title is None:
        refuse(text, line, "title", f"{quoted(text, line, 60)} is not that of a component")
    return title[1], title[3]


def _samples(text: Text, first: int, integers: FloatArray) -> tuple[FloatArray, int]:
    """
    Return acceleration and the line after the component.

    Velocity and displacement follow in V2A and must be whole.
    """
    samples = _promised_samples(text, first + _POINTS_LINE)
    sizes = [int(size) for size in integers[33:36]]
    if sizes[0] != samples:
        problem = f"{sizes[0]}, but {samples} on line {first + _POINTS_LINE + 1}"
        refuse(text, first + _TEXT_LINES + 3, "number of points", problem)
    # Blocks of acceleration, velocity and displacement, of which V1A has the first
    line = first + _HEADER_LINES
    blocks = []
    for size in sizes:
        if size > 0:
            blocks.append(fixed_block(text, line, size, _WIDTH, _PER_LINE))
            line += block_lines(size, _PER_LINE)
    return blocks[0], line


def _promised_samples(text: Text, line: int) -> int:
    """Return the number of samples in the text of the header."""
    promised = _POINTS.search(text.lines[line])
    if promised is None:
        refuse(text, line, "number of points", f"{quoted(text, line)} gives none")
    return count(text, line, "number of points", promised[1])


def _unit(text: Text, first: int, state: str) -> float:
    """Return the unit of the samples, m/s2."""
    if state == "Corrected":
        return _MILLIMETRE
    line = first + _UNIT_LINE
    unit = _UNIT.search(text.lines[line])
    if unit is None:
        refuse(text, line, "unit", f"{quoted(text, line)} names no multiple of mm/s/s")
    return float(unit[1]) * _MILLIMETRE


def _angles(parts: tuple[str, ...]) -> tuple[Angle, Angle]:
    """Return latitude and longitude; the numeric header lacks the sign of southern latitudes."""
    return Angle(sexagesimal(*parts[:3]), parts[3]), Angle(sexagesimal(*parts[4:7]), parts[7])


def _station(text: Text, first: int) -> dict[str, Any]:
    """Return codes, name and coordinates of the station."""
    line = first + 1
    site = _SITE.match(text.lines[line])
    if site is None:
        refuse(text, line, "site", f"{quoted(text, line)} has no code and coordinates")
    # Its groups are the code, then four parts of each angle
    epicentre = _event(text.lines[first : first + _TEXT_LINES])
    return {
        "network": "NZ",
        "station": site[1],
        "coordinates": station_place(*_angles(site.groups()[1:9]), epicentre),
        "station_name": text.lines[first + 2].strip() or None,
    }


def _described(lines: list[str]) -> dict[str, Any]:
    """Return event, instrument, corners, peak and direction, as far as the text has them."""
    peak = _PEAK.match(lines[13])
    # The corners lie where the transition bands end: inside the pass band
    words = {
        "event": _event(lines),
        "instrument": _instrument(lines),
        "corners": corners(_BANDS.search(lines[11]), 2),
        "header_peak": abs(float(peak[1])) * _MILLIMETRE if peak else None,
    }
    direction = lines[12].removeprefix("Component").split("  ")[0]
    return words | orientation(direction)


def _event(lines: list[str]) -> dict[str, Any]:
    """Return name, hypocentre and magnitude of the event."""
    epicentre, origin = _EPICENTRE.match(lines[8]), _ORIGIN.match(lines[7])
    depth, magnitude = (pattern.search(lines[8]) for pattern in (_DEPTH, _MAGNITUDE))
    # Groups: four parts of each angle; depth in km
    place = epicentre_place(*_angles(epicentre.groups(""))) if epicentre else {}
    return {
        "name": lines[6].strip() or None,
        "time": _origin_time(origin) if origin else None,
        "latitude": place.get("latitude"),
        "longitude": place.get("longitude"),
        "depth": metres(float(depth[1])) if depth else None,
        "magnitude": float(magnitude[1]) if magnitude else None,
    }


def _origin_time(found: re.Match[str]) -> UTCDateTime | None:
    """Return the origin time, UTC; None where it is no time."""
    month = found[2][:3].upper()
    if month not in MONTHS:
        return None
    # A day or clock that does not exist is no time
    words = f"{found[1]}-{MONTHS.index(month) + 1:02d}-{int(found[3]):02d}T{found[4]}"
    try:
        return UTCDateTime(datetime.fromisoformat(words).replace(tzinfo=UTC))
    except ValueError:
        return None


def _instrument(lines: list[str]) -> dict[str, Any]:
    """Return model, serial number and constants of the instrument."""
    model, _, serial = lines[3].removeprefix("Instrument").strip().partition("_")
    constants = sensor_constants(_SENSOR.search(lines[4]))
    return {"model": model or None, "serial": serial or None, **constants}


def _start(text: Text, line: int, integers: FloatArray) -> UTCDateTime:
    """Return the time of the first sample."""
    # The parts of the time are at three places among the integers
    year, month = int(integers[8]), int(integers[9])
    day, hour = int(integers[18]), int(integers[19])
    minute, milliseconds = int(integers[38]), int(integers[39])
    return utc(text, line, "start", (year, month, day), (hour, minute, milliseconds / 1000))
