"""Conversions of header words to SI: years, degrees, kilometres and times in UTC."""

import math
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime, timedelta

from obspy import UTCDateTime

from per_obspy.formats.text.lines import Text, refuse

#: English months as headers abbreviate them
MONTHS = ("JAN", "FEB", "MAR", "APR", "MAY", "JUN", "JUL", "AUG", "SEP", "OCT", "NOV", "DEC")


def full_year(year: str) -> int:
    """
    Return a year that may have two digits: strong-motion records begin in 1933.

    >>> full_year("52"), full_year("06"), full_year("1985")
    (1952, 2006, 1985)
    """
    if len(year.strip()) > 2:
        return int(year)
    return int(year) + (2000 if int(year) < 33 else 1900)


def sexagesimal(degrees: str, minutes: str, seconds: str) -> float:
    """
    Return unsigned degrees from degrees, minutes and seconds.

    Minutes or seconds of 60 and more give infinity, which no place has.

    >>> sexagesimal("34", "30", "36")
    34.51
    """
    if int(minutes) >= 60 or int(seconds) >= 60:
        return math.inf
    return int(degrees) + int(minutes) / 60 + int(seconds) / 3600


def metres(kilometres: float | None) -> float | None:
    """
    Return kilometres in metres; None where the number is unknown.

    >>> metres(7.5)
    7500.0
    """
    return None if kilometres is None else 1000 * kilometres


def first_known(numbers: Iterable[float | None]) -> float | None:
    """
    Return the first number that is not None; None if there is none.

    >>> first_known([None, 6.1, 5.9])
    6.1
    """
    for number in numbers:
        if number is not None:
            return number
    return None


def utc(
    text: Text,
    line: int,
    field: str,
    date: tuple[int, ...],
    clock: tuple[float, ...] = (),
    hours_ahead: float = 0.0,
) -> UTCDateTime:
    """
    Return a time in UTC.

    Parameters
    ----------
    text, line, field
        File, line and name of the header field, for the message of an impossible time.
    date : tuple of int
        Year, month and day.
    clock : tuple of float
        Hour, minute and second; midnight where they are missing.
    hours_ahead : float
        Hours by which the clock is ahead of UTC.
    """
    hour, minute, second = (*clock, 0.0, 0.0, 0.0)[:3]
    if not 1900 <= date[0] < 2100:
        refuse(text, line, field, f"{date[0]} is not a year of a record")
    # Hours, minutes and seconds may exceed their ranges, the date may not
    try:
        year, month, day = date
        midnight = datetime(year, month, day, tzinfo=UTC)
        moment = midnight + timedelta(hours=hour - hours_ahead, minutes=minute, seconds=second)
    except (ValueError, OverflowError, TypeError) as error:
        refuse(text, line, field, f"{date} {clock} is not a time ({error})")
    return UTCDateTime(moment)


def utc_from_words(
    text: Text, line: int, field: str, words: Sequence[str], hours_ahead: float = 0.0
) -> UTCDateTime:
    """Return a time in UTC, as :func:`utc`, from the words of year, month, ... and second."""
    year, month, day, hour, minute = (int(word) for word in words[:5])
    clock = (hour, minute, float(words[5]))
    return utc(text, line, field, (year, month, day), clock, hours_ahead)
