"""The surface over all azimuths bounds that of each, and turns with the sensors."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.pounding.history.gap_surface import azimuthal_gap_surface
from per_obspy.pounding.history.relative import critical_gap_surface

NORTH, EAST = np.random.default_rng(4).normal(size=(2, 1500)) * np.hanning(1500)
PERIODS = [0.5, 0.8, 1.3]


def test_it_is_the_largest_of_all_azimuths():
    # mutation: cos and sin exchanged, one side only, azimuths of the half circle with a sign lost
    along = [
        critical_gap_surface(NORTH * np.cos(t) + EAST * np.sin(t), 0.01, PERIODS, PERIODS)
        for t in np.radians(np.arange(0.0, 180.0))
    ]
    # the direction is chosen at samples: (omega dt)² / 8 at 0.5 s is 0.2 %; a degree misses 0.004 %
    # of the maximum
    assert_allclose(
        azimuthal_gap_surface(NORTH, EAST, 0.01, PERIODS, PERIODS),
        np.max(along, axis=0),
        rtol=2e-3,
        atol=1e-15,
    )


def test_turning_the_sensors_changes_nothing():
    turned = azimuthal_gap_surface(EAST, -NORTH, 0.01, PERIODS, PERIODS)
    assert_allclose(
        turned, azimuthal_gap_surface(NORTH, EAST, 0.01, PERIODS, PERIODS), rtol=1e-9, atol=1e-15
    )


def test_one_component_is_the_surface_of_that_component():
    alone = azimuthal_gap_surface(NORTH, 0 * NORTH, 0.01, PERIODS, PERIODS)
    assert_allclose(
        alone, critical_gap_surface(NORTH, 0.01, PERIODS, PERIODS), rtol=1e-9, atol=1e-15
    )


def test_bad_periods_are_named():
    with pytest.raises(ValueError, match="periods_2 must be positive"):
        azimuthal_gap_surface(NORTH, EAST, 0.01, PERIODS, [0.0])
