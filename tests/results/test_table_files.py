"""Tables as files: types that do not depend on the rows, meanings, and rejections."""

import numpy as np
import pandas as pd
import pyarrow as pa

from per_obspy.errors import Rejection
from per_obspy.inventory.schema import Column
from per_obspy.results.table_files import (
    as_arrow,
    write_csv,
    write_described,
    write_parquet,
    write_rejected,
)
from per_obspy.screening.columns import column_table


def test_types_are_those_of_the_schema():
    # would catch chunks whose types differ, because one of them has no value in a column
    empty = pd.DataFrame({"pair_id": [None], "gap": [None], "storeys_1": [None], "note": [None]})
    table = as_arrow(empty)
    assert table.schema.field("pair_id").type == pa.string()
    assert table.schema.field("gap").type == pa.float64()
    assert table.schema.field("note").type == pa.string()  # nothing is known of it


def test_other_columns_keep_their_types():
    table = as_arrow(pd.DataFrame({"floors": [1, 2], "share": [0.5, np.nan]}))
    assert table.schema.field("floors").type == pa.int64()
    assert table.schema.field("share").type == pa.float64()


def test_tables_are_written_without_their_attributes(tmp_path):
    # would catch rejections, which have a file of their own, in the metadata of a table
    table = pd.DataFrame({"pair_id": ["a"], "gap": [0.1]})
    table.attrs["rejected"] = (Rejection("pair", "b", "", None, ("no gap",)),)
    write_csv(table, tmp_path / "table.csv")
    write_parquet(table, tmp_path / "table.parquet")
    for read in (pd.read_csv(tmp_path / "table.csv"), pd.read_parquet(tmp_path / "table.parquet")):
        pd.testing.assert_frame_equal(read, table)
        assert read.attrs == {}
    assert "rejected" in table.attrs


def test_columns_have_unit_and_meaning(tmp_path):
    write_csv(column_table(["pair_id", "gap"]), tmp_path / "known.csv")
    known = pd.read_csv(tmp_path / "known.csv").set_index("name")
    assert known.loc["gap", "unit"] == "m"
    # columns that the schema does not know
    write_described([Column("mine", "str", "s", "time of it")], tmp_path / "described.csv")
    described = pd.read_csv(tmp_path / "described.csv")
    assert described.to_dict("records") == [{"name": "mine", "unit": "s", "meaning": "time of it"}]


def test_rejections_are_counted_and_keep_every_reason(tmp_path):
    rejections = [
        Rejection("pair", "a, b", "pairs.csv", 3, ("gap = -1 m", "no height")),
        Rejection("station", "XX.S1", "", None, ("no motion",)),
        Rejection("pair", "c", "pairs.csv", 4, ("no gap",)),
    ]
    kinds = write_rejected(iter(rejections), tmp_path / "rejected.csv")
    assert kinds == {"pair": 2, "station": 1}
    # separated by semicolons, with the line of the file where there is one
    table = pd.read_csv(tmp_path / "rejected.csv", keep_default_na=False)
    assert table["reasons"].tolist() == ["gap = -1 m; no height", "no motion", "no gap"]
    assert table["row"].tolist() == ["3", "", "4"]
