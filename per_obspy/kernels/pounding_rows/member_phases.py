"""
Coefficients of the buildings of a row in their current phases, and the exchange with its lines.

A row has two tables: ``members`` (n_buildings, LANE_ROWS), the numbers of its lanes as in
``pounding_lanes.lanes``, and ``row`` (n_buildings, ROW_COLUMNS), its lines as in
``pounding_events.motion``, for the event code. Buildings in contact form a cluster, whose members
share one equation of motion.
"""

import math

from per_obspy.kernels._jit import lean
from per_obspy.kernels.pounding_events.motion import (
    DAMPING_RATE,
    ELASTIC_RESPONSES,
    GAP,
    HARDENING,
    LARGEST_ENERGY_RADIUS_SQUARED,
    MASS,
    PARTICIPATION,
    PHASE,
    PLASTIC,
    STIFFNESS,
    TAYLOR,
    TERM_COUNT,
    YIELD,
    YIELDED_RESPONSES,
    U,
    V,
    cluster_equation,
    last_of_cluster,
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
    OMEGA,
    STEP_DISPLACEMENT,
    STEP_VELOCITY,
    STRUCTURE_ROWS,
    VELOCITY,
    YIELD_CENTRE,
    YIELD_LIMIT,
    YIELD_SIDE,
)
from per_obspy.kernels.pounding_lanes.pair_rows import (
    fill_responses,
    write_error_bounds,
)

# rows of a lane that structure 2 has in ``lanes``
#: first and last member of the cluster for which the coefficients were written, and whether they
#: have to be written again
CLUSTER_FIRST, CLUSTER_LAST, IS_OUTDATED = 43, 44, 45
#: whether the coefficients of a step have to be written again
IS_STEP_OUTDATED = 46
#: largest rate of the row times the duration of a step; first member only
LARGEST_RATE = 47

#: Rounding of a contact force, over the stiffness times displacement.
FORCE_ROUNDING = 1e-12


@lean
def _write_step(member, row, i, is_alone, equation, duration):
    """Write the coefficients of one step of building i, by the equation of its cluster."""
    damping, stiffness, drive, constant = equation
    omega = math.sqrt(row[i, STIFFNESS])
    # responses of its phase; a cluster has its own, for which TAYLOR is free between events
    responses = ELASTIC_RESPONSES if row[i, PHASE] == 0.0 else YIELDED_RESPONSES
    if not is_alone:
        responses = TAYLOR
        fill_responses(row[i : i + 1], 0, responses, damping, stiffness, duration)
    # displacement (k = 0) and velocity over omega (k = 1) after a step
    for k in range(2):
        target = STEP_DISPLACEMENT if k == 0 else STEP_VELOCITY
        by_velocity = row[i, responses + k]
        by_force = row[i, responses + 2 + k]
        by_ramp = row[i, responses + 4 + k]
        scale = 1.0 if k == 0 else 1.0 / omega
        member[target] = scale * ((1.0 - k) - stiffness * by_force)
        member[target + 1] = scale * by_velocity * omega
        member[target + 2] = -scale * drive * (by_force - by_ramp)
        member[target + 3] = -scale * drive * by_ramp
        member[target + 4] = scale * constant * by_force


@lean
def _write_acceleration(member, row, i, equation):
    """Write the coefficients of the acceleration of building i over omega²."""
    damping, stiffness, drive, constant = equation
    omega = math.sqrt(row[i, STIFFNESS])
    # by displacement, velocity and ground, and the constant
    member[ACCELERATION] = -stiffness / row[i, STIFFNESS]
    member[ACCELERATION + 1] = -damping / omega
    member[ACCELERATION + 2] = -drive / row[i, STIFFNESS]
    member[ACCELERATION + 3] = constant / row[i, STIFFNESS]


@lean
def _equation_of(row, first, last, i):
    """
    Return damping, stiffness, drive and constant of building i in its cluster.

    The equation is ``u'' + damping u' + stiffness u = constant - drive * ground acceleration``.
    """
    _, damping, stiffness, force, force_rate = cluster_equation(row, first, last, 0.0, 1.0)
    return damping, stiffness, -force_rate, force + stiffness * row[i, U]


@lean
def _write_clearance(member, row, j):
    """Write the clearance of an open interface; that after the last building is always 1."""
    # gap - u_left + u_right
    is_last = j == row.shape[0] - 1
    member[CONTACT_FUNCTION] = 0.0 if is_last else -1.0
    member[CONTACT_FUNCTION + 1] = 0.0 if is_last else 1.0
    member[CONTACT_FUNCTION + 2] = 0.0
    member[CONTACT_FUNCTION + 3] = 0.0
    member[CONTACT_FUNCTION + 4] = 1.0 if is_last else row[j, GAP]
    member[CONTACT_ROUNDING] = 0.0


@lean
def _write_contact_force(member, row, first, last, j, equation):
    """
    Write the force of a closed interface over the mass on one side, positive in compression.

    The members on the left, or on the right if a wall (infinite mass) is among those, need it to
    move with the cluster.
    """
    damping, stiffness, drive, constant = equation
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
    member[CONTACT_FUNCTION] = sign * by_displacement / mass
    member[CONTACT_FUNCTION + 1] = 0.0
    member[CONTACT_FUNCTION + 2] = sign * by_velocity / mass * math.sqrt(row[j, STIFFNESS])
    member[CONTACT_FUNCTION + 3] = sign * by_ground / mass
    member[CONTACT_FUNCTION + 4] = sign * rest / mass
    member[CONTACT_ROUNDING] = FORCE_ROUNDING * largest


@lean
def _mark_outdated(members, row):
    """Note which members need new coefficients; return whether any does."""
    is_any = False
    first = 0
    while first < row.shape[0]:
        # the same cluster in the same phases keeps its coefficients
        last = last_of_cluster(row, first)
        is_new = False
        for i in range(first, last + 1):
            is_new |= members[i, CLUSTER_FIRST] != first
            is_new |= members[i, CLUSTER_LAST] != last
            is_new |= members[i, YIELD_SIDE] != row[i, PHASE]
            is_new |= row[i, PHASE] == 0.0 and members[i, YIELD_CENTRE] != row[i, PLASTIC]
        for i in range(first, last + 1):
            members[i, IS_OUTDATED] = is_new
        is_any |= is_new
        first = last + 1
    return is_any


@lean
def write_phases(members, row):
    """
    Write the numbers of the members that depend on phase and contact, where these are new.

    These are the coefficients of the acceleration, elastic range, error bounds and contact
    function; those of a complete step are left to ``write_steps``.
    """
    first = 0
    while first < row.shape[0]:
        last = last_of_cluster(row, first)
        for i in range(first, last + 1):
            if members[i, IS_OUTDATED]:
                member = members[i]
                equation = _equation_of(row, first, last, i)
                _write_acceleration(member, row, i, equation)
                member[IS_STEP_OUTDATED] = 1.0
                # elastic range; a yielding structure is always looked at
                side = row[i, PHASE]
                member[YIELD_LIMIT] = row[i, YIELD] if side == 0 else -math.inf
                member[YIELD_CENTRE] = row[i, PLASTIC]
                member[YIELD_SIDE] = side
                write_error_bounds(member, 0)
                # interface to the next building
                if i < last:
                    _write_contact_force(member, row, first, last, i, equation)
                else:
                    _write_clearance(member, row, i)
                member[CLUSTER_FIRST] = first
                member[CLUSTER_LAST] = last
                # structure 2 of the interface on the left
                if i > 0:
                    for k in range(ACCELERATION, ACCELERATION_ERROR + 1):
                        members[i - 1, STRUCTURE_ROWS + k] = member[k]
        first = last + 1


@lean
def update_phases(members, row):
    """Write the numbers of new phases; return whether there is one."""
    is_any = _mark_outdated(members, row)
    if is_any:
        write_phases(members, row)
    return is_any


@lean
def write_steps(members, row, duration):
    """Write the coefficients of a step, s, of the members in a new phase, if it lasts so long."""
    first = 0
    while first < row.shape[0]:
        last = last_of_cluster(row, first)
        for i in range(first, last + 1):
            # those that have changed their phase since the last complete step
            if members[i, IS_STEP_OUTDATED]:
                equation = _equation_of(row, first, last, i)
                _write_step(members[i], row, i, first == last, equation, duration)
                members[i, IS_STEP_OUTDATED] = 0.0
        first = last + 1


@lean
def _largest_rate(row):
    """Return the largest rate of the motion of a row, as ``taylor_terms`` has it, 1/s."""
    largest = 0.0
    for i in range(row.shape[0]):
        largest = max(largest, math.sqrt(row[i, STIFFNESS]) + row[i, DAMPING_RATE])
    return largest


@lean
def write_constants(members, row, cosine, sine, duration):
    """Write all numbers of a row at rest, for steps of a duration, s."""
    terms = taylor_terms(row, duration)
    members[: row.shape[0], :] = 0.0
    for i in range(row.shape[0]):
        member = members[i]
        row[i, TERM_COUNT] = terms
        member[AXIS_COSINE] = cosine
        member[AXIS_SINE] = sine
        # responses of the elastic and of the yielding building
        one = row[i : i + 1]
        stiffness = row[i, STIFFNESS]
        damping = 2.0 * row[i, DAMPING_RATE]
        yielded = stiffness * row[i, HARDENING]
        fill_responses(one, 0, ELASTIC_RESPONSES, damping, stiffness, duration)
        fill_responses(one, 0, YIELDED_RESPONSES, damping, yielded, duration)
        # frequency, and the angle of a step
        omega = math.sqrt(stiffness)
        member[OMEGA] = omega
        member[ANGLE] = omega * duration
        member[IS_OUTDATED] = 1.0
    members[0, LARGEST_RATE] = _largest_rate(row) * duration
    write_phases(members, row)
    write_steps(members, row, duration)


@lean
def load_row(members, row):
    """Copy the states of the buildings from their lanes to the row."""
    for i in range(row.shape[0]):
        row[i, U] = members[i, DISPLACEMENT]
        row[i, V] = members[i, VELOCITY] * members[i, OMEGA]
        if row[i, PHASE] != 0.0:
            row[i, PLASTIC] = row[i, U] - row[i, PHASE] * row[i, YIELD]
        # the energy radius is not computed for lanes
        row[i, LARGEST_ENERGY_RADIUS_SQUARED] = math.inf
