"""The thirteen header lines that CSMIP (CGS, formerly CDMG) began and RENADIC took over."""

import re
from re import Match
from typing import Any, NamedTuple

from obspy import UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.formats.text.conversions import MONTHS, full_year, metres, utc
from per_obspy.formats.text.lines import DECIMAL, Text, block_lines, fixed_block, line_at, refuse
from per_obspy.formats.text.places import decimal_angles, epicentre_place, station_place
from per_obspy.formats.text.vocabulary import (
    channel_code,
    orientation,
    sensor_constants,
)

_HEADER_LINES = 13
_INTEGER_LINES = 7  # 100 integers, 16 a line; all their values are in the text too
_RECORD_OF = ("RECORD OF", "RCRD OF")
_UNKNOWN = (-999.0, 0.0)

# Line 4 (from 0): station number, coordinates, recorder, channels
_LETTER = "([NSEW])"
_SITE = re.compile(
    rf"STATION (?:NO|ID)\.\s*+(\S*?)\s++{DECIMAL}\s*+{_LETTER}[,\s]\s*+{DECIMAL}\s*+{_LETTER}"
)
_MODEL = re.compile(r"[NSEW][,\s]\s*+[\d.]++\s*+[NSEW]\s++(\S.{0,80}?)\s*+S/N\s*+(\w*+)")
_CHANNELS = re.compile(r"\(\s*+(\d{1,3})\s*+CHNS OF\s*+(\d{1,3})")

# Lines 5, 6, 9: agency; channel and direction; instrument
_AGENCIES = re.compile(r"\b(CGS|CDMG|CSMIP)\b")
_CHANNEL = re.compile(
    r"CHAN\s*+(\d{1,3}):\s*+(.*?)\s*+(?:\(STA CHN:\s*+(\d{1,3})\)\s*+)?(?:LOCATION:\s*+(.*+))?"
)
_CONSTANTS = re.compile(rf"INSTR PERIOD\s*+=\s*+{DECIMAL}\s*+SEC,\s*+DAMPING\s*+=\s*+{DECIMAL}")
_SENSITIVITY = re.compile(rf"SENSITIVITY\s*+=\s*+{DECIMAL}\s*+V(?:DC)?/G")

# Line 3: SEED names and start; lines 1 and 2: time of the record and of the origin
_SEED = re.compile(r"[^.]*\.([A-Z0-9]{1,2})\.([A-Z0-9]{1,5})\.\S\S\.H")
_CLOCK = (
    r"(\d{1,2})/\s*+(\d{1,2})/\s*+(\d{1,4}),?\s++"
    rf"(\d{{1,2}}):\s*+(\d{{1,2}}):\s*+{DECIMAL}\s*+([A-Z]++)"
)
_START = re.compile(rf"(?:START|TRIGGER) TIME:\s*+{_CLOCK}")
_ORIGIN = re.compile(rf"ORIGIN[^:]*+:\s*+{_CLOCK}")
_RECORDED = re.compile(
    r"\b([A-Z]{3})[A-Z]*+\s++(\d{1,2}),\s++(\d{4})\s++"
    rf"(\d{{1,2}}):(\d{{1,2}})(?::{DECIMAL})?\s++([A-Z]++)"
)

# Line 8: hypocentre
_EPICENTRE = re.compile(rf"{DECIMAL}\s*+{_LETTER}[,\s]\s*+{DECIMAL}\s*+{_LETTER}")
_DEPTH = re.compile(rf"\bH=\s*+{DECIMAL}\s*+KM")
_MAGNITUDE = re.compile(rf"\b(M[A-Z]?)=?\s*+{DECIMAL}")

#: time zone -> hours ahead of UTC
_ZONES = {
    "UTC": 0,
    "GMT": 0,
    "UT": 0,
    "PST": -8,
    "PDT": -7,
    "MST": -7,
    "MDT": -6,
    "AKST": -9,
    "AKDT": -8,
    "HST": -10,
}

#: date of instruments without a clock
_NO_CLOCK = (1980, 1, 1)


class Header(NamedTuple):
    """
    The header of one channel.

    Attributes
    ----------
    words : dict
        In the vocabulary of ``formats/text/vocabulary.py``.
    channel : int
        Number in the file.
    reals : (n_reals,) ndarray
        Real numbers of the header.
    next_line : int
        Line after the header.
    """

    words: dict[str, Any]
    channel: int
    reals: FloatArray
    next_line: int


def read_header(text: Text, first: int, text_lines: int, reals: int) -> Header:
    """
    Read the header of one channel.

    Parameters
    ----------
    text : Text
        The file.
    first : int
        Line of the first of the thirteen common lines.
    text_lines, reals : int
        Lines of text from there to the integers, real numbers after those.
    """
    line_at(text, first + _HEADER_LINES - 1, "header")
    lines = [line.upper() for line in text.lines[first : first + _HEADER_LINES]]
    channel = _CHANNEL.fullmatch(lines[6].strip())
    if channel is None:
        refuse(text, first + 6, "channel", f"{lines[6].strip()!r} names no channel")
    numbers = first + text_lines + _INTEGER_LINES
    line_at(text, numbers, "header numbers")
    # Words of the thirteen lines of text, then the real numbers
    words = _words(text, first, lines, channel)
    values = fixed_block(text, numbers, reals, 10, 8)
    return Header(words, int(channel[1]), values, numbers + block_lines(reals, 8))


def _words(text: Text, first: int, lines: list[str], channel: Match[str]) -> dict[str, Any]:
    """Return the words of the thirteen lines of text, in capitals."""
    event = _event(text, first, lines)
    words = _station(lines, event) | {"instrument": _instrument(lines), "event": event}
    words |= orientation(channel[2])
    # Place of the sensor, times, and the location code that separates instruments
    words["sensor_location"] = channel[4] or None
    words["starttime"] = _start(text, first, lines)
    words["location"] = _location(lines[4], int(channel[1]), int(channel[3] or channel[1]))
    return words


def _location(site: str, channel: int, station_channel: int) -> str | None:
    """
    Return a location code that separates the instruments of one station.

    The components of an instrument share it: a recorder of three channels is named by its first
    one; a recorder that serves sensors all over a structure gives each a number.
    """
    channels = _CHANNELS.search(site)
    recorder, station = (int(channels[1]), int(channels[2])) if channels else (0, 0)
    if station <= 4 and recorder == station:
        return None
    return f"{station_channel - channel + 1 if recorder <= 3 else station_channel:02d}"


def known(value: float, factor: float = 1.0) -> float | None:
    """Return a real number of the header in SI, or None where it is a mark for unknown."""
    return None if value in _UNKNOWN else float(value) * factor


def channel_name(header: Header, dt: float) -> str:
    """Return the SEED channel code; channels without an azimuth are numbered as in the file."""
    code = channel_code(1 / dt, header.words)
    return (
        f"{code[:2]}{header.channel % 10}" if len(code) < 3 or "direction" in header.words else code
    )


def _station(lines: list[str], epicentre: dict[str, Any]) -> dict[str, Any]:
    """Return codes, name and coordinates of the station."""
    site = _SITE.match(lines[4].strip())
    name, *owner = re.split(r"\s{2,}|\s+S/N", lines[5].strip())
    # SEED names where the header has them, else the agency's number or the name of the place
    if seed := _SEED.match(lines[3]):
        network, code = seed[1], seed[2]
    else:
        network = "CE" if _AGENCIES.search(owner[0] if owner else lines[0]) else ""
        number = site[1] if site else ""
        code = number or re.sub(r"[^A-Z0-9]", "", name)
    return {
        "network": network,
        "station": code,
        "station_name": name or None,
        "coordinates": station_place(*decimal_angles(site, 2), epicentre) if site else {},
    }


def _instrument(lines: list[str]) -> dict[str, Any]:
    """Return model, serial number and constants of the instrument."""
    model = _MODEL.search(lines[4])
    sensitivity = _SENSITIVITY.search(lines[9])
    return {
        "model": model[1] if model else None,
        "serial": model[2] if model else None,
        **sensor_constants(_CONSTANTS.search(lines[9])),
        "sensitivity": float(sensitivity[1]) / STANDARD_GRAVITY if sensitivity else None,
    }


def _start(text: Text, first: int, lines: list[str]) -> UTCDateTime | None:
    """Return the start of the record, or else the time in the title ``RECORD OF``."""
    if start := _START.search(lines[3]):
        return _moment(text, first + 3, start)
    recorded = _RECORDED.search(lines[1])
    if recorded is None or not lines[1].startswith(_RECORD_OF):
        return None
    month, day, year, hour, minute, second, zone = recorded.groups()
    if month not in MONTHS or zone not in _ZONES:
        return None
    # Months are names here, and seconds may be missing
    date = (int(year), MONTHS.index(month) + 1, int(day))
    clock = (float(hour), float(minute), float(second or 0))
    return utc(text, first + 1, "time", date, clock, _ZONES[zone])


def _moment(text: Text, line: int, found: Match[str]) -> UTCDateTime | None:
    """Return the time of a clock; None where it was not set or its zone is unknown."""
    month, day, year, hour, minute, second, zone = found.groups()
    date = (full_year(year), int(month), int(day))
    if date == _NO_CLOCK or zone not in _ZONES:
        return None
    return utc(text, line, "time", date, (float(hour), float(minute), float(second)), _ZONES[zone])


def _event(text: Text, first: int, lines: list[str]) -> dict[str, Any]:
    """Return name, origin time, hypocentre and magnitude of the event."""
    origin = _ORIGIN.search(lines[2])
    found = _EPICENTRE.search(lines[8])
    epicentre = epicentre_place(*decimal_angles(found)) if found else {}
    depth = _DEPTH.search(lines[8])
    named = not lines[1].startswith(_RECORD_OF)
    # A depth without an epicentre is a mark for unknown
    return {
        "name": lines[1].strip() if named else None,
        "time": _moment(text, first + 2, origin) if origin else None,
        "latitude": epicentre.get("latitude"),
        "longitude": epicentre.get("longitude"),
        "depth": metres(float(depth[1])) if depth and epicentre else None,
        "magnitude": _magnitude(lines[8]),
    }


def _magnitude(hypocentre: str) -> float | None:
    """Return the moment magnitude, or else the first that is above zero."""
    magnitudes = {}
    for kind, value in _MAGNITUDE.findall(hypocentre):
        if float(value) > 0:
            magnitudes[kind] = float(value)
    return magnitudes.get("MW", next(iter(magnitudes.values()), None))
