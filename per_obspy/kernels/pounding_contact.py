"""
What happens at the instant of a contact: stereomechanical impacts, and which interfaces stay closed.

Impacts are pairwise and sequential, from left to right, repeated until no touching pair approaches. Interfaces that
touch without speed then stay closed where the forces that keep them closed are compressive.
"""

import math
from typing import Any, NamedTuple

from ._jit import kernel
from .pounding_motion import (
    MASS,
    PARTICIPATION,
    PLASTIC,
    RATE,
    YIELD,
    U,
    V,
    fill_curves,
    last_in_contact,
    mass_share,
    restoring,
    size_of_forces,
)

# columns of Tally.log, one row an impact
TIME, LEFT, BEFORE_1, AFTER_1, BEFORE_2, AFTER_2, IMPULSE, PLACE_1, PLACE_2 = range(9)
LOG_COLUMNS = 9
# places in Tally.counts
IMPACTS, IN_SEGMENT = 0, 1
#: Clearance below which two structures touch at the instant of another contact, relative to displacements and gap.
TOUCH = 1e-12
#: Opening acceleration, relative to the forces per unit mass, that is rounding.
PRESSED = 1e-14


class Tally(NamedTuple):
    """
    What is counted: arrays.

    ``peaks`` (N, 3): largest displacement, squared radius and squared energy radius; ``approach`` (1,): largest
    approach speed; ``counts`` (2,): impacts of the history and of the current segment; ``transfer`` (N,): energy given
    to the neighbours by impacts; ``log`` (capacity, 9): impacts, as long as there is room.
    """

    peaks: Any
    approach: Any
    counts: Any
    transfer: Any
    log: Any


class Rules(NamedTuple):
    """
    When bounces end and pressed structures stay in contact.

    An interface may stay closed that separates slower than ``speed`` (m/s), or slower than ``delay`` (s) times its
    closing acceleration, or in a segment with ``bounces`` impacts or more.
    """

    speed: float
    delay: float
    bounces: int


@kernel
def touches(row, interface):
    """Tell whether an interface is closed or has no clearance."""
    if row.stuck[interface] or row.order[interface] > 0:
        return True
    left, right = row.state[interface, U], row.state[interface + 1, U]
    clearance = row.gaps[interface] - left + right
    return clearance <= TOUCH * (abs(left) + abs(right) + row.gaps[interface])


@kernel
def strike(row, tally, interface, time):
    """Let the two structures of an interface hit each other."""
    j, state, structures = interface, row.state, row.structures
    before_1, before_2 = state[j, V], state[j + 1, V]
    approach = before_1 - before_2
    change = (1.0 + row.restitution[j]) * approach
    after_1 = before_1 - change * mass_share(structures, j, j + 1, j + 1)
    after_2 = before_2 + change * mass_share(structures, j, j + 1, j)
    if structures[j, MASS] < math.inf:
        impulse = structures[j, MASS] * (before_1 - after_1)
    else:
        impulse = structures[j + 1, MASS] * (after_2 - before_2)
    state[j, V], state[j + 1, V] = after_1, after_2
    tally.transfer[j] += 0.5 * impulse * (before_1 + after_1)
    tally.transfer[j + 1] -= 0.5 * impulse * (before_2 + after_2)
    tally.approach[0] = max(tally.approach[0], approach)
    count = tally.counts[IMPACTS]
    if count < tally.log.shape[0]:
        line = tally.log[count]
        line[TIME], line[LEFT], line[IMPULSE] = time, j, impulse
        line[BEFORE_1], line[AFTER_1], line[PLACE_1] = before_1, after_1, state[j, U]
        line[BEFORE_2], line[AFTER_2], line[PLACE_2] = before_2, after_2, state[j + 1, U]
    tally.counts[IMPACTS] += 1
    tally.counts[IN_SEGMENT] += 1


@kernel
def strike_all(row, tally, rules, hit, time):
    """Let touching pairs hit each other, from left to right, until none approaches."""
    approaching = True
    while approaching:
        approaching = False
        for j in range(row.stuck.size):
            if row.state[j, V] - row.state[j + 1, V] > rules.speed and (j == hit or touches(row, j)):
                strike(row, tally, j, time)
                approaching = tally.counts[IN_SEGMENT] < rules.bounces


@kernel
def free_acceleration(row, i, acceleration):
    """Return the acceleration that a structure has by itself."""
    stiffness, constant = restoring(row.structures, row.state, row.phase, i)
    damping = 2.0 * row.structures[i, RATE] * row.state[i, V]
    return constant - stiffness * row.state[i, U] - damping - row.structures[i, PARTICIPATION] * acceleration


@kernel
def lingers(row, tally, rules, interface, acceleration):
    """Tell whether a touching pair separates so slowly that it may stay in contact."""
    separation = row.state[interface + 1, V] - row.state[interface, V]
    if separation <= rules.speed or tally.counts[IN_SEGMENT] >= rules.bounces:
        return True
    closing = free_acceleration(row, interface, acceleration) - free_acceleration(row, interface + 1, acceleration)
    return separation <= rules.delay * closing


@kernel
def close_pressed(row, acceleration, slope, duration):
    """
    Close lingering interfaces whose structures would accelerate into each other, until none would.

    Closing one never makes the force of another tensile (their matrix is an M-matrix), so none has to open again.
    """
    closed = True
    while closed:
        closed = False
        fill_curves(row, acceleration, 0.0, 4)
        for j in range(row.stuck.size):
            if row.lingering[j] and not row.stuck[j]:
                opening = 2.0 * (row.curve[j + 1, 2] - row.curve[j, 2])
                size = size_of_forces(row, j, acceleration, slope, duration)
                size += size_of_forces(row, j + 1, acceleration, slope, duration)
                if opening <= PRESSED * size:
                    row.stuck[j] = closed = True


@kernel
def join(row, tally, first, last):
    """Give a cluster its common velocity, by momentum."""
    common = 0.0
    for i in range(first, last + 1):
        common += mass_share(row.structures, first, last, i) * row.state[i, V]
    for i in range(first, last + 1):
        mass, velocity = row.structures[i, MASS], row.state[i, V]
        if mass < math.inf:
            tally.transfer[i] += 0.5 * mass * (velocity - common) * (velocity + common)
        row.state[i, V] = common


@kernel
def unload_reversed(row):
    """Return yielding structures whose velocity was reversed to their elastic phase."""
    for i in range(row.phase.size):
        side = row.phase[i]
        if side != 0 and side * row.state[i, V] <= 0.0:
            row.phase[i], row.unloading[i] = 0, side
            row.state[i, PLASTIC] = row.state[i, U] - side * row.structures[i, YIELD]


@kernel
def meet(row, tally, rules, segment, elapsed, hit):
    """Carry out a contact of one interface, with all that it causes in the row at the same instant."""
    acceleration = segment.acceleration + segment.slope * elapsed
    strike_all(row, tally, rules, hit, segment.start + elapsed)
    for j in range(row.stuck.size):
        row.lingering[j] = False
        if j == hit or touches(row, j):
            row.order[j] = 1 if row.state[j + 1, V] > row.state[j, V] else 2
            row.stuck[j] = False
            row.lingering[j] = lingers(row, tally, rules, j, acceleration)
    close_pressed(row, acceleration, segment.slope, segment.duration)
    first = 0
    while first < row.phase.size:
        last = last_in_contact(row.stuck, first)
        if last > first:
            join(row, tally, first, last)
        first = last + 1
    unload_reversed(row)
