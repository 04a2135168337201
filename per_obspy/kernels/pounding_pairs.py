"""The scalar half of ``pounding_lanes``: coefficients of a lane's phase, and what happens to a pair inside a step."""

import math

from ._jit import kernel
from .polynomial_roots import first_fall, is_last_root, value_and_slope
from .pounding_events import fill_power, fill_velocity, find_event, finish_piece, raise_peaks
from .pounding_lanes import (
    CENTRE,
    CLEAR,
    COSINE,
    FLEXIBILITY,
    FORCE,
    FORCE_FLOOR,
    HIGHEST_PLACE,
    LIMIT,
    PLACE,
    PLACE_MARGIN,
    POWER_MARGIN,
    PULL,
    SIDE,
    SINE,
    SPEED,
    START_PLACE,
    START_SPEED,
    STEP_PLACE,
    STEP_SPEED,
    STIFF,
    STRUCTURE_ROWS,
    TURN,
    WIDEN,
    WIDEST_RADIUS,
    at,
)
from .pounding_motion import (
    BOUNCES,
    CURVE,
    ELASTIC,
    GAP,
    GUARD,
    HARDENING,
    HIGHEST,
    MASS,
    MOST_BOUNCES,
    PARTICIPATION,
    PHASE,
    PLASTIC,
    RATE,
    RICHEST,
    STIFFNESS,
    STUCK,
    TERMS,
    WIDEST,
    YIELD,
    YIELDED,
    U,
    V,
    cluster_equation,
    fill_taylor,
    restoring,
    taylor_terms,
)


@kernel
def fill_responses(row, i, column, damping, stiffness, duration):
    """Fill six columns with displacement and velocity after a step from unit speed, unit force and unit ramp."""
    terms = int(row[0, TERMS])
    row[i, GUARD] = 0.0
    for k in range(3):
        fill_taylor(row, i, GUARD, terms, 1.0 * (k == 0), damping, stiffness, 1.0 * (k == 1), (k == 2) / duration)
        row[i, column + 2 * k], row[i, column + 2 * k + 1] = value_and_slope(row, i, GUARD, terms, duration)


@kernel
def write_step(lanes, row, lane, i, equation, duration):
    """Write the coefficients of one step of structure i, whose displacement obeys the equation (see below)."""
    damping, stiffness, drive, constant = equation
    first = i * STRUCTURE_ROWS
    if row[0, STUCK]:
        responses = CURVE  # not in use between two events
        fill_responses(row, i, responses, damping, stiffness, duration)
    else:
        responses = ELASTIC if row[i, PHASE] == 0.0 else YIELDED
    for k in range(2):
        to = first + (STEP_PLACE if k == 0 else STEP_SPEED)
        by_speed, by_force = row[i, responses + k], row[i, responses + 2 + k]
        by_ramp = row[i, responses + 4 + k]
        lanes[at(to, lane)] = (1.0 - k) - stiffness * by_force
        lanes[at(to + 1, lane)] = by_speed
        lanes[at(to + 2, lane)] = -drive * (by_force - by_ramp)
        lanes[at(to + 3, lane)] = -drive * by_ramp
        lanes[at(to + 4, lane)] = constant * by_force
    lanes[at(first + PULL, lane)] = -stiffness
    lanes[at(first + PULL + 1, lane)] = -damping
    lanes[at(first + PULL + 2, lane)] = -drive
    lanes[at(first + PULL + 3, lane)] = constant


@kernel
def equation_of(row, i):
    """Return damping, stiffness, drive and constant of ``u'' + damping u' + stiffness u = constant - drive a``."""
    first, last = (0, 1) if row[0, STUCK] else (i, i)
    _, damping, stiffness, force, force_rate = cluster_equation(row, first, last, 0.0, 1.0)
    return damping, stiffness, -force_rate, force + stiffness * row[i, U]


@kernel
def write_guard(lanes, row, lane, i, equation):
    """Write the gap of a free pair, or what force contact exerts on structure i over its mass."""
    if not row[0, STUCK]:
        lanes[at(CLEAR, lane)] = row[0, GAP]
        for k in range(5):
            lanes[at(FORCE + k, lane)] = 0.0
        lanes[at(FORCE + 4, lane)] = 1.0
        return
    damping, stiffness, drive, constant = equation
    sign = -1.0 if i == 0 else 1.0
    own, own_constant = restoring(row, i)
    lanes[at(CLEAR, lane)] = math.inf
    lanes[at(FORCE + i, lane)] = sign * (own - stiffness)
    lanes[at(FORCE + 1 - i, lane)] = 0.0
    lanes[at(FORCE + 2, lane)] = sign * (2.0 * row[i, RATE] - damping)
    lanes[at(FORCE + 3, lane)] = sign * (row[i, PARTICIPATION] - drive)
    lanes[at(FORCE + 4, lane)] = sign * (constant - own_constant)
    lanes[at(FORCE_FLOOR, lane)] = 1e-12 * max(row[0, STIFFNESS], row[1, STIFFNESS])


@kernel
def write_phase(lanes, row, lane, duration):
    """Write what depends on the phase of a pair: coefficients of the step, guards, limits."""
    for i in range(2):
        equation = equation_of(row, i)
        write_step(lanes, row, lane, i, equation, duration)
        first, side = i * STRUCTURE_ROWS, row[i, PHASE]
        lanes[at(first + LIMIT, lane)] = row[i, YIELD] if side == 0 else math.inf
        lanes[at(first + CENTRE, lane)] = row[i, PLASTIC]
        lanes[at(first + SIDE, lane)] = side
        # more than twice what u'' + omega² u can leave its chord by, h²/8 of its own second derivative
        softening = abs(row[i, STIFFNESS] - equation[1])
        lanes[at(first + POWER_MARGIN, lane)] = 0.5 * duration * (softening * duration + equation[0])
    finite = 0 if row[0, MASS] < math.inf else 1
    write_guard(lanes, row, lane, finite, equation_of(row, finite))


@kernel
def write_constants(lanes, row, lane, cosine, sine, duration):
    """Write what stays the same for a pair, and set its state to rest."""
    row[0, TERMS] = taylor_terms(row, duration)
    for i in range(2):
        first, stiffness, damping = i * STRUCTURE_ROWS, row[i, STIFFNESS], 2.0 * row[i, RATE]
        fill_responses(row, i, ELASTIC, damping, stiffness, duration)
        fill_responses(row, i, YIELDED, damping, stiffness * row[i, HARDENING], duration)
        lanes[at(first + COSINE, lane)], lanes[at(first + SINE, lane)] = cosine, sine
        lanes[at(first + STIFF, lane)], lanes[at(first + FLEXIBILITY, lane)] = stiffness, 1.0 / stiffness
        # four times the error h⁴/384 u'''' of cubic Hermite interpolation, u'''' from the pulls at both ends
        phase = math.sqrt(stiffness) * duration
        share = (phase * phase + damping * duration) / 96.0
        lanes[at(first + PLACE_MARGIN, lane)] = share * duration * duration


@kernel
def load_pair(lanes, row, lane):
    """Copy a lane, as it was at the start of the step, to the pair's row, on which the event code works."""
    for i in range(2):
        first = i * STRUCTURE_ROWS
        row[i, U], row[i, V] = lanes[at(first + START_PLACE, lane)], lanes[at(first + START_SPEED, lane)]
        if row[i, PHASE] != 0.0:
            row[i, PLASTIC] = row[i, U] - row[i, PHASE] * row[i, YIELD]
        row[i, HIGHEST] = lanes[at(first + HIGHEST_PLACE, lane)]
        row[i, WIDEST] = lanes[at(first + WIDEST_RADIUS, lane)]
        row[i, RICHEST] = math.inf  # not asked for


@kernel
def store_pair(lanes, row, lane):
    """Copy a pair back to its lane, as it is at the end of the step."""
    for i in range(2):
        first = i * STRUCTURE_ROWS
        lanes[at(first + PLACE, lane)], lanes[at(first + SPEED, lane)] = row[i, U], row[i, V]
        lanes[at(first + HIGHEST_PLACE, lane)] = row[i, HIGHEST]
        lanes[at(first + WIDEST_RADIUS, lane)] = row[i, WIDEST]


@kernel
def changes_phase(lanes, row, lane):
    """Tell whether a lane's coefficients are no longer those of its pair's phase."""
    changes = (lanes[at(CLEAR, lane)] == math.inf) != (row[0, STUCK] != 0.0)
    for i in range(2):
        first = i * STRUCTURE_ROWS
        changes |= lanes[at(first + SIDE, lane)] != row[i, PHASE]
        changes |= row[i, PHASE] == 0.0 and lanes[at(first + CENTRE, lane)] != row[i, PLASTIC]
    return changes


@kernel
def repeat_step(row, log, segment):
    """Carry a pair through one step, event by event; tell whether it got through."""
    row[0, BOUNCES] = 0.0
    elapsed = 0.0
    for _ in range(100 * int(row[0, MOST_BOUNCES])):
        span, kind, place = find_event(row, segment, elapsed)
        raise_peaks(row, span, segment.terms)
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, log, segment, elapsed, span, kind, place)
        if elapsed >= segment.duration:
            return True
    return False


@kernel
def raise_inside(lanes, row, lane, first, flags, ground, slope, duration):
    """
    Raise the maxima of one structure of a lane to what it reaches inside the step, where nothing else happens.

    Line 0 of ``row`` lends the room for Taylor coefficients.
    """
    if not flags & (TURN | WIDEN):
        return
    terms = int(row[0, TERMS])
    place, speed = lanes[at(first + START_PLACE, lane)], lanes[at(first + START_SPEED, lane)]
    stiffness, damping = -lanes[at(first + PULL, lane)], -lanes[at(first + PULL + 1, lane)]
    drive, constant = lanes[at(first + PULL + 2, lane)], lanes[at(first + PULL + 3, lane)]
    row[0, CURVE] = place
    force = constant + drive * ground - stiffness * place
    fill_taylor(row, 0, CURVE, terms, speed, damping, stiffness, force, drive * slope)
    if flags & TURN:
        fill_velocity(row, 0, terms)
        _raise_lane(lanes, row, lane, first, terms - 1, duration)
    if flags & WIDEN:
        fill_power(row, 0, lanes[at(first + STIFF, lane)], 0.0, terms)
        _raise_lane(lanes, row, lane, first, terms - 2, duration)


@kernel
def _raise_lane(lanes, row, lane, first, guard_terms, duration):
    """Raise the maxima of one structure of a lane at the roots of the guard."""
    highest, widest = at(first + HIGHEST_PLACE, lane), at(first + WIDEST_RADIUS, lane)
    value, slope = value_and_slope(row, 0, GUARD, guard_terms, 0.0)
    sign = 1.0 if value > 0.0 or (value == 0.0 and slope > 0.0) else -1.0
    time = first_fall(row, 0, GUARD, guard_terms, sign, 0.0, duration, 0.0)
    while time >= 0.0:
        u, v = value_and_slope(row, 0, CURVE, int(row[0, TERMS]), time)
        lanes[highest] = max(lanes[highest], abs(u))
        lanes[widest] = max(lanes[widest], u * u + lanes[at(first + FLEXIBILITY, lane)] * v * v)
        if is_last_root(row, 0, GUARD, guard_terms, time, duration):
            return
        sign = -sign
        time = first_fall(row, 0, GUARD, guard_terms, sign, time, duration, 0.0)


@kernel
def read_end(lanes, row, lane):
    """Copy the end of the last step to the pair's row, its maxima included."""
    for i in range(2):
        first = i * STRUCTURE_ROWS
        place, speed = lanes[at(first + PLACE, lane)], lanes[at(first + SPEED, lane)]
        radius = place * place + lanes[at(first + FLEXIBILITY, lane)] * speed * speed
        row[i, U], row[i, V] = place, speed
        row[i, HIGHEST] = max(lanes[at(first + HIGHEST_PLACE, lane)], abs(place))
        row[i, WIDEST] = max(lanes[at(first + WIDEST_RADIUS, lane)], radius)


@kernel
def rest_lane(lanes, lane):
    """Let a lane go on without ever being flagged."""
    for first in (0, STRUCTURE_ROWS):
        lanes[at(first + HIGHEST_PLACE, lane)] = lanes[at(first + WIDEST_RADIUS, lane)] = math.inf
        lanes[at(first + LIMIT, lane)], lanes[at(first + SIDE, lane)] = math.inf, 0.0
    lanes[at(CLEAR, lane)] = math.inf
    for k in range(4):
        lanes[at(FORCE + k, lane)] = 0.0
    lanes[at(FORCE + 4, lane)], lanes[at(FORCE_FLOOR, lane)] = 1.0, 0.0
