"""Years, degrees, kilometres and times, as headers write them."""

import math

import pytest
from obspy import UTCDateTime

from per_obspy.errors import RecordRejected
from per_obspy.formats.text.conversions import (
    first_known,
    full_year,
    metres,
    sexagesimal,
    utc,
    utc_from_words,
)
from per_obspy.formats.text.lines import Text

TEXT = Text("some.file", ["first", "second"])


def test_clocks_of_other_zones():
    east = utc(TEXT, 0, "time", (2021, 4, 18), (7, 11, 30.5), 8)
    assert east == UTCDateTime("2021-04-17T23:11:30.5")
    west = utc(TEXT, 0, "time", (2019, 12, 31), (20, 0, 0), -8)
    assert west == UTCDateTime("2020-01-01T04:00:00")


def test_a_date_without_a_clock_is_midnight():
    assert utc(TEXT, 0, "time", (2021, 4, 18)) == UTCDateTime(2021, 4, 18)


def test_words_and_numbers_give_the_same_time():
    words = ("2021", "04", "18", "07", "11", "30.5")
    numbers = utc(TEXT, 0, "time", (2021, 4, 18), (7, 11, 30.5), 8)
    assert utc_from_words(TEXT, 0, "time", words, 8) == numbers


@pytest.mark.parametrize(
    ("year", "full"), [("33", 1933), ("99", 1999), ("00", 2000), ("32", 2032), ("1906", 1906)]
)
def test_two_digits_of_a_year(year: str, full: int):
    assert full_year(year) == full


@pytest.mark.parametrize(
    "date",
    [(2020, 2, 30), (1899, 1, 1), (2100, 1, 1), (2020, 13, 1), (2020, 0, 1), (2020, 1, 10**12)],
)
def test_impossible_dates_are_refused(date: tuple[int, ...]):
    with pytest.raises(RecordRejected, match=r"some\.file: line 2, time: "):
        utc(TEXT, 1, "time", date)


def test_an_hour_of_arc_has_60_minutes_of_60_seconds():
    # would catch 3600 and 60 in each other's place
    assert sexagesimal("10", "30", "00") == 10.5
    assert sexagesimal("10", "00", "36") == pytest.approx(10.01, rel=1e-15)
    # 75 minutes are a damaged header, not a quarter of a degree more
    assert math.isinf(sexagesimal("10", "75", "00"))
    assert math.isinf(sexagesimal("10", "00", "60"))


def test_unknown_numbers_stay_unknown():
    assert metres(None) is None
    assert first_known([None, None]) is None
    # zero is a number: a depth or magnitude of 0 is no gap
    assert (metres(0.0), first_known([None, 0.0, 1.0])) == (0.0, 0.0)
