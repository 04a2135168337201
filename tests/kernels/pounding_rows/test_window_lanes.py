"""
Motion in a window of a step, against matrix exponentials and polynomials at many times.

Covers ``per_obspy.kernels.pounding_rows.window_lanes``.
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm
from scipy.optimize import brentq

from per_obspy.kernels.pounding_events import motion as columns
from per_obspy.kernels.pounding_lanes.lanes import LARGEST_RATE, PAIR_LANES, STRUCTURE_ROWS
from per_obspy.kernels.pounding_lanes.maxima_in_step import raise_maxima
from per_obspy.kernels.pounding_lanes.phases import write_constants
from per_obspy.kernels.pounding_rows import window_lanes as window_rows

STEP, COUNT, TERMS = 0.02, 400, window_rows.WINDOW_TERMS
#: Times at which a motion inside a piece is looked at, as shares of the piece.
INSIDE = np.linspace(0.0, 1.0, 401)


class Buildings:
    """Random elastic buildings in a window, all in motion."""

    def __init__(self, random, count=8):
        self.row = np.zeros((count, columns.ROW_COLUMNS))
        self.members = np.zeros(count * STRUCTURE_ROWS)
        self.omega = random.uniform(1.0, 30.0, count)
        row = self.row
        row[:, columns.DAMPING_RATE] = random.uniform(0.0, 0.2, count) * self.omega
        row[:, columns.STIFFNESS], row[:, columns.YIELD] = self.omega**2, np.inf
        row[:, columns.MASS], row[:, columns.PARTICIPATION] = 1.0, random.uniform(0.5, 2.0, count)
        write_constants(self.members, row, 1.0, 0.0, STEP)
        # Their states, and a ground acceleration with its change over a step
        self.u, self.z = random.normal(0.0, 0.02, (2, count))
        self.ground, self.change = random.normal(size=2)
        self.longest = window_rows.WINDOW_REACH / self.members[LARGEST_RATE]
        self.window = np.zeros(window_rows.WINDOW_SIZE)
        window_rows.load_buildings(self.members, row, self.window)
        self.lanes(window_rows.NOW)[:count] = self.u
        self.lanes(window_rows.NOW + 1)[:count] = self.z
        window_rows.fill_polynomials(self.window, self.ground, self.change)

    def lanes(self, row):
        """Return all lanes of a row of the window."""
        return self.window[row * PAIR_LANES : (row + 1) * PAIR_LANES]

    def exact(self, i, share):
        """Return displacement, velocity over omega and acceleration over omega² at a share."""
        omega, rate, q = self.omega[i], *self.row[i, [columns.DAMPING_RATE, columns.PARTICIPATION]]
        system = np.zeros((4, 4))
        system[0, 1] = system[2, 3] = 1.0
        system[1] = -(omega**2), -2.0 * rate, -q, 0.0
        start = self.u[i], self.z[i] * omega, self.ground, self.change / STEP
        end = expm(system * share * STEP) @ start
        return end[0], end[1] / omega, (system @ end)[1] / omega**2


def test_the_window_is_as_long_as_its_terms_allow():
    # catches: a window whose polynomials are cut off too early
    left_out = window_rows.WINDOW_REACH**TERMS / math.factorial(TERMS)
    assert 0.9 * columns.TRUNCATION < left_out < columns.TRUNCATION


def test_buildings_move_as_their_equation():
    # catches: a coefficient of the polynomial, the ground at the wrong time, an angle for its
    # reciprocal
    random = np.random.default_rng(1)
    for _ in range(20):
        some = Buildings(random)
        share = min(some.longest, 1.0) * random.uniform(0.1, 1.0)
        expected = np.array([some.exact(i, share) for i in range(8)])
        ground = some.ground + share * some.change
        window_rows.move_buildings(some.window, share, ground)
        for k in range(3):
            # the acceleration over omega² of slow buildings is as large as 1 m
            assert_allclose(some.lanes(window_rows.NOW + k)[:8], expected[:, k], atol=1e-13)


def test_no_maximum_is_left_out():
    # catches: a bound of the radius that is too small or belongs to a complete step
    random, found = np.random.default_rng(2), 0
    for _ in range(40):
        some = Buildings(random)
        share = min(some.longest, 1.0) * random.choice([0.01, 0.3, 1.0])
        radius = np.array([[np.hypot(*some.exact(i, share * s)[:2]) for s in INSIDE[::20]]
                           for i in range(8)]).max(axis=1)  # fmt: skip
        some.lanes(window_rows.LARGEST)[:8] = radius * random.choice([1.0 - 1e-9, 3.0], 8)
        window_rows.move_buildings(some.window, share, some.ground + share * some.change)
        may_exceed = some.lanes(window_rows.MAY_EXCEED)[:8] == 1.0
        exceeds = some.lanes(window_rows.LARGEST)[:8] < radius
        assert may_exceed[exceeds].all()
        found += np.count_nonzero(~may_exceed)
    # most of those far below are recognised
    assert found > 0.25 * 40 * 8


def test_maxima_in_a_piece():
    # catches: errors that shrink faster than those of the piece, a root that is not looked for
    random, inside = np.random.default_rng(3), np.zeros(2)
    for _ in range(60):
        some = Buildings(random, 1)
        some.z *= 0.05
        share = random.choice([0.02, 0.3, 1.0])
        states = np.array([some.exact(0, share * s) for s in INSIDE])
        u, radius = np.abs(states[:, 0]).max(), np.hypot(states[:, 0], states[:, 1]).max()
        # Maxima so far just below those of the piece
        some.row[0, columns.LARGEST_DISPLACEMENT] = (1.0 - 1e-9) * u
        some.row[0, columns.LARGEST_RADIUS_SQUARED] = (1.0 - 1e-9) * radius**2
        start, end = tuple(states[0]), tuple(states[-1])
        raise_maxima(some.members, some.row, 0, start, end, some.change, share)
        # 400 times miss a maximum by an eighth of their squared distance
        assert some.row[0, columns.LARGEST_DISPLACEMENT] == pytest.approx(u, rel=1e-5)
        assert some.row[0, columns.LARGEST_DISPLACEMENT] >= u * (1.0 - 1e-13)
        assert some.row[0, columns.LARGEST_RADIUS_SQUARED] >= radius**2 * (1.0 - 1e-13)
        ends = states[[0, -1]]
        inside += u > np.abs(ends[:, 0]).max(), radius > np.hypot(ends[:, 0], ends[:, 1]).max()
    assert (inside > 5).all()


def solve_for(some, share, wanted):
    """Set the state of one building, and the ground, to a start and a velocity at the end."""
    found = []
    # The motion is linear in displacement, velocity and the ground at the start and its change
    for unit in np.eye(4):
        some.u[0], some.z[0], some.ground, some.change = unit
        start, end = some.exact(0, 0.0), some.exact(0, share)
        found.append([start[0], start[1], start[2], end[1]])
    numbers = np.linalg.solve(np.transpose(found), wanted)
    some.u[0], some.z[0], some.ground, some.change = numbers


def test_a_building_that_turns_twice_in_a_piece():
    # catches: a velocity that is taken for its chord
    random = np.random.default_rng(7)
    for share in (0.1, 1.0):
        some = Buildings(random, 1)
        angle = share * STEP * some.omega[0]
        slow = 0.1 * angle * 0.02
        # Velocities are alike at both ends, and reversed in between
        solve_for(some, share, [0.03, slow, -0.02, slow])
        states = np.array([some.exact(0, share * s) for s in INSIDE])
        start, end = tuple(states[0]), tuple(states[-1])
        some.row[0, columns.LARGEST_DISPLACEMENT] = start[0]
        raise_maxima(some.members, some.row, 0, start, end, some.change, share)
        largest = states[:, 0].max()
        assert largest > (1.0 + 1e-9) * start[0]
        assert some.row[0, columns.LARGEST_DISPLACEMENT] >= largest * (1.0 - 1e-13)


def test_a_radius_that_is_largest_inside_is_not_left_out():
    # catches: a bound of the radius without the acceleration
    random = np.random.default_rng(8)
    for fraction in (0.1, 1.0):
        some = Buildings(random, 1)
        share = fraction * min(some.longest, 1.0)
        angle = share * STEP * some.omega[0]
        # It is as fast at the end as at the start, and faster in between
        solve_for(some, share, [-0.5 * angle * 0.05, 0.05, 0.5, 0.05])
        radius = np.array([np.hypot(*some.exact(0, share * s)[:2]) for s in INSIDE])
        assert radius.max() > (1.0 + 1e-6) * max(radius[0], radius[-1])
        some.lanes(window_rows.NOW)[0], some.lanes(window_rows.NOW + 1)[0] = some.u[0], some.z[0]
        window_rows.fill_polynomials(some.window, some.ground, some.change)
        some.lanes(window_rows.LARGEST)[0] = (1.0 - 1e-9) * radius.max()
        window_rows.move_buildings(some.window, share, some.ground + share * some.change)
        assert some.lanes(window_rows.MAY_EXCEED)[0] == 1.0


def polynomial_of(random, room):
    """Return the coefficients of a random clearance whose terms are of like size in a room."""
    powers = room ** np.arange(TERMS)
    size = 10.0 ** random.uniform(-3.0, 0.0, TERMS) * 0.3 ** np.arange(TERMS)
    return random.normal(size=TERMS) * size / powers


def course_of(polynomial, room, has_met):
    """Return what bounds show of a clearance, in a window of it alone, and the window."""
    window = np.zeros(window_rows.WINDOW_SIZE)
    window[window_rows.CLEARANCE * PAIR_LANES :: PAIR_LANES][:TERMS] = polynomial
    window[window_rows.MET * PAIR_LANES] = has_met
    window_rows.find_courses(window, room)
    return window[window_rows.COURSE * PAIR_LANES], window


def values_of(polynomial, room):
    """Return a clearance at many times of a room."""
    return np.polynomial.polynomial.polyval(INSIDE * room, polynomial)


@pytest.mark.parametrize("has_met", [0.0, 1.0])
def test_the_course_of_a_clearance(has_met):
    # catches: concave for convex, a bound without one of its terms, a value that is not the last
    random, courses = np.random.default_rng(4), []
    for _ in range(5 * COUNT):
        room = 10.0 ** random.uniform(-3.0, 0.0)
        polynomial = polynomial_of(random, room)
        polynomial[0] = 0.0 if has_met else abs(polynomial[0])
        polynomial[1] = abs(polynomial[1]) if has_met else polynomial[1]
        course, window = course_of(polynomial, room, has_met)
        values = values_of(polynomial, room)[1:]
        if course == window_rows.OPEN:
            assert values.min() > 0.0
        if course == window_rows.ONCE:
            assert np.count_nonzero(np.diff(values > 0.0)) <= 1
            assert values[-1] < 0.0
            share = window_rows.closing_share(window, 0, room)
            root = brentq(np.polynomial.Polynomial(polynomial), 1e-9 * room, room, xtol=1e-15)
            assert share == pytest.approx(root, rel=1e-11, abs=1e-14)
        courses.append(int(course))
    # all of them happen, and few stay uncertain
    counts = np.bincount(courses, minlength=3)
    assert counts.min() > 20
    assert counts[int(window_rows.UNKNOWN)] < 0.5 * counts.sum()


def test_a_clearance_that_just_closes_inside_does_not_stay_open():
    # catches: bounds of the second derivative, of the rate or of the value that are too tight
    random, found = np.random.default_rng(5), 0
    for _ in range(5 * COUNT):
        room = 10.0 ** random.uniform(-3.0, 0.0)
        polynomial = polynomial_of(random, room)
        # a parabola, or one without, that the other terms bend
        polynomial[3:] *= random.choice([0.0, 1.0])
        least = values_of(polynomial, room).min()
        dip = polynomial[0] - least
        polynomial[0] += -least - 1e-6 * dip
        if dip > 0.0:
            found += 1
            assert course_of(polynomial, room, 0.0)[0] != window_rows.OPEN
    assert found > COUNT


def test_a_clearance_that_closes_and_opens_again_does_not_close_once():
    # catches: the value at the end taken for all that happens before
    room = 0.1
    for sign in (1.0, -1.0):
        roots = np.polynomial.polynomial.polyfromroots([0.2 * room, 0.5 * room, 0.8 * room])
        polynomial = np.zeros(TERMS)
        polynomial[:4] = sign * roots
        course, _ = course_of(polynomial, room, 0.0)
        assert course == window_rows.UNKNOWN


def test_clearances_are_those_to_the_next_building():
    # catches: the building on the left, a gap left out, a clearance that is not zero after contact
    some = Buildings(np.random.default_rng(6))
    some.lanes(window_rows.CLEAR)[:8] = 0.5
    some.lanes(window_rows.MET)[2] = 1.0
    window_rows.fill_clearances(some.window)
    first = some.lanes(window_rows.CLEARANCE)[:7]
    expected = 0.5 + np.diff(some.u)
    expected[2] = 0.0
    assert_allclose(first, expected, rtol=1e-15)
    rates = some.lanes(window_rows.CLEARANCE + 1)[:7] / STEP
    assert_allclose(rates, np.diff(some.z * some.omega), rtol=1e-12, atol=1e-12)
