"""
What headers say, in SI: ``name: value`` fields, numbers in lines, times in UTC, places in degrees.

A time is found by a pattern with the groups ``year``, ``month``, ``day``, ``hour``, ``minute``,
``second`` and ``zone``, as far as the header has them; a place by one with ``latitude``, ``north``
(its letter), ``longitude`` and ``east``. A second pattern for the same part of a time has the name
of its group with an underscore: ``year_``.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from re import Match, Pattern
from typing import Any, NamedTuple, NoReturn

from obspy import UTCDateTime

from per_obspy.formats.text.lines import NUMBER, Text, count, finite_number, interval, refuse
from per_obspy.formats.text.vocabulary import Words, coordinates

#: first letters of months in English and Spanish
_MONTHS = "JAN FEB MAR APR MAY JUN JUL AUG SEP OCT NOV DEC"
MONTHS = {_MONTHS[4 * month : 4 * month + 3]: month + 1 for month in range(12)}
MONTHS |= {"ENE": 1, "ABR": 4, "AGO": 8, "DIC": 12}

#: time zone -> hours ahead of UTC
_ZONES = {"PST": -8, "PDT": -7, "MST": -7, "MDT": -6, "AKST": -9, "AKDT": -8, "HST": -10}
_ZONES |= dict.fromkeys(("UTC", "GMT", "UT"), 0)

#: parts of a time of day in patterns
CLOCK = rf"(?P<hour>\d{{1,2}}):(?P<minute>\d{{1,2}}):(?P<second>{NUMBER})"

#: values that mark an unknown number
_UNKNOWN = ("", "none", "unknown", "-", "n/a")

#: largest distance of a station from the epicentre at which the epicentre decides a sign, degrees
_REACH = 10.0

#: letters of an angle -> name, positive and negative letter
_AXES = (("latitude", "N", "S"), ("longitude", "E", "W"))


class HeaderField(NamedTuple):
    """The value of a header field and its line."""

    line: int
    value: str


@dataclass(frozen=True)
class Header:
    """Named values of a header."""

    #: the file
    text: Text
    #: name -> value and line
    fields: Mapping[str, HeaderField]

    def word(self, name: str) -> str | None:
        """Return text, or None where the field is missing or empty."""
        return self.fields[name].value or None if name in self.fields else None

    def words(self, **names: str) -> dict[str, str | None]:
        """Return the text of several fields by other names."""
        return {word: self.word(name) for word, name in names.items()}

    def refuse(self, name: str, problem: str) -> NoReturn:
        """Raise the error of a field."""
        refuse(self.text, self.line(name), name, problem)

    def line(self, name: str) -> int:
        """Return the line of a field, the first of the file where it is missing."""
        return self.fields[name].line if name in self.fields else 0

    def required(self, name: str) -> str:
        """Return the text of a field that must be there and not be empty."""
        if name not in self.fields:
            self.refuse(name, "the header has no such field")
        return self.fields[name].value or self.refuse(name, "empty")

    def number(self, name: str) -> float | None:
        """Return a number, or None where the field is missing, empty or marked as unknown."""
        word = self.word(name) or ""
        if word.lower() in _UNKNOWN:
            return None
        return finite_number(self.text, self.line(name), name, word)

    def numbers(self, **names: str) -> dict[str, float | None]:
        """Return the numbers of several fields by other names."""
        return {word: self.number(name) for word, name in names.items()}

    def samples(self, name: str) -> int:
        """Return a positive whole number that must be there."""
        return count(self.text, self.line(name), name, self.required(name))

    def interval(self, name: str) -> float:
        """Return a positive number that must be there."""
        return interval(self.text, self.line(name), name, self.required(name))

    def time(
        self, pattern: Pattern[str], *names: str, hours_ahead: float = 0.0
    ) -> UTCDateTime | None:
        """Return the time in the lines of one field or several; None where they hold none."""
        match = pattern.match("\n".join(self.word(name) or "" for name in names))
        return header_time(self.text, self.line(names[0]), names[0], match, hours_ahead)


def read_fields(text: Text, stop: int) -> Header:
    """Read the named values of the lines before ``stop``; of repeated names the first counts."""
    fields: dict[str, HeaderField] = {}
    for line, content in enumerate(text.lines[:stop]):
        name, colon, value = content.partition(":")
        if colon:
            single_spaced = re.sub(r"\s+", " ", name.strip(" #"))
            fields.setdefault(single_spaced, HeaderField(line, value.strip()))
    return Header(text, fields)


def scale(number: float | None, factor: float) -> float | None:
    """
    Return a number in another unit; None where it is unknown.

    >>> scale(7.5, 1000), scale(None, 1000)
    (7500.0, None)
    """
    return None if number is None else factor * number


def number_in(match: Match[str] | None, group: int | str = 1) -> float | None:
    """
    Return a group of a match as a number; None where there is none.

    >>> number_in(re.match(r"H=(.*) KM", "H=12.5 KM")), number_in(None)
    (12.5, None)
    """
    word = word_in(match, group)
    return None if word is None else float(word)


def word_in(match: Match[str] | None, group: int | str = 1) -> str | None:
    """
    Return a group of a match; None where there is none or it is empty.

    >>> word_in(re.match(r"S/N *(.*)", "S/N 12")), word_in(re.match(r"S/N *(.*)", "S/N"))
    ('12', None)
    """
    return (match[group] or None) if match else None


def first_known(numbers: Iterable[float | None]) -> float | None:
    """
    Return the first number that is not None; None if there is none.

    >>> first_known([None, 6.1, 5.9])
    6.1
    """
    return next((number for number in numbers if number is not None), None)


def moment_first(sizes: Iterable[tuple[str, str]]) -> float | None:
    """
    Return the moment magnitude of kinds and sizes, or else the first; none is 0, an unknown one.

    >>> moment_first([("ML", "6.1"), ("Mw", "6.3")]), moment_first([("Mw", "0"), ("ML", "5")])
    (6.3, 5.0)
    """
    known = [(kind.upper() != "MW", float(size)) for kind, size in sizes if float(size) > 0]
    return min(known, key=lambda size: size[0])[1] if known else None


def corners(match: Match[str] | None, first: int = 1) -> dict[str, float]:
    """
    Return the corners of a filter from two groups of a match, Hz; empty where there is none.

    >>> corners(re.match(r"([.0-9]+)-([.0-9]+)", "0.1-30"))
    {'highpass': 0.1, 'lowpass': 30.0}
    """
    if match is None:
        return {}
    return {"highpass": float(match[first]), "lowpass": float(match[first + 1])}


def full_year(year: str) -> int:
    """
    Return a year that may have two digits: strong-motion records begin in 1933.

    >>> full_year("52"), full_year("06"), full_year("1985")
    (1952, 2006, 1985)
    """
    if len(year.strip()) > 2:
        return int(year)
    return int(year) + (2000 if int(year) < 33 else 1900)


def header_time(
    text: Text, line: int, field: str, match: Match[str] | None, hours_ahead: float = 0.0
) -> UTCDateTime | None:
    """
    Return the time, UTC, that a pattern with parts of a time found in a field of a line.

    It is None where nothing was found, or the month or zone is unknown. An impossible time is
    refused. The clock may be hours ahead of the zone.
    """
    if match is None:
        return None
    parts = {name.rstrip("_"): word for name, word in match.groupdict().items() if word}
    month = MONTHS.get(parts["month"][:3].upper())
    zone = _ZONES.get(parts.get("zone", "UTC"))
    if parts["month"].isdecimal():
        month = int(parts["month"])
    if month is None or zone is None:
        return None
    # Parts of the clock that the header lacks are zero
    date = full_year(parts["year"]), month, int(parts["day"])
    clock = tuple(float(parts.get(name, 0)) for name in ("hour", "minute", "second"))
    return utc(text, line, field, date, clock, zone + hours_ahead)


def utc(
    text: Text,
    line: int,
    field: str,
    date: Sequence[int],
    clock: Sequence[float] = (0.0, 0.0, 0.0),
    hours_ahead: float = 0.0,
) -> UTCDateTime:
    """
    Return a time in UTC from year, month, day and hour, minute, second of a clock ahead of it.

    An impossible time is refused by the line and the name of its field.
    """
    hour, minute, second = clock
    year, month, day = date
    if not 1900 <= year < 2100:
        refuse(text, line, field, f"{year} is not a year of a record")
    # Hours, minutes and seconds may exceed their ranges, the date may not
    try:
        midnight = datetime(year, month, day, tzinfo=UTC)
        moment = midnight + timedelta(hours=hour - hours_ahead, minutes=minute, seconds=second)
    except (ValueError, OverflowError) as error:
        refuse(text, line, field, f"{date} {clock} is not a time ({error})")
    return UTCDateTime(moment)


def place_pattern(angle: str, between: str) -> str:
    """Return a pattern of a place: latitude and longitude with a letter each."""
    return (
        rf"(?P<latitude>{angle})\s*+(?P<north>[NSEW])"
        rf"{between}(?P<longitude>{angle})\s*+(?P<east>[NSEW])"
    )


def epicentre_place(match: Match[str] | None) -> Words:
    """
    Return the coordinates of an epicentre, degrees; empty where they are unknown.

    >>> pattern = place_pattern("[0-9.]+", " ")
    >>> epicentre_place(re.match(pattern, "34.0N 118.0N"))
    {}
    """
    place = station_place(match, {})
    return {} if "problem" in place else place


def station_place(
    match: Match[str] | None, epicentre: Mapping[str, Any], elevation: float | None = None
) -> Words:
    """
    Return the coordinates of a station, found by a pattern of a place; empty where unknown.

    A letter that does not belong to its angle is replaced by that of the hemisphere in which the
    station is near the epicentre, as far as that is known; where this does not decide, the place is
    unknown. Either is written into ``problem``, which
    :func:`~per_obspy.formats.text.vocabulary.trace` turns into a note of the record. Letters that
    are merely exchanged mean that the longitude comes first. The elevation is in m.

    >>> match = re.match(place_pattern("[0-9.]+", " "), "34.1N 118.4N")
    >>> station_place(match, {"longitude": -118.5})["longitude"]
    -118.4
    """
    if match is None:
        return {}
    signed: list[float | None] = []
    problems = []
    for axis, size, letter in _angles(match):
        degrees = _signed(axis, size, letter)
        if degrees is None:
            degrees, note = _mend_sign(axis, size, letter, epicentre.get(axis[0]))
            problems.append(note)
        signed.append(degrees)
    # A place out of range is a separate problem
    place = coordinates(signed[0], signed[1], elevation)
    return place | {"problem": "; ".join(problems)} if problems else place


_Axis = tuple[str, str, str]


def _angles(match: Match[str]) -> list[tuple[_Axis, float, str]]:
    """Return axis, degrees and letter of both angles; the letters decide where the axes change."""
    angles = []
    for name, letter in (("latitude", "north"), ("longitude", "east")):
        # Minutes or seconds of 60 and more give infinity, which no place has
        degrees, *parts = (float(word) for word in match[name].split())
        parts = [part / 60**power if part < 60 else math.inf for power, part in enumerate(parts, 1)]
        # West is oeste in Spanish
        angles.append((sum(parts, degrees), match[letter].replace("O", "W")))
    if angles[0][1] in ("E", "W") and angles[1][1] in ("N", "S"):
        angles.reverse()
    return [(axis, *angle) for axis, angle in zip(_AXES, angles, strict=True)]


def _signed(axis: _Axis, degrees: float, letter: str) -> float | None:
    """Return signed degrees; None where the letter does not belong to the axis."""
    _, positive, negative = axis
    if letter == negative:
        return -abs(degrees)
    # A minus contradicts the letter of the positive side
    return degrees if letter == positive and degrees >= 0 else None


def _mend_sign(
    axis: _Axis, degrees: float, letter: str, centre: float | None
) -> tuple[float | None, str]:
    """Return the only one of both signs that is near the epicentre, None if any, and a note."""
    name, positive, negative = axis
    note = f"{name} {degrees:g} {letter}: {positive} or {negative} expected"
    # Differences of two angles, from 0 to 180 degrees
    near = [
        sign
        for sign in (degrees, -degrees)
        if centre is not None and abs((sign - centre + 180) % 360 - 180) <= _REACH
    ]
    if len(near) != 1:
        return None, f"{note}, the epicentre does not decide, so the place is unknown"
    return near[0], f"{note}, {positive if near[0] > 0 else negative} taken, the epicentre's side"
