"""CWB, now CWA (Taiwan): free-field records as text, time and three components, gal."""

import re
from typing import Any

import numpy as np
from obspy import Stream

from per_obspy.checks import FloatArray
from per_obspy.constants import GAL
from per_obspy.formats.text.header import CLOCK, Header, read_fields, scale
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    count,
    free_block,
    head,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import (
    Words,
    coordinates,
    gal_columns,
    is_direction,
    orientation,
)

_LENGTH = "RecordLength(sec)"
_TITLE = b"#Earthquake Information"
_COLUMNS = re.compile(r"Time\s++(\w)\(\+\);?\s*+(\w)\(\+\);?\s*+(\w)\(\+\)")
_TIME = re.compile(rf"(?P<year>\d{{4}})/(?P<month>\d{{1,2}})/(?P<day>\d{{1,2}})-{CLOCK}")
_EXTREMES = re.compile(rf"{DECIMAL}~\s*+{DECIMAL}")
_HOURS_AHEAD = 8.0
_TIME_ROUNDING = 0.001  # s, times have three decimals


def is_cwb(file: WaveformFile) -> bool:
    """Check whether a file starts like a record of CWB."""
    start = head(file, 100)
    return start.startswith(_TITLE) and b"#Origin Time(GMT+08):" in start


def read_cwb(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a record of CWB: three components, m/s2."""
    text = read_text(file)
    rows = enumerate(text.lines)
    first = next((line for line, row in rows if row.strip() and row[0] != "#"), None)
    if first is None:
        refuse(text, len(text.lines) - 1, "samples", "the file ends after its header")
    header = read_fields(text, first)
    directions = _directions(header)
    # The length of the record gives the number of samples
    dt = 1 / header.interval("SampleRate(Hz)")
    seconds = header.interval(_LENGTH)
    samples = count(text, header.line(_LENGTH), _LENGTH, str(round(seconds / dt)))
    # Columns of time and three components
    table = free_block(text, first, 4 * samples).reshape(-1, 4)
    _check_times(text, first, table[:, 0], dt)
    components = [orientation(name) | _peak(header, name) for name in directions]
    return gal_columns(table[:, 1:], dt, _common_words(header), components)


def _directions(header: Header) -> tuple[str, ...]:
    """Return the directions of the columns after time, which must be in gal."""
    unit, columns = header.required("AmplitudeUnit"), header.required("DataSequence")
    if not unit.startswith("gal"):
        header.refuse("AmplitudeUnit", f"{unit!r} is not gal")
    # All three must be directions
    names = _COLUMNS.match(columns)
    if names is None or not all(is_direction(orientation(name)) for name in names.groups()):
        header.refuse("DataSequence", f"{columns!r} is not time and three directions")
    return names.groups()


def _check_times(text: Text, first: int, times: FloatArray, dt: float) -> None:
    """Refuse times that are not the even ones of the header."""
    wrong = np.abs(times - times[0] - dt * np.arange(len(times))) > _TIME_ROUNDING
    if wrong.any():
        index = int(np.argmax(wrong))
        refuse(text, first + index, "time", f"{times[index]:g} s breaks the spacing of {dt:g} s")


def _peak(header: Header, direction: str) -> dict[str, float]:
    """Return the larger of the two extremes of a component, m/s2, as far as it is known."""
    extremes = _EXTREMES.match(header.word(f"AmplitudeMAX. {direction}") or "")
    if extremes is None:
        return {}
    return {"header_peak": GAL * max(abs(float(extreme)) for extreme in extremes.groups())}


def _common_words(header: Header) -> Words:
    """Return the words that all components share; clocks are eight hours ahead."""
    origin, start = (
        header.time(_TIME, f"{name}(GMT+08)", hours_ahead=_HOURS_AHEAD)
        for name in ("Origin Time", "StartTime")
    )
    hypocentre = header.numbers(
        latitude="EpicenterLatitude(N)",
        longitude="EpicenterLongitude(E)",
        depth="Depth(km)",
        magnitude="Magnitude(Ml)",
    )
    place = header.numbers(latitude="StationLatitude(N)", longitude="StationLongitude(E)")
    # Depth becomes metres
    return {
        "network": "TW",
        "station": header.required("StationCode"),
        "station_name": header.word("StationName"),
        "coordinates": coordinates(**place),
        "instrument": header.words(model="InstrumentKind"),
        "starttime": start,
        "processing_level": "raw",
        "event": {**hypocentre, "time": origin, "depth": scale(hypocentre["depth"], 1000)},
    }
