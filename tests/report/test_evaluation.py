"""Prediction against observation: the numbers written, and the reliability diagram."""

import json

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from per_obspy.report.evaluation import _draw_shares, draw_reliability, write_evaluation
from per_obspy.screening.evaluation import evaluation


@pytest.fixture
def risk():
    """Return a risk table with these observations, and probabilities if there are any."""

    def risk(observed, probability):
        state = np.where(np.nan_to_num(probability) > 0.5, "yes", "no")
        table = pd.DataFrame(
            {"rank": range(1, len(probability) + 1), "state": state, "probability": probability}
        )
        return table if observed is None else table.assign(observed=observed)

    return risk


def test_only_pairs_that_were_looked_at_count(risk, tmp_path):
    table = risk([1.0, np.nan, 0.0, 1.0], [0.9, 0.9, 0.1, 0.2])
    files = write_evaluation(table, tmp_path, simulated=True)
    assert [file.relative_to(tmp_path).as_posix() for file in files] == [
        "evaluation.json",
        "figures/reliability.png",
    ]
    # By hand: one of two pounded pairs was predicted, no false alarm
    scores = json.loads(files[0].read_text())
    assert (scores["pairs"], scores["pounded"]) == (3, 2)
    assert (scores["hit_rate"], scores["false_alarm_rate"]) == (0.5, 0.0)
    assert scores["brier_score"] == pytest.approx((0.1**2 + 0.1**2 + 0.8**2) / 3)
    assert sum(row["events"] for row in scores["reliability"]) == 3
    assert files[1].read_bytes().startswith(b"\x89PNG")


def test_a_share_of_nothing_is_null_and_the_file_is_json(risk, tmp_path):
    # would catch NaN, which JSON does not know
    (table,) = write_evaluation(risk([0.0, 0.0], [np.nan, np.nan]), tmp_path, simulated=False)
    scores = json.loads(table.read_text(), parse_constant=pytest.fail)
    assert scores["hit_rate"] is scores["brier_score"] is None
    assert scores["reliability"] == []


@pytest.mark.parametrize("observed", [None, [np.nan, np.nan]])
def test_files_of_an_earlier_run_do_not_stay(risk, tmp_path, observed):
    earlier = write_evaluation(risk([1.0, 0.0], [0.9, 0.1]), tmp_path, simulated=False)
    assert write_evaluation(risk(observed, [0.9, 0.1]), tmp_path, simulated=False) == []
    assert not any(file.exists() for file in earlier)


def test_the_diagram_has_the_range_of_a_true_prediction():
    # 100 fair coins: 40 to 60 heads in 19 of 20 tries; would catch a range about the observed share
    observed = np.repeat([1.0, 0.0], [30, 70])
    table = pd.DataFrame({"observed": observed, "state": "yes", "probability": 0.5})
    axes = Figure().subplots()
    _draw_shares(axes, evaluation(table))
    (segment,) = axes.collections[0].get_segments()
    assert segment[:, 0].tolist() == [0.5, 0.5]
    assert segment[:, 1] == pytest.approx([0.4, 0.6])
    assert axes.lines[-1].get_xydata().tolist() == [[0.5, 0.3]]


def test_the_diagram_has_shares_counts_and_scores(drawn):
    figures = drawn("evaluation")
    observed = np.repeat([1.0, 0.0, 1.0, 0.0], [2, 8, 45, 5])
    probability = np.repeat([0.25, 0.85], [10, 50])
    table = pd.DataFrame({"observed": observed, "state": "yes", "probability": probability})
    draw_reliability(evaluation(table), "reliability.png", simulated=True)
    ((figure, _, simulated),) = figures
    assert simulated
    shares, counts = figure.axes

    # Two bins: 2 of 10 and 45 of 50 pounded
    assert shares.lines[-1].get_xydata() == pytest.approx(np.array([[0.25, 0.2], [0.85, 0.9]]))
    assert [(bar.get_x(), bar.get_height()) for bar in counts.patches] == [(0.2, 10), (0.8, 50)]
    # Numbers and units of what is drawn
    assert shares.get_title().startswith("60 pairs looked at, 47 pounded\nBrier score 0.1")
    assert shares.get_ylabel() == "observed share of pounding"
    assert (counts.get_xlabel(), counts.get_yscale()) == (
        "predicted probability of pounding",
        "log",
    )
