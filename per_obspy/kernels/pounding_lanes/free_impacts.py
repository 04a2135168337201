"""
Fast path for single impacts of a free pair, where bounds show that its clearance closes once.

It is used when the clearance closes once in the rest of a step, or not at all: most steps of a
pounding pair that hold an event consist of such pieces. Everything else is left, from the start of
the step or from the last impact on, to the event code of single histories.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.polynomial_roots import value_and_slope
from per_obspy.kernels.pounding_events.contact import apply_impact, resolve_contact
from per_obspy.kernels.pounding_events.motion import (
    BOUNCE_LIMIT,
    BOUNCES,
    RAMP_RESPONSE,
    STICKING_DELAY,
    STICKING_SPEED,
    TERM_COUNT,
    V,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    ACCELERATION,
    ACCELERATION_ERROR,
    ANGLE,
    CONTACT_FUNCTION,
    DISPLACEMENT,
    OMEGA,
    STRUCTURE_ROWS,
    VELOCITY,
    VELOCITY_ERROR,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    complete_state,
    may_exceed_maxima,
    may_yield,
    raise_maxima_inside,
)
from per_obspy.kernels.pounding_lanes.pair_rows import load_pair

#: A clearance below this share of displacements and gap is not certain to be open.
CLEARANCE_ROUNDING = 1e-12
#: Predictions for the clearance in a piece.
UNCERTAIN, STAYS_OPEN, CLOSES_ONCE, CLOSES_NOW = 0, 1, 2, 3
#: Share of a step over which a motion is cubic but for rounding, and one whose square is rounding.
CUBIC_SHARE, LAST_SHARE = 1e-4, 1e-9
#: Of the third Taylor coefficient: a product takes less time than a division.
SIXTH = 1.0 / 6.0
#: Corrections of the time of an impact, above which it is left to the event code.
MOST_CORRECTIONS = 10


@inlined
def _clearance(pair, left, right):
    """Return the clearance of a free pair in two states."""
    return pair[CONTACT_FUNCTION + 4] - left[0] + right[0]


@inlined
def opening_rate(pair, left, right):
    """Return the rate at which the clearance of a pair grows, m/s."""
    return pair[STRUCTURE_ROWS + OMEGA] * right[1] - pair[OMEGA] * left[1]


@inlined
def clearance_trend(pair, left, right, next_left, next_right, share):
    """
    Return whether a clearance rises, falls, or rises and then may turn in a piece of a step.

    The piece is this share of the step, between two pairs of states. The clearance's rate leaves
    its chord by ``error`` at most; the rate falls all through (the clearance is concave) or grows
    (convex) where the bounds of its rate have one sign.
    """
    second = STRUCTURE_ROWS
    omega = pair[OMEGA]
    other_omega = pair[second + OMEGA]
    # error bounds of the clearance's rate and acceleration
    strength = omega * max(abs(left[2]), abs(next_left[2]))
    other_strength = other_omega * max(abs(right[2]), abs(next_right[2]))
    error = share * (
        pair[VELOCITY_ERROR] * strength + pair[second + VELOCITY_ERROR] * other_strength
    )
    bend = (
        omega * pair[ACCELERATION_ERROR] * strength
        + other_omega * pair[second + ACCELERATION_ERROR] * other_strength
    )
    # acceleration of the clearance at both ends
    change = other_omega * other_omega * right[2] - omega * omega * left[2]
    next_change = other_omega * other_omega * next_right[2] - omega * omega * next_left[2]
    is_concave = max(change, next_change) + bend < 0.0
    is_convex = min(change, next_change) - bend > 0.0
    # rate of the clearance at both ends, and by it the sign of the rate inside
    rate = opening_rate(pair, left, right)
    next_rate = opening_rate(pair, next_left, next_right)
    rises = (
        (min(rate, next_rate) > error)
        | (is_convex & (rate > 0.0))
        | (is_concave & (next_rate > 0.0))
    )
    falls = (
        (max(rate, next_rate) < -error)
        | (is_concave & (rate < 0.0))
        | (is_convex & (next_rate < 0.0))
    )
    return rises, falls, is_concave & (rate > 0.0)


@inlined
def predict_clearance(pair, left, right, next_left, next_right, share):
    """Predict the clearance of a free pair in a piece of a step: one of the four predictions."""
    rises, falls, turns = clearance_trend(pair, left, right, next_left, next_right, share)
    if rises:
        return STAYS_OPEN
    if not (falls | turns):
        return UNCERTAIN
    # it falls once: its signs at the ends decide
    size = abs(left[0]) + abs(right[0]) + pair[CONTACT_FUNCTION + 4]
    is_open = _clearance(pair, left, right) > CLEARANCE_ROUNDING * size
    if falls & (not is_open):
        return CLOSES_NOW
    return CLOSES_ONCE if _clearance(pair, next_left, next_right) < 0.0 else STAYS_OPEN


@inlined
def _first_guess(start, slope, end):
    """Return where the parabola with this start, slope and end at 1 falls through zero."""
    bend = end - start - slope
    root = math.sqrt(max(slope * slope - 4.0 * bend * start, 0.0))
    return 2.0 * start / (root - slope) if slope <= 0.0 else -0.5 * (slope + root) / bend


@inlined
def _acceleration_rate(pair, first, state, change):
    """Return the rate of an acceleration per step, over which the ground changes by ``change``."""
    by_displacement = pair[first + ACCELERATION] * state[1]
    by_velocity = pair[first + ACCELERATION + 1] * state[2]
    return pair[first + ANGLE] * (by_displacement + by_velocity) + (
        pair[first + ACCELERATION + 2] * change
    )


@inlined
def state_inside_step(pair, row, i, start, change, share):
    """Return the state of structure i after a share of a step, over which the ground changes."""
    terms = int(row[0, TERM_COUNT]) - 3
    cubic, slope = value_and_slope(row, i, RAMP_RESPONSE + 3, terms, share)
    return _state_by_ramp(pair, i * STRUCTURE_ROWS, start, change, share, cubic, slope)


@inlined
def states_inside_step(pair, row, left, right, change, share):
    """Return ``state_inside_step`` of both structures: two series in one loop take less time."""
    cubic = slope = other_cubic = other_slope = 0.0
    # Horner's rule
    for n in range(int(row[0, TERM_COUNT]) - 1, 2, -1):
        slope = slope * share + cubic
        cubic = cubic * share + row[0, RAMP_RESPONSE + n]
        other_slope = other_slope * share + other_cubic
        other_cubic = other_cubic * share + row[1, RAMP_RESPONSE + n]
    return (
        _state_by_ramp(pair, 0, left, change, share, cubic, slope),
        _state_by_ramp(pair, STRUCTURE_ROWS, right, change, share, other_cubic, other_slope),
    )


@inlined
def _state_by_ramp(pair, first, start, change, share, cubic, slope):
    """
    Return the state of a structure after a share of a step, over which the ground changes.

    ``change`` is the change of the ground over the complete step. As the ground is linear, the
    acceleration y is in free vibration: with B, twice the integral of its response to a unit rate,
    and dots for shares of the step, ``y = y0 (1 - k B') + y0' B''`` where ``B'' + d B' + k B =
    share``. ``cubic`` and ``slope`` are the series of B / share³ and its rate.
    """
    u, z, y = start
    # equation of motion with time as the share of a step
    angle = pair[first + ANGLE]
    rate = _acceleration_rate(pair, first, start, change)
    damping = -angle * pair[first + ACCELERATION + 1]
    stiffness = -angle * angle * pair[first + ACCELERATION]
    # B and B'
    ramp = share * share * share * cubic
    ramp_rate = share * share * (3.0 * cubic + share * slope)
    # growth of displacement and velocity, and the acceleration
    moved = share * z + angle * (y * (ramp_rate + damping * ramp) + rate * ramp)
    faster = y * (share - stiffness * ramp) + rate * ramp_rate
    acceleration = y * (1.0 - stiffness * ramp_rate) + rate * (
        share - damping * ramp_rate - stiffness * ramp
    )
    return u + angle * moved, z + angle * faster, acceleration


@inlined
def _near_state(pair, first, state, rate, share):
    """Return the state a share of a step away, so near that the acceleration is linear."""
    angle = share * pair[first + ANGLE]
    u = state[0] + angle * (state[1] + angle * (0.5 * state[2] + rate * share * SIXTH))
    return u, state[1] + angle * (state[2] + 0.5 * rate * share), state[2] + rate * share


@inlined
def _clearance_series(pair, left, right, change, duration):
    """
    Return the Taylor coefficients of the clearance up to the third, over shares of a step.

    And the rates of both accelerations per step, over which the ground changes by ``change``.
    """
    second = STRUCTURE_ROWS
    omega = pair[OMEGA] * duration
    other_omega = pair[second + OMEGA] * duration
    # rates of both accelerations, then the coefficients of their difference
    rate = _acceleration_rate(pair, 0, left, change)
    other_rate = _acceleration_rate(pair, second, right, change)
    value = _clearance(pair, left, right)
    slope = other_omega * right[1] - omega * left[1]
    bend = 0.5 * (other_omega * other_omega * right[2] - omega * omega * left[2])
    twist = (other_omega * other_omega * other_rate - omega * omega * rate) * SIXTH
    return (value, slope, bend, twist), (rate, other_rate)


@inlined
def _improved_guess(series, end, share, time):
    """
    Return a better estimate of where a clearance falls through zero than a time.

    By Newton's step with curvature on the quartic of four Taylor coefficients and the value at
    the end of the piece.
    """
    value, slope, bend, twist = series
    reached = value + share * (slope + share * (bend + share * twist))
    fourth = (end - reached) / (share * share * share * share)
    # quartic, its first and half its second derivative
    here = value + time * (slope + time * (bend + time * (twist + time * fourth)))
    inverse = 1.0 / (slope + time * (2.0 * bend + time * (3.0 * twist + time * 4.0 * fourth)))
    bend_here = bend + time * (3.0 * twist + time * 6.0 * fourth)
    step = -here * inverse
    better = time + step - step * step * bend_here * inverse
    return better if 0.0 < better < share else time


@lean
def locate_impact(pair, row, left, right, next_left, next_right, share, segment):
    """
    Return the time of the impact in a piece whose clearance closes once, and both states then.

    The time is a share of the step, as is the piece. It is corrected by the cubic of the clearance
    at the last estimate until that is exact; it is -1 if this does not end, or leaves the step.
    """
    duration = segment.duration
    change = segment.slope * duration
    # first estimate: parabola through both ends, then the quartic
    series, _ = _clearance_series(pair, left, right, change, duration)
    end = _clearance(pair, next_left, next_right)
    time = share * _first_guess(series[0], series[1] * share, end)
    time = _improved_guess(series, end, share, time)
    for _ in range(MOST_CORRECTIONS):
        # states at the estimate, and Taylor coefficients of the clearance from there
        hit_left, hit_right = states_inside_step(pair, row, left, right, change, time)
        series, rates = _clearance_series(pair, hit_left, hit_right, change, duration)
        value, slope, bend, twist = series
        # root of the cubic: Newton's step with curvature, then a second Newton step
        inverse = 1.0 / slope
        step = -value * inverse
        step -= step * step * bend * inverse
        last = -(value + step * (slope + step * (bend + step * twist))) * inverse
        step += last
        # no impact of this piece is further away than a step
        if not abs(step) <= 1.0:
            break
        time += step
        # the cubic is exact over so short a step: states at the impact
        if (abs(step) <= CUBIC_SHARE) & (abs(last) <= LAST_SHARE):
            is_inside = (0.0 < time < share - CLEARANCE_ROUNDING) & (slope < 0.0)
            hit_left = _near_state(pair, 0, hit_left, rates[0], step)
            hit_right = _near_state(pair, STRUCTURE_ROWS, hit_right, rates[1], step)
            return time if is_inside else -1.0, hit_left, hit_right
    return -1.0, left, right


@inlined
def set_states(pair, left, right):
    """Set displacement and velocity of a pair to those of two states."""
    pair[DISPLACEMENT] = left[0]
    pair[VELOCITY] = left[1]
    pair[STRUCTURE_ROWS + DISPLACEMENT] = right[0]
    pair[STRUCTURE_ROWS + VELOCITY] = right[1]


@inlined
def _states_after_impact(pair, row, log, left, right, segment, elapsed):
    """Apply an impact to a pair in these states, after a share of the step; return its states."""
    # impact, on the row
    set_states(pair, left, right)
    load_pair(pair, row)
    apply_impact(row, log, 0, segment.start + elapsed * segment.duration)
    # states with the velocities after it
    ground = segment.acceleration + elapsed * segment.slope * segment.duration
    second = STRUCTURE_ROWS
    hit_left = complete_state(pair, 0, left[0], row[0, V] / pair[OMEGA], ground)
    hit_right = complete_state(pair, second, right[0], row[1, V] / pair[second + OMEGA], ground)
    return hit_left, hit_right


@inlined
def _raise_both(pair, row, left, right, next_left, next_right, change, share):
    """Raise the maxima of both structures to those of a piece."""
    if may_exceed_maxima(pair, row, 0, left, next_left):
        raise_maxima_inside(pair, row, 0, left, next_left, change, share)
    if may_exceed_maxima(pair, row, 1, right, next_right):
        raise_maxima_inside(pair, row, 1, right, next_right, change, share)


@inlined
def next_impact(pair, row, left, right, next_left, next_right, share, segment):
    """
    Return the time until the impact in a piece, as a share of the step, and both states then.

    The time is infinite, and the states are those at the end, if there is no impact; it is -1 if
    that is uncertain.
    """
    prediction = predict_clearance(pair, left, right, next_left, next_right, share)
    if may_yield(pair, 0, left, next_left) or may_yield(pair, STRUCTURE_ROWS, right, next_right):
        prediction = UNCERTAIN
    # one way out per prediction
    if prediction == CLOSES_ONCE:
        return locate_impact(pair, row, left, right, next_left, next_right, share, segment)
    if prediction == CLOSES_NOW:
        return 0.0, left, right
    return math.inf if prediction == STAYS_OPEN else -1.0, next_left, next_right


@inlined
def _bounces_end(pair, row, left, right):
    """Return whether a free pair separates so slowly after an impact that it may stay closed."""
    omega = pair[OMEGA]
    other_omega = pair[STRUCTURE_ROWS + OMEGA]
    separation = opening_rate(pair, left, right)
    # as ``is_lingering``: a bounce lasts 2 separation / closing acceleration
    closing = omega * omega * left[2] - other_omega * other_omega * right[2]
    return (
        (separation <= row[0, STICKING_SPEED])
        | (row[0, BOUNCES] >= row[0, BOUNCE_LIMIT])
        | (separation <= row[0, STICKING_DELAY] * closing)
    )


@lean
def run_free_impacts(pair, row, log, left, right, next_left, next_right, segment):
    """
    Carry a free pair through a step of single impacts.

    Parameters
    ----------
    pair : (LANE_ROWS,) ndarray
        Numbers of its lane; see `lanes` for its rows.
    row : (2, ROW_COLUMNS) ndarray
        Its row of structures; see `motion` for its columns.
    log : (n_lines, LOG_COLUMNS) ndarray
        Log of impacts.
    left, right : tuple of float
        States of both structures at the start of the step: displacement, velocity over omega,
        acceleration over omega² (m).
    next_left, next_right : tuple of float
        States at its end without impact.
    segment : Segment
        The step.

    Returns
    -------
    float
        Time up to which the step was carried out, s: its duration, when ``pair`` has the state;
        else that of the last impact, when ``row`` has it; or -1 if no impact was carried out.
    """
    # times are shares of the step
    elapsed = 0.0
    change = segment.slope * segment.duration
    while True:
        remaining = 1.0 - elapsed
        share, next_left, next_right = next_impact(
            pair, row, left, right, next_left, next_right, remaining, segment
        )
        # uncertain, or an impact without approach: left to the event code
        if share < 0.0 or (
            share <= remaining
            and opening_rate(pair, next_left, next_right) >= -row[0, STICKING_SPEED]
        ):
            break
        _raise_both(pair, row, left, right, next_left, next_right, change, min(share, remaining))
        # no further impact: the end of the step
        if share > remaining:
            set_states(pair, next_left, next_right)
            return segment.duration
        # the impact, and the states at the end of the step after it
        elapsed += share
        left, right = _states_after_impact(pair, row, log, next_left, next_right, segment, elapsed)
        if _bounces_end(pair, row, left, right):
            break
        next_left, next_right = states_inside_step(pair, row, left, right, change, 1.0 - elapsed)
    if row[0, BOUNCES] == 0.0:
        return -1.0
    # the row stays at the last impact
    resolve_contact(row, log, segment, elapsed * segment.duration, 0)
    return elapsed * segment.duration
