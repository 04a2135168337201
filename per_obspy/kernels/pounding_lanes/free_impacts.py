r"""
The instant at which the clearance of a free pair closes in a piece of a step, and motion from it.

Inside a step each structure obeys one linear equation. With ``h`` the displacement that a unit
velocity causes after the time t, motion from an impact at t on is that from another start of the
step: the one from which free motion leads to the velocities after the impact. A change w of
velocity at t is the change ``-h w / D`` of displacement and ``(h' + d h) w / D`` of velocity at the
start, with d the damping, k the stiffness and ``D = (h' + d h) h' + k h^2``, the determinant of the
motion over t. So the end of the step follows without another series, and the next impact of the
step from that start.
"""

import math

from per_obspy.kernels._jit import inlined
from per_obspy.kernels.polynomial_roots import value_and_slope
from per_obspy.kernels.pounding_events.motion import RAMP_RESPONSE, TERM_COUNT
from per_obspy.kernels.pounding_lanes.lanes import (
    ACCELERATION,
    ANGLE,
    CONTACT_FUNCTION,
    OMEGA,
    STEP_DISPLACEMENT,
    STEP_VELOCITY,
    STRUCTURE_ROWS,
)

#: A clearance below this share of displacements and gap is not certain to be open.
CLEARANCE_ROUNDING = 1e-12
#: Predictions for the clearance in a piece.
UNCERTAIN, STAYS_OPEN, CLOSES_ONCE, CLOSES_NOW = 0, 1, 2, 3
#: Share of a step over which a motion is cubic but for rounding, and one whose square is rounding.
CUBIC_SHARE, LAST_SHARE = 1e-4, 1e-9
#: Of the third Taylor coefficient: a product takes less time than a division.
SIXTH = 1.0 / 6.0
#: Corrections of the time of an event, above which it is left to the event code.
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
def _first_guess(start, slope, end):
    """Return where the parabola with this start, slope and end at 1 falls through zero."""
    bend = end - start - slope
    root = math.sqrt(max(slope * slope - 4.0 * bend * start, 0.0))
    return 2.0 * start / (root - slope) if slope <= 0.0 else -0.5 * (slope + root) / bend


@inlined
def acceleration_rate(pair, first, state, change):
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
    ramp = _ramp(share, cubic, slope)
    return _state_by_ramp(pair, i * STRUCTURE_ROWS, start, change, share, ramp)


@inlined
def _ramps(row, share):
    """
    Return the ``_ramp`` of both structures.

    Their series are summed side by side, even and odd powers too: these sums of products do not
    wait for each other.
    """
    square = share * share
    even = even_rate = odd = odd_rate = 0.0
    other_even = other_even_rate = other_odd = other_odd_rate = 0.0
    n = RAMP_RESPONSE + int(row[0, TERM_COUNT]) - 1
    # the last power of an odd number of terms
    if (n - RAMP_RESPONSE) % 2 == 1:
        even = row[0, n]
        other_even = row[1, n]
        n -= 1
    # Horner's rule in the square of the time
    while n > RAMP_RESPONSE + 3:
        even_rate = even_rate * square + even
        even = even * square + row[0, n - 1]
        odd_rate = odd_rate * square + odd
        odd = odd * square + row[0, n]
        other_even_rate = other_even_rate * square + other_even
        other_even = other_even * square + row[1, n - 1]
        other_odd_rate = other_odd_rate * square + other_odd
        other_odd = other_odd * square + row[1, n]
        n -= 2
    # value and rate of both series
    rate = odd + 2.0 * share * (even_rate + share * odd_rate)
    other_rate = other_odd + 2.0 * share * (other_even_rate + share * other_odd_rate)
    return (
        _ramp(share, even + share * odd, rate),
        _ramp(share, other_even + share * other_odd, other_rate),
    )


@inlined
def _ramp(share, cubic, slope):
    """Return the response to a unit ramp and its rate, from response / share³ and its rate."""
    square = share * share
    return share * square * cubic, square * (3.0 * cubic + share * slope)


@inlined
def _equation(pair, first):
    """Return damping and stiffness of a structure with time as the share of a step."""
    angle = pair[first + ANGLE]
    return -angle * pair[first + ACCELERATION + 1], -angle * angle * pair[first + ACCELERATION]


@inlined
def _velocity_response(pair, first, share, ramp):
    """Return displacement and rate after a share of a step, by a unit rate at its start."""
    damping, stiffness = _equation(pair, first)
    response = share - damping * ramp[1] - stiffness * ramp[0]
    return response, 1.0 - damping * response - stiffness * ramp[1]


@inlined
def _state_by_ramp(pair, first, start, change, share, ramp):
    """
    Return the state of a structure after a share of a step, over which the ground changes.

    ``change`` is the change of the ground over the complete step. As the ground is linear, the
    acceleration y is in free vibration: with B, twice the integral of its response to a unit rate,
    and dots for shares of the step, ``y = y0 (1 - k B') + y0' B''`` where ``B'' + d B' + k B =
    share``. ``ramp`` is B and B'.
    """
    u, z, y = start
    angle = pair[first + ANGLE]
    rate = acceleration_rate(pair, first, start, change)
    damping, stiffness = _equation(pair, first)
    response, response_rate = ramp
    # growth of displacement and velocity, and the acceleration
    moved = share * z + angle * (y * (response_rate + damping * response) + rate * response)
    faster = y * (share - stiffness * response) + rate * response_rate
    acceleration = y * (1.0 - stiffness * response_rate) + rate * (
        share - damping * response_rate - stiffness * response
    )
    return u + angle * moved, z + angle * faster, acceleration


@inlined
def _near_state(pair, first, state, rate, share):
    """Return the state a share of a step away, so near that the acceleration is linear."""
    angle = share * pair[first + ANGLE]
    u = state[0] + angle * (state[1] + angle * (0.5 * state[2] + rate * share * SIXTH))
    return u, state[1] + angle * (state[2] + 0.5 * rate * share), state[2] + rate * share


@inlined
def _near_response(pair, first, response, share):
    """Return the response to a unit rate a share of a step later, so near that it is cubic."""
    damping, stiffness = _equation(pair, first)
    value, rate = response
    # by the equation of free vibration
    bend = -damping * rate - stiffness * value
    twist = -damping * bend - stiffness * rate
    value += share * (rate + share * (0.5 * bend + share * SIXTH * twist))
    return value, rate + share * (bend + 0.5 * share * twist)


@inlined
def add_velocity(pair, first, origin, end, response, growth):
    """
    Return the start of a step from which motion has another velocity at an instant, and its end.

    Parameters
    ----------
    pair : (LANE_ROWS,) ndarray
        Numbers of the lane of a pair; see `lanes` for its rows.
    first : int
        First row of the structure.
    origin, end : tuple of float
        Its states at the start and at the end of the step, without that change.
    response : tuple of float
        Displacement and rate at the instant by a unit rate at the start of the step.
    growth : float
        Change of velocity over omega at the instant, m.
    """
    angle = pair[first + ANGLE]
    damping, stiffness = _equation(pair, first)
    value, rate = response
    # changes of displacement and velocity at the start
    by_displacement = rate + damping * value
    inverse = 1.0 / (by_displacement * rate + stiffness * value * value)
    u = -angle * value * inverse * growth
    z = by_displacement * inverse * growth
    # and at the end
    row = first + STEP_DISPLACEMENT
    next_u = pair[row] * u + pair[row + 1] * z
    row = first + STEP_VELOCITY
    next_z = pair[row] * u + pair[row + 1] * z
    return _moved(pair, first, origin, u, z), _moved(pair, first, end, next_u, next_z)


@inlined
def _moved(pair, first, state, displacement, velocity):
    """Return a state with additional displacement and velocity."""
    by_displacement = pair[first + ACCELERATION] * displacement
    faster = state[2] + by_displacement + pair[first + ACCELERATION + 1] * velocity
    return state[0] + displacement, state[1] + velocity, faster


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
    rate = acceleration_rate(pair, 0, left, change)
    other_rate = acceleration_rate(pair, second, right, change)
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


@inlined
def _guess_after_contact(series, end, share):
    """
    Return an estimate of where a clearance that is zero at the start falls through zero again.

    By the root of the parabola, and Newton's step with curvature from there, both on the
    polynomials of ``_improved_guess`` over the time.
    """
    _, slope, bend, twist = series
    # parabola
    last = end / share
    time = slope * share / (slope - last)
    # cubic with this value at the end
    fourth = (last - slope - share * (bend + share * twist)) / (share * share * share)
    here = slope + time * (bend + time * (twist + time * fourth))
    inverse = 1.0 / (bend + time * (2.0 * twist + time * 3.0 * fourth))
    step = -here * inverse
    better = time + step - step * step * (twist + time * 3.0 * fourth) * inverse
    return better if 0.0 < better < share else time


@inlined
def step_to_root(value, slope, bend, twist):
    """Return Newton's step with curvature to the root of a cubic, and a second Newton step."""
    inverse = 1.0 / slope
    step = -value * inverse
    step -= step * step * bend * inverse
    return step, -(value + step * (slope + step * (bend + step * twist))) * inverse


@inlined
def locate_impact(pair, row, ends, origin, other_origin, elapsed, share, segment, has_met):
    """
    Return the time until the impact in a piece whose clearance closes once, and both states then.

    The time is a share of the step, as is the piece; ``ends`` are the states of both structures at
    its start, then at its end. It begins a share ``elapsed`` after the states from which free
    motion leads through it; if the pair ``has_met`` its clearance is zero then. The time is
    corrected by the cubic of the clearance at the last estimate until that is exact; it is -1 if
    this does not end, or leaves the piece.

    Also return ``_velocity_response`` of both structures then, since these states.
    """
    left, right, next_left, next_right = ends
    second = STRUCTURE_ROWS
    duration = segment.duration
    change = segment.slope * duration
    # first estimate
    series, _ = _clearance_series(pair, left, right, change, duration)
    end = _clearance(pair, next_left, next_right)
    if has_met:
        time = _guess_after_contact(series, end, share)
    else:
        time = share * _first_guess(series[0], series[1] * share, end)
        time = _improved_guess(series, end, share, time)
    for _ in range(MOST_CORRECTIONS):
        # states at the estimate, and Taylor coefficients of the clearance from there
        now = elapsed + time
        ramp, other_ramp = _ramps(row, now)
        hit_left = _state_by_ramp(pair, 0, origin, change, now, ramp)
        hit_right = _state_by_ramp(pair, second, other_origin, change, now, other_ramp)
        series, rates = _clearance_series(pair, hit_left, hit_right, change, duration)
        value, slope, bend, twist = series
        # root of the cubic from there
        step, last = step_to_root(value, slope, bend, twist)
        step += last
        # no impact of this piece is further away than a step
        if not abs(step) <= 1.0:
            break
        time += step
        # the cubic is exact over so short a step: states at the impact
        if (abs(step) <= CUBIC_SHARE) & (abs(last) <= LAST_SHARE):
            is_inside = (0.0 < time < share - CLEARANCE_ROUNDING) & (slope < 0.0)
            hit_left = _near_state(pair, 0, hit_left, rates[0], step)
            hit_right = _near_state(pair, second, hit_right, rates[1], step)
            response = _velocity_response(pair, 0, now, ramp)
            other_response = _velocity_response(pair, second, now, other_ramp)
            return (
                time if is_inside else -1.0,
                hit_left,
                hit_right,
                _near_response(pair, 0, response, step),
                _near_response(pair, second, other_response, step),
            )
    return -1.0, left, right, (0.0, 1.0), (0.0, 1.0)
