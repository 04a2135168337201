"""Columns of Parquet files in plain types, and text that is not UTF-8."""

import datetime
import decimal

import pyarrow as pa
import pytest
from pyarrow import parquet

from per_obspy.inventory.files.parquet import plain_columns
from per_obspy.inventory.files.reading import PairInventory, checked_chunk, read_pairs

DAY = datetime.date(2020, 1, 1)

COLUMNS = [
    (pa.array([[1], None]), ["[1]", None]),
    (pa.array([[("a", 1)], None], pa.map_(pa.string(), pa.int64())), ["[('a', 1)]", None]),
    (pa.array([{"a": 1}, None]), ["{'a': 1}", None]),
    (pa.array([b"\xff", None]), [r"b'\xff'", None]),
    (pa.array([decimal.Decimal("1.5"), None]), [1.5, None]),
    (pa.array(["a", None]).dictionary_encode(), ["a", None]),
    (pa.array(["a", None], pa.large_string()), ["a", None]),
    (pa.array(["a", None], pa.string_view()), ["a", None]),
    (pa.array([2**64 - 1, None], pa.uint64()), [2.0**64, None]),
    (pa.array([datetime.time(1), None]), ["01:00:00", None]),
    (pa.array([DAY, None]), [DAY, None]),
    (pa.array([True, None]), [True, None]),
    (pa.nulls(2), [None, None]),
]


@pytest.mark.parametrize(("column", "values"), COLUMNS)
def test_every_type_becomes_a_plain_one(column, values):
    table, faults = plain_columns(pa.table({"map": column}))
    assert table["map"].to_pylist() == values
    assert faults == {}


@pytest.mark.parametrize("column", ["note", "pair_id", "system_1"])
@pytest.mark.parametrize("size", [1, 100])
def test_text_that_is_not_utf_8_rejects_its_row(tmp_path, column, size):
    # would catch an error of the decoder after the stations are done
    count = 5
    columns = {"pair_id": [f"p{i}" for i in range(count)], "gap": [0.1] * count}
    for name in ("longitude_1", "latitude_1", "longitude_2", "latitude_2"):
        columns[name] = [1.0] * count
    columns |= {"height_1": [9.0] * count, "height_2": [9.0] * count}
    columns |= {"note": ["x"] * count, "system_1": ["other"] * count}
    raw = [text.encode() for text in columns[column]]
    raw[2] = b"\xff" + raw[2]
    columns[column] = pa.array(raw).view(pa.string())
    path = tmp_path / "pairs.parquet"
    parquet.write_table(pa.table(columns), path)
    whole = read_pairs(path)
    assert whole["pair_id"].tolist() == ["p0", "p1", "p3", "p4"]
    (rejection,) = whole.attrs["rejected"]
    assert (rejection.row, rejection.reasons) == (4, (f"{column} is not UTF-8",))
    chunks = [checked_chunk(chunk) for chunk in PairInventory([path]).chunks(size)]
    assert sum(map(len, chunks)) == count - 1
    assert sum(len(chunk.attrs["rejected"]) for chunk in chunks) == 1
