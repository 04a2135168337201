"""NSMN (Türkiye, AFAD's older ASCII): three columns, uncorrected, gal."""

import re
from typing import Any

from obspy import Stream

from per_obspy.constants import GAL
from per_obspy.formats.text.header import (
    CLOCK,
    Header,
    epicentre_place,
    number_in,
    place_pattern,
    read_fields,
    scale,
    station_place,
)
from per_obspy.formats.text.lines import (
    DECIMAL,
    NUMBER,
    WaveformFile,
    free_block,
    head,
    line_at,
    read_text,
    refuse,
)
from per_obspy.formats.text.vocabulary import Words, gal_columns, is_direction, orientation

_TITLE = b"STRONG GROUND MOTION RECORDS OF TURKIYE"
_HEADER_LINES = 18
_PLACE = re.compile(place_pattern(NUMBER, r"\s*+-\s*+"))
_EVENT_TIME = re.compile(rf"(?P<year>\d{{4}})/(?P<month>\d{{1,2}})/(?P<day>\d{{1,2}}) {CLOCK}")
_RECORD_TIME = re.compile(rf"(?P<day>\d{{1,2}})/(?P<month>\d{{1,2}})/(?P<year>\d{{4}}) {CLOCK}")
_PEAKS = re.compile(rf"\(([NEU]-[SWD])\)\s*+{DECIMAL}")
_MAGNITUDE = re.compile(DECIMAL)


def is_nsmn(file: WaveformFile) -> bool:
    """Check whether a file starts like a record of NSMN."""
    return head(file, len(_TITLE)) == _TITLE


def read_nsmn(file: WaveformFile, **_unused: Any) -> Stream:
    """Read a record of NSMN: three components, m/s2."""
    text = read_text(file)
    header = read_fields(text, _HEADER_LINES - 1)
    directions = line_at(text, _HEADER_LINES - 1, "components").split()
    if len(directions) != 3 or not all(is_direction(orientation(name)) for name in directions):
        problem = f"expected three directions, got {directions}"
        refuse(text, _HEADER_LINES - 1, "components", problem)
    # One column per component
    samples = header.samples("NUMBER OF DATA")
    values = free_block(text, _HEADER_LINES, 3 * samples).reshape(-1, 3)
    dt = header.interval("SAMPLING INTERVAL (sec)")
    # Peaks of the header, as far as it has them
    peaks = dict(_PEAKS.findall(header.word("RAW PGA VALUES (gal)") or ""))
    components = [
        orientation(name) | ({"header_peak": GAL * float(peaks[name])} if name in peaks else {})
        for name in directions
    ]
    return gal_columns(values, dt, _common_words(header), components)


def _common_words(header: Header) -> Words:
    """Return the words that all components share."""
    place = epicentre_place(_PLACE.search(header.word("EPICENTER COORDINATES") or ""))
    # The kind of the magnitude follows its number
    event = {
        "time": header.time(_EVENT_TIME, "EARTHQUAKE DATE"),
        **place,
        "depth": scale(header.number("EARTHQUAKE DEPTH (km)"), 1000),
        "magnitude": number_in(_MAGNITUDE.match(header.word("EARTHQUAKE MAGNITUDE") or "")),
    }
    elevation = header.number("STATION ALTITUDE (m)")
    site = _PLACE.search(header.word("STATION COORDINATES") or "")
    return {
        "network": "TK",
        "station": header.required("STATION ID"),
        "station_name": header.word("PLACE"),
        "coordinates": station_place(site, event, elevation),
        "instrument": header.words(model="RECORDER TYPE", serial="RECORDER SERIAL NO"),
        "starttime": header.time(_RECORD_TIME, "RECORD TIME"),
        "event": event,
        "processing_level": "raw",
    }
