"""
States of one structure at the samples of a tile, and its exact maxima inside steps.

The steps are those of ``lanes``; the numbers of a lane are copied to one line, ``pair``, row for
row. A state is displacement, velocity over omega and acceleration over omega² (all m). Where a
maximum may be passed between two states the peak is found on the exact solution, a short Taylor
polynomial over the share of a step.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.polynomial_roots import first_fall, is_last_root, value_and_slope
from per_obspy.kernels.pounding_events.motion import (
    EVENT_FUNCTION,
    LARGEST_DISPLACEMENT,
    LARGEST_RADIUS_SQUARED,
    TAYLOR,
    TERM_COUNT,
    fill_taylor,
)
from per_obspy.kernels.pounding_events.next_event import fill_power, fill_velocity
from per_obspy.kernels.pounding_lanes.free_impacts import (
    SIXTH,
    acceleration_rate,
    state_inside_step,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    ACCELERATION,
    ACCELERATION_ERROR,
    ANGLE,
    AXIS_COSINE,
    AXIS_SINE,
    DISPLACEMENT_ERROR,
    POWER_ERROR,
    STEP_DISPLACEMENT,
    STEP_VELOCITY,
    STRUCTURE_ROWS,
    VELOCITY_ERROR,
    YIELD_CENTRE,
    YIELD_LIMIT,
    YIELD_SIDE,
)

#: Share of a step over which a cubic has the largest displacement but for rounding.
NEAR = 3e-4
#: Estimates of the time of a turning point, above which it is left to the polynomials.
MOST_ESTIMATES = 4


@inlined
def _step_value(pair, row, displacement, velocity, ground_start, ground_end):
    """Return displacement or velocity after one step, as ``step_value`` of ``lanes``."""
    form = pair[row + 2] * ground_start + (pair[row + 3] * ground_end + pair[row + 4])
    return pair[row] * displacement + (pair[row + 1] * velocity + form)


@inlined
def ground_along(pair, ground, k):
    """Return the ground acceleration along a pair at a sample of the tile."""
    return pair[AXIS_COSINE] * ground[0, k] + pair[AXIS_SINE] * ground[1, k]


@inlined
def complete_state(pair, first, displacement, velocity, ground):
    """Return the state of a structure: displacement, velocity and acceleration."""
    form = pair[first + ACCELERATION + 2] * ground + pair[first + ACCELERATION + 3]
    acceleration = pair[first + ACCELERATION] * displacement + (
        pair[first + ACCELERATION + 1] * velocity + form
    )
    return displacement, velocity, acceleration


@inlined
def state_after_step(pair, first, state, ground_start, ground_end):
    """Return the state of a structure after a step."""
    u = _step_value(pair, first + STEP_DISPLACEMENT, state[0], state[1], ground_start, ground_end)
    z = _step_value(pair, first + STEP_VELOCITY, state[0], state[1], ground_start, ground_end)
    return complete_state(pair, first, u, z, ground_end)


@inlined
def may_yield(pair, first, start, end):
    """Return whether a structure may yield or unload between two states at most a step apart."""
    u0, z0, y0 = start
    u1, z1, y1 = end
    strength = max(abs(y0), abs(y1))
    side = pair[first + YIELD_SIDE]
    centre = pair[first + YIELD_CENTRE]
    # yielding: the velocity may change its sign
    if side != 0.0:
        return min(side * z0, side * z1) < pair[first + VELOCITY_ERROR] * strength
    # elastic: the displacement may leave the elastic range
    distance = max(abs(u0 - centre), abs(u1 - centre))
    return distance + pair[first + DISPLACEMENT_ERROR] * strength > pair[first + YIELD_LIMIT]


@inlined
def raise_maxima(pair, row, i, start, end, change, share):
    """
    Raise the maxima of structure i to those of a piece of a step, exact between its ends.

    ``start`` and ``end`` are states this ``share`` of a step apart; over a complete step the ground
    changes by ``change``. The radius grows with the angle by the power p = u'' + omega² u at most,
    which in a step is within its chord and its error bound: by ``growth`` from a root to the nearer
    end. And its square by growth (2 r + growth), with r below |u| + |z|. The errors of displacement
    and power grow at least as fast as the share.

    Most motion is far below its maxima. No displacement exceeds the radius, and the power changes
    by ``2 r + 2 strength`` at most, with the larger radius r and the larger acceleration of both
    ends: that bounds ``growth`` from above.
    """
    first = i * STRUCTURE_ROWS
    u0, z0, y0 = start
    u1, z1, y1 = end
    strength = max(abs(y0), abs(y1))
    radius_squared = max(u0 * u0 + z0 * z0, u1 * u1 + z1 * z1)
    # far below the maxima
    quarter = 0.25 * share * pair[first + ANGLE]
    widening = 1.0 + quarter
    by_strength = quarter * (1.0 + 4.0 * share * pair[first + POWER_ERROR])
    room = row[i, LARGEST_DISPLACEMENT] - by_strength * strength
    if not ((room > 0.0) & (widening * widening * radius_squared < room * room)):
        # to both ends, then between them
        _raise_nearby(pair, row, i, start, end, change, share)


@inlined
def _raise_to_ends(pair, row, i, start, end, share):
    """
    Raise the maxima of structure i to two states.

    Return whether its displacement may turn, and its radius, beyond them in between.
    """
    first = i * STRUCTURE_ROWS
    u0, z0, y0 = start
    u1, z1, y1 = end
    strength = max(abs(y0), abs(y1))
    radius_squared = max(u0 * u0 + z0 * z0, u1 * u1 + z1 * z1)
    # maxima at the states
    reach = max(abs(u0), abs(u1))
    largest = max(row[i, LARGEST_DISPLACEMENT], reach)
    largest_squared = max(row[i, LARGEST_RADIUS_SQUARED], radius_squared)
    row[i, LARGEST_DISPLACEMENT] = largest
    row[i, LARGEST_RADIUS_SQUARED] = largest_squared
    # the displacement turns where the velocity, within its error, has a root
    velocity_error = 2.0 * share * pair[first + VELOCITY_ERROR] * strength
    turns = abs(z0 + z1) <= abs(z1 - z0) + velocity_error
    turns &= reach + share * share * pair[first + DISPLACEMENT_ERROR] * strength > largest
    # the radius turns where the power, within its error, has a root; what it grows by from there
    power_change = abs((u1 + y1) - (u0 + y0))
    power_error = share * pair[first + POWER_ERROR] * strength
    growth = 0.125 * share * pair[first + ANGLE] * (power_change + 8.0 * power_error)
    widens = abs(u0 + u1 + y0 + y1) <= power_change + 2.0 * power_error
    twice_radius = 2.0 * max(abs(u0) + abs(z0), abs(u1) + abs(z1))
    widens &= radius_squared + growth * (twice_radius + growth) > largest_squared
    return turns, widens


@lean
def _raise_nearby(pair, row, i, start, end, change, share):
    """Raise the maxima of structure i to those of a piece that may hold larger ones."""
    turns, widens = _raise_to_ends(pair, row, i, start, end, share)
    if turns | widens:
        _raise_inside(pair, row, i, start, end, change, share, turns, widens)


@inlined
def _accelerates_one_way(pair, first, start, end):
    """Return whether the acceleration has one sign between two states, by the bound of its rest."""
    bend = pair[first + ACCELERATION_ERROR] * max(abs(start[2]), abs(end[2]))
    return (min(start[2], end[2]) > bend) | (max(start[2], end[2]) < -bend)


@inlined
def _first_estimate(angle, start, end, rate, share):
    """
    Return where a velocity is zero, by the cubic with its first two rates and both ends.

    One step of Newton with curvature, from the chord.
    """
    slope = angle * start[2]
    bend = 0.5 * angle * rate
    chord = (end[1] - start[1]) / share
    twist = (chord - slope - share * bend) / (share * share)
    time = -start[1] / chord
    # value, rate and half the second rate there
    here = start[1] + time * (slope + time * (bend + time * twist))
    inverse = 1.0 / (slope + time * (2.0 * bend + time * 3.0 * twist))
    step = -here * inverse
    better = time + step - step * step * (bend + 3.0 * time * twist) * inverse
    return better if 0.0 < better < share else time


@lean
def turning_point(pair, row, i, start, end, change, share):
    """
    Return the displacement at which structure i turns between two states.

    Parameters
    ----------
    pair : (LANE_ROWS,) ndarray
        Numbers of its lane; see `lanes` for its rows.
    row : (n_structures, ROW_COLUMNS) ndarray
        Its row of structures; see `motion` for its columns.
    i : int
        Number of the structure.
    start, end : tuple of float
        Both states.
    change : float
        Change of the ground acceleration over a complete step, m/s².
    share : float
        Time between both states, as a share of the step.

    Returns
    -------
    float
        The displacement, m; that at the start where the structure certainly does not turn; NaN
        where neither is certain.
    """
    first = i * STRUCTURE_ROWS
    if not _accelerates_one_way(pair, first, start, end):
        return math.nan
    # the velocity rises or falls all through: its signs at the ends decide
    if start[1] * end[1] >= 0.0:
        return start[0]
    angle = pair[first + ANGLE]
    rate = acceleration_rate(pair, first, start, change)
    time = _first_estimate(angle, start, end, rate, share)
    for _ in range(MOST_ESTIMATES):
        # state at the estimate, and Newton's step with curvature from there
        u, z, y = state_inside_step(pair, row, i, start, change, time)
        rate = acceleration_rate(pair, first, (u, z, y), change)
        first_order = -z / (angle * y)
        step = first_order - 0.5 * first_order * first_order * rate / y
        time += step
        # the series holds inside the piece only
        if not 0.0 <= time <= share:
            break
        # both terms: where the acceleration vanishes they may cancel far from a root
        if max(abs(first_order), abs(step)) <= NEAR:
            return u + angle * step * (z + angle * step * (0.5 * y + SIXTH * step * rate))
    return math.nan


@lean
def _raise_inside(pair, row, i, start, end, change, share, turns, widens):
    """Raise the maxima of structure i to those at roots of the velocity, and of the power."""
    first = i * STRUCTURE_ROWS
    terms = int(row[0, TERM_COUNT])
    angle = pair[first + ANGLE]
    # a displacement that turns once
    if turns:
        turn = turning_point(pair, row, i, start, end, change, share)
        if not math.isnan(turn):
            row[i, LARGEST_DISPLACEMENT] = max(row[i, LARGEST_DISPLACEMENT], abs(turn))
            row[i, LARGEST_RADIUS_SQUARED] = max(row[i, LARGEST_RADIUS_SQUARED], turn * turn)
            turns = False
    # maxima at the other roots
    if turns | widens:
        fill_displacement_in_step(pair, row, 0, first, start, change)
    if turns:
        fill_velocity(row, 0, terms)
        _raise_maxima_at_roots(row, i, terms - 1, angle, share)
    if widens:
        fill_power(row, 0, angle * angle, 0.0, terms)
        _raise_maxima_at_roots(row, i, terms - 2, angle, share)


@lean
def fill_displacement_in_step(pair, row, line, first, state, change):
    """Fill a line's Taylor coefficients of the displacement after a state, by shares of a step."""
    terms = int(row[0, TERM_COUNT])
    angle = pair[first + ANGLE]
    square = angle * angle
    # equation of motion with time as the share of a step
    velocity = angle * state[1]
    damping = -angle * pair[first + ACCELERATION + 1]
    stiffness = -square * pair[first + ACCELERATION]
    force = square * state[2] + damping * velocity
    force_rate = square * pair[first + ACCELERATION + 2] * change
    row[line, TAYLOR] = state[0]
    fill_taylor(row, line, TAYLOR, terms, velocity, damping, stiffness, force, force_rate)


@lean
def _raise_maxima_at_roots(row, i, function_terms, angle, share):
    """Raise the maxima of structure i at the roots of line 0's event function within a share."""
    # sign of the function just after the start
    value, slope = value_and_slope(row, 0, EVENT_FUNCTION, function_terms, 0.0)
    sign = 1.0 if value > 0.0 or (value == 0.0 and slope > 0.0) else -1.0
    # roots one after another; the sign changes at each
    time = first_fall(row, 0, EVENT_FUNCTION, function_terms, sign, 0.0, share, 0.0)
    while time >= 0.0:
        u, z = value_and_slope(row, 0, TAYLOR, int(row[0, TERM_COUNT]), time)
        z /= angle
        row[i, LARGEST_DISPLACEMENT] = max(row[i, LARGEST_DISPLACEMENT], abs(u))
        row[i, LARGEST_RADIUS_SQUARED] = max(row[i, LARGEST_RADIUS_SQUARED], u * u + z * z)
        if is_last_root(row, 0, EVENT_FUNCTION, function_terms, time, share):
            return
        sign = -sign
        time = first_fall(row, 0, EVENT_FUNCTION, function_terms, sign, time, share, 0.0)


@inlined
def search_tile(pair, row, i, displacement, velocity, ground, count):
    """Raise the maxima of structure i to those of a tile without events, from its start on."""
    first = i * STRUCTURE_ROWS
    ground_start = ground_along(pair, ground, 0)
    state = complete_state(pair, first, displacement, velocity, ground_start)
    # step by step
    for k in range(1, count + 1):
        ground_end = ground_along(pair, ground, k)
        after = state_after_step(pair, first, state, ground_start, ground_end)
        raise_maxima(pair, row, i, state, after, ground_end - ground_start, 1.0)
        state = after
        ground_start = ground_end
