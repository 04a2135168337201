"""
What happens at the instant of a contact: stereomechanical impacts, and which interfaces stay closed.

Impacts are pairwise and sequential, from left to right, repeated until no touching pair approaches.
Interfaces that touch without speed then stay closed where the forces that keep them closed are
compressive. Bounces end, and an interface may stay closed, when it separates slower than STILL
(m/s), or slower than DELAY (s) times its closing acceleration, or after MOST_BOUNCES impacts in a
segment.
"""

import math

from per_obspy.kernels._jit import lean
from per_obspy.kernels.pounding_events.motion import (
    APPROACH,
    BOUNCES,
    CURVE,
    DELAY,
    GAP,
    GIVEN,
    IMPACTS,
    LINGERING,
    MASS,
    MOST_BOUNCES,
    ORDER,
    PARTICIPATION,
    PHASE,
    PLASTIC,
    RATE,
    RESTITUTION,
    STILL,
    STUCK,
    UNLOADING,
    YIELD,
    U,
    V,
    fill_curves,
    last_in_contact,
    mass_share,
    restoring,
    size_of_forces,
)

# columns of the log of impacts, one line an impact as long as there is room
TIME, LEFT, BEFORE_1, AFTER_1, BEFORE_2, AFTER_2, IMPULSE, PLACE_1, PLACE_2 = range(9)
LOG_COLUMNS = 9
#: Clearance below which two structures touch at the instant of another contact, relative to
#: displacements and gap.
TOUCH = 1e-12
#: Opening acceleration, relative to the forces per unit mass, that is rounding.
PRESSED = 1e-14


@lean
def touches(row, interface):
    """Tell whether an interface is closed or has no clearance."""
    if row[interface, STUCK] or row[interface, ORDER] > 0:
        return True
    left, right = row[interface, U], row[interface + 1, U]
    clearance = row[interface, GAP] - left + right
    return clearance <= TOUCH * (abs(left) + abs(right) + row[interface, GAP])


@lean
def write_impact(log, row, j, time, impulse, before_1, before_2):
    """Write an impact that has just changed the velocities to the log, if it has room."""
    count = 0.0
    for k in range(row.shape[0] - 1):
        count += row[k, IMPACTS]
    if count < log.shape[0]:
        line = int(count)
        log[line, TIME], log[line, LEFT], log[line, IMPULSE] = time, j, impulse
        log[line, BEFORE_1], log[line, AFTER_1], log[line, PLACE_1] = before_1, row[j, V], row[j, U]
        log[line, BEFORE_2], log[line, AFTER_2], log[line, PLACE_2] = (
            before_2,
            row[j + 1, V],
            row[j + 1, U],
        )


@lean
def strike(row, log, j, time):
    """Let the two structures of an interface hit each other."""
    before_1, before_2 = row[j, V], row[j + 1, V]
    approach = before_1 - before_2
    change = (1.0 + row[j, RESTITUTION]) * approach
    after_1 = before_1 - change * mass_share(row, j, j + 1, j + 1)
    after_2 = before_2 + change * mass_share(row, j, j + 1, j)
    if row[j, MASS] < math.inf:
        impulse = row[j, MASS] * (before_1 - after_1)
    else:
        impulse = row[j + 1, MASS] * (after_2 - before_2)
    row[j, V], row[j + 1, V] = after_1, after_2
    row[j, GIVEN] += 0.5 * impulse * (before_1 + after_1)
    row[j + 1, GIVEN] -= 0.5 * impulse * (before_2 + after_2)
    row[j, APPROACH] = max(row[j, APPROACH], approach)
    write_impact(log, row, j, time, impulse, before_1, before_2)
    row[j, IMPACTS] += 1.0
    row[0, BOUNCES] += 1.0


@lean
def strike_all(row, log, hit, time):
    """Let touching pairs hit each other, from left to right, until none approaches."""
    approaching = True
    while approaching:
        approaching = False
        for j in range(row.shape[0] - 1):
            if row[j, V] - row[j + 1, V] > row[0, STILL] and (j == hit or touches(row, j)):
                strike(row, log, j, time)
                approaching = row[0, BOUNCES] < row[0, MOST_BOUNCES]


@lean
def free_acceleration(row, i, acceleration):
    """Return the acceleration that a structure has by itself."""
    stiffness, constant = restoring(row, i)
    damping = 2.0 * row[i, RATE] * row[i, V]
    return constant - stiffness * row[i, U] - damping - row[i, PARTICIPATION] * acceleration


@lean
def lingers(row, interface, acceleration):
    """Tell whether a touching pair separates so slowly that it may stay in contact."""
    separation = row[interface + 1, V] - row[interface, V]
    if separation <= row[0, STILL] or row[0, BOUNCES] >= row[0, MOST_BOUNCES]:
        return True
    closing = free_acceleration(row, interface, acceleration) - free_acceleration(
        row, interface + 1, acceleration
    )
    return separation <= row[0, DELAY] * closing


@lean
def close_pressed(row, acceleration, slope, duration):
    """
    Close lingering interfaces whose structures would accelerate into each other, until none would.

    Closing one never makes the force of another tensile (their matrix is an M-matrix), so none has
    to open again.
    """
    closed = True
    while closed:
        closed = False
        fill_curves(row, acceleration, 0.0, 4)
        for j in range(row.shape[0] - 1):
            if row[j, LINGERING] and not row[j, STUCK]:
                opening = 2.0 * (row[j + 1, CURVE + 2] - row[j, CURVE + 2])
                size = size_of_forces(row, j, acceleration, slope, duration)
                size += size_of_forces(row, j + 1, acceleration, slope, duration)
                if opening <= PRESSED * size:
                    row[j, STUCK] = 1.0
                    closed = True


@lean
def join(row, first, last):
    """Give a cluster its common velocity, by momentum."""
    common = 0.0
    for i in range(first, last + 1):
        common += mass_share(row, first, last, i) * row[i, V]
    for i in range(first, last + 1):
        mass, velocity = row[i, MASS], row[i, V]
        if mass < math.inf:
            row[i, GIVEN] += 0.5 * mass * (velocity - common) * (velocity + common)
        row[i, V] = common


@lean
def unload_reversed(row):
    """Return yielding structures whose velocity was reversed to their elastic phase."""
    for i in range(row.shape[0]):
        side = row[i, PHASE]
        if side != 0 and side * row[i, V] <= 0.0:
            row[i, PHASE], row[i, UNLOADING] = 0.0, side
            row[i, PLASTIC] = row[i, U] - side * row[i, YIELD]


@lean
def meet(row, log, segment, elapsed, hit):
    """Carry out a contact of one interface, with all that it causes in the row at the same instant."""
    acceleration = segment.acceleration + segment.slope * elapsed
    strike_all(row, log, hit, segment.start + elapsed)
    lingering = False
    for j in range(row.shape[0] - 1):
        row[j, LINGERING] = 0.0
        if j == hit or touches(row, j):
            row[j, ORDER] = 1.0 if row[j + 1, V] > row[j, V] else 2.0
            row[j, STUCK] = 0.0
            row[j, LINGERING] = lingers(row, j, acceleration)
            lingering |= row[j, LINGERING] != 0.0
    if lingering:
        close_pressed(row, acceleration, segment.slope, segment.duration)
    first = 0
    while first < row.shape[0]:
        last = last_in_contact(row, first)
        if last > first:
            join(row, first, last)
        first = last + 1
    unload_reversed(row)
