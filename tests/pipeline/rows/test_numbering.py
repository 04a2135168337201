"""Numbers of buildings and pieces of connected pairs, against plain Python."""

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from per_obspy.pipeline.rows import numbering
from per_obspy.pipeline.rows import pair_columns as pair_columns_module
from per_obspy.pipeline.rows.numbering import BuildingNumbers, building_numbers, piece_numbers
from per_obspy.pipeline.rows.pair_columns import pair_columns
from per_obspy.tables.buildings import one_thread_database


@pytest.fixture
def numbered(tmp_path):
    """Return a function that numbers the buildings of a table."""

    def number(**columns):
        path = tmp_path / "risk.parquet"
        pq.write_table(pa.table(columns), path)
        with pair_columns([path]) as pairs, one_thread_database(tmp_path) as database:
            return building_numbers(pairs, database)

    return number


def test_numbers_follow_the_alphabet_of_the_bytes(numbered):
    first = ["b", "", "ñ", "Z", None, "a b"]
    second = ["a", "b", "", "b", None, "10"]
    found = numbered(building_id_1=first, building_id_2=second)
    # as Python sorts code points, which are those of the bytes of UTF-8
    names = sorted({name for name in [*first, *second] if name})
    place = {name: number for number, name in enumerate(names)} | {"": -1, None: -1}
    assert found.codes.tolist() == [
        [place[a], place[b]] for a, b in zip(first, second, strict=True)
    ]
    assert found.named == len(names)


@pytest.mark.parametrize("together", [1, 3, 1000])
def test_equal_identifiers_have_one_number_wherever_they_are_read(numbered, monkeypatch, together):
    # Mutations: a new number at the begin of each batch; none where a batch begins with another
    # name than the one before ends with
    monkeypatch.setattr(numbering, "SORTED", together)
    monkeypatch.setattr(pair_columns_module, "TOGETHER", 7)
    draw = np.random.default_rng(6)
    sides = draw.choice([*"abcdefgh", ""], (2, 50))
    found = numbered(building_id_1=sides[0].tolist(), building_id_2=sides[1].tolist())
    names = np.unique(sides[sides != ""])
    expected = np.where(sides == "", -1, np.searchsorted(names, sides))
    assert found.codes.T.tolist() == expected.tolist()
    assert found.named == names.size


def test_a_table_without_identifiers_has_no_numbers(numbered):
    found = numbered(pair_id=["a", "b"])
    assert (found.codes == -1).all()
    # each pair may be in a piece of its own
    assert piece_numbers(found, 1).tolist() == [0, 1]


@pytest.mark.parametrize("size", [1, 10, 1000])
def test_no_building_is_in_two_pieces(size):
    generator = np.random.default_rng(4)
    codes = generator.integers(-1, 300, (200, 2)).astype(np.int32)
    piece = piece_numbers(BuildingNumbers(codes, 300), size)
    ends = pd.DataFrame({"building": codes.ravel(), "piece": np.repeat(piece, 2)})
    named = ends[ends["building"] >= 0]
    assert (named.groupby("building")["piece"].nunique() == 1).all()
    # smaller pieces where the pairs allow it
    assert (piece.max() > 0) == (size < 200)
