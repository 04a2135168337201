"""Scenarios together: limits, and pairs that a scenario lacks."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_less
from scipy.special import ndtr, ndtri

from per_obspy.screening.columns import DEMAND_SHARES
from per_obspy.screening.ensemble import (
    ORDER,
    SEVERITY,
    annual_probability,
    conditional_probability,
    ensemble_columns,
    ensemble_rejections,
    ensemble_rows,
    gap_for_rate,
)


def test_one_scenario_is_itself_and_equal_ones_are_one():
    chance = np.array([[0.0, 0.3, 1.0]])
    assert_allclose(conditional_probability(chance, [7.0]), chance[0], rtol=1e-15)
    assert_allclose(
        conditional_probability(np.repeat(chance, 3, axis=0), [1, 2, 3]), chance[0], rtol=1e-15
    )


def test_only_the_proportion_of_weights_counts():
    chance = np.random.default_rng(1).uniform(0, 1, (4, 50))
    weights = np.array([1.0, 2.0, 0.0, 5.0])
    got = conditional_probability(chance, weights)
    assert_allclose(conditional_probability(chance, 1e-3 * weights), got, rtol=1e-13)
    # a scenario of weight 0 changes no probability
    assert_allclose(conditional_probability(chance[[0, 1, 3]], weights[[0, 1, 3]]), got, rtol=1e-13)
    assert ((chance.min(axis=0) <= got) & (got <= chance.max(axis=0))).all()


def test_a_year_by_drawing_it():
    # Poisson numbers of each scenario, each event pounding by its probability: an implementation by
    # counting
    random = np.random.default_rng(4)
    chance, rates = np.array([[0.8], [0.3]]), np.array([0.2, 0.5])
    events = random.poisson(rates, (200_000, 2))
    hits = random.binomial(events, chance[:, 0]).sum(axis=1)
    # standard error of a share near 0.27 of 200 000 years: 0.001
    assert annual_probability(chance, rates)[0] == pytest.approx((hits > 0).mean(), abs=0.004)


def test_rare_scenarios_keep_their_digits():
    # would catch 1 - exp(-x), which has lost half of its digits at 1e-9
    assert_allclose(annual_probability([[0.5]], [2e-9]), [1e-9], rtol=1e-8)
    assert annual_probability([[1.0]], [0.0])[0] == 0.0


WEIGHTS = {"near": 3.0, "far": 1.0}


def _joined(*rows):
    """Return pairs at one place whose scenarios were joined, from name and probabilities."""
    table = pd.DataFrame(rows, columns=["pair_id", "probability_near", "probability_far"])
    same = {"gap": 0.05, "longitude": 20.0, "latitude": 10.0}
    # the same severity in both, as far as a scenario has the pair
    for name in ("near", "far"):
        known = table[f"probability_{name}"].notna()
        for column, value in (("expected_impact_velocity", 0.5), ("weighted_velocity", 1.0)):
            table[f"{column}_{name}"] = np.where(known, value, np.nan)
        table[f"demand_{name}"] = np.where(known, 0.1, np.nan)
        table[f"expected_amplification_{name}"] = np.nan
    table = table.assign(configuration="floor_to_column", period_1=0.5, period_2=1.0)
    return table.assign(**same, **{f"{name}_largest": value for name, value in same.items()})


def test_every_pair_has_its_probabilities_and_its_worst_scenario():
    joined = _joined(("a", 0.2, 0.4), ("b", 0.9, 0.1), ("c", 0.9, 0.1))
    joined.loc[2, ["expected_impact_velocity_far", "weighted_velocity_far"]] = 0.6, 1.2
    table = ensemble_rows(joined, WEIGHTS, yearly=False)
    assert_allclose(table["probability"], [0.25, 0.7, 0.7])
    # of equal velocities the likelier scenario; a harder impact outranks it
    assert table["worst_scenario"].tolist() == ["far", "near", "far"]
    described = [name for name in ensemble_columns(WEIGHTS, yearly=False) if name != "rank"]
    assert list(table) == [*described, ORDER]
    assert "annual_probability" not in table


def test_the_expected_severity_is_the_weighted_mean_of_the_scenarios():
    joined = _joined(("a", 0.5, 0.0)).assign(
        expected_impact_velocity_far=8.0,
        weighted_velocity_far=16.0,
        expected_amplification_near=1.6,
    )
    table = ensemble_rows(joined, WEIGHTS, yearly=False)
    # three quarters of the weight; an unknown amplification is 1
    assert_allclose(table["expected_impact_velocity"], 0.75 * 0.5 + 0.25 * 8.0)
    # the factor of the configuration is that of the scenarios
    assert_allclose(table["weighted_velocity"], 2.0 * table["expected_impact_velocity"])
    assert table["configuration"].tolist() == ["floor_to_column"]
    assert_allclose(table["expected_amplification"], 1.0 + 0.75 * 0.6)


def test_rates_give_a_probability_in_a_year_too():
    table = ensemble_rows(_joined(("a", 1.0, 0.0)), {"near": 0.01, "far": 0.03}, yearly=True)
    assert_allclose(
        table["annual_probability"], 0.01 - 0.01**2 / 2, rtol=2e-5
    )  # the next term is 0.01**3 / 6
    assert_allclose(table["probability"], 0.25)


def test_a_pair_does_not_depend_on_other_pairs():
    # would catch a matrix product, which adds in another order for other sizes
    random = np.random.default_rng(6)
    rows = [(f"p{i}", *random.uniform(0, 1, 2)) for i in range(37)]
    table = ensemble_rows(_joined(*rows), {"near": 0.3, "far": 0.1}, yearly=True)
    for i, row in enumerate(rows):
        alone = ensemble_rows(_joined(row), {"near": 0.3, "far": 0.1}, yearly=True)
        pd.testing.assert_frame_equal(
            alone, table.iloc[i : i + 1].reset_index(drop=True), check_exact=True
        )


NUMBERS = ["probability", "annual_probability", *SEVERITY]


def test_a_pair_that_a_scenario_lacks_is_ranked_by_the_others_and_has_no_number():
    # would catch a missing probability that counts as 0, and a pair that is left out
    joined = _joined(("a", 0.2, 0.2), ("b", 0.9, np.nan), ("c", np.nan, 0.1))
    joined["weighted_velocity_near"] *= 3.0
    table = ensemble_rows(joined, WEIGHTS, yearly=True)
    assert table["pair_id"].tolist() == ["a", "b", "c"]
    assert table[NUMBERS].notna().all(axis=1).tolist() == [True, False, False]
    assert table[NUMBERS].iloc[1:].isna().all(axis=None)
    # the mean of both, 3/4 times 3 and 1/4 times 1, or the one that is known
    assert_allclose(table[ORDER], [2.5, 3.0, 1.0])
    # a scenario without weight is better than nothing
    assert ensemble_rows(joined, WEIGHTS | {"near": 0.0}, yearly=False)[ORDER][1] == 3.0
    assert table["worst_scenario"].tolist() == ["near", "near", "far"]
    assert not list(ensemble_rejections(joined))


def test_a_pair_of_unknown_gap_stands_where_a_run_puts_it():
    unknown = _joined(("b", np.nan, np.nan)).assign(gap=np.nan, gap_largest=np.nan)
    unknown = unknown.assign(demand_near=0.3, demand_far=0.1)
    joined = pd.concat([_joined(("a", 1.0, 1.0)), unknown], ignore_index=True)
    table = ensemble_rows(joined, WEIGHTS, yearly=True)
    assert table[NUMBERS].iloc[1].isna().all()
    # as a touching pair: half of the demand times the mean of both angular frequencies
    frequency = 2.0 * np.pi * (1.0 / 0.5 + 1.0 / 1.0) / 2.0
    assert_allclose(table[ORDER], [1.0, 0.5 * frequency * (0.75 * 0.3 + 0.25 * 0.1)])
    assert table["worst_scenario"].tolist() == ["near", "near"]
    assert not list(ensemble_rejections(joined))


def test_equal_names_of_different_pairs_are_rejected():
    joined = _joined(("a", 0.2, 0.2), ("b", 0.2, 0.2)).assign(
        gap_largest=[0.05, 0.3], latitude_largest=[10.0, 11.0]
    )
    assert ensemble_rows(joined, WEIGHTS, yearly=False)["pair_id"].tolist() == ["a"]
    (rejected,) = ensemble_rejections(joined)
    assert rejected.reasons == (
        "gap = 0.05 m in one scenario and 0.3 m in another",
        "latitude = 10 degrees in one scenario and 11 degrees in another",
    )


def test_wrong_weights_are_named():
    with pytest.raises(ValueError, match="weights must have a positive sum, got 0"):
        conditional_probability([[0.5]], [0.0])
    with pytest.raises(ValueError, match=r"rates must be zero or more, got -1\.0"):
        annual_probability([[0.5]], [-1.0])
    with pytest.raises(ValueError, match=r"weights must be one a scenario \(1\), got 2"):
        conditional_probability([[0.5]], [1.0, 1.0])


def _lognormal(*medians, log_std=0.4):
    """Return the quantiles of a lognormal demand of one pair in each scenario."""
    scores = ndtri([*DEMAND_SHARES.values()])
    return np.exp(np.log(medians)[:, None] + log_std * scores)[:, :, None]


def test_the_gap_for_a_rate_of_lognormal_demands():
    # linear in the normal score: any chance of a lognormal demand is exact, also beyond the shares
    for chance in (0.999, 0.5, 0.1, 1e-3):
        gap = gap_for_rate(_lognormal(0.1), [0.02], 0.02 * chance)
        assert_allclose(gap, 0.1 * np.exp(-0.4 * ndtri(chance)), rtol=2e-6)
    # the gap has the rate, and its own annual rate gives a gap back
    demands, rates = _lognormal(0.03, 0.2), np.array([0.02, 0.002])
    own = rates @ ndtr(np.log(np.array([0.03, 0.2]) / 0.05) / 0.4)
    assert_allclose(gap_for_rate(demands, rates, own), 0.05, rtol=2e-6)
    # two scenarios of half the rate are one, in any order; a rarer contact needs a wider gap
    twice = np.concatenate([demands, demands[::-1]])
    halves = np.concatenate([rates, rates[::-1]]) / 2
    assert_allclose(gap_for_rate(twice, halves, own), 0.05, rtol=2e-6)
    targets = (0.01, 0.003, 0.001, 1e-4)
    assert_array_less(0.0, np.diff([gap_for_rate(demands, rates, one)[0] for one in targets]))


def test_certain_demands_of_one_another_and_none():
    # without uncertainty a gap as wide as the demand suffices; of two scenarios the one that makes
    # the rate decides
    certain = np.repeat(np.array([0.05, 0.3])[:, None], len(DEMAND_SHARES), axis=1)[:, :, None]
    assert_allclose(gap_for_rate(certain, [0.02, 0.001], 0.002), 0.05, rtol=2e-6)
    assert_allclose(gap_for_rate(certain, [0.02, 0.001], 0.0005), 0.3, rtol=2e-6)
    # rarer than the target without a gap, and unknown
    assert gap_for_rate(certain, [0.001, 0.001], 0.002) == 0.0
    assert np.isnan(gap_for_rate(certain * [[[1.0]], [[np.nan]]], [0.02, 0.001], 0.0005))
