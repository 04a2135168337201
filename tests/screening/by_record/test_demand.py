"""Demand on the gap: the governing estimate and ratios."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.screening.by_record.estimates import (
    demand_ratio,
    gap_estimates,
    governing_demand,
)

RANDOM = np.random.default_rng(3)
PER = tuple(RANDOM.uniform(0.05, 0.5, (2, 40)))
SD = tuple(0.8 * radius for radius in PER)
PERIOD = tuple(RANDOM.uniform(0.2, 3.0, (2, 40)))
DAMPING = (np.full(40, 0.05), np.full(40, 0.05))


def _estimates(correlation_record):
    return gap_estimates(PER, SD, PERIOD, DAMPING, correlation_record)


def test_a_record_that_moves_both_apart_governs():
    estimates = _estimates(np.full(40, -1.0))
    demand, rule = governing_demand(estimates, np.zeros(40, dtype=bool))
    # rho = -1 is the sum, up to the root's round-off
    assert_allclose(demand, PER[0] + PER[1], rtol=1e-12)
    assert set(rule) == {"per_record"}


def test_a_record_that_moves_both_together_does_not_lower_the_demand():
    # would catch: taking the record's estimate alone, or the smaller of the two
    demand, rule = governing_demand(_estimates(np.full(40, 1.0)), np.zeros(40, dtype=bool))
    assert_array_equal(demand, _estimates(np.full(40, 1.0)).per)
    assert set(rule) == {"per_white_noise"}


def test_equal_derived_periods_do_not_make_a_pair_safe():
    # would catch: rho = 1 and a demand of 0 for half of the real pairs
    radius, period = np.array([0.3]), np.array([1.0])
    estimates = gap_estimates(
        (radius, radius), (radius, radius), (period, period), (0.05, 0.05), np.array([1.0])
    )
    # the root of a difference of equal squares
    assert estimates.per[0] == pytest.approx(0.0, abs=1e-8)
    demand, rule = governing_demand(estimates, np.array([True]))
    assert_allclose(demand, 0.3 * np.sqrt(2.0), rtol=1e-12)  # SRSS of equal radii
    assert rule.tolist() == ["srss"]


def test_demands_are_proportional_to_the_motion():
    # would catch: a radius that misses its participation in one of the estimates
    correlation = np.full(40, 0.3)
    once = _estimates(correlation)
    per, sd = (2 * PER[0], 2 * PER[1]), (2 * SD[0], 2 * SD[1])
    twice = gap_estimates(per, sd, PERIOD, DAMPING, correlation)
    for name in ("per", "record", "sd", "srss", "absolute"):
        assert_allclose(getattr(twice, name), 2 * getattr(once, name), rtol=1e-12)  # round-off


def test_ratio_is_empty_only_without_demand():
    ratio = demand_ratio(np.array([0.0, 0.1, 0.1]), np.array([0.2, 0.2, 0.0]))
    assert_array_equal(ratio, [0.0, 0.5, np.nan])
