"""Words, directions and codes that all formats share."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from per_obspy.formats.text.vocabulary import (
    channel_code,
    coordinates,
    file_direction,
    horizontal,
    orientation,
    trace,
)

AZIMUTHS = st.floats(0, 360, allow_nan=False)


@given(AZIMUTHS)
def test_components_at_right_angles_have_different_codes(azimuth: float):
    # catches a class boundary that is closed on both sides: 45 and 135 degrees
    one, other = (channel_code(100, horizontal(azimuth + turn)) for turn in (0, 90))
    assert one != other
    assert one[:2] == other[:2] == "HN"


@given(AZIMUTHS)
def test_a_reversed_sensor_is_never_called_north_or_east(azimuth: float):
    # catches folding azimuths to half a circle: N with reversed polarity would be read as north
    codes = [channel_code(100, horizontal(azimuth + turn))[-1] for turn in (0, 180)]
    assert not set(codes) <= {"N", "E"}


@pytest.mark.parametrize(
    ("rate", "band"),
    [(50, "B"), (79.9, "B"), (80, "H"), (249.9, "H"), (250, "C"), (1000, "F"), (5, "M")],
)
def test_band_codes_of_seed(rate: float, band: str):
    assert channel_code(rate, {"sensor_dip": -90.0}) == f"{band}NZ"


@pytest.mark.parametrize(
    ("words", "azimuth"),
    [
        ("N21E", 21),
        ("S 16 E", 164),
        ("S05W", 185),
        ("N80W", 280),
        ("S90E", 90),
        ("N00E", 0),
        ("N90E", 90),
        ("360", 0),
        ("360 Deg", 0),
        ("118 DEG", 118),
        ("NS", 0),
        ("WE", 90),
        ("West", 270),
        ("072.5", 72.5),
    ],
)
def test_horizontal_directions(words: str, azimuth: float):
    assert orientation(words) == {"sensor_azimuth": azimuth, "sensor_dip": 0.0}


@pytest.mark.parametrize(
    ("words", "dip"),
    [("Up", -90), ("UP", -90), ("V", -90), ("U-D", -90), ("DOWN", 90), ("DWN", 90)],
)
def test_vertical_directions(words: str, dip: float):
    assert orientation(words) == {"sensor_dip": dip}


@pytest.mark.parametrize("words", ["", " ", "-", "?"])
def test_no_word_is_no_direction(words: str):
    assert orientation(words) == {}


@pytest.mark.parametrize(
    ("words", "letter"),
    [
        *[(words, "L") for words in ("L", "Long", "LONGITUDINAL", "HNL")],
        *[(words, "T") for words in ("T", "Tran", "TRANSVERSE", "HGT")],
        *[(words, "L") for words in ("Comp. L", "L1")],
        *[(words, "1") for words in ("H1", "Hor 1", "FN")],
        *[("Radial", "R"), ("HNE", "E"), ("HLN", "N"), ("X", "X"), ("Y", "Y")],
    ],
)
def test_horizontals_without_an_azimuth_keep_their_word(words: str, letter: str):
    # mutation: 1 is an azimuth of one degree, Tran ends with the N of north
    direction = orientation(words)
    assert "sensor_azimuth" not in direction
    assert direction["sensor_dip"] == 0.0
    assert channel_code(100, direction) == f"HN{letter}"


@pytest.mark.parametrize(
    ("words", "letter"),
    [
        *[(words, "") for words in ("361", "N100E", "N E", "Other", "9999", "-20")],
        *[("HN3", "3"), ("HNA", "A"), ("1", "1"), ("HN2", "2")],
    ],
)
def test_unknown_and_numbered_directions_have_no_dip(words: str, letter: str):
    # each may be the vertical, 1 and 2 beside a 3
    direction = orientation(words)
    assert set(direction) == {"direction"}
    assert channel_code(100, direction) == f"HN{letter}"


@pytest.mark.parametrize(
    ("name", "direction"),
    [
        ("OLD--L.AT2", {"direction": "L", "sensor_dip": 0.0}),
        ("a/b.zip/RSN99_HILLHNE.AT2", {"direction": "HNE", "sensor_dip": 0.0}),
        ("x_UP.AT2", {"sensor_dip": -90.0}),
        ("kobe.000", horizontal(0)),
        ("E.AT2", horizontal(90)),
        ("x_h2.AT2", {"direction": "H2", "sensor_dip": 0.0}),
        ("kobe.ver", {"sensor_dip": -90.0}),
        ("ELC-270.at2", horizontal(270)),
        # numbers of files, names of stations, of which the last letters are no direction
        *[
            (name, {})
            for name in ("001.AT2", "rec_007.AT2", "HOTEL.AT2", "090.AT2", "IRPINIA.V2", "a.d")
        ],
    ],
)
def test_names_of_files_may_end_with_a_direction(name: str, direction: dict[str, object]):
    assert file_direction(name) == direction


@pytest.mark.parametrize(
    "place", [(0.0, 0.0), (None, 5.0), (5.0, None), (91.0, 0.0), (0.0, 181.0), (np.inf, 1.0)]
)
def test_unknown_and_impossible_coordinates_are_absent(place: tuple[float | None, float | None]):
    words = coordinates(*place)
    # What is impossible is noted, what is unknown is not
    is_impossible = None not in place and place != (0.0, 0.0)
    assert set(words) == ({"problem"} if is_impossible else set())
    stats = trace(np.zeros(2), 0.01, {"coordinates": words}).stats
    assert "coordinates" not in stats
    assert len(stats.get("processing", [])) == is_impossible


def test_words_that_are_unknown_are_left_out():
    words = {
        "station": "A/ 1",
        "event": {"name": None},
        "coordinates": {},
        "instrument": {"model": "X", "serial": None},
    }
    stats = trace(np.zeros(2), 0.01, words | {"header_peak": None}).stats
    assert stats.station == "A1"  # a station's code names files
    assert stats.instrument == {"model": "X"}
    assert not {"event", "coordinates", "header_peak"} & set(stats)
