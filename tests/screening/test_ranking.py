"""The order of pairs: worst first by each criterion in turn, whatever order they came in."""

import numpy as np
import pandas as pd
from hypothesis import given
from hypothesis import strategies as st

from per_obspy.screening.ranking import KEYS, in_order, risk_class, worst_first

#: From worst to best; each row is better than the one before by the criterion in its name.
TABLE = pd.DataFrame(
    [
        ("state", "yes", 0.2, 0.1, 0.9, 1.0, 1.0),
        ("probability", "possible", 0.9, 0.1, 0.9, 1.0, 1.0),
        ("velocity", "possible", 0.5, 0.5, 0.9, 1.0, 1.0),
        ("ratio", "possible", 0.5, 0.2, 0.4, 1.0, 1.0),
        ("importance", "possible", 0.5, 0.2, 0.9, 1.5, 1.0),
        ("occupants", "possible", 0.5, 0.2, 0.9, 1.0, 90.0),
        ("x name", "possible", 0.5, 0.2, 0.9, 1.0, 1.0),
        ("y name", "possible", 0.5, 0.2, 0.9, 1.0, 1.0),
        ("z no demand", "possible", 0.5, 0.2, np.nan, 9.0, 9.0),
        ("no", "no", 0.5, np.nan, 0.1, 9.0, 9.0),
    ],
    columns=[
        "pair_id",
        "state",
        "probability",
        "impact_velocity",
        "demand_ratio",
        "importance_2",
        "occupants_1",
    ],
)


@given(st.permutations(range(len(TABLE))))
def test_the_worst_is_first_however_the_pairs_came(order):
    # would catch a criterion that is missing, turned round, or in the wrong place
    shuffled = TABLE.iloc[list(order)]
    ranked = worst_first(shuffled, shuffled["impact_velocity"])
    assert ranked["pair_id"].tolist() == TABLE["pair_id"].tolist()
    assert ranked["rank"].tolist() == list(range(1, len(TABLE) + 1))


def test_probabilities_importance_and_occupants_may_be_unknown():
    bare = TABLE[["pair_id", "state", "demand_ratio"]]
    ranked = worst_first(bare, np.zeros(len(bare)))
    assert ranked["pair_id"].iloc[0] == "state"
    assert ranked["pair_id"].iloc[-1] == "no"
    assert list(bare) == ["pair_id", "state", "demand_ratio"]  # the caller's table is as it was


def test_keys_rise_from_the_worst_pair_on():
    # pieces of a table are merged by these columns
    keys = in_order(TABLE, TABLE["impact_velocity"])[[*KEYS]].to_numpy().tolist()
    assert keys == sorted(keys)


def test_no_pairs_have_an_order():
    empty = worst_first(TABLE.iloc[:0], TABLE["impact_velocity"].iloc[:0])
    assert empty.empty
    assert "rank" in empty


def test_a_class_includes_its_threshold():
    classes = {"severe": 0.5, "high": 1.0, "low": np.inf}
    ratio = np.array([0.0, 0.5, np.nextafter(0.5, 1.0), 1.0, 7.0, np.nan])
    assert risk_class(ratio, classes).tolist() == ["severe", "severe", "high", "high", "low", "low"]


def test_a_ratio_above_every_threshold_has_the_last_class():
    # would catch an index beyond the names where the last threshold is finite
    assert risk_class(np.array([9.0]), {"high": 1.0, "low": 2.0}).tolist() == ["low"]
