"""The probability of a pair: limits, and a plain Monte Carlo that shares only the stored spectra."""

import numpy as np
from numpy.testing import assert_allclose

import per_obspy
from per_obspy.screening.probability import NODES
from per_obspy.screening.stored import log_spectra, stored_log

from .conftest import make_pairs


def _one(station, **row):
    return per_obspy.risk_table(station, make_pairs([row])).iloc[0]


def test_nodes_are_those_of_independent_standard_normal_variables():
    # 128 quasi-random nodes: mean, variance and covariance within a few hundredths
    assert_allclose(NODES.mean(axis=0), 0, atol=0.03)
    assert_allclose(np.cov(NODES.T), np.eye(4), atol=0.08)


def test_stored_spectra_are_met_at_their_grid_points(station):
    periods = np.log(station["period"].to_numpy()[[3, 20, 59]])
    stored = stored_log(log_spectra(station), np.full(3, 4), periods, np.full(3, np.log(0.05)))
    expected = np.log(station["per_azimuthal"].sel(azimuth=40.0, damping=0.05).to_numpy()[[3, 20, 59]])
    assert_allclose(stored, expected, rtol=1e-6)  # float32


def test_given_buildings_and_an_exact_demand_leave_no_doubt(station):
    given = {"damping_1": 0.05, "damping_2": 0.05}
    demand = _one(station, **given)["demand"]
    assert _one(station, **given, gap=0.99 * demand)["probability"] == 1.0
    assert _one(station, **given, gap=1.01 * demand)["probability"] == 0.0


def test_doubt_about_the_gap_is_even_where_gap_and_demand_are_equal(station):
    given = {"damping_1": 0.05, "damping_2": 0.05}
    demand = _one(station, **given)["demand"]
    probability = _one(station, **given, gap=demand, gap_std=0.2 * demand)["probability"]
    # the gap's median is below its mean by half the variance of its logarithm: slightly more than one half
    assert 0.5 < probability < 0.56


def test_more_gap_is_less_likely_to_close(station):
    derived = {"period_1": np.nan, "period_2": np.nan}
    chances = [_one(station, **derived, gap=gap)["probability"] for gap in (0.0, 0.02, 0.1, 0.3, 1.0, 5.0)]
    assert chances[0] == 1.0
    assert np.all(np.diff(chances) <= 0)
    assert chances[-1] < 0.01


def test_equal_derived_buildings_against_monte_carlo(station):
    # would catch: both periods resampled together, which keeps equal buildings in step and the probability at 0
    derived = {"period_1": np.nan, "period_2": np.nan, "height_1": 18.0, "storeys_1": 6.0}
    probe = _one(station, **derived, gap=1.0)
    gap = 0.6 * probe["srss_gap"]
    row = _one(station, **derived, gap=gap)
    random = np.random.default_rng(11)
    n = 40_000
    radii, periods, dampings = [], [], []
    azimuth = np.full(n, round(row["azimuth_used"] / 10.0), dtype=int)
    for i in (1, 2):
        period = np.log(row[f"period_{i}"]) + random.normal(size=n) * row[f"period_log_std_{i}"]
        damping = np.log(0.05) + random.normal(size=n) * 0.3
        median = stored_log(log_spectra(station), azimuth[:1], np.log([row[f"period_{i}"]]), np.log([0.05]))
        change = stored_log(log_spectra(station), azimuth, period, damping) - median
        radii.append(row[f"participation_{i}"] * row[f"per_{i}"] * np.exp(change))
        periods.append(np.exp(period))
        dampings.append(np.exp(damping))
    rho = per_obspy.ddc_correlation(periods[0], dampings[0], periods[1], dampings[1])
    critical = per_obspy.critical_gap(*radii, rho) * np.exp(0.35 * random.normal(size=n))
    # 128 quasi-random nodes in four dimensions against 40 000 samples (standard error 0.0025)
    assert_allclose(row["probability"], np.mean(critical > gap), atol=0.02)
