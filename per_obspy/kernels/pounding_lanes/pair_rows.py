"""What ``pounding_lanes`` needs to know of a pair: coefficients of its phase, its state at rest and when settled."""

import math

from per_obspy.kernels._jit import lean
from per_obspy.kernels.polynomial_roots import value_and_slope
from per_obspy.kernels.pounding_events.motion import (
    CURVE,
    ELASTIC,
    GAP,
    GUARD,
    HARDENING,
    MASS,
    PARTICIPATION,
    PHASE,
    PLASTIC,
    RATE,
    RICHEST,
    SHAPE,
    STIFFNESS,
    STUCK,
    TERMS,
    YIELD,
    YIELDED,
    U,
    V,
    cluster_equation,
    fill_taylor,
    restoring,
    taylor_terms,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    ANGLE,
    BEND,
    CENTRE,
    COSINE,
    FLOOR,
    HIGHEST_PLACE,
    LIMIT,
    OMEGA,
    PLACE,
    PLACE_SAG,
    POWER_SAG,
    PULL,
    SIDE,
    SINE,
    SPEED,
    SPEED_SAG,
    STEP_PLACE,
    STEP_SPEED,
    STRUCTURE_ROWS,
    WIDEST_RADIUS,
)
from per_obspy.kernels.pounding_lanes.lanes import GUARD as CLOSING


@lean
def fill_responses(row, i, column, damping, stiffness, duration):
    """Fill six columns with displacement and velocity after a step from unit speed, unit force and unit ramp."""
    terms = int(row[0, TERMS])
    row[i, GUARD] = 0.0
    for k in range(3):
        fill_taylor(
            row,
            i,
            GUARD,
            terms,
            1.0 * (k == 0),
            damping,
            stiffness,
            1.0 * (k == 1),
            (k == 2) / duration,
        )
        row[i, column + 2 * k], row[i, column + 2 * k + 1] = value_and_slope(
            row, i, GUARD, terms, duration
        )


@lean
def write_step(pair, row, i, equation, duration):
    """Write the coefficients of one step of structure i, whose displacement obeys the equation (see below)."""
    damping, stiffness, drive, constant = equation
    first, omega = i * STRUCTURE_ROWS, math.sqrt(row[i, STIFFNESS])
    if row[0, STUCK]:
        responses = CURVE  # not in use between two events
        fill_responses(row, i, responses, damping, stiffness, duration)
    else:
        responses = ELASTIC if row[i, PHASE] == 0.0 else YIELDED
    for k in range(2):
        to = first + (STEP_PLACE if k == 0 else STEP_SPEED)
        by_speed, by_force = row[i, responses + k], row[i, responses + 2 + k]
        by_ramp = row[i, responses + 4 + k]
        scale = 1.0 if k == 0 else 1.0 / omega
        pair[to] = scale * ((1.0 - k) - stiffness * by_force)
        pair[to + 1] = scale * by_speed * omega
        pair[to + 2] = -scale * drive * (by_force - by_ramp)
        pair[to + 3] = -scale * drive * by_ramp
        pair[to + 4] = scale * constant * by_force
    pair[first + PULL] = -stiffness / row[i, STIFFNESS]
    pair[first + PULL + 1] = -damping / omega
    pair[first + PULL + 2] = -drive / row[i, STIFFNESS]
    pair[first + PULL + 3] = constant / row[i, STIFFNESS]


@lean
def write_bounds(pair, first):
    """
    Write how far displacement, speed and power leave their chords inside a step, over the acceleration at its ends.

    With time as the angle omega t, the acceleration y obeys y'' + 2 b y' + k y = 0 in a step,
    because that of the ground is linear. As |y'| leaves its mean, at most 2 / angle times the
    larger |y| of both ends, by half a step times
    |y''|, and y its chord by an eighth of the step squared times |y''|, that is at most ``8 bend / angle²`` times that
    |y|; and the power is ``(1 - k) u - 2 b u'`` beside what is linear.
    """
    angle = pair[first + ANGLE]
    stiffness, damping = -pair[first + PULL], -0.5 * pair[first + PULL + 1]
    curvature, rate = 0.125 * stiffness * angle * angle, damping * angle
    bend = (0.5 * rate + curvature) / (1.0 - rate - curvature)
    place_sag, speed_sag = 0.125 * angle * angle * (1.0 + bend), (0.25 + 0.5 * bend) * angle
    pair[first + BEND], pair[first + PLACE_SAG], pair[first + SPEED_SAG] = (
        bend,
        place_sag,
        speed_sag,
    )
    pair[first + POWER_SAG] = abs(1.0 - stiffness) * place_sag + 2.0 * damping * speed_sag


@lean
def fill_shape(pair, row, i):
    """Fill the motion over the share of a step from rest, with an acceleration that is 0 and grows by 1 a step."""
    first, angle = i * STRUCTURE_ROWS, pair[i * STRUCTURE_ROWS + ANGLE]
    damping, stiffness = -angle * pair[first + PULL + 1], -angle * angle * pair[first + PULL]
    fill_taylor(row, i, SHAPE, int(row[0, TERMS]), 0.0, damping, stiffness, 0.0, 1.0)


@lean
def equation_of(row, i):
    """Return damping, stiffness, drive and constant of ``u'' + damping u' + stiffness u = constant - drive a``."""
    first, last = (0, 1) if row[0, STUCK] else (i, i)
    _, damping, stiffness, force, force_rate = cluster_equation(row, first, last, 0.0, 1.0)
    return damping, stiffness, -force_rate, force + stiffness * row[i, U]


@lean
def write_guard(pair, row, i, equation):
    """Write the clearance of a free pair, or what force contact exerts on structure i over its mass."""
    if not row[0, STUCK]:
        pair[CLOSING], pair[CLOSING + 1] = -1.0, 1.0
        pair[CLOSING + 2] = pair[CLOSING + 3] = pair[FLOOR] = 0.0
        pair[CLOSING + 4] = row[0, GAP]
        return
    damping, stiffness, drive, constant = equation
    sign = -1.0 if i == 0 else 1.0
    own, own_constant = restoring(row, i)
    pair[CLOSING + i] = sign * (own - stiffness)
    pair[CLOSING + 1 - i] = 0.0
    pair[CLOSING + 2] = sign * (2.0 * row[i, RATE] - damping) * math.sqrt(row[0, STIFFNESS])
    pair[CLOSING + 3] = sign * (row[i, PARTICIPATION] - drive)
    pair[CLOSING + 4] = sign * (constant - own_constant)
    pair[FLOOR] = 1e-12 * max(row[0, STIFFNESS], row[1, STIFFNESS])


@lean
def write_phase(pair, row, duration):
    """Write what depends on the phase of a pair: coefficients of the step, guards, limits."""
    for i in range(2):
        write_step(pair, row, i, equation_of(row, i), duration)
        first, side = i * STRUCTURE_ROWS, row[i, PHASE]
        pair[first + LIMIT] = row[i, YIELD] if side == 0 else -math.inf
        pair[first + CENTRE] = row[i, PLASTIC]
        pair[first + SIDE] = side
        write_bounds(pair, first)
        fill_shape(pair, row, i)
    finite = 0 if row[0, MASS] < math.inf else 1
    write_guard(pair, row, finite, equation_of(row, finite))


@lean
def write_constants(pair, row, cosine, sine, duration):
    """Write what stays the same for a pair."""
    row[0, TERMS] = taylor_terms(row, duration)
    pair[COSINE], pair[SINE] = cosine, sine
    for i in range(2):
        first, stiffness, damping = i * STRUCTURE_ROWS, row[i, STIFFNESS], 2.0 * row[i, RATE]
        fill_responses(row, i, ELASTIC, damping, stiffness, duration)
        fill_responses(row, i, YIELDED, damping, stiffness * row[i, HARDENING], duration)
        omega = math.sqrt(stiffness)
        pair[first + OMEGA], pair[first + ANGLE] = omega, omega * duration


@lean
def changes_phase(pair, row):
    """Tell whether a lane's coefficients are no longer those of its pair's phase."""
    changes = (pair[FLOOR] > 0.0) != (row[0, STUCK] != 0.0)
    for i in range(2):
        first = i * STRUCTURE_ROWS
        changes |= pair[first + SIDE] != row[i, PHASE]
        changes |= row[i, PHASE] == 0.0 and pair[first + CENTRE] != row[i, PLASTIC]
    return changes


@lean
def load_pair(pair, row):
    """Copy a pair's state to its row, on which the event code works."""
    for i in range(2):
        first = i * STRUCTURE_ROWS
        row[i, U], row[i, V] = pair[first + PLACE], pair[first + SPEED] * pair[first + OMEGA]
        if row[i, PHASE] != 0.0:
            row[i, PLASTIC] = row[i, U] - row[i, PHASE] * row[i, YIELD]
        row[i, RICHEST] = math.inf  # not asked for


@lean
def store_pair(pair, row, duration):
    """Copy a pair's state back from its row, and what depends on its phase."""
    if changes_phase(pair, row):
        write_phase(pair, row, duration)
    for i in range(2):
        first = i * STRUCTURE_ROWS
        pair[first + PLACE], pair[first + SPEED] = row[i, U], row[i, V] / pair[first + OMEGA]


@lean
def rest(pair):
    """Let a lane go on at rest, without ever being flagged."""
    for first in (0, STRUCTURE_ROWS):
        pair[first + PLACE] = pair[first + SPEED] = 0.0
        pair[first + HIGHEST_PLACE] = pair[first + WIDEST_RADIUS] = math.inf
        pair[first + LIMIT] = math.inf
    for k in range(4):
        pair[CLOSING + k] = 0.0
    pair[CLOSING + 4], pair[FLOOR] = 1.0, 0.0
