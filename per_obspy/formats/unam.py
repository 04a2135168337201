"""
UNAM's standard file of acceleration, version 2.0: up to twelve channels, gal.

CICESE and other institutions of Mexico write it too.
"""

import re
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from obspy import Stream, UTCDateTime

from per_obspy.checks import FloatArray
from per_obspy.constants import GAL
from per_obspy.formats.text.conversions import metres, utc
from per_obspy.formats.text.fields import (
    Fields,
    HeaderField,
    count_field,
    number_field,
    required_field,
    text_field,
)
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    count,
    finite_number,
    fixed_block,
    head,
    interval,
    no_more,
    read_text,
    refuse,
)
from per_obspy.formats.text.places import Angle, epicentre_place, station_place
from per_obspy.formats.text.vocabulary import orientation, trace

_MARK = b"ARCHIVO ESTANDAR DE ACELERACION"
_WIDTH = 10
_NAME_WIDTH = 39  # characters before the colon of a field
_LONGEST_HEADER = 400  # lines
_RULE = "---------+"
_DATE = re.compile(r"(\d{4})/(\d\d?)/(\d\d?)|(\d\d?) DE (\w+) DEL? (\d{4})")
_MONTHS = (
    "ENERO",
    "FEBRERO",
    "MARZO",
    "ABRIL",
    "MAYO",
    "JUNIO",
    "JULIO",
    "AGOSTO",
    "SEPTIEMBRE",
    "OCTUBRE",
    "NOVIEMBRE",
    "DICIEMBRE",
)
_CLOCK = re.compile(rf"(\d{{1,2}}):(\d{{1,2}}):{DECIMAL}")
_LATITUDE = re.compile(rf"{DECIMAL}\s*+LAT\.?\s*+([NSEWO])")
_LONGITUDE = re.compile(rf"{DECIMAL}\s*+LONG\.?\s*+([NSEWO])")
_MAGNITUDE = re.compile(rf"(M\w?)={DECIMAL}")
_PEAK_PLACES = "ACEL. MAX., C1-C6, EN LA MUESTRA"
_MISSING_LINES = 5  # at most, where peaks are earlier than in the header
_DAY, _HALF_DAY = 86400, 43200.0  # s


class _ChannelValue(NamedTuple):
    """The value of one channel in a field of several: line and name of the field, and the value."""

    line: int
    name: str
    value: str


def is_unam(file: WaveformFile) -> bool:
    """Check whether a file starts like UNAM's standard file of acceleration."""
    start = head(file, 700)
    return start.startswith(b"*****") and _MARK in start


def read_unam(file: WaveformFile, **_unused: Any) -> Stream:
    """Read UNAM's standard file: uncorrected acceleration of all channels, m/s2."""
    text = read_text(file)
    first = _first_sample(text)
    fields = _fields(text, first)
    _require_gal(text, fields)
    channels = count_field(text, fields, "NUMERO DE CANALES")
    # One column per channel
    samples, dt = _size(text, fields, channels)
    values = _samples(text, first, samples, channels)
    _refuse_missing_lines(text, fields, values)
    directions = _values(text, fields, "ORIENTACION C1-C6 (rumbo;orientacion)", channels)
    peaks = _peaks(text, fields, channels)
    common = _common_words(text, fields)
    # One trace per channel
    stream = Stream()
    for direction, column, peak in zip(directions, values.T, peaks, strict=True):
        words = common | _direction(direction.value) | {"header_peak": GAL * peak}
        stream.append(trace(np.ascontiguousarray(GAL * column), dt, words))
    return stream


def _size(text: Text, fields: Fields, channels: int) -> tuple[int, float]:
    """Return number of samples and interval, s, which all channels must share."""
    sizes = [
        count(text, *channel)
        for channel in _values(text, fields, "NUM. TOTAL DE MUESTRAS, C1-C6", channels)
    ]
    steps = [
        interval(text, *channel)
        for channel in _values(text, fields, "INTERVALO DE MUESTREO, C1-C6 (s)", channels)
    ]
    # Columns of the block cannot differ
    if len(set(sizes)) > 1 or len(set(steps)) > 1:
        problem = f"channels must share length and interval, got {sizes}, {steps}"
        refuse(text, 0, "NUM. TOTAL DE MUESTRAS", problem)
    return sizes[0], steps[0]


def _samples(text: Text, first: int, samples: int, channels: int) -> FloatArray:
    """Return the samples, (n_samples, n_channels), gal."""
    values = fixed_block(text, first, samples * channels, _WIDTH, channels)
    _refuse_surplus(text, first + samples, samples)
    return values.reshape(-1, channels)


def _refuse_surplus(text: Text, line: int, samples: int) -> None:
    """
    Refuse more samples than promised.

    Lines that repeat the last sample are accepted: older files are filled up with them.
    """
    last = text.lines[line - 1]
    if any(surplus != last for surplus in text.lines[line:]):
        no_more(text, line, samples)


def _refuse_missing_lines(text: Text, fields: Fields, values: FloatArray) -> None:
    """
    Refuse peaks a few samples earlier than in the header: lines before them are missing.

    The lines that fill up a file would otherwise take their place in the count. Samples are counted
    from 1, in older files from 0; peaks elsewhere are those of another processing.
    """
    field = fields.get(_PEAK_PLACES)
    words = field.value.split("/")[1:] if field else []
    is_known = len(words) == values.shape[1] and all(word.strip().isdecimal() for word in words)
    if field is None or not is_known:
        return
    # Shifts at which each channel has its peak: 0 or 1 in a whole file, the same in all channels
    columns = zip(words, np.abs(values).T, strict=True)
    shifts = [_peak_shifts(column, int(word[:12])) for word, column in columns]
    common = {0, 1}.intersection(*shifts)
    if all(shifts) and not common:
        refuse(text, field.line, _PEAK_PLACES, f"{field.value}, but lines before are missing")


def _peak_shifts(column: FloatArray, promised: int) -> set[int]:
    """Return by how many samples the peak of a channel is later than promised; few at most."""
    first = max(promised - 1 - _MISSING_LINES, 0)
    peaks = np.flatnonzero(column[first : promised + 1] == column.max())
    return {first + int(index) + 1 - promised for index in peaks}


def _peaks(text: Text, fields: Fields, channels: int) -> list[float]:
    """Return the absolute peaks of the header, gal."""
    return [
        abs(finite_number(text, *channel))
        for channel in _values(text, fields, "ACEL. MAX.(Gal), C1-C6", channels)
    ]


def _first_sample(text: Text) -> int:
    """Return the line after the second rule below the title of the samples."""
    lines = enumerate(text.lines[:_LONGEST_HEADER])
    rules = [line for line, content in lines if content.startswith(_RULE)]
    if len(rules) < 2 or rules[1] + 1 >= len(text.lines):
        refuse(text, len(text.lines) - 1, "DATOS DE ACELERACION", "the file has no samples")
    return rules[1] + 1


def _fields(text: Text, stop: int) -> dict[str, HeaderField]:
    """Return the fields; a second line of a field has no name and is called ``NAME 2``."""
    fields: dict[str, HeaderField] = {}
    last = ""
    for name, field in _named_lines(text, stop):
        if name:
            last = name
            fields.setdefault(name, field)
        elif last and field.value:
            fields.setdefault(f"{last} 2", field)
    return fields


def _named_lines(text: Text, stop: int) -> Iterator[tuple[str, HeaderField]]:
    """Yield names and values; institutions differ in blanks and brackets of the names."""
    for line, content in enumerate(text.lines[:stop]):
        if len(content) > _NAME_WIDTH and content[_NAME_WIDTH] == ":":
            # Bring names to one spelling
            name = re.sub(r"\s+", " ", content[:_NAME_WIDTH].strip())
            name = name.replace("[", "(").replace("]", ")")
            name = name.replace(". (", ".(").replace("C6, (", "C6 (")
            yield name, HeaderField(line, content[_NAME_WIDTH + 1 :].strip())


def _values(text: Text, fields: Fields, name: str, channels: int) -> list[_ChannelValue]:
    """Return the values of all channels, which slashes separate in two fields of six each."""
    line, value = required_field(text, fields, name)
    second = text_field(fields, name.replace("C1-C6", "C7-C12")) or ""
    parts = value.split("/")[1:] + second.split("/")[1:]
    # Both fields begin with a slash
    if len(parts) < channels:
        refuse(text, line, name, f"{len(parts)} values for {channels} channels")
    return [_ChannelValue(line, name, part) for part in parts[:channels]]


def _require_gal(text: Text, fields: Fields) -> None:
    """Refuse another unit than gal."""
    unit = required_field(text, fields, "UNIDADES DE LOS DATOS")
    if not unit.value.upper().startswith("GAL"):
        refuse(text, unit.line, "UNIDADES DE LOS DATOS", f"{unit.value!r} is not gal")


def _direction(words: str) -> dict[str, float]:
    """Return the orientation; with a minus after the semicolon, down counts as positive."""
    word, _, sign = words.strip().partition(";")
    direction = orientation(word)
    if sign.strip() == "-" and direction.get("sensor_dip"):
        return {"sensor_dip": -direction["sensor_dip"]}
    return direction


def _angles(fields: Fields, name: str) -> tuple[Angle, Angle] | None:
    """Return latitude and longitude from the two lines of a field; None where one is missing."""
    latitude = _LATITUDE.match((text_field(fields, name) or "").upper())
    longitude = _LONGITUDE.match((text_field(fields, f"{name} 2") or "").upper())
    if latitude is None or longitude is None:
        return None
    # West is oeste in Spanish
    letters = [found[2].replace("O", "W") for found in (latitude, longitude)]
    return Angle(float(latitude[1]), letters[0]), Angle(float(longitude[1]), letters[1])


def _common_words(text: Text, fields: Fields) -> dict[str, Any]:
    """Return the words that all channels share."""
    words = _times(text, fields)
    words |= _station(text, fields, words["event"])
    return words | {"units": "m/s2", "quantity": "acceleration", "processing_level": "raw"}


def _station(text: Text, fields: Fields, epicentre: dict[str, Any]) -> dict[str, Any]:
    """Return code, name, coordinates and instrument of the station."""
    angles = _angles(fields, "COORDENADAS DE LA ESTACION")
    elevation = number_field(text, fields, "ALTITUD (msnm)")
    # The format has no network codes
    return {
        "station": required_field(text, fields, "CLAVE DE LA ESTACION").value,
        "station_name": text_field(fields, "NOMBRE DE LA ESTACION"),
        "coordinates": station_place(*angles, epicentre, elevation) if angles else {},
        "instrument": {
            "model": text_field(fields, "MODELO DEL ACELEROGRAFO"),
            "serial": text_field(fields, "NUMERO DE SERIE DEL ACELEROGRAFO"),
        },
    }


def _times(text: Text, fields: Fields) -> dict[str, Any]:
    """
    Return event and start.

    The date is the event's, and the record may begin on the other side of midnight.
    """
    angles = _angles(fields, "COORDENADAS DEL EPICENTRO")
    place = epicentre_place(*angles) if angles else {}
    depth = _depth(text, fields)
    magnitude = _magnitude(fields)
    origin = _moment(text, fields, "HORA EPICENTRO (GMT)")
    start = _moment(text, fields, "HORA DE LA PRIMERA MUESTRA (GMT)")
    # More than half a day between them is a change of the date
    if origin is not None and start is not None and abs(start - origin) > _HALF_DAY:
        start += _DAY if start < origin else -_DAY
    event = {
        "time": origin,
        "latitude": place.get("latitude"),
        "longitude": place.get("longitude"),
        "depth": depth,
        "magnitude": magnitude,
    }
    return {"starttime": start, "event": event}


def _depth(text: Text, fields: Fields) -> float | None:
    """Return the depth of the event, m; institutions differ in the unit's capital letter."""
    name = "PROFUNDIDAD FOCAL (Km)"
    if name not in fields:
        name = "PROFUNDIDAD FOCAL (km)"
    return metres(number_field(text, fields, name))


def _magnitude(fields: Fields) -> float | None:
    """Return the first moment magnitude, or else the first of any kind."""
    magnitudes = _MAGNITUDE.findall(text_field(fields, "MAGNITUD(ES)") or "")
    for kind, size in magnitudes:
        if kind == "Mw":
            return float(size)
    return float(magnitudes[0][1]) if magnitudes else None


def _moment(text: Text, fields: Fields, name: str) -> UTCDateTime | None:
    """Return a time on the date of the event; None where a part of it is missing."""
    date = _DATE.match((text_field(fields, "FECHA DEL SISMO (GMT)") or "").upper())
    clock = _CLOCK.match(text_field(fields, name) or "")
    if date is None or clock is None or (date[5] and date[5] not in _MONTHS):
        return None
    # The month is a Spanish name, or a number in a date that begins with the year
    if date[5]:
        day = (int(date[6]), _MONTHS.index(date[5]) + 1, int(date[4]))
    else:
        day = (int(date[1]), int(date[2]), int(date[3]))
    hour, minute, second = clock.groups()
    time_of_day = (float(hour), float(minute), float(second))
    return utc(text, fields[name].line, name, day, time_of_day)
