"""Scenarios together: limits, and a pair that a scenario does not know."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from per_obspy.screening.ensemble import annual_probability, conditional_probability, ensemble_table


def test_one_scenario_is_itself_and_equal_ones_are_one():
    chance = np.array([[0.0, 0.3, 1.0]])
    assert_allclose(conditional_probability(chance, [7.0]), chance[0], rtol=1e-15)
    assert_allclose(conditional_probability(np.repeat(chance, 3, axis=0), [1, 2, 3]), chance[0], rtol=1e-15)


def test_only_the_proportion_of_weights_counts():
    chance = np.random.default_rng(1).uniform(0, 1, (4, 50))
    weights = np.array([1.0, 2.0, 0.0, 5.0])
    got = conditional_probability(chance, weights)
    assert_allclose(conditional_probability(chance, 1e-3 * weights), got, rtol=1e-13)
    # a scenario of weight 0 says nothing
    assert_allclose(conditional_probability(chance[[0, 1, 3]], weights[[0, 1, 3]]), got, rtol=1e-13)
    assert ((chance.min(axis=0) <= got) & (got <= chance.max(axis=0))).all()


def test_a_year_by_drawing_it():
    # Poisson numbers of each scenario, each event pounding by its probability: an implementation by counting
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


def _table(**probability):
    return pd.DataFrame({"pair_id": list(probability), "probability": list(probability.values())})


def test_tables_are_joined_by_the_names_of_their_pairs():
    # would catch rows joined by position
    table = ensemble_table([_table(a=0.2, b=0.9), _table(b=0.1, a=0.4)], ["near", "far"], [3.0, 1.0])
    assert table["pair_id"].tolist() == ["b", "a"]
    assert_allclose(table["probability"], [0.7, 0.25])
    assert table["worst_scenario"].tolist() == ["near", "far"]
    assert_allclose(table[["probability_near", "probability_far"]], [[0.9, 0.1], [0.2, 0.4]])


def test_a_pair_that_a_scenario_does_not_know_is_rejected_with_its_name():
    table = ensemble_table([_table(a=0.2, b=np.nan), _table(a=0.2)], ["near", "far"], [1.0, 1.0])
    assert table["pair_id"].tolist() == ["a"]
    (rejected,) = table.attrs["rejected"]
    assert (rejected.name, rejected.reasons) == ("b", ("no probability in near, far",))


def test_wrong_weights_are_named():
    with pytest.raises(ValueError, match="weights must have a positive sum, got 0"):
        conditional_probability([[0.5]], [0.0])
    with pytest.raises(ValueError, match=r"rates must be zero or more, got -1\.0"):
        annual_probability([[0.5]], [-1.0])
    with pytest.raises(ValueError, match=r"weights must be one a scenario \(1\), got 2"):
        conditional_probability([[0.5]], [1.0, 1.0])
    with pytest.raises(ValueError, match="each once, got a, a"):
        ensemble_table([_table(x=0.1)] * 2, ["a", "a"], [1.0, 1.0])
