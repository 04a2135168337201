"""Tables of one schema: types, empty cells, and the meaning of every column."""

from itertools import pairwise

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from per_obspy.inventory.schema import Column
from per_obspy.results.table_files import regrouped, schema_of, table_of, write_meanings

COLUMNS = (
    Column("count", "int64", "1", "how many"),
    Column("size", "float64", "m", "how large"),
    Column("name", "str", "", "whose"),
    Column("old", "bool", "", "whether old"),
)


def test_numbers_that_are_not_known_are_empty_cells():
    table = table_of(
        {"old": [True, False], "name": ["a", ""], "size": [np.nan, 2.0], "count": [np.nan, 3.0]},
        COLUMNS,
    )
    assert table.schema.equals(schema_of(COLUMNS))
    assert table.to_pylist() == [
        {"count": None, "size": None, "name": "a", "old": True},
        {"count": 3, "size": 2.0, "name": "", "old": False},
    ]


def test_no_rows_have_the_same_types():
    empty = table_of({column.name: np.array([]) for column in COLUMNS}, COLUMNS)
    assert empty.schema.types == [pa.int64(), pa.float64(), pa.string(), pa.bool_()]


def test_every_column_and_flag_is_explained(tmp_path):
    write_meanings(COLUMNS, {"odd": "it is odd"}, tmp_path / "columns.csv")
    table = pd.read_csv(tmp_path / "columns.csv", keep_default_na=False)
    assert table["name"].tolist() == ["count", "size", "name", "old", "flag_odd"]
    assert table["meaning"].iloc[-1] == "it is odd"


@pytest.mark.parametrize("sizes", [[7], [1] * 7, [5, 0, 2], []])
def test_rows_are_regrouped_whatever_their_pieces(sizes):
    schema = schema_of(COLUMNS[:1])
    ends = np.cumsum([0, *sizes])
    tables = [
        pa.table({"count": np.arange(begin, end)}, schema=schema)
        for begin, end in pairwise(ends.tolist())
    ]
    found = [table["count"].to_pylist() for table in regrouped(tables, schema, 3)]
    assert found == ([[0, 1, 2], [3, 4, 5], [6]] if sizes else [])
