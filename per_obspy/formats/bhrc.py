"""BHRC (Iran): volume 1, uncorrected, g/10, three components a file."""

import re
from typing import Any

from obspy import Stream, Trace, UTCDateTime

from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    block_lines,
    count,
    fixed_block,
    head,
    interval,
    line_at,
    number,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import coordinates, hemisphere, horizontal, trace, utc

_TITLE = "* VOL1DS FILE:"
_HEADER_LINES, _RATE_LINE = 27, 21
_WIDTH, _PER_LINE = 13, 10
_STATION = re.compile(
    rf"(.*?)\s+Station\s+{DECIMAL}\s*([NS])\s*{DECIMAL}\s*([EW])(?:\s+Altitude\s*{DECIMAL})?"
)
_AZIMUTH = re.compile(r"\b([LT])\s*(\d{1,3})\b")
_EPICENTRE = re.compile(
    rf"Epicenter\s+{DECIMAL}\s*([NS])\s*{DECIMAL}\s*([EW])(?:\s+FD\s*{DECIMAL})?"
)
_MAGNITUDE = re.compile(rf"\b(Mw|Ms|mb|ML|M)\s*{DECIMAL}")
_TIME = re.compile(
    rf"Origin Time\s*:\s*(\d{{4}})/(\d{{1,2}})/(\d{{1,2}})\s+(\d{{1,2}}):(\d{{1,2}}):{DECIMAL}"
)
_POINTS = re.compile(rf"NO\. OF POINTS\s*=\s*(\S+)\s+DURATION\s*=\s*{DECIMAL}")
_SENSOR = re.compile(rf"INSTR PERIOD\s*=\s*{DECIMAL}\s*SEC\s+DAMPING\s*=\s*{DECIMAL}")


def is_bhrc(file: WaveformFile) -> bool:
    """Tell whether a file starts like volume 1 of BHRC."""
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
    line_at(text, first + _HEADER_LINES, "samples")
    lines = text.lines[first : first + _HEADER_LINES]
    if not lines[0].startswith(_TITLE):
        refuse(text, first, "title", f"{lines[0].strip()[:40]!r} is not that of a component")
    if not lines[11].upper().strip().endswith("G/10"):
        refuse(text, first + 11, "unit", f"{lines[11].strip()!r} is not g/10")
    samples, dt = _size(text, first)
    line = first + _HEADER_LINES
    values = STANDARD_GRAVITY / 10 * fixed_block(text, line, samples, _WIDTH, _PER_LINE)
    line += block_lines(samples, _PER_LINE)
    if line_at(text, line, "end of component").strip() != "/&":
        refuse(
            text,
            line,
            "end of component",
            f"expected '/&' after the samples, got {text.lines[line].strip()[:40]!r}",
        )
    words = {"units": "m/s2", "quantity": "acceleration", "processing_level": "raw"}
    return trace(
        values, dt, words | _station(lines) | {"event": _event(text, first, lines)}
    ), line + 1


def _size(text: Text, first: int) -> tuple[int, float]:
    """Return samples and interval; the rate must fit the duration."""
    points = _POINTS.match(text.lines[first + 10].strip())
    if points is None:
        refuse(
            text, first + 10, "number of points", f"{text.lines[first + 10].strip()!r} gives none"
        )
    samples = count(text, first + 10, "number of points", points[1])
    rate = number(
        text, first + _RATE_LINE, "sampling rate", text.lines[first + _RATE_LINE][:_WIDTH]
    )
    if rate <= 0 or abs(samples / rate - float(points[2])) > 0.01 * float(points[2]):
        refuse(
            text,
            first + _RATE_LINE,
            "sampling rate",
            f"{rate:g} Hz, but {samples} samples last {points[2]} s",
        )
    return samples, 1 / interval(text, first + _RATE_LINE, "sampling rate", rate)


def _station(lines: list[str]) -> dict[str, Any]:
    station, sensor = _STATION.match(lines[7]), _SENSOR.match(lines[9])
    component = lines[6].removeprefix("COMP").strip()[:1].upper()
    azimuths = {
        letter: float(azimuth)
        for letter, azimuth in _AZIMUTH.findall(lines[7].partition("Azimuth")[2])
    }
    direction = {"sensor_dip": -90.0} if component == "V" else {}
    period = float(sensor[1]) if sensor else 0.0
    return {
        "station": re.sub(r"[^A-Z0-9]", "", station[1].upper()) if station else None,
        "station_name": station[1] if station else None,
        "coordinates": _place(station),
        "instrument": {
            "model": lines[1].partition("=")[2].strip() or None,
            "natural_frequency": 1 / period if period > 0 else None,
            "damping": float(sensor[2]) if sensor else None,
        },
    } | (horizontal(azimuths[component]) if component in azimuths else direction)


def _place(found: re.Match[str] | None) -> dict[str, float | None]:
    if found is None:
        return {}
    elevation = float(found[6]) if found[6] else None
    return coordinates(hemisphere(found[2], found[3]), hemisphere(found[4], found[5]), elevation)


def _event(text: Text, first: int, lines: list[str]) -> dict[str, Any]:
    place, time = _EPICENTRE.match(lines[8]), _TIME.match(lines[2])
    magnitudes = {kind: float(size) for kind, size in _MAGNITUDE.findall(lines[8])}
    return {
        "time": _origin(text, first + 2, time) if time else None,
        "latitude": hemisphere(place[1], place[2]) if place else None,
        "longitude": hemisphere(place[3], place[4]) if place else None,
        "depth": 1000 * float(place[5]) if place and place[5] else None,
        "magnitude": magnitudes.get("Mw", next(iter(magnitudes.values()), None)),
    }


def _origin(text: Text, line: int, time: re.Match[str]) -> UTCDateTime:
    year, month, day, hour, minute = (int(part) for part in time.groups()[:5])
    return utc(text, line, "origin time", (year, month, day), (hour, minute, float(time[6])))
