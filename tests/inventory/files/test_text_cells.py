"""Text that no spreadsheet takes for a formula, and the same text when it is read again."""

import pandas as pd
import pyarrow as pa
import pytest

from per_obspy.inventory.files.reading import read_pairs
from per_obspy.inventory.files.text_cells import arrow_cells, cell, cells, given_text, given_texts
from per_obspy.inventory.files.writing import write_pairs

TEXTS = [
    "=1", "+a", "-", "@x", "'=1", "''=1", " =1", "\t=1", "\r+x", "\x00=", "\uff1d1", "-\u0661",
    "|cmd", "\uff5cx", "-1", "+1e5", "-inf", "'s", "", "a\nb", "a\u202eb", "plain", "'", "'-1",
]  # fmt: skip


def test_columns_and_single_texts_agree():
    # would catch regular expressions of two libraries that differ
    column = arrow_cells(pa.table({"a": TEXTS}))["a"]
    assert column.to_pylist() == [cell(text) for text in TEXTS]
    assert given_texts(column).to_pylist() == [given_text(cell(text)) for text in TEXTS]


@pytest.mark.parametrize("text", TEXTS)
def test_a_text_is_read_as_it_was_but_for_unprintable_characters(text):
    assert given_text(cell(text)) == cell("x" + text)[1:]
    is_number = cell(text).lstrip("+-")[:1].isascii() and cell(text).lstrip("+-")[:1].isdecimal()
    assert is_number or not cell(text).strip().startswith(
        ("=", "+", "-", "@", "|", "\uff1d", "\uff5c")
    )


def test_numbers_and_empty_cells_stay():
    table = pd.DataFrame({"a": [-1.0, 2.0], "=b": ["=x", None], "c": [True, False]})
    table.attrs["rejected"] = ()
    plain = cells(table)
    assert plain.attrs == {}
    assert plain.columns.tolist() == ["a", "'=b", "c"]
    assert plain.iloc[0].tolist() == [-1.0, "'=x", True]
    assert plain["=b" if "=b" in plain else "'=b"].isna().tolist() == [False, True]
    arrow = arrow_cells(pa.table({"a": [-1.0], "b": pa.array([None], pa.string())}))
    assert arrow.to_pylist() == [{"a": -1.0, "b": None}]


@pytest.mark.parametrize("name", ["=1+1", "@x", "'=1", "-"])
def test_pairs_keep_their_names_in_a_csv_file(tmp_path, name):
    row = {"pair_id": f"{name}a", "gap": 0.1, "longitude_1": -1.0, "latitude_1": 1.0}
    row |= {"longitude_2": -1.0, "latitude_2": 1.0, "height_1": 9.0, "height_2": 9.0, "note": name}
    write_pairs(pd.DataFrame([row]), tmp_path / "pairs.csv")
    found = read_pairs(tmp_path / "pairs.csv")
    assert found.loc[0, "pair_id"] == f"{name}a"
    assert found.loc[0, "note"] == name
    text = (tmp_path / "pairs.csv").read_text()
    assert f"\n'{name}a" in text
