"""The nearest station, on a sphere."""

import numpy as np
from numpy.testing import assert_allclose
from obspy.geodetics import gps2dist_azimuth

from per_obspy.screening.assignment import EARTH_RADIUS, nearest_station


def test_distances_agree_with_the_ellipsoid():
    random = np.random.default_rng(2)
    longitude, latitude = random.uniform(-180, 180, 50), random.uniform(-85, 85, 50)
    _, distance = nearest_station(longitude, latitude, np.array([12.0]), np.array([42.0]))
    geodesic = [gps2dist_azimuth(42.0, 12.0, y, x)[0] for x, y in zip(longitude, latitude, strict=True)]
    assert_allclose(distance, geodesic, rtol=6e-3)  # a sphere is within 0.6 % of the WGS 84 ellipsoid


def test_the_nearest_is_found_across_the_date_line():
    # would catch: distances in degrees, where 179.9 and -179.9 are 359.8 apart
    station, distance = nearest_station(np.array([179.9]), np.array([0.0]), np.array([170.0, -179.9]), np.zeros(2))
    assert station.tolist() == [1]
    assert_allclose(distance, EARTH_RADIUS * np.radians(0.2), rtol=1e-9)  # round-off of the chord


def test_a_place_at_a_station_is_at_no_distance():
    station, distance = nearest_station(np.array([5.0]), np.array([50.0]), np.array([4.0, 5.0]), np.array([50.0, 50.0]))
    assert station.tolist() == [1]
    assert distance[0] < 1e-6  # m
