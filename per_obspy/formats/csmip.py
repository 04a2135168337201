"""
CSMIP (CGS, formerly CDMG) records and official spectra.

RAW and volume 1 are uncorrected, volume 2 is corrected, volume 3 holds response spectra. RENADIC
took over the header of volume 1.
"""

import re
from re import Match
from typing import Any, NamedTuple

import numpy as np
from obspy import Stream, Trace, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.constants import GAL, STANDARD_GRAVITY
from per_obspy.formats.text.header import (
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
    fixed_block,
    head,
    head_lines,
    line_at,
    match_line,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import (
    Words,
    channel_code,
    orientation,
    read_components,
    trace,
)
from per_obspy.formats.text.volumes import (
    corrected_blocks,
    is_title,
    promised_points,
    read_film,
    sensor_constants,
    titled_block,
)

_VOLUME_1 = re.compile(
    rb"UNCORRECTED ACCELEROGRAM DATA.*?UNITS OF UNCOR", re.DOTALL | re.IGNORECASE
)
_VOLUME_3 = re.compile("^RESPONSE AND FOURIER AMPLITUDE SPECTRA", re.IGNORECASE)
_DAMPING = re.compile("^DAMPING", re.IGNORECASE)
_INCH = 0.0254  # m
_UNITS = re.compile(r"UNITS OF UNCOR.*?\b(?:AND|IS)\s++(G/10|G)\b", re.IGNORECASE)
_UNITS_OF_UNCORRECTED = {"G": STANDARD_GRAVITY, "G/10": STANDARD_GRAVITY / 10}
_CORRECTED_UNIT = re.compile("CM/SEC2|CM/SEC/SEC", re.IGNORECASE)
_END = re.compile("^/&")

#: lines of text and real numbers of the headers of volumes 1, 2 and 3
_HEADER_LINES = 13  # that all have
_VOLUME_1_LINES, _VOLUME_1_REALS = 13, 50
_VOLUME_2_LINES, _VOLUME_2_REALS = 24, 100
_VOLUME_3_LINES = 28
_INTEGER_LINES = 7  # 100 integers, 16 a line; all their values are in the text too

_SLOTS = 100  # of every array of a volume 3, filled or not
_SLOT_WIDTH, _SLOTS_PER_LINE = 10, 8
_SLOT_LINES = block_lines(_SLOTS, _SLOTS_PER_LINE)
_ARRAYS = 7  # of every damping of a volume 3: SD, SV, SA, PSV and three others

_RECORD_OF = ("RECORD OF", "RCRD OF")
_UNKNOWN = (-999.0, 0.0)

# Line 4 (from 0): station number, coordinates, recorder, channels
_PLACE = place_pattern(NUMBER, r"[,\s]\s*+")
_SITE = re.compile(rf"STATION (?:NO|ID)\.\s*+(\S*?)\s++{_PLACE}")
_MODEL = re.compile(r"[NSEW][,\s]\s*+[\d.]++\s*+[NSEW]\s++(\S.{0,80}?)\s*+S/N\s*+(\w*+)")
_CHANNELS = re.compile(r"\(\s*+(\d{1,3})\s*+CHNS OF\s*+(\d{1,3})")

# Lines 5, 6, 9: agency; channel and direction; instrument
_AGENCIES = re.compile(r"\b(CGS|CDMG|CSMIP)\b")
_CHANNEL = re.compile(
    r"CHAN\s*+(\d{1,3}):\s*+(.*?)\s*+(?:\(STA CHN:\s*+(\d{1,3})\)\s*+)?(?:LOCATION:\s*+(.*+))?"
)
_SENSITIVITY = re.compile(rf"SENSITIVITY\s*+=\s*+{DECIMAL}\s*+V(?:DC)?/G")

# Line 3: SEED names and start; lines 1 and 2: time of the record and of the origin
_SEED = re.compile(r"[^.]*\.([A-Z0-9]{1,2})\.([A-Z0-9]{1,5})\.\S\S\.H")
_CLOCK = (
    r"(?P<month>\d{1,2})/\s*+(?P<day>\d{1,2})/\s*+(?P<year>\d{1,4}),?\s++"
    rf"(?P<hour>\d{{1,2}}):\s*+(?P<minute>\d{{1,2}}):\s*+(?P<second>{NUMBER})\s*+(?P<zone>[A-Z]++)"
)
_START = re.compile(rf"(?:START|TRIGGER) TIME:\s*+{_CLOCK}")
_ORIGIN = re.compile(rf"ORIGIN[^:]*+:\s*+{_CLOCK}")
_RECORDED = re.compile(
    r"^(?:RECORD|RCRD) OF.*?\b(?P<month>[A-Z]{3})[A-Z]*+\s++(?P<day>\d{1,2}),\s++(?P<year>\d{4})"
    rf"\s++(?P<hour>\d{{1,2}}):(?P<minute>\d{{1,2}})(?::(?P<second>{NUMBER}))?\s++(?P<zone>[A-Z]++)"
)
_NO_CLOCK = re.compile(r"\b0?1/\s*+0?1/\s*+(?:19)?80\b")  # date of instruments without a clock

# Line 8: hypocentre
_EPICENTRE = re.compile(_PLACE)
_DEPTH = re.compile(rf"\bH=\s*+{DECIMAL}\s*+KM")
_MAGNITUDE = re.compile(rf"\b(M[A-Z]?)=?\s*+{DECIMAL}")


class _Header(NamedTuple):
    """Header of one channel: words, number in the file, real numbers, line after it."""

    words: Words
    channel: int
    reals: list[float | None]
    next_line: int


def is_volume_1(file: WaveformFile) -> bool:
    """Check whether a file starts like CSMIP RAW or volume 1."""
    return volume_1_agency(file) == "CSMIP"


def volume_1_agency(file: WaveformFile) -> str | None:
    """Return the agency of a file that starts like a volume 1, CSMIP or RENADIC, or None."""
    start = head(file, 1200)
    if not _VOLUME_1.match(start):
        return None
    return "RENADIC" if b"RENADIC" in start.upper() else "CSMIP"


def is_volume_2(file: WaveformFile) -> bool:
    """Check whether a file starts like CSMIP volume 2."""
    lines = [line.upper() for line in head_lines(file, 200)]
    return (
        len(lines) > 2
        and lines[0].startswith("CORRECTED ACCELEROGRAM ")
        and lines[1].startswith("UNCORRECTED ACCELEROGRAM DATA")
    )


def read_volume_1(file: WaveformFile, **_unused: Any) -> Stream:
    """Read CSMIP RAW or volume 1: uncorrected acceleration of all channels, m/s2."""
    return read_components(read_text(file), _volume_1_channel)


def read_volume_2(file: WaveformFile, **_unused: Any) -> Stream:
    """Read CSMIP volume 2: corrected acceleration of all channels, m/s2."""
    return read_components(read_text(file), _volume_2_channel)


def _volume_1_channel(text: Text, first: int) -> tuple[Trace, int]:
    """Return a channel of uncorrected acceleration and the line after its end."""
    header = _read_header(text, first, _VOLUME_1_LINES, _VOLUME_1_REALS)
    unit = match_line(text, first + 11, "unit", _UNITS, "{} is neither g nor g/10")[1].upper()
    samples = promised_points(text, first + 10)
    # The header's peak is in g, whatever the unit of the samples
    words = {"processing_level": "raw", "header_peak": scale(header.reals[6], STANDARD_GRAVITY)}
    line = header.next_line
    # Even samples have a title; film has none
    if is_title(line_at(text, line, "samples")):
        values, dt, end = titled_block(text, line, "", 8, 9)
        if len(values) != samples:
            problem = f"{len(values)}, but {samples} on line {first + 11}"
            refuse(text, line, "number of points", problem)
    else:
        values, dt, film, end = read_film(text, line, samples)
        words |= film
    return _trace(_UNITS_OF_UNCORRECTED[unit] * values, dt, header, words), _end(text, end)


def _volume_2_channel(text: Text, first: int) -> tuple[Trace, int]:
    """Return a channel of corrected acceleration and the line after its end."""
    header = _read_header(text, first + 1, _VOLUME_2_LINES, _VOLUME_2_REALS)
    match_line(text, header.next_line, "unit", _CORRECTED_UNIT, "{} does not name cm/sec2")
    values, dt, line = corrected_blocks(text, header.next_line, ("ACCEL", "VELOC", "DISPL"))
    # Corners in Hz, peak in gal
    words = {
        "processing_level": "processed",
        "corners": {"highpass": header.reals[61], "lowpass": header.reals[72]},
        "header_peak": scale(header.reals[65], GAL),
    }
    return _trace(GAL * values, dt, header, words), _end(text, line)


def _end(text: Text, line: int) -> int:
    """Return the line after the mark that ends a channel."""
    match_line(text, line, "end of channel", _END, "expected '/&' after the samples, got {}")
    return line + 1


def _trace(values: FloatArray, dt: float, header: _Header, words: Words) -> Trace:
    """Return acceleration in m/s2; channels without an azimuth are numbered as in the file."""
    code = channel_code(1 / dt, header.words)
    if len(code) < 3 or "direction" in header.words:
        code = f"{code[:2]}{header.channel % 10}"
    return trace(values, dt, header.words | words | {"channel": code})


def _read_header(text: Text, first: int, text_lines: int, reals: int) -> _Header:
    """Read the header of one channel, from its first common line, with lines of text and reals."""
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
    known = [None if value in _UNKNOWN else float(value) for value in values]
    return _Header(words, int(channel[1]), known, numbers + block_lines(reals, 8))


def _words(text: Text, first: int, lines: list[str], channel: Match[str]) -> Words:
    """Return the words of the thirteen lines of text, in capitals."""
    event = _event(text, first, lines)
    model = _MODEL.search(lines[4])
    sensitivity = number_in(_SENSITIVITY.search(lines[9]))
    # The location code separates instruments
    return {
        **_station(lines, event),
        "event": event,
        "instrument": {
            "model": word_in(model),
            "serial": word_in(model, 2),
            **sensor_constants(lines[9]),
            "sensitivity": None if sensitivity is None else sensitivity / STANDARD_GRAVITY,
        },
        **orientation(channel[2]),
        "sensor_location": channel[4] or None,
        "starttime": _start(text, first, lines),
        "location": _location(lines[4], int(channel[1]), int(channel[3] or channel[1])),
    }


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


def _station(lines: list[str], epicentre: Words) -> Words:
    """Return codes, name and coordinates of the station."""
    site = _SITE.match(lines[4].strip())
    name, *owner = re.split(r"\s{2,}|\s+S/N", lines[5].strip())
    # SEED names where the header has them, else the agency's number or the name of the place
    if seed := _SEED.match(lines[3]):
        network, code = seed.groups()
    else:
        network = "CE" if _AGENCIES.search(owner[0] if owner else lines[0]) else ""
        code = word_in(site) or re.sub(r"[^A-Z0-9]", "", name)
    return {
        "network": network,
        "station": code,
        "station_name": name or None,
        "coordinates": station_place(site, epicentre),
    }


def _start(text: Text, first: int, lines: list[str]) -> UTCDateTime | None:
    """Return the start of the record, or else the time in the title ``RECORD OF``."""
    if start := _START.search(lines[3]):
        return _clock(text, first + 3, start)
    return header_time(text, first + 1, "time", _RECORDED.match(lines[1]))


def _clock(text: Text, line: int, match: Match[str] | None) -> UTCDateTime | None:
    """Return the time of a clock; None where there is none or it was not set."""
    if match is None or _NO_CLOCK.search(match[0]):
        return None
    return header_time(text, line, "time", match)


def _event(text: Text, first: int, lines: list[str]) -> Words:
    """Return name, origin time, hypocentre and magnitude of the event."""
    epicentre = epicentre_place(_EPICENTRE.search(lines[8]))
    depth = scale(number_in(_DEPTH.search(lines[8])), 1000)
    # A depth without an epicentre is a mark for unknown
    return {
        "name": None if lines[1].startswith(_RECORD_OF) else lines[1].strip(),
        "time": _clock(text, first + 2, _ORIGIN.search(lines[2])),
        **epicentre,
        "depth": depth if epicentre else None,
        "magnitude": moment_first(_MAGNITUDE.findall(lines[8])),
    }


class OfficialSpectra(NamedTuple):
    """Response spectra of one channel as the agency computed them."""

    #: number in the file
    channel: int
    #: undamped periods, s, (n_periods,), and fractions of critical, (n_damping,)
    periods: FloatArray
    damping: FloatArray
    #: relative displacement, m, and velocity, m/s; absolute acceleration, m/s2; pseudo velocity,
    #: m/s; each (n_damping, n_periods)
    sd: FloatArray
    sv: FloatArray
    sa: FloatArray
    psv: FloatArray


def read_spectra(file: WaveformFile) -> tuple[OfficialSpectra, ...]:
    """
    Read the spectra of a CSMIP volume 3 file, one entry per channel.

    Raises
    ------
    RecordRejected
        If the file is not a volume 3 or lacks parts that its header announces.
    """
    text = read_text(file)
    match_line(text, 0, "title", _VOLUME_3, "{} is not that of a volume 3")
    # A channel ends as those of the other volumes do
    spectra, line = [], 0
    while line < len(text.lines):
        channel, line = _spectra_channel(text, line)
        spectra.append(channel)
        line = _end(text, line)
    return tuple(spectra)


def _spectra_channel(text: Text, first: int) -> tuple[OfficialSpectra, int]:
    """Return the spectra of a channel and the line after them."""
    header = _read_header(text, first + 2, _VOLUME_3_LINES, _VOLUME_2_REALS)
    periods, dampings = _spectra_size(text, first + 2 + _VOLUME_3_LINES)
    # Dampings, periods, and the Fourier spectrum with its title, which is passed over
    line = header.next_line + 1
    damping = fixed_block(text, header.next_line, dampings, _SLOT_WIDTH, _SLOTS_PER_LINE)
    grid = _slots(text, line, periods)
    line += 2 * _SLOT_LINES + 1
    # Arrays of every damping below their title, (n_arrays, n_damping, n_periods)
    values = np.empty((_ARRAYS, dampings, periods))
    for index, fraction in enumerate(damping):
        problem = f"expected the spectra of {fraction:g}, got {{}}"
        match_line(text, line, "damping", _DAMPING, problem)
        for kind in range(_ARRAYS):
            values[kind, index] = _slots(text, line + 1 + kind * _SLOT_LINES, periods)
        line += _ARRAYS * _SLOT_LINES + 1
    # Inches and fractions of gravity
    sd, sv, sa, psv = values[:4]
    lengths = sd * _INCH, sv * _INCH, sa * STANDARD_GRAVITY, psv * _INCH
    return OfficialSpectra(header.channel, grid, damping, *lengths), line


def _spectra_size(text: Text, line: int) -> tuple[int, int]:
    """Return the numbers of periods and dampings, which are among the header's integers."""
    periods, dampings = map(int, fixed_block(text, line, 100, 5, 16)[67:69])
    if not 0 < periods <= _SLOTS or not 0 < dampings <= 8:
        refuse(text, line + 4, "periods, dampings", f"{periods} and {dampings}")
    return periods, dampings


def _slots(text: Text, line: int, periods: int) -> FloatArray:
    """Return the filled slots of an array."""
    return fixed_block(text, line, _SLOTS, _SLOT_WIDTH, _SLOTS_PER_LINE)[:periods]
