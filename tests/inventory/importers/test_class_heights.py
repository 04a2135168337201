"""Heights from buildings of the same class, with the deviation of the class."""

import numpy as np
import pandas as pd
import pytest
from screening_samples import make_pairs, make_station

import per_obspy
from per_obspy.inventory.importers.class_heights import ENOUGH, with_class_heights
from per_obspy.inventory.importers.recognition import imported


def _town(count=400, seed=3):
    # two classes of known medians and deviations
    rng = np.random.default_rng(seed)
    low = 6.0 * np.exp(rng.normal(0, 0.2, count))
    high = 30.0 * np.exp(rng.normal(0, 0.5, count))
    table = pd.DataFrame({"height": np.concatenate([low, high]), "storeys": np.nan})
    return table, pd.Series(["house"] * count + ["tower"] * count)


def test_a_missing_height_has_median_and_deviation_of_its_class():
    table, classes = _town()
    table.loc[[0, 400], "height"] = np.nan
    filled = with_class_heights(table, classes)
    # 400 values: the median is off by 1.25 s / 20, the deviation by s / sqrt(800), three times that
    assert filled.loc[0, "height"] == pytest.approx(6.0, rel=0.04)
    assert filled.loc[400, "height"] == pytest.approx(30.0, rel=0.10)
    assert filled.loc[0, "height_log_std"] == pytest.approx(0.2, abs=0.021)
    assert filled.loc[400, "height_log_std"] == pytest.approx(0.5, abs=0.053)
    known = filled.index.difference([0, 400])
    assert filled.loc[known, "height"].tolist() == table.loc[known, "height"].tolist()
    assert filled.loc[known, "height_log_std"].isna().all()


def test_too_few_known_buildings_give_no_estimate():
    # one below the limit, and one at it
    for known, is_filled in ((ENOUGH - 1, False), (ENOUGH, True)):
        table = pd.DataFrame({"height": [np.nan, *([9.0] * known)]})
        filled = with_class_heights(table, pd.Series(["house"] * (known + 1)))
        assert pd.notna(filled.loc[0, "height"]) == is_filled
        # equal heights: a smallest deviation keeps the mark
        if is_filled:
            assert filled.loc[0, "height_log_std"] > 0.0


def test_storeys_are_estimated_where_a_class_has_no_heights():
    table = pd.DataFrame({"height": [np.nan] * 41, "storeys": [np.nan, *([2.0, 4.0] * 20)]})
    filled = with_class_heights(table, pd.Series(["yes"] * 41))
    assert filled["height"].isna().all()
    assert filled.loc[0, "storeys"] == pytest.approx(np.sqrt(8.0))
    assert filled.loc[0, "height_log_std"] == pytest.approx(np.log(2.0) / 2.0, rel=0.02)


def test_storeys_or_cells_that_are_not_understood_are_not_replaced():
    table = pd.DataFrame(
        {"height": [np.nan, np.nan, *([9.0] * 30)], "storeys": [3.0] + [np.nan] * 31}
    )
    is_understood = np.arange(32) != 1
    filled = with_class_heights(table, pd.Series([""] * 32), is_understood)
    assert filled["height"].isna().tolist()[:3] == [True, True, False]


def test_layers_of_surveys_are_left_as_they_are():
    # a survey's empty cell may be an empty lot
    survey = {"n_storeys": [None, *([2.0] * 30)], "touches_left": None, "touches_right": None}
    table = imported(pd.DataFrame(survey | {"llrs": "LFM", "structural_system": "CR"}), "town")
    assert np.isnan(table["storeys"].tolist()[0])
    assert "height_log_std" not in table


def test_the_deviation_of_a_height_reaches_the_probability():
    # one pair whose gap is well above its demand: uncertain heights make pounding likelier
    probability = []
    for deviation in (0.0, 0.6):
        pairs = make_pairs([{"gap": 0.4, "period_1": np.nan, "period_2": np.nan}])
        pairs = pairs.assign(height_log_std_1=deviation, height_log_std_2=deviation)
        risk = per_obspy.risk_table([make_station()], pairs)
        probability.append(float(risk["probability"].iloc[0]))
        assert ("height_1" in risk["derived"].iloc[0].split()) == (deviation > 0.0)
    assert probability[1] > 1.2 * probability[0] > 0.0
