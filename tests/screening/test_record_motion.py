"""Uncertain motion of a record: sources that decide, and the site."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import table_of

from per_obspy.config import Screening
from per_obspy.pounding.reliability import per_error
from per_obspy.screening.uncertain_motion import (
    likely_oscillators,
    pair_motion,
    record_motion,
)
from per_obspy.screening.values import at_contact, both

#: One exact demand, one estimate outside the usable periods, one of derived periods, and one of
#: buildings that yield along an unknown period.
ROWS = [
    {},
    {"period_1": 9.5},
    {"period_1": np.nan, "period_2": np.nan},
    {"period_1": 0.2, "period_2": np.nan, "height_2": 9.0, "storeys_2": 3.0,
     "yield_displacement_1": 2e-4},
]  # fmt: skip
EXACT, GIVEN, DERIVED, YIELDING = range(4)
SITE = {
    "distance": 0.0,
    "ln_per_ratio_1": 0.4,
    "ln_per_ratio_2": -0.2,
    "ln_per_std_1": 0.5,
    "ln_per_std_2": 0.3,
}


@pytest.fixture(scope="module")
def table(station):
    table = table_of(station, ROWS)
    rules = table["demand_rule"].tolist()
    assert (rules[EXACT], rules[YIELDING]) == ("exact", "linearized")
    assert "exact" not in (rules[GIVEN], rules[DERIVED])
    return table


def test_the_median_of_the_estimate_is_taken_off_the_radius(record, table):
    # would catch: one bias for elastic and linearized estimates, a radius of the oscillator
    screening = Screening(linearized_median=5.0)
    error = per_error(*likely_oscillators(table)).median
    motion = record_motion(record, table, screening)
    shares = both(table, "participation")
    for i, radius in enumerate((motion.first, motion.second), start=1):
        # where the exact demand decides there is no error of an estimate
        bias = np.where(table["demand_rule"] == "exact", 1.0, error)
        elastic = shares[i - 1] * table[f"per_{i}"] / bias
        equivalent = shares[i - 1] * table[f"equivalent_per_{i}"] / 5.0
        assert_allclose(radius.radius[:YIELDING], elastic[:YIELDING], rtol=1e-12)
        assert_allclose(radius.radius[YIELDING], equivalent[YIELDING], rtol=1e-12)


def test_oscillators_and_correlation_are_those_that_decide(record, table):
    motion = record_motion(record, table, Screening())
    first, second = motion.first, motion.second
    assert first.period[YIELDING] == table["equivalent_period_1"].iloc[YIELDING]
    assert first.damping[YIELDING] == table["equivalent_damping_1"].iloc[YIELDING]
    assert_array_equal(second.period[:YIELDING], table["period_2"].iloc[:YIELDING])
    # the correlation of the estimate that decides
    by_record = table.assign(demand_rule="per_record")
    found = record_motion(record, by_record, Screening()).correlation
    assert_array_equal(found, table["correlation_record"])
    assert motion.correlation[YIELDING] == table["correlation_linearized"].iloc[YIELDING]
    assert motion.correlation[DERIVED] == table["correlation"].iloc[DERIVED]


def test_errors_of_the_model_are_those_of_the_estimate(record, table):
    motion = record_motion(record, table, Screening(linearized_dispersion=0.62))
    error = per_error(*likely_oscillators(table)).log_std
    assert motion.log_std.tolist() == [0.0, error[GIVEN], error[DERIVED], 0.62]


def test_the_motion_of_the_site_is_that_of_the_table(record, table):
    at_site = table.assign(**SITE)
    motion = record_motion(record, at_site, Screening())
    assert set(motion.first.ln_ratio) == {0.4}
    assert set(motion.second.ln_ratio) == {-0.2}
    # the pair's own deviation, with the error of an estimate
    error = per_error(*likely_oscillators(table)).log_std
    ratios, stds = both(at_site, "ln_per_ratio"), both(at_site, "ln_per_std")
    _, log_std = pair_motion(at_contact(table, "per"), ratios, stds, both(table, "period"))
    assert motion.log_std[EXACT] == log_std[EXACT]
    assert_allclose(motion.log_std[DERIVED], np.hypot(log_std[DERIVED], error[DERIVED]), rtol=1e-12)


def test_without_a_field_of_stations_the_site_has_the_motion_of_the_record(record, table):
    # unknown motion counts as that of the record, with the deviation of none
    unknown = record_motion(record, table.assign(**dict.fromkeys(SITE, np.nan)), Screening())
    absent = record_motion(record, table, Screening())
    for motion in (unknown, absent):
        assert not motion.first.ln_ratio.any()
        assert not motion.second.ln_ratio.any()
        assert motion.log_std[EXACT] == 0.0
