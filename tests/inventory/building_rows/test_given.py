"""Values of buildings in a table: neither derived nor infinite ones."""

import numpy as np
import pandas as pd

from per_obspy.inventory.building_rows.given import given_values, is_derived


def test_whole_names_count():
    derived = pd.Series(["period_1 mass_2", "period_11", ""])
    assert is_derived(derived, "period_1").tolist() == [True, False, False]


def test_derived_infinite_and_absent_values_are_not_given():
    table = pd.DataFrame(
        {
            "derived": ["", "period_1"],
            "period_1": [0.5, 0.6],
            "period_2": [0.7, 0.8],
            "yield_displacement_1": [np.inf, 0.1],
            "hardening_1": [0.0, 0.02],
        }
    )
    given = given_values(table)
    np.testing.assert_array_equal(given["period"], [[0.5, 0.7], [np.nan, 0.8]])
    np.testing.assert_array_equal(given["yield_displacement"][:, 0], [np.nan, 0.1])
    # the hardening of a building that does not yield means nothing
    np.testing.assert_array_equal(given["hardening"][:, 0], [np.nan, 0.02])
    assert np.isnan(given["mass"]).all()
