"""Nodes of what is uncertain: moments, and medians where nothing is."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.screening.uncertainty.nodes import (
    NODES,
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
}


def test_nodes_are_those_of_independent_standard_normal_variables():
    # 128 quasi-random nodes: mean, variance and covariance within a few hundredths
    assert_allclose(NODES.mean(axis=0), 0, atol=0.03)
    assert_allclose(np.cov(NODES.T), np.eye(6), atol=0.1)


def test_the_first_nodes_have_the_moments_too():
    # pairs without a doubt about contact use the first 32 only
    assert_allclose(NODES[:32].mean(axis=0), 0, atol=0.12)
    assert_allclose(NODES[:32].var(axis=0), 1, atol=0.25)


def test_periods_are_lognormal_and_certain_ones_stay():
    period = period_at_nodes(np.array([2.0, 1.0]), PAIRS, 1, NODES)
    assert_allclose(np.log(period[0]), np.log(2.0) + 0.3 * NODES[:, 0], rtol=1e-12)
    assert_array_equal(period[1], np.ones(len(NODES)))


def test_no_damping_is_critical():
    damping = damping_at_nodes(np.array([0.3, 0.05]), PAIRS, 1, NODES)
    assert damping.max() == 0.99
    assert_array_equal(damping[1], np.full(len(NODES), 0.05))


def test_a_deviation_of_any_building_is_a_doubt():
    assert building_is_uncertain(PAIRS).tolist() == [True, False]


def test_a_lognormal_gap_keeps_its_moments():
    # mean 0.2, standard deviation 0.1: ln(1 + 0.25) is the variance of the logarithm
    pairs = {"gap": np.array([0.2, 0.2, 0.0]), "gap_std": np.array([0.1, 0.0, 0.0])}
    assert_allclose(gap_dispersion(pairs), [np.sqrt(np.log(1.25)), 0.0, 0.0], rtol=1e-12)
    assert_allclose(median_gap(pairs), [0.2 / np.sqrt(1.25), 0.2, 0.0], rtol=1e-12)
