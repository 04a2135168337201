"""Columns of a pair table that may be absent, and names of flags as text."""

import numpy as np
import pandas as pd
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from per_obspy.inventory.table_columns import joined_names, numbers_in


def test_a_column_that_is_absent_is_nan_in_every_row():
    pairs = pd.DataFrame({"gap": [1, 2]})
    assert_array_equal(numbers_in(pairs, "gap"), [1.0, 2.0], strict=True)
    assert_array_equal(numbers_in(pairs, "height_1"), [np.nan, np.nan], strict=True)


@given(st.integers(1, 63), st.integers(0, 20), st.integers(0, 2**32 - 1))
def test_names_are_those_of_the_true_flags_in_order(count, rows, seed):
    # would catch a bit that overflows at 63 names, and texts of one row written into another
    flags = np.random.default_rng(seed).random((count, rows)) < 0.3
    names = [f"flag_{i}" for i in range(count)]
    expected = [" ".join(np.array(names)[flags[:, row]]) for row in range(rows)]
    assert joined_names(dict(zip(names, flags, strict=True))).tolist() == expected
