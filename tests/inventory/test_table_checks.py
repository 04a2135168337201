"""Checks of a pair table as a whole: its profile, derived and unused columns."""

import numpy as np
import pandas as pd

from per_obspy.errors import Rejection
from per_obspy.inventory.checking import checked_pairs
from per_obspy.inventory.table_checks import (
    derived_counts,
    faults_by_column,
    inventory_profile,
    unused_columns,
)


def test_a_small_inventory():
    pairs = pd.DataFrame({
        "pair_id": ["a", "b", "c"], "gap": [0.0, 0.0, 0.3], "period_1": [np.nan, 0.4, np.nan],
        "system_1": ["other", "", "other"], "site_class": ["", "", ""], "note": ["x", "y", "z"],
    })  # fmt: skip
    profile = inventory_profile(pairs).set_index("column")
    assert profile.index.tolist() == ["pair_id", "gap", "site_class", "system_1", "period_1"]
    assert profile["given"].tolist() == [3, 3, 0, 2, 1]
    assert profile.loc["gap", ["unit", "smallest", "median", "largest"]].tolist() == [
        "m",
        0.0,
        0.0,
        0.3,
    ]
    assert profile["most_frequent"].tolist()[1:] == ["0.0", "", "other", "0.4"]
    assert np.isnan(profile.loc["system_1", "median"])


def _pairs(**columns):
    place = {"longitude_1": 0.3, "latitude_1": 0.1, "longitude_2": 0.3001, "latitude_2": 0.1}
    table = {
        "pair_id": ["a", "b"],
        "gap": [0.0, 0.2],
        "height_1": 9.0,
        "height_2": 12.0,
        **place,
        **columns,
    }
    return checked_pairs(pd.DataFrame(table), "pairs.csv")


def test_what_is_derived_is_counted_by_rows():
    counts = derived_counts(_pairs(period_1=[0.4, np.nan], period_2=0.5, mass_1=2e5))
    assert counts["period_1"] == 1
    assert counts["mass_2"] == 2
    assert not {"period_2", "mass_1", "height_1", "gap"} & set(counts)


def test_a_mistyped_column_is_asked_about():
    assert unused_columns(_pairs(perod_1=0.4, ward="x")) == [
        "perod_1, did you mean period_1?",
        "ward",
    ]


def test_faults_are_counted_by_column():
    rows = [
        ("gap = 50 m is outside", "height_1 = 0 m is outside"),
        ("gap = 51 m is outside",),
        ("no geometry",),
    ]
    rejected = [Rejection("pair", "x", "", None, reasons) for reasons in rows]
    assert faults_by_column(rejected) == {"gap": 2, "height_1": 1, "no geometry": 1}
