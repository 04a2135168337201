"""
CSMIP (CGS, formerly CDMG) records and official spectra.

RAW and volume 1 are uncorrected, volume 2 is corrected, volume 3 holds response spectra.
"""

import re
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from obspy import Stream, Trace

from per_obspy.checks import FloatArray
from per_obspy.constants import GAL, STANDARD_GRAVITY
from per_obspy.formats.text.csmip_header import Header, channel_name, known, read_header
from per_obspy.formats.text.film import film_lines, read_film
from per_obspy.formats.text.lines import (
    Text,
    WaveformFile,
    block_lines,
    count,
    fixed_block,
    head,
    head_lines,
    line_at,
    quoted,
    read_text,
    refuse,
)
from per_obspy.formats.text.number_blocks import is_title, titled_block
from per_obspy.formats.text.vocabulary import trace

_INCH = 0.0254  # m
_UNITS = re.compile(r"UNITS OF UNCOR.*?\b(?:AND|IS)\s++(G/10|G)\b")
_PROMISED = re.compile(r"NO\. OF POINTS\s*+=\s*+(\S+)")
_UNITS_OF_UNCORRECTED = {"G": STANDARD_GRAVITY, "G/10": STANDARD_GRAVITY / 10}
_VOLUME_1_LINES, _VOLUME_1_REALS = 13, 50
_VOLUME_2_LINES, _VOLUME_2_REALS = 24, 100
_VOLUME_3_LINES = 28
_SLOTS = 100  # of every array of a volume 3, filled or not
_SLOT_WIDTH, _SLOTS_PER_LINE = 10, 8
_ARRAYS = 7  # of every damping of a volume 3: SD, SV, SA, PSV and three others


def is_volume_1(file: WaveformFile) -> bool:
    """Check whether a file starts like CSMIP RAW or volume 1."""
    start = head(file, 1200).upper()
    return (
        start.startswith(b"UNCORRECTED ACCELEROGRAM DATA")
        and b"UNITS OF UNCOR" in start
        and b"RENADIC" not in start
    )


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
    return _channels(read_text(file), _volume_1_channel)


def read_volume_2(file: WaveformFile, **_unused: Any) -> Stream:
    """Read CSMIP volume 2: corrected acceleration of all channels, m/s2."""
    return _channels(read_text(file), _volume_2_channel)


def _channels(text: Text, read_channel: Callable[[Text, int], tuple[Trace, int]]) -> Stream:
    """Return all channels of a file."""
    stream, line = Stream(), 0
    while line < len(text.lines):
        component, line = read_channel(text, line)
        stream.append(component)
        line = _end_of_channel(text, line)
    return stream


def _end_of_channel(text: Text, line: int) -> int:
    """Return the line after the mark that ends a channel."""
    if not line_at(text, line, "end of channel").startswith("/&"):
        problem = f"expected '/&' after the samples, got {quoted(text, line, 40)}"
        refuse(text, line, "end of channel", problem)
    return line + 1


def _volume_1_channel(text: Text, first: int) -> tuple[Trace, int]:
    """Return a channel of uncorrected acceleration and the line after its samples."""
    header = read_header(text, first, _VOLUME_1_LINES, _VOLUME_1_REALS)
    factor = _uncorrected_unit(text, first + 11)
    samples = _promised_samples(text, first + 10)
    # Even samples have a title; film has none
    film: dict[str, Any] = {}
    if is_title(line_at(text, header.next_line, "samples")):
        values, dt, line = titled_block(text, header.next_line, "", 8, 9)
        if len(values) != samples:
            problem = f"{len(values)}, but {samples} on line {first + 11}"
            refuse(text, header.next_line, "number of points", problem)
    else:
        values, dt, film = read_film(text, header.next_line, samples)
        line = header.next_line + film_lines(samples)
    # The header's peak is in g, whatever the unit of the samples
    words = {"processing_level": "raw", "header_peak": _peak(header.reals[6], STANDARD_GRAVITY)}
    return _trace(factor * values, dt, header, words | film), line


def _promised_samples(text: Text, line: int) -> int:
    """Return the number of samples that the text of a volume 1 promises."""
    promised = _PROMISED.match(text.lines[line].strip().upper())
    if promised is None:
        refuse(text, line, "number of points", f"{quoted(text, line)} gives none")
    return count(text, line, "number of points", promised[1])


def _volume_2_channel(text: Text, first: int) -> tuple[Trace, int]:
    """Return a channel of corrected acceleration and the line after its last block."""
    header = read_header(text, first + 1, _VOLUME_2_LINES, _VOLUME_2_REALS)
    title = line_at(text, header.next_line, "title of acceleration").upper()
    if "CM/SEC2" not in title and "CM/SEC/SEC" not in title:
        refuse(text, header.next_line, "unit", f"{title.strip()!r} does not name cm/sec2")
    # Velocity and displacement follow the acceleration and must be whole
    values, dt, line = titled_block(text, header.next_line, "ACCEL", 8, 10)
    for kind in ("VELOC", "DISPL"):
        integral, _, line = titled_block(text, line, kind, 8, 10)
        if len(integral) != len(values):
            problem = f"{len(integral)} samples, acceleration has {len(values)}"
            refuse(text, line - 1, kind, problem)
    # Corners in Hz, peak in gal
    words = {
        "processing_level": "processed",
        "corners": {"highpass": known(header.reals[61]), "lowpass": known(header.reals[72])},
        "header_peak": _peak(header.reals[65], GAL),
    }
    return _trace(GAL * values, dt, header, words), line


def _trace(values: FloatArray, dt: float, header: Header, words: dict[str, Any]) -> Trace:
    """Return acceleration in m/s2 with the words of its header."""
    words |= {"units": "m/s2", "quantity": "acceleration", "channel": channel_name(header, dt)}
    return trace(values, dt, header.words | words)


def _peak(value: float, factor: float) -> float | None:
    """Return the absolute peak of the header in SI, or None where it is unknown."""
    peak = known(value, factor)
    return None if peak is None else abs(peak)


def _uncorrected_unit(text: Text, line: int) -> float:
    """Return the unit of uncorrected samples, m/s2."""
    unit = _UNITS.search(text.lines[line].upper())
    if unit is None:
        refuse(text, line, "unit", f"{quoted(text, line)} is neither g nor g/10")
    return _UNITS_OF_UNCORRECTED[unit[1]]


class OfficialSpectra(NamedTuple):
    """
    Response spectra of one channel as the agency computed them.

    Attributes
    ----------
    channel : int
        Number in the file.
    periods : (n_periods,) ndarray
        Undamped periods, s.
    damping : (n_damping,) ndarray
        Fractions of critical.
    sd, sv, sa, psv : (n_damping, n_periods) ndarray
        Relative displacement, m; relative velocity, m/s; absolute acceleration, m/s2; pseudo
        velocity, m/s.
    """

    channel: int
    periods: FloatArray
    damping: FloatArray
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
    if not text.lines[0].upper().startswith("RESPONSE AND FOURIER AMPLITUDE SPECTRA"):
        refuse(text, 0, "title", f"{quoted(text, 0, 60)} is not that of a volume 3")
    # A channel ends as those of the other volumes do
    spectra, line = [], 0
    while line < len(text.lines):
        channel, line = _spectra_channel(text, line)
        spectra.append(channel)
        line = _end_of_channel(text, line)
    return tuple(spectra)


def _spectra_channel(text: Text, first: int) -> tuple[OfficialSpectra, int]:
    """Return the spectra of a channel and the line after them."""
    header = read_header(text, first + 2, _VOLUME_3_LINES, _VOLUME_2_REALS)
    periods, dampings = _spectra_size(text, first + 2 + _VOLUME_3_LINES)
    # Dampings, periods, and the Fourier spectrum with its title, which is passed over
    damping = fixed_block(text, header.next_line, dampings, _SLOT_WIDTH, _SLOTS_PER_LINE)
    line = header.next_line + 1
    grid = _slots(text, line, periods)
    line += 2 * block_lines(_SLOTS, _SLOTS_PER_LINE) + 1
    # Arrays of every damping, (n_arrays, n_damping, n_periods)
    values = np.empty((_ARRAYS, dampings, periods))
    for index in range(dampings):
        values[:, index], line = _spectra_of_damping(text, line, damping[index], periods)
    return _in_si(header.channel, grid, damping, values), line


def _spectra_size(text: Text, line: int) -> tuple[int, int]:
    """Return the numbers of periods and dampings, which are among the header's integers."""
    integers = fixed_block(text, line, 100, 5, 16)
    periods, dampings = int(integers[67]), int(integers[68])
    if not 0 < periods <= _SLOTS or not 0 < dampings <= 8:
        refuse(text, line + 4, "periods, dampings", f"{periods} and {dampings}")
    return periods, dampings


def _slots(text: Text, line: int, periods: int) -> FloatArray:
    """Return the filled slots of an array."""
    return fixed_block(text, line, _SLOTS, _SLOT_WIDTH, _SLOTS_PER_LINE)[:periods]


def _spectra_of_damping(
    text: Text, line: int, damping: float, periods: int
) -> tuple[FloatArray, int]:
    """Return the arrays of one damping, (n_arrays, n_periods), and the line after them."""
    title = line_at(text, line, "damping").upper()
    if not title.startswith("DAMPING"):
        problem = f"expected the spectra of {damping:g}, got {title.strip()[:40]!r}"
        refuse(text, line, "damping", problem)
    # All arrays have as many lines
    values = np.empty((_ARRAYS, periods))
    for kind in range(_ARRAYS):
        values[kind] = _slots(text, line + 1, periods)
        line += block_lines(_SLOTS, _SLOTS_PER_LINE)
    return values, line + 1


def _in_si(
    channel: int, periods: FloatArray, damping: FloatArray, values: FloatArray
) -> OfficialSpectra:
    """Return spectra in SI from inches and fractions of gravity."""
    sd, sv, sa, psv = values[:4]
    return OfficialSpectra(
        channel, periods, damping, sd * _INCH, sv * _INCH, sa * STANDARD_GRAVITY, psv * _INCH
    )
