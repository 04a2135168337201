"""CWB, now CWA (Taiwan): free-field records as text, time and three components, gal."""

import re
from typing import Any

import numpy as np
from obspy import Stream, UTCDateTime

from per_obspy.constants import GAL
from per_obspy.formats.text.fields import (
    Fields,
    field,
    interval_field,
    number_field,
    read_fields,
    word_field,
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
from per_obspy.formats.text.vocabulary import coordinates, orientation, trace, utc

_TITLE = b"#Earthquake Information"
_COLUMNS = re.compile(r"Time\s+(\w)\(\+\);?\s*(\w)\(\+\);?\s*(\w)\(\+\)")
_TIME = re.compile(rf"(\d{{4}})/(\d{{1,2}})/(\d{{1,2}})-(\d{{1,2}}):(\d{{1,2}}):{DECIMAL}")
_EXTREMES = re.compile(rf"{DECIMAL}~\s*{DECIMAL}")
_HOURS_AHEAD = 8.0


def is_cwb(file: WaveformFile) -> bool:
    """Tell whether a file starts like a record of CWB."""
    start = head(file, 100)
    return start.startswith(_TITLE) and b"#Origin Time(GMT+08):" in start


def read_cwb(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a record of CWB: three components, m/s2."""
    text = read_text(file)
    first = next(
        (line for line, content in enumerate(text.lines) if content.strip() and content[0] != "#"),
        None,
    )
    if first is None:
        refuse(text, len(text.lines) - 1, "samples", "the file ends after its header")
    fields = read_fields(text, first)
    names = _columns(text, fields)
    dt = 1 / interval_field(text, fields, "SampleRate(Hz)")
    samples = _samples(text, fields, dt)
    table = free_block(text, first, None, 4 * samples).reshape(-1, 4)
    _check_times(text, first, table[:, 0], dt)
    common = _station(text, fields) | {
        "event": _event(text, fields),
        "starttime": _time(text, fields, "StartTime(GMT+08)"),
    }
    common |= {"units": "m/s2", "quantity": "acceleration", "processing_level": "raw"}
    return Stream(
        trace(
            np.ascontiguousarray(GAL * column),
            dt,
            common | orientation(name) | {"header_peak": _peak(fields, name)},
        )
        for name, column in zip(names, table.T[1:], strict=True)
    )


def _columns(text: Text, fields: Fields) -> tuple[str, ...]:
    unit, columns = field(text, fields, "AmplitudeUnit"), field(text, fields, "DataSequence")
    if not unit.value.startswith("gal"):
        refuse(text, unit.line, "AmplitudeUnit", f"{unit.value!r} is not gal")
    names = _COLUMNS.match(columns.value)
    if names is None or not all(orientation(name) for name in names.groups()):
        refuse(
            text,
            columns.line,
            "DataSequence",
            f"{columns.value!r} is not time and three directions",
        )
    return names.groups()


def _samples(text: Text, fields: Fields, dt: float) -> int:
    length = field(text, fields, "RecordLength(sec)")
    seconds = interval_field(text, fields, "RecordLength(sec)")
    return count(text, length.line, "RecordLength(sec)", str(round(seconds / dt)))


def _check_times(text: Text, first: int, times: np.ndarray, dt: float) -> None:
    """Refuse times that are not the even ones of the header; they have three decimals."""
    wrong = np.abs(times - times[0] - dt * np.arange(len(times))) > 0.001
    if wrong.any():
        index = int(np.argmax(wrong))
        refuse(text, first + index, "time", f"{times[index]:g} s breaks the spacing of {dt:g} s")


def _peak(fields: Fields, name: str) -> float | None:
    extremes = _EXTREMES.match(word_field(fields, f"AmplitudeMAX. {name}") or "")
    return GAL * max(abs(float(extremes[1])), abs(float(extremes[2]))) if extremes else None


def _station(text: Text, fields: Fields) -> dict[str, Any]:
    latitude, longitude = (
        number_field(text, fields, f"Station{name}") for name in ("Latitude(N)", "Longitude(E)")
    )
    return {
        "network": "TW",
        "station": field(text, fields, "StationCode").value,
        "station_name": word_field(fields, "StationName"),
        "coordinates": coordinates(latitude, longitude),
        "instrument": {"model": word_field(fields, "InstrumentKind")},
    }


def _event(text: Text, fields: Fields) -> dict[str, Any]:
    depth = number_field(text, fields, "Depth(km)")
    return {
        "time": _time(text, fields, "Origin Time(GMT+08)"),
        "latitude": number_field(text, fields, "EpicenterLatitude(N)"),
        "longitude": number_field(text, fields, "EpicenterLongitude(E)"),
        "depth": None if depth is None else 1000 * depth,
        "magnitude": number_field(text, fields, "Magnitude(Ml)"),
    }


def _time(text: Text, fields: Fields, name: str) -> UTCDateTime | None:
    time = _TIME.match(word_field(fields, name) or "")
    if time is None:
        return None
    year, month, day, hour, minute = (int(part) for part in time.groups()[:5])
    clock = (hour, minute, float(time[6]))
    return utc(text, fields[name].line, name, (year, month, day), clock, _HOURS_AHEAD)
