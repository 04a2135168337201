"""COSMOS 1.20: V0 (counts), V1 (uncorrected), V2 (corrected), and their variants with several channels a file."""

import re
from typing import Any, NamedTuple

from obspy import Stream, Trace, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.constants import GAL, STANDARD_GRAVITY
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    block_lines,
    count,
    fixed_block,
    head_lines,
    line_at,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import channel_code, coordinates, orientation, trace, utc

_TITLE = re.compile(
    r"(Raw|Uncorrected|Corrected) (acceleration|velocity|displacement)\b.*\(Format v0?1\.\d+ with (\d+) text lines\)"
)
_FORMAT = re.compile(r"Format\s*=\s*\(\s*(\d+)([IFE])(\d+)(?:\.\d+)?\s*\)")
_HEADER_NUMBERS = re.compile(r"\s*100 (Integer|Real)-header values follow on\s+(\d+) lines")
_COMMENTS = re.compile(r"\s*(\d{1,4}) Comment line\(s\) follow")
_SAMPLES = re.compile(rf"\s*(\d+)\s+.*?\bapprox\s+{DECIMAL}\s*secs?,\s*units=\s*([^(,]*?)\s*\(")
_CODE = re.compile(r"Code:\s*(\w+)-(\S+)\s*(.*)")
_SCNL = re.compile(r"\|<SCNL>(\w+)\.(\w+)\.(\w+)\.(\S+)")
_CHANNEL = re.compile(
    r"Sta Cha(?:n\s*\??|:)?\s*(?:\d+|\?)?\s*:?\s*(.*?)\s*\(Rcrdr Chan\s*(\w*|\?)\)(?:\s*Location:\s*(.*))?"
)
_FILTERED = re.compile(rf"below\s+{DECIMAL}\s*Hz.*above\s+{DECIMAL}\s*Hz")
_SERIAL = re.compile(r"Recorder:\s*(.*?)\s*s/n\s*(\S+)")
_TEXT_LINES = 13
_UNKNOWN = -999.0
#: unit of the samples -> unit in SI, factor
_UNITS = {
    "counts": ("counts", 1.0),
    "cm/sec2": ("m/s2", GAL),
    "cm/sec/sec": ("m/s2", GAL),
    "gal": ("m/s2", GAL),
    "g": ("m/s2", STANDARD_GRAVITY),
    "cm/sec": ("m/s", 0.01),
    "cm": ("m", 0.01),
}


class _Header(NamedTuple):
    first: int
    text_lines: list[str]
    integers: FloatArray
    reals: FloatArray
    comments: list[str]
    next_line: int


def is_cosmos(file: WaveformFile) -> bool:
    """Tell whether a file starts like COSMOS V0, V1 or V2 (not the spectra of V3)."""
    return bool(_TITLE.match(head_lines(file, 200)[0]))


def read_cosmos(file: WaveformFile, **_unused: Any) -> Stream:
    """Read COSMOS V0, V1 or V2: all channels, m/s2 (or m/s, m), or counts with their gain in ``calib``."""
    text = read_text(file)
    stream, line = Stream(), 0
    while line < len(text.lines):
        component, line = _channel(text, line)
        stream.append(component)
    return stream


def _channel(text: Text, first: int) -> tuple[Trace, int]:
    title = _TITLE.match(text.lines[first])
    if title is None:
        refuse(
            text,
            first,
            "title",
            f"{text.lines[first].strip()[:60]!r} is not that of a COSMOS time series",
        )
    header = _header(text, first, count(text, first, "text lines", title[3]))
    unit, values, line = _samples(text, header.next_line)
    if not re.match(r"/&|End-of-data", line_at(text, line, "end of data")):
        refuse(
            text,
            line,
            "end of data",
            f"expected it after the samples, got {text.lines[line].strip()[:40]!r}",
        )
    dt = _interval(text, header, len(values))
    words = _words(header) | {"starttime": _start(text, header), "event": _event(header)}
    words |= {
        "units": unit,
        "quantity": title[2],
        "processing_level": "processed" if title[1] == "Corrected" else "raw",
    }
    words.setdefault("channel", _channel_code(header, words, dt))
    words |= {"calib": _gain(text, header)} if unit == "counts" else {"corners": _corners(header)}
    peak = _real(header, 63)
    words["header_peak"] = (
        None if peak is None else abs(peak) * _UNITS[_unit_name(text, header.next_line)][1]
    )
    return trace(values, dt, words), line + 1


def _header(text: Text, first: int, text_lines: int) -> _Header:
    if text_lines < _TEXT_LINES:
        refuse(text, first, "text lines", f"{text_lines}, the format has {_TEXT_LINES}")
    line_at(text, first + text_lines, "integer header")
    line = first + text_lines
    integers, line = _numbers(text, line, "Integer")
    reals, line = _numbers(text, line, "Real")
    comments = _COMMENTS.match(line_at(text, line, "comments"))
    if comments is None:
        refuse(
            text,
            line,
            "comments",
            f"{text.lines[line].strip()[:40]!r} does not say how many lines follow",
        )
    stop = line + 1 + int(comments[1])
    line_at(text, stop, "samples")
    return _Header(
        first,
        text.lines[first : first + text_lines],
        integers,
        reals,
        text.lines[line + 1 : stop],
        stop,
    )


def _numbers(text: Text, line: int, kind: str) -> tuple[FloatArray, int]:
    title = line_at(text, line, f"{kind.lower()} header")
    promised, layout = _HEADER_NUMBERS.match(title), _FORMAT.search(title)
    if promised is None or layout is None or promised[1] != kind:
        refuse(
            text,
            line,
            f"{kind.lower()} header",
            f"{title.strip()[:60]!r} does not announce its values and format",
        )
    per_line, width = (count(text, line, "format", part) for part in (layout[1], layout[3]))
    values = fixed_block(text, line + 1, 100, width, per_line)
    return values, line + 1 + block_lines(100, per_line)


def _unit_name(text: Text, line: int) -> str:
    announced = _SAMPLES.match(text.lines[line])
    name = announced[3].lower() if announced else ""
    if name not in _UNITS:
        refuse(
            text, line, "units", f"{text.lines[line].strip()[:70]!r} is none of {', '.join(_UNITS)}"
        )
    return name


def _samples(text: Text, line: int) -> tuple[str, FloatArray, int]:
    unit, factor = _UNITS[_unit_name(text, line)]
    announced, layout = _SAMPLES.match(text.lines[line]), _FORMAT.search(text.lines[line])
    if announced is None or layout is None:
        refuse(
            text,
            line,
            "samples",
            f"{text.lines[line].strip()[:70]!r} announces no number and format",
        )
    samples = count(text, line, "number of samples", announced[1])
    per_line, width = (count(text, line, "format", part) for part in (layout[1], layout[3]))
    values = factor * fixed_block(text, line + 1, samples, width, per_line)
    return unit, values, line + 1 + block_lines(samples, per_line)


def _real(header: _Header, index: int) -> float | None:
    value = float(header.reals[index])
    return None if value == _UNKNOWN else value


def _interval(text: Text, header: _Header, samples: int) -> float:
    """Return the interval of the series, s; the recorder's own (real 34) may differ after resampling."""
    milliseconds, recorder = _real(header, 61), _real(header, 33)
    dt = recorder if milliseconds is None else milliseconds / 1000
    announced = _SAMPLES.match(text.lines[header.next_line])
    seconds = float(announced[2]) if announced else 0.0
    if dt is None or not 1e-5 <= dt <= 1e5 or abs(samples * dt - seconds) > 1 + 0.05 * seconds:
        refuse(
            text,
            header.next_line,
            "interval",
            f"{dt} s in the header, but {samples} samples last {seconds:g} s",
        )
    return dt


def _start(text: Text, header: _Header) -> UTCDateTime | None:
    year, month, day, hour, minute = (int(header.integers[index]) for index in (39, 41, 42, 43, 44))
    second = _real(header, 29)
    if _UNKNOWN in (year, month, day, hour, minute) or second is None:
        return None
    return utc(text, header.first + 7, "start time", (year, month, day), (hour, minute, second))


def _words(header: _Header) -> dict[str, Any]:
    """Codes (from the comment with SEED names, if there is one), place, instrument, orientation."""
    code = _CODE.search(header.text_lines[4])
    seed = next((found for comment in header.comments if (found := _SCNL.match(comment))), None)
    channel, serial = _CHANNEL.match(header.text_lines[8]), _SERIAL.match(header.text_lines[6])
    frequency, sensitivity = _real(header, 39), _real(header, 41)
    words: dict[str, Any] = {
        "network": code[1] if code else None,
        "station": code[2] if code else None,
        "station_name": re.sub(r"^\S+\s+", "", code[3]).strip() or None if code else None,
        "coordinates": coordinates(_real(header, 0), _real(header, 1), _real(header, 2)),
        "sensor_location": (channel[3] or None) if channel else None,
        "instrument": {
            "model": (serial[1] or None) if serial else None,
            "serial": serial[2] if serial and serial[2] != "?" else None,
            "natural_frequency": frequency,
            "damping": _real(header, 40),
            "sensitivity": None if sensitivity is None else sensitivity / STANDARD_GRAVITY,
        },
    }
    if seed:
        words |= {
            "network": seed[3],
            "station": seed[1],
            "channel": seed[2],
            "location": seed[4].replace("--", ""),
        }
    direction = orientation(channel[1]) if channel else {}
    if not direction and seed and seed[2].endswith("Z"):
        direction = {"sensor_dip": -90.0}
    return words | direction


def _channel_code(header: _Header, words: dict[str, Any], dt: float) -> str:
    code = channel_code(1 / dt, words)
    number = int(header.integers[50])
    return code if len(code) == 3 or number < 1 else f"{code}{number % 10}"


def _gain(text: Text, header: _Header) -> float:
    """Return m/s2 a count: microvolts a count over volts a g of the sensor and the recorder's gain."""
    step, sensitivity, gain = _real(header, 21), _real(header, 41), _real(header, 46)
    if not step or not sensitivity:
        refuse(
            text,
            header.first,
            "gain",
            f"unknown: {step} microvolts a count, sensor {sensitivity} V/g",
        )
    return 1e-6 * step / sensitivity * STANDARD_GRAVITY / (gain or 1.0)


def _corners(header: _Header) -> dict[str, float]:
    found = _FILTERED.search(header.text_lines[11])
    return {"highpass": float(found[1]), "lowpass": float(found[2])} if found else {}


def _event(header: _Header) -> dict[str, Any]:
    depth = _real(header, 11)
    magnitudes = [_real(header, index) for index in (12, 14, 13)]  # moment, local, surface wave
    return {
        "latitude": _real(header, 9),
        "longitude": _real(header, 10),
        "depth": None if depth is None else 1000 * depth,
        "magnitude": next((magnitude for magnitude in magnitudes if magnitude is not None), None),
    }
