"""Scores of predictions whose scores are known."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from per_obspy.screening.evaluation import brier_score, evaluation, reliability


def test_a_table_by_hand():
    table = pd.DataFrame(
        {
            "observed": [1.0, 1.0, 1.0, 0.0, 0.0, np.nan],
            "state": ["yes", "likely", "possible", "likely", "unlikely", "yes"],
            "probability": [0.8, 0.6, 0.4, 0.6, 0.2, 0.9],
        }
    )
    got = evaluation(table)
    assert (got.pairs, got.pounded) == (5, 3)
    # of three that pounded two were yes or likely and one possible; of two others one was likely
    rates = [got.hit_rate, got.hit_rate_with_possible, got.false_alarm_rate]
    assert_allclose(rates, [2 / 3, 1.0, 1 / 2])
    assert_allclose(got.brier_score, (0.2**2 + 0.4**2 + 0.6**2 + 0.6**2 + 0.2**2) / 5)
    assert_allclose(got.brier_score_of_the_share, 0.6 * 0.4)
    assert got.reliability["events"].sum() == 5


def test_without_probabilities_states_are_still_compared():
    got = evaluation(pd.DataFrame({"observed": [1.0, 1.0], "state": ["yes", "no"]}))
    assert got.hit_rate == 0.5
    assert np.isnan(got.brier_score)
    assert np.isnan(got.false_alarm_rate)
    assert got.reliability.empty


def test_the_score_of_certainty_and_of_its_opposite():
    observed = [1, 0, 1, 0]
    assert brier_score(observed, observed) == 0.0
    assert brier_score(observed, [0, 1, 0, 1]) == 1.0
    assert brier_score(observed, [0.5] * 4) == 0.25


def test_a_calibrated_prediction_is_reliable():
    # would catch bins that are shifted or shares of the wrong side
    random = np.random.default_rng(11)
    probability = random.uniform(0, 1, 100_000)
    table = reliability(random.uniform(0, 1, 100_000) < probability, probability)
    assert table["events"].sum() == 100_000
    assert (
        (table["low"] <= table["mean_probability"]) & (table["mean_probability"] <= table["high"])
    ).all()
    # ten bins: the largest of ten normal deviates passes four standard deviations once in 1600
    # seeds, this one does not
    assert (
        np.abs(table["observed_share"] - table["mean_probability"]) < 4 * table["share_std"]
    ).all()
    # Brier score of a calibrated prediction: mean of p(1 - p) = 1/6, with a standard error of
    # 0.0005
    assert brier_score(random.uniform(0, 1, 100_000) < probability, probability) == pytest.approx(
        1 / 6, abs=0.002
    )


def test_certainty_falls_into_the_last_bin():
    assert reliability([1, 1], [1.0, 0.95], bins=10)["events"].tolist() == [2]


def test_what_is_no_observation_is_named():
    with pytest.raises(ValueError, match=r"observed must be 0 or 1, got 0\.5"):
        evaluation(pd.DataFrame({"observed": [0.5], "state": ["yes"]}))
    with pytest.raises(ValueError, match="observed must have at least one value"):
        evaluation(pd.DataFrame({"observed": [np.nan], "state": ["yes"]}))
