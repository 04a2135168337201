"""One reader for a ranked table in one file and in one file per cell."""

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from per_obspy.errors import CatalogError
from per_obspy.results import ranked_table as module
from per_obspy.results.ranked_table import ranked_table, remove_table, table_files, table_outputs

COUNT = 40


@pytest.fixture
def whole():
    """A ranked table with texts and empty cells."""
    draw = np.random.default_rng(3)
    return pd.DataFrame(
        {
            "rank": np.arange(1, COUNT + 1),
            "pair_id": [f"pair {number}" for number in draw.permutation(COUNT)],
            "gap": draw.choice([0.1, np.nan], COUNT),
            "cell": draw.choice(["a", "b", "c"], COUNT),
        }
    )


@pytest.fixture(params=["one file", "cells"])
def files(request, whole, tmp_path):
    """The files of the table, with a few rows per group."""
    if request.param == "one file":
        pieces = {tmp_path / "risk.parquet": whole}
    else:
        (tmp_path / "risk").mkdir()
        pieces = {
            tmp_path / "risk" / f"{name}.parquet": rows for name, rows in whole.groupby("cell")
        }
    for path, rows in pieces.items():
        table = pa.Table.from_pandas(rows, preserve_index=False)
        pq.write_table(table, path, row_group_size=4)
    return table_files(tmp_path)


@pytest.mark.parametrize("size", [1, 7, 1000])
@pytest.mark.parametrize("count", [0, 1, 13, COUNT, 1000])
def test_the_worst_rows_are_those_of_the_smallest_ranks(files, whole, monkeypatch, size, count):
    # would catch the first rows of the first cell instead of those of all cells
    monkeypatch.setattr(module, "ROWS", size)
    with ranked_table(files) as table:
        found = table.first(count, ["pair_id", "none", "gap"])
        pieces = list(table.ranked(count))
    expected = whole.head(count)
    pd.testing.assert_frame_equal(found, expected[["pair_id", "gap"]], check_dtype=False)
    assert all(piece.num_rows <= size for piece in pieces)
    if count:
        pd.testing.assert_frame_equal(pa.concat_tables(pieces).to_pandas(), expected)


def test_pieces_hold_every_row_once(files, whole, monkeypatch):
    monkeypatch.setattr(module, "ROWS", 7)
    with ranked_table(files, ["rank", "gap", "none"]) as table:
        assert table.pairs == COUNT
        found = pd.concat(table.pieces()).sort_values("rank", ignore_index=True)
    pd.testing.assert_frame_equal(found, whole[["rank", "gap"]])


def test_a_row_is_found_by_its_rank(files, whole):
    with ranked_table(files) as table:
        for rank in (1, 4, 5, COUNT):
            assert table.row(rank)["pair_id"] == whole["pair_id"][rank - 1]
        with pytest.raises(IndexError):
            table.row(COUNT + 1)


def test_only_files_of_the_table_are_listed_and_removed(files, tmp_path):
    folder = tmp_path / "risk"
    folder.mkdir(exist_ok=True)
    # a note of the user, and a cell that is being written
    (folder / "note.txt").write_text("mine")
    (folder / ".lat0_lon0.1@here.part.parquet").write_bytes(b"PAR1")
    assert table_files(tmp_path) == files
    remove_table(tmp_path)
    assert table_files(tmp_path) == []
    assert (folder / "note.txt").read_text() == "mine"
    with pytest.raises(CatalogError, match="no file"), ranked_table(table_files(tmp_path)):
        pass


def test_outputs_of_the_table_are_known_by_their_names():
    outputs = {"risk.csv": "1", "risk.parquet": "2", "risky/a.parquet": "3", "risk/a.parquet": "4"}
    assert table_outputs(outputs) == {"risk.parquet": "2", "risk/a.parquet": "4"}
