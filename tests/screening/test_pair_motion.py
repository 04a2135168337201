"""Two oscillators at one site: published correlation of periods, limits of the pair's motion."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from per_obspy.screening.uncertain_motion import pair_motion, period_correlation

periods = st.floats(0.01, 10.0)


@given(periods, periods)
def test_periods_correlate_alike_in_either_order_and_fully_with_themselves(period, other):
    correlation = period_correlation(period, other)
    assert 0.0 < correlation <= 1.0
    assert correlation == period_correlation(other, period)
    # 1 - cos(pi/2) is 1 up to rounding
    assert_allclose(period_correlation(period, period), 1.0, rtol=1e-15)


def test_long_periods_follow_the_logarithm_of_their_ratio():
    # above 0.109 s: 1 - sin(pi/2 - x) would be 1 - cos(x); the published form is 1 - cos(pi/2 - x)
    # = 1 - sin(x)
    assert_allclose(period_correlation(0.5, 0.5 * np.exp(1.0)), 1.0 - np.sin(0.366), rtol=1e-12)
    # it depends on the ratio alone; would catch the short form used too far
    assert_allclose(period_correlation(0.2, 0.6), period_correlation(2.0, 6.0), rtol=1e-12)


def test_short_periods_by_hand():
    # 0.02 and 0.1 s: 1 - 0.105 (1 - 1/(1 + e^5)) 0.08/0.0901
    by_hand = 1.0 - 0.105 * 0.9933071490757153 * 0.08 / 0.0901
    assert_allclose(period_correlation(0.02, 0.1), by_hand, rtol=1e-12)
    # across 0.2 s there is no step larger than the change of the period lets expect; would catch a
    # swapped branch
    near, beyond = period_correlation(0.05, [0.1999, 0.2001])
    assert abs(near - beyond) < 0.01


def _motion(radii, ratios, stds, periods=(0.5, 2.0)):
    """Return ratio and deviation of a single pair."""
    columns = [np.array(pair, dtype=float)[:, None] for pair in (radii, ratios, stds, periods)]
    ratio, std = pair_motion(*map(tuple, columns))
    return float(ratio[0]), float(std[0])


def test_both_radii_alike_change_the_gap_alike():
    ratio, _ = _motion((0.3, 0.1), (0.4, 0.4), (0.0, 0.0))
    assert ratio == pytest.approx(0.4, rel=1e-12)
    # equal periods: one error for both, whole
    _, std = _motion((0.3, 0.1), (0.0, 0.0), (0.5, 0.5), (1.0, 1.0))
    assert std == pytest.approx(0.5, rel=1e-12)
    # of different periods a part of it: the errors are not the same
    assert 0.5 / np.sqrt(2.0) < _motion((0.1, 0.1), (0.0, 0.0), (0.5, 0.5))[1] < 0.5


def test_a_radius_of_zero_has_no_weight():
    assert _motion((0.3, 0.0), (0.4, 9.0), (0.2, 3.0)) == pytest.approx((0.4, 0.2), rel=1e-12)
    ratio, std = _motion((0.0, 0.0), (0.4, 0.4), (0.2, 0.2), (1.0, 1.0))
    assert ratio == 0.0
    assert std == pytest.approx(0.2, rel=1e-12)


radii, ratios, deviations = st.floats(1e-3, 1.0), st.floats(-2, 2), st.floats(0, 1)


@given(radii, radii, ratios, ratios, deviations, deviations)
def test_reciprocity_and_bounds(radius_1, radius_2, ratio_1, ratio_2, std_1, std_2):
    # would catch a weight of the wrong building
    pair = _motion((radius_1, radius_2), (ratio_1, ratio_2), (std_1, std_2))
    exchanged = _motion((radius_2, radius_1), (ratio_2, ratio_1), (std_2, std_1), (2.0, 0.5))
    assert pair == pytest.approx(exchanged, rel=1e-12, abs=1e-15)
    assert min(ratio_1, ratio_2) - 1e-12 <= pair[0] <= max(ratio_1, ratio_2) + 1e-12
    assert pair[1] <= max(std_1, std_2) + 1e-12
    # root of the sum of squares at the site over that here
    at_site = np.hypot(radius_1 * np.exp(ratio_1), radius_2 * np.exp(ratio_2))
    expected = np.log(at_site / np.hypot(radius_1, radius_2))
    assert pair[0] == pytest.approx(expected, abs=1e-12)
