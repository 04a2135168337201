"""Uncertain motion of a record: sources that decide, the site, and dampings that are resampled."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import table_of

from per_obspy.config import Screening
from per_obspy.screening.uncertainty.pair_motion import pair_motion
from per_obspy.screening.uncertainty.record_motion import record_motion
from per_obspy.screening.values import at_contact, both, values

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


def test_the_exact_demand_counts_only_where_it_decides(record, table):
    motion = record_motion(record, table, Screening())
    assert np.isnan(motion.exact_demand).tolist() == [False, True, True, True]
    assert motion.exact_demand[EXACT] == table["demand_exact"].iloc[EXACT]


def test_the_median_of_the_estimate_is_taken_off_the_radius(record, table):
    # would catch: one bias for elastic and linearized estimates, a radius of the oscillator
    screening = Screening(model_median=2.0, linearized_median=5.0)
    motion = record_motion(record, table, screening)
    shares = both(table, "participation")
    for i, radius in enumerate((motion.first, motion.second), start=1):
        elastic = shares[i - 1] * table[f"per_{i}"] / 2.0
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
    screening = Screening(model_dispersion=0.31, linearized_dispersion=0.62)
    motion = record_motion(record, table, screening)
    assert motion.model_log_std.tolist() == [0.31, 0.31, 0.31, 0.62]


def test_dampings_widen_radii_only_where_they_are_not_resampled(station, record, table):
    # at a stored period, azimuth and dampings 0.02, 0.05, 0.1 the change is that of the spectrum
    motion = record_motion(record, table, Screening())
    resampled = (table["period_log_std_1"] > 0) | (table["period_log_std_2"] > 0)
    # of an exact demand the buildings are sampled
    resampled |= table["demand_rule"] == "exact"
    assert_array_equal(motion.first.damping_log_std > 0, ~resampled)
    period = float(station["period"][30])
    # one deviation of the damping is from 0.0447 to either of these
    stored = table.assign(period_1=period, azimuth_used=40.0, damping_1=np.sqrt(0.02 * 0.1))
    stored = stored.assign(damping_log_std_1=np.log(5.0) / 2.0, period_log_std_1=0.0)
    stored = stored.assign(demand_rule="per_record")
    found = record_motion(record, stored, Screening()).first.damping_log_std[EXACT]
    spectrum = station["per_azimuthal"].sel(azimuth=40.0, period=period)
    low, high = spectrum.sel(damping=[0.02, 0.1]).to_numpy()
    assert_allclose(found, np.log(low / high) / 2.0, rtol=1e-5)


def test_the_motion_of_the_site_is_that_of_the_table(record, table):
    at_site = table.assign(**SITE)
    motion = record_motion(record, at_site, Screening())
    assert set(motion.first.ln_ratio) == {0.4}
    assert set(motion.second.ln_ratio) == {-0.2}
    assert set(motion.first.motion_log_std) == {0.5}
    # the exact demand is scaled as the pair's
    ratios, stds = both(at_site, "ln_per_ratio"), both(at_site, "ln_per_std")
    ln_ratio, log_std = pair_motion(at_contact(table, "per"), ratios, stds, both(table, "period"))
    assert_array_equal(motion.pair_log_std, log_std)
    expected = values(table, "demand_exact") * np.exp(ln_ratio)
    assert motion.exact_demand[EXACT] == expected[EXACT]


def test_without_a_field_of_stations_the_site_has_the_motion_of_the_record(record, table):
    # unknown motion counts as that of the record, with the deviation of none
    unknown = record_motion(record, table.assign(**dict.fromkeys(SITE, np.nan)), Screening())
    absent = record_motion(record, table, Screening())
    for motion in (unknown, absent):
        assert not motion.first.ln_ratio.any()
        assert not motion.second.motion_log_std.any()
        assert not motion.pair_log_std.any()
