"""Coast lines and borders at places that are known from elsewhere."""

import numpy as np
import pytest

from per_obspy.report.page.map_lines import MOST_CORNERS, lines_around, towns_around


def distance(lines, longitude, latitude):
    """Return the distance of a place from the nearest line, km."""
    nearest = np.inf
    for line in lines:
        corners = np.reshape(line, (-1, 2)) - [longitude, latitude]
        corners *= [111.2 * np.cos(np.radians(latitude)), 111.2]
        start, step = corners[:-1], np.diff(corners, axis=0)
        share = np.clip(-(start * step).sum(1) / np.maximum((step**2).sum(1), 1e-12), 0, 1)
        nearest = min(nearest, np.hypot(*(start + share[:, None] * step).T).min())
    return nearest


@pytest.mark.parametrize(
    ("kind", "longitude", "latitude"),
    [
        ("coast", -9.5008, 38.7805),  # Cabo da Roca, westernmost point of Portugal
        ("coast", 18.4977, -34.3568),  # Cape of Good Hope
        ("borders", -117.029, 32.5427),  # San Ysidro crossing of the border at Tijuana
        ("borders", 6.0208, 50.7547),  # Vaalserberg, point of three countries
    ],
)
def test_lines_pass_known_places(kind, longitude, latitude):
    lines = lines_around(np.array([longitude]), np.array([latitude]))[kind]
    # A map of 1:10 million generalises by some kilometres
    assert distance(lines, longitude, latitude) < 3.0


def test_a_place_far_inland_has_no_coast():
    found = lines_around(np.array([66.9]), np.array([48.0]))  # amid Kazakhstan
    assert found == {"coast": [], "borders": []}


def test_the_whole_world_is_thinned():
    found = lines_around(np.array([-170.0, 170.0]), np.array([-50.0, 70.0]))
    # Last corners of lines are kept besides every so many
    assert sum(len(line) // 2 for lines in found.values() for line in lines) < 2 * MOST_CORNERS


def test_without_a_place_there_are_no_lines():
    empty = {"coast": [], "borders": []}
    assert lines_around(np.array([np.nan]), np.array([1.0])) == empty
    assert lines_around(np.empty(0), np.empty(0)) == empty


def test_towns_amid_the_places_come_before_larger_ones_around():
    # would catch: only towns of Los Angeles on the map of Ridgecrest
    towns = towns_around(np.array([-117.8, -117.5]), np.array([35.5, 35.8]), 20)
    names = [name for name, _, _ in towns]
    assert len(names) == 20
    assert names[0] == "Ridgecrest"
    assert names.index("China Lake Acres") < names.index("Los Angeles")
