"""
Coefficients of a pair in its current phase, and the exchange of its state with its row.

A pair has two tables: ``pair`` (LANE_ROWS,), the numbers of its lane as in ``lanes``, and ``row``
(2, ROW_COLUMNS), its row of structures as in ``pounding_events.motion``, for the event code.
"""

import math

from per_obspy.kernels._jit import lean
from per_obspy.kernels.polynomial_roots import value_and_slope
from per_obspy.kernels.pounding_events.motion import (
    DAMPING_RATE,
    ELASTIC_RESPONSES,
    EVENT_FUNCTION,
    GAP,
    HARDENING,
    IN_CONTACT,
    LARGEST_ENERGY_RADIUS_SQUARED,
    MASS,
    PARTICIPATION,
    PHASE,
    PLASTIC,
    RAMP_RESPONSE,
    RESTITUTION,
    STIFFNESS,
    TAYLOR,
    TERM_COUNT,
    YIELD,
    YIELDED_RESPONSES,
    U,
    V,
    cluster_equation,
    fill_taylor,
    mass_share,
    restoring_force,
    taylor_terms,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    ACCELERATION,
    ACCELERATION_ERROR,
    ANGLE,
    AXIS_COSINE,
    AXIS_SINE,
    CONTACT_FUNCTION,
    CONTACT_ROUNDING,
    DISPLACEMENT,
    DISPLACEMENT_ERROR,
    IMPACT_GROWTH,
    IS_CHANGED,
    MAXIMUM_SO_FAR,
    OMEGA,
    POWER_ERROR,
    RADIUS_SQUARED_SO_FAR,
    STEP_DISPLACEMENT,
    STEP_VELOCITY,
    STRUCTURE_ROWS,
    VELOCITY,
    VELOCITY_ERROR,
    YIELD_CENTRE,
    YIELD_LIMIT,
    YIELD_SIDE,
)


@lean
def fill_responses(row, i, column, damping, stiffness, duration):
    """
    Fill six columns with the responses after a step to unit velocity, unit force and unit ramp.

    Each is displacement and velocity; a unit ramp reaches 1 at the end of the step.
    """
    terms = int(row[0, TERM_COUNT])
    row[i, EVENT_FUNCTION] = 0.0
    for k in range(3):
        # Taylor polynomial of the k-th response, and its value at the end of the step
        velocity = 1.0 * (k == 0)
        force = 1.0 * (k == 1)
        ramp = (k == 2) / duration
        fill_taylor(row, i, EVENT_FUNCTION, terms, velocity, damping, stiffness, force, ramp)
        response, rate = value_and_slope(row, i, EVENT_FUNCTION, terms, duration)
        row[i, column + 2 * k] = response
        row[i, column + 2 * k + 1] = rate


@lean
def write_step(pair, row, i, equation, duration):
    """Write the coefficients of one step of structure i, by its `motion_equation`."""
    damping, stiffness, drive, constant = equation
    first = i * STRUCTURE_ROWS
    omega = math.sqrt(row[i, STIFFNESS])
    pair[IS_CHANGED] = 1.0
    # responses of its phase; a touching pair has its own, for which TAYLOR is free between events
    if row[0, IN_CONTACT]:
        responses = TAYLOR
        if i == 0:
            fill_responses(row, 0, responses, damping, stiffness, duration)
        else:
            # both have one equation, and the first was written before
            for k in range(6):
                row[1, responses + k] = row[0, responses + k]
    else:
        responses = ELASTIC_RESPONSES if row[i, PHASE] == 0.0 else YIELDED_RESPONSES
    # displacement (k = 0) and velocity over omega (k = 1) after a step
    for k in range(2):
        target = first + (STEP_DISPLACEMENT if k == 0 else STEP_VELOCITY)
        by_velocity = row[i, responses + k]
        by_force = row[i, responses + 2 + k]
        by_ramp = row[i, responses + 4 + k]
        scale = 1.0 if k == 0 else 1.0 / omega
        pair[target] = scale * ((1.0 - k) - stiffness * by_force)
        pair[target + 1] = scale * by_velocity * omega
        pair[target + 2] = -scale * drive * (by_force - by_ramp)
        pair[target + 3] = -scale * drive * by_ramp
        pair[target + 4] = scale * constant * by_force
    # acceleration over omega²
    pair[first + ACCELERATION] = -stiffness / row[i, STIFFNESS]
    pair[first + ACCELERATION + 1] = -damping / omega
    pair[first + ACCELERATION + 2] = -drive / row[i, STIFFNESS]
    pair[first + ACCELERATION + 3] = constant / row[i, STIFFNESS]


@lean
def write_error_bounds(pair, first):
    """
    Write the error bounds of a structure's chords inside a step, over the acceleration at its ends.

    With time as the angle omega t, the acceleration y obeys y'' + 2 b y' + k y = 0 in a step,
    because that of the ground is linear. As |y'| leaves its mean, at most 2 / angle times the
    larger |y| of both ends, by half a step times |y''|, and y its chord by an eighth of the step
    squared times |y''|, that is at most ``8 error / angle²`` times that |y|; and the power is
    ``(1 - k) u - 2 b u'`` plus a linear function.
    """
    angle = pair[first + ANGLE]
    stiffness = -pair[first + ACCELERATION]
    damping = -0.5 * pair[first + ACCELERATION + 1]
    # bound of |y| inside the step, over the larger |y| at its ends, less one
    curvature = 0.125 * stiffness * angle * angle
    rate = damping * angle
    error = (0.5 * rate + curvature) / (1.0 - rate - curvature)
    # by it the bounds of displacement, velocity and power
    displacement_error = 0.125 * angle * angle * (1.0 + error)
    velocity_error = (0.25 + 0.5 * error) * angle
    power_error = abs(1.0 - stiffness) * displacement_error + 2.0 * damping * velocity_error
    pair[first + ACCELERATION_ERROR] = error
    pair[first + DISPLACEMENT_ERROR] = displacement_error
    pair[first + VELOCITY_ERROR] = velocity_error
    pair[first + POWER_ERROR] = power_error


@lean
def fill_ramp_response(pair, row, i):
    """Fill the response of structure i to an acceleration that is 0 and grows by 1 per step."""
    first = i * STRUCTURE_ROWS
    angle = pair[first + ANGLE]
    # time is the share of a step
    damping = -angle * pair[first + ACCELERATION + 1]
    stiffness = -angle * angle * pair[first + ACCELERATION]
    fill_taylor(row, i, RAMP_RESPONSE, int(row[0, TERM_COUNT]), 0.0, damping, stiffness, 0.0, 1.0)


@lean
def motion_equation(row, i):
    """
    Return damping, stiffness, drive and constant of structure i in its phase.

    The equation is ``u'' + damping u' + stiffness u = constant - drive * ground acceleration``;
    touching structures share it.
    """
    first, last = (0, 1) if row[0, IN_CONTACT] else (i, i)
    _, damping, stiffness, force, force_rate = cluster_equation(row, first, last, 0.0, 1.0)
    return damping, stiffness, -force_rate, force + stiffness * row[i, U]


@lean
def write_contact_function(pair, row, i, equation):
    """Write the clearance of a free pair, or the contact force on structure i over its mass."""
    # free: gap - u1 + u2
    if not row[0, IN_CONTACT]:
        pair[CONTACT_FUNCTION] = -1.0
        pair[CONTACT_FUNCTION + 1] = 1.0
        pair[CONTACT_FUNCTION + 2] = 0.0
        pair[CONTACT_FUNCTION + 3] = 0.0
        pair[CONTACT_ROUNDING] = 0.0
        pair[CONTACT_FUNCTION + 4] = row[0, GAP]
        return
    # touching: common acceleration less that of the structure alone, positive in compression
    damping, stiffness, drive, constant = equation
    sign = -1.0 if i == 0 else 1.0
    own_stiffness, own_constant = restoring_force(row, i)
    own_damping = 2.0 * row[i, DAMPING_RATE]
    pair[CONTACT_FUNCTION + i] = sign * (own_stiffness - stiffness)
    pair[CONTACT_FUNCTION + 1 - i] = 0.0
    pair[CONTACT_FUNCTION + 2] = sign * (own_damping - damping) * math.sqrt(row[0, STIFFNESS])
    pair[CONTACT_FUNCTION + 3] = sign * (row[i, PARTICIPATION] - drive)
    pair[CONTACT_FUNCTION + 4] = sign * (constant - own_constant)
    pair[CONTACT_ROUNDING] = 1e-12 * max(row[0, STIFFNESS], row[1, STIFFNESS])


@lean
def write_branch(pair, row, i, duration):
    """
    Write all numbers of a lane that depend on the branch of structure i.

    These are the coefficients of the step, elastic range and error bounds; ``duration`` is that of
    a step, s.
    """
    write_step(pair, row, i, motion_equation(row, i), duration)
    # elastic range, which a yielding structure cannot leave
    first = i * STRUCTURE_ROWS
    side = row[i, PHASE]
    pair[first + YIELD_LIMIT] = row[i, YIELD] if side == 0 else math.inf
    pair[first + YIELD_CENTRE] = row[i, PLASTIC]
    pair[first + YIELD_SIDE] = side
    write_error_bounds(pair, first)
    fill_ramp_response(pair, row, i)


@lean
def write_phase(pair, row, duration):
    """Write all numbers of a lane that depend on the phase of its pair: branches and contact."""
    for i in range(2):
        write_branch(pair, row, i, duration)
    # contact force from the structure that is no wall
    finite = 0 if row[0, MASS] < math.inf else 1
    write_contact_function(pair, row, finite, motion_equation(row, finite))


@lean
def write_constants(pair, row, cosine, sine, duration):
    """Write all numbers of a lane and its row that never change, for steps of a duration, s."""
    row[0, TERM_COUNT] = taylor_terms(row, duration)
    pair[AXIS_COSINE] = cosine
    pair[AXIS_SINE] = sine
    for i in range(2):
        # responses of the elastic and of the yielding structure
        first = i * STRUCTURE_ROWS
        stiffness = row[i, STIFFNESS]
        damping = 2.0 * row[i, DAMPING_RATE]
        yielded = stiffness * row[i, HARDENING]
        fill_responses(row, i, ELASTIC_RESPONSES, damping, stiffness, duration)
        fill_responses(row, i, YIELDED_RESPONSES, damping, yielded, duration)
        omega = math.sqrt(stiffness)
        pair[first + OMEGA] = omega
        pair[first + ANGLE] = omega * duration
        # impact by (7) and (8): the other structure's share of the mass
        change = (1.0 + row[0, RESTITUTION]) * mass_share(row, 0, 1, 1 - i)
        pair[IMPACT_GROWTH + i] = (change if i else -change) / omega


@lean
def has_new_phase(pair, row):
    """Return whether the coefficients of a lane no longer belong to the phase of its row."""
    # contact, phase and plastic displacement
    is_new = (pair[CONTACT_ROUNDING] > 0.0) != (row[0, IN_CONTACT] != 0.0)
    for i in range(2):
        first = i * STRUCTURE_ROWS
        is_new |= pair[first + YIELD_SIDE] != row[i, PHASE]
        is_new |= row[i, PHASE] == 0.0 and pair[first + YIELD_CENTRE] != row[i, PLASTIC]
    return is_new


@lean
def load_pair(pair, row):
    """Copy the state of a pair from its lane to its row."""
    for i in range(2):
        first = i * STRUCTURE_ROWS
        row[i, U] = pair[first + DISPLACEMENT]
        row[i, V] = pair[first + VELOCITY] * pair[first + OMEGA]
        if row[i, PHASE] != 0.0:
            row[i, PLASTIC] = row[i, U] - row[i, PHASE] * row[i, YIELD]
        # the energy radius is not computed for lanes
        row[i, LARGEST_ENERGY_RADIUS_SQUARED] = math.inf


@lean
def store_pair(pair, row, duration):
    """Copy the state of a pair from its row to its lane, with the coefficients of a new phase."""
    if has_new_phase(pair, row):
        write_phase(pair, row, duration)
    for i in range(2):
        first = i * STRUCTURE_ROWS
        pair[first + DISPLACEMENT] = row[i, U]
        pair[first + VELOCITY] = row[i, V] / pair[first + OMEGA]


@lean
def rest_pair(pair):
    """Set a lane to rest for good: it is never flagged again."""
    for first in (0, STRUCTURE_ROWS):
        pair[first + DISPLACEMENT] = 0.0
        pair[first + VELOCITY] = 0.0
        # no maximum can be passed, no elastic range left
        pair[first + MAXIMUM_SO_FAR] = math.inf
        pair[first + RADIUS_SQUARED_SO_FAR] = math.inf
        pair[first + YIELD_LIMIT] = math.inf
        pair[first + YIELD_SIDE] = 0.0
    # the contact function is always 1
    for k in range(4):
        pair[CONTACT_FUNCTION + k] = 0.0
    pair[CONTACT_FUNCTION + 4] = 1.0
    pair[CONTACT_ROUNDING] = 0.0
