"""Distances on the sphere and the published correlation of residuals."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.screening.assignment import nearest_station
from per_obspy.screening.motion_field import great_circle, spatial_correlation


@pytest.mark.parametrize(
    ("period", "clustered", "reach"),
    # ranges worked by hand from Jayaram & Baker (2009), equations (17), (18) and (19), km
    [
        (0.0, False, 8.5),
        (0.5, False, 17.1),
        (0.0, True, 40.7),
        (0.5, True, 33.2),
        (2.0, False, 29.4),
        (30.0, True, 59.0),
    ],
)
def test_the_published_ranges(period, clustered, reach):
    assert_allclose(
        spatial_correlation(reach * 1000.0, period, clustered), np.exp(-3.0), rtol=1e-12
    )


def test_distances_are_those_of_the_nearest_station():
    # an implementation by chords; would catch degrees taken for radians, and the date line
    east, north = np.array([179.99, 0.0, 12.0]), np.array([0.0, 60.0, -45.0])
    for other in ((-179.99, 0.0), (0.5, 60.0), (12.0, 80.0)):
        chord = nearest_station(east, north, *(np.array([x]) for x in other))[1]
        # chords are ill-conditioned for near-opposite places; these are within 1e-9
        assert_allclose(great_circle(east, north, *other), chord, rtol=1e-9)
