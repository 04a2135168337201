"""The risk table by cell: the rows and ranks of the one table, whole or not at all."""

import shutil

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from per_obspy.errors import PerError
from per_obspy.results import ranked_cells
from per_obspy.results.parts import write_part
from per_obspy.results.risk import write_risk
from per_obspy.screening.ranking import in_order

COUNT = 120
FACTS = {"name": "a run", "simulated": "true"}


@pytest.fixture(scope="module")
def rows():
    """Pairs in some cells, on both sides of zero; some have no place, and few differ in badness."""
    draw = np.random.default_rng(11)
    longitude, latitude = draw.uniform(-1, 2, COUNT), draw.uniform(-1, 1, COUNT)
    longitude[::17], latitude[::23] = np.nan, np.nan
    columns = {
        # texts that are no names of files
        "pair_id": [f"../../{number}" for number in draw.permutation(COUNT)],
        "state": draw.choice(["yes", "no"], COUNT),
        "station": draw.choice(["", "XX.S001"], COUNT),
        "probability": draw.choice([0.0, 0.5, 1.0], COUNT),
        "expected_impact_velocity": draw.choice([0.0, 0.1, np.nan], COUNT),
        "longitude": longitude,
        "latitude": latitude,
        "/etc": draw.choice(["a", "../b"], COUNT),
    }
    return pd.DataFrame(columns)


def parts_of(rows, folder, size):
    """Write parts of so many rows, as chunks leave them."""
    paths = []
    for number, first in enumerate(range(0, len(rows), size)):
        paths.append(folder / "chunks" / f"{number:06}.parquet")
        write_part(in_order(rows.iloc[first : first + size]), number, paths[-1])
    return paths


def written(parts, folder):
    return write_risk(parts, folder, FACTS, 100, cell=1.0)


def contents(folder):
    return {path.name: path.read_bytes() for path in (folder / "risk").iterdir()}


@pytest.fixture(scope="module")
def expected(rows, tmp_path_factory):
    """The one table, and the bytes of the dataset, from a single part."""
    folder = tmp_path_factory.mktemp("whole")
    parts = parts_of(rows, folder, COUNT)
    one = write_risk(parts, folder, FACTS, 100)
    text = (folder / "risk.csv").read_bytes()
    (folder / "risk.parquet").rename(folder / "one.parquet")
    found = written(parts, folder)
    (folder / "one.parquet").rename(folder / "risk.parquet")
    assert (found.states, found.stations) == (one.states, one.stations)
    assert [path.parent.name for path in found.files[:-2]] == ["risk"] * (len(found.files) - 2)
    # Mutation: the rows of the first cells instead of the worst
    assert (folder / "risk.csv").read_bytes() == text
    return folder


def test_the_cells_together_are_the_one_table(expected):
    # Mutations: ranks of a part that count from 1; rows of a cell in the order of their parts
    one, folder = pq.read_table(expected / "risk.parquet"), expected / "risk"
    cells = {path.stem: pq.read_table(path) for path in folder.iterdir()}
    assert {"no_place", "lat0_lon0", "lat-1_lon-1", "lat0_lon1"} <= set(cells)
    for name, table in cells.items():
        assert table.schema.equals(one.schema, check_metadata=True)
        frame = table.to_pandas()
        assert frame["rank"].is_monotonic_increasing
        place = frame[["latitude", "longitude"]]
        corner = [float(text[3:]) for text in name.split("_")] if name != "no_place" else None
        unknown, inside = place.isna().any(axis=1), (place // 1 == (corner or 0)).all(axis=1)
        assert (unknown if corner is None else inside).all()
    whole = pd.concat([table.to_pandas() for table in cells.values()])
    whole = whole.sort_values("rank", ignore_index=True)
    pd.testing.assert_frame_equal(whole, one.to_pandas())


def test_nothing_is_written_elsewhere(expected):
    # names of pairs and columns that lead out of the folder
    assert sorted(path.name for path in expected.iterdir()) == [
        *("chunks", "risk", "risk.columns.csv", "risk.csv", "risk.parquet")
    ]


@pytest.mark.parametrize("size", [2, 7])
def test_bytes_do_not_depend_on_chunks(rows, expected, tmp_path, size):
    written(parts_of(rows.sample(frac=1.0, random_state=size), tmp_path, size), tmp_path)
    assert contents(tmp_path) == contents(expected)


@pytest.mark.parametrize(("together", "kept", "opened"), [(1, 1, 500), (8, 20, 3), (50, 9, 1)])
def test_rows_do_not_depend_on_what_is_kept_and_open(
    rows, expected, tmp_path, monkeypatch, together, kept, opened
):
    # Mutations: a group of cells without its last; rows that are kept at the end left out; a cell
    # that is written twice.
    for name, value in (("ROWS", together), ("KEPT", kept), ("OPEN", opened)):
        monkeypatch.setattr(ranked_cells, name, value)
    written(parts_of(rows, tmp_path, 10), tmp_path)
    # groups of rows have another size, so the values are compared
    assert contents(tmp_path).keys() == contents(expected).keys()
    for name in contents(expected):
        found, known = (pq.read_table(folder / "risk" / name) for folder in (tmp_path, expected))
        assert found.equals(known, check_metadata=True)


def test_few_rows_are_kept(rows, tmp_path, monkeypatch):
    # would catch memory that grows with the table, and slices that keep the table of their rows
    monkeypatch.setattr(ranked_cells, "KEPT", 10)
    kept, write = [], ranked_cells.CellFiles.write_table

    def counted(files, table):
        write(files, table)
        pieces = [piece for some in files._kept.values() for piece in some]
        kept.append((sum(map(len, pieces)), sum(piece.nbytes for piece in pieces)))

    monkeypatch.setattr(ranked_cells.CellFiles, "write_table", counted)
    monkeypatch.setattr("per_obspy.results.risk.ROWS", 20)
    written(parts_of(rows, tmp_path, 40), tmp_path)
    assert len(kept) == COUNT // 20
    assert all(count <= 10 for count, _ in kept)


def test_a_killed_ranking_is_done_again(rows, expected, tmp_path, monkeypatch):
    # would catch a half dataset under its name
    parts, write = parts_of(rows, tmp_path, 40), ranked_cells.CellFiles.write_kept
    for number in (0, 3):
        left = iter(range(number))

        def stopped(files, cell, left=left):
            if next(left, None) is None:
                raise KeyboardInterrupt
            write(files, cell)

        monkeypatch.setattr(ranked_cells.CellFiles, "write_kept", stopped)
        with pytest.raises(KeyboardInterrupt):
            written(parts, tmp_path)
        assert [path.name for path in tmp_path.iterdir()] == ["chunks"]
    monkeypatch.setattr(ranked_cells.CellFiles, "write_kept", write)
    written(parts, tmp_path)
    assert contents(tmp_path) == contents(expected)


def test_a_part_that_cannot_be_read_leaves_no_dataset(rows, tmp_path):
    parts = parts_of(rows, tmp_path, 60)
    other = parts_of(rows.drop(columns="station"), tmp_path / "other", COUNT)
    shutil.copy(other[0], parts[1])
    with pytest.raises(Exception):  # noqa: B017, PT011 - a fault of the program, not of the user
        written(parts, tmp_path)
    assert not (tmp_path / "risk").exists()


def test_a_folder_in_the_way_is_named(rows, tmp_path):
    (tmp_path / "risk").mkdir()
    (tmp_path / "risk" / "note.txt").write_text("mine")
    with pytest.raises(PerError, match="risk: cannot be written"):
        written(parts_of(rows, tmp_path, COUNT), tmp_path)
    assert (tmp_path / "risk" / "note.txt").read_text() == "mine"
