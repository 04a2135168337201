"""The rest of a record is left out only where it changes no result of a row."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_events.motion import COUNTED_SPEED
from per_obspy.kernels.pounding_lanes.remaining_motion import (
    DECAY,
    GAIN,
    NORM,
    REACH,
    remains_still,
)
from per_obspy.pounding import row_maxima as rows_page
from per_obspy.pounding.kernel_tables import structure_table
from per_obspy.pounding.row_history import pounding_history
from per_obspy.pounding.row_maxima import BuildingRows, row_maxima
from per_obspy.pounding.structure import Structure

DT = 0.02


def record(rng):
    """Return strong noise that fades, and a stronger aftershock that fades, m/s²."""
    fading = 10.0 ** -np.linspace(0.0, 5.0, 1000)
    envelope = np.concatenate([np.ones(300), fading, np.full(200, 1.2), fading])
    return 3.0 * envelope * rng.normal(size=(2, envelope.size))


def random_rows(rng, sizes):
    """Return rows that touch, of which some have a gap too, or are of equal buildings."""
    count = sum(sizes)
    first = np.append(0, np.cumsum(sizes))
    rows = BuildingRows(
        first=first,
        period=rng.uniform(0.2, 0.8, count),
        damping=rng.uniform(0.05, 0.15, count),
        mass=rng.uniform(0.2, 5.0, count),
        yield_displacement=np.full(count, np.inf),
        hardening=np.zeros(count),
        participation_left=rng.uniform(0.6, 1.6, count),
        participation_right=rng.uniform(0.6, 1.6, count),
        gap=np.where(rng.random(count) < 0.3, rng.uniform(0.002, 0.02, count), 0.0),
        restitution=rng.uniform(0.2, 0.9, count),
        azimuth=rng.uniform(0.0, 360.0, len(sizes)),
    )
    # some yield, some do not by far
    rows.yield_displacement[: count // 2] = rng.choice([0.02, 0.05, 5.0, np.inf], count // 2)
    # all buildings of the last row are equal
    last = slice(first[-2], first[-1])
    for name in ("period", "damping", "mass", "participation_left", "participation_right"):
        getattr(rows, name)[last] = 0.5
    rows.gap[last] = 0.0
    return rows


@pytest.mark.compiled
def test_rows_are_the_same_bits_as_through_the_whole_record(monkeypatch):
    # catches: a ground that is taken for quiet, an energy without a neighbour, a group with a gap
    rng = np.random.default_rng(21)
    north, east = record(rng)
    rows = random_rows(rng, [3, 4, 5, 3, 8, 4, 3, 6, 3, 3])
    short = row_maxima(north, east, DT, rows)

    def never_still(*arguments):
        """Return records of which no rest is known to be quiet."""
        found = records_in_steps(*arguments)
        return {n: one._replace(sizes=np.full_like(one.sizes, 1e30)) for n, one in found.items()}

    records_in_steps = rows_page.records_in_steps
    monkeypatch.setattr(rows_page, "records_in_steps", never_still)
    whole = row_maxima(north, east, DT, rows)
    for name in whole._fields:
        assert_array_equal(getattr(short, name), getattr(whole, name), err_msg=name)
    assert (whole.impacts > 0).sum() > 20


def row_of(displacement, gaps, largest=0.1, fastest=1.0):
    """Return three linear buildings, displaced together."""
    row = np.zeros((3, columns.ROW_COLUMNS))
    omega = 2.0 * np.pi / np.array([1.0, 0.6, 0.8])
    row[:, columns.DAMPING_RATE] = 0.05 * omega
    row[:, columns.STIFFNESS] = omega**2
    row[:, columns.YIELD] = np.inf
    row[:, columns.PARTICIPATION] = row[:, columns.MASS] = 1.0
    row[:, columns.U], row[:, columns.LARGEST_DISPLACEMENT] = displacement, largest
    row[:2, columns.APPROACH], row[:2, columns.GAP] = fastest, gaps
    row[:, COUNTED_SPEED] = 1e-3
    return row


def is_still(row, sizes=None, group=0, direction=(1.0, 0.0)):
    """Return whether a row remains still under a ground that is quiet if not given."""
    sizes = np.zeros((2, 40)) if sizes is None else sizes
    return remains_still(row, *direction, sizes, 1.28, group)


@pytest.mark.parametrize("gaps", [(0.0, 0.0), (0.0, 0.05), (0.05, 0.0), (0.05, 0.05)])
def test_a_quiet_row_is_still_and_an_excited_one_is_not(gaps):
    # catches: one group left out of the sums
    assert is_still(row_of(1e-5, gaps))
    late = np.zeros((2, 40))
    late[0, 30] = 6.0
    # a late pulse counts only along its direction, and not once it is over
    assert not is_still(row_of(1e-5, gaps), late)
    assert is_still(row_of(1e-5, gaps), late, direction=(0.0, 1.0))
    assert is_still(row_of(1e-5, gaps), late, group=31)
    assert not is_still(row_of(1e-5, gaps), late[::-1], direction=(0.6, -0.8))
    for i in range(3):
        row = row_of(1e-5, gaps)
        row[i, columns.LARGEST_DISPLACEMENT] = 1e-6
        assert not is_still(row)


def test_impacts_that_count_keep_a_row_going():
    # catches: limits of another interface, a unit of speed that is not that of the interface
    assert not is_still(row_of(5e-3, (0.0, 0.0)))
    assert is_still(row_of(5e-3, (0.0, 0.0), fastest=50.0))
    for j in range(2):
        row = row_of(5e-3, (0.0, 0.0), fastest=50.0)
        row[j, columns.APPROACH] = 1.0
        assert not is_still(row)
        row[j, COUNTED_SPEED] = 0.2
        assert is_still(row)
    # before the first impact every impact is the fastest
    row = row_of([1e-9, -1e-9, 1e-9], (0.0, 0.0))
    row[1, columns.APPROACH] = 0.0
    assert not is_still(row)


def test_an_approach_takes_the_energy_of_a_group():
    # catches: the speed of one of both buildings
    row = row_of(0.0, (0.0, 0.05))
    row[0, columns.V] = 1e-2
    # at most 1e-2 m/s times the root of two, against 1 % of the fastest
    for fastest, expected in ((1.45, True), (1.38, False)):
        row[:2, columns.APPROACH] = fastest
        assert is_still(row) == expected


def test_the_building_beside_a_gap_reaches_it():
    # catches: the reach of the other end of a group; the slower building is beside the gap
    row = row_of(0.0, (0.0, 0.05), fastest=100.0)
    both = [columns.STIFFNESS, columns.DAMPING_RATE]
    row[:2, both] = row[1::-1, both]
    # 0.045 m at most, then 0.054 m; the first building alone 0.032 m
    for speed, expected in ((0.28, True), (0.34, False)):
        row[0, columns.V] = speed
        assert is_still(row) == expected


@pytest.mark.parametrize("gaps", [(0.0, 0.05), (0.05, 0.0)])
def test_displacements_that_may_close_a_gap_keep_a_row_going(gaps):
    # catches: the reach of the wrong building
    assert not is_still(row_of(0.03, gaps, fastest=100.0))
    assert is_still(row_of(0.03, [4.0 * gap for gap in gaps], fastest=100.0))


def test_equal_buildings_with_equal_states_have_no_impact():
    # catches: one of three that differs in its state, equation or drive
    def equal(fastest=0.0):
        row = row_of(5e-3, (0.0, 0.0), fastest=fastest)
        row[:, columns.STIFFNESS], row[:, columns.DAMPING_RATE] = 100.0, 0.5
        return row

    assert is_still(equal())
    for column in ("STIFFNESS", "DAMPING_RATE", "PARTICIPATION", "U", "V"):
        for i in range(3):
            row = equal()
            row[i, getattr(columns, column)] += 1e-9
            assert not is_still(row)


def test_walls_that_touch_have_no_bound():
    # catches: an energy that a wall can give again and again
    row = row_of(1e-5, (0.0, 0.0))
    row[2, columns.MASS] = np.inf
    assert not is_still(row)


def test_touching_buildings_that_may_yield_are_linear_about_one_place_of_rest():
    # catches: a bound beyond the elastic range, or of buildings that press each other at rest
    def with_yield(displacement, plastic, limit):
        row = row_of(displacement, (0.0, 0.0))
        row[:, columns.YIELD], row[:, columns.PLASTIC] = limit, plastic
        return is_still(row)

    assert with_yield(1e-5, 0.0, 0.02)
    assert with_yield(2e-3 + 1e-5, 2e-3, 0.02)
    assert not with_yield(1e-5, 0.0, 1e-5)
    assert not with_yield(1e-5, 2e-3, 0.02)
    assert not with_yield([2e-3, 1e-3, 1e-3], [2e-3, 1e-3, 1e-3], 0.02)


@pytest.mark.parametrize("damping", [0.04, 0.3])
@pytest.mark.parametrize("seed", range(4))
def test_the_norm_bounds_that_of_a_hit_row(seed, damping):
    # catches: a decay or a rise that the motion exceeds; without loss at impacts both are close
    rng = np.random.default_rng(seed)
    ground = np.zeros(257)
    ground[1:4] = 1.0
    structures = [
        Structure(*one) for one in rng.uniform([0.7, 0.03, 0.5], [1.0, damping, 2.0], (3, 3))
    ]
    history = pounding_history(ground, DT, structures, 0.0, 1.0, free_vibration=False)
    assert len(history.impacts) > 5
    row = row_of(0.0, (0.0, 0.0), largest=1e9, fastest=1e15)
    table = structure_table(structures)
    row[:, :6] = table
    rate, stiffness, mass = table[:, 0].min(), table[:, 1], table[:, 5]
    sizes = np.zeros((2, 4))
    sizes[0, 0] = 3.0 * DT
    u, v = history.displacement[:, 4], history.velocity[:, 4]
    early = np.sqrt((mass * (v**2 + 2.0 * rate * u * v + stiffness * u**2)).sum())
    for end in range(1, 5):
        sample = 64 * end
        assert remains_still(row, 1.0, 0.0, sizes[:, :end], 64 * DT, 0)
        # just after the pulse hardly any energy is lost
        assert early < row[0, GAIN] * sizes[0, 0]
        assert early > 0.92 * row[0, GAIN] * sizes[0, 0] or damping > 0.04
        # the bound went on for one group after the record
        bound = row[0, NORM] / row[0, DECAY]
        u, v = history.displacement[:, sample], history.velocity[:, sample]
        norm = np.sqrt((mass * (v**2 + 2.0 * rate * u * v + stiffness * u**2)).sum())
        assert norm < bound
        # close to it where all are damped alike
        assert norm > 0.5 * bound or damping > 0.04
        assert (abs(u) < bound * row[:, REACH]).all()
