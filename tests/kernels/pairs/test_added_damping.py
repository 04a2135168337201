"""The kernel of added damping against a closed form, so short that it also runs uncompiled."""

import numpy as np
import pytest

from per_obspy.kernels.pairs.added_damping import least_dampings, white_noise_correlation

#: Radii that fall like the square root of the damping, as under white noise.
DAMPINGS = np.log([0.02, 0.05, 0.1, 0.2])
STORED = np.broadcast_to(-0.5 * DAMPINGS, (1, 2, 4)).copy()


def least(gap, log_ratio=np.nan, dampings=DAMPINGS, stored=STORED):
    added = np.empty(1)
    pair = np.array([[log_ratio, 0.05, 0.05, np.log(3.0), np.log(4.0), gap]])
    least_dampings(dampings, stored, pair, 0.4, added)
    return added[0]


@pytest.mark.parametrize("share", [0.99, 0.8, 0.5, 0.36])
def test_uncorrelated_radii_fall_together(share):
    # the gap falls like the radii, by sqrt(0.05 / (0.05 + added)), also beyond the stored dampings
    assert least(5.0 * share) == pytest.approx(0.05 / share**2 - 0.05, abs=2e-8)


def test_limits():
    assert least(5.0 * (1.0 + 1e-12)) == 0.0  # but for rounding of logarithms
    assert np.isnan(least(5.0 * 0.3))  # 0.506 would be needed
    # one stored damping has no slope
    assert np.isnan(least(4.9, dampings=DAMPINGS[:1], stored=STORED[..., :1].copy()))


def test_correlated_buildings_of_equal_period_keep_the_difference_of_their_radii():
    # equal dampings and periods: correlation 1 whatever is added
    assert least(0.8, log_ratio=0.0) == pytest.approx(0.05 / 0.8**2 - 0.05, abs=2e-8)


def test_correlation_of_white_noise():
    # mutation: damping attached to the other building. Undamped and in step: 0 / 0 counts as one
    assert white_noise_correlation(0.0, 0.05, 0.05) == pytest.approx(1.0, abs=1e-15)
    assert white_noise_correlation(0.0, 0.0, 0.0) == 1.0
    assert white_noise_correlation(0.3, 0.02, 0.1) == pytest.approx(
        white_noise_correlation(-0.3, 0.1, 0.02), rel=1e-14
    )
    assert white_noise_correlation(0.3, 0.02, 0.1) != pytest.approx(
        white_noise_correlation(0.3, 0.1, 0.02), rel=1e-3
    )
