"""
The words that every format plugin puts into ``trace.stats``.

network, station, location
    Codes of the header; the location separates the instruments of one station.
channel
    SEED code from sampling rate and orientation, with instrument code N (accelerometer).
starttime, delta
    UTC; s. Unknown: 1970-01-01, ObsPy's default; a date without a time gives midnight.
units
    ``"m/s2"``, ``"m/s"``, ``"m"``, or ``"counts"`` with the gain in ``calib`` (m/s2 per count).
quantity
    ``"acceleration"``, ``"velocity"`` or ``"displacement"``.
processing_level
    ``"raw"`` or ``"processed"``.
coordinates
    latitude, longitude (degrees), elevation (m).
coordinates_source, coordinates_conflict
    Name of the table of stations, ``"header"`` or ``"StationXML"``; text with the places of other
    sources that are more than 1 km away (``records/metadata.py``).
sensor_location
    Place in the structure or the ground, as the header has it.
sensor_azimuth, sensor_dip
    Degrees clockwise from north (horizontals only); degrees down from horizontal (0; up is -90).
direction
    Direction in the words of the file, where these give no azimuth: ``L``, ``TRAN``, ``HN1``.
corners
    highpass, lowpass: corners of the filter that was applied, Hz.
instrument
    model, serial, natural_frequency (Hz), damping (fraction of critical), sensitivity (V/(m/s2)).
event
    name, time (UTC), latitude, longitude (degrees), depth (m), magnitude.
station_name
    As the header has it.
site_class, vs30
    Of the ground as the metadata have it: any word; m/s.
digitised
    True where the record was digitised from film.
simulated
    True where the motion is simulated; absent from records of real ground motion.
header_peak
    Largest absolute value according to the header, in ``units``.
processing
    Notes of the reader, one line each: changes and uncertainties. Later steps follow.

A word that a file does not hold is absent: never a guess, never zero. Coordinates 0, 0 are what
files write for unknown.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from obspy import Stream, Trace
from obspy.core import AttribDict

from per_obspy.checks import FloatArray
from per_obspy.constants import (
    COMPASS_AZIMUTHS,
    GAL,
    HORIZONTAL_LETTERS,
    SEED_CODE,
    VERTICAL_DIPS,
)
from per_obspy.formats.text.lines import Text

#: words of the vocabulary -> their values
Words = dict[str, Any]

#: words that can name a file
_CODES = {"network", "station", "location", "channel"}

#: letters around the angle of a direction as ``N21E`` -> azimuth of the first, turn to the second
_QUADRANTS = {"NE": (0.0, 1.0), "NW": (360.0, -1.0), "SE": (180.0, -1.0), "SW": (180.0, 1.0)}
_QUADRANT = re.compile(r"([NS])\s*+(\d{1,2}(?:\.\d*)?)\s*+([EW])")
_DEGREES = re.compile(r"\d{1,3}(\.\d*)?")

#: numbers of components; last letters of SEED codes of horizontals; azimuths and last letters of
#: SEED codes in names of files
_NUMBERS = tuple("123")
_HORIZONTAL_CODES = tuple("NE12LTRHXY")
_FILE_AZIMUTH = re.compile(r"000|0[1-9]\d|[12]\d\d|3[0-5]\d|360")
_FILE_NUMBER = re.compile(r"(H|HOR|[A-Z][GHLMN])[12]")
_FILE_CODES = tuple("NEZ12")
#: words before a direction
_COMPONENT = re.compile(r"COMP(ONENT)?\b[\s.:]*+")

#: smallest sampling rate, Hz -> band code of SEED
_BANDS = ((1000.0, "F"), (250.0, "C"), (80.0, "H"), (10.0, "B"), (0.0, "M"))

#: largest angle from north or east at which a channel is called N or E, degrees
_AXIS_TOLERANCE = 5


def orientation(words: str) -> Words:
    """
    Return ``sensor_azimuth``, ``sensor_dip``, ``direction`` of ``N21E``, ``NS``, ``UP``, ``LONG``.

    A word without an azimuth is the ``direction``; an unknown or numbered one has no dip either, as
    it may be that of the vertical. No word gives an empty mapping. A single 1, 2 or 3 is a number,
    not an azimuth.

    >>> orientation("S 16 E"), orientation("270 DEG")
    ({'sensor_azimuth': 164.0, 'sensor_dip': 0.0}, {'sensor_azimuth': 270.0, 'sensor_dip': 0.0})
    >>> orientation("Up"), orientation("HNZ")
    ({'sensor_dip': -90.0}, {'sensor_dip': -90.0})
    >>> orientation("Tran"), orientation("Othr")
    ({'direction': 'TRAN', 'sensor_dip': 0.0}, {'direction': 'OTHR'})
    """
    text = _COMPONENT.sub("", words.strip().upper())
    word = text.removesuffix("DEG").rstrip(" .")
    # Vertical sensors and points of the compass
    if word in VERTICAL_DIPS:
        return {"sensor_dip": VERTICAL_DIPS[word]}
    if word in COMPASS_AZIMUTHS:
        return horizontal(COMPASS_AZIMUTHS[word])
    # An angle from north or south towards east or west
    if quadrant := _QUADRANT.fullmatch(word):
        start, sign = _QUADRANTS[quadrant[1] + quadrant[3]]
        return horizontal(start + sign * float(quadrant[2]))
    # A full azimuth in degrees
    if _DEGREES.fullmatch(word) and float(word) <= 360 and text not in _NUMBERS:
        return horizontal(float(word))
    return _without_azimuth(re.sub(r"[^A-Z0-9]+", "", word))


def _without_azimuth(word: str) -> Words:
    """Return the direction of a word that has no azimuth."""
    if not word:
        return {}
    letter = _letter(word)
    if letter == "Z":
        return {"sensor_dip": -90.0}
    # U, V and W may be three inclined sensors; 1, 2, 3 and A, B, C any direction
    is_numbered = letter in _NUMBERS and (word in _NUMBERS or word not in HORIZONTAL_LETTERS)
    is_horizontal = not is_numbered and letter in _HORIZONTAL_CODES
    return {"direction": word} | ({"sensor_dip": 0.0} if is_horizontal else {})


def is_direction(words: Mapping[str, Any]) -> bool:
    """Return whether an orientation is a vertical, or a horizontal such as HN1 and HN2."""
    return "sensor_dip" in words or _letter(str(words.get("direction", ""))) in ("1", "2")


def _letter(word: str) -> str:
    """Return the last letter of a channel code for a word without an azimuth; empty if unknown."""
    known = word if word in HORIZONTAL_LETTERS else word.rstrip("0123456789")
    if known in HORIZONTAL_LETTERS:
        return HORIZONTAL_LETTERS[known]
    return word[-1] if re.fullmatch(SEED_CODE, word) or word in _NUMBERS else ""


def channel_direction(code: str) -> Words:
    """
    Return the direction of a channel code, of which N and E are azimuths as well.

    >>> channel_direction("HNE"), channel_direction("TRAN")
    ({'sensor_azimuth': 90.0, 'sensor_dip': 0.0}, {'direction': 'TRAN', 'sensor_dip': 0.0})
    """
    if re.fullmatch(SEED_CODE, code) and code not in HORIZONTAL_LETTERS and code[-1] in "NE":
        return horizontal(COMPASS_AZIMUTHS[code[-1]])
    return orientation(code)


def file_direction(name: str) -> Words:
    """
    Return the direction at the end of a file's name, for headers that have none.

    It is the suffix, the whole name, or follows ``-``, ``_``, ``.`` or a blank; a code of SEED may
    follow letters. Numbers must be azimuths of three digits from 010 on, or 000, and no whole
    names: files are numbered as well.

    >>> file_direction("OLD--L.AT2"), file_direction("HILLHNZ.AT2"), file_direction("CBGS.ver")
    ({'direction': 'L', 'sensor_dip': 0.0}, {'sensor_dip': -90.0}, {'sensor_dip': -90.0})
    >>> file_direction("ELC_180.AT2"), file_direction("record_003.at2")
    ({'sensor_azimuth': 180.0, 'sensor_dip': 0.0}, {})
    """
    stem, _, suffix = re.split(r"[/\\]", name)[-1].upper().rpartition(".")
    words = [suffix if len(suffix) > 1 else "", *re.split(r"[-_. ]+", stem)[-1:]]
    for word in words:
        is_azimuth = word != stem and _FILE_AZIMUTH.fullmatch(word)
        is_numbered = word[-1:].isdigit() and not (is_azimuth or _FILE_NUMBER.fullmatch(word))
        direction = {} if is_numbered else orientation(word)
        if is_direction(direction):
            return direction
    # Without a separator only a whole code of SEED is no part of a name
    code = re.search(rf"{SEED_CODE}$", stem)
    return orientation(code[0]) if code and code[0][-1] in _FILE_CODES else {}


def horizontal(azimuth: float) -> dict[str, float]:
    """Return the words of a horizontal sensor, degrees clockwise from north."""
    return {"sensor_azimuth": azimuth % 360, "sensor_dip": 0.0}


def channel_code(sampling_rate: float, orientation: Mapping[str, Any]) -> str:
    """
    Return the SEED code of an accelerometer's channel.

    North and east within 5 degrees are N and E; otherwise 1 is the horizontal nearer to the
    north-south line. Without an azimuth it is the letter of the component: N, E, L, T, 1. An
    unknown orientation gives only band and instrument.

    >>> channel_code(200, horizontal(0)), channel_code(50, horizontal(118))
    ('HNN', 'BN2')
    >>> channel_code(100, {"sensor_dip": -90}), channel_code(100, {"direction": "TRAN"})
    ('HNZ', 'HNT')
    """
    band = next(code for rate, code in _BANDS if round(sampling_rate, 3) >= rate)
    if abs(orientation.get("sensor_dip", 0.0)) == 90:
        return f"{band}NZ"
    if "sensor_azimuth" not in orientation:
        return f"{band}N{_letter(orientation.get('direction', ''))}"
    azimuth = orientation["sensor_azimuth"]
    for letter, axis in (("N", 0.0), ("E", 90.0)):
        # Angle between sensor and axis, from 0 to 180 degrees
        if abs((azimuth - axis + 180) % 360 - 180) <= _AXIS_TOLERANCE:
            return f"{band}N{letter}"
    # From 135 to 45 degrees through north; the tolerance keeps both ends from one letter
    return f"{band}N{1 if (azimuth + 45 - 1e-7) % 180 < 90 else 2}"


def trace(samples: FloatArray, dt: float, words: Mapping[str, Any], file: str = "") -> Trace:
    """
    Return a trace with the words of the vocabulary, which is acceleration in m/s2 by default.

    Words that are None are left out, and so are empty groups; ``notes`` and the ``problem`` of the
    coordinates become lines of ``processing``. The channel code is made from rate and orientation
    where the header has none, with the end of the name of a file of one component. Codes keep
    letters, digits, ``_`` and ``-`` only, so that they can name a file. The peak of the header
    loses its sign. Samples are in ``words["units"]``, their interval in s.
    """
    header: Words = {"units": "m/s2", "quantity": "acceleration", **words}
    # Notes of the reader and of the place
    place = dict(header.get("coordinates") or {})
    notes = [*header.pop("notes", ()), place.pop("problem", None)]
    header["coordinates"] = place
    header["processing"] = [f"per_obspy: {note}" for note in notes if note] or None
    header = _without_unknowns(header)
    if "header_peak" in header:
        header["header_peak"] = abs(header["header_peak"])
    # The name of the file helps where the header names no direction
    if "sensor_dip" not in header and "channel" not in header:
        header |= file_direction(file)
    header.setdefault("channel", channel_code(1 / dt, header))
    # Strip the characters that a file name cannot hold
    for name in _CODES & header.keys():
        header[name] = re.sub(r"[^A-Za-z0-9_-]", "", header[name])
    return Trace(data=np.ascontiguousarray(samples), header={"delta": dt, **header})


def _without_unknowns(words: Mapping[str, Any]) -> Words:
    """Return words that are not None; groups become attributes, empty ones are left out."""
    known: Words = {}
    for name, word in words.items():
        if isinstance(word, Mapping):
            group = AttribDict(_without_unknowns(word))
            known |= {name: group} if group else {}
        elif word is not None:
            known[name] = word
    return known


def gal_columns(
    table: FloatArray, dt: float, words: Mapping[str, Any], components: Iterable[Mapping[str, Any]]
) -> Stream:
    """
    Return the components of a table (n_samples, n_components), gal, as traces at an interval, s.

    The first words are those of all components, the others those of each.
    """
    columns = zip(GAL * table.T, components, strict=True)
    return Stream([trace(column, dt, {**words, **component}) for column, component in columns])


def read_components(text: Text, read_component: Callable[[Text, int], tuple[Trace, int]]) -> Stream:
    """Read components that follow each other; each is a trace and the line after it."""
    stream, line = Stream(), 0
    while line < len(text.lines):
        component, line = read_component(text, line)
        stream.append(component)
    return stream


def coordinates(
    latitude: float | None, longitude: float | None, elevation: float | None = None
) -> Words:
    """
    Return the group of coordinates, degrees and m.

    It is empty where they are unknown or 0, 0. Impossible ones are unknown too, and ``problem``
    describes that; :func:`trace` turns it into a note.
    """
    if latitude is None or longitude is None or (latitude == 0 and longitude == 0):
        return {}
    if not (abs(latitude) <= 90 and abs(longitude) <= 180):
        place = f"latitude {latitude:g}, longitude {longitude:g}"
        return {"problem": f"{place}: out of range, so the place is unknown"}
    return {"latitude": latitude, "longitude": longitude, "elevation": elevation}
