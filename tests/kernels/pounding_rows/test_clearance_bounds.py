"""
Clearances of two oscillators in a piece of a step, against the same motion at many times.

Covers ``per_obspy.kernels.pounding_rows.clearance_bounds``.
"""

import numpy as np
import pytest

from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_lanes.free_impacts import (
    CLOSES_NOW,
    CLOSES_ONCE,
    STAYS_OPEN,
    states_inside_step,
)
from per_obspy.kernels.pounding_lanes.lanes import LANE_ROWS
from per_obspy.kernels.pounding_lanes.maxima_in_step import complete_state
from per_obspy.kernels.pounding_lanes.pair_rows import write_constants, write_phase
from per_obspy.kernels.pounding_rows.clearance_bounds import clearance_course, stays_open

STEP, COUNT = 0.02, 500
#: Times at which the motion inside a piece is looked at, as shares of the piece.
INSIDE = np.linspace(0.0, 1.0, 61)[1:]


def pair_of(random):
    """Return the numbers and the row of two random elastic oscillators without contact."""
    row, pair = np.zeros((2, columns.ROW_COLUMNS)), np.zeros(LANE_ROWS)
    omega = random.uniform(1.0, 30.0, 2)
    row[:, columns.DAMPING_RATE] = random.uniform(0.0, 0.2, 2) * omega
    row[:, columns.STIFFNESS], row[:, columns.YIELD] = omega**2, np.inf
    row[:, columns.PARTICIPATION] = row[:, columns.MASS] = 1.0
    row[0, columns.GAP] = random.choice([0.0, 0.01])
    write_constants(pair, row, 1.0, 0.0, STEP)
    write_phase(pair, row, STEP)
    return pair, row, omega


def piece_of(random, has_met):
    """Return a random piece near contact: pair, states at its ends, length, and clearances."""
    pair, row, omega = pair_of(random)
    share, ground = random.uniform(0.05, 1.0), random.normal(size=2)
    clearance = 0.0 if has_met else random.choice([1e-6, 1e-4, 1e-3, -1e-4])
    u = random.normal(0.0, 0.02)
    position = u, u - row[0, columns.GAP] + clearance
    # both move alike but for a speed that a step may turn
    speed = random.normal(0.0, 0.2) + np.array([0.0, random.choice([-0.2, -0.02, 0.02, 0.2])])
    if has_met:
        speed[1] = speed[0] + abs(speed[1] - speed[0])
    left, right = (
        complete_state(pair, first, position[i], speed[i] / omega[i], ground[0])
        for i, first in enumerate((0, 35))
    )
    change = ground[1]
    ends = states_inside_step(pair, row, left, right, change, share)
    inside = [states_inside_step(pair, row, left, right, change, share * s) for s in INSIDE]
    clearances = np.array([row[0, columns.GAP] - a[0] + b[0] for a, b in inside])
    return (pair, left, right, *ends, share), clearances


@pytest.mark.parametrize("has_met", [False, True])
def test_an_interface_that_stays_open_never_closes(has_met):
    # catches: a bound of the cubic that is too small, control points of another piece
    random = np.random.default_rng(7)
    found = closed = 0
    for _ in range(COUNT):
        piece, clearances = piece_of(random, has_met)
        is_open = stays_open(*piece, STEP, has_met)
        closed += clearances.min() <= 0.0
        if is_open:
            found += 1
            assert clearances.min() > 0.0
    # it recognises most of them, and some close
    assert closed > 20
    assert found > 0.8 * (COUNT - closed)


def test_the_course_of_a_clearance():
    # catches: a swing of the rate that is too small, a sign, concave and convex exchanged
    random = np.random.default_rng(8)
    courses = []
    for _ in range(COUNT):
        piece, clearances = piece_of(random, False)
        course = clearance_course(*piece, STEP)
        start = piece[0][76] - piece[1][0] + piece[2][0]
        signs = np.append(start, clearances) > 0.0
        changes = np.count_nonzero(np.diff(signs))
        if course == CLOSES_ONCE:
            # from open to closed, or from closed to open and closed again
            assert not signs[-1]
            assert changes == (1 if start > 0.0 else changes)
            assert changes <= 2
        elif course == STAYS_OPEN and start > 0.0:
            assert signs.all()
        elif course == CLOSES_NOW:
            assert start <= 1e-12
            assert (np.diff(clearances) < 0.0).all()
        courses.append(course)
    # all of them happen, and few stay uncertain
    counts = np.bincount(courses, minlength=4)
    assert (counts[1:] > 20).all()
    assert counts[0] < 0.25 * counts.sum()
