"""USGS SMC: one component a file, acceleration (cm/s2), velocity (cm/s) or displacement (cm)."""

import re
from datetime import UTC, datetime, timedelta
from typing import Any

from obspy import Stream, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.formats.text.lines import (
    Text,
    WaveformFile,
    block_lines,
    count,
    fixed_block,
    head_lines,
    interval,
    line_at,
    no_more,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import coordinates, horizontal, trace

_TEXT_LINES = 11
_INTEGERS, _REALS = 48, 50
_NO_INTEGER, _NO_REAL = -32768, 1e38
_TITLE = re.compile(
    r"[1-4] (UNCORRECTED ACCELEROGRAM|CORRECTED ACCELEROGRAM|VELOCITY|DISPLACEMENT)\s*"
)
_QUANTITIES = {"VELOCITY": ("velocity", "m/s"), "DISPLACEMENT": ("displacement", "m")}
_STATION = re.compile(r"station = (.*?)\s*component=")
_MODEL = re.compile(r"inst type=(.*?)\s+data source = (.*)")


def is_smc(file: WaveformFile) -> bool:
    """Tell whether a file starts like SMC."""
    lines = head_lines(file, 200)
    return len(lines) > 2 and bool(_TITLE.fullmatch(lines[0])) and lines[1].startswith("*")


def read_smc(file: WaveformFile, **_unused: Any) -> Stream:
    """Read SMC: one component, m/s2, m/s or m."""
    text = read_text(file)
    title = _TITLE.fullmatch(text.lines[0])
    if title is None:
        refuse(text, 0, "title", f"{text.lines[0].strip()!r} is not that of a time series")
    line_at(text, _TEXT_LINES, "integers")
    integers = fixed_block(text, _TEXT_LINES, _INTEGERS, 10, 8)
    reals = fixed_block(text, _TEXT_LINES + 6, _REALS, 15, 5)
    comments = 0 if integers[15] == _NO_INTEGER else int(integers[15])
    first = _TEXT_LINES + 16 + max(comments, 0)
    samples = count(text, _TEXT_LINES + 2, "number of samples", f"{integers[16]:g}")
    rate = interval(text, _TEXT_LINES + 6, "sampling rate", float(reals[1]))
    values = 0.01 * fixed_block(text, first, samples, 10, 8)
    no_more(text, first + block_lines(samples, 8), samples)
    quantity, unit = _QUANTITIES.get(title[1], ("acceleration", "m/s2"))
    level = "raw" if title[1].startswith("UNCORRECTED") else "processed"
    words = {
        "quantity": quantity,
        "units": unit,
        "processing_level": level,
        "starttime": _start(text, integers),
    }
    words |= _station(text, integers, reals) | _numbers(reals) | _direction(integers)
    return Stream([trace(values, 1 / rate, words)])


def _real(reals: FloatArray, index: int) -> float | None:
    return float(reals[index]) if abs(reals[index]) < _NO_REAL else None


def _start(text: Text, integers: FloatArray) -> UTCDateTime | None:
    """Return the time of the first sample from year, day of the year, hour, minute, second, millisecond."""
    year, day, hour, minute, second, millisecond = (int(value) for value in integers[1:7])
    if _NO_INTEGER in (year, day, hour, minute):
        return None
    parts = {"days": day - 1, "hours": hour, "minutes": minute}
    parts |= {"seconds": 0 if second == _NO_INTEGER else second}
    parts |= {"milliseconds": 0 if millisecond == _NO_INTEGER else millisecond}
    try:
        return UTCDateTime(datetime(year, 1, 1, tzinfo=UTC) + timedelta(**parts))
    except (ValueError, OverflowError) as error:
        refuse(text, _TEXT_LINES, "time", f"{year} day {day} is no date ({error})")


def _station(text: Text, integers: FloatArray, reals: FloatArray) -> dict[str, Any]:
    name, model = _STATION.match(text.lines[5]), _MODEL.match(text.lines[7])
    place = (_real(reals, 10), _real(reals, 11), _real(reals, 12))
    period = _real(reals, 21)
    station = int(integers[29])
    return {
        "network": "NP" if model and model[2].strip() == "USGS" else None,
        "station": text.lines[2].strip() if station == _NO_INTEGER else str(station),
        "station_name": name[1] if name else None,
        "coordinates": coordinates(*place),
        "instrument": {
            "model": model[1] if model else None,
            "natural_frequency": period,
            "damping": _real(reals, 22),
        },
    }


def _numbers(reals: FloatArray) -> dict[str, Any]:
    depth = _real(reals, 4)
    peaks = [abs(peak) * 0.01 for peak in (_real(reals, 29), _real(reals, 31)) if peak is not None]
    magnitudes = [_real(reals, index) for index in (5, 7, 6)]  # moment, local, surface wave
    return {
        "corners": {"highpass": _real(reals, 32), "lowpass": _real(reals, 34)},
        "header_peak": max(peaks, default=None),
        "event": {
            "latitude": _real(reals, 2),
            "longitude": _real(reals, 3),
            "depth": None if depth is None else 1000 * depth,
            "magnitude": next(
                (magnitude for magnitude in magnitudes if magnitude is not None), None
            ),
        },
    }


def _direction(integers: FloatArray) -> dict[str, float]:
    """Return the orientation: 0 is up and 180 down in the first number, 90 leaves the azimuth to the second."""
    vertical, azimuth = int(integers[12]), int(integers[13])
    if vertical in (0, 180):
        return {"sensor_dip": -90.0 if vertical == 0 else 90.0}
    return horizontal(float(azimuth)) if azimuth != _NO_INTEGER else {}
