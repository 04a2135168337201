"""Places in headers whose letters may be wrong."""

import pytest

from per_obspy.formats.text.places import Angle, epicentre_place, station_place

WEST = {"latitude": 34.2, "longitude": -118.5}


@pytest.mark.parametrize(
    ("latitude", "longitude", "place"),
    [
        ((1.5, "N"), (2.5, "E"), (1.5, 2.5)),
        ((1.5, "S"), (2.5, "E"), (-1.5, 2.5)),
        ((1.5, "N"), (2.5, "W"), (1.5, -2.5)),
        # a sign that agrees with its letter
        ((1.5, "N"), (-2.5, "W"), (1.5, -2.5)),
        # letters exchanged: the longitude comes first
        ((2.5, "W"), (1.5, "N"), (1.5, -2.5)),
    ],
)
def test_letters_are_signs(
    latitude: tuple[float, str], longitude: tuple[float, str], place: tuple[float, float]
):
    angles = Angle(*latitude), Angle(*longitude)
    for found in (station_place(*angles, {}), epicentre_place(*angles)):
        assert (found["latitude"], found["longitude"]) == place
        assert "problem" not in found


@pytest.mark.parametrize("letter", ["N", "S", "", "?"])
def test_the_epicentre_decides_a_wrong_letter(letter: str):
    place = station_place(Angle(34.1, "N"), Angle(118.4, letter), WEST)
    assert (place["latitude"], place["longitude"]) == (34.1, -118.4)
    assert place["problem"].endswith("E or W expected, W taken, the epicentre's side")


def test_a_latitude_with_a_letter_of_a_longitude_takes_the_epicentre_s_side():
    place = station_place(Angle(33.0, "W"), Angle(71.6, "W"), {"latitude": -33.5})
    assert (place["latitude"], place["longitude"]) == (-33.0, -71.6)


@pytest.mark.parametrize(
    "epicentre",
    [
        {},
        {"longitude": None},
        # far from either sign
        {"longitude": 30.0},
    ],
)
def test_a_wrong_letter_that_the_epicentre_does_not_decide_leaves_the_place_unknown(
    epicentre: dict[str, float],
):
    place = station_place(Angle(34.1, "N"), Angle(118.4, "N"), epicentre)
    assert "latitude" not in place
    assert place["problem"].endswith("the epicentre does not decide, so the place is unknown")


def test_an_epicentre_near_both_signs_decides_nothing():
    # 2 degrees north and south are both within reach of an epicentre at the equator
    place = station_place(Angle(2.0, "E"), Angle(78.0, "W"), {"latitude": 0.5, "longitude": -78.0})
    assert "latitude" not in place


def test_a_minus_that_contradicts_its_letter_is_a_wrong_letter():
    place = station_place(Angle(34.1, "N"), Angle(-118.4, "E"), WEST)
    assert place["longitude"] == -118.4
    assert "problem" in place


@pytest.mark.parametrize("angles", [((91.0, "N"), (2.0, "E")), ((1.0, "N"), (181.0, "E"))])
def test_a_place_out_of_range_is_unknown_and_noted(angles: tuple[tuple[float, str], ...]):
    latitude, longitude = (Angle(*angle) for angle in angles)
    place = station_place(latitude, longitude, WEST)
    assert set(place) == {"problem"}
    assert place["problem"].endswith("out of range, so the place is unknown")
    assert epicentre_place(latitude, longitude) == {}
