"""UNAM's standard file of acceleration, version 2.0 (also CICESE and others in Mexico): up to twelve channels, gal."""

import re
from typing import Any

import numpy as np
from obspy import Stream, UTCDateTime

from per_obspy.constants import GAL
from per_obspy.formats.text.fields import (
    Field,
    Fields,
    count_field,
    field,
    number_field,
    word_field,
)
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    count,
    fixed_block,
    head,
    interval,
    no_more,
    number,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import coordinates, hemisphere, orientation, trace, utc

_MARK = b"ARCHIVO ESTANDAR DE ACELERACION"
_WIDTH = 10
_RULE = "---------+"
_DATE = re.compile(r"(\d{4})/(\d\d?)/(\d\d?)|(\d\d?) DE (\w+) DEL? (\d{4})")
_MONTHS = ("ENERO", "FEBRERO", "MARZO", "ABRIL", "MAYO", "JUNIO", "JULIO", "AGOSTO", "SEPTIEMBRE", "OCTUBRE",
           "NOVIEMBRE", "DICIEMBRE")  # fmt: skip
_CLOCK = re.compile(rf"(\d{{1,2}}):(\d{{1,2}}):{DECIMAL}")
_LATITUDE = re.compile(rf"{DECIMAL}\s*LAT\.?\s*([NS])")
_LONGITUDE = re.compile(rf"{DECIMAL}\s*LONG\.?\s*([EWO])")
_HALF_DAY = 43200.0  # s


def is_unam(file: WaveformFile) -> bool:
    """Tell whether a file starts like UNAM's standard file of acceleration."""
    start = head(file, 700)
    return start.startswith(b"*****") and _MARK in start


def read_unam(file: WaveformFile, **_unused: Any) -> Stream:
    """Read UNAM's standard file: uncorrected acceleration of all channels, m/s2."""
    text = read_text(file)
    first = _first_sample(text)
    fields = _fields(text, first)
    _gal(text, fields)
    channels = count_field(text, fields, "NUMERO DE CANALES")
    sizes = [
        count(text, *found)
        for found in _values(text, fields, "NUM. TOTAL DE MUESTRAS, C1-C6", channels)
    ]
    steps = [
        interval(text, *found)
        for found in _values(text, fields, "INTERVALO DE MUESTREO, C1-C6 (s)", channels)
    ]
    if len(set(sizes)) > 1 or len(set(steps)) > 1:
        refuse(
            text,
            0,
            "NUM. TOTAL DE MUESTRAS",
            f"channels must share length and interval, got {sizes}, {steps}",
        )
    values = fixed_block(text, first, sizes[0] * channels, _WIDTH, channels).reshape(-1, channels)
    _only_padding(text, first + sizes[0], sizes[0])
    names = [
        found[2]
        for found in _values(text, fields, "ORIENTACION C1-C6 (rumbo;orientacion)", channels)
    ]
    peaks = [
        abs(number(text, *found))
        for found in _values(text, fields, "ACEL. MAX.(Gal), C1-C6", channels)
    ]
    common = _station(text, fields) | _times(text, fields)
    common |= {"units": "m/s2", "quantity": "acceleration", "processing_level": "raw"}
    return Stream(
        trace(
            np.ascontiguousarray(GAL * column),
            steps[0],
            common | _direction(name) | {"header_peak": GAL * peak},
        )
        for name, column, peak in zip(names, values.T, peaks, strict=True)
    )


def _only_padding(text: Text, line: int, samples: int) -> None:
    """Refuse more samples than promised, unless they repeat the last one, with which older files are filled up."""
    if any(extra != text.lines[line - 1] for extra in text.lines[line:]):
        no_more(text, line, samples)


def _first_sample(text: Text) -> int:
    """Return the line after the second rule below the title of the samples."""
    rules = [line for line, content in enumerate(text.lines[:400]) if content.startswith(_RULE)]
    if len(rules) < 2 or rules[1] + 1 >= len(text.lines):
        refuse(text, len(text.lines) - 1, "DATOS DE ACELERACION", "the file has no samples")
    return rules[1] + 1


def _fields(text: Text, stop: int) -> dict[str, Field]:
    """Return the fields; institutions differ in blanks and brackets, and second lines of a field have no name."""
    fields: dict[str, Field] = {}
    last = ""
    for name, found in _lines(text, stop):
        if name:
            last = name
            fields.setdefault(name, found)
        elif last and found.value:
            fields.setdefault(f"{last} 2", found)
    return fields


def _lines(text: Text, stop: int) -> list[tuple[str, Field]]:
    named = []
    for line, content in enumerate(text.lines[:stop]):
        if len(content) > 39 and content[39] == ":":
            name = re.sub(r"\s+", " ", content[:39].strip()).replace("[", "(").replace("]", ")")
            named.append(
                (
                    name.replace(". (", ".(").replace("C6, (", "C6 ("),
                    Field(line, content[40:].strip()),
                )
            )
    return named


def _values(text: Text, fields: Fields, name: str, channels: int) -> list[tuple[int, str, str]]:
    """Return the values of all channels, which stand between slashes in two fields of six."""
    second = name.replace("C1-C6", "C7-C12")
    parts = (
        field(text, fields, name).value.split("/")[1:]
        + (word_field(fields, second) or "").split("/")[1:]
    )
    if len(parts) < channels:
        refuse(text, fields[name].line, name, f"{len(parts)} values for {channels} channels")
    return [(fields[name].line, name, part) for part in parts[:channels]]


def _gal(text: Text, fields: Fields) -> None:
    unit = field(text, fields, "UNIDADES DE LOS DATOS")
    if not unit.value.upper().startswith("GAL"):
        refuse(text, unit.line, "UNIDADES DE LOS DATOS", f"{unit.value!r} is not gal")


def _direction(words: str) -> dict[str, float]:
    """Return the orientation; a sign after the semicolon says whether up counts as positive."""
    word, _, sign = words.strip().partition(";")
    found = orientation(word)
    if sign.strip() == "-" and found.get("sensor_dip"):
        return {"sensor_dip": -found["sensor_dip"]}
    return found


def _place(fields: Fields, name: str) -> tuple[float | None, float | None]:
    latitude = _LATITUDE.match((word_field(fields, name) or "").upper())
    longitude = _LONGITUDE.match((word_field(fields, f"{name} 2") or "").upper())
    if latitude is None or longitude is None:
        return None, None
    west = longitude[2].replace("O", "W")  # oeste
    return hemisphere(latitude[1], latitude[2]), hemisphere(longitude[1], west)


def _station(text: Text, fields: Fields) -> dict[str, Any]:
    place = _place(fields, "COORDENADAS DE LA ESTACION")
    return {
        "station": field(text, fields, "CLAVE DE LA ESTACION").value,
        "station_name": word_field(fields, "NOMBRE DE LA ESTACION"),
        "coordinates": coordinates(*place, number_field(text, fields, "ALTITUD (msnm)")),
        "instrument": {
            "model": word_field(fields, "MODELO DEL ACELEROGRAFO"),
            "serial": word_field(fields, "NUMERO DE SERIE DEL ACELEROGRAFO"),
        },
    }


def _times(text: Text, fields: Fields) -> dict[str, Any]:
    """Return event and start; the date is the event's, and the record may begin on the other side of midnight."""
    latitude, longitude = _place(fields, "COORDENADAS DEL EPICENTRO")
    depth = number_field(
        text,
        fields,
        "PROFUNDIDAD FOCAL (Km)"
        if "PROFUNDIDAD FOCAL (Km)" in fields
        else "PROFUNDIDAD FOCAL (km)",
    )
    magnitudes = re.findall(rf"(M\w?)={DECIMAL}", word_field(fields, "MAGNITUD(ES)") or "")
    best = dict(reversed(magnitudes)).get("Mw", magnitudes[0][1] if magnitudes else None)
    event, start = (
        _moment(text, fields, name)
        for name in ("HORA EPICENTRO (GMT)", "HORA DE LA PRIMERA MUESTRA (GMT)")
    )
    if event is not None and start is not None and abs(start - event) > _HALF_DAY:
        start += 86400 if start < event else -86400
    words = {
        "time": event,
        "latitude": latitude,
        "longitude": longitude,
        "depth": None if depth is None else 1000 * depth,
        "magnitude": None if best is None else float(best),
    }
    return {"starttime": start, "event": words}


def _moment(text: Text, fields: Fields, name: str) -> UTCDateTime | None:
    date = _DATE.match((word_field(fields, "FECHA DEL SISMO (GMT)") or "").upper())
    clock = _CLOCK.match(word_field(fields, name) or "")
    if date is None or clock is None or (date[5] and date[5] not in _MONTHS):
        return None
    if date[5]:
        day = (int(date[6]), _MONTHS.index(date[5]) + 1, int(date[4]))
    else:
        day = (int(date[1]), int(date[2]), int(date[3]))
    return utc(
        text, fields[name].line, name, day, (float(clock[1]), float(clock[2]), float(clock[3]))
    )
