"""Moat walls: they bound the motion, and an impact on them never lengthens the radius."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from per_obspy.pounding.history.with_walls.moat import moat_history
from per_obspy.pounding.structure import Structure

DT = 0.02
ISOLATED = Structure(3.0, 0.1, 1e3, yield_displacement=0.02, hardening=0.1)


@pytest.fixture(scope="module")
def shaking():
    """Smoothed noise under an envelope, about 3 m/s²."""
    noise = np.convolve(np.random.default_rng(0).normal(size=300), np.ones(5) / 5, mode="same")
    return 6.0 * noise * np.sin(np.pi * np.arange(300) / 300) ** 0.5


def test_the_building_stays_between_the_walls(shaking):
    # catches: left and right gap exchanged
    history = moat_history(shaking, DT, ISOLATED, 0.05, 0.08, 0.4)
    assert set(history.impacts["left"]) == {0, 1}
    assert history.displacement[1].min() >= -0.05 - 1e-12
    assert history.displacement[1].max() <= 0.08 + 1e-12
    assert_array_equal(history.displacement[[0, 2]], 0.0)


def test_an_impact_keeps_the_given_share_of_the_velocity(shaking):
    # catches: walls of finite mass
    impacts = moat_history(shaking, DT, ISOLATED, 0.05, 0.08, 0.4).impacts
    left, right = (impacts[impacts["left"] == interface] for interface in (0, 1))
    np.testing.assert_allclose(right["velocity_after_1"], -0.4 * right["velocity_before_1"])
    np.testing.assert_allclose(left["velocity_after_2"], -0.4 * left["velocity_before_2"])


def test_walls_without_room_are_refused(shaking):
    with pytest.raises(ValueError, match="no room to move"):
        moat_history(shaking, DT, ISOLATED, 0.0, 0.0, 0.4)
