"""
UNAM's standard file of acceleration, version 2.0: up to twelve channels, gal.

CICESE and other institutions of Mexico write it too.
"""

import re
from typing import Any

import numpy as np
from obspy import Stream

from per_obspy.checks import FloatArray
from per_obspy.constants import GAL
from per_obspy.formats.text.header import (
    CLOCK,
    Header,
    HeaderField,
    epicentre_place,
    first_known,
    moment_first,
    scale,
    station_place,
)
from per_obspy.formats.text.lines import (
    DECIMAL,
    NUMBER,
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
from per_obspy.formats.text.vocabulary import Words, gal_columns, orientation

_MARK = b"ARCHIVO ESTANDAR DE ACELERACION"
_WIDTH = 10
_NAME_WIDTH = 39  # characters before the colon of a field
_LONGEST_HEADER = 400  # lines
_RULE = "---------+"
_UNITS = "UNIDADES DE LOS DATOS"
_SIZES, _STEPS = "NUM. TOTAL DE MUESTRAS, C1-C6", "INTERVALO DE MUESTREO, C1-C6 (s)"
_DIRECTIONS, _PEAKS = "ORIENTACION C1-C6 (rumbo;orientacion)", "ACEL. MAX.(Gal), C1-C6"
_PEAK_PLACES = "ACEL. MAX., C1-C6, EN LA MUESTRA"
_MISSING_LINES = 5  # at most, where peaks are earlier than in the header
#: a clock, and below it a date with a Spanish month, or one of numbers that begins with the year
_TIME = re.compile(
    rf"{CLOCK}.*\n(?:(?P<year>\d{{4}})/(?P<month>\d\d?)/(?P<day>\d\d?)|"
    r"(?P<day_>\d\d?) DE (?P<month_>ENERO|FEBRERO|MARZO|ABRIL|MAYO|JUNIO|JULIO|AGOSTO|SEPTIEMBRE|"
    r"OCTUBRE|NOVIEMBRE|DICIEMBRE) DEL? (?P<year_>\d{4}))",
    re.IGNORECASE,
)
#: latitude, and below it longitude; west is oeste
_PLACE = re.compile(
    rf"(?P<latitude>{NUMBER})\s*+LAT\.?\s*+(?P<north>[NSEWO]).*\n"
    rf"(?P<longitude>{NUMBER})\s*+LONG\.?\s*+(?P<east>[NSEWO])"
)
_MAGNITUDE = re.compile(rf"(M\w?)={DECIMAL}")
_DAY, _HALF_DAY = 86400, 43200.0  # s


def is_unam(file: WaveformFile) -> bool:
    """Check whether a file starts like UNAM's standard file of acceleration."""
    start = head(file, 700)
    return start.startswith(b"*****") and _MARK in start


def read_unam(file: WaveformFile, **_unused: Any) -> Stream:
    """Read UNAM's standard file: uncorrected acceleration of all channels, m/s2."""
    text = read_text(file)
    first = _first_sample(text)
    header = _header(text, first)
    # Other units have never been seen
    unit = header.required(_UNITS)
    if not unit.upper().startswith("GAL"):
        header.refuse(_UNITS, f"{unit!r} is not gal")
    # One column per channel, and in the header one value
    channels = header.samples("NUMERO DE CANALES")
    samples, dt = _size(header, channels)
    values = _samples(text, first, samples, channels)
    _refuse_missing_lines(header, values)
    directions, peaks = (_values(header, name, channels) for name in (_DIRECTIONS, _PEAKS))
    components = []
    for direction, peak in zip(directions, peaks, strict=True):
        largest = GAL * finite_number(text, header.line(_PEAKS), _PEAKS, peak)
        components.append(_direction(direction) | {"header_peak": largest})
    return gal_columns(values, dt, _common_words(header), components)


def _first_sample(text: Text) -> int:
    """Return the line after the second rule below the title of the samples."""
    lines = enumerate(text.lines[:_LONGEST_HEADER])
    rules = [line for line, content in lines if content.startswith(_RULE)]
    if len(rules) < 2 or rules[1] + 1 >= len(text.lines):
        refuse(text, len(text.lines) - 1, "DATOS DE ACELERACION", "the file has no samples")
    return rules[1] + 1


def _header(text: Text, stop: int) -> Header:
    """
    Return the fields of a header; a second line of a field has no name and is called ``NAME 2``.

    Institutions differ in blanks and brackets of the names.
    """
    fields: dict[str, HeaderField] = {}
    last = ""
    for line, content in enumerate(text.lines[:stop]):
        if content[_NAME_WIDTH : _NAME_WIDTH + 1] != ":":
            continue
        # Bring names to one spelling
        name = re.sub(r"\s+", " ", content[:_NAME_WIDTH].strip())
        name = name.replace("[", "(").replace("]", ")")
        name = name.replace(". (", ".(").replace("C6, (", "C6 (")
        field = HeaderField(line, content[_NAME_WIDTH + 1 :].strip())
        if name:
            last = name
            fields.setdefault(name, field)
        elif last and field.value:
            fields.setdefault(f"{last} 2", field)
    return Header(text, fields)


def _values(header: Header, name: str, channels: int) -> list[str]:
    """Return the values of all channels, which slashes separate in two fields of six each."""
    second = header.word(name.replace("C1-C6", "C7-C12")) or ""
    parts = header.required(name).split("/")[1:] + second.split("/")[1:]
    # Both fields begin with a slash
    if len(parts) < channels:
        header.refuse(name, f"{len(parts)} values for {channels} channels")
    return [part.strip() for part in parts[:channels]]


def _size(header: Header, channels: int) -> tuple[int, float]:
    """Return number of samples and interval, s, which all channels must share."""
    text, line = header.text, header.line
    sizes = [count(text, line(_SIZES), _SIZES, word) for word in _values(header, _SIZES, channels)]
    steps = [
        interval(text, line(_STEPS), _STEPS, word) for word in _values(header, _STEPS, channels)
    ]
    # Columns of the block cannot differ
    if len(set(sizes)) > 1 or len(set(steps)) > 1:
        problem = f"channels must share length and interval, got {sizes}, {steps}"
        refuse(text, 0, "NUM. TOTAL DE MUESTRAS", problem)
    return sizes[0], steps[0]


def _samples(text: Text, first: int, samples: int, channels: int) -> FloatArray:
    """
    Return the samples, (n_samples, n_channels), gal; refuse more than promised.

    Lines that repeat the last sample are accepted: older files are filled up with them.
    """
    values = fixed_block(text, first, samples * channels, _WIDTH, channels)
    end = first + samples
    if any(surplus != text.lines[end - 1] for surplus in text.lines[end:]):
        no_more(text, end, samples)
    return values.reshape(-1, channels)


def _refuse_missing_lines(header: Header, values: FloatArray) -> None:
    """
    Refuse peaks a few samples earlier than in the header: lines before them are missing.

    The lines that fill up a file would otherwise take their place in the count. Samples are counted
    from 1, in older files from 0; peaks elsewhere are those of another processing.
    """
    words = (header.word(_PEAK_PLACES) or "").split("/")[1:]
    if len(words) != values.shape[1] or not all(word.strip().isdecimal() for word in words):
        return
    # Shifts at which each channel has its peak: 0 or 1 in a whole file, the same in all channels
    columns = zip(words, np.abs(values).T, strict=True)
    shifts = [_peak_shifts(column, int(word[:12])) for word, column in columns]
    if all(shifts) and not {0, 1}.intersection(*shifts):
        problem = f"{header.word(_PEAK_PLACES)}, but lines before are missing"
        header.refuse(_PEAK_PLACES, problem)


def _peak_shifts(column: FloatArray, promised: int) -> set[int]:
    """Return by how many samples the peak of a channel is later than promised; few at most."""
    first = max(promised - 1 - _MISSING_LINES, 0)
    peaks = np.flatnonzero(column[first : promised + 1] == column.max())
    return {first + int(index) + 1 - promised for index in peaks}


def _direction(words: str) -> dict[str, float]:
    """Return the orientation; with a minus after the semicolon, down counts as positive."""
    word, _, sign = words.strip().partition(";")
    direction = orientation(word)
    if sign.strip() == "-" and direction.get("sensor_dip"):
        return {"sensor_dip": -direction["sensor_dip"]}
    return direction


def _common_words(header: Header) -> Words:
    """
    Return the words that all channels share.

    The date is the event's, and the record may begin on the other side of midnight.
    """
    origin, start = (
        header.time(_TIME, name, "FECHA DEL SISMO (GMT)")
        for name in ("HORA EPICENTRO (GMT)", "HORA DE LA PRIMERA MUESTRA (GMT)")
    )
    # More than half a day between them is a change of the date
    if origin is not None and start is not None and abs(start - origin) > _HALF_DAY:
        start += _DAY if start < origin else -_DAY
    # Institutions differ in the unit's capital letter
    depth = first_known(header.number(f"PROFUNDIDAD FOCAL ({unit})") for unit in ("Km", "km"))
    event = {
        "time": origin,
        **epicentre_place(_place(header, "COORDENADAS DEL EPICENTRO")),
        "depth": scale(depth, 1000),
        "magnitude": moment_first(_MAGNITUDE.findall(header.word("MAGNITUD(ES)") or "")),
    }
    # The format has no network codes
    site = _place(header, "COORDENADAS DE LA ESTACION")
    return {
        "station": header.required("CLAVE DE LA ESTACION"),
        "station_name": header.word("NOMBRE DE LA ESTACION"),
        "coordinates": station_place(site, event, header.number("ALTITUD (msnm)")),
        "instrument": header.words(
            model="MODELO DEL ACELEROGRAFO", serial="NUMERO DE SERIE DEL ACELEROGRAFO"
        ),
        "starttime": start,
        "event": event,
        "processing_level": "raw",
    }


def _place(header: Header, name: str) -> re.Match[str] | None:
    """Return latitude and longitude from the two lines of a field."""
    lines = (header.word(name) or "", header.word(f"{name} 2") or "")
    return _PLACE.match("\n".join(lines).upper())
