"""Impact velocity of a relative motion: limits, scale and symmetry."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from per_obspy.kernels.pairs.node_outcomes import LOSS
from per_obspy.screening.population import RelativeMotion, impact_velocity

SHARES = st.floats(0.0, 0.999)


def _motion(demand=0.2, velocity=0.8, speeds=(0.6, 0.5), correlation=0.0):
    """Return the motion of one pair at one node."""
    numbers = (demand, velocity, *speeds, correlation)
    return RelativeMotion(*(np.array([[number]]) for number in numbers))


def _velocity(motion, gap, scale=1.0):
    return impact_velocity(motion, np.array([[scale]]), np.array([[gap]]))[0, 0]


def test_uncorrelated_touching_buildings_hit_with_the_relative_velocity():
    assert _velocity(_motion(), 0.0) == 0.8


@given(SHARES)
def test_harmonic_relative_motion(share):
    # z = D sin, at z = g the velocity is V cos; would catch a share that is not squared
    expected = 0.8 * np.cos(np.arcsin(share))
    assert_allclose(_velocity(_motion(), 0.2 * share), expected, rtol=1e-9)


def test_no_impact_at_the_demand_and_beyond():
    # like the root of the missing share towards the demand
    assert [_velocity(_motion(), gap) for gap in (0.2, 0.3, 2.56)] == [0.0, 0.0, 0.0]
    assert 0.0 < _velocity(_motion(), 0.2 * (1.0 - 1e-10)) < 0.8 * 1.5e-5


def test_two_buildings_that_move_as_one_never_hit():
    still = _motion(demand=0.0, velocity=0.0, correlation=1.0)
    assert _velocity(still, 0.0) == 0.0


@given(SHARES, st.floats(0.01, 100.0), st.floats(-0.5, 1.0))
def test_ground_and_gap_times_a_factor_make_the_velocity_so_many_times(share, factor, correlation):
    motion = _motion(correlation=correlation)
    gap = 0.2 * share
    expected = factor * _velocity(motion, gap)
    assert_allclose(_velocity(motion, factor * gap, factor), expected, rtol=1e-6, atol=1e-12)


def test_earlier_impacts_keep_equal_buildings_from_hitting_hard():
    ratio = _velocity(_motion(correlation=1.0), 0.0) / _velocity(_motion(), 0.0)
    assert_allclose(ratio, np.exp(-LOSS), rtol=1e-12)
    # a first impact near the demand has none before it
    near = 0.2 * 0.999
    assert_allclose(
        _velocity(_motion(correlation=1.0), near), _velocity(_motion(), near), rtol=2e-3
    )
