"""Rows of buildings: chains, rings, bends, cuts; every pair is in exactly one row."""

import time
from itertools import pairwise

import numpy as np
import pytest

from per_obspy.buildings.chains import ROW_FLAGS, chains_of, joints_of
from per_obspy.buildings.contacts import contacts_of

from .street import street, table_of, terrace


def rows_of(table, angle=30.0, longest=30):
    """Return the buildings of each row along its axis, its flags, and all that was found."""
    pairs = table_of(table)
    contacts = contacts_of(pairs, angle)
    chains = chains_of(contacts, joints_of(contacts, pairs, angle), angle, longest)
    names = np.stack([side.to_numpy() for side in contacts.names], axis=1)
    found = []
    for number, (begin, end) in enumerate(pairwise(chains.first.tolist())):
        pair, turned = chains.pair[begin:end], chains.turned[begin:end]
        sides = [
            names[k][:: -1 if back else 1].tolist() for k, back in zip(pair, turned, strict=True)
        ]
        # each contact begins with the building with which the one before ends
        assert all(one[1] == two[0] for one, two in pairwise(sides))
        flags = {name for name in ROW_FLAGS if chains.flags[name][number]}
        first = contacts.order[pair].min()
        found.append((first, [sides[0][0], *(side[1] for side in sides)], flags))
    # rows are in any order: by the first of the names of their pairs
    found.sort(key=lambda row: row[0])
    rows, flags = [row for _, row, _ in found], [raised for _, _, raised in found]
    kept = np.flatnonzero(~contacts.repeated)
    assert sorted(chains.pair.tolist()) == kept.tolist()
    return rows, flags, chains


#: Name of a case -> pairs, further columns, rows, and flags of each row.
CASES = {
    "a corner building is in two rows": (
        [("a", "b", 90, 0), ("b", "c", 90, 0), ("c", "d", 0, 0)],
        {},
        [["a", "b", "c"], ["c", "d"]],
        [set(), set()],
    ),
    "pairs without names are rows of two": (
        [("", "", 90, 0), ("", "", 90, 0)],
        {},
        [["p0#1", "p0#2"], ["p1#1", "p1#2"]],
        [{"no_building_id"}] * 2,
    ),
    "the other branch of a fork is a separate row": (
        [("a", "b", 90, 0.0), ("b", "c", 90, 0.1), ("b", "d", 90, 0.2)],
        {},
        [["a", "b", "c"], ["b", "d"]],
        [{"fork"}] * 2,
    ),
    "contradictory pairs cut a row": (
        [("a", "b", 90, 0), ("b", "c", 90, 0)],
        {"period_1": [9.0, 0.5], "period_2": [0.6, 9.0]},
        [["a", "b"], ["b", "c"]],
        [{"contradictory"}] * 2,
    ),
    # The bend of 15 degrees at d; its building is in both rows
    "a curved street is cut at its sharpest bend": (
        list(zip("abcde", "bcdef", [90, 100, 110, 125, 135], [0.0] * 5, strict=True)),
        {},
        [["a", "b", "c", "d"], ["d", "e", "f"]],
        [{"bent"}] * 2,
    ),
    "no row goes on across an unknown gap": (
        [("a", "b", 90, 0), ("b", "c", 90, np.nan), ("c", "d", 90, 0)],
        {},
        [["a", "b"], ["b", "c"], ["c", "d"]],
        [set(), {"unknown_gap"}, set()],
    ),
    "an assumed gap is followed and flagged": (
        [("a", "b", 90, 0), ("b", "c", 90, 0.5)],
        {"derived": ["", "gap"]},
        [["a", "b", "c"]],
        [{"unknown_gap"}],
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_rows_and_flags(case):
    pairs, columns, rows, flags = CASES[case]
    assert rows_of(street(*pairs, **columns))[:2] == (rows, flags)


def test_buildings_in_a_circle_along_one_azimuth_are_a_ring():
    # impossible on the ground, possible in a table
    rows, flags, _ = rows_of(street(("a", "b", 90, 0.1), ("b", "c", 90, 0.3), ("c", "a", 90, 0.2)))
    assert sorted(map(sorted, rows)) == [["a", "b", "c"], ["b", "c"]]
    assert flags == [{"ring"}] * 2


def test_a_terrace_is_one_row():
    rows, flags, chains = rows_of(street(("b", "c", 90, 0), ("b", "a", 272, 0), ("d", "c", 270, 0)))
    assert rows == [["a", "b", "c", "d"]]
    assert flags == [set()]
    # the mean of 90, 92 and 90 degrees; of such small angles the mean direction is the mean
    assert chains.azimuth[0] == pytest.approx(90 + 2 / 3, abs=1e-3)


def test_a_row_is_named_from_azimuth_0_to_180():
    rows, _, chains = rows_of(street(("c", "b", 265, 0), ("b", "a", 275, 0)))
    assert rows == [["a", "b", "c"]]
    assert chains.azimuth[0] == pytest.approx(90.0)


def test_an_unknown_axis_is_a_row_of_two():
    rows, flags, chains = rows_of(street(("a", "b", np.nan, 0), ("b", "c", 90, 0)))
    assert rows == [["a", "b"], ["b", "c"]]
    assert flags == [{"unknown_azimuth"}, set()]
    assert np.isnan(chains.azimuth[0])


def test_a_long_row_is_cut_at_its_widest_gap():
    gaps = [0.0, 0.0, 0.3, 0.0, 0.0]
    rows, flags, _ = rows_of(terrace(6, gaps=gaps), longest=5)
    # the pair of that gap keeps a row of its own
    names = [f"b{k:04}" for k in range(6)]
    assert rows == [names[:3], names[2:4], names[3:]]
    assert flags == [{"cut"}] * 3


def test_of_equal_gaps_a_long_row_is_cut_near_its_middle():
    rows, _, _ = rows_of(terrace(8), longest=7)
    assert sorted(map(len, rows)) == [2, 4, 4]


@pytest.mark.parametrize("gaps", [0.0, np.linspace(1.0, 0.0, 29_999)])
def test_a_table_that_is_one_chain_takes_seconds(gaps):
    # with falling gaps every cut would take one pair from the end: 30 000 copies of the rest
    start = time.process_time()
    rows, flags, _ = rows_of(terrace(30_000, gaps=gaps), longest=30)
    assert max(map(len, rows)) <= 30
    assert all(found == {"cut"} for found in flags)
    # 1 s on one core; copies of the rest would take minutes
    assert time.process_time() - start < 30.0


def test_rows_do_not_depend_on_the_order_of_the_table():
    generator = np.random.default_rng(1)
    pairs = [(f"b{a}", f"b{b}", float(z), 0.1) for a, b, z in generator.integers(0, 12, (30, 3))]
    pairs = [pair for pair in pairs if pair[0] != pair[1]]
    table = street(*pairs)
    expected = rows_of(table)
    shuffled = table.iloc[generator.permutation(len(table))].reset_index(drop=True)
    found = rows_of(shuffled)
    assert found[:2] == expected[:2]


def test_a_row_read_backwards_is_the_same_row():
    table = street(("a", "b", 80, 0.1), ("b", "c", 90, 0.2), ("c", "d", 95, 0.3))
    turned = table.rename(
        columns={"building_id_1": "building_id_2", "building_id_2": "building_id_1"}
    )
    turned["azimuth"] += 180.0
    rows, _, chains = rows_of(table)
    backwards, _, same = rows_of(turned)
    assert rows == backwards
    np.testing.assert_allclose(same.azimuth, chains.azimuth, rtol=1e-12)


def test_of_a_ring_only_one_gap_is_cut():
    # a ring of 15 buildings in a row of at most 180 degrees: two bends, each at a building
    count = 15
    gaps = np.where(np.arange(count) == 4, 0.5, 0.1)
    pairs = [(f"b{k:02}", f"b{(k + 1) % count:02}", 24.0 * k, gaps[k]) for k in range(count)]
    rows, _, _ = rows_of(street(*pairs), angle=80.0)
    # 14 pairs that turn by 24 degrees each: no row has more than four of them
    assert sum(len(row) - 1 for row in rows) == count
    # at its widest gap
    assert ["b04", "b05"] in list(map(sorted, rows))
    assert sorted(map(len, rows))[0] == 2
    assert max(map(len, rows)) == 5


def test_a_ring_around_a_square_is_cut_at_its_widest_gap():
    # twelve buildings, each turned by 30 degrees against the one before
    count = 12
    gaps = np.where(np.arange(count) == 7, 0.5, 0.1)
    pairs = [(f"b{k:02}", f"b{(k + 1) % count:02}", 30.0 * k, gaps[k]) for k in range(count)]
    rows, flags, _ = rows_of(street(*pairs), angle=40.0)
    assert ["b07", "b08"] in rows or ["b08", "b07"] in rows
    # the rest turns by 300 degrees, and a row by 40 at most
    assert all(len(row) <= 3 for row in rows)
    assert all("ring" in found for found in flags)
