"""
Contact at one instant: stereomechanical impacts, and the interfaces that stay closed after them.

Impacts are pairwise and sequential, from left to right, repeated until no touching pair approaches.
Interfaces that touch without speed then stay closed where the forces that keep them closed are
compressive. Bounces end, and an interface may stay closed, when it separates slower than
STICKING_SPEED (m/s), or slower than STICKING_DELAY (s) times its closing acceleration, or after
BOUNCE_LIMIT impacts in a segment.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel, lean
from per_obspy.kernels.pounding_events.motion import (
    ALL_IMPACTS,
    APPROACH,
    BOUNCE_LIMIT,
    BOUNCES,
    CLEARANCE_ORDER,
    COUNTED_SPEED,
    DAMPING_RATE,
    GAP,
    IMPACTS,
    IN_CONTACT,
    KEPT_LINES,
    LINGERING,
    MASS,
    PARTICIPATION,
    PHASE,
    PLASTIC,
    RESTITUTION,
    STICKING_DELAY,
    STICKING_SPEED,
    TAYLOR,
    TERM_COUNT,
    TRANSFERRED,
    UNLOADING,
    YIELD,
    U,
    V,
    fill_displacements,
    last_of_cluster,
    mass_share,
    restoring_force,
    size_of_forces,
)

# columns of the log of impacts, one line per impact as long as there is room
#: time (s), index of the structure left of the gap
LOG_TIME, LOG_LEFT = 0, 1
#: velocities of the left and of the right structure (m/s), before and after the impact
LOG_BEFORE_1, LOG_AFTER_1, LOG_BEFORE_2, LOG_AFTER_2 = 2, 3, 4, 5
#: impulse (N s), displacements (m)
LOG_IMPULSE, LOG_DISPLACEMENT_1, LOG_DISPLACEMENT_2 = 6, 7, 8
LOG_COLUMNS = 9
#: An impact counts if its approach speed is above this (m/s) and above this share of the fastest.
SLOWEST_COUNTED, COUNTED_SHARE = 1e-3, 1e-2
#: Impacts of a row in lanes at most; touching rows whose masses differ by a factor of a million
#: have more.
MOST_IMPACTS = 1 << 22
#: Clearance below which two structures touch at the instant of another contact, relative to
#: displacements and gap.
TOUCH_ROUNDING = 1e-12
#: Opening acceleration, relative to the forces per unit mass, that is rounding.
PRESSED_ROUNDING = 1e-14


@lean
def is_touching(row, j):
    """Return whether an interface is closed or has no clearance."""
    if row[j, IN_CONTACT] or row[j, CLEARANCE_ORDER] > 0:
        return True
    # clearance against the rounding of its terms
    left = row[j, U]
    right = row[j + 1, U]
    clearance = row[j, GAP] - left + right
    return clearance <= TOUCH_ROUNDING * (abs(left) + abs(right) + row[j, GAP])


@lean
def _count_lines(row):
    """Return the number of impacts of a row, which are lines of its log as long as it has room."""
    count = 0.0
    for k in range(row.shape[0] - 1):
        count += row[k, IMPACTS]
    return int(count)


@lean
def log_impact(log, row, j, time, impulse, before_1, before_2):
    """Write an impact that has just changed the velocities to the log, if it has room."""
    # the number of impacts before this one is its line
    line = _count_lines(row)
    if line < log.shape[0]:
        log[line, LOG_TIME] = time
        log[line, LOG_LEFT] = j
        log[line, LOG_IMPULSE] = impulse
        log[line, LOG_BEFORE_1] = before_1
        log[line, LOG_AFTER_1] = row[j, V]
        log[line, LOG_DISPLACEMENT_1] = row[j, U]
        log[line, LOG_BEFORE_2] = before_2
        log[line, LOG_AFTER_2] = row[j + 1, V]
        log[line, LOG_DISPLACEMENT_2] = row[j + 1, U]


@lean
def _counting_limit(row, j):
    """Return the approach speed up to which an impact does not count, by the fastest so far."""
    return max(row[j, COUNTED_SPEED], COUNTED_SHARE * row[j, APPROACH])


@lean
def drop_uncounted(row, log):
    """
    Leave only those impacts of a row in lanes that still count in its log and in IMPACTS.

    The fastest impact of an interface, which decides on the others, is known at the end only.
    """
    lines = _count_lines(row)
    for j in range(row.shape[0]):
        row[j, IMPACTS] = 0.0
    kept = 0
    # the others move up
    for line in range(lines):
        j = int(log[line, LOG_LEFT])
        if log[line, LOG_BEFORE_1] - log[line, LOG_BEFORE_2] > _counting_limit(row, j):
            for column in range(LOG_COLUMNS):
                log[kept, column] = log[line, column]
            row[j, IMPACTS] += 1.0
            kept += 1
    row[0, KEPT_LINES] = kept


@lean
def has_room(row, log):
    """
    Return whether a row may go on after a step, and make room for the next one.

    Its log must hold every impact that may count, and all its impacts must be MOST_IMPACTS at most.
    """
    row[0, ALL_IMPACTS] += row[0, BOUNCES]
    lines = _count_lines(row)
    if lines > log.shape[0] or row[0, ALL_IMPACTS] > MOST_IMPACTS:
        return False
    # once half of what was left is used: not in every step where most lines count
    if 2 * lines > log.shape[0] + row[0, KEPT_LINES]:
        drop_uncounted(row, log)
    return True


@lean
def _never_counts(row, j, approach):
    """Return whether an impact in lanes does not count, whatever the fastest of all will be."""
    return row[0, TERM_COUNT] > 0.0 and approach <= _counting_limit(row, j)


@lean
def apply_impact(row, log, j, time):
    """
    Apply one impact to the two structures of an interface: equations (7) to (10).

    In lanes, which do not follow energies, an impact that never counts leaves no line.
    """
    before_1 = row[j, V]
    before_2 = row[j + 1, V]
    approach = before_1 - before_2
    # velocities after the impact, (7) and (8)
    change = (1.0 + row[j, RESTITUTION]) * approach
    after_1 = before_1 - change * mass_share(row, j, j + 1, j + 1)
    after_2 = before_2 + change * mass_share(row, j, j + 1, j)
    never_counts = _never_counts(row, j, approach)
    row[j, APPROACH] = max(row[j, APPROACH], approach)
    row[0, BOUNCES] += 1.0
    if never_counts:
        row[j, V] = after_1
        row[j + 1, V] = after_2
        return
    # impulse, from the structure that is no wall
    if row[j, MASS] < math.inf:
        impulse = row[j, MASS] * (before_1 - after_1)
    else:
        impulse = row[j + 1, MASS] * (after_2 - before_2)
    row[j, V] = after_1
    row[j + 1, V] = after_2
    # transferred energies, (9) and (10) in their short form: impulse times mean velocity
    row[j, TRANSFERRED] += 0.5 * impulse * (before_1 + after_1)
    row[j + 1, TRANSFERRED] -= 0.5 * impulse * (before_2 + after_2)
    log_impact(log, row, j, time, impulse, before_1, before_2)
    row[j, IMPACTS] += 1.0


@kernel
def count_impacts(rows, logs):
    """
    Return the number of impacts of pairs that count, chatter left out.

    Parameters
    ----------
    rows : (n_pairs, 2, ROW_COLUMNS) ndarray
        Of the pairs at the end of their histories; see `motion` for the columns.
    logs : (n_pairs, n_lines, LOG_COLUMNS) ndarray
        Logs that hold all their impacts.

    Returns
    -------
    (n_pairs,) ndarray of int
        Impacts above SLOWEST_COUNTED, and above COUNTED_SHARE of the pair's fastest.
    """
    counts = np.zeros(rows.shape[0], np.int64)
    for pair in range(rows.shape[0]):
        # the fastest is known at the end only
        limit = max(SLOWEST_COUNTED, COUNTED_SHARE * rows[pair, 0, APPROACH])
        for line in range(int(rows[pair, 0, IMPACTS])):
            approach = logs[pair, line, LOG_BEFORE_1] - logs[pair, line, LOG_BEFORE_2]
            counts[pair] += approach > limit
    return counts


@lean
def apply_impacts(row, log, hit, time):
    """Apply impacts to touching pairs, from left to right, until no pair approaches."""
    approaching = True
    while approaching:
        approaching = False
        # one pass over the row; another one follows, because an impact may press neighbours
        for j in range(row.shape[0] - 1):
            if row[j, V] - row[j + 1, V] > row[0, STICKING_SPEED] and (
                j == hit or is_touching(row, j)
            ):
                apply_impact(row, log, j, time)
                approaching = row[0, BOUNCES] < row[0, BOUNCE_LIMIT]


@lean
def free_acceleration(row, i, acceleration):
    """Return the acceleration of a structure without contact."""
    stiffness, constant = restoring_force(row, i)
    damping = 2.0 * row[i, DAMPING_RATE] * row[i, V]
    return constant - stiffness * row[i, U] - damping - row[i, PARTICIPATION] * acceleration


@lean
def closing_acceleration(row, j, acceleration):
    """
    Return a bound of the acceleration at which the two sides of a touching interface close.

    Each side is pushed by its structure, or by one behind it that touches it: the acceleration
    of structures that move together is a mean of theirs.
    """
    # strongest push from the left
    left = free_acceleration(row, j, acceleration)
    k = j
    while k > 0 and is_touching(row, k - 1):
        k -= 1
        left = max(left, free_acceleration(row, k, acceleration))
    # strongest push from the right
    k = j + 1
    right = free_acceleration(row, k, acceleration)
    while k < row.shape[0] - 1 and is_touching(row, k):
        k += 1
        right = min(right, free_acceleration(row, k, acceleration))
    return left - right


@lean
def is_lingering(row, j, acceleration):
    """Return whether a touching pair separates so slowly that it may stay in contact."""
    separation = row[j + 1, V] - row[j, V]
    if separation <= row[0, STICKING_SPEED] or row[0, BOUNCES] >= row[0, BOUNCE_LIMIT]:
        return True
    # a bounce lasts 2 separation / closing acceleration
    return separation <= row[0, STICKING_DELAY] * closing_acceleration(row, j, acceleration)


@lean
def close_pressed_interfaces(row, acceleration, slope, duration):
    """
    Close lingering interfaces whose structures would accelerate into each other, until none would.

    Closing one never makes the force of another tensile (their matrix is an M-matrix), so none has
    to open again.
    """
    closed = True
    while closed:
        closed = False
        # accelerations with the interfaces that are closed now
        fill_displacements(row, acceleration, 0.0, 4)
        for j in range(row.shape[0] - 1):
            if row[j, LINGERING] and not row[j, IN_CONTACT]:
                # opening acceleration, against the rounding of the forces
                opening = 2.0 * (row[j + 1, TAYLOR + 2] - row[j, TAYLOR + 2])
                size = size_of_forces(row, j, acceleration, slope, duration)
                size += size_of_forces(row, j + 1, acceleration, slope, duration)
                if opening <= PRESSED_ROUNDING * size:
                    row[j, IN_CONTACT] = 1.0
                    closed = True


@lean
def join_cluster(row, first, last):
    """Set the common velocity of a cluster, by momentum."""
    common = 0.0
    for i in range(first, last + 1):
        common += mass_share(row, first, last, i) * row[i, V]
    # the change of kinetic energy goes to the neighbours
    for i in range(first, last + 1):
        mass = row[i, MASS]
        velocity = row[i, V]
        if mass < math.inf:
            row[i, TRANSFERRED] += 0.5 * mass * (velocity - common) * (velocity + common)
        row[i, V] = common


@lean
def unload_reversed(row):
    """Return yielding structures whose velocity was reversed to their elastic phase."""
    for i in range(row.shape[0]):
        side = row[i, PHASE]
        if side != 0 and side * row[i, V] <= 0.0:
            # on the edge of yielding, where the distance to it is zero
            row[i, PHASE] = 0.0
            row[i, UNLOADING] = side
            row[i, PLASTIC] = row[i, U] - side * row[i, YIELD]


@lean
def resolve_contact(row, log, segment, elapsed, hit):
    """
    Carry out a contact of one interface, with all its consequences in the row at the same instant.

    Parameters
    ----------
    row : (n_structures, ROW_COLUMNS) ndarray
        Row of structures at the instant of the contact; see `motion` for its columns.
    log : (n_lines, LOG_COLUMNS) ndarray
        Log of impacts, which receives one line per impact.
    segment : Segment
        Current segment of the ground acceleration.
    elapsed : float
        Time since the start of the segment, s.
    hit : int
        Interface whose clearance has just closed.
    """
    acceleration = segment.acceleration + segment.slope * elapsed
    apply_impacts(row, log, hit, segment.start + elapsed)
    # open every touching interface
    for j in range(row.shape[0] - 1):
        row[j, LINGERING] = 0.0
        if j == hit or is_touching(row, j):
            row[j, CLEARANCE_ORDER] = 1.0 if row[j + 1, V] > row[j, V] else 2.0
            row[j, IN_CONTACT] = 0.0
    # note where one may stay closed
    lingering = False
    for j in range(row.shape[0] - 1):
        if row[j, CLEARANCE_ORDER] > 0.0:
            row[j, LINGERING] = is_lingering(row, j, acceleration)
            lingering |= row[j, LINGERING] != 0.0
    if lingering:
        close_pressed_interfaces(row, acceleration, segment.slope, segment.duration)
    # structures in contact move on with one velocity
    first = 0
    while first < row.shape[0]:
        last = last_of_cluster(row, first)
        if last > first:
            join_cluster(row, first, last)
        first = last + 1
    unload_reversed(row)
