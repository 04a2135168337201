"""CSMIP (CGS, formerly CDMG): RAW and volume 1 (uncorrected), volume 2 (corrected), volume 3 (official spectra)."""

import re
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from obspy import Stream, Trace

from per_obspy.checks import FloatArray
from per_obspy.constants import GAL, STANDARD_GRAVITY
from per_obspy.formats.text.csmip_header import Header, channel_name, known, read_header
from per_obspy.formats.text.film import pair_lines, read_pairs
from per_obspy.formats.text.lines import (
    Text,
    WaveformFile,
    block_lines,
    count,
    fixed_block,
    head,
    head_lines,
    line_at,
    read_text,
    refuse,
)
from per_obspy.formats.text.number_blocks import is_title, titled_block
from per_obspy.formats.text.vocabulary import trace

_INCH = 0.0254  # m
_UNITS = re.compile(r"UNITS OF UNCOR.*?\b(?:AND|IS)\s+(G/10|G)\b")
_PROMISED = re.compile(r"NO\. OF POINTS\s*=\s*(\S+)")
_UNITS_OF_UNCORRECTED = {"G": STANDARD_GRAVITY, "G/10": STANDARD_GRAVITY / 10}
_VOLUME_1_LINES, _VOLUME_1_REALS = 13, 50
_VOLUME_2_LINES, _VOLUME_2_REALS = 24, 100
_VOLUME_3_LINES = 28
_SLOTS = 100  # of every array of a volume 3, filled or not


def is_volume_1(file: WaveformFile) -> bool:
    """Tell whether a file starts like CSMIP RAW or volume 1."""
    start = head(file, 1200).upper()
    return (
        start.startswith(b"UNCORRECTED ACCELEROGRAM DATA")
        and b"UNITS OF UNCOR" in start
        and b"RENADIC" not in start
    )


def is_volume_2(file: WaveformFile) -> bool:
    """Tell whether a file starts like CSMIP volume 2."""
    lines = [line.upper() for line in head_lines(file, 200)]
    volumes = ("CORRECTED ACCELEROGRAM ", "UNCORRECTED ACCELEROGRAM DATA")
    return len(lines) > 2 and all(
        line.startswith(volume) for line, volume in zip(lines, volumes, strict=False)
    )


def read_volume_1(file: WaveformFile, **_unused: Any) -> Stream:
    """Read CSMIP RAW or volume 1: uncorrected acceleration of all channels, m/s2."""
    return _channels(read_text(file), _volume_1_channel)


def read_volume_2(file: WaveformFile, **_unused: Any) -> Stream:
    """Read CSMIP volume 2: corrected acceleration of all channels, m/s2."""
    return _channels(read_text(file), _volume_2_channel)


def _channels(text: Text, read_channel: Callable[[Text, int], tuple[Trace, int]]) -> Stream:
    stream, line = Stream(), 0
    while line < len(text.lines):
        component, line = read_channel(text, line)
        stream.append(component)
        line = _end_of_channel(text, line)
    return stream


def _end_of_channel(text: Text, line: int) -> int:
    if not line_at(text, line, "end of channel").startswith("/&"):
        refuse(
            text,
            line,
            "end of channel",
            f"expected '/&' after the samples, got {text.lines[line].strip()[:40]!r}",
        )
    return line + 1


def _volume_1_channel(text: Text, first: int) -> tuple[Trace, int]:
    header = read_header(text, first, _VOLUME_1_LINES, _VOLUME_1_REALS)
    factor = _uncorrected_unit(text, first + 11)
    promised = _PROMISED.match(text.lines[first + 10].strip().upper())
    if promised is None:
        refuse(
            text, first + 10, "number of points", f"{text.lines[first + 10].strip()!r} gives none"
        )
    samples = count(text, first + 10, "number of points", promised[1])
    if is_title(line_at(text, header.next_line, "samples")):
        values, dt, line = titled_block(text, header.next_line, "", 8, 9)
        if len(values) != samples:
            refuse(
                text,
                header.next_line,
                "number of points",
                f"{len(values)}, but {samples} on line {first + 11}",
            )
    else:
        values, dt = read_pairs(text, header.next_line, samples)
        line = header.next_line + pair_lines(samples)
    words = {"processing_level": "raw", "header_peak": _peak(header.reals[6], STANDARD_GRAVITY)}
    return _trace(factor * values, dt, header, words), line


def _volume_2_channel(text: Text, first: int) -> tuple[Trace, int]:
    header = read_header(text, first + 1, _VOLUME_2_LINES, _VOLUME_2_REALS)
    title = line_at(text, header.next_line, "title of acceleration").upper()
    if "CM/SEC2" not in title and "CM/SEC/SEC" not in title:
        refuse(text, header.next_line, "unit", f"{title.strip()!r} does not say cm/sec2")
    values, dt, line = titled_block(text, header.next_line, "ACCEL", 8, 10)
    for kind in ("VELOC", "DISPL"):
        others, _, line = titled_block(text, line, kind, 8, 10)
        if len(others) != len(values):
            refuse(text, line - 1, kind, f"{len(others)} samples, acceleration has {len(values)}")
    words = {
        "processing_level": "processed",
        "corners": {"highpass": known(header.reals[61]), "lowpass": known(header.reals[72])},
        "header_peak": _peak(header.reals[65], GAL),
    }
    return _trace(GAL * values, dt, header, words), line


def _trace(values: FloatArray, dt: float, header: Header, words: dict[str, Any]) -> Trace:
    words |= {"units": "m/s2", "quantity": "acceleration", "channel": channel_name(header, dt)}
    return trace(values, dt, header.words | words)


def _peak(value: float, factor: float) -> float | None:
    peak = known(value, factor)
    return None if peak is None else abs(peak)


def _uncorrected_unit(text: Text, line: int) -> float:
    unit = _UNITS.search(text.lines[line].upper())
    if unit is None:
        refuse(text, line, "unit", f"{text.lines[line].strip()!r} is neither g nor g/10")
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
    Read the spectra of a CSMIP volume 3 file, one entry a channel.

    Raises
    ------
    RecordRejected
        If the file is no volume 3 or lacks what its header promises.
    """
    text = read_text(file)
    if not text.lines[0].upper().startswith("RESPONSE AND FOURIER AMPLITUDE SPECTRA"):
        refuse(text, 0, "title", f"{text.lines[0].strip()[:60]!r} is not that of a volume 3")
    spectra, line = [], 0
    while line < len(text.lines):
        channel, line = _spectra_channel(text, line)
        spectra.append(channel)
        line = _end_of_channel(text, line)
    return tuple(spectra)


def _spectra_channel(text: Text, first: int) -> tuple[OfficialSpectra, int]:
    header = read_header(text, first + 2, _VOLUME_3_LINES, _VOLUME_2_REALS)
    integers = fixed_block(text, first + 2 + _VOLUME_3_LINES, 100, 5, 16)
    periods, dampings = int(integers[67]), int(integers[68])
    if not 0 < periods <= _SLOTS or not 0 < dampings <= 8:
        refuse(
            text, first + 2 + _VOLUME_3_LINES + 4, "periods, dampings", f"{periods} and {dampings}"
        )
    damping = fixed_block(text, header.next_line, dampings, 10, 8)
    line = header.next_line + 1
    grid = fixed_block(text, line, _SLOTS, 10, 8)[:periods]
    line += 2 * block_lines(_SLOTS, 8) + 1  # the Fourier spectrum and its title
    values = np.empty((7, dampings, periods))
    for index in range(dampings):
        title = line_at(text, line, "damping").upper()
        if not title.startswith("DAMPING"):
            refuse(
                text,
                line,
                "damping",
                f"expected the spectra of {damping[index]:g}, got {title.strip()[:40]!r}",
            )
        for kind in range(7):
            values[kind, index] = fixed_block(text, line + 1, _SLOTS, 10, 8)[:periods]
            line += block_lines(_SLOTS, 8)
        line += 1
    sd, sv, sa, psv = (
        values[0] * _INCH,
        values[1] * _INCH,
        values[2] * STANDARD_GRAVITY,
        values[3] * _INCH,
    )
    return OfficialSpectra(header.channel, grid, damping, sd, sv, sa, psv), line
