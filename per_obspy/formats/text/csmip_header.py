"""The thirteen header lines that CSMIP (CGS, formerly CDMG) began and RENADIC took over."""

import re
from typing import Any, NamedTuple

from obspy import UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.formats.text.lines import DECIMAL, Text, block_lines, fixed_block, line_at, refuse
from per_obspy.formats.text.vocabulary import (
    channel_code,
    coordinates,
    full_year,
    hemisphere,
    orientation,
    utc,
)

_HEADER_LINES = 13
_INTEGER_LINES = 7  # 100 integers, 16 a line; everything in them is said elsewhere too
_RECORD_OF = ("RECORD OF", "RCRD OF")
_UNKNOWN = (-999.0, 0.0)

_SITE = re.compile(rf"STATION (?:NO|ID)\.\s*(\S*?)\s+{DECIMAL}\s*([NS])[,\s]\s*{DECIMAL}\s*([EW])")
_MODEL = re.compile(r"[NS][,\s]\s*[\d.]+\s*[EW]\s+(\S.*?)\s*S/N\s*(\w*)")
_CHANNELS = re.compile(r"\(\s*(\d{1,3})\s*CHNS OF\s*(\d{1,3})")
_CONSTANTS = re.compile(rf"INSTR PERIOD\s*=\s*{DECIMAL}\s*SEC,\s*DAMPING\s*=\s*{DECIMAL}")
_SENSITIVITY = re.compile(rf"SENSITIVITY\s*=\s*{DECIMAL}\s*V(?:DC)?/G")
_CHANNEL = re.compile(
    r"CHAN\s*(\d{1,3}):\s*(.*?)\s*(?:\(STA CHN:\s*(\d{1,3})\)\s*)?(?:LOCATION:\s*(.*))?"
)
_SEED = re.compile(r"[^.]*\.([A-Z0-9]{1,2})\.([A-Z0-9]{1,5})\.\S\S\.H")
_AGENCIES = re.compile(r"\b(CGS|CDMG|CSMIP)\b")

_CLOCK = rf"(\d{{1,2}})/\s*(\d{{1,2}})/\s*(\d{{1,4}}),?\s+(\d{{1,2}}):\s*(\d{{1,2}}):\s*{DECIMAL}\s*([A-Z]+)"
_START = re.compile(rf"(?:START|TRIGGER) TIME:\s*{_CLOCK}")
_ORIGIN = re.compile(rf"ORIGIN[^:]*:\s*{_CLOCK}")
_RECORDED = re.compile(
    rf"\b([A-Z]{{3}})[A-Z]*\s+(\d{{1,2}}),\s+(\d{{4}})\s+(\d{{1,2}}):(\d{{1,2}})(?::{DECIMAL})?\s+([A-Z]+)"
)
_MONTHS = ("JAN", "FEB", "MAR", "APR", "MAY", "JUN", "JUL", "AUG", "SEP", "OCT", "NOV", "DEC")
#: hours ahead of UTC
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
#: the date that instruments without a clock give
_NO_CLOCK = (1980, 1, 1)
_EPICENTRE = re.compile(rf"{DECIMAL}\s*([NS])[,\s]\s*{DECIMAL}\s*([EW])")
_DEPTH = re.compile(rf"\bH=\s*{DECIMAL}\s*KM")
_MAGNITUDE = re.compile(rf"\b(M[A-Z]?)=?\s*{DECIMAL}")


class Header(NamedTuple):
    """One channel's words of the vocabulary, its number, the header's real numbers, and the line after them."""

    words: dict[str, Any]
    channel: int
    reals: FloatArray
    next_line: int


def read_header(text: Text, first: int, text_lines: int, reals: int) -> Header:
    """
    Read one channel's header.

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
    words = (
        _station(lines)
        | _instrument(lines)
        | orientation(channel[2])
        | {"sensor_location": channel[4] or None}
    )
    words |= {"starttime": _start(text, first, lines), "event": _event(text, first, lines)}
    words["location"] = _location(lines[4], int(channel[1]), int(channel[3] or channel[1]))
    values = fixed_block(text, numbers, reals, 10, 8)
    return Header(words, int(channel[1]), values, numbers + block_lines(reals, 8))


def _location(site: str, channel: int, station_channel: int) -> str | None:
    """
    Return a location code that tells instruments of one station apart and keeps the components of each together.

    A recorder of three channels is named by its first one; a recorder that serves sensors all over
    a structure gives each its own number.
    """
    channels = _CHANNELS.search(site)
    recorder, station = (int(channels[1]), int(channels[2])) if channels else (0, 0)
    if station <= 4 and recorder == station:
        return None
    return f"{station_channel - channel + 1 if recorder <= 3 else station_channel:02d}"


def known(value: float, factor: float = 1.0) -> float | None:
    """Return a real number of the header, in SI, or None where it stands for unknown."""
    return None if value in _UNKNOWN else float(value) * factor


def channel_name(header: Header, dt: float) -> str:
    """Return the SEED channel code; channels of unknown orientation are numbered as in the file."""
    code = channel_code(1 / dt, header.words)
    return code if len(code) == 3 else f"{code}{header.channel % 10}"


def _station(lines: list[str]) -> dict[str, Any]:
    site = _SITE.match(lines[4].strip())
    number = site[1] if site else ""
    place = (hemisphere(site[2], site[3]), hemisphere(site[4], site[5])) if site else (None, None)
    name, *owner = re.split(r"\s{2,}|\s+S/N", lines[5].strip())
    seed = _SEED.match(lines[3])
    network = "CE" if _AGENCIES.search(owner[0] if owner else lines[0]) else ""
    return {
        "network": seed[1] if seed else network,
        "station": seed[2] if seed else number or re.sub(r"[^A-Z0-9]", "", name),
        "station_name": name or None,
        "coordinates": coordinates(*place),
    }


def _instrument(lines: list[str]) -> dict[str, Any]:
    model, constants, sensitivity = (
        _MODEL.search(lines[4]),
        _CONSTANTS.search(lines[9]),
        _SENSITIVITY.search(lines[9]),
    )
    period = float(constants[1]) if constants else 0.0
    words = {
        "model": model[1] if model else None,
        "serial": model[2] if model else None,
        "natural_frequency": 1 / period if period > 0 else None,
        "damping": float(constants[2]) if constants else None,
        "sensitivity": float(sensitivity[1]) / STANDARD_GRAVITY if sensitivity else None,
    }
    return {"instrument": words}


def _start(text: Text, first: int, lines: list[str]) -> UTCDateTime | None:
    if start := _START.search(lines[3]):
        return _moment(text, first + 3, start)
    recorded = _RECORDED.search(lines[1])
    if recorded and lines[1].startswith(_RECORD_OF):
        month, day, year, hour, minute, second, zone = recorded.groups()
        if month in _MONTHS and zone in _ZONES:
            date = (int(year), _MONTHS.index(month) + 1, int(day))
            clock = (float(hour), float(minute), float(second or 0))
            return utc(text, first + 1, "time", date, clock, _ZONES[zone])
    return None


def _moment(text: Text, line: int, found: re.Match[str]) -> UTCDateTime | None:
    month, day, year, hour, minute, second, zone = found.groups()
    date = (full_year(year), int(month), int(day))
    if date == _NO_CLOCK or zone not in _ZONES:
        return None
    return utc(text, line, "time", date, (float(hour), float(minute), float(second)), _ZONES[zone])


def _event(text: Text, first: int, lines: list[str]) -> dict[str, Any]:
    origin, place, depth = (
        _ORIGIN.search(lines[2]),
        _EPICENTRE.search(lines[8]),
        _DEPTH.search(lines[8]),
    )
    where = (
        coordinates(hemisphere(place[1], place[2]), hemisphere(place[3], place[4])) if place else {}
    )
    magnitudes = {
        kind: float(value) for kind, value in _MAGNITUDE.findall(lines[8]) if float(value) > 0
    }
    named = not lines[1].startswith(_RECORD_OF)
    return {
        "name": lines[1].strip() if named else None,
        "time": _moment(text, first + 2, origin) if origin else None,
        "latitude": where.get("latitude"),
        "longitude": where.get("longitude"),
        "depth": float(depth[1]) * 1000 if depth and where else None,
        "magnitude": magnitudes.get("MW", next(iter(magnitudes.values()), None)),
    }
