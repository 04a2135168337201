"""Profile of an inventory."""

import numpy as np
import pandas as pd

from per_obspy.inventory.profile import inventory_profile


def test_a_small_inventory():
    pairs = pd.DataFrame({
        "pair_id": ["a", "b", "c"], "gap": [0.0, 0.0, 0.3], "period_1": [np.nan, 0.4, np.nan],
        "system_1": ["other", "", "other"], "site_class": ["", "", ""], "note": ["x", "y", "z"],
    })  # fmt: skip
    profile = inventory_profile(pairs).set_index("column")
    assert profile.index.tolist() == ["pair_id", "gap", "site_class", "system_1", "period_1"]
    assert profile["given"].tolist() == [3, 3, 0, 2, 1]
    assert profile.loc["gap", ["unit", "smallest", "median", "largest"]].tolist() == ["m", 0.0, 0.0, 0.3]
    assert profile["most_frequent"].tolist()[1:] == ["0.0", "", "other", "0.4"]
    assert np.isnan(profile.loc["system_1", "median"])
