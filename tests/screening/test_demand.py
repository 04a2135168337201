"""Demand on the gap: the governing estimate and ratios."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.config import Screening
from per_obspy.screening.estimates import elastic_estimates
from per_obspy.screening.ranking import state_columns
from per_obspy.screening.station_motion import PairMotion

RANDOM = np.random.default_rng(3)
PER = tuple(RANDOM.uniform(0.05, 0.5, (2, 40, 1)))
GIVEN = {f"period_{i}": RANDOM.uniform(0.2, 3.0, 40) for i in (1, 2)}


def _estimates(correlation_record, factor=1.0, per=PER, **columns):
    """Return the estimates of pairs along one azimuth, without participations."""
    radii = tuple(factor * radius for radius in per)
    count = len(radii[0])
    pairs = {f"{name}_{i}": np.full(count, one) for name, one in ONES.items() for i in (1, 2)}
    pairs |= GIVEN | {"derived": np.full(count, "", dtype=object)} | columns
    correlation = np.full((count, 1), correlation_record)
    sd = tuple(0.8 * radius for radius in radii)
    motion = PairMotion(np.zeros((count, 1)), radii, sd, correlation)
    return {name: column[:, 0] for name, column in elastic_estimates(motion, pairs).items()}


ONES = {"participation": 1.0, "damping": 0.05}


def test_a_record_that_moves_both_apart_governs():
    estimates = _estimates(-1.0)
    # rho = -1 is the sum, up to the root's round-off
    assert_allclose(estimates["demand"], (PER[0] + PER[1])[:, 0], rtol=1e-12)
    assert set(estimates["demand_rule"]) == {"per_record"}


def test_a_record_that_moves_both_together_does_not_lower_the_demand():
    # would catch: taking the record's estimate alone, or the smaller of the two
    estimates = _estimates(1.0)
    assert_array_equal(estimates["demand"], estimates["critical_gap_per"])
    assert set(estimates["demand_rule"]) == {"per_white_noise"}


def test_equal_derived_periods_do_not_make_a_pair_safe():
    # would catch: rho = 1 and a demand of 0 for half of the real pairs
    radius, period = np.array([[0.3]]), np.array([1.0])
    derived = np.array(["period_1"], dtype=object)
    estimates = _estimates(
        1.0, per=(radius, radius), period_1=period, period_2=period, derived=derived
    )
    # the root of a difference of equal squares
    assert estimates["critical_gap_per"][0] == pytest.approx(0.0, abs=1e-8)
    assert_allclose(estimates["demand"], 0.3 * np.sqrt(2.0), rtol=1e-12)  # SRSS of equal radii
    assert estimates["demand_rule"].tolist() == ["srss"]


def test_demands_are_proportional_to_the_motion():
    # would catch: a radius that misses its participation in one of the estimates
    once, twice = _estimates(0.3), _estimates(0.3, 2.0)
    gaps = ("critical_gap_per", "critical_gap_record", "critical_gap_sd", "srss_gap")
    for name in (*gaps, "absolute_gap"):
        assert_allclose(twice[name], 2 * once[name], rtol=1e-12)  # round-off


def test_ratio_is_empty_only_without_demand():
    table = pd.DataFrame({"gap": [0.0, 0.1, 0.1], "demand": [0.2, 0.2, 0.0]})
    table = table.assign(probability=0.5, expected_impact_velocity=0.1, floors_misaligned=False)
    equal = {"storeys": 3.0, "mass": 1e6, "sd": 0.1, "hazus_yield": np.nan}
    of_both = {f"{name}_{i}": value for name, value in equal.items() for i in (1, 2)}
    table = table.assign(yield_displacement_1=np.inf, yield_displacement_2=np.inf, **of_both)
    assert_array_equal(state_columns(table, Screening())["demand_ratio"], [0.0, 0.5, np.nan])
