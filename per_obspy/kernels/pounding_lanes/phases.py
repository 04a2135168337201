"""
Coefficients of the buildings of a row in their current phases, and the exchange with its lines.

A row has two tables: ``members`` (n_buildings * STRUCTURE_ROWS,), the numbers of its lanes as in
``lanes``, one building after the other, and ``row`` (n_buildings, ROW_COLUMNS), its lines as in
``pounding_events.motion``, for the event code. Buildings in contact form a cluster, whose members
share one equation of motion.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.polynomial_roots import value_and_slope
from per_obspy.kernels.pounding_events.motion import (
    DAMPING_RATE,
    ELASTIC_RESPONSES,
    EVENT_FUNCTION,
    GAP,
    HARDENING,
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
    last_of_cluster,
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
    CLUSTER_FIRST,
    CLUSTER_LAST,
    CONTACT_FUNCTION,
    CONTACT_ROUNDING,
    DISPLACEMENT,
    DISPLACEMENT_ERROR,
    IMPACT_GROWTH,
    IS_CHANGED,
    IS_STEP_OUTDATED,
    LARGEST_RATE,
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

#: Rounding of a contact force, over the stiffness times displacement.
FORCE_ROUNDING = 1e-12


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


@inlined
def _equation_of(row, first, last):
    """
    Return damping, stiffness, drive and force of a cluster: without ground acceleration, now.

    The equation of building i is ``u'' + damping u' + stiffness (u - u_i) = force - drive * ground
    acceleration``, with its displacement u_i now.
    """
    _, damping, stiffness, force, force_rate = cluster_equation(row, first, last, 0.0, 1.0)
    return damping, stiffness, -force_rate, force


@lean
def _write_step(members, row, first, last, i, equation, duration):
    """Write the coefficients of one step of building i, by the equation of its cluster."""
    damping, stiffness, drive, force = equation
    constant = force + stiffness * row[i, U]
    own = i * STRUCTURE_ROWS
    omega = members[own + OMEGA]
    # responses of its phase; a cluster has its own, for which TAYLOR is free between events
    responses = ELASTIC_RESPONSES if row[i, PHASE] == 0.0 else YIELDED_RESPONSES
    if first < last:
        responses = TAYLOR
        if i == first:
            fill_responses(row, i, responses, damping, stiffness, duration)
        else:
            # all have one equation, and the first was written before
            for k in range(6):
                row[i, responses + k] = row[first, responses + k]
    # displacement (k = 0) and velocity over omega (k = 1) after a step
    for k in range(2):
        target = own + (STEP_DISPLACEMENT if k == 0 else STEP_VELOCITY)
        by_velocity = row[i, responses + k]
        by_force = row[i, responses + 2 + k]
        by_ramp = row[i, responses + 4 + k]
        scale = 1.0 if k == 0 else 1.0 / omega
        members[target] = scale * ((1.0 - k) - stiffness * by_force)
        members[target + 1] = scale * by_velocity * omega
        members[target + 2] = -scale * drive * (by_force - by_ramp)
        members[target + 3] = -scale * drive * by_ramp
        members[target + 4] = scale * constant * by_force
    members[own + IS_STEP_OUTDATED] = 0.0


@lean
def write_error_bounds(members, own):
    """
    Write the error bounds of a building's chords inside a step, over the acceleration at its ends.

    With time as the angle omega t, the acceleration y obeys y'' + 2 b y' + k y = 0 in a step,
    because that of the ground is linear. As |y'| leaves its mean, at most 2 / angle times the
    larger |y| of both ends, by half a step times |y''|, and y its chord by an eighth of the step
    squared times |y''|, that is at most ``8 error / angle²`` times that |y|; and the power is
    ``(1 - k) u - 2 b u'`` plus a linear function.
    """
    angle = members[own + ANGLE]
    stiffness = -members[own + ACCELERATION]
    damping = -0.5 * members[own + ACCELERATION + 1]
    # bound of |y| inside the step, over the larger |y| at its ends, less one
    curvature = 0.125 * stiffness * angle * angle
    rate = damping * angle
    error = (0.5 * rate + curvature) / (1.0 - rate - curvature)
    # by it the bounds of displacement, velocity and power
    displacement_error = 0.125 * angle * angle * (1.0 + error)
    velocity_error = (0.25 + 0.5 * error) * angle
    power_error = abs(1.0 - stiffness) * displacement_error + 2.0 * damping * velocity_error
    members[own + ACCELERATION_ERROR] = error
    members[own + DISPLACEMENT_ERROR] = displacement_error
    members[own + VELOCITY_ERROR] = velocity_error
    members[own + POWER_ERROR] = power_error


@lean
def _write_clearance(members, row, j):
    """Write the clearance of an open interface; that after the last building is always 1."""
    # gap - u_left + u_right
    own = j * STRUCTURE_ROWS
    is_last = j == row.shape[0] - 1
    members[own + CONTACT_FUNCTION] = 0.0 if is_last else -1.0
    members[own + CONTACT_FUNCTION + 1] = 0.0 if is_last else 1.0
    members[own + CONTACT_FUNCTION + 2] = 0.0
    members[own + CONTACT_FUNCTION + 3] = 0.0
    members[own + CONTACT_FUNCTION + 4] = 1.0 if is_last else row[j, GAP]
    members[own + CONTACT_ROUNDING] = 0.0


@lean
def _write_contact_force(members, row, first, last, j, equation):
    """
    Write the force of a closed interface over the mass on one side, positive in compression.

    The members on the left, or on the right if a wall (infinite mass) is among those, need it to
    move with the cluster.
    """
    damping, stiffness, drive, force = equation
    constant = force + stiffness * row[j, U]
    # the side without a wall
    begin = first
    end = j
    sign = -1.0
    for i in range(first, j + 1):
        if row[i, MASS] == math.inf:
            begin = j + 1
            end = last
            sign = 1.0
    # sums of the outer forces, by displacement and velocity of building j
    mass = by_displacement = by_velocity = by_ground = rest = largest = 0.0
    for i in range(begin, end + 1):
        own_stiffness, own_constant = restoring_force(row, i)
        mass += row[i, MASS]
        by_displacement += row[i, MASS] * (own_stiffness - stiffness)
        by_velocity += row[i, MASS] * (2.0 * row[i, DAMPING_RATE] - damping)
        by_ground += row[i, MASS] * (row[i, PARTICIPATION] - drive)
        offset = own_stiffness * (row[i, U] - row[j, U])
        rest += row[i, MASS] * (constant + offset - own_constant)
    # its rounding is that of the stiffest member
    for i in range(first, last + 1):
        largest = max(largest, row[i, STIFFNESS])
    # as a function of the motion of building j
    target = j * STRUCTURE_ROWS + CONTACT_FUNCTION
    members[target] = sign * by_displacement / mass
    members[target + 1] = 0.0
    members[target + 2] = sign * by_velocity / mass * math.sqrt(row[j, STIFFNESS])
    members[target + 3] = sign * by_ground / mass
    members[target + 4] = sign * rest / mass
    members[j * STRUCTURE_ROWS + CONTACT_ROUNDING] = FORCE_ROUNDING * largest


@lean
def _write_phase(members, row, first, last, i, equation):
    """
    Write the numbers of building i that depend on its phase and cluster.

    These are the coefficients of the acceleration, elastic range, error bounds, contact function
    and response to a ramp; those of a complete step are left to ``write_steps``.
    """
    damping, stiffness, drive, force = equation
    own = i * STRUCTURE_ROWS
    omega = members[own + OMEGA]
    angle = members[own + ANGLE]
    # acceleration over omega², by displacement, velocity and ground, and its constant
    members[own + ACCELERATION] = -stiffness / row[i, STIFFNESS]
    members[own + ACCELERATION + 1] = -damping / omega
    members[own + ACCELERATION + 2] = -drive / row[i, STIFFNESS]
    members[own + ACCELERATION + 3] = (force + stiffness * row[i, U]) / row[i, STIFFNESS]
    # elastic range, which a yielding structure cannot leave
    members[own + YIELD_LIMIT] = row[i, YIELD] if row[i, PHASE] == 0.0 else math.inf
    members[own + YIELD_CENTRE] = row[i, PLASTIC]
    members[own + YIELD_SIDE] = row[i, PHASE]
    write_error_bounds(members, own)
    # interface to the next building
    if i < last:
        _write_contact_force(members, row, first, last, i, equation)
    else:
        _write_clearance(members, row, i)
    # response to an acceleration that is 0 and grows by 1 per step; time is the share of a step
    damping = -angle * members[own + ACCELERATION + 1]
    stiffness = -angle * angle * members[own + ACCELERATION]
    fill_taylor(row, i, RAMP_RESPONSE, int(row[0, TERM_COUNT]), 0.0, damping, stiffness, 0.0, 1.0)
    members[own + CLUSTER_FIRST] = first
    members[own + CLUSTER_LAST] = last
    members[own + IS_STEP_OUTDATED] = 1.0
    members[own + IS_CHANGED] = 1.0


@inlined
def write_branch(members, row, i, duration):
    """Write all numbers that depend on the branch of a building without contact, for a step, s."""
    equation = _equation_of(row, i, i)
    _write_phase(members, row, i, i, i, equation)
    _write_step(members, row, i, i, i, equation, duration)


@lean
def update_phases(members, row):
    """Write the numbers of buildings in a new phase or cluster; return whether there is one."""
    is_any = False
    first = 0
    while first < row.shape[0]:
        # the same cluster in the same phases keeps its coefficients
        last = last_of_cluster(row, first)
        is_new = False
        for i in range(first, last + 1):
            own = i * STRUCTURE_ROWS
            is_new |= members[own + CLUSTER_FIRST] != first
            is_new |= members[own + CLUSTER_LAST] != last
            is_new |= members[own + YIELD_SIDE] != row[i, PHASE]
            is_new |= row[i, PHASE] == 0.0 and members[own + YIELD_CENTRE] != row[i, PLASTIC]
        if is_new:
            # one equation for all of it
            equation = _equation_of(row, first, last)
            for i in range(first, last + 1):
                _write_phase(members, row, first, last, i, equation)
        is_any |= is_new
        first = last + 1
    return is_any


@lean
def write_steps(members, row, duration):
    """Write the coefficients of a step, s, of the buildings in a new phase."""
    first = 0
    while first < row.shape[0]:
        last = last_of_cluster(row, first)
        if members[first * STRUCTURE_ROWS + IS_STEP_OUTDATED]:
            equation = _equation_of(row, first, last)
            for i in range(first, last + 1):
                _write_step(members, row, first, last, i, equation, duration)
        first = last + 1


@lean
def write_constants(members, row, cosine, sine, duration):
    """Write all numbers of a row at rest, for steps of a duration, s."""
    terms = taylor_terms(row, duration)
    members[:] = 0.0
    largest = 0.0
    for i in range(row.shape[0]):
        own = i * STRUCTURE_ROWS
        row[i, TERM_COUNT] = terms
        stiffness = row[i, STIFFNESS]
        damping = 2.0 * row[i, DAMPING_RATE]
        omega = math.sqrt(stiffness)
        # direction, frequency and angle of a step
        members[own + AXIS_COSINE] = cosine
        members[own + AXIS_SINE] = sine
        members[own + OMEGA] = omega
        members[own + ANGLE] = omega * duration
        members[own + CLUSTER_FIRST] = -1.0
        largest = max(largest, omega + row[i, DAMPING_RATE])
        # responses of the elastic and of the yielding building
        yielded = stiffness * row[i, HARDENING]
        fill_responses(row, i, ELASTIC_RESPONSES, damping, stiffness, duration)
        fill_responses(row, i, YIELDED_RESPONSES, damping, yielded, duration)
        # impact of two by (7) and (8): the other structure's share of the mass
        if row.shape[0] == 2:
            change = (1.0 + row[0, RESTITUTION]) * mass_share(row, 0, 1, 1 - i)
            members[own + IMPACT_GROWTH] = (change if i else -change) / omega
    members[LARGEST_RATE] = largest * duration
    update_phases(members, row)
    write_steps(members, row, duration)


@lean
def load_row(members, row):
    """Copy the states of the buildings from the numbers of their lanes to the row."""
    for i in range(row.shape[0]):
        own = i * STRUCTURE_ROWS
        row[i, U] = members[own + DISPLACEMENT]
        row[i, V] = members[own + VELOCITY] * members[own + OMEGA]
        if row[i, PHASE] != 0.0:
            row[i, PLASTIC] = row[i, U] - row[i, PHASE] * row[i, YIELD]
        # the energy radius is not computed for lanes
        row[i, LARGEST_ENERGY_RADIUS_SQUARED] = math.inf


@lean
def store_row(members, row, duration):
    """Copy the states from the row to the numbers of its lanes, with those of new phases."""
    if update_phases(members, row):
        write_steps(members, row, duration)
    for i in range(row.shape[0]):
        own = i * STRUCTURE_ROWS
        members[own + DISPLACEMENT] = row[i, U]
        members[own + VELOCITY] = row[i, V] / members[own + OMEGA]


@lean
def rest_row(members, count):
    """Set the lanes of so many buildings to rest for good: they are never flagged again."""
    for i in range(count):
        own = i * STRUCTURE_ROWS
        members[own + DISPLACEMENT] = 0.0
        members[own + VELOCITY] = 0.0
        # no maximum can be passed, no elastic range left
        members[own + MAXIMUM_SO_FAR] = math.inf
        members[own + RADIUS_SQUARED_SO_FAR] = math.inf
        members[own + YIELD_LIMIT] = math.inf
        members[own + YIELD_SIDE] = 0.0
        # the contact function is always 1
        for k in range(4):
            members[own + CONTACT_FUNCTION + k] = 0.0
        members[own + CONTACT_FUNCTION + 4] = 1.0
        members[own + CONTACT_ROUNDING] = 0.0
