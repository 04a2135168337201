"""
Fast path for the steps of a free pair in which its structures yield or unload.

Away from contact each structure moves on its own. Where bounds show that it changes its stiffness
once in the rest of a step, or not at all, the change is located on the exact solution. Everything
else is left to the event code of single histories, from the start of the step on.
"""

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.pounding_events.motion import (
    GAP_ROUNDING,
    LARGEST_DISPLACEMENT,
    LARGEST_RADIUS_SQUARED,
    PHASE,
    PLASTIC,
    UNLOADING,
    YIELD,
)
from per_obspy.kernels.pounding_lanes.free_impacts import (
    LAST_SHARE,
    MOST_CORRECTIONS,
    SIXTH,
    UNCERTAIN,
    acceleration_rate,
    state_inside_step,
    step_to_root,
)
from per_obspy.kernels.pounding_lanes.impact_steps import set_states
from per_obspy.kernels.pounding_lanes.lanes import (
    ACCELERATION,
    ACCELERATION_ERROR,
    ANGLE,
    DISPLACEMENT_ERROR,
    STRUCTURE_ROWS,
    VELOCITY_ERROR,
    YIELD_CENTRE,
    YIELD_LIMIT,
    YIELD_SIDE,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    may_yield,
    raise_maxima,
)
from per_obspy.kernels.pounding_lanes.phases import write_branch

#: Predictions for a structure in a piece of a step besides UNCERTAIN: the last two change its
#: stiffness.
STAYS, CHANGES_ONCE, CHANGES_NOW = 1, 2, 3
#: Changes of stiffness in one step, above which it is left to the event code.
MOST_CHANGES = 4
#: Angle over which a motion is cubic but for rounding: its fourth power over 24 is 4e-18.
CUBIC_ANGLE = 1e-4
#: Share of a step before its end within which a change is left to the event code.
END_ROUNDING = 1e-12


@inlined
def _predict_unloading(pair, first, start, end):
    """Predict the velocity of a yielding structure, towards its side, in a piece of a step."""
    side = pair[first + YIELD_SIDE]
    speed = side * start[1]
    # its rate leaves those at the ends by ``bend`` at most
    rate = side * start[2]
    end_rate = side * end[2]
    bend = pair[first + ACCELERATION_ERROR] * max(abs(rate), abs(end_rate))
    if (min(rate, end_rate) > bend) & (speed >= 0.0):
        return STAYS
    if max(rate, end_rate) >= -bend:
        return UNCERTAIN
    # it falls all through: its signs at the ends decide
    if speed <= 0.0:
        return CHANGES_NOW
    return CHANGES_ONCE if side * end[1] < 0.0 else STAYS


@inlined
def _nearer_side(pair, first, start, end):
    """Return the side of the elastic range to which two states are nearer."""
    return 1.0 if 0.5 * (start[0] + end[0]) > pair[first + YIELD_CENTRE] else -1.0


@inlined
def _predict_yielding(pair, first, start, end, share):
    """
    Predict the distance of an elastic structure to the nearer end of its range in a piece.

    Its rate leaves its chord by ``error`` at most, and the rate of that its ends by ``bend``: the
    distance is convex or concave where that has one sign.
    """
    side = _nearer_side(pair, first, start, end)
    limit = pair[first + YIELD_LIMIT]
    centre = pair[first + YIELD_CENTRE]
    strength = max(abs(start[2]), abs(end[2]))
    # the other end of the range is too far away
    other = limit + side * (0.5 * (start[0] + end[0]) - centre) - 0.5 * abs(end[0] - start[0])
    if other <= pair[first + DISPLACEMENT_ERROR] * strength:
        return UNCERTAIN
    # shape of the distance
    bend = pair[first + ACCELERATION_ERROR] * strength
    is_convex = max(side * start[2], side * end[2]) + bend < 0.0
    is_concave = min(side * start[2], side * end[2]) - bend > 0.0
    error = share * pair[first + VELOCITY_ERROR] * strength
    # it grows all through
    rate = -side * start[1]
    end_rate = -side * end[1]
    if (
        (min(rate, end_rate) > error)
        | (is_convex & (rate >= 0.0))
        | (is_concave & (end_rate >= 0.0))
    ):
        return STAYS
    # or it falls all through
    falls = (
        (max(rate, end_rate) < -error)
        | (is_concave & (rate < 0.0))
        | (is_convex & (end_rate < 0.0))
    )
    # its signs at the ends decide
    if limit - side * (start[0] - centre) <= GAP_ROUNDING * (limit + abs(start[0])):
        return CHANGES_NOW if falls else UNCERTAIN
    if limit - side * (end[0] - centre) < 0.0:
        return CHANGES_ONCE if falls | is_concave | is_convex else UNCERTAIN
    return STAYS if falls | is_concave else UNCERTAIN


@inlined
def predict_change(pair, first, start, end, share):
    """Predict the stiffness of a structure between two states, a share of a step apart."""
    if not may_yield(pair, first, start, end):
        return STAYS
    if pair[first + YIELD_SIDE] != 0.0:
        return _predict_unloading(pair, first, start, end)
    return _predict_yielding(pair, first, start, end, share)


@inlined
def _rates(pair, first, state, change):
    """Return the first and second rate of an acceleration over shares of a step."""
    angle = pair[first + ANGLE]
    # both derivatives of the equation of motion, where the ground is linear
    rate = acceleration_rate(pair, first, state, change)
    by_displacement = angle * pair[first + ACCELERATION] * state[2]
    return rate, angle * (by_displacement + pair[first + ACCELERATION + 1] * rate)


@inlined
def _change_series(pair, first, side, state, rates):
    """
    Return the Taylor coefficients up to the third of the function that falls to zero at a change.

    It is the distance to yielding towards a side, or the velocity of a yielding structure towards
    its side; ``rates`` are those of the acceleration, and time is the share of a step.
    """
    u, z, y = state
    angle = pair[first + ANGLE]
    # velocity of a yielding structure, else the distance
    if pair[first + YIELD_SIDE] != 0.0:
        scale = side * angle
        return side * z, scale * y, 0.5 * scale * rates[0], SIXTH * scale * rates[1]
    distance = pair[first + YIELD_LIMIT] - side * (u - pair[first + YIELD_CENTRE])
    scale = -side * angle
    return distance, scale * z, 0.5 * scale * angle * y, SIXTH * scale * angle * rates[0]


@inlined
def _first_estimate(start, slope, end, end_slope, share):
    """
    Return an estimate of where a function falls to zero in a piece of this share of a step.

    The inverse function is taken as the cubic with the values and slopes at both ends.
    """
    fall = start - end
    part = start / fall
    rest = 1.0 - part
    # shares of the piece per part of the fall
    time = part * (
        part * (3.0 - 2.0 * part) - rest * fall * (rest / slope - part / end_slope) / share
    )
    return share * (time if 0.0 < time < 1.0 else part)


@inlined
def _state_nearby(pair, first, state, rates, share):
    """Return the state a share of a step away, so near that the displacement is a cubic."""
    u, z, y = state
    rate, second = rates
    angle = pair[first + ANGLE]
    # mean velocity and mean acceleration over the share
    moved = z + 0.5 * angle * share * (y + share * rate / 3.0)
    faster = y + 0.5 * share * (rate + share * second / 3.0)
    near = u + angle * share * moved
    return near, z + angle * share * faster, y + share * (rate + 0.5 * share * second)


@inlined
def locate_change(pair, row, i, start, end, change, share):
    """
    Return the time of the only change of stiffness of structure i in a piece, and its state then.

    The time is a share of the step, as is the piece; over a complete step the ground changes by
    ``change``. It is corrected by the cubic at the last estimate until that is exact; it is -1 if
    this does not end, or leaves the piece.
    """
    first = i * STRUCTURE_ROWS
    side = pair[first + YIELD_SIDE]
    if side == 0.0:
        side = _nearer_side(pair, first, start, end)
    # first estimate
    rates = _rates(pair, first, start, change)
    value, slope, _, _ = _change_series(pair, first, side, start, rates)
    end_value, end_slope, _, _ = _change_series(pair, first, side, end, rates)
    time = _first_estimate(value, slope, end_value, end_slope, share)
    for _ in range(MOST_CORRECTIONS):
        # state at the estimate, and root of the cubic from there
        state = state_inside_step(pair, row, i, start, change, time)
        rates = _rates(pair, first, state, change)
        value, slope, bend, twist = _change_series(pair, first, side, state, rates)
        step, last = step_to_root(value, slope, bend, twist)
        step += last
        # no change of this piece is further away than a step
        if not abs(step) <= 1.0:
            break
        time += step
        # the cubic is exact over so short a step
        if (pair[first + ANGLE] * abs(step) <= CUBIC_ANGLE) & (abs(last) <= LAST_SHARE):
            is_inside = (0.0 < time < share - END_ROUNDING) & (slope < 0.0)
            state = _state_nearby(pair, first, state, rates, step)
            return time if is_inside else -1.0, state
    return -1.0, start


@inlined
def _change_stiffness(pair, row, i, state, end, duration):
    """Change the stiffness of structure i in a state; return its state on the new branch."""
    first = i * STRUCTURE_ROWS
    side = row[i, PHASE]
    u, z, y = state
    # yielding begins; or it ends, where the velocity is zero
    if side == 0.0:
        row[i, PHASE] = _nearer_side(pair, first, state, end)
    else:
        row[i, PHASE] = 0.0
        row[i, PLASTIC] = u - side * row[i, YIELD]
        z = 0.0
    write_branch(pair, row, i, duration)
    return u, z, y


@inlined
def run_changes(pair, row, i, start, end, segment):
    """
    Carry structure i of a free pair through a step in which it may yield or unload.

    Parameters
    ----------
    pair : (LANE_ROWS,) ndarray
        Numbers of its lane; see `lanes` for its rows. Receives the coefficients of a new branch.
    row : (2, ROW_COLUMNS) ndarray
        Its row of structures; see `motion` for its columns.
    i : int
        Index of the structure.
    start, end : tuple of float
        States at both ends of the step on the branch at its start: displacement, velocity over
        omega, acceleration over omega² (m).
    segment : Segment
        The step.

    Returns
    -------
    is_certain : bool
        Whether the step was carried out; else the structure may have any branch and maxima.
    end : tuple of float
        State at the end of the step.
    low, high : float
        Bounds of the displacement in the step, m.
    """
    first = i * STRUCTURE_ROWS
    change = segment.slope * segment.duration
    remaining = 1.0
    low = high = start[0]
    error = 0.0
    for _ in range(MOST_CHANGES):
        # the piece until the next change
        prediction = predict_change(pair, first, start, end, remaining)
        share = remaining
        after = end
        if prediction == CHANGES_ONCE:
            share, after = locate_change(pair, row, i, start, end, change, remaining)
        elif prediction == CHANGES_NOW:
            share, after = 0.0, start
        if prediction == UNCERTAIN or share < 0.0:
            break
        # its maxima and bounds
        raise_maxima(pair, row, i, start, after, change, share)
        low = min(low, after[0])
        high = max(high, after[0])
        strength = max(abs(start[2]), abs(after[2]))
        error = max(error, pair[first + DISPLACEMENT_ERROR] * strength)
        # no further change: the end of the step
        if prediction == STAYS:
            row[i, UNLOADING] = 0.0
            return True, after, low - error, high + error
        # the change, and the state at the end of the step after it
        remaining -= share
        start = _change_stiffness(pair, row, i, after, end, segment.duration)
        end = state_inside_step(pair, row, i, start, change, remaining)
    return False, end, low, high


@inlined
def branch_and_maxima(row, i):
    """Return what ``run_changes`` may change of structure i: its branch and its maxima."""
    return (
        row[i, PHASE],
        row[i, PLASTIC],
        row[i, UNLOADING],
        row[i, LARGEST_DISPLACEMENT],
        row[i, LARGEST_RADIUS_SQUARED],
    )


@lean
def restore(pair, row, i, before, duration):
    """Return structure i to the branch and the maxima that it had before."""
    is_other = (row[i, PHASE] != before[0]) | (row[i, PLASTIC] != before[1])
    row[i, PHASE] = before[0]
    row[i, PLASTIC] = before[1]
    row[i, UNLOADING] = before[2]
    row[i, LARGEST_DISPLACEMENT] = before[3]
    row[i, LARGEST_RADIUS_SQUARED] = before[4]
    # coefficients of the branch
    if is_other:
        write_branch(pair, row, i, duration)


@inlined
def run_stiffness_changes(pair, row, left, right, next_left, next_right, segment, least, largest):
    """
    Carry a free pair through a step in which its structures may yield or unload.

    Parameters
    ----------
    pair, row, segment
        As in `run_changes`.
    left, right : tuple of float
        States of both structures at the start of the step.
    next_left, next_right : tuple of float
        States at its end on the branches at its start.
    least, largest : float
        Range of the relative displacement ``u2 - u1`` for which this is enough, m.

    Returns
    -------
    bool
        Whether the relative displacement is certain to stay in this range; else pair and row are
        as before, and the step is left to the event code.
    """
    before = branch_and_maxima(row, 0)
    other_before = branch_and_maxima(row, 1)
    # one structure after the other
    is_certain, next_left, low, high = run_changes(pair, row, 0, left, next_left, segment)
    if is_certain:
        is_certain, next_right, other_low, other_high = run_changes(
            pair, row, 1, right, next_right, segment
        )
        if is_certain & (other_low - high > least) & (other_high - low < largest):
            set_states(pair, next_left, next_right)
            return True
    restore(pair, row, 0, before, segment.duration)
    restore(pair, row, 1, other_before, segment.duration)
    return False
