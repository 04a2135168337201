"""Rows divided where a gap never closes: the same maxima as of the complete rows."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.pounding import row_tables
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.row_maxima import (
    BuildingRows,
    row_and_pair_maxima,
    row_maxima,
)
from per_obspy.pounding.row_tables import (
    checked_rows,
    moves_in_step,
    parts_of,
    run_in_parts,
    stays_open,
)
from per_obspy.pounding.structure import Structure

DT = 0.02
PULSE = -4.0 * np.sin(2 * np.pi * np.arange(120) * DT / 0.8) * np.linspace(1.0, 0.0, 120)


def row_of(gaps, period, mass, **fields):
    """Return one row along the north, of buildings with these gaps after them."""
    count = len(gaps) + 1
    numbers = {
        "period": np.array(period),
        "damping": np.full(count, 0.05),
        "mass": np.array(mass),
        "yield_displacement": np.full(count, np.inf),
        "hardening": np.zeros(count),
        "participation_left": np.ones(count),
        "participation_right": np.ones(count),
        "gap": np.append(gaps, 1.0),
        "restitution": np.full(count, 0.6),
    }
    return BuildingRows(np.array([0, count]), **{**numbers, **fields}, azimuth=np.zeros(1))


def complete(monkeypatch, rows):
    """Return the maxima of rows that are not divided."""

    def never(rows, _):
        is_open = np.zeros(rows.period.size, dtype=bool)
        is_open[rows.first[1:] - 1] = True
        return is_open

    with monkeypatch.context() as patch:
        patch.setattr(row_tables, "stays_open", never)
        return row_maxima(PULSE, 0.0 * PULSE, DT, rows)


@pytest.mark.parametrize("limit", [np.inf, 0.02])
def test_a_divided_row_is_the_complete_row(monkeypatch, limit):
    # catches: a neighbour beyond an open gap, a scale or an end of another part
    period = [0.5, 0.9, 0.6, 1.1, 0.4, 0.7, 0.8]
    rows = row_of([0.001, 5.0, 0.01, 0.02, 5.0, 5.0], period, [2.0, 1.0, 3.0, 1.0, 2.0, 1.0, 1.0])
    random = np.random.default_rng(2)
    for name in ("participation_left", "participation_right"):
        getattr(rows, name)[:] = random.uniform(0.6, 1.4, 7)
    rows.yield_displacement[2:4], rows.yield_displacement[-1] = limit, limit
    expected = complete(monkeypatch, rows)
    found = row_maxima(PULSE, 0.0 * PULSE, DT, rows)
    assert expected.impacts[[0, 2, 3]].all()
    assert not expected.impacts[[1, 4, 5]].any()
    for name, values in expected._asdict().items():
        assert_allclose(getattr(found, name), values, rtol=1e-9, err_msg=name)  # both are exact


def test_a_gap_that_closes_only_because_of_another_impact():
    # catches: rows divided by the motion of the buildings alone
    rows = row_of([0.0, 0.2], [2.0, 0.6, 0.6], [50.0, 1.0, 1.0])
    found = row_maxima(PULSE, 0.0 * PULSE, DT, rows)
    alone = row_maxima(PULSE, 0.0 * PULSE, DT, rows._replace(gap=np.full(3, 9.0)))
    assert alone.displacement[1] + alone.displacement[2] < 0.2
    assert found.impacts[1] > 0
    structures = [Structure(t, 0.05, m) for t, m in zip(rows.period, rows.mass, strict=True)]
    history = pounding_history(PULSE, DT, structures, [0.0, 0.2], 0.6)
    assert_allclose(found.radius, history.per, rtol=1e-6)  # required of maxima


def test_buildings_that_move_in_step_are_computed_only_if_another_hits_them(monkeypatch):
    # catches: neighbours in step whose motion another building disturbs, at once or in the end
    walls = row_of([0.0, 0.2, 0.0], [2.0, 0.6, 0.6, 0.6], [50.0, 1.0, 2.0, 1.0])
    for rows in (walls, walls._replace(gap=np.zeros(4))):
        expected = complete(monkeypatch, rows)
        found = row_maxima(PULSE, 0.0 * PULSE, DT, rows)
        assert expected.impacts[:3].all()
        for name, values in expected._asdict().items():
            assert_allclose(getattr(found, name), values, rtol=1e-9, err_msg=name)  # both are exact
    # without the first no one is hit, whatever the masses: nothing is computed
    alike = checked_rows(row_of([0.0, 0.2], [0.6] * 3, [1.0, 2.0, 1.0]))
    maxima = np.ones((3, 1))
    pairs = run_in_parts(alike, maxima, lambda _: pytest.fail("computed"), np.ones(3, bool))
    assert_array_equal(pairs[:2], 1.0)
    alike.participation_left[1] = 1.1
    assert_array_equal(moves_in_step(alike), [False, True, False])


def test_parts_are_joined_until_no_gap_closes():
    # catches: a gap that only the part of two joined parts closes, parts that are not run again
    rows = checked_rows(row_of([1.0, 1.0, 1.0, 2.0], [1.0, 2.0, 1.0, 2.0, 1.0], [1.0] * 5))
    alone = np.array([[0.6, 0.5, 0.1, 0.1, 0.1]]).T
    seen = []

    def run(parts):
        seen.append(np.diff(parts.first).tolist())
        # motion grows with the number of buildings of a part
        return np.repeat(0.3 * np.diff(parts.first), np.diff(parts.first))[:, None]

    # the motion of the first two reaches 0.6 m
    maxima = alone.copy()
    run_in_parts(rows, maxima, run, np.zeros(5, dtype=bool))
    assert seen == [[2]]
    assert_array_equal(maxima[:, 0], [0.6, 0.6, 0.1, 0.1, 0.1])
    # that of three 0.9 m, that of four 1.2 m
    rows.gap[1] = 0.7
    maxima = alone.copy()
    seen.clear()
    run_in_parts(rows, maxima, run, np.zeros(5, dtype=bool))
    assert seen == [[2], [3], [4]]
    assert_allclose(maxima[:, 0], [1.2, 1.2, 1.2, 1.2, 0.1], rtol=1e-12)


def test_only_a_certain_gap_divides():
    # catches: displacements without their participation, a gap that is reached exactly
    rows = checked_rows(
        row_of([0.3, 0.3], [1.0] * 3, [1.0] * 3, participation_right=np.array([2.0, 1.0, 1.0]))
    )
    reached = np.array([0.1, 0.1, 0.1])
    assert_array_equal(stays_open(rows, reached), [False, True, True])
    # just below the gap, by less than rounding
    nearly = np.array([0.1, 0.1 * (1.0 - 1e-10), 0.1])
    assert_array_equal(stays_open(rows, nearly), [False, True, True])
    assert_array_equal(stays_open(rows, 0.99 * reached), [True, True, True])
    # a row ends after its last building, however far that moves
    assert stays_open(rows, np.array([0.0, 0.0, 9.0]))[2]
    rows.participation_left[2] = 1.5
    assert_array_equal(stays_open(rows, np.array([0.0, 0.1, 0.14])), [True, False, True])
    assert not stays_open(checked_rows(row_of([0.0], [1.0] * 2, [1.0] * 2)), np.zeros(2))[0]


def test_parts_have_the_axis_and_the_buildings_of_their_rows():
    # catches: numbers of a part counted in its row, terms of a neighbour beyond an open gap
    rows = row_of([0.1, 0.2, 0.3], [1.0, 2.0, 3.0, 4.0], [1.0] * 4)
    rows = checked_rows(rows._replace(first=np.array([0, 1, 4]), azimuth=np.array([10.0, 20.0])))
    rows.participation_left[:], rows.participation_right[:] = 2.0, 3.0
    is_end = np.array([True, False, True, True])
    parts = parts_of(rows, is_end, np.array([True, True, True, False]))
    assert_array_equal(parts.first, [0, 1, 3])
    assert_array_equal(parts.period, [1.0, 2.0, 3.0])
    assert_array_equal(parts.azimuth, [10.0, 20.0])
    assert_array_equal(parts.participation_left, [1.0, 1.0, 2.0])
    assert_array_equal(parts.participation_right, [1.0, 3.0, 1.0])
    assert_array_equal(parts.gap, [1.0, 0.2, 1.0])


def test_pairs_alone_have_no_other_neighbours():
    # catches: a pair with the gap or the axis of another, a part of two computed once more
    rows = row_of([0.001, 5.0, 0.01, 0.02], [0.5, 0.9, 0.6, 1.1, 0.4], [2.0, 1.0, 3.0, 1.0, 2.0])
    wanted = np.array([True] * 3 + [False] * 2)
    _, some = row_and_pair_maxima(PULSE, 0.0 * PULSE, DT, rows, wanted)
    assert_array_equal(np.isnan(some.radius[:4, 0]), [False] * 3 + [True])
    found, pairs = row_and_pair_maxima(PULSE, 0.0 * PULSE, DT, rows, np.ones(5, dtype=bool))
    expected = row_maxima(PULSE, 0.0 * PULSE, DT, rows)
    for name, values in expected._asdict().items():
        assert_array_equal(getattr(found, name), values, err_msg=name)
    for left in range(4):
        both = slice(left, left + 2)
        fields = {name: getattr(rows, name)[both] for name in rows._fields[1:-1]}
        pair = BuildingRows(np.array([0, 2]), **fields, azimuth=np.zeros(1))
        alone = row_maxima(PULSE, 0.0 * PULSE, DT, pair)
        # a lane does not depend on the others
        assert_array_equal(pairs.radius[left], alone.radius)
        assert_array_equal(pairs.free_radius[left], alone.free_radius)
        assert pairs.impacts[left, 0] == alone.impacts[0]
        assert pairs.impact_velocity[left, 0] == alone.impact_velocity[0]
    assert found.impacts[3] != pairs.impacts[3, 0]


def test_a_part_of_two_is_computed_once_for_its_row_and_alone():
    # catches: pairs alone that are computed again
    rows = checked_rows(row_of([0.1, 5.0, 0.1, 0.1], [1.0, 2.0, 1.0, 2.0, 1.0], [1.0] * 5))
    seen = []

    def run(parts):
        seen.append(np.diff(parts.first).tolist())
        return np.arange(1.0, parts.period.size + 1.0)[:, None]

    maxima = np.full((5, 1), 0.3)
    pairs = run_in_parts(rows, maxima, run, np.ones(5, dtype=bool))
    assert seen == [[2, 2, 2], [3]]
    assert_array_equal(pairs[[0, 2, 3], :, 0], [[1, 2], [3, 4], [5, 6]])
    assert_array_equal(maxima[:, 0], [1, 2, 1, 2, 3])
