"""
COSMOS 1.20: V0 (counts), V1 (uncorrected) and V2 (corrected).

Their variants with several channels per file are read too.
"""

import re
from typing import Any, NamedTuple

from obspy import Stream, Trace, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.formats.text.conversions import first_known, metres, utc, utc_from_words
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    block_lines,
    count,
    fixed_block,
    head_lines,
    line_at,
    quoted,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import (
    channel_code,
    coordinates,
    corners,
    orientation,
    trace,
)
from per_obspy.units import motion_unit

_TITLE = re.compile(
    r"(Raw|Uncorrected|Corrected) (acceleration|velocity|displacement)\b.*"
    r"\(Format v0?1\.\d{1,4} with (\d{1,4}) text lines\)"
)
_FORMAT = re.compile(
    r"Format\s*+=\s*+\(\s*+(\d{1,4})([IFE])(\d{1,4})(?:\.\d{1,4})?\s*+\)", re.IGNORECASE
)
_HEADER_NUMBERS = re.compile(r"\s*+100 (Integer|Real)-header values follow on\s++(\d{1,4}) lines")
_COMMENTS = re.compile(r"\s*+(\d{1,4}) Comment line\(s\) follow")
_SAMPLES = re.compile(
    rf"\s*+(\d{{1,12}})\s++.*?\bapprox\s++{DECIMAL}\s*+secs?,\s*+units=\s*+([^(,]{{0,40}}?)\s*+\("
)
_CODE = re.compile(r"Code:\s*+(\w++)-(\S++)\s*+(.*)")
_SCNL = re.compile(r"\|<SCNL>(\w++)\.(\w++)\.(\w++)\.(\S++)")
_CHANNEL = re.compile(
    r"Sta Cha(?:n\s*+\??|:)?\s*+(?:\d{1,4}+|\?)?\s*+:?\s*+(.*?)\s*+"
    r"\(Rcrdr Chan\s*+(\w*+|\?)\)(?:\s*+Location:\s*+(.*+))?"
)
_FILTERED = re.compile(rf"below\s++{DECIMAL}\s*+Hz.*above\s++{DECIMAL}\s*+Hz")
_SERIAL = re.compile(r"Recorder:\s*+(.*?)\s*+s/n\s*+(\S++)")
_NAME = re.compile(r"Record\s++of\s++(.{1,60}?)\s++Earthquake\b", re.IGNORECASE)
_ORIGIN = re.compile(
    r"Origin:\s*+(\d{1,4})/(\d{1,2})/(\d{1,4}),?\s++(\d{1,2}):(\d{1,2}):(\d{1,2}(?:\.\d{0,6})?)"
    r"\s*+(?:UTC|GMT)"
)
_VS30 = re.compile(r"\bVs30\s*+[=:]?\s*+(\d{2,4}(?:\.\d{0,3})?)\s*+m/s", re.IGNORECASE)
_TEXT_LINES = 13
_UNKNOWN = -999.0


class _Header(NamedTuple):
    """Header of one channel: its text, 100 integers, 100 reals, comments, and the line after it."""

    first: int
    text_lines: list[str]
    integers: FloatArray
    reals: FloatArray
    comments: list[str]
    next_line: int


def is_cosmos(file: WaveformFile) -> bool:
    """Check whether a file starts like COSMOS V0, V1 or V2 (not the spectra of V3)."""
    return bool(_TITLE.match(head_lines(file, 200)[0]))


def read_cosmos(file: WaveformFile, **_unused: Any) -> Stream:
    """
    Read all channels of COSMOS V0, V1 or V2.

    Samples are in m/s2 (or m/s, m), or counts with their gain in ``calib``.
    """
    text = read_text(file)
    stream, line = Stream(), 0
    while line < len(text.lines):
        component, line = _channel(text, line)
        stream.append(component)
    return stream


def _channel(text: Text, first: int) -> tuple[Trace, int]:
    """Return a channel and the line after it."""
    state, quantity, text_lines = _title(text, first)
    header = _header(text, first, count(text, first, "text lines", text_lines))
    unit, values, end = _samples(text, header.next_line)
    _check_end(text, end)
    dt = _interval(text, header, len(values))
    # Words of the header
    words = _words(header) | {"starttime": _start(text, header), "event": _event(text, header)}
    words |= {"units": unit, "quantity": quantity}
    words["processing_level"] = "processed" if state == "Corrected" else "raw"
    words.setdefault("channel", _channel_code(header, words, dt))
    # Counts have a gain, all else may have been filtered
    if unit == "counts":
        words["calib"] = _gain(text, header)
    else:
        words["corners"] = corners(_FILTERED.search(header.text_lines[11]))
    words["header_peak"] = _peak(text, header)
    return trace(values, dt, words), end + 1


def _title(text: Text, line: int) -> tuple[str, str, str]:
    """Return state (raw, ...), quantity and number of text lines as the title has them."""
    title = _TITLE.match(text.lines[line])
    if title is None:
        problem = f"{quoted(text, line, 60)} is not that of a COSMOS time series"
        refuse(text, line, "title", problem)
    return title[1], title[2], title[3]


def _check_end(text: Text, line: int) -> None:
    """Refuse a channel that does not end after its samples."""
    if not re.match(r"/&|End-of-data", line_at(text, line, "end of data")):
        problem = f"expected it after the samples, got {quoted(text, line, 40)}"
        refuse(text, line, "end of data", problem)


def _header(text: Text, first: int, text_lines: int) -> _Header:
    """Read the header of a channel."""
    if text_lines < _TEXT_LINES:
        refuse(text, first, "text lines", f"{text_lines}, the format has {_TEXT_LINES}")
    line_at(text, first + text_lines, "integer header")
    # 100 integers, 100 reals, then comments
    line = first + text_lines
    integers, line = _numbers(text, line, "Integer")
    reals, line = _numbers(text, line, "Real")
    # A line announces the number of comments, which may be 0
    comments = _COMMENTS.match(line_at(text, line, "comments"))
    if comments is None:
        problem = f"{quoted(text, line, 40)} does not contain the number of lines that follow"
        refuse(text, line, "comments", problem)
    stop = line + 1 + int(comments[1])
    line_at(text, stop, "samples")
    title_and_text = text.lines[first : first + text_lines]
    return _Header(first, title_and_text, integers, reals, text.lines[line + 1 : stop], stop)


def _numbers(text: Text, line: int, kind: str) -> tuple[FloatArray, int]:
    """Return the 100 integers or reals of a header and the line after them."""
    field = f"{kind.lower()} header"
    title = line_at(text, line, field)
    promised = _HEADER_NUMBERS.match(title)
    layout = _FORMAT.search(title)
    # The title names the kind of numbers and their FORTRAN format
    if promised is None or layout is None or promised[1].lower() != kind.lower():
        problem = f"{quoted(text, line, 60)} does not announce its values and format"
        refuse(text, line, field, problem)
    return _block(text, line, 100, layout)


def _block(text: Text, line: int, numbers: int, layout: re.Match[str]) -> tuple[FloatArray, int]:
    """Return the numbers below a line with their FORTRAN format, and the line after them."""
    per_line = count(text, line, "format", layout[1])
    width = count(text, line, "format", layout[3])
    values = fixed_block(text, line + 1, numbers, width, per_line)
    return values, line + 1 + block_lines(numbers, per_line)


def _unit(text: Text, line: int) -> tuple[str, float]:
    """Return unit in SI, or counts, and factor of the samples, from the line above them."""
    announced = _SAMPLES.match(text.lines[line])
    # Agencies write g, G and g.
    name = announced[3] if announced else ""
    if name.lower().rstrip(". ") in ("counts", "count"):
        return "counts", 1.0
    unit = motion_unit(name)
    if unit is None:
        problem = f"{quoted(text, line, 70)} is none of counts, g, gal, cm/sec2, cm/sec, cm"
        refuse(text, line, "units", problem)
    return unit.name, unit.factor


def _samples(text: Text, line: int) -> tuple[str, FloatArray, int]:
    """Return the unit in SI, the samples in it, and the line after them."""
    unit, factor = _unit(text, line)
    announced = _SAMPLES.match(text.lines[line])
    layout = _FORMAT.search(text.lines[line])
    if announced is None or layout is None:
        refuse(text, line, "samples", f"{quoted(text, line, 70)} announces no number and format")
    # Samples become SI
    samples = count(text, line, "number of samples", announced[1])
    values, next_line = _block(text, line, samples, layout)
    return unit, factor * values, next_line


def _real(header: _Header, index: int) -> float | None:
    """Return a real number of the header, or None where it is unknown."""
    value = float(header.reals[index])
    return None if value == _UNKNOWN else value


def _peak(text: Text, header: _Header) -> float | None:
    """Return the largest absolute value according to the header, in SI or counts."""
    peak = _real(header, 63)
    if peak is None:
        return None
    _, factor = _unit(text, header.next_line)
    return abs(peak) * factor


def _interval(text: Text, header: _Header, samples: int) -> float:
    """
    Return the interval of the series, s.

    The recorder's interval (real number 34) may differ from it after resampling.
    """
    milliseconds, recorder = _real(header, 61), _real(header, 33)
    dt = recorder if milliseconds is None else milliseconds / 1000
    # The line above the samples announces their duration in whole seconds
    announced = _SAMPLES.match(text.lines[header.next_line])
    seconds = float(announced[2]) if announced else 0.0
    if dt is None or not 1e-5 <= dt <= 1e5 or abs(samples * dt - seconds) > 1 + 0.05 * seconds:
        problem = f"{dt} s in the header, but {samples} samples last {seconds:g} s"
        refuse(text, header.next_line, "interval", problem)
    return dt


def _start(text: Text, header: _Header) -> UTCDateTime | None:
    """Return the time of the first sample; None where a part of it is unknown."""
    year, month, day, hour, minute = (int(header.integers[index]) for index in (39, 41, 42, 43, 44))
    second = _real(header, 29)
    if _UNKNOWN in (year, month, day, hour, minute) or second is None:
        return None
    return utc(text, header.first + 7, "start time", (year, month, day), (hour, minute, second))


def _origin(text: Text, header: _Header) -> UTCDateTime | None:
    """Return the origin time of the fourth line of text; None unless it is in UTC."""
    found = _ORIGIN.match(header.text_lines[3])
    if found is None:
        return None
    # Agencies write month/day/year or year/month/day
    first, second, third, *clock = found.groups()
    date = (first, second, third) if len(first) == 4 else (third, first, second)
    return utc_from_words(text, header.first + 3, "origin time", (*date, *clock))


def _vs30(header: _Header) -> float | None:
    """Return Vs30, m/s, from the words of the site's geology or of a comment."""
    for line in (header.text_lines[5], *header.comments):
        if found := _VS30.search(line):
            return float(found[1])
    return None


def _words(header: _Header) -> dict[str, Any]:
    """Return codes, place, instrument and orientation; codes of SEED are in a comment."""
    channel = _CHANNEL.match(header.text_lines[8])
    words = _station(header)
    words["sensor_location"] = (channel[3] or None) if channel else None
    words["instrument"] = _instrument(header)
    words["vs30"] = _vs30(header)
    # Names of SEED take the place of the station's number
    seed = _seed_names(header)
    words |= seed
    direction = orientation(channel[1]) if channel else {}
    if "sensor_dip" not in direction and seed.get("channel", "").endswith("Z"):
        direction = {"sensor_dip": -90.0}
    return words | direction


def _station(header: _Header) -> dict[str, Any]:
    """Return codes, name and coordinates of the station."""
    code = _CODE.search(header.text_lines[4])
    place = coordinates(_real(header, 0), _real(header, 1), _real(header, 2))
    # The first word of the name is the agency's
    return {
        "network": code[1] if code else None,
        "station": code[2] if code else None,
        "station_name": re.sub(r"^\S+\s+", "", code[3]).strip() or None if code else None,
        "coordinates": place,
    }


def _instrument(header: _Header) -> dict[str, Any]:
    """Return model, serial number and constants of the instrument."""
    serial = _SERIAL.match(header.text_lines[6])
    sensitivity = _real(header, 41)
    # Volts per g in the header, volts per m/s2 in SI
    return {
        "model": (serial[1] or None) if serial else None,
        "serial": serial[2] if serial and serial[2] != "?" else None,
        "natural_frequency": _real(header, 39),
        "damping": _real(header, 40),
        "sensitivity": None if sensitivity is None else sensitivity / STANDARD_GRAVITY,
    }


def _seed_names(header: _Header) -> dict[str, str]:
    """Return the codes in the first comment that has them: station, channel, network, location."""
    for comment in header.comments:
        if names := _SCNL.match(comment):
            station, channel, network, location = names.groups()
            return {
                "network": network,
                "station": station,
                "channel": channel,
                "location": location.replace("--", ""),
            }
    return {}


def _channel_code(header: _Header, words: dict[str, Any], dt: float) -> str:
    """Return the SEED channel code; channels without an azimuth have the number of the file."""
    code, number = channel_code(1 / dt, words), int(header.integers[50])
    is_numbered = number > 0 and (len(code) < 3 or "direction" in words)
    return f"{code[:2]}{number % 10}" if is_numbered else code


def _gain(text: Text, header: _Header) -> float:
    """
    Return the gain, m/s2 per count.

    It is microvolts per count over the sensor's volts per g and the recorder's gain.
    """
    step, sensitivity, gain = _real(header, 21), _real(header, 41), _real(header, 46)
    if not step or not sensitivity:
        problem = f"unknown: {step} microvolts a count, sensor {sensitivity} V/g"
        refuse(text, header.first, "gain", problem)
    return 1e-6 * step / sensitivity * STANDARD_GRAVITY / (gain or 1.0)


def _event(text: Text, header: _Header) -> dict[str, Any]:
    """Return name, time, hypocentre and magnitude: moment, else local, else surface wave."""
    named = _NAME.match(header.text_lines[1].strip())
    return {
        "name": named[1] if named else None,
        "time": _origin(text, header),
        "latitude": _real(header, 9),
        "longitude": _real(header, 10),
        "depth": metres(_real(header, 11)),
        "magnitude": first_known(_real(header, index) for index in (12, 14, 13)),
    }
