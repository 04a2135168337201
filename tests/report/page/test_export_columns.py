"""Columns of the page that only export and search need."""

import numpy as np
import pandas as pd

from per_obspy.report.page import packing
from per_obspy.report.page.packing import addresses, pack_export


def described(packed):
    """Return the kinds of the packed columns."""
    return {column["name"]: column["kind"] for column in packed.description["columns"]}


def test_kinds_lose_no_digit_of_an_identifier():
    table = pd.DataFrame(
        {
            "rank": [1, 2],
            "parcel": [9_876_543.0, np.nan],
            "mass": [1.23456e6, 2.5],
            "storeys": [3, 5],
            "is_corner": [True, False],
            "owner": ["a", None],
        }
    )
    kinds = described(pack_export(table, ["rank"]))
    assert kinds == {
        "parcel": "whole", "mass": "number", "storeys": "number", "is_corner": "choice",
        "owner": "choice",
    }  # fmt: skip


def test_columns_without_room_are_named(monkeypatch):
    monkeypatch.setattr(packing, "MOST_BYTES", 1_500)
    random = np.random.default_rng(1)
    table = pd.DataFrame({"a": random.random(500), "b": random.random(500), "c": 1.0})
    packed = pack_export(table, [])
    # 500 numbers at random of 13 bits take some 1000 bytes: one column fits, and a constant
    assert set(described(packed)) == {"a", "c"}
    assert packed.description["left_out"] == ["b"]


def test_a_wide_table_does_not_make_a_large_page(monkeypatch):
    monkeypatch.setattr(packing, "MOST_COLUMNS", 5)
    table = pd.DataFrame({f"x{number}": [number] for number in range(9)})
    assert pack_export(table, []).description["left_out"] == ["x5", "x6", "x7", "x8"]


def test_places_of_both_buildings_are_one_text():
    table = pd.DataFrame(
        {"Street_1": ["Calle 5", None], "addr:city_1": ["Lima", " "], "city_2": ["Lima", "Callao"],
         "street_width_1": [9.0, 8.0]}
    )  # fmt: skip
    assert addresses(table).tolist() == ["Calle 5, Lima", "Callao"]
    assert addresses(table[["street_width_1"]]) is None
