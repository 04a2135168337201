"""Nodes of uncertain values: moments, and medians without uncertainty."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import ndtr
from scipy.stats import lognorm, qmc, truncnorm

from per_obspy.screening.population import (
    NODES,
    ONE_WALL,
    building_is_uncertain,
    damping_at_nodes,
    gap_dispersion,
    median_gap,
    period_at_nodes,
)

PAIRS = {
    "period_log_std_1": np.array([0.3, 0.0]),
    "damping_log_std_1": np.array([5.0, 0.0]),
    "period_log_std_2": np.array([0.0, 0.0]),
    "damping_log_std_2": np.array([0.0, 0.0]),
    "yield_log_std_1": np.array([0.0, 0.0]),
    "yield_log_std_2": np.array([0.0, 0.0]),
    "period_correlation": np.array([0.0, 0.0]),
}


def test_nodes_are_the_second_sobol_points():
    # SciPy has the points by another program; eight bits survive both normal functions
    points = qmc.Sobol(9, scramble=False).fast_forward(128).random(128)
    assert_array_equal(np.round(256.0 * ndtr(NODES)), 256.0 * points)


def test_nodes_are_those_of_independent_standard_normal_variables():
    # 128 quasi-random nodes: mean, variance and covariance within a few hundredths
    assert_allclose(NODES.mean(axis=0), 0, atol=0.03)
    assert_allclose(np.cov(NODES.T), np.eye(9), atol=0.1)


def test_the_first_nodes_have_the_moments_too():
    # pairs without a doubt about contact use the first 32 only
    assert_allclose(NODES[:32].mean(axis=0), 0, atol=0.12)
    assert_allclose(NODES[:32].var(axis=0), 1, atol=0.25)


def test_periods_are_lognormal_and_certain_ones_stay():
    period = period_at_nodes(np.array([2.0, 1.0]), PAIRS, 1, NODES)
    assert_allclose(np.log(period[0]), np.log(2.0) + 0.3 * NODES[:, 0], rtol=1e-12)
    assert_array_equal(period[1], np.ones(len(NODES)))


@pytest.mark.parametrize("shared", [0.0, 0.5, 0.85, 1.0])
def test_periods_of_alike_neighbours_are_correlated(shared):
    pairs = PAIRS | {"period_log_std_2": np.full(2, 0.4), "period_correlation": np.full(2, shared)}
    first, second = (period_at_nodes(np.ones(2), pairs, i, NODES)[0] for i in (1, 2))
    # 128 quasi-random nodes: correlation and deviation within some hundredths
    assert_allclose(np.corrcoef(np.log(first), np.log(second))[0, 1], shared, atol=0.03)
    assert_allclose(np.log(second).std(), 0.4, atol=0.02)


def test_without_correlation_the_periods_are_those_of_independent_nodes():
    pairs = PAIRS | {"period_log_std_2": np.full(2, 0.4)}
    period = period_at_nodes(np.array([2.0, 1.0]), pairs, 2, NODES)
    assert_array_equal(period, np.outer([2.0, 1.0], np.exp(0.4 * NODES[:, 2])))


def test_no_damping_is_critical():
    damping = damping_at_nodes(np.array([0.3, 0.05]), PAIRS, 1, NODES)
    assert damping.max() == 0.99
    assert_array_equal(damping[1], np.full(len(NODES), 0.05))


def test_a_deviation_of_any_building_is_a_doubt():
    assert building_is_uncertain(PAIRS).tolist() == [True, False]


def _truncated(gap, deviation):
    """Return the distribution of a length measured with a normal error, if it is not below 0."""
    return truncnorm(-gap / deviation, np.inf, gap, deviation)


def _lognormal(gap, deviation):
    """Return the lognormal distribution of a gap."""
    pairs = {"gap": np.array([gap]), "gap_std": np.array([deviation])}
    return lognorm(gap_dispersion(pairs)[0], scale=median_gap(pairs)[0])


def test_certain_gaps_stay():
    pairs = {"gap": np.array([0.2, 0.0]), "gap_std": np.zeros(2)}
    assert_array_equal(gap_dispersion(pairs), [0.0, 0.0])
    assert_array_equal(median_gap(pairs), [0.2, 0.0])


@pytest.mark.parametrize("gap", [0.0, 0.01, 0.05, 0.1, 0.2, 0.4])
def test_an_uncertain_gap_gives_hardly_less_contact_than_a_normal_error(gap):
    # an independent distribution gives the expected chances; a lognormal one has two quantiles of
    # it only, so that a chance of 0.04 may become a `no`
    demands = np.geomspace(1e-4, 2.0, 500)
    expected, found = _truncated(gap, 0.1).cdf(demands), _lognormal(gap, 0.1).cdf(demands)
    assert expected[found < 0.01].max(initial=0.0) < 0.04
    assert (found - expected).min() > -0.06


@pytest.mark.parametrize("deviation", [0.001, 0.1, 0.5])
def test_touching_outlines_are_never_a_no(deviation):
    # stiff houses in a row have demands of some hundredths of the deviation: by a normal error
    # alone 183 of 434 touching pairs of San José would be `no`
    touching = _lognormal(0.0, deviation)
    assert touching.cdf(0.0005 * deviation) > 0.1
    # most walls are one, the gaps of the others have the half of a normal distribution
    for share in (0.02, 0.1, 0.3, 1.0, 2.0):
        others = _truncated(0.0, deviation).cdf(share * deviation)
        mixture = ONE_WALL + (1.0 - ONE_WALL) * others
        # two quantiles make no mixture, which has 0.885 at 0.3 deviations
        found = max(ONE_WALL, touching.cdf(share * deviation))
        assert -0.02 < found - mixture < 0.05


def test_touching_outlines_are_no_certain_contact():
    assert _lognormal(0.0, 0.1).cdf(0.001) < ONE_WALL
    assert _lognormal(0.0, 0.1).cdf(0.05) < 0.96


def test_nearer_outlines_are_likelier_to_hit():
    # would catch walls drawn a centimetre apart that hit more often than walls drawn as one
    demands = np.geomspace(0.001, 0.5, 100)
    chances = [_lognormal(gap, 0.1).cdf(demands) for gap in np.linspace(0.0, 0.6, 61)]
    # two lognormal distributions may cross where both are nearly certain
    assert np.diff(chances, axis=0).max() < 0.005


def test_a_small_deviation_of_a_gap_is_that_of_its_logarithm():
    # a fiftieth of the gap: a normal and a lognormal distribution differ by the square of that
    assert_allclose(_lognormal(0.5, 0.01).median(), 0.5, rtol=4e-4)
    assert_allclose(_lognormal(0.5, 0.01).std(), 0.01, rtol=0.01)
