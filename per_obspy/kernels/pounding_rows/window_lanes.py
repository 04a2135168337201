"""
Motion of the buildings of a row in a window of a step, side by side as SIMD lanes.

In so short a time the displacement of a building is a polynomial of few terms, and so is the
clearance after it, whose first fall through zero is the next impact. All buildings are moved to
every event. Each function is one loop over eight lanes of one array, row by row, so that it
vectorises; a row of more buildings takes several, with the array from its first lane on. The
constants below are the rows of this array.
"""

import math

from per_obspy.kernels._jit import inlined, lean, vectorised
from per_obspy.kernels.pounding_events.motion import (
    GAP,
    GAP_ROUNDING,
    LARGEST_DISPLACEMENT,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    ACCELERATION,
    ANGLE,
    PAIR_LANES,
    POWER_ERROR,
    STRUCTURE_ROWS,
)

#: Lanes of one loop.
WIDTH = 8
#: Taylor terms in a window, and the product of rate and duration x up to which ``x**terms /
#: terms!`` is below TRUNCATION of ``motion``.
WINDOW_TERMS, WINDOW_REACH = 12, 0.167

# rows of a building
#: displacement, velocity over omega and acceleration over omega² (m) now, and before the last move
NOW, BEFORE = 0, 3
#: coefficients of the acceleration (four), angle of a step, error bound of the power
BY_STATE, STEP_ANGLE, ERROR = 6, 10, 11
#: reciprocal of the angle of a step; largest displacement so far (m)
PER_ANGLE, LARGEST = 12, 13
#: 1 where the building may have passed its maxima in the last move
MAY_EXCEED = 14
# rows of the interface after it
#: gap (m)
CLEAR = 15
#: 1 where both have just met and part, 2 where they touch without speed, else 0
MET = 16
#: what bounds show of it in the window
COURSE = 17
#: It stays open in the window, it closes once, or bounds do not show it.
OPEN, ONCE, UNKNOWN = 0.0, 1.0, 2.0
#: Taylor coefficients of the displacement and of the clearance
POLYNOMIAL, CLEARANCE = 18, 18 + WINDOW_TERMS
WINDOW_ROWS = 18 + 2 * WINDOW_TERMS
#: The lane after the last one is read too.
WINDOW_SIZE = WINDOW_ROWS * PAIR_LANES + WIDTH
#: Corrections of a root, and the largest one, over the times to the root and to the top of the
#: parabola, after which it is exact: what remains is about its third power.
MOST_CORRECTIONS, LAST_CORRECTION = 10, 1e-5


@lean
def at(row, lane):
    """Return the index of a row of a lane."""
    return row * PAIR_LANES + lane


@vectorised
def fill_polynomials(window, ground, change):
    """Fill acceleration and polynomial of buildings under a ground acceleration and its change."""
    for i in range(WIDTH):
        u = window[at(NOW, i)]
        z = window[at(NOW + 1, i)]
        by_displacement = window[at(BY_STATE, i)]
        by_velocity = window[at(BY_STATE + 1, i)]
        by_ground = window[at(BY_STATE + 2, i)]
        angle = window[at(STEP_ANGLE, i)]
        # acceleration and its rate per step
        y = by_displacement * u + (
            by_velocity * z + (by_ground * ground + window[at(BY_STATE + 3, i)])
        )
        rate = angle * (by_displacement * z + by_velocity * y) + by_ground * change
        window[at(NOW + 2, i)] = y
        # coefficients over shares of the step
        square = angle * angle
        damping = angle * by_velocity
        stiffness = square * by_displacement
        window[at(POLYNOMIAL, i)] = u
        window[at(POLYNOMIAL + 1, i)] = angle * z
        before = 0.5 * square * y
        last = (1.0 / 6.0) * square * rate
        window[at(POLYNOMIAL + 2, i)] = before
        window[at(POLYNOMIAL + 3, i)] = last
        # free vibration of the acceleration
        for n in range(4, WINDOW_TERMS):
            following = damping * (1.0 / n) * last + stiffness * (1.0 / (n * (n - 1))) * before
            before = last
            last = following
            window[at(POLYNOMIAL + n, i)] = last


@vectorised
def fill_clearances(window):
    """Fill the polynomials of the clearances after buildings."""
    for i in range(WIDTH):
        for n in range(WINDOW_TERMS):
            right = window[at(POLYNOMIAL + n, i + 1)]
            window[at(CLEARANCE + n, i)] = right - window[at(POLYNOMIAL + n, i)]
        # with the gap; zero where both have just met
        value = window[at(CLEARANCE, i)] + window[at(CLEAR, i)]
        window[at(CLEARANCE, i)] = 0.0 if window[at(MET, i)] > 0.0 else value


@vectorised
def find_courses(window, room):
    """
    Find whether clearances fall through zero within a room, as far as bounds show it.

    A clearance lies above its parabola with the least second derivative. If that, or the rate, has
    one sign all through, it falls once at most if it starts open and ends closed; one that is
    concave, or falls, stays open if it ends open.
    """
    for i in range(WIDTH):
        # first coefficients
        value = window[at(CLEARANCE, i)]
        slope = window[at(CLEARANCE + 1, i)]
        bend = window[at(CLEARANCE + 2, i)]
        # bound of the second derivative beyond its start, and value at the end
        twist = 0.0
        for n in range(WINDOW_TERMS - 1, 2, -1):
            twist = twist * room + (n * (n - 1.0)) * abs(window[at(CLEARANCE + n, i)])
        twist *= room
        end = 0.0
        for n in range(WINDOW_TERMS - 1, -1, -1):
            end = end * room + window[at(CLEARANCE + n, i)]
        size = abs(window[at(NOW, i)]) + abs(window[at(NOW, i + 1)]) + window[at(CLEAR, i)]
        rounding = GAP_ROUNDING * size
        # whether it is certainly open just after the start
        has_met = (window[at(MET, i)] == 1.0) & (slope > 0.0)
        starts_open = (value > rounding) | has_met
        # least and largest second derivative and rate
        least = 2.0 * bend - twist
        largest = 2.0 * bend + twist
        slowest = slope + room * min(least, 0.0)
        fastest = slope + room * max(largest, 0.0)
        # the parabola stays above zero, or the rate does
        low = value + room * (slope + 0.5 * room * least)
        is_low = (least > 0.0) & (slope < 0.0) & (slope + room * least > 0.0)
        is_high = 2.0 * least * (value - rounding) > slope * slope
        is_open = (low > rounding) & (value > rounding) & ((not is_low) | is_high)
        is_open = is_open | (starts_open & (slowest > 0.0))
        is_open = is_open | (has_met & (slope + 0.5 * room * least > 0.0))
        # it falls once at most: its value at the end decides
        is_single = (largest < 0.0) | (fastest < 0.0)
        is_open = is_open | (starts_open & is_single & (end > rounding))
        is_once = starts_open & (is_single | (least > 0.0)) & (end < 0.0)
        course = ONCE if is_once else UNKNOWN
        window[at(COURSE, i)] = OPEN if is_open else course


@inlined
def closing_share(window, j, room):
    """
    Return when a clearance that closes once in a room falls through zero.

    By Newton's steps with curvature from the root of its parabola; -1 if these do not end.
    """
    # root of the parabola
    value = window[at(CLEARANCE, j)]
    slope = window[at(CLEARANCE + 1, j)]
    bend = window[at(CLEARANCE + 2, j)]
    twist = 3.0 * window[at(CLEARANCE + 3, j)]
    root = math.sqrt(max(slope * slope - 4.0 * bend * value, 0.0))
    time = 2.0 * value / (root - slope) if slope <= 0.0 else -0.5 * (slope + root) / bend
    for _ in range(MOST_CORRECTIONS):
        # even and odd powers side by side
        square = time * time
        even = odd = even_rate = odd_rate = 0.0
        for n in range(WINDOW_TERMS - 2, -1, -2):
            even_rate = even_rate * square + even
            odd_rate = odd_rate * square + odd
            even = even * square + window[at(CLEARANCE + n, j)]
            odd = odd * square + window[at(CLEARANCE + n + 1, j)]
        here = even + time * odd
        # Newton's step with curvature
        inverse = 1.0 / (odd + 2.0 * time * (even_rate + time * odd_rate))
        step = -here * inverse
        half = (bend + twist * time) * inverse
        step -= step * step * half
        time += step
        if not 0.0 < time <= room:
            break
        if abs(step) * (1.0 + abs(half) * time) <= LAST_CORRECTION * time:
            return time
    return -1.0


@vectorised
def move_buildings(window, share, ground):
    """Move buildings by a share of the step, and find whether they may pass their maxima in it."""
    for i in range(WIDTH):
        # polynomial and its rate, by Horner's rule
        u = rate = 0.0
        for n in range(WINDOW_TERMS - 1, -1, -1):
            rate = rate * share + u
            u = u * share + window[at(POLYNOMIAL + n, i)]
        z = rate * window[at(PER_ANGLE, i)]
        # acceleration
        y = window[at(BY_STATE, i)] * u + (
            window[at(BY_STATE + 1, i)] * z
            + (window[at(BY_STATE + 2, i)] * ground + window[at(BY_STATE + 3, i)])
        )
        # far below the maxima, as in ``may_exceed``
        u0 = window[at(NOW, i)]
        z0 = window[at(NOW + 1, i)]
        y0 = window[at(NOW + 2, i)]
        strength = max(abs(y0), abs(y))
        radius_squared = max(u0 * u0 + z0 * z0, u * u + z * z)
        quarter = 0.25 * share * window[at(STEP_ANGLE, i)]
        widening = 1.0 + quarter
        by_strength = quarter * (1.0 + 4.0 * share * window[at(ERROR, i)])
        room = window[at(LARGEST, i)] - by_strength * strength
        is_below = (room > 0.0) & (widening * widening * radius_squared < room * room)
        window[at(MAY_EXCEED, i)] = 0.0 if is_below else 1.0
        # both states; no clearance is zero any longer
        window[at(BEFORE, i)] = u0
        window[at(BEFORE + 1, i)] = z0
        window[at(BEFORE + 2, i)] = y0
        window[at(NOW, i)] = u
        window[at(NOW + 1, i)] = z
        window[at(NOW + 2, i)] = y
        window[at(MET, i)] = 0.0


@lean
def load_buildings(members, row, window):
    """Copy what does not change inside a window: equations, gaps and maxima."""
    for i in range(row.shape[0]):
        # equation of motion
        own = i * STRUCTURE_ROWS
        for k in range(4):
            window[at(BY_STATE + k, i)] = members[own + ACCELERATION + k]
        window[at(STEP_ANGLE, i)] = members[own + ANGLE]
        window[at(PER_ANGLE, i)] = 1.0 / members[own + ANGLE]
        window[at(ERROR, i)] = members[own + POWER_ERROR]
        window[at(LARGEST, i)] = row[i, LARGEST_DISPLACEMENT]
        window[at(CLEAR, i)] = row[i, GAP]
