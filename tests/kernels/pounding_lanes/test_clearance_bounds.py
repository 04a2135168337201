"""
Clearances of two oscillators in a piece of a step, against the same motion at many times.

Covers ``per_obspy.kernels.pounding_lanes.impact_steps``.
"""

import numpy as np
import pytest

from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_lanes.free_impacts import (
    CLOSES_NOW,
    CLOSES_ONCE,
    STAYS_OPEN,
    state_inside_step,
)
from per_obspy.kernels.pounding_lanes.impact_steps import clearance_course, stays_open
from per_obspy.kernels.pounding_lanes.lanes import CONTACT_FUNCTION, LANE_ROWS
from per_obspy.kernels.pounding_lanes.maxima_in_step import complete_state
from per_obspy.kernels.pounding_lanes.phases import write_constants

STEP, COUNT = 0.02, 500
#: Times at which the motion inside a piece is looked at, as shares of the piece.
INSIDE = np.linspace(0.0, 1.0, 61)[1:]


def states_inside_step(pair, row, left, right, change, share):
    """Return the states of both structures after a share of a step."""
    states = enumerate((left, right))
    return tuple(state_inside_step(pair, row, i, state, change, share) for i, state in states)


def pair_of(random):
    """Return the numbers and the row of two random elastic oscillators without contact."""
    row, pair = np.zeros((2, columns.ROW_COLUMNS)), np.zeros(LANE_ROWS)
    omega = random.uniform(1.0, 30.0, 2)
    row[:, columns.DAMPING_RATE] = random.uniform(0.0, 0.2, 2) * omega
    row[:, columns.STIFFNESS], row[:, columns.YIELD] = omega**2, np.inf
    row[:, columns.PARTICIPATION] = row[:, columns.MASS] = 1.0
    row[0, columns.GAP] = random.choice([0.0, 0.01])
    write_constants(pair, row, 1.0, 0.0, STEP)
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


class LinearPair:
    """
    Two random oscillators in a random piece, whose motion is linear in six numbers.

    These are displacement and velocity over omega of both, and the ground acceleration with its
    change over a step.
    """

    def __init__(self, random):
        self.pair, self.row, self.omega = pair_of(random)
        self.share = random.uniform(0.3, 1.0)
        # Rates of the clearance at all times and at both ends, and its growth up to every time
        motions = [self.motion(unit) for unit in np.eye(6)]
        self.all_rates = np.transpose([self.rates_of(*motion) for motion in motions])
        self.rates = self.all_rates[[0, -1]]
        self.growth = np.transpose([self.growth_of(*motion) for motion in motions])

    def motion(self, numbers):
        """Return the states at the start, and those at every time inside."""
        first, change = numbers[:5], numbers[5]
        left = complete_state(self.pair, 0, first[0], first[1], first[4])
        right = complete_state(self.pair, 35, first[2], first[3], first[4])
        inside = [
            states_inside_step(self.pair, self.row, left, right, change, self.share * time)
            for time in INSIDE
        ]
        return (left, right), inside

    def rates_of(self, start, inside):
        """Return the rate of the clearance at the start and at every time inside."""
        states = start, *inside
        return [self.omega[1] * right[1] - self.omega[0] * left[1] for left, right in states]

    @staticmethod
    def growth_of(start, inside):
        """Return by how much the clearance has grown at every time inside."""
        first = start[1][0] - start[0][0]
        return [right[0] - left[0] - first for left, right in inside]

    def numbers_with(self, random, conditions, values):
        """Return random numbers of which some linear functions have these values."""
        draw = random.normal(size=6) * [0.02, 0.02, 0.02, 0.02, 1.0, 1.0]
        correction = np.linalg.lstsq(conditions, values - conditions @ draw, rcond=None)[0]
        return draw + correction

    def piece(self, numbers, clearance):
        """Return the arguments of a piece that begins with a clearance; the gap gives it."""
        (left, right), inside = self.motion(numbers)
        self.pair[CONTACT_FUNCTION + 4] = clearance + left[0] - right[0]
        return self.pair, left, right, *inside[-1], self.share, STEP


@pytest.mark.compiled
def test_a_piece_that_just_closes_between_its_ends_does_not_stay_open():
    # catches: a rest that is too small or has the other sign, a control point too far in, a swing
    # of the rate that is too small
    random, flat, bowed, rising = np.random.default_rng(9), 0, 0, 0
    for _ in range(COUNT):
        one = LinearPair(random)
        whole = np.vstack([one.rates, one.growth[-1:]])
        # The cubic is constant; only the rest moves the clearance
        numbers = one.numbers_with(random, whole, np.zeros(3))
        flat += dips(one, numbers)
        flat += dips(one, -numbers)
        # It falls and rises again, as a parabola
        rates = random.uniform(0.01, 0.1) * np.array([-1.0, 1.0])
        bowed += dips(one, one.numbers_with(random, whole, np.append(rates, 0.0)))
        # Its rates at both ends are positive, and it falls in between
        slow = one.numbers_with(random, one.rates, np.zeros(2))
        rate = -random.uniform(0.1, 0.7) * (one.all_rates @ slow).min()
        rising += dips(one, slow + np.linalg.lstsq(one.rates, np.full(2, rate), rcond=None)[0])
    assert min(flat, bowed) > 0.5 * COUNT
    assert rising > 20


def dips(one, numbers):
    """Check a motion whose gap lets it close by a thousandth of its dip; return whether it dips."""
    growth = one.growth @ numbers
    dip = -growth.min()
    # Dips below the rounding of the states are none
    if dip < 1e-9 * np.abs(numbers[:4]).max() or growth[-1] <= -0.999 * dip:
        return False
    piece = one.piece(numbers, 0.999 * dip)
    assert not stays_open(*piece, False)
    assert clearance_course(*piece) != STAYS_OPEN
    return True


@pytest.mark.compiled
def test_a_piece_that_closes_again_after_contact_does_not_stay_open():
    # catches: too little room after the contact, the rate at the start taken for that at the end
    random, again = np.random.default_rng(10), 0
    for _ in range(COUNT):
        one = LinearPair(random)
        whole = np.vstack([one.rates, one.growth[-1:]])
        flat = one.numbers_with(random, whole, np.zeros(3))
        flat *= -np.sign((one.growth @ flat)[len(INSIDE) // 2])
        dip = -(one.growth @ flat).min()
        # It leaves the contact, and is back before the end, where it is open
        rise = random.choice([0.01, 0.1, 1.0, 3.0, 9.0]) * dip
        values = np.array([rise / (one.share * STEP), 0.0, min(rise, 0.01 * dip)])
        numbers = flat + np.linalg.lstsq(whole, values, rcond=None)[0]
        growth = one.growth @ numbers
        if growth.min() < -1e-9 * np.abs(numbers[:4]).max():
            again += 1
            assert not stays_open(*one.piece(numbers, 0.0), True)
    assert again > 0.3 * COUNT


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
