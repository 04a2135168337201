"""Numbers in texts: five digits, exact decimals, and columns of the user unchanged."""

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from per_obspy.results.table_files import rounded, rounded_arrow, rounded_table

TABLE = pd.DataFrame(
    {
        "gap": [0.123456789, np.nan],
        "longitude_1": [-68.123456789, 179.99999999],
        "cadastre": [123456789.123, 1.0],
        "pair_id": ["0.123456789", "b"],
    }
)


@given(st.floats(min_value=1e-15, max_value=1e15), st.sampled_from([-1.0, 1.0]))
def test_numbers_are_written_with_five_digits(value, sign):
    # by Python's own formatting; a tie may go either way
    (found,) = rounded(np.array([sign * value]))
    assert found == float(f"{found:.4e}")
    assert abs(found - sign * value) <= 0.5000001 * 10.0 ** (np.floor(np.log10(value)) - 4)


def test_what_is_not_finite_or_tiny_stays():
    values = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 5e-324, 1.7e308])
    assert rounded(values).tobytes() == values.tobytes()


@pytest.mark.parametrize("form", ["pandas", "arrow"])
def test_only_known_columns_are_rounded(form):
    # would catch cadastral numbers that are cut, and coordinates that move by metres
    if form == "pandas":
        found = rounded_table(TABLE)
    else:
        found = rounded_arrow(pa.Table.from_pandas(TABLE)).to_pandas()
    assert found["gap"].tolist()[0] == 0.12346
    assert np.isnan(found["gap"][1])
    assert found["longitude_1"].tolist() == [-68.1234568, 180.0]
    assert found["cadastre"].tolist() == [123456789.123, 1.0]
    assert found["pair_id"].tolist() == ["0.123456789", "b"]


def test_the_table_itself_keeps_all_digits():
    before = TABLE.copy(deep=True)
    rounded_table(TABLE)
    pd.testing.assert_frame_equal(TABLE, before)


def test_columns_that_the_package_computed_are_rounded_by_their_names():
    found = rounded_table(TABLE, own=["cadastre"])
    assert found["cadastre"].tolist() == [123460000.0, 1.0]


def test_a_tiny_probability_has_five_digits_too():
    # beyond 10^22, the largest power of ten that is exact
    assert rounded(np.array([5.846121131152857e-30])).tolist() == [5.8461e-30]
