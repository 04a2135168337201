"""
Closing clearance of a free pair in a piece of a step, as far as bounds show it.

Where it closes once, the impact is located on the exact solution. ``impact_steps`` goes from one
impact of a step to the next.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.polynomial_roots import value_and_slope
from per_obspy.kernels.pounding_events.motion import RAMP_RESPONSE, TERM_COUNT
from per_obspy.kernels.pounding_lanes.lanes import (
    ACCELERATION,
    ACCELERATION_ERROR,
    ANGLE,
    CONTACT_FUNCTION,
    OMEGA,
    STRUCTURE_ROWS,
    VELOCITY_ERROR,
)

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
