"""Sensors of any azimuth are resolved into north and east."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.spectra.station import north_and_east

MOTION = np.random.default_rng(1).normal(size=(2, 50))


def _sensed(azimuth):
    return MOTION[0] * np.cos(np.radians(azimuth)) + MOTION[1] * np.sin(np.radians(azimuth))


@pytest.mark.parametrize(
    ("azimuth_1", "azimuth_2"), [(0, 90), (37, 127), (200, 110), (10, 75), (359, 91), (-30, 60)]
)
def test_motion_comes_back(azimuth_1, azimuth_2):
    # would catch: a swapped sine, a wrong sign of the determinant, sensors taken as orthogonal
    north, east = north_and_east(_sensed(azimuth_1), _sensed(azimuth_2), azimuth_1, azimuth_2)
    assert_allclose(
        [north, east], MOTION, rtol=0, atol=1e-14
    )  # round-off of a 2 x 2 system, angles of 65 degrees up


def test_north_and_east_sensors_pass_bit_by_bit():
    # would catch: cos(90 degrees) = 6e-17 leaking one component into the other
    assert_array_equal(north_and_east(*MOTION, 0.0, 90.0), MOTION)
    assert_array_equal(north_and_east(*MOTION, 90.0, 360.0), MOTION[::-1])


@pytest.mark.parametrize("azimuth_2", [30.0, 210.0, 45.0])
def test_sensors_on_the_same_line_are_refused(azimuth_2):
    with pytest.raises(ValueError, match="too close to the same line"):
        north_and_east(*MOTION, 30.0, azimuth_2)
