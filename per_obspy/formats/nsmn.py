"""NSMN (Türkiye, AFAD's older ASCII): three columns, uncorrected, gal."""

import re
from typing import Any

import numpy as np
from obspy import Stream, UTCDateTime

from per_obspy.constants import GAL
from per_obspy.formats.text.fields import (
    Fields,
    count_field,
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
    free_block,
    head,
    line_at,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import coordinates, hemisphere, orientation, trace, utc

_TITLE = b"STRONG GROUND MOTION RECORDS OF TURKIYE"
_HEADER_LINES = 18
_PLACE = re.compile(rf"{DECIMAL}\s*([NS])\s*-\s*{DECIMAL}\s*([EW])")
_EVENT_TIME = re.compile(rf"(\d{{4}})/(\d{{1,2}})/(\d{{1,2}}) (\d{{1,2}}):(\d{{1,2}}):{DECIMAL}")
_RECORD_TIME = re.compile(rf"(\d{{1,2}})/(\d{{1,2}})/(\d{{4}}) (\d{{1,2}}):(\d{{1,2}}):{DECIMAL}")
_PEAKS = re.compile(rf"\(([NEU]-[SWD])\)\s*{DECIMAL}")


def is_nsmn(file: WaveformFile) -> bool:
    """Tell whether a file starts like a record of NSMN."""
    return head(file, len(_TITLE)) == _TITLE


def read_nsmn(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a record of NSMN: three components, m/s2."""
    text = read_text(file)
    fields = read_fields(text, _HEADER_LINES - 1)
    names = line_at(text, _HEADER_LINES - 1, "components").split()
    if not all(orientation(name) for name in names) or len(names) != 3:
        refuse(text, _HEADER_LINES - 1, "components", f"expected three directions, got {names}")
    samples = count_field(text, fields, "NUMBER OF DATA")
    values = free_block(text, _HEADER_LINES, None, 3 * samples).reshape(-1, 3)
    dt = interval_field(text, fields, "SAMPLING INTERVAL (sec)")
    peaks = {
        name: abs(float(peak)) * GAL
        for name, peak in _PEAKS.findall(word_field(fields, "RAW PGA VALUES (gal)") or "")
    }
    common = _station(text, fields) | {
        "event": _event(text, fields),
        "starttime": _start(text, fields),
    }
    common |= {"units": "m/s2", "quantity": "acceleration", "processing_level": "raw"}
    return Stream(
        trace(
            np.ascontiguousarray(GAL * column),
            dt,
            common | orientation(name) | {"header_peak": peaks.get(name)},
        )
        for name, column in zip(names, values.T, strict=True)
    )


def _place(fields: Fields, name: str) -> tuple[float | None, float | None]:
    place = _PLACE.search(word_field(fields, name) or "")
    return (
        (hemisphere(place[1], place[2]), hemisphere(place[3], place[4])) if place else (None, None)
    )


def _station(text: Text, fields: Fields) -> dict[str, Any]:
    elevation = number_field(text, fields, "STATION ALTITUDE (m)")
    return {
        "network": "TK",
        "station": field(text, fields, "STATION ID").value,
        "station_name": word_field(fields, "PLACE"),
        "coordinates": coordinates(*_place(fields, "STATION COORDINATES"), elevation),
        "instrument": {
            "model": word_field(fields, "RECORDER TYPE"),
            "serial": word_field(fields, "RECORDER SERIAL NO"),
        },
    }


def _event(text: Text, fields: Fields) -> dict[str, Any]:
    latitude, longitude = _place(fields, "EPICENTER COORDINATES")
    time = _EVENT_TIME.match(word_field(fields, "EARTHQUAKE DATE") or "")
    depth = number_field(text, fields, "EARTHQUAKE DEPTH (km)")
    magnitude = re.match(DECIMAL, word_field(fields, "EARTHQUAKE MAGNITUDE") or "")
    return {
        "time": _moment(text, fields, "EARTHQUAKE DATE", time.groups()) if time else None,
        "latitude": latitude,
        "longitude": longitude,
        "depth": None if depth is None else 1000 * depth,
        "magnitude": float(magnitude[1]) if magnitude else None,
    }


def _start(text: Text, fields: Fields) -> UTCDateTime | None:
    time = _RECORD_TIME.match(word_field(fields, "RECORD TIME") or "")
    if time is None:
        return None
    day, month, year, *clock = time.groups()
    return _moment(text, fields, "RECORD TIME", (year, month, day, *clock))


def _moment(text: Text, fields: Fields, name: str, parts: tuple[str, ...]) -> UTCDateTime:
    year, month, day, hour, minute = (int(part) for part in parts[:5])
    return utc(text, fields[name].line, name, (year, month, day), (hour, minute, float(parts[5])))
