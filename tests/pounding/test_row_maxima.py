"""Rows of buildings: exact histories, contact heights, symmetry, laws of impact, company."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from per_obspy import threads
from per_obspy.pounding.pair_histories import pounding_histories
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.row_maxima import BuildingRows, row_maxima
from per_obspy.pounding.structure import Structure
from per_obspy.spectra.elastic import per_spectrum

from .made_up import shaking

DT = 0.02


NORTH, EAST = shaking(12.0, seed=0), shaking(12.0, seed=1)


def random_rows(sizes, seed=0, gap=(0.01, 0.05), **fields):
    """Rows of buildings with periods of 0.25 to 1.5 s."""
    random, count = np.random.default_rng(seed), sum(sizes)
    draw = {
        "period": random.uniform(0.25, 1.5, count),
        "damping": random.uniform(0.02, 0.08, count),
        "mass": random.uniform(1e5, 1e6, count),
        "yield_displacement": np.full(count, np.inf),
        "hardening": np.zeros(count),
        "participation_left": random.uniform(0.6, 1.4, count),
        "participation_right": random.uniform(0.6, 1.4, count),
        "gap": random.uniform(*gap, count),
        "restitution": random.uniform(0.4, 0.8, count),
    }
    axis = random.uniform(0.0, 360.0, len(sizes))
    return BuildingRows(np.append(0, np.cumsum(sizes)), **{**draw, **fields}, azimuth=axis)


def plain(rows):
    """Return the same rows with contact where the displacement is that of the oscillator."""
    ones = np.ones(rows.period.size)
    return rows._replace(participation_left=ones, participation_right=ones)


def chosen(rows, numbers):
    """Return some of the rows."""
    members = [np.arange(rows.first[k], rows.first[k + 1]) for k in numbers]
    index = np.concatenate(members)
    fields = {name: getattr(rows, name)[index] for name in rows._fields[1:-1]}
    first = np.append(0, np.cumsum([part.size for part in members]))
    return BuildingRows(first, **fields, azimuth=rows.azimuth[list(numbers)]), index


def histories(rows):
    """Return the single histories of plain rows along their axes."""
    found = []
    for k, azimuth in enumerate(np.radians(rows.azimuth)):
        part = slice(rows.first[k], rows.first[k + 1])
        columns = (rows.period, rows.damping, rows.mass, rows.yield_displacement, rows.hardening)
        structures = [
            Structure(*values) for values in zip(*(c[part] for c in columns), strict=True)
        ]
        motion = np.cos(azimuth) * NORTH + np.sin(azimuth) * EAST
        gaps, restitution = rows.gap[part][:-1], rows.restitution[part][:-1]
        found.append(pounding_history(motion, DT, structures, gaps, restitution))
    return found


class TestSingleHistories:
    @pytest.mark.parametrize(
        ("sizes", "gap", "tolerance"),
        [
            # few impacts: both are exact, as required before the first near-grazing contact
            ([5, 3, 4, 5], (0.03, 0.08), 1e-9),
            # required of maxima after hundreds of impacts; bounces end earlier in blocks of rows
            ([5, 3, 4, 5], (0.0, 0.0), 1e-6),
            # a row that begins in contact and may open further on
            ([6, 2], (0.0, 0.02), 1e-6),
        ],
    )
    def test_maxima_are_those_of_pounding_history(self, sizes, gap, tolerance):
        # catches: a wrong neighbour in a block, contact forces of a cluster, lost or double impacts
        rows = plain(random_rows(sizes, gap=gap, seed=3))
        if gap == (0.0, 0.02):
            rows.gap[::2] = 0.0
        maxima = row_maxima(NORTH, EAST, DT, rows)
        expected = histories(rows)
        assert_allclose(maxima.radius, np.concatenate([h.per for h in expected]), rtol=tolerance)
        largest = np.concatenate([h.displacement_maxima for h in expected])
        assert_allclose(maxima.displacement, largest, rtol=tolerance)
        counts = [np.bincount(h.impacts.query("counted")["left"], minlength=6) for h in expected]
        found = np.split(maxima.impacts, rows.first[1:-1])
        total = sum(int(numbers.sum()) for numbers in counts)
        assert total > 40
        # impacts at the limit of counting may fall on either side of it
        difference = [
            abs(n[:-1] - c[: n.size - 1]).sum() for n, c in zip(found, counts, strict=True)
        ]
        assert sum(difference) <= (0 if tolerance == 1e-9 else 0.02 * total)

    @pytest.mark.parametrize("restitution", [0.3, 0.65])
    def test_rows_of_light_and_heavy_buildings(self, restitution):
        # catches: bounces that end too early. A light building between two heavy ones is thrown to
        # and fro thousands of times in one step; with a limit of 400 radii are off by 1e-3 to 0.4
        rows = plain(random_rows([5] * 4, gap=(0.0, 0.0), seed=3))
        rows.mass[:] = np.resize([1.0, 100.0], rows.mass.size)
        rows.restitution[:] = restitution
        maxima = row_maxima(NORTH, EAST, DT, rows)
        expected = np.concatenate([history.per for history in histories(rows)])
        assert_allclose(maxima.radius, expected, rtol=1e-6)  # required of maxima

    @pytest.mark.parametrize("gap", [0.0, 0.02])
    def test_yielding_rows(self, gap):
        # catches: an elastic step of a yielding building, contact force without its yield force
        rows = plain(random_rows([4, 3], seed=5, gap=(gap, gap)))
        rows.yield_displacement[:] = [0.02, np.inf, 0.03, 0.01, 0.02, 0.02, np.inf]
        rows.hardening[:] = 0.1
        maxima, expected = row_maxima(NORTH, EAST, DT, rows), histories(rows)
        assert all(h.plastic_displacement.any() for h in expected)
        # required of maxima
        assert_allclose(maxima.radius, np.concatenate([h.per for h in expected]), rtol=1e-6)

    def test_a_row_longer_than_a_block(self):
        # catches: a row cut at the end of the lanes
        rows = plain(random_rows([35], seed=6))
        maxima, (expected,) = row_maxima(NORTH, EAST, DT, rows), histories(rows)
        assert len(expected.impacts) > 100
        assert_allclose(maxima.radius, expected.per, rtol=1e-6)  # required of maxima


def by_solver(rows, motion, end):
    """
    Return displacements and approach speeds of one linear row by an ODE solver.

    The equations are those of the modal coordinates, each interface at its own height.
    """
    omega, n = 2 * np.pi / rows.period, rows.period.size
    a, b = rows.participation_right[:-1], rows.participation_left[1:]
    fastest, largest = np.zeros(n), np.zeros(n)

    def rate(t, y):
        d, v = y[:n], y[n:]
        ground = np.interp(t, DT * np.arange(motion.size), motion)
        return np.concatenate([v, -ground - omega**2 * d - 2 * rows.damping * omega * v])

    def closing(j):
        def clearance(_, y):
            return rows.gap[j] + b[j] * y[j + 1] - a[j] * y[j]

        clearance.terminal, clearance.direction = True, -1
        return clearance

    # sample by sample, from contact to contact
    t, state, count = 0.0, np.zeros(2 * n), 0
    events, ends = [closing(j) for j in range(n - 1)], iter(DT * np.arange(1, end))
    target = next(ends)
    while target is not None:
        step = solve_ivp(
            rate, (t, target), state, events=events, rtol=1e-11, atol=1e-13, max_step=DT / 4
        )
        t, state = step.t[-1], step.y[:, -1].copy()
        largest = np.maximum(largest, np.abs(step.y[:n]).max(axis=1))
        # the solver must not have passed a contact
        clearances = rows.gap[:-1, None] + b[:, None] * step.y[1:n] - a[:, None] * step.y[: n - 1]
        assert clearances.min() > -1e-9
        if step.status == 0:
            target = next(ends, None)
            continue
        j = next(k for k in range(n - 1) if step.t_events[k].size)
        approach = a[j] * state[n + j] - b[j] * state[n + j + 1]
        share = a[j] ** 2 / rows.mass[j] + b[j] ** 2 / rows.mass[j + 1]
        impulse = (1 + rows.restitution[j]) * approach / share
        state[n + j] -= a[j] * impulse / rows.mass[j]
        state[n + j + 1] += b[j] * impulse / rows.mass[j + 1]
        fastest[j], count = max(fastest[j], approach), count + 1
    return largest, fastest, count


@pytest.mark.parametrize("seed", [11, 15])
def test_contact_at_heights_of_its_own_against_a_solver(seed):
    # catches: participations of the wrong side, modal mass in place of that at the contact height
    rows = random_rows([4], seed=seed, gap=(0.01, 0.03))
    azimuth = np.radians(rows.azimuth[0])
    motion = (np.cos(azimuth) * NORTH + np.sin(azimuth) * EAST)[:200]
    largest, fastest, count = by_solver(rows, motion, 200)
    assert count > 10
    maxima = row_maxima(NORTH[:200], EAST[:200], DT, rows, free_vibration=False)
    # the solver's own accuracy; displacements at its samples, a quarter of a step apart
    assert_allclose(maxima.impact_velocity, fastest, rtol=1e-8)
    assert_allclose(maxima.displacement, largest, rtol=1e-3)


class TestSymmetry:
    def test_the_mirrored_row_under_the_opposite_motion_is_the_same(self):
        # catches: left and right exchanged in one formula
        rows = random_rows([5, 4, 3], seed=7)
        numbers = np.concatenate(
            [np.arange(rows.first[k], rows.first[k + 1])[::-1] for k in range(3)]
        )
        fields = {name: getattr(rows, name)[numbers] for name in rows._fields[1:-1]}
        swapped = fields["participation_right"], fields["participation_left"]
        fields["participation_left"], fields["participation_right"] = swapped
        # interface k | k + 1 becomes the one before
        for name in ("gap", "restitution"):
            fields[name] = np.roll(fields[name], -1)
        mirrored = BuildingRows(rows.first, **fields, azimuth=rows.azimuth)
        there = row_maxima(NORTH, EAST, DT, rows)
        back = row_maxima(-NORTH, -EAST, DT, mirrored)
        assert there.impacts.sum() > 50
        # the scales of a row begin at its other end: rounding alone
        assert_allclose(back.radius, there.radius[numbers], rtol=1e-9)
        inner = np.roll(numbers, -1)
        assert_array_equal(back.impacts, np.where(back.impacts, there.impacts[inner], 0))
        assert back.impacts.sum() == there.impacts.sum()

    def test_the_axis_may_point_either_way(self):
        # catches: an azimuth that turns the wrong component
        rows = random_rows([4, 2], seed=8)
        there = row_maxima(NORTH, EAST, DT, rows)
        back = row_maxima(-NORTH, -EAST, DT, rows._replace(azimuth=rows.azimuth + 180.0))
        assert_allclose(back.radius, there.radius, rtol=1e-9)  # cosines of two angles

    def test_scales(self):
        # catches: a length or a mass that enters a law of motion; powers of two are exact
        rows = random_rows([5, 4], seed=9)
        once = row_maxima(NORTH, EAST, DT, rows)
        scaled = rows._replace(gap=4.0 * rows.gap, mass=2.0 * rows.mass)
        four = row_maxima(4.0 * NORTH, 4.0 * EAST, DT, scaled)
        assert_array_equal(four.radius, 4.0 * once.radius)
        assert_array_equal(four.free_radius, 4.0 * once.free_radius)
        assert_array_equal(four.impact_velocity, 4.0 * once.impact_velocity)


class TestLimits:
    @pytest.mark.parametrize("gap", [(0.0, 0.0), (0.01, 0.05)])
    @pytest.mark.parametrize("limit", [np.inf, 0.03])
    def test_a_row_of_two_is_the_pair(self, gap, limit):
        # catches: contact mass, scale of gap or yield displacement at the contact height
        rows = random_rows([2] * 20, seed=10, gap=gap)
        rows.yield_displacement[:] = limit
        rows.hardening[:] = 0.05
        maxima = row_maxima(NORTH, EAST, DT, rows)
        first, second = slice(0, None, 2), slice(1, None, 2)
        a, b = rows.participation_right[first], rows.participation_left[second]
        pairs = pounding_histories(
            [NORTH, EAST], DT,
            rows.period[first], rows.damping[first], rows.mass[first] / a**2,
            rows.period[second], rows.damping[second], rows.mass[second] / b**2,
            rows.gap[first], rows.restitution[first], a, b, rows.azimuth,
            a * limit, 0.05, b * limit, 0.05,
        )  # fmt: skip
        assert pairs.impacts.sum() > 100
        # required of maxima; a row allows more bounces in one step than a pair
        assert_allclose(maxima.radius[first] * a, pairs.per[0], rtol=1e-6)
        assert_allclose(maxima.radius[second] * b, pairs.per[1], rtol=1e-6)
        assert_allclose(maxima.impact_velocity[first], pairs.impact_velocity, rtol=1e-6)
        assert abs(maxima.impacts[first] - pairs.impacts).max() <= 1

    def test_equal_buildings_that_touch_move_in_step(self):
        # catches: contact that hits by rounding
        count = 6
        equal = {name: np.full(count, value) for name, value in
                 {"period": 0.7, "damping": 0.05, "mass": 3e5, "participation_left": 1.2,
                  "participation_right": 1.2}.items()}  # fmt: skip
        rows = random_rows([count], seed=1, gap=(0.0, 0.0), **equal)
        maxima = row_maxima(NORTH, EAST, DT, rows)
        assert not maxima.impacts.any()
        assert not maxima.impact_velocity.any()
        assert_allclose(maxima.radius, maxima.free_radius, rtol=1e-9)  # both are exact

    def test_an_infinite_mass_splits_the_row(self):
        # catches: an impulse that passes through a wall
        rows = random_rows([5], seed=13)
        rows.mass[2] = np.inf
        whole = row_maxima(NORTH, EAST, DT, rows)
        halves = [np.array([0, 1, 2]), np.array([2, 3, 4])]
        for members in halves:
            fields = {name: getattr(rows, name)[members] for name in rows._fields[1:-1]}
            half = row_maxima(NORTH, EAST, DT, BuildingRows([0, 3], **fields, azimuth=rows.azimuth))
            assert half.impacts.sum() > 10
            assert_allclose(half.radius, whole.radius[members], rtol=1e-9)  # steps in other parts
            assert_array_equal(half.impacts[:2], whole.impacts[members[:2]])
        assert_allclose(whole.radius[2], whole.free_radius[2], rtol=1e-9)

    def test_wide_gaps_and_rows_of_one_give_the_spectrum(self):
        # catches: contact with a building of another row
        rows = random_rows([1, 4, 1], seed=14, gap=(9.0, 9.0))
        rows = rows._replace(azimuth=np.zeros(3))
        maxima = row_maxima(NORTH, EAST, DT, rows)
        expected = [
            per_spectrum(np.append(NORTH, 0.0), DT, [period], damping)[0]
            for period, damping in zip(rows.period, rows.damping, strict=True)
        ]
        assert_allclose(maxima.radius, expected, rtol=1e-9)  # both are exact
        assert_allclose(maxima.free_radius, expected, rtol=1e-9)
        assert not maxima.impacts.any()

    def test_a_yielding_building_alone(self):
        # catches: the elastic spectrum as the radius of a building that yields
        rows = plain(random_rows([3], seed=15, gap=(9.0, 9.0)))
        rows.yield_displacement[:] = 0.01
        maxima = row_maxima(NORTH, EAST, DT, rows)
        assert_allclose(maxima.free_radius, maxima.radius, rtol=1e-9)  # both are exact
        elastic = row_maxima(NORTH, EAST, DT, rows._replace(yield_displacement=np.full(3, np.inf)))
        assert (abs(maxima.radius / elastic.radius - 1.0) > 0.01).all()


class TestCompany:
    def test_a_row_does_not_depend_on_the_others(self):
        # catches: sums over a block, coefficients shared by lanes, order of rows; bit for bit
        rows = random_rows([5, 2, 1, 7, 3, 5, 12, 4, 33, 2], seed=16)
        rows.gap[::3] = 0.0
        rows.yield_displacement[::4] = 0.02
        rows.period[4] = 0.06  # another number of steps per sampling interval
        together = row_maxima(NORTH, EAST, DT, rows)
        for numbers in ([3], [9, 0, 8], [6, 5, 4, 3, 2, 1]):
            few, index = chosen(rows, numbers)
            for found, expected in zip(row_maxima(NORTH, EAST, DT, few), together, strict=True):
                assert_array_equal(found, expected[index])

    def test_nor_on_the_rows_held_at_a_time(self, monkeypatch):
        # catches: numbers of buildings that do not begin at 0 in a later part
        rows = random_rows([5, 2, 1, 7, 3], seed=20)
        rows.yield_displacement[::3] = 0.02
        expected = row_maxima(NORTH, EAST, DT, rows)
        monkeypatch.setattr("per_obspy.pounding.row_maxima.PART", 2)
        for found, one in zip(row_maxima(NORTH, EAST, DT, rows), expected, strict=True):
            assert_array_equal(found, one)

    @pytest.mark.parametrize("processors", [1, 3])
    def test_nor_on_the_number_of_threads(self, processors, monkeypatch):
        # catches: memory shared by threads
        rows = random_rows([5] * 20, seed=17)
        expected = row_maxima(NORTH, EAST, DT, rows)
        monkeypatch.setattr(threads, "usable_processors", lambda: processors)
        for found, one in zip(row_maxima(NORTH, EAST, DT, rows), expected, strict=True):
            assert_array_equal(found, one)


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("period", [0.5, 0.0, 0.5], "period must be positive, got 0.0 at index 1"),
        ("mass", [1.0, np.nan, 1.0], "mass"),
        ("gap", [-0.01, 0.1, 0.1], "gap must be zero or more, got -0.01 at index 0"),
        ("participation_left", [1.0, 0.0, 1.0], "participation_left must be positive"),
        ("restitution", [0.5, 1.5, 0.5], "restitution"),
        ("damping", [0.05, 0.05], r"damping must have the shape \(3,\), got \(2,\)"),
        ("mass", [np.inf, np.inf, 1.0], "index 0 and 1 is infinite"),
        ("first", [0, 2, 2, 3], "first must begin at 0 and grow"),
        ("first", [0.0, 3.0], "first must be whole numbers"),
        ("azimuth", [np.nan], "azimuth must be finite"),
    ],
)
def test_wrong_rows_are_refused(name, values, message):
    # catches: a NaN that a running maximum hides
    rows = random_rows([3], seed=18)._replace(**{name: np.array(values)})
    with pytest.raises(ValueError, match=message):
        row_maxima(NORTH, EAST, DT, rows)


def test_values_without_meaning_are_not_looked_at():
    # catches: the gap after the last building, refused or used
    rows = random_rows([3, 2], seed=19)
    expected = row_maxima(NORTH, EAST, DT, rows)
    last, first = rows.first[1:] - 1, rows.first[:-1]
    rows.gap[last], rows.restitution[last] = np.nan, -1.0
    rows.participation_right[last], rows.participation_left[first] = np.nan, 0.0
    for found, one in zip(row_maxima(NORTH, EAST, DT, rows), expected, strict=True):
        assert_array_equal(found, one)
