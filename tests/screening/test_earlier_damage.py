"""Pairs after an earlier earthquake: what starts anew, what stays, and what nobody knows."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import make_pairs, make_station

import per_obspy
from per_obspy.screening.earlier_damage import NEEDED, pairs_after

#: Pairs by name: strong ones stay elastic by their yield value, weak ones yield.
STRONG = {"yield_displacement_1": 5.0, "yield_displacement_2": 5.0}
WEAK = {"yield_displacement_1": 0.005, "yield_displacement_2": 5.0, "hardening_1": 0.1}
WALLS = {"system_1": "concrete_wall", "system_2": "concrete_wall", "period_1": 0.6}
ROWS = {
    "strong": {**STRONG, "gap": 3.0},
    "weak": {**WEAK, "gap": 0.3, "gap_std": 0.02},
    "weak and hit": {**WEAK, "gap": 0.002},
    "weak, no azimuth": {**WEAK, "gap": 3.0, "azimuth": np.nan},
    "linear and hit": {"gap": 0.0},
    "linear, far apart": {"gap": 3.0},
    "linear, elastic": {"gap": 3.0, **WALLS},
    "no gap": {**WEAK, "gap": np.nan},
}


def named(rows):
    return make_pairs(list(rows.values())).assign(pair_id=list(rows))


@pytest.fixture(scope="module")
def station():
    """A station at which walls stay elastic, by the yield displacement of HAZUS, and frames not."""
    return make_station(scale=0.02)


@pytest.fixture(scope="module")
def first(station):
    return per_obspy.risk_table(station, named(ROWS))


@pytest.fixture(scope="module")
def after(first):
    return pairs_after(named(ROWS), first, "moderate").set_index("pair_id")


def test_histories_leave_gaps_and_the_rest_is_unknown(first, after):
    words = dict(zip(after.index, after["after_damage"], strict=True))
    assert words == {
        "strong": "", "weak": "residual", "weak and hit": "residual",
        "weak, no azimuth": "unknown", "linear and hit": "unknown",
        # beyond the elastic range of the weakest system, of which the pair may be
        "linear, far apart": "unknown", "linear, elastic": "", "no gap": "unknown",
    }  # fmt: skip
    table = first.set_index("pair_id").loc[after.index]
    # elastic buildings come to rest where they stood
    assert table.loc["strong", ["residual_1", "residual_2"]].tolist() == [0.0, 0.0]
    assert table.loc["strong", "residual_gap"] == 3.0
    residual = (after["after_damage"] == "residual").to_numpy()
    assert_array_equal(after["gap"][~residual], table["gap"][~residual])
    assert after["gap_before"][~residual].isna().all()
    # what is left of the gap, never less than nothing
    left = (table["gap"] + table["residual_2"] - table["residual_1"]).clip(lower=0.0)
    assert_allclose(after["gap"][residual], left[residual], rtol=1e-12)
    assert_array_equal(after["gap_before"][residual], table["gap"][residual])
    assert (table["residual_1"][residual].abs() > 1e-4).all()
    # neither residual is known better than it is large, beside the tape
    assert after["gap"]["weak"] > 0.0
    assert after["gap_std"]["weak"] >= np.hypot(table["residual_1"]["weak"], 0.02)
    # what leans on its neighbour touches it, as surely as the gap was known
    leaning = pairs_after(named(ROWS), first.assign(residual_gap=0.0), "moderate")
    assert leaning.set_index("pair_id").loc["weak", ["gap", "gap_std"]].tolist() == [0.0, 0.02]


def test_a_pair_that_may_be_damaged_is_no_no(station, after):
    # catches: a state by the probability alone; a flag that only one of both words raises
    second = per_obspy.risk_table(station, after.reset_index()).set_index("pair_id")
    undamaged = per_obspy.risk_table(station, named(ROWS)).set_index("pair_id")
    assert undamaged.loc["linear, far apart", "state"] == "no"
    assert second.loc["linear, far apart", "state"] == "unlikely"
    assert second.loc["linear, elastic", "state"] == "no"
    for word, flag in (("unknown", "after_damage_unknown"), ("residual", "residual_gap")):
        flagged = second["flags"].str.split().map(lambda names, flag=flag: flag in names)
        assert_array_equal(flagged, second["after_damage"] == word)


def test_a_third_earthquake_starts_from_what_the_second_left(station, after):
    second = per_obspy.risk_table(station, after.reset_index())
    third = pairs_after(named(ROWS), second, "moderate").set_index("pair_id")
    known = second.set_index("pair_id").loc["weak"]
    assert known["gap"] == after.loc["weak", "gap"]
    assert third.loc["weak", "gap"] == known["residual_gap"]
    # the gap of the pair table stays the one that was surveyed, and what is unknown stays so
    assert third.loc["weak", "gap_before"] == 0.3
    assert (third["after_damage"] == "unknown").tolist() == (
        after["after_damage"] == "unknown"
    ).tolist()


def test_gaps_measured_since_stay_and_other_pairs_are_unknown(first):
    measured = {**ROWS, "weak": {**WEAK, "gap": 0.28, "gap_std": 0.005}}
    now = named(measured).assign(gap_std_source="given")
    found = pairs_after(now, first, "moderate").set_index("pair_id")
    assert found.loc["weak", ["gap", "gap_std"]].tolist() == [0.28, 0.005]
    assert found.loc["weak", "after_damage"] == ""
    # outlines that were evaluated in another way are no measurement
    again = pairs_after(now.assign(gap_std_source="assumed"), first, "moderate")
    assert again.set_index("pair_id").loc["weak", "after_damage"] == "residual"
    # a pair that was not screened, and one of the same name elsewhere
    there = named(ROWS).assign(longitude_1=lambda table: table["longitude_1"] + 0.01)
    for pairs, rows in ((there, first), (named(ROWS), first[:0])):
        assert set(pairs_after(pairs, rows, "moderate")["after_damage"]) == {"unknown"}


def test_every_needed_column_is_in_a_risk_table(first):
    assert set(NEEDED) <= set(first)
