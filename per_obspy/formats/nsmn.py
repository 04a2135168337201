"""NSMN (Türkiye, AFAD's older ASCII): three columns, uncorrected, gal."""

import re
from typing import Any

import numpy as np
from obspy import Stream, UTCDateTime

from per_obspy.constants import GAL
from per_obspy.formats.text.conversions import metres, utc_from_words
from per_obspy.formats.text.fields import (
    Fields,
    count_field,
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
    free_block,
    head,
    line_at,
    read_text,
    refuse,
)
from per_obspy.formats.text.places import (
    Angle,
    decimal_angles,
    epicentre_place,
    station_place,
)
from per_obspy.formats.text.vocabulary import is_direction, orientation, trace

_TITLE = b"STRONG GROUND MOTION RECORDS OF TURKIYE"
_HEADER_LINES = 18
_PLACE = re.compile(rf"{DECIMAL}\s*+([NSEW])\s*+-\s*+{DECIMAL}\s*+([NSEW])")
_EVENT_TIME = re.compile(rf"(\d{{4}})/(\d{{1,2}})/(\d{{1,2}}) (\d{{1,2}}):(\d{{1,2}}):{DECIMAL}")
_RECORD_TIME = re.compile(rf"(\d{{1,2}})/(\d{{1,2}})/(\d{{4}}) (\d{{1,2}}):(\d{{1,2}}):{DECIMAL}")
_PEAKS = re.compile(rf"\(([NEU]-[SWD])\)\s*+{DECIMAL}")


def is_nsmn(file: WaveformFile) -> bool:
    """Check whether a file starts like a record of NSMN."""
    return head(file, len(_TITLE)) == _TITLE


def read_nsmn(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a record of NSMN: three components, m/s2."""
    text = read_text(file)
    fields = read_fields(text, _HEADER_LINES - 1)
    directions = _directions(text)
    # One column per component
    samples = count_field(text, fields, "NUMBER OF DATA")
    values = free_block(text, _HEADER_LINES, None, 3 * samples).reshape(-1, 3)
    dt = interval_field(text, fields, "SAMPLING INTERVAL (sec)")
    # Words of the header
    peaks = _peaks(fields)
    common = _common_words(text, fields)
    stream = Stream()
    for direction, column in zip(directions, values.T, strict=True):
        words = common | orientation(direction) | {"header_peak": peaks.get(direction)}
        stream.append(trace(np.ascontiguousarray(GAL * column), dt, words))
    return stream


def _directions(text: Text) -> list[str]:
    """Return the directions of the three columns."""
    directions = line_at(text, _HEADER_LINES - 1, "components").split()
    if len(directions) != 3 or not all(is_direction(orientation(name)) for name in directions):
        problem = f"expected three directions, got {directions}"
        refuse(text, _HEADER_LINES - 1, "components", problem)
    return directions


def _peaks(fields: Fields) -> dict[str, float]:
    """Return direction -> absolute peak of the header, m/s2."""
    peaks = _PEAKS.findall(text_field(fields, "RAW PGA VALUES (gal)") or "")
    return {direction: abs(float(peak)) * GAL for direction, peak in peaks}


def _common_words(text: Text, fields: Fields) -> dict[str, Any]:
    """Return the words that all components share."""
    words: dict[str, Any] = {"event": _event(text, fields)}
    words |= _station(text, fields, words["event"])
    words["starttime"] = _start(text, fields)
    return words | {"units": "m/s2", "quantity": "acceleration", "processing_level": "raw"}


def _angles(fields: Fields, name: str) -> tuple[Angle, Angle] | None:
    """Return latitude and longitude with their letters; None where there are none."""
    found = _PLACE.search(text_field(fields, name) or "")
    return decimal_angles(found) if found else None


def _station(text: Text, fields: Fields, epicentre: dict[str, Any]) -> dict[str, Any]:
    """Return codes, name, coordinates and instrument of the station."""
    elevation = number_field(text, fields, "STATION ALTITUDE (m)")
    angles = _angles(fields, "STATION COORDINATES")
    # The header names the recorder, not the sensor
    recorder = {
        "model": text_field(fields, "RECORDER TYPE"),
        "serial": text_field(fields, "RECORDER SERIAL NO"),
    }
    return {
        "network": "TK",
        "station": required_field(text, fields, "STATION ID").value,
        "station_name": text_field(fields, "PLACE"),
        "coordinates": station_place(*angles, epicentre, elevation) if angles else {},
        "instrument": recorder,
    }


def _event(text: Text, fields: Fields) -> dict[str, Any]:
    """Return origin time, hypocentre and magnitude of the event."""
    angles = _angles(fields, "EPICENTER COORDINATES")
    place = epicentre_place(*angles) if angles else {}
    time = _EVENT_TIME.match(text_field(fields, "EARTHQUAKE DATE") or "")
    # Depth in km; the kind of the magnitude follows its number
    depth = number_field(text, fields, "EARTHQUAKE DEPTH (km)")
    magnitude = re.match(DECIMAL, text_field(fields, "EARTHQUAKE MAGNITUDE") or "")
    return {
        "time": _moment(text, fields, "EARTHQUAKE DATE", time.groups()) if time else None,
        "latitude": place.get("latitude"),
        "longitude": place.get("longitude"),
        "depth": metres(depth),
        "magnitude": float(magnitude[1]) if magnitude else None,
    }


def _start(text: Text, fields: Fields) -> UTCDateTime | None:
    """Return the time of the first sample, whose day comes before month and year."""
    time = _RECORD_TIME.match(text_field(fields, "RECORD TIME") or "")
    if time is None:
        return None
    day, month, year, *clock = time.groups()
    return _moment(text, fields, "RECORD TIME", (year, month, day, *clock))


def _moment(text: Text, fields: Fields, name: str, words: tuple[str, ...]) -> UTCDateTime:
    """Return a time in UTC from the words of year, month, ... and second."""
    return utc_from_words(text, fields[name].line, name, words)
