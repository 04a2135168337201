"""Screening by a spectrum: limits that the demand must keep, and pairs outside the spectrum."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.special import ndtr

from per_obspy.config import Building, Codes, Screening
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.reliability import sd_error
from per_obspy.screening.codes import code_rules, rule_columns
from per_obspy.screening.columns import RESULTS
from per_obspy.screening.design import DESIGN, LEADING, DesignSpectrum, design_table

#: SD = 0.1 m/s times the period, at every damping.
SPECTRUM = DesignSpectrum(
    "code.csv", np.array([0.1, 4.0]), np.array([0.02, 0.05]), np.array([[0.01, 0.4], [0.01, 0.4]])
)


def _pairs(**columns):
    """Return pairs of two buildings of 0.5 and 1 s, with columns of their own."""
    plain = {"gap": 0.1, "height_1": 12.0, "height_2": 12.0, "period_1": 0.5, "period_2": 1.0}
    given = plain | columns
    count = max(np.size(column) for column in given.values())
    # all in one place: there is no record
    place = dict.fromkeys(("longitude_1", "latitude_1", "longitude_2", "latitude_2"), 0.0)
    names = [f"p{number}" for number in range(count)]
    return pd.DataFrame({"pair_id": names, **place}).assign(**given)


ASCE = Screening(codes=Codes(rules=("asce7-16",)))


def _table(pairs, screening=ASCE):
    return design_table(SPECTRUM, pairs, Building(), screening).set_index("pair_id")


def test_the_demand_by_hand():
    # participations given as 1: radii are 0.05 and 0.1 m; far periods are nearly uncorrelated under
    # white noise
    row = _table(_pairs(participation_1=1.0, participation_2=1.0)).loc["p0"]
    assert_allclose([row["sd_1"], row["sd_2"]], [0.05, 0.1], rtol=1e-12)
    assert_allclose(row["srss_gap_sd"], np.hypot(0.05, 0.1), rtol=1e-12)
    assert_allclose(row["absolute_gap_sd"], 0.15, rtol=1e-12)
    assert row["demand_rule"] == "sd_white_noise"
    squared_gap = 0.05**2 + 0.1**2 - 2 * row["correlation"] * 0.05 * 0.1
    assert_allclose(row["demand"] ** 2, squared_gap, rtol=1e-10)
    assert 0.0 < row["correlation"] < 0.05
    # a gap of 0.9 of the demand, of which the estimate is uncertain
    assert row["state"] == "likely"
    assert_allclose(row["demand_ratio"], 0.1 / row["demand"], rtol=1e-12)
    assert row["impact_velocity"] > 0


def test_demands_are_at_contact_level():
    # twice the participation, twice the demand; would catch a radius of the plain oscillator
    once = _table(_pairs(participation_1=1.0, participation_2=1.0)).loc["p0"]
    twice = _table(_pairs(participation_1=2.0, participation_2=2.0)).loc["p0"]
    assert_allclose(twice["demand"], 2 * once["demand"], rtol=1e-12)
    rule = "required_gap_asce7_event_based"
    assert_allclose(twice[rule], 2 * once[rule], rtol=1e-12)
    assert twice["sd_1"] == once["sd_1"]


def test_code_rules_know_the_property():
    # catches: a column of text that does not reach the rules
    table = _table(_pairs(same_property=["yes", "no"], gap=0.1))
    one, two = table["required_gap_asce7_event_based"]
    radii = [table["participation_1"] * table["sd_1"], table["participation_2"] * table["sd_2"]]
    assert_allclose(one, np.hypot(*(radius.iloc[0] for radius in radii)), rtol=1e-12)
    assert_allclose(two, sum(radius.iloc[1] for radius in radii), rtol=1e-12)


def test_equal_buildings_are_safe_only_if_their_periods_are_known():
    given = {"period_1": 0.7, "period_2": 0.7, "damping_1": 0.05, "damping_2": 0.05}
    known = _table(_pairs(**given, gap=0.01)).loc["p0"]
    assert known["demand"] == pytest.approx(0.0, abs=1e-9)
    assert (known["state"], known["probability"]) == ("no", 0.0)
    derived = _table(_pairs(period_1=np.nan, period_2=np.nan, gap=[0.01, 9.0]))
    assert derived["demand_rule"].tolist() == ["sd_srss", "sd_srss"]
    assert derived.loc["p0", "state"] == "yes"
    assert derived.loc["p1", "state"] == "no"  # 9 m: nothing but the population decides
    assert derived.loc["p0", "probability"] > 0.5 > derived.loc["p1", "probability"]


def test_a_gap_close_to_the_demand_is_in_between():
    # the estimate errs: a gap 10 % above the demand is pounded across in a third of cases
    plain = {"participation_1": 1.0, "participation_2": 1.0, "damping_1": 0.05, "damping_2": 0.05}
    demand = _table(_pairs(**plain)).loc["p0", "demand"]
    error = sd_error(0.5, 0.05, 1.0, 0.05)
    table = _table(_pairs(gap=demand * np.array([0.9, 1.1, 3.0]), **plain))
    assert table.loc[["p0", "p1", "p2"], "state"].tolist() == ["likely", "possible", "no"]
    # the logarithm of the gap over the estimate's median, in standard deviations of the estimate
    expected = ndtr(-np.log(np.array([0.9, 1.1, 3.0]) * error.median) / error.log_std)
    assert_allclose(table.loc[["p0", "p1", "p2"], "probability"], expected, atol=1e-9)


def test_unknown_periods_widen_the_probability_towards_one_half():
    # independent of the nodes: a hundred thousand drawn pairs of periods; standard error 0.0015
    pairs = _pairs(period_log_std_1=0.3, period_log_std_2=0.3, gap=0.12)
    pairs = pairs.assign(participation_1=1.0, participation_2=1.0)
    pairs = pairs.assign(damping_1=0.05, damping_2=0.05)
    probability = _table(pairs).loc["p0", "probability"]
    random = np.random.default_rng(8)
    period = np.array([[0.5], [1.0]]) * np.exp(0.3 * random.normal(size=(2, 100_000)))
    demand = critical_gap(*(0.1 * period), ddc_correlation(period[0], 0.05, period[1], 0.05))
    error = sd_error(0.5, 0.05, 0.5 * np.exp(np.hypot(np.log(2.0), np.hypot(0.3, 0.3))), 0.05)
    scatter = np.exp(error.log_std * random.normal(size=100_000))
    pounded = demand / error.median * scatter > 0.12
    # 128 quasi-random nodes integrate the probability of a gap near the middle to about 0.01
    assert probability == pytest.approx(pounded.mean(), abs=0.02)


def test_a_spectrum_leaves_the_error_of_the_estimate_and_of_uncertain_dampings():
    # building 2 moves 1e-4 of its SD: the critical gap is the SD of building 1, 0.1 m
    still = {"participation_1": 1.0, "participation_2": 1e-4, "period_1": 1.0, "damping_1": 0.05}
    table = _table(_pairs(**still, damping_2=0.05, gap=[0.08, 0.1, 0.13]))
    error = sd_error(1.0, 0.05, table.loc["p0", "period_2"], 0.05)
    median = 0.1 / error.median
    expected = ndtr(np.log(median / np.array([0.08, 0.1, 0.13])) / error.log_std)
    found = table.loc[["p0", "p1", "p2"], "probability"]
    assert_allclose(found, expected, atol=1e-3)
    # a radius that falls as the root of the damping: half its log-standard deviation
    grid = np.array([0.01, 0.05, 0.25])
    falling = DesignSpectrum(
        "code.csv", np.array([0.1, 4.0]), grid, np.outer(np.sqrt(0.05 / grid), [0.01, 0.4])
    )
    pairs = _pairs(**still, damping_2=0.05, gap=0.13, damping_log_std_1=0.4)
    widened = design_table(falling, pairs, Building(), Screening())["probability"].iloc[0]
    expected = ndtr(np.log(median / 0.13) / np.hypot(0.2, error.log_std))
    # 128 nodes of one dimension
    assert_allclose(widened, expected, atol=5e-3)


def test_pairs_outside_the_spectrum_are_rejected_with_their_values():
    # would catch: one reason per pair, or the span of the other axis
    columns = {"period_1": [0.5, 0.05, 0.5], "period_2": [1.0, 5.0, 1.0]}
    pairs = _pairs(**columns, damping_1=[0.05, 0.05, 0.1])
    table = design_table(SPECTRUM, pairs, Building(), Screening())
    assert table["pair_id"].tolist() == ["p0"]
    short, damped = table.attrs["rejected"]
    assert short.reasons == (
        "period_1 = 0.05 s is outside the spectrum's 0.1 to 4 s",
        "period_2 = 5 s is outside the spectrum's 0.1 to 4 s",
    )
    assert damped.reasons == ("damping_1 = 0.1 is outside the spectrum's 0.02 to 0.05",)
    assert {rejection.source for rejection in table.attrs["rejected"]} == {"code.csv"}


def test_nothing_left_is_an_empty_table_with_all_columns():
    table = design_table(SPECTRUM, _pairs(period_1=9.0), Building(), Screening())
    assert table.empty
    assert set(LEADING) <= set(table)
    assert len(table.attrs["rejected"]) == 1


def test_touching_pairs_are_answered_and_the_worst_is_first():
    table = _table(_pairs(gap=[0.5, 0.0, 0.05]))
    assert table.index.tolist()[-1] == "p0"
    assert table.loc["p1", "demand_ratio"] == 0.0
    assert table["rank"].tolist() == [1, 2, 3]


def test_order_of_the_buildings_does_not_matter():
    pairs = _pairs(gap=0.02, height_1=12.0, height_2=18.0, contact_height=12.0, restitution=0.5)
    exchanged = {"1": "2", "2": "1"}
    names = {n: n[:-1] + exchanged[n[-1]] for n in pairs if n[-2:] in ("_1", "_2")}
    row, other = _table(pairs).loc["p0"], _table(pairs.rename(columns=names)).loc["p0"]
    # the grazing state is found by an iteration with an end at 1e-13
    for name in ("demand", "srss_gap_sd", "impact_velocity", "required_gap_asce7_event_based"):
        assert_allclose(row[name], other[name], rtol=1e-9)
    assert_allclose(row["amplification_1"], other["amplification_2"], rtol=1e-9)


def test_every_column_is_described():
    every_rule = Codes(gb_intensity=7, rules=tuple(code_rules()["rule"]))
    table = _table(_pairs(), Screening(codes=every_rule)).reset_index()
    described = {*RESULTS, *DESIGN, *rule_columns(), "pair_id", "gap"}
    rules = {name for name in table if name.startswith("required")}
    assert len(rules) == len(every_rule.rules)
    assert {*LEADING, *rules} <= described
