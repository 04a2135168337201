"""Columns as arrays: the same from a DataFrame and from a dict, cut and joined without loss."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

from per_obspy.screening.values import at_contact, both, chosen, components, joined, only, values

TABLE = {
    "per_1": np.array([1.0, 2.0, 3.0]),
    "per_2": np.array([4.0, 5.0, 6.0]),
    "participation_1": np.array([1.0, 1.5, 2.0]),
    "participation_2": np.array([1.0, 0.5, 0.0]),
    "name": np.array(["a", "b", "c"], dtype=object),
}


@pytest.mark.parametrize("table", [TABLE, pd.DataFrame(TABLE)])
def test_lengths_at_contact_height_are_times_the_participation(table):
    # would catch a participation of the other building
    first, second = at_contact(table, "per")
    assert first.tolist() == [1.0, 3.0, 6.0]
    assert second.tolist() == [4.0, 2.5, 0.0]
    assert both(table, "per")[1].tolist() == [4.0, 5.0, 6.0]


def test_columns_are_contiguous_float64():
    # functions of NumPy may differ in the last bit between strides
    column = values({"storeys": np.arange(10)[::2]}, "storeys")
    assert column.dtype == np.float64
    assert column.flags.c_contiguous


@pytest.mark.parametrize("table", [TABLE, pd.DataFrame(TABLE)])
def test_parts_join_to_the_whole_in_any_order(table):
    # would catch rows that are joined in the order of the parts
    numbers = [np.array([2]), np.array([1, 0])]
    parts = [(rows, chosen(table, rows)) for rows in numbers]
    for order in (parts, parts[::-1]):
        whole = joined(order)
        for name, column in TABLE.items():
            assert_array_equal(whole[name], column)


def test_rows_may_be_chosen_by_a_mask():
    some = chosen(TABLE, TABLE["per_1"] > 1.5)
    assert some["name"].tolist() == ["b", "c"]


def test_a_single_horizontal_counts_as_north():
    motion = xr.DataArray([[1.0, 2.0]], dims=("horizontal", "time"))
    station = xr.Dataset({"acceleration": motion, "sampling_interval": 0.01})
    north, east, interval = components(station)
    assert north.tolist() == [1.0, 2.0]
    assert east.tolist() == [0.0, 0.0]
    assert interval == 0.01


@pytest.mark.parametrize("table", [TABLE, pd.DataFrame(TABLE)])
def test_only_the_named_columns_are_kept_as_far_as_there_are_any(table):
    some = only(table, ("name", "per_2", "gap"))
    assert list(some) == ["name", "per_2"]
    assert some["per_2"].tolist() == [4.0, 5.0, 6.0]
