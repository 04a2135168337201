"""The header of DYNA 1.x, which ESM and ITACA write and AFAD imitates."""

import re
from typing import Any

from obspy import Stream, UTCDateTime

from per_obspy.formats.text.conversions import first_known, metres, utc_from_words
from per_obspy.formats.text.fields import (
    Fields,
    count_field,
    interval_field,
    number_field,
    read_fields,
    required_field,
    text_field,
)
from per_obspy.formats.text.lines import DECIMAL, Text, free_block, refuse
from per_obspy.formats.text.vocabulary import channel_direction, coordinates, trace
from per_obspy.units import MotionUnit, motion_unit

_NAME = re.compile(r"[A-Z][A-Z0-9_/^]*:")
_TIME = re.compile(rf"(\d{{4}})/?(\d\d)/?(\d\d)[ _]?(\d\d):?(\d\d):?{DECIMAL}")
_MODEL = re.compile(r"sensor = (.*?)\s*+(?:\[.*?\])?\s*+(?:\||$)")
_START = "DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS"

#: words for an unknown ground, in lower case
_UNKNOWN = ("", "none", "unknown", "null", "nan", "-")


def read_dyna_text(text: Text, first: int) -> Stream:
    """Read one component whose header begins on the line ``first``."""
    stop = _header_end(text, first)
    fields = read_fields(text, stop)
    samples = count_field(text, fields, "NDATA")
    dt = interval_field(text, fields, "SAMPLING_INTERVAL_S")
    unit = _unit(text, fields)
    values = unit.factor * free_block(text, stop, None, samples)
    # Words of the header
    words = _station(text, fields) | {"units": unit.name, "quantity": unit.quantity}
    words["event"] = _event(text, fields)
    words |= _processing(text, fields)
    # The format has no azimuths, only the channel
    words |= channel_direction(text_field(fields, "STREAM") or "")
    words["starttime"] = _moment(text, fields, _START, text_field(fields, _START) or "")
    words["header_peak"] = _peak(text, fields, unit.name)
    return Stream([trace(values, dt, words, text.name)])


def _header_end(text: Text, first: int) -> int:
    """Return the line after the header."""
    stop = first
    while stop < len(text.lines) and _NAME.match(text.lines[stop]):
        stop += 1
    if stop == len(text.lines):
        refuse(text, stop - 1, "samples", "the file ends after its header")
    return stop


def _unit(text: Text, fields: Fields) -> MotionUnit:
    """Return the unit of the samples, which must fit the quantity."""
    field = required_field(text, fields, "UNITS")
    kind = required_field(text, fields, "DATA_TYPE")
    unit = motion_unit(field.value)
    if unit is None:
        refuse(text, field.line, "UNITS", f"{field.value!r} is none of cm/s^2, m/s^2, g, cm/s, cm")
    # A spectrum, for example, is in a unit of a quantity without being its time series
    if kind.value.lower() != unit.quantity:
        problem = f"{kind.value!r} is not a time series in {field.value}"
        refuse(text, kind.line, "DATA_TYPE", problem)
    return unit


def _peak(text: Text, fields: Fields, unit: str) -> float | None:
    """Return the peak of the header in m/s2; velocity and displacement have none."""
    peak = number_field(text, fields, "PGA_CM/S^2")
    if peak is None or unit != "m/s2":
        return None
    return abs(peak) * 0.01


def _station(text: Text, fields: Fields) -> dict[str, Any]:
    """Return codes, name, coordinates and instrument of the station."""
    location = text_field(fields, "LOCATION") or ""
    return {
        "network": text_field(fields, "NETWORK"),
        "station": required_field(text, fields, "STATION_CODE").value,
        "location": location if len(location) == 2 else None,
        "channel": text_field(fields, "STREAM"),
        "station_name": text_field(fields, "STATION_NAME"),
        "coordinates": _place(text, fields),
        "instrument": _instrument(text, fields),
        **_ground(text, fields),
    }


def _place(text: Text, fields: Fields) -> dict[str, float | None]:
    """Return the coordinates of the station, degrees and m."""
    latitude = number_field(text, fields, "STATION_LATITUDE_DEGREE")
    longitude = number_field(text, fields, "STATION_LONGITUDE_DEGREE")
    elevation = number_field(text, fields, "STATION_ELEVATION_M")
    return coordinates(latitude, longitude, elevation)


def _ground(text: Text, fields: Fields) -> dict[str, str | float | None]:
    """Return site class and Vs30, m/s; words as ``unknown`` and ``None`` are no ground."""
    site_class = text_field(fields, "SITE_CLASSIFICATION_EC8") or ""
    velocity = text_field(fields, "VS30_M/S") or ""
    measured = velocity.lower() not in _UNKNOWN
    vs30 = number_field(text, fields, "VS30_M/S") if measured else None
    # A velocity of 0 is how tables write an unknown one
    return {
        "site_class": None if site_class.lower() in _UNKNOWN else site_class,
        "vs30": vs30 if vs30 is not None and vs30 > 0 else None,
    }


def _instrument(text: Text, fields: Fields) -> dict[str, Any]:
    """Return model and constants of the sensor."""
    sensor = _MODEL.match(text_field(fields, "INSTRUMENT") or "")
    return {
        "model": sensor[1] or None if sensor else None,
        "natural_frequency": number_field(text, fields, "INSTRUMENTAL_FREQUENCY_HZ"),
        "damping": number_field(text, fields, "INSTRUMENTAL_DAMPING"),
    }


def _processing(text: Text, fields: Fields) -> dict[str, Any]:
    """Return the corners of the filter; a record without any was not processed."""
    corners = {
        "highpass": _corner(text, fields, "LOW_CUT_FREQUENCY_HZ"),
        "lowpass": _corner(text, fields, "HIGH_CUT_FREQUENCY_HZ"),
    }
    filtered = first_known(corners.values()) is not None
    return {"corners": corners, "processing_level": "processed" if filtered else "raw"}


def _corner(text: Text, fields: Fields, name: str) -> float | None:
    """Return a corner of the filter, Hz, which AFAD has under a name with a prefix."""
    corner = number_field(text, fields, name)
    return number_field(text, fields, f"AAD_{name}") if corner is None else corner


def _event(text: Text, fields: Fields) -> dict[str, Any]:
    """Return name, time, hypocentre and magnitude (moment, or else local) of the event."""
    date = text_field(fields, "EVENT_DATE_YYYYMMDD") or ""
    time = text_field(fields, "EVENT_TIME_HHMMSS") or ""
    # Depth is in km; the local magnitude counts only where there is no moment magnitude
    depth = number_field(text, fields, "EVENT_DEPTH_KM")
    moment = number_field(text, fields, "MAGNITUDE_W")
    return {
        "name": text_field(fields, "EVENT_NAME"),
        "time": _moment(text, fields, "EVENT_DATE_YYYYMMDD", f"{date} {time}"),
        "latitude": number_field(text, fields, "EVENT_LATITUDE_DEGREE"),
        "longitude": number_field(text, fields, "EVENT_LONGITUDE_DEGREE"),
        "depth": metres(depth),
        "magnitude": number_field(text, fields, "MAGNITUDE_L") if moment is None else moment,
    }


def _moment(text: Text, fields: Fields, name: str, words: str) -> UTCDateTime | None:
    """Return a time, or None where the words are not one."""
    time = _TIME.fullmatch(words)
    if time is None:
        return None
    return utc_from_words(text, fields[name].line, name, time.groups())
