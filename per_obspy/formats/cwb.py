"""CWB, now CWA (Taiwan): free-field records as text, time and three components, gal."""

import re
from typing import Any

import numpy as np
from obspy import Stream, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.constants import GAL
from per_obspy.formats.text.conversions import metres, utc_from_words
from per_obspy.formats.text.fields import (
    Fields,
    interval_field,
    number_field,
    read_fields,
    required_field,
    text_field,
)
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
from per_obspy.formats.text.vocabulary import coordinates, is_direction, orientation, trace

_TITLE = b"#Earthquake Information"
_COLUMNS = re.compile(r"Time\s++(\w)\(\+\);?\s*+(\w)\(\+\);?\s*+(\w)\(\+\)")
_TIME = re.compile(rf"(\d{{4}})/(\d{{1,2}})/(\d{{1,2}})-(\d{{1,2}}):(\d{{1,2}}):{DECIMAL}")
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
    first = _first_sample(text)
    fields = read_fields(text, first)
    directions = _directions(text, fields)
    dt = 1 / interval_field(text, fields, "SampleRate(Hz)")
    samples = _samples(text, fields, dt)
    # Columns of time and three components
    table = free_block(text, first, None, 4 * samples).reshape(-1, 4)
    _check_times(text, first, table[:, 0], dt)
    common = _common_words(text, fields)
    # One trace per component
    stream = Stream()
    for direction, column in zip(directions, table.T[1:], strict=True):
        words = common | orientation(direction) | {"header_peak": _peak(fields, direction)}
        stream.append(trace(np.ascontiguousarray(GAL * column), dt, words))
    return stream


def _first_sample(text: Text) -> int:
    """Return the first line that is neither blank nor a part of the header."""
    lines = enumerate(text.lines)
    samples = (line for line, content in lines if content.strip() and content[0] != "#")
    first = next(samples, None)
    if first is None:
        refuse(text, len(text.lines) - 1, "samples", "the file ends after its header")
    return first


def _directions(text: Text, fields: Fields) -> tuple[str, ...]:
    """Return the directions of the columns after time, which must be in gal."""
    unit = required_field(text, fields, "AmplitudeUnit")
    columns = required_field(text, fields, "DataSequence")
    if not unit.value.startswith("gal"):
        refuse(text, unit.line, "AmplitudeUnit", f"{unit.value!r} is not gal")
    # All three must be directions
    names = _COLUMNS.match(columns.value)
    if names is None or not all(is_direction(orientation(name)) for name in names.groups()):
        problem = f"{columns.value!r} is not time and three directions"
        refuse(text, columns.line, "DataSequence", problem)
    return names.groups()


def _samples(text: Text, fields: Fields, dt: float) -> int:
    """Return the number of samples that fit the length of the record."""
    name = "RecordLength(sec)"
    length = required_field(text, fields, name)
    seconds = interval_field(text, fields, name)
    return count(text, length.line, name, str(round(seconds / dt)))


def _check_times(text: Text, first: int, times: FloatArray, dt: float) -> None:
    """Refuse times that are not the even ones of the header."""
    wrong = np.abs(times - times[0] - dt * np.arange(len(times))) > _TIME_ROUNDING
    if wrong.any():
        index = int(np.argmax(wrong))
        refuse(text, first + index, "time", f"{times[index]:g} s breaks the spacing of {dt:g} s")


def _peak(fields: Fields, direction: str) -> float | None:
    """Return the larger of the two extremes of a component, m/s2."""
    extremes = _EXTREMES.match(text_field(fields, f"AmplitudeMAX. {direction}") or "")
    if extremes is None:
        return None
    return GAL * max(abs(float(extremes[1])), abs(float(extremes[2])))


def _common_words(text: Text, fields: Fields) -> dict[str, Any]:
    """Return the words that all components share."""
    words = _station(text, fields) | {"event": _event(text, fields)}
    words["starttime"] = _time(text, fields, "StartTime(GMT+08)")
    return words | {"units": "m/s2", "quantity": "acceleration", "processing_level": "raw"}


def _station(text: Text, fields: Fields) -> dict[str, Any]:
    """Return codes, name, coordinates and instrument of the station."""
    latitude = number_field(text, fields, "StationLatitude(N)")
    longitude = number_field(text, fields, "StationLongitude(E)")
    return {
        "network": "TW",
        "station": required_field(text, fields, "StationCode").value,
        "station_name": text_field(fields, "StationName"),
        "coordinates": coordinates(latitude, longitude),
        "instrument": {"model": text_field(fields, "InstrumentKind")},
    }


def _event(text: Text, fields: Fields) -> dict[str, Any]:
    """Return origin time, hypocentre and local magnitude of the event."""
    depth = number_field(text, fields, "Depth(km)")
    return {
        "time": _time(text, fields, "Origin Time(GMT+08)"),
        "latitude": number_field(text, fields, "EpicenterLatitude(N)"),
        "longitude": number_field(text, fields, "EpicenterLongitude(E)"),
        "depth": metres(depth),
        "magnitude": number_field(text, fields, "Magnitude(Ml)"),
    }


def _time(text: Text, fields: Fields, name: str) -> UTCDateTime | None:
    """Return a time in UTC; clocks of the format are eight hours ahead."""
    time = _TIME.match(text_field(fields, name) or "")
    if time is None:
        return None
    return utc_from_words(text, fields[name].line, name, time.groups(), _HOURS_AHEAD)
