"""
The risk table by cell: the rows and ranks of the one table, resumed, whole or not at all.

Covers ``per_obspy.results.ranked_cells`` and
``per_obspy.results.ranked_table``.
"""

import pickle
import shutil
from concurrent.futures import Executor, Future, ThreadPoolExecutor

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from per_obspy.errors import PerError
from per_obspy.files import file_hash
from per_obspy.results import ranked_cells
from per_obspy.results.parts import write_part
from per_obspy.results.risk import write_risk
from per_obspy.resume import write_status
from per_obspy.runs.tasks.parallel import Workers
from per_obspy.runs.tasks.parts import Part
from per_obspy.runs.tasks.risk_cells import write_cells, write_texts
from per_obspy.screening.ranking import in_order

COUNT = 120
FACTS = {"name": "a run", "simulated": "true"}


class Stopped(Exception):
    """The process ends here."""


class Limited(Executor):
    """Do so many tasks at once in this process, then end as a killed process does."""

    def __init__(self, tasks):
        self.left = tasks

    def submit(self, function, /, *arguments):
        if not self.left:
            raise Stopped
        self.left -= 1
        # As it travels to another process
        function, arguments = pickle.loads(pickle.dumps((function, arguments)))
        future = Future()
        future.set_result(function(*arguments))
        return future


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
    """Write parts of so many rows with their status, as chunks leave them."""
    parts = []
    for number, first in enumerate(range(0, len(rows), size)):
        path = folder / "chunks" / f"{number:06}.parquet"
        write_part(in_order(rows.iloc[first : first + size]), number, path)
        status = path.with_suffix(".json")
        write_status(status, "key", {path.name: file_hash(path)}, {"rejected": []})
        parts.append(Part(number, size, path, status, resumed=False))
    return parts


def written(parts, folder, executor=None):
    return write_cells(parts, folder, FACTS, 1.0, Workers(1, executor))


def contents(folder):
    return {path.name: path.read_bytes() for path in (folder / "risk").iterdir()}


@pytest.fixture(scope="module")
def expected(rows, tmp_path_factory):
    """The one table, and the bytes of the dataset, from a single part."""
    folder = tmp_path_factory.mktemp("whole")
    parts = parts_of(rows, folder, COUNT)
    one = write_risk([part.path for part in parts], folder, FACTS, 100)
    found = written(parts, folder)
    assert (found.states, found.stations) == (one.states, one.stations)
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


@pytest.mark.parametrize(("size", "most"), [(2, 4), (7, 64)])
def test_bytes_do_not_depend_on_chunks(rows, expected, tmp_path, monkeypatch, size, most):
    # 60 parts of two rows are merged in several passes
    monkeypatch.setattr(ranked_cells, "MOST_FILES", most)
    written(parts_of(rows.sample(frac=1.0, random_state=size), tmp_path, size), tmp_path)
    assert contents(tmp_path) == contents(expected)
    assert not (tmp_path / "cells").exists()


@pytest.mark.parametrize(("batch", "together"), [(1, 5), (3, 50), (3, 10_000)])
def test_bytes_do_not_depend_on_what_is_read_together(
    rows, expected, tmp_path, monkeypatch, batch, together
):
    # Mutations: batches of a cell counted from its rows rounded down; ranks of a window taken
    # again in the next; the last window left out.
    monkeypatch.setattr(ranked_cells, "BATCH", batch)
    monkeypatch.setattr(ranked_cells, "RANKED_TOGETHER", together)
    monkeypatch.setattr(ranked_cells, "ROWS", 8)
    monkeypatch.setattr(ranked_cells, "MOST_FILES", 3)
    written(parts_of(rows, tmp_path, 10), tmp_path)
    # groups of rows have another size, so the values are compared
    for name in contents(expected):
        found, known = (pq.read_table(folder / "risk" / name) for folder in (tmp_path, expected))
        assert found.equals(known, check_metadata=True)


def test_many_parts_are_merged_in_one_pass_with_one_batch_of_each(
    rows, expected, tmp_path, monkeypatch
):
    # would catch a second copy of the cells on the disk, and files that are read as a whole
    monkeypatch.setattr(ranked_cells, "BATCH", 1)
    read, ahead = [0], []

    def counted(one, batches=ranked_cells.arranged_rows):
        for batch in batches(one):
            read[0] += batch.num_rows
            yield batch

    def merged(waiting, order, next_rows=ranked_cells.next_rows):
        taken = next_rows(waiting, order)
        read[0] -= taken.num_rows
        ahead.append(read[0])
        return taken

    monkeypatch.setattr(ranked_cells, "arranged_rows", counted)
    monkeypatch.setattr(ranked_cells, "next_rows", merged)
    monkeypatch.setattr(ranked_cells, "_merged", None)
    written(parts_of(rows, tmp_path, 1), tmp_path)
    assert contents(tmp_path) == contents(expected)
    # no row but those that are wanted
    assert set(ahead) == {0}


def test_bytes_do_not_depend_on_workers(rows, expected, tmp_path):
    with ThreadPoolExecutor(3) as executor:
        written(parts_of(rows, tmp_path, 10), tmp_path, executor)
    assert contents(tmp_path) == contents(expected)


def test_a_run_that_is_killed_between_cells_is_resumed(rows, expected, tmp_path, monkeypatch):
    # would catch a half dataset under its name, and work that is done twice
    parts = parts_of(rows, tmp_path, 40)
    total = len(parts) + len(contents(expected))
    for tasks in (0, 1, len(parts), len(parts) + 2, total - 1):
        shutil.rmtree(tmp_path / "cells", ignore_errors=True)
        monkeypatch.setattr("per_obspy.runs.tasks.parallel.AHEAD_ELSEWHERE", 1)
        with pytest.raises(Stopped):
            written(parts, tmp_path, Limited(tasks))
        assert not (tmp_path / "risk").exists()
        again = Limited(total)
        written(parts, tmp_path, again)
        assert total - again.left == total - tasks
        assert contents(tmp_path) == contents(expected)
        shutil.rmtree(tmp_path / "risk")


@pytest.mark.parametrize("name", ["000001.arrow", "000001.ranks"])
def test_an_arranged_part_that_is_cut_is_made_again(rows, expected, tmp_path, name):
    # Mutation: the hash of one file only
    parts = parts_of(rows, tmp_path, 40)
    with pytest.raises(Stopped):
        written(parts, tmp_path, Limited(len(parts)))
    file = tmp_path / "cells" / "arranged" / name
    file.write_bytes(file.read_bytes()[:-8])
    written(parts, tmp_path)
    assert contents(tmp_path) == contents(expected)


def test_cells_of_other_parts_are_not_taken(rows, expected, tmp_path):
    parts = parts_of(rows.iloc[:80], tmp_path, 40)
    with pytest.raises(Stopped):
        written(parts, tmp_path, Limited(5))
    # the inventory grows: all ranks are others, and cells may be gone
    stray = tmp_path / "cells" / "risk" / "lat80_lon80.parquet"
    stray.write_bytes(b"PAR1")
    written(parts_of(rows, tmp_path, 40), tmp_path)
    assert contents(tmp_path) == contents(expected)


def test_a_part_that_cannot_be_read_leaves_no_dataset(rows, tmp_path):
    parts = parts_of(rows, tmp_path, 60)
    other = parts_of(rows.drop(columns="station"), tmp_path / "other", COUNT)
    shutil.copy(other[0].path, parts[1].path)
    with pytest.raises(Exception):  # noqa: B017, PT011 - a fault of the program, not of the user
        written(parts, tmp_path)
    assert not (tmp_path / "risk").exists()


def test_the_text_has_the_worst_rows_of_all_cells(expected, tmp_path):
    # would catch the rows of the first cells instead of the worst
    files = sorted((expected / "risk").iterdir())
    for path in write_texts(files, tmp_path, 100):
        assert path.read_bytes() == (expected / path.name).read_bytes()


def test_a_folder_in_the_way_is_named(rows, tmp_path):
    (tmp_path / "risk").mkdir()
    (tmp_path / "risk" / "note.txt").write_text("mine")
    with pytest.raises(PerError, match="risk: cannot be written"):
        written(parts_of(rows, tmp_path, COUNT), tmp_path)
    assert (tmp_path / "risk" / "note.txt").read_text() == "mine"
