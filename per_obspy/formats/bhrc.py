"""BHRC (Iran): volume 1, uncorrected, g/10, three components per file."""

import re
from typing import Any

from obspy import Stream, Trace, UTCDateTime

from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.formats.text.conversions import metres, utc_from_words
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    block_lines,
    count,
    finite_number,
    fixed_block,
    head,
    interval,
    line_at,
    quoted,
    read_text,
    refuse,
)
from per_obspy.formats.text.places import decimal_angles, epicentre_place, station_place
from per_obspy.formats.text.vocabulary import horizontal, sensor_constants, trace

_TITLE = "* VOL1DS FILE:"
_HEADER_LINES, _POINTS_LINE, _UNIT_LINE, _RATE_LINE = 27, 10, 11, 21
_WIDTH, _PER_LINE = 13, 10
_STATION = re.compile(
    rf"(.*?)\s++Station\s++{DECIMAL}\s*+([NSEW])\s*+{DECIMAL}\s*+([NSEW])"
    rf"(?:\s++Altitude\s*+{DECIMAL})?"
)
_AZIMUTH = re.compile(r"\b([LT])\s*+(\d{1,3})\b")
_EPICENTRE = re.compile(
    rf"Epicenter\s++{DECIMAL}\s*+([NSEW])\s*+{DECIMAL}\s*+([NSEW])(?:\s++FD\s*+{DECIMAL})?"
)
_MAGNITUDE = re.compile(rf"\b(Mw|Ms|mb|ML|M)\s*+{DECIMAL}")
_TIME = re.compile(
    rf"Origin Time\s*+:\s*+(\d{{4}})/(\d{{1,2}})/(\d{{1,2}})\s++(\d{{1,2}}):(\d{{1,2}}):{DECIMAL}"
)
_POINTS = re.compile(rf"NO\. OF POINTS\s*+=\s*+(\S+)\s++DURATION\s*+=\s*+{DECIMAL}")
_SENSOR = re.compile(rf"INSTR PERIOD\s*+=\s*+{DECIMAL}\s*+SEC\s++DAMPING\s*+=\s*+{DECIMAL}")


def is_bhrc(file: WaveformFile) -> bool:
    """Check whether a file starts like volume 1 of BHRC."""
    return head(file, len(_TITLE)) == _TITLE.encode()


def read_bhrc(file: WaveformFile, **_unused: Any) -> Stream:
    """Read volume 1 of BHRC: uncorrected acceleration of all components, m/s2."""
    text = read_text(file)
    stream, line = Stream(), 0
    while line < len(text.lines):
        component, line = _component(text, line)
        stream.append(component)
    return stream


def _component(text: Text, first: int) -> tuple[Trace, int]:
    """Return a component and the line after it."""
    line_at(text, first + _HEADER_LINES, "samples")
    lines = text.lines[first : first + _HEADER_LINES]
    _check_title_and_unit(text, first)
    # Samples, in g/10
    samples, dt = _size(text, first)
    start = first + _HEADER_LINES
    values = STANDARD_GRAVITY / 10 * fixed_block(text, start, samples, _WIDTH, _PER_LINE)
    end = start + block_lines(samples, _PER_LINE)
    _check_end(text, end)
    # Words of the header
    words = {"units": "m/s2", "quantity": "acceleration", "processing_level": "raw"}
    event = _event(text, first, lines)
    words |= _station(lines, event) | {"event": event}
    return trace(values, dt, words), end + 1


def _check_title_and_unit(text: Text, first: int) -> None:
    """Refuse a component without its title, or in another unit than g/10."""
    if not text.lines[first].startswith(_TITLE):
        refuse(text, first, "title", f"{quoted(text, first, 40)} is not that of a component")
    unit = first + _UNIT_LINE
    if not text.lines[unit].upper().strip().endswith("G/10"):
        refuse(text, unit, "unit", f"{quoted(text, unit)} is not g/10")


def _check_end(text: Text, line: int) -> None:
    """Refuse a component that does not end after its samples."""
    if line_at(text, line, "end of component").strip() != "/&":
        problem = f"expected '/&' after the samples, got {quoted(text, line, 40)}"
        refuse(text, line, "end of component", problem)


def _size(text: Text, first: int) -> tuple[int, float]:
    """Return the number of samples and their interval, s; the rate must fit the duration."""
    line = first + _POINTS_LINE
    points = _POINTS.match(text.lines[line].strip())
    if points is None:
        refuse(text, line, "number of points", f"{quoted(text, line)} gives none")
    samples = count(text, line, "number of points", points[1])
    # The rate is on a separate line among the numbers
    line = first + _RATE_LINE
    rate = finite_number(text, line, "sampling rate", text.lines[line][:_WIDTH])
    duration = float(points[2])
    if rate <= 0 or abs(samples / rate - duration) > 0.01 * duration:
        problem = f"{rate:g} Hz, but {samples} samples last {points[2]} s"
        refuse(text, line, "sampling rate", problem)
    return samples, 1 / interval(text, line, "sampling rate", rate)


def _station(lines: list[str], epicentre: dict[str, Any]) -> dict[str, Any]:
    """Return code, name, coordinates, instrument and direction of a component."""
    station = _STATION.match(lines[7])
    name = station[1] if station else None
    # The model is on a separate line
    instrument = {
        "model": lines[1].partition("=")[2].strip() or None,
        **sensor_constants(_SENSOR.match(lines[9])),
    }
    words = {
        "station": re.sub(r"[^A-Z0-9]", "", name.upper()) if name is not None else None,
        "station_name": name,
        "coordinates": _place(station, epicentre),
        "instrument": instrument,
    }
    return words | _direction(lines)


def _direction(lines: list[str]) -> dict[str, float]:
    """Return the direction of a component: L and T have azimuths, V is vertical."""
    component = lines[6].removeprefix("COMP").strip()[:1].upper()
    azimuths = dict(_AZIMUTH.findall(lines[7].partition("Azimuth")[2]))
    if component in azimuths:
        return horizontal(float(azimuths[component]))
    return {"sensor_dip": -90.0} if component == "V" else {}


def _place(found: re.Match[str] | None, epicentre: dict[str, Any]) -> dict[str, Any]:
    """Return the coordinates of the station, degrees and m."""
    if found is None:
        return {}
    elevation = float(found[6]) if found[6] else None
    return station_place(*decimal_angles(found, 2), epicentre, elevation)


def _event(text: Text, first: int, lines: list[str]) -> dict[str, Any]:
    """Return origin time, hypocentre and magnitude (moment, or else the first) of the event."""
    epicentre = _EPICENTRE.match(lines[8])
    place = epicentre_place(*decimal_angles(epicentre)) if epicentre else {}
    depth = float(epicentre[5]) if epicentre and epicentre[5] else None
    # Kinds of magnitude in the order of the line
    magnitudes = {kind: float(size) for kind, size in _MAGNITUDE.findall(lines[8])}
    return {
        "time": _origin(text, first + 2, _TIME.match(lines[2])),
        "latitude": place.get("latitude"),
        "longitude": place.get("longitude"),
        "depth": metres(depth),
        "magnitude": magnitudes.get("Mw", next(iter(magnitudes.values()), None)),
    }


def _origin(text: Text, line: int, time: re.Match[str] | None) -> UTCDateTime | None:
    """Return the origin time; None where the header has none."""
    return utc_from_words(text, line, "origin time", time.groups()) if time else None
