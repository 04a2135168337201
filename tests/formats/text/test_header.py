"""Fields, numbers, times and places, as headers write them."""

import re

import pytest
from obspy import UTCDateTime

from per_obspy.errors import RecordRejected
from per_obspy.formats.text.header import (
    CLOCK,
    epicentre_place,
    first_known,
    full_year,
    header_time,
    read_fields,
    scale,
    station_place,
    utc,
)
from per_obspy.formats.text.lines import Text

TEXT = Text(
    "some.file",
    ["#NAME  OF : Some: Town", "POINTS:  12", "DT: 0.01", "DEPTH: unknown", "CODE:", "POINTS: 13"],
)
HEADER = read_fields(TEXT, 6)
WEST = {"latitude": 34.2, "longitude": -118.5}


def test_names_are_single_spaced_and_the_first_of_them_counts():
    assert HEADER.word("NAME OF") == "Some: Town"
    assert HEADER.samples("POINTS") == 12
    assert HEADER.interval("DT") == 0.01


def test_unknown_values_are_absent():
    assert HEADER.numbers(depth="DEPTH", other="NOWHERE") == {"depth": None, "other": None}
    assert HEADER.words(code="CODE", other="NOWHERE") == {"code": None, "other": None}


@pytest.mark.parametrize(
    ("name", "message"),
    [("NOWHERE", "line 1, NOWHERE: the header has no such field"), ("CODE", "line 5, CODE: empty")],
)
def test_required_values_must_be_there(name: str, message: str):
    with pytest.raises(RecordRejected, match=f"some.file: {message}"):
        HEADER.required(name)


def test_words_are_no_numbers():
    with pytest.raises(RecordRejected, match="line 1, NAME OF: 'Some: Town' is not a number"):
        HEADER.number("NAME OF")


def test_lines_after_the_header_are_no_fields():
    assert set(read_fields(TEXT, 2).fields) == {"NAME OF", "POINTS"}


def test_clocks_of_other_zones():
    east = utc(TEXT, 0, "time", (2021, 4, 18), (7, 11, 30.5), 8)
    assert east == UTCDateTime("2021-04-17T23:11:30.5")
    west = utc(TEXT, 0, "time", (2019, 12, 31), (20, 0, 0), -8)
    assert west == UTCDateTime("2020-01-01T04:00:00")


@pytest.mark.parametrize(
    ("words", "time"),
    [
        ("18 4 2021 07:11:30.5 UTC", "2021-04-18T07:11:30.5"),
        # names of months in English and Spanish
        ("18 April 2021 07:11:30.5 GMT", "2021-04-18T07:11:30.5"),
        ("18 ABRIL 2021 07:11:30.5 GMT", "2021-04-18T07:11:30.5"),
        ("31 Dec 19 20:00:00 PST", "2020-01-01T04:00:00"),
        # unknown zones and months give no time
        ("18 4 2021 07:11:30.5 XST", None),
        ("18 Foo 2021 07:11:30.5 UTC", None),
        ("no time", None),
    ],
)
def test_times_in_words(words: str, time: str | None):
    pattern = rf"(?P<day>\d+) (?P<month>\w+) (?P<year>\d+) {CLOCK} (?P<zone>\w+)"
    found = header_time(TEXT, 0, "time", re.match(pattern, words))
    assert found == (UTCDateTime(time) if time else None)


def test_a_date_without_a_clock_is_midnight():
    assert utc(TEXT, 0, "time", (2021, 4, 18)) == UTCDateTime(2021, 4, 18)


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


def test_unknown_numbers_stay_unknown():
    assert first_known([None, None]) is None
    # zero is a number: a depth or magnitude of 0 is no gap
    assert (scale(0.0, 1000), first_known([None, 0.0, 1.0])) == (0.0, 0.0)


def place(words: str) -> re.Match[str]:
    """Return the match of two angles and letters, which damaged headers may have."""
    pattern = r"(?P<latitude>[-\d. ]+)(?P<north>\D?),(?P<longitude>[-\d. ]+)(?P<east>\D?)"
    return re.fullmatch(pattern, words)


def test_an_hour_of_arc_has_60_minutes_of_60_seconds():
    # would catch 3600 and 60 in each other's place
    signed = epicentre_place(place("10 30 00S,10 00 36E"))
    assert (signed["latitude"], signed["longitude"]) == (-10.5, pytest.approx(10.01, rel=1e-15))
    # 75 minutes are a damaged header, not a quarter of a degree more
    for words in ("10 75 00N,10 0 0E", "10 00 60N,10 0 0E"):
        assert epicentre_place(place(words)) == {}


@pytest.mark.parametrize(
    ("words", "signed"),
    [
        ("1.5N,2.5E", (1.5, 2.5)),
        ("1.5S,2.5E", (-1.5, 2.5)),
        ("1.5N,2.5W", (1.5, -2.5)),
        # west in Spanish
        ("1.5N,2.5O", (1.5, -2.5)),
        # a sign that agrees with its letter
        ("1.5N,-2.5W", (1.5, -2.5)),
        # letters exchanged: the longitude comes first
        ("2.5W,1.5N", (1.5, -2.5)),
    ],
)
def test_letters_are_signs(words: str, signed: tuple[float, float]):
    for found in (station_place(place(words), {}), epicentre_place(place(words))):
        assert (found["latitude"], found["longitude"]) == signed
        assert "problem" not in found


@pytest.mark.parametrize("letter", ["N", "S", "", "?"])
def test_the_epicentre_decides_a_wrong_letter(letter: str):
    found = station_place(place(f"34.1N,118.4{letter}"), WEST)
    assert (found["latitude"], found["longitude"]) == (34.1, -118.4)
    assert found["problem"].endswith("E or W expected, W taken, the epicentre's side")


def test_a_latitude_with_a_letter_of_a_longitude_takes_the_epicentre_s_side():
    found = station_place(place("33.0W,71.6W"), {"latitude": -33.5})
    assert (found["latitude"], found["longitude"]) == (-33.0, -71.6)


@pytest.mark.parametrize("epicentre", [{}, {"longitude": None}, {"longitude": 30.0}])
def test_a_wrong_letter_that_the_epicentre_does_not_decide_leaves_the_place_unknown(
    epicentre: dict[str, float],
):
    # unknown, or far from either sign
    found = station_place(place("34.1N,118.4N"), epicentre)
    assert "latitude" not in found
    assert found["problem"].endswith("the epicentre does not decide, so the place is unknown")


def test_an_epicentre_near_both_signs_decides_nothing():
    # 2 degrees north and south are both within reach of an epicentre at the equator
    found = station_place(place("2.0E,78.0W"), {"latitude": 0.5, "longitude": -78.0})
    assert "latitude" not in found


def test_a_minus_that_contradicts_its_letter_is_a_wrong_letter():
    found = station_place(place("34.1N,-118.4E"), WEST)
    assert found["longitude"] == -118.4
    assert "problem" in found


@pytest.mark.parametrize("words", ["91.0N,2.0E", "1.0N,181.0E", "1 99 0N,2.0E"])
def test_a_place_out_of_range_is_unknown_and_noted(words: str):
    found = station_place(place(words), WEST)
    assert set(found) == {"problem"}
    assert found["problem"].endswith("out of range, so the place is unknown")
    assert epicentre_place(place(words)) == {}
