"""USC (Los Angeles network): volume 1 (uncorrected) and volume 2 (corrected)."""

import re
from typing import Any

from obspy import Stream, Trace, UTCDateTime

from per_obspy.constants import GAL, STANDARD_GRAVITY
from per_obspy.formats.text.conversions import MONTHS, sexagesimal, utc
from per_obspy.formats.text.film import film_lines, read_film
from per_obspy.formats.text.lines import (
    DECIMAL,
    Text,
    WaveformFile,
    count,
    head_lines,
    line_at,
    quoted,
    read_text,
    refuse,
)
from per_obspy.formats.text.number_blocks import titled_block
from per_obspy.formats.text.places import Angle, epicentre_place, station_place
from per_obspy.formats.text.vocabulary import (
    corners,
    orientation,
    sensor_constants,
    trace,
)

_VOLUME_1 = re.compile(r"FILE\s++\d{1,12} OF UNCORRECTED ACCELEROGRAM DATA OF VOLUME I:")
_VOLUME_2 = "CORRECTED ACCELEROGRAM "
_VOLUME_1_LINES, _VOLUME_2_LINES = 27, 45
_ANGLE = r"(\d{1,3})\s++(\d{1,2})\s++(\d{1,2})([NSEW])"
_STATION = re.compile(rf"STATION USC#\s*+(\S+)\s++{_ANGLE},\s*+{_ANGLE}")
_EPICENTRE = re.compile(rf"EPICENTER\s*+-\s*+{_ANGLE},\s*+{_ANGLE}")
_DATE = re.compile(r"([A-Z]{3})\S*+ (\d{1,2}), (\d{4})\s*+-\s*+(\d\d)(\d\d) GMT")
_SENSOR = re.compile(rf"INSTR PERIOD\s*+=\s*+{DECIMAL}\s*+SEC\s++DAMPING\s*+=\s*+{DECIMAL}")
_POINTS = re.compile(r"NO\. OF POINTS\s*+=\s*+(\S+)")
_BANDS = re.compile(rf"BETWEEN\s*+{DECIMAL}-\s*+{DECIMAL} AND\s*+{DECIMAL}-\s*+{DECIMAL} HZ")
_PEAK = re.compile(rf"PEAK ACCELERATION =\s*+{DECIMAL}\s*+CMS?/SEC/SEC")


def is_usc(file: WaveformFile) -> bool:
    """Check whether a file starts like volume 1 or 2 of USC."""
    lines = head_lines(file, 200)
    corrected = lines[0].startswith(_VOLUME_2) and len(lines) > 2
    return bool(_VOLUME_1.match(lines[1 if corrected else 0]))


def read_usc(file: WaveformFile, **_unused: Any) -> Stream:
    """Read volume 1 or 2 of USC: acceleration of all components, m/s2."""
    text = read_text(file)
    stream, line = Stream(), 0
    while line < len(text.lines):
        corrected = text.lines[line].startswith(_VOLUME_2)
        component, line = _volume_2(text, line) if corrected else _volume_1(text, line)
        stream.append(component)
    return stream


def _volume_1(text: Text, first: int) -> tuple[Trace, int]:
    """Return a component of volume 1 and the line after it."""
    start = first + _VOLUME_1_LINES
    line_at(text, start, "samples")
    words = _words(text, first) | {"processing_level": "raw"}
    if not text.lines[first + 11].startswith("UNITS ARE SEC AND G/10"):
        refuse(text, first + 11, "unit", f"{quoted(text, first + 11, 40)} is not g/10")
    samples = _promised_samples(text, first + 10)
    # Digitised film, in g/10
    film = read_film(_shifted(text), start, samples)
    component = trace(STANDARD_GRAVITY / 10 * film.values, film.dt, words | film.words)
    return component, start + film_lines(samples)


def _promised_samples(text: Text, line: int) -> int:
    """Return the number of samples in the text of the header."""
    points = _POINTS.match(text.lines[line])
    if points is None:
        refuse(text, line, "number of points", f"{quoted(text, line)} gives none")
    return count(text, line, "number of points", points[1])


def _shifted(text: Text) -> Text:
    """Return the file without its first column, FORTRAN's blank for the line printer."""
    lines = [line[1:] if line.startswith(" ") else line for line in text.lines]
    return text._replace(lines=lines)


def _volume_2(text: Text, first: int) -> tuple[Trace, int]:
    """Return a component of volume 2 and the line after it."""
    line = first + _VOLUME_2_LINES
    line_at(text, line, "samples")
    words = _words(text, first + 1)
    if "CM/SEC/SEC" not in text.lines[line]:
        refuse(text, line, "unit", f"{quoted(text, line)} does not name cm/sec/sec")
    # Velocity and displacement follow the acceleration and must be whole
    values, dt, line = titled_block(text, line, "ACC", 8, 10)
    for kind in ("VEL", "DIS"):
        integral, _, line = titled_block(text, line, kind, 8, 10)
        if len(integral) != len(values):
            problem = f"{len(integral)} samples, acceleration has {len(values)}"
            refuse(text, line - 1, kind, problem)
    # Samples are in gal
    return trace(GAL * values, dt, words | _corrected_words(text, first)), line


def _corrected_words(text: Text, first: int) -> dict[str, Any]:
    """Return filter and peak of volume 2."""
    bands = _BANDS.search(text.lines[first + 14])
    peak = _PEAK.match(text.lines[first + 17])
    return {
        "processing_level": "processed",
        "corners": corners(bands, 2),
        "header_peak": abs(float(peak[1])) * GAL if peak else None,
    }


def _words(text: Text, first: int) -> dict[str, Any]:
    """Return the words of the lines that both volumes share."""
    lines = text.lines[first : first + 13]
    if not _VOLUME_1.match(lines[0]):
        refuse(text, first, "title", f"{quoted(text, first, 60)} is not that of a component")
    # Event, and station, whose place may need the epicentre; then the instrument
    event = _event(text, first, lines)
    words = {"units": "m/s2", "quantity": "acceleration", "event": event}
    words |= _station(lines, event)
    words["instrument"] = sensor_constants(_SENSOR.match(lines[9]))
    direction = re.match(r"COMP\s++(\S+)", lines[6])
    return words | (orientation(direction[1]) if direction else {})


def _station(lines: list[str], epicentre: dict[str, Any]) -> dict[str, Any]:
    """Return coordinates, code and name of the station."""
    station = _STATION.match(lines[4])
    # The name ends where two blanks or a line number follow
    name = re.split(r"\s{2,}|\d+$", lines[5].strip())[0]
    return {
        "coordinates": station_place(*_angles(station.groups()[1:]), epicentre) if station else {},
        "station": station[1] if station else None,
        "station_name": name or None,
    }


def _angles(parts: tuple[str, ...]) -> tuple[Angle, Angle]:
    """Return latitude and longitude from degrees, minutes, seconds and letter of each."""
    return Angle(sexagesimal(*parts[:3]), parts[3]), Angle(sexagesimal(*parts[4:7]), parts[7])


def _event(text: Text, first: int, lines: list[str]) -> dict[str, Any]:
    """Return name, origin time and epicentre of the event."""
    epicentre = _EPICENTRE.match(lines[8])
    place = epicentre_place(*_angles(epicentre.groups())) if epicentre else {}
    # The name ends where two blanks follow
    name = re.split(r"\s{2,}", lines[1].strip())[0]
    return {
        "name": name or None,
        "time": _origin(text, first + 2, _DATE.match(lines[2])),
        "latitude": place.get("latitude"),
        "longitude": place.get("longitude"),
    }


def _origin(text: Text, line: int, date: re.Match[str] | None) -> UTCDateTime | None:
    """Return the origin time; None where it is missing or its month is no English one."""
    if date is None or date[1] not in MONTHS:
        return None
    day = (int(date[3]), MONTHS.index(date[1]) + 1, int(date[2]))
    return utc(text, line, "date", day, (float(date[4]), float(date[5])))
