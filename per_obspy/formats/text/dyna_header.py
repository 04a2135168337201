"""The header of DYNA 1.x, which ESM and ITACA write and AFAD imitates."""

import re
from typing import Any

from obspy import Stream, UTCDateTime

from per_obspy.formats.text.fields import (
    Fields,
    count_field,
    field,
    interval_field,
    number_field,
    read_fields,
    word_field,
)
from per_obspy.formats.text.lines import DECIMAL, Text, free_block, refuse
from per_obspy.formats.text.vocabulary import coordinates, trace, utc

_NAME = re.compile(r"[A-Z][A-Z0-9_/^]*:")
_TIME = re.compile(rf"(\d{{4}})/?(\d\d)/?(\d\d)[ _]?(\d\d):?(\d\d):?{DECIMAL}")
_MODEL = re.compile(r"sensor = (.*?)\s*(?:\[.*?\])?\s*(?:\||$)")
#: unit of the header -> unit of the samples, factor
_UNITS = {
    "cm/s^2": ("m/s2", 0.01),
    "m/s^2": ("m/s2", 1.0),
    "cm/s": ("m/s", 0.01),
    "m/s": ("m/s", 1.0),
    "cm": ("m", 0.01),
    "m": ("m", 1.0),
}
_QUANTITIES = {"m/s2": "acceleration", "m/s": "velocity", "m": "displacement"}


def read_dyna_text(text: Text, first: int) -> Stream:
    """Read one component whose header begins on the line ``first``."""
    stop = _header_end(text, first)
    fields = read_fields(text, stop)
    samples = count_field(text, fields, "NDATA")
    dt = interval_field(text, fields, "SAMPLING_INTERVAL_S")
    unit, factor, quantity = _unit(text, fields)
    values = factor * free_block(text, stop, None, samples)
    words = _station(text, fields) | {
        "units": unit,
        "quantity": quantity,
        "event": _event(text, fields),
    }
    words |= _processing(text, fields) | _orientation(fields) | {"starttime": _start(text, fields)}
    peak = number_field(text, fields, "PGA_CM/S^2")
    words["header_peak"] = (
        abs(peak) * 0.01 if peak is not None and quantity == "acceleration" else None
    )
    return Stream([trace(values, dt, words)])


def _header_end(text: Text, first: int) -> int:
    stop = first
    while stop < len(text.lines) and _NAME.match(text.lines[stop]):
        stop += 1
    if stop == len(text.lines):
        refuse(text, stop - 1, "samples", "the file ends after its header")
    return stop


def _unit(text: Text, fields: Fields) -> tuple[str, float, str]:
    unit, kind = field(text, fields, "UNITS"), field(text, fields, "DATA_TYPE")
    if unit.value not in _UNITS:
        refuse(text, unit.line, "UNITS", f"{unit.value!r} is none of {', '.join(_UNITS)}")
    name, factor = _UNITS[unit.value]
    if kind.value.lower() != _QUANTITIES[name]:
        refuse(text, kind.line, "DATA_TYPE", f"{kind.value!r} is not a time series in {unit.value}")
    return name, factor, _QUANTITIES[name]


def _station(text: Text, fields: Fields) -> dict[str, Any]:
    sensor = _MODEL.match(word_field(fields, "INSTRUMENT") or "")
    location = word_field(fields, "LOCATION") or ""
    return {
        "network": word_field(fields, "NETWORK"),
        "station": field(text, fields, "STATION_CODE").value,
        "location": location if len(location) == 2 else None,
        "channel": word_field(fields, "STREAM"),
        "station_name": word_field(fields, "STATION_NAME"),
        "coordinates": coordinates(
            number_field(text, fields, "STATION_LATITUDE_DEGREE"),
            number_field(text, fields, "STATION_LONGITUDE_DEGREE"),
            number_field(text, fields, "STATION_ELEVATION_M"),
        ),
        "instrument": {
            "model": sensor[1] or None if sensor else None,
            "natural_frequency": number_field(text, fields, "INSTRUMENTAL_FREQUENCY_HZ"),
            "damping": number_field(text, fields, "INSTRUMENTAL_DAMPING"),
        },
    }


def _orientation(fields: Fields) -> dict[str, float]:
    """Tell the direction from the channel code: the format names no azimuth."""
    letters = {
        "N": {"sensor_azimuth": 0.0, "sensor_dip": 0.0},
        "E": {"sensor_azimuth": 90.0, "sensor_dip": 0.0},
    }
    return (letters | {"Z": {"sensor_dip": -90.0}}).get(
        (word_field(fields, "STREAM") or " ")[-1], {}
    )


def _processing(text: Text, fields: Fields) -> dict[str, Any]:
    """Corners of the filter; a record without any was not processed."""
    corners = {}
    for name, key in (("highpass", "LOW_CUT_FREQUENCY_HZ"), ("lowpass", "HIGH_CUT_FREQUENCY_HZ")):
        found = number_field(text, fields, key)
        corners[name] = number_field(text, fields, f"AAD_{key}") if found is None else found
    filtered = any(corner is not None for corner in corners.values())
    return {"corners": corners, "processing_level": "processed" if filtered else "raw"}


def _event(text: Text, fields: Fields) -> dict[str, Any]:
    date, time = (
        word_field(fields, "EVENT_DATE_YYYYMMDD") or "",
        word_field(fields, "EVENT_TIME_HHMMSS") or "",
    )
    depth = number_field(text, fields, "EVENT_DEPTH_KM")
    moment = number_field(text, fields, "MAGNITUDE_W")
    return {
        "name": word_field(fields, "EVENT_NAME"),
        "time": _moment(text, fields, "EVENT_DATE_YYYYMMDD", f"{date} {time}"),
        "latitude": number_field(text, fields, "EVENT_LATITUDE_DEGREE"),
        "longitude": number_field(text, fields, "EVENT_LONGITUDE_DEGREE"),
        "depth": None if depth is None else 1000 * depth,
        "magnitude": number_field(text, fields, "MAGNITUDE_L") if moment is None else moment,
    }


def _start(text: Text, fields: Fields) -> UTCDateTime | None:
    name = "DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS"
    return _moment(text, fields, name, word_field(fields, name) or "")


def _moment(text: Text, fields: Fields, name: str, words: str) -> UTCDateTime | None:
    time = _TIME.fullmatch(words)
    if time is None:
        return None
    year, month, day, hour, minute = (int(part) for part in time.groups()[:5])
    return utc(text, fields[name].line, name, (year, month, day), (hour, minute, float(time[6])))
