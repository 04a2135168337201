"""USC (Los Angeles network): volume 1 (uncorrected) and volume 2 (corrected)."""

import re
from typing import Any

from obspy import Stream, Trace

from per_obspy.constants import GAL, STANDARD_GRAVITY
from per_obspy.formats.text.header import (
    corners,
    epicentre_place,
    header_time,
    number_in,
    place_pattern,
    scale,
    station_place,
    word_in,
)
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    head_lines,
    line_at,
    match_line,
    read_text,
)
from per_obspy.formats.text.vocabulary import Words, orientation, read_components, trace
from per_obspy.formats.text.volumes import (
    corrected_blocks,
    promised_points,
    read_film,
    sensor_constants,
)

_VOLUME_1 = re.compile(r"^FILE\s++\d{1,12} OF UNCORRECTED ACCELEROGRAM DATA OF VOLUME I:")
_VOLUME_2 = "CORRECTED ACCELEROGRAM "
_VOLUME_1_LINES, _VOLUME_2_LINES = 27, 45
_VOLUME_1_UNIT = re.compile("^UNITS ARE SEC AND G/10")
_VOLUME_2_UNIT = re.compile("CM/SEC/SEC")
_PLACE = place_pattern(r"\d{1,3}\s++\d{1,2}\s++\d{1,2}", r",\s*+")
_STATION = re.compile(rf"STATION USC#\s*+(\S+)\s++{_PLACE}")
_EPICENTRE = re.compile(rf"EPICENTER\s*+-\s*+{_PLACE}")
_DATE = re.compile(
    r"(?P<month>[A-Z]{3})\S*+ (?P<day>\d{1,2}), (?P<year>\d{4})\s*+-\s*+"
    r"(?P<hour>\d\d)(?P<minute>\d\d) GMT"
)
_BANDS = re.compile(rf"BETWEEN\s*+{DECIMAL}-\s*+{DECIMAL} AND\s*+{DECIMAL}-\s*+{DECIMAL} HZ")
_PEAK = re.compile(rf"PEAK ACCELERATION =\s*+{DECIMAL}\s*+CMS?/SEC/SEC")
_DIRECTION = re.compile(r"COMP\s++(\S+)")


def is_usc(file: WaveformFile) -> bool:
    """Check whether a file starts like volume 1 or 2 of USC."""
    lines = head_lines(file, 200)
    corrected = lines[0].startswith(_VOLUME_2) and len(lines) > 2
    return bool(_VOLUME_1.match(lines[1 if corrected else 0]))


def read_usc(file: WaveformFile, **_unused: Any) -> Stream:
    """Read volume 1 or 2 of USC: acceleration of all components, m/s2."""
    return read_components(read_text(file), _component)


def _component(text: Text, first: int) -> tuple[Trace, int]:
    """Return a component and the line after it."""
    if text.lines[first].startswith(_VOLUME_2):
        return _volume_2(text, first)
    start = first + _VOLUME_1_LINES
    line_at(text, start, "samples")
    words = _words(text, first) | {"processing_level": "raw"}
    match_line(text, first + 11, "unit", _VOLUME_1_UNIT, "{} is not g/10")
    samples = promised_points(text, first + 10)
    # Digitised film below FORTRAN's blank for the line printer, in g/10
    rows = [row[1:] if row.startswith(" ") else row for row in text.lines]
    film = read_film(text._replace(lines=rows), start, samples)
    component = trace(STANDARD_GRAVITY / 10 * film.values, film.dt, words | film.words)
    return component, film.next_line


def _volume_2(text: Text, first: int) -> tuple[Trace, int]:
    """Return a component of volume 2 and the line after it."""
    line = first + _VOLUME_2_LINES
    line_at(text, line, "samples")
    words = _words(text, first + 1)
    match_line(text, line, "unit", _VOLUME_2_UNIT, "{} does not name cm/sec/sec")
    values, dt, line = corrected_blocks(text, line, ("ACC", "VEL", "DIS"))
    # Samples and peak are in gal
    words |= {
        "processing_level": "processed",
        "corners": corners(_BANDS.search(text.lines[first + 14]), 2),
        "header_peak": scale(number_in(_PEAK.match(text.lines[first + 17])), GAL),
    }
    return trace(GAL * values, dt, words), line


def _words(text: Text, first: int) -> Words:
    """Return the words of the lines that both volumes share."""
    lines = text.lines[first : first + 13]
    match_line(text, first, "title", _VOLUME_1, "{} is not that of a component")
    # Names end where two blanks follow, that of the station also before a line number
    event = {
        "name": re.split(r"\s{2,}", lines[1].strip())[0] or None,
        "time": header_time(text, first + 2, "date", _DATE.match(lines[2])),
        **epicentre_place(_EPICENTRE.match(lines[8])),
    }
    station = _STATION.match(lines[4])
    return {
        "event": event,
        "coordinates": station_place(station, event),
        "station": word_in(station),
        "station_name": re.split(r"\s{2,}|\d+$", lines[5].strip())[0] or None,
        "instrument": sensor_constants(lines[9]),
        **orientation(word_in(_DIRECTION.match(lines[6])) or ""),
    }
