"""Parts joined in the order of the whole: the same as pandas makes of the table in memory."""

from itertools import pairwise

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from per_obspy.errors import MachineFault
from per_obspy.results import parts
from per_obspy.results.parts import (
    batches,
    bounded_database,
    joined_rows,
    joined_schema,
    write_part,
)
from per_obspy.screening.ranking import in_order


def table(count, seed, first=0):
    """Return rows of which many are equally bad, so that only their names differ."""
    draw = np.random.default_rng(seed)
    numbers = draw.permutation(np.arange(first, first + count))
    # Few different values in each column of the order
    return pd.DataFrame(
        {
            "pair_id": [f"pair {number}" for number in numbers],
            "probability": draw.choice([0.0, 0.5, 1.0], count),
            "weighted_velocity": draw.choice([0.0, 0.1, np.nan], count),
            "expected_amplification": draw.choice([1.0, 1.5], count),
        }
    )


def written(folder, pieces):
    """Return the files of some pieces, each in its order."""
    paths = [folder / f"{number:06}.parquet" for number in range(len(pieces))]
    for number, (piece, path) in enumerate(zip(pieces, paths, strict=True)):
        write_part(in_order(piece), number, path)
    return paths


def read(paths, size):
    return pa.concat_tables(joined_rows(paths, joined_schema(paths), size)).to_pandas()


@pytest.mark.parametrize("size", [1, 7, 1000])
@pytest.mark.parametrize("cuts", [[], [1], [13, 14, 250]])
def test_the_whole_is_in_order(tmp_path, monkeypatch, size, cuts):
    # Mutations: an order of the parts instead of the rows; rows of a part taken twice at the edge
    # of a group; ties between parts left in the order of the parts.
    monkeypatch.setattr(parts, "TOGETHER", 11)
    whole = table(300, seed=1)
    edges = [0, *cuts, len(whole)]
    pieces = [whole.iloc[first:last] for first, last in pairwise(edges)]
    expected = in_order(whole)[list(whole)]
    pd.testing.assert_frame_equal(
        read(written(tmp_path, pieces), size), expected, check_dtype=False
    )


@pytest.mark.parametrize("most", [2, 3])
def test_parts_merged_in_several_passes_are_in_the_same_order(tmp_path, monkeypatch, most):
    # Mutations: parts of one pass one after the other; keys of the order lost after a pass.
    monkeypatch.setattr(parts, "TOGETHER", 7)
    monkeypatch.setattr(parts, "MOST_PARTS", most)
    whole = table(200, seed=2)
    # one part has a column that the others lack
    pieces = [whole.iloc[first : first + 20] for first in range(0, 200, 20)]
    pieces[4] = pieces[4].assign(remark="x")
    expected = in_order(pd.concat(pieces))[[*whole, "remark"]]
    found = read(written(tmp_path, pieces), 30)
    pd.testing.assert_frame_equal(found, expected, check_dtype=False)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        f"{number:06}.parquet" for number in range(10)
    ]


def test_memory_does_not_grow_with_the_number_of_parts(tmp_path, monkeypatch):
    # would catch every part held open with its rows: 200 parts here, of a world 10 000
    monkeypatch.setattr(parts, "MOST_PARTS", 4)
    held, most = set(), []
    take = parts.WaitingRows.take

    def counted(rows, number):
        held.add(rows)
        most.append(len(held))
        return take(rows, number)

    def begun(*given, merged=parts._merged):
        held.clear()
        yield from merged(*given)

    monkeypatch.setattr(parts.WaitingRows, "take", counted)
    monkeypatch.setattr(parts, "_merged", begun)
    whole = table(60, seed=3)
    pieces = [whole.iloc[first : first + 2] for first in range(0, 60, 2)]
    assert len(read(written(tmp_path, pieces), 1000)) == 60
    assert max(most) <= 4


def test_the_order_is_read_from_one_part_after_the_other(tmp_path, monkeypatch):
    # would catch a reader that is ahead in many parts: 2.0 instead of 1.5 GB at 10 million rows
    paths = written(tmp_path, [table(20, seed=number, first=20 * number) for number in range(9)])
    is_open, most = set(), []

    class Watched(pq.ParquetFile):
        def __enter__(self):
            is_open.add(self)
            most.append(len(is_open))
            return self

        def __exit__(self, *error):
            is_open.discard(self)
            return super().__exit__(*error)

    monkeypatch.setattr(parts.pq, "ParquetFile", Watched)
    order = np.concatenate(list(parts.parts_in_order(paths, 50)))
    assert np.bincount(order).tolist() == [20] * 9
    assert set(most) == {1}
    assert len(most) == 9


def test_parts_with_other_columns_and_types(tmp_path):
    # Mutation: the first part decides the columns of all.
    first, second = (
        table(20, seed=2).assign(note=1, only_here="a"),
        table(20, seed=3, first=20).assign(note="x"),
    )
    third = table(20, seed=4, first=40).assign(note=1.5)
    rows = read(written(tmp_path, [first, second, third]), 50).set_index("pair_id")
    assert set(rows.loc[first["pair_id"], "only_here"]) == {"a"}
    assert rows.loc[[*second["pair_id"], *third["pair_id"]], "only_here"].isna().all()
    assert [rows["note"][one["pair_id"].iloc[0]] for one in (first, second, third)] == [
        "1",
        "x",
        "1.5",
    ]


def test_whole_numbers_and_fractions_are_numbers(tmp_path):
    paths = written(
        tmp_path, [table(5, seed=2).assign(note=1), table(5, seed=3, first=5).assign(note=1.5)]
    )
    assert joined_schema(paths).field("note").type == pa.float64()


def test_columns_of_the_order_are_left_out(tmp_path):
    paths = written(tmp_path, [table(5, seed=2)])
    assert joined_schema(paths).names == list(table(5, seed=2))
    assert "order_part" in pq.read_schema(paths[0]).names


@pytest.mark.parametrize("by_stream", [False, True])
def test_a_database_without_memory_is_a_fault_of_the_machine(tmp_path, by_stream):
    # 80 MB of numbers in the order of another column do not fit into 10 MB without a folder
    query = "SELECT * FROM range(10000000) AS rows(number) ORDER BY hash(number)"

    def join() -> None:
        with bounded_database(tmp_path) as database:
            database.execute("SET memory_limit = '10MB'")
            database.execute("SET max_temp_directory_size = '0KB'")
            if by_stream:
                list(batches(database, query, 1000))
            database.execute(query).fetchall()

    with pytest.raises(MachineFault, match="not enough memory"):
        join()
