"""
COSMOS 1.20: V0 (counts), V1 (uncorrected) and V2 (corrected).

Their variants with several channels per file are read too.
"""

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from obspy import Stream, Trace, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.constants import STANDARD_GRAVITY
from per_obspy.formats.text.header import (
    corners,
    first_known,
    header_time,
    number_in,
    scale,
    utc,
    word_in,
)
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    block_lines,
    count,
    fixed_block,
    head_lines,
    line_at,
    match_line,
    quote,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import (
    Words,
    channel_code,
    coordinates,
    orientation,
    read_components,
    trace,
)
from per_obspy.units import motion_unit

_TITLE = re.compile(
    r"^(Raw|Uncorrected|Corrected) (acceleration|velocity|displacement)\b.*"
    r"\(Format v0?1\.\d{1,4} with (\d{1,4}) text lines\)"
)
_FORMAT = r".*?(?i:Format)\s*+=\s*+\(\s*+(\d{1,4})[IFEife](\d{1,4})(?:\.\d{1,4})?\s*+\)"
_HEADER_NUMBERS = {
    kind: re.compile(rf"^\s*+100 {kind}-header values follow on\s++\d{{1,4}} lines{_FORMAT}")
    for kind in ("Integer", "Real")
}
_END = re.compile("^/&|^End-of-data")
_COMMENTS = re.compile(r"^\s*+(\d{1,4}) Comment line\(s\) follow")
_SAMPLES = re.compile(
    rf"^\s*+(\d{{1,12}})\s++.*?\bapprox\s++{DECIMAL}\s*+secs?,\s*+"
    rf"units=\s*+([^(,]{{0,40}}?)\s*+\({_FORMAT}"
)
_CODE = re.compile(r"Code:\s*+(\w++)-(\S++)\s*+(.*)")
_SCNL = re.compile(
    r"\|<SCNL>(?P<station>\w++)\.(?P<channel>\w++)\.(?P<network>\w++)\.(?P<location>\S++)"
)
_CHANNEL = re.compile(
    r"Sta Cha(?:n\s*+\??|:)?\s*+(?:\d{1,4}+|\?)?\s*+:?\s*+(.*?)\s*+"
    r"\(Rcrdr Chan\s*+(\w*+|\?)\)(?:\s*+Location:\s*+(.*+))?"
)
_FILTERED = re.compile(rf"below\s++{DECIMAL}\s*+Hz.*above\s++{DECIMAL}\s*+Hz")
_SERIAL = re.compile(r"Recorder:\s*+(.*?)\s*+s/n\s*+(?:\?(?!\S)|(\S++))")
_NAME = re.compile(r"Record\s++of\s++(.{1,60}?)\s++Earthquake\b", re.IGNORECASE)
#: month/day/year or year/month/day
_ORIGIN = re.compile(
    r"Origin:\s*+(?:(?P<year_>\d{4})/(?P<month_>\d{1,2})/(?P<day_>\d{1,2})|"
    r"(?P<month>\d{1,2})/(?P<day>\d{1,2})/(?P<year>\d{1,4})),?\s++"
    r"(?P<hour>\d{1,2}):(?P<minute>\d{1,2}):(?P<second>\d{1,2}(?:\.\d{0,6})?)\s*+(?:UTC|GMT)"
)
_VS30 = re.compile(r"\bVs30\s*+[=:]?\s*+(\d{2,4}(?:\.\d{0,3})?)\s*+m/s", re.IGNORECASE)
_TEXT_LINES = 13
_UNKNOWN = -999.0


class _Header(NamedTuple):
    """Header of a channel; integers and reals are None where they are unknown."""

    text: Text
    first: int  # line of the title
    lines: list[str]  # of text
    integers: list[float | None]
    reals: list[float | None]
    comments: list[str]
    next_line: int  # that announces the samples


def is_cosmos(file: WaveformFile) -> bool:
    """Check whether a file starts like COSMOS V0, V1 or V2 (not the spectra of V3)."""
    return bool(_TITLE.match(head_lines(file, 200)[0]))


def read_cosmos(file: WaveformFile, **_unused: Any) -> Stream:
    """
    Read all channels of COSMOS V0, V1 or V2.

    Samples are in m/s2 (or m/s, m), or counts with their gain in ``calib``.
    """
    return read_components(read_text(file), _channel)


def _channel(text: Text, first: int) -> tuple[Trace, int]:
    """Return a channel and the line after it."""
    title = match_line(text, first, "title", _TITLE, "{} is not that of a COSMOS time series")
    header = _read_header(text, first, count(text, first, "text lines", title[3]))
    unit, factor, values, dt, end = _samples(header)
    match_line(text, end, "end of data", _END, "expected it after the samples, got {}")
    # Words of the header
    words = _words(header) | {"starttime": _start(header), "event": _event(header)}
    words |= {"units": unit, "quantity": title[2], "header_peak": scale(header.reals[63], factor)}
    words["processing_level"] = "processed" if title[1] == "Corrected" else "raw"
    words.setdefault("channel", _channel_code(header, words, dt))
    # Counts have a gain, all else may have been filtered
    if unit == "counts":
        words["calib"] = _gain(header)
    else:
        words["corners"] = corners(_FILTERED.search(header.lines[11]))
    return trace(factor * values, dt, words), end + 1


def _read_header(text: Text, first: int, text_lines: int) -> _Header:
    """Read the header of a channel: text, 100 integers, 100 reals, comments."""
    if text_lines < _TEXT_LINES:
        refuse(text, first, "text lines", f"{text_lines}, the format has {_TEXT_LINES}")
    line_at(text, first + text_lines, "integer header")
    integers, line = _numbers(text, first + text_lines, "Integer")
    reals, line = _numbers(text, line, "Real")
    # A line announces the number of comments, which may be 0
    problem = "{} does not contain the number of lines that follow"
    stop = line + 1 + int(match_line(text, line, "comments", _COMMENTS, problem)[1])
    line_at(text, stop, "samples")
    lines, comments = text.lines[first : first + text_lines], text.lines[line + 1 : stop]
    return _Header(text, first, lines, integers, reals, comments, stop)


def _numbers(text: Text, line: int, kind: str) -> tuple[list[float | None], int]:
    """Return the 100 integers or reals of a header, None where unknown, and the line after them."""
    problem = "{} does not announce its values and format"
    title = match_line(text, line, f"{kind.lower()} header", _HEADER_NUMBERS[kind], problem)
    values, next_line = _block(text, line, 100, title.groups())
    return [None if value == _UNKNOWN else value for value in values.tolist()], next_line


def _samples(header: _Header) -> tuple[str, float, FloatArray, float, int]:
    """Return unit and factor to it, samples, interval, s, and the line after the samples."""
    text, line = header.text, header.next_line
    problem = "{} announces no number, duration, unit and format"
    announced = match_line(text, line, "samples", _SAMPLES, problem)
    samples, seconds, unit, *layout = announced.groups()
    # The unit may be counts, which have a gain
    name, factor = _unit(text, line, unit)
    values, end = _block(text, line, count(text, line, "number of samples", samples), layout)
    return name, factor, values, _interval(header, len(values), float(seconds)), end


def _block(
    text: Text, line: int, numbers: int, layout: Sequence[str | Any]
) -> tuple[FloatArray, int]:
    """Return the numbers below a line with their FORTRAN format, and the line after them."""
    per_line, width = (count(text, line, "format", word) for word in layout)
    values = fixed_block(text, line + 1, numbers, width, per_line)
    return values, line + 1 + block_lines(numbers, per_line)


def _unit(text: Text, line: int, name: str) -> tuple[str, float]:
    """Return unit in SI, or counts, and factor of the samples."""
    # Agencies write g, G and g.
    if name.lower().rstrip(". ") in ("counts", "count"):
        return "counts", 1.0
    unit = motion_unit(name)
    if unit is None:
        problem = f"{quote(text, line)} is none of counts, g, gal, cm/sec2, cm/sec, cm"
        refuse(text, line, "units", problem)
    return unit.name, unit.factor


def _interval(header: _Header, samples: int, seconds: float) -> float:
    """
    Return the interval of the series, s.

    The recorder's interval (real number 34) may differ from it after resampling.
    """
    milliseconds = header.reals[61]
    dt = header.reals[33] if milliseconds is None else milliseconds / 1000
    # The duration is announced in whole seconds
    if dt is None or not 1e-5 <= dt <= 1e5 or abs(samples * dt - seconds) > 1 + 0.05 * seconds:
        problem = f"{dt} s in the header, but {samples} samples last {seconds:g} s"
        refuse(header.text, header.next_line, "interval", problem)
    return dt


def _gain(header: _Header) -> float:
    """
    Return the gain, m/s2 per count.

    It is microvolts per count over the sensor's volts per g and the recorder's gain.
    """
    step, sensitivity, gain = (header.reals[index] for index in (21, 41, 46))
    if not step or not sensitivity:
        problem = f"unknown: {step} microvolts a count, sensor {sensitivity} V/g"
        refuse(header.text, header.first, "gain", problem)
    return 1e-6 * step / sensitivity * STANDARD_GRAVITY / (gain or 1.0)


def _start(header: _Header) -> UTCDateTime | None:
    """Return the time of the first sample; None where a part of it is unknown."""
    parts = [header.integers[index] for index in (39, 41, 42, 43, 44)] + [header.reals[29]]
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        return None
    # All but the seconds are whole numbers
    year, month, day, hour, minute = map(int, known[:5])
    date, clock = (year, month, day), (hour, minute, known[5])
    return utc(header.text, header.first + 7, "start time", date, clock)


def _words(header: _Header) -> Words:
    """Return codes, place, instrument and orientation; codes of SEED are in a comment."""
    code = _CODE.search(header.lines[4])
    channel = _CHANNEL.match(header.lines[8])
    grounds = map(_VS30.search, (header.lines[5], *header.comments))
    words = {
        "network": word_in(code),
        "station": word_in(code, 2),
        # The first word of the name is the agency's
        "station_name": re.sub(r"^\S+\s+", "", word_in(code, 3) or "").strip() or None,
        "coordinates": coordinates(*header.reals[:3]),
        "sensor_location": word_in(channel, 3),
        "instrument": _instrument(header),
        "vs30": first_known(map(number_in, grounds)),
    }
    # Names of SEED in the first comment that has them take the place of the station's number
    if seed := next(filter(None, map(_SCNL.match, header.comments)), None):
        words |= seed.groupdict()
        words["location"] = seed["location"].replace("--", "")
    direction = orientation(word_in(channel) or "")
    if "sensor_dip" not in direction and str(words.get("channel")).endswith("Z"):
        direction = {"sensor_dip": -90.0}
    return words | direction


def _instrument(header: _Header) -> Words:
    """Return model, serial number and constants of the instrument."""
    recorder = _SERIAL.match(header.lines[6])
    frequency, damping, sensitivity = header.reals[39:42]
    # Volts per g in the header, volts per m/s2 in SI
    return {
        "model": word_in(recorder),
        "serial": word_in(recorder, 2),
        "natural_frequency": frequency,
        "damping": damping,
        "sensitivity": None if sensitivity is None else sensitivity / STANDARD_GRAVITY,
    }


def _channel_code(header: _Header, words: Words, dt: float) -> str:
    """Return the SEED channel code; channels without an azimuth have the number of the file."""
    code, number = channel_code(1 / dt, words), int(header.integers[50] or 0)
    is_numbered = number > 0 and (len(code) < 3 or "direction" in words)
    return f"{code[:2]}{number % 10}" if is_numbered else code


def _event(header: _Header) -> Words:
    """Return name, time, hypocentre and magnitude: moment, else local, else surface wave."""
    origin = _ORIGIN.match(header.lines[3])
    latitude, longitude, depth = header.reals[9:12]
    # Kinds of magnitude in the order of preference
    return {
        "name": word_in(_NAME.match(header.lines[1].strip())),
        "time": header_time(header.text, header.first + 3, "origin time", origin),
        "latitude": latitude,
        "longitude": longitude,
        "depth": scale(depth, 1000),
        "magnitude": first_known(header.reals[index] for index in (12, 14, 13)),
    }
