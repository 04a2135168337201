"""BHRC (Iran): volume 1, uncorrected, g/10, three components per file."""

import re
from typing import Any

from obspy import Stream, Trace

from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.formats.text.header import (
    CLOCK,
    epicentre_place,
    header_time,
    moment_first,
    number_in,
    place_pattern,
    scale,
    station_place,
    word_in,
)
from per_obspy.formats.text.lines import (
    DECIMAL,
    NUMBER,
    Text,
    WaveformFile,
    block_lines,
    count,
    fixed_block,
    head,
    interval,
    line_at,
    match_line,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import Words, horizontal, read_components, trace
from per_obspy.formats.text.volumes import sensor_constants

_TITLE = re.compile(r"^\* VOL1DS FILE:")
_HEADER_LINES, _POINTS_LINE, _UNIT_LINE, _RATE_LINE = 27, 10, 11, 21
_WIDTH, _PER_LINE = 13, 10
_PLACE = place_pattern(NUMBER, r"\s*+")
_STATION = re.compile(rf"(.*?)\s++Station\s++{_PLACE}(?:\s++Altitude\s*+(?P<elevation>{NUMBER}))?")
_AZIMUTH = re.compile(r"\b([LT])\s*+(\d{1,3})\b")
_EPICENTRE = re.compile(rf"Epicenter\s++{_PLACE}(?:\s++FD\s*+(?P<depth>{NUMBER}))?")
_MAGNITUDE = re.compile(rf"\b(Mw|Ms|mb|ML|M)\s*+{DECIMAL}")
_TIME = re.compile(
    rf"Origin Time\s*+:\s*+(?P<year>\d{{4}})/(?P<month>\d{{1,2}})/(?P<day>\d{{1,2}})\s++{CLOCK}"
)
_POINTS = re.compile(rf"^\s*+NO\. OF POINTS\s*+=\s*+(\S+)\s++DURATION\s*+=\s*+{DECIMAL}")
_UNIT = re.compile(r"G/10\s*$", re.IGNORECASE)
_END = re.compile(r"^\s*/&\s*$")


def is_bhrc(file: WaveformFile) -> bool:
    """Check whether a file starts like volume 1 of BHRC."""
    return head(file, 14) == b"* VOL1DS FILE:"


def read_bhrc(file: WaveformFile, **_unused: Any) -> Stream:
    """Read volume 1 of BHRC: uncorrected acceleration of all components, m/s2."""
    return read_components(read_text(file), _component)


def _component(text: Text, first: int) -> tuple[Trace, int]:
    """Return a component and the line after it."""
    start = first + _HEADER_LINES
    line_at(text, start, "samples")
    match_line(text, first, "title", _TITLE, "{} is not that of a component")
    match_line(text, first + _UNIT_LINE, "unit", _UNIT, "{} is not g/10")
    samples, dt = _size(text, first)
    values = STANDARD_GRAVITY / 10 * fixed_block(text, start, samples, _WIDTH, _PER_LINE)
    end = start + block_lines(samples, _PER_LINE)
    match_line(text, end, "end of component", _END, "expected '/&' after the samples, got {}")
    # Words of the header
    lines = text.lines[first:start]
    event = _event(text, first, lines)
    words = _station(lines, event) | {"event": event, "processing_level": "raw"}
    return trace(values, dt, words), end + 1


def _size(text: Text, first: int) -> tuple[int, float]:
    """Return the number of samples and their interval, s; the rate must fit the duration."""
    points = match_line(text, first + _POINTS_LINE, "number of points", _POINTS)
    samples = count(text, first + _POINTS_LINE, "number of points", points[1])
    # The rate is on a separate line among the numbers
    line = first + _RATE_LINE
    rate = interval(text, line, "sampling rate", text.lines[line][:_WIDTH])
    duration = float(points[2])
    if abs(samples / rate - duration) > 0.01 * duration:
        problem = f"{rate:g} Hz, but {samples} samples last {points[2]} s"
        refuse(text, line, "sampling rate", problem)
    return samples, 1 / rate


def _station(lines: list[str], epicentre: Words) -> Words:
    """Return code, name, coordinates, instrument and direction of a component."""
    station = _STATION.match(lines[7])
    name = word_in(station)
    azimuths = dict(_AZIMUTH.findall(lines[7].partition("Azimuth")[2]))
    # L and T have azimuths, V is vertical
    component = lines[6].removeprefix("COMP").strip()[:1].upper()
    direction = {"sensor_dip": -90.0} if component == "V" else {}
    if component in azimuths:
        direction = horizontal(float(azimuths[component]))
    # The code is made from the name
    return {
        "station": re.sub(r"[^A-Z0-9]", "", (name or "").upper()),
        "station_name": name,
        "coordinates": station_place(station, epicentre, number_in(station, "elevation")),
        "instrument": {
            "model": lines[1].partition("=")[2].strip() or None,
            **sensor_constants(lines[9]),
        },
        **direction,
    }


def _event(text: Text, first: int, lines: list[str]) -> Words:
    """Return origin time, hypocentre and magnitude (moment, or else the first) of the event."""
    epicentre = _EPICENTRE.match(lines[8])
    return {
        "time": header_time(text, first + 2, "origin time", _TIME.match(lines[2])),
        **epicentre_place(epicentre),
        "depth": scale(number_in(epicentre, "depth"), 1000),
        "magnitude": moment_first(_MAGNITUDE.findall(lines[8])),
    }
