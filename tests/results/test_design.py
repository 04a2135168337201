"""Files of a screening by a design spectrum: all four, the same rows, every column described."""

import pandas as pd
import pytest

from per_obspy.errors import Rejection
from per_obspy.results.risk import FILES, write_design


@pytest.fixture
def table():
    """Two rows of the table, one of them without a name, and a column of the user."""
    rows = {"pair_id": ["a", None], "gap": [0.1, 1 / 3], "state": ["yes", "no"], "note": ["x", ""]}
    place = {"place": ["14. Sokak", ""], "longitude": -150.0, "latitude": 10.0}
    table = pd.DataFrame(rows | place)
    table.attrs["rejected"] = (Rejection("pair", "b", "pairs.csv", 4, ("no gap",)),)
    return table


def test_every_file_is_there_and_holds_the_same(table, tmp_path):
    files = write_design(table, tmp_path)
    assert files == [tmp_path / name for name in FILES]
    text, whole, _, rejected = files
    # the second pair has no name
    pd.testing.assert_frame_equal(pd.read_parquet(whole), table, check_dtype=False)
    read = pd.read_csv(text, keep_default_na=False, na_values={"pair_id": [""]})
    # The text has the columns of a reader, and a place everywhere
    assert read.pop("place").tolist() == ["14. Sokak", "10.000 N, 150.000 W"]
    short = table.drop(columns=["note", "place"])[list(read)]
    pd.testing.assert_frame_equal(read, short, check_dtype=False, rtol=5e-5)  # five digits
    assert pd.read_csv(rejected)["reasons"].tolist() == ["no gap"]


def test_columns_of_the_user_are_named_as_such(table, tmp_path):
    write_design(table, tmp_path)
    columns = pd.read_csv(tmp_path / "design.columns.csv", keep_default_na=False)
    assert columns["name"].tolist() == list(table)
    meanings = columns.set_index("name")["meaning"]
    assert meanings["note"] == "carried through from the pair table"
    assert "carried through" not in meanings["gap"]
