"""The risk table on disk: ranks, text of the worst rows, pieces, single rows."""

import json

import numpy as np
import pandas as pd
import pytest
from pyarrow import parquet

from per_obspy.screening.ranking import KEYS, in_order
from per_obspy.tables import risk
from per_obspy.tables.parts import write_part
from per_obspy.tables.risk import ranked_table, write_risk, write_worst

COUNT = 300
FACTS = {"name": "a run", "simulated": "true"}


@pytest.fixture(scope="module")
def rows():
    """Rows of a risk table in the order of the inventory."""
    random = np.random.default_rng(7)
    # Text that CSV has to quote, empty cells, and numbers of many digits
    columns = {
        "pair_id": [f'pair "{number}", north' for number in random.permutation(COUNT)],
        "state": random.choice(["yes", "likely", "no"], COUNT),
        "probability": random.uniform(0, 1, COUNT),
        "expected_impact_velocity": random.choice([0.1, 1e-17 / 3, np.nan], COUNT),
        "station": random.choice(["", "XX.S001"], COUNT),
        "impacts": random.choice([0.0, 3.0, np.nan], COUNT),
    }
    return pd.DataFrame(columns)


@pytest.fixture
def parts(rows, tmp_path):
    paths = []
    for number, first in enumerate(range(0, COUNT, 100)):
        piece = rows.iloc[first : first + 100]
        paths.append(tmp_path / "chunks" / f"{number:06}.parquet")
        write_part(in_order(piece), number, paths[-1])
    return paths


@pytest.fixture
def expected(rows):
    """The whole table as pandas orders it in memory."""
    table = in_order(rows).drop(columns=list(KEYS))
    table.insert(0, "rank", np.arange(1, COUNT + 1))
    return table


def test_the_whole_is_ranked_and_counted(parts, expected, tmp_path):
    written = write_risk(parts, tmp_path, FACTS, csv_rows=COUNT)
    table = pd.read_parquet(tmp_path / "risk.parquet")
    pd.testing.assert_frame_equal(table, expected, check_dtype=False)
    assert written.states == expected["state"].value_counts().to_dict()
    # its facts, and the meaning of every column
    metadata = parquet.read_schema(tmp_path / "risk.parquet").metadata
    assert FACTS.items() <= json.loads(metadata[b"per_obspy"]).items()
    columns = pd.read_csv(tmp_path / "risk.columns.csv")
    assert set(table) <= set(columns["name"])
    assert written.files == [
        tmp_path / f"risk{end}" for end in (".parquet", ".csv", ".columns.csv")
    ]


SIZES = [(1, 1), (1, 50), (7, 1), (7, 50), (7, 299), (50, 50), (50, 120), (1000, 120), (1000, 5000)]


@pytest.mark.parametrize(("size", "csv_rows"), SIZES)
def test_text_of_the_worst_rows_does_not_depend_on_pieces(
    parts, tmp_path, monkeypatch, size, csv_rows
):
    # would catch a row too many, a header in the middle, and numbers in other digits than those of
    # the database that reads the whole table
    monkeypatch.setattr(risk, "ROWS", size)
    write_risk(parts, tmp_path, FACTS, csv_rows)
    write_worst(tmp_path / "risk.parquet", csv_rows, tmp_path / "expected.csv")
    assert (tmp_path / "risk.csv").read_bytes() == (tmp_path / "expected.csv").read_bytes()
    assert sorted(path.name for path in tmp_path.glob(".*")) == []


def test_the_table_is_read_in_pieces(parts, expected, tmp_path, monkeypatch):
    write_risk(parts, tmp_path, FACTS, COUNT)
    monkeypatch.setattr(risk, "ROWS", 11)
    columns = ["rank", "state", "no such column"]
    with ranked_table(tmp_path / "risk.parquet", columns) as table:
        pieces = list(table.pieces())
    assert max(map(len, pieces)) == 11
    whole = pd.concat(pieces, ignore_index=True)
    pd.testing.assert_frame_equal(whole, expected[["rank", "state"]], check_dtype=False)


def test_a_row_is_found_in_whichever_group_it_is(parts, expected, tmp_path, monkeypatch):
    monkeypatch.setattr(risk, "ROWS", 50)
    write_risk(parts, tmp_path, FACTS, COUNT)
    # first and last rows of groups
    with ranked_table(tmp_path / "risk.parquet", ["rank"]) as table:
        assert table.pairs == COUNT
        assert table.file.num_row_groups == COUNT // 50
        for index in (0, 49, 50, 299):
            assert table.row(index)["pair_id"] == expected["pair_id"][index]
        with pytest.raises(IndexError):
            table.row(COUNT)
