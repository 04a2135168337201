"""Search for rows: numbers of buildings, pieces, stations of rows, chunks of whole rows."""

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from per_obspy.buildings import search
from per_obspy.buildings.search import one_thread_database, serving_stations, whole_groups
from per_obspy.config.pairs import Rows
from per_obspy.results.ranked_table import ranked_table

from .street import street, table_of


@pytest.fixture
def numbered(tmp_path):
    """Return a function that numbers the buildings of a table."""

    def number(**columns):
        path = tmp_path / "risk.parquet"
        pq.write_table(pa.table(columns), path)
        with ranked_table([path]) as pairs, one_thread_database(tmp_path) as database:
            return search.number_buildings(pairs, database)

    return number


def test_numbers_follow_the_alphabet_of_the_bytes(numbered):
    first = ["b", "", "ñ", "Z", None, "a b"]
    second = ["a", "b", "", "b", None, "10"]
    found = numbered(building_id_1=first, building_id_2=second)
    # as Python sorts code points, which are those of the bytes of UTF-8
    names = sorted({name for name in [*first, *second] if name})
    place = {name: number for number, name in enumerate(names)} | {"": -1, None: -1}
    assert found.tolist() == [[place[a], place[b]] for a, b in zip(first, second, strict=True)]
    assert found.max() + 1 == len(names)


@pytest.mark.parametrize("together", [1, 3, 1000])
def test_equal_identifiers_have_one_number_wherever_they_are_read(numbered, monkeypatch, together):
    # Mutations: a new number at the begin of each batch; none where a batch begins with another
    # name than the one before ends with
    monkeypatch.setattr(search, "SORTED", together)
    monkeypatch.setattr(search, "BATCH", 7)
    draw = np.random.default_rng(6)
    sides = draw.choice([*"abcdefgh", ""], (2, 50))
    found = numbered(building_id_1=sides[0].tolist(), building_id_2=sides[1].tolist())
    names = np.unique(sides[sides != ""])
    expected = np.where(sides == "", -1, np.searchsorted(names, sides))
    assert found.T.tolist() == expected.tolist()
    assert found.max() + 1 == names.size


def test_a_table_without_identifiers_has_no_numbers(numbered):
    found = numbered(pair_id=["a", "b"])
    assert (found == -1).all()
    # each pair may be in a piece of its own
    assert search.piece_numbers(found, 1).tolist() == [0, 1]


@pytest.mark.parametrize("size", [1, 10, 1000])
def test_no_building_is_in_two_pieces(size):
    generator = np.random.default_rng(4)
    codes = generator.integers(-1, 300, (200, 2)).astype(np.int32)
    piece = search.piece_numbers(codes, size)
    ends = pd.DataFrame({"building": codes.ravel(), "piece": np.repeat(piece, 2)})
    named = ends[ends["building"] >= 0]
    assert (named.groupby("building")["piece"].nunique() == 1).all()
    # smaller pieces where the pairs allow it
    assert (piece.max() > 0) == (size < 200)


def serving(sizes, stations, distance=1.0):
    """Return the stations of rows of so many pairs, and whether they have several."""
    row = np.repeat(np.arange(len(sizes)), sizes)
    distances = np.broadcast_to(distance, row.size)
    found, several = serving_stations(row, np.array(stations, dtype=object), distances)
    return found.tolist(), several.tolist()


def test_the_station_of_most_pairs_serves_the_row():
    assert serving([3, 1], ["B", "A", "B", "A"]) == (["B", "A"], [True, False])


@pytest.mark.parametrize(("distance", "expected"), [([1.0, 2.0], "B"), ([2.0, 1.0], "A")])
def test_of_equally_many_the_nearer_serves(distance, expected):
    assert serving([2], ["B", "A"], distance)[0] == [expected]


def test_pairs_of_a_map_have_no_station():
    assert serving([2, 1], ["", "", "A"], [np.nan, np.nan, 1.0])[0] == ["", "A"]


def found_in(pairs, stations, azimuth_used=10.0):
    """Return the contacts of pairs in the order of their rows."""
    pairs = pairs.assign(station=stations, distance=1.0, azimuth_used=azimuth_used)
    table = table_of(pairs.assign(rank=np.arange(1, len(pairs) + 1)))
    contacts, found = search.find_in_piece(table, Rows(), search.CARRIED)
    return contacts.to_pandas().sort_values(["row_id", "interface"]), found


def test_contacts_are_numbered_within_their_rows():
    row = [("a", "b"), ("b", "c"), ("v", "w"), ("w", "x"), ("x", "y")]
    found, _ = found_in(street(*((*pair, 10.0, 0.1) for pair in row)), "A")
    assert found["row_id"].tolist() == ["R-p0"] * 2 + ["R-p2"] * 3
    assert found["interface"].tolist() == [1, 2, 1, 2, 3]
    assert found["buildings"].tolist() == [3] * 2 + [4] * 3


def test_the_worst_axis_takes_the_place_of_an_unknown_one():
    pairs = street(("v", "w", np.nan, 0.1), ("a", "b", 10.0, 0.1), ("b", "c", 10.0, 0.1))
    assert found_in(pairs, "A", 200.0)[0]["azimuth"].tolist() == [200.0, 10.0, 10.0]


def test_stations_of_repeated_contacts_take_no_part():
    # Mutation: names of stations of all pairs, numbers among those of the contacts
    pairs = street(("a", "b", 10.0, 0.1), ("a", "b", 10.0, 0.2), ("b", "c", 10.0, 0.1))
    assert set(found_in(pairs, ["B", "A", "B"])[0]["station"]) == {"B"}


def test_a_pair_has_a_history_of_its_own_only_under_the_record_of_its_row():
    pairs = street(*((*pair, 10.0, 0.1) for pair in ("ab", "bc", "cd")))
    found, _ = found_in(pairs.assign(impact_velocity_alone=0.3), ["B", "A", "B"])
    np.testing.assert_array_equal(found["impact_velocity_alone"], [0.3, np.nan, 0.3])


def test_buildings_are_counted_by_the_stations_of_their_pairs():
    pairs = street(("a", "b", 10.0, 0.1), ("b", "c", 10.0, 0.1), ("c", "d", 10.0, 0.1))
    assert found_in(pairs, ["A", "A", ""])[1].served == {"A": 3}


def chunks(folder, sizes, stations, group):
    """Return the contacts of each chunk of rows in a file with groups of a number of contacts."""
    rows = np.repeat(np.arange(len(sizes)), sizes)
    table = pd.DataFrame(
        {"station": np.array(stations)[rows], "buildings": np.array(sizes)[rows] + 1}
    )
    table["interface"] = table.groupby(rows).cumcount() + 1
    table["row_id"] = rows.astype(str)
    pq.write_table(pa.Table.from_pandas(table), folder / "contacts.parquet", row_group_size=group)
    found = search.chunks_of(folder / "contacts.parquet")
    return [list(dict.fromkeys(map(int, part["row_id"].to_pylist()))) for part in found]


@pytest.mark.parametrize("group", [1, 3, 100])
def test_chunks_hold_whole_rows_of_one_station(tmp_path, monkeypatch, group):
    monkeypatch.setattr(search, "CHUNK", 4)
    # however the rows arrive
    found = chunks(tmp_path, [2, 2, 3, 2], ["A", "A", "A", "B"], group)
    assert found == [[0, 1], [2], [3]]


@pytest.mark.parametrize("group", [1, 4, 100])
def test_a_row_longer_than_a_chunk_is_a_chunk(tmp_path, monkeypatch, group):
    monkeypatch.setattr(search, "CHUNK", 4)
    assert chunks(tmp_path, [1, 9, 1], ["A"] * 3, group) == [[0], [1], [2]]


@pytest.mark.parametrize("size", [1, 2, 3, 5, 9])
def test_groups_are_whole_however_they_arrive(size):
    whole = pa.table({"number": [0, 0, 0, 4, 5, 5, 7, 7, 7]})
    found = list(whole_groups((whole.slice(k, size) for k in range(0, 9, size)), "number"))
    assert pa.concat_tables(found).equals(whole)
    # no number is in two of them
    assert sum(len(set(part["number"].to_pylist())) for part in found) == 4
