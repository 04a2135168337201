"""
Steps of a row with impacts, from event to event.

A step is passed in windows, in which the next impact of the row is found for all interfaces side
by side (``window_lanes``). Every other event (release, yielding, unloading, contact without
approach) is left to the event code of single histories.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.polynomial_roots import first_fall
from per_obspy.kernels.pounding_events.contact import (
    apply_impact,
    is_lingering,
    is_touching,
    resolve_contact,
)
from per_obspy.kernels.pounding_events.motion import (
    BOUNCE_LIMIT,
    CLEARANCE_ORDER,
    EVENT_FUNCTION,
    GAP,
    GAP_ROUNDING,
    IN_CONTACT,
    LARGEST_DISPLACEMENT,
    PHASE,
    STICKING_SPEED,
    UNLOADING,
    YIELD,
    U,
    V,
)
from per_obspy.kernels.pounding_events.next_event import find_event, finish_piece
from per_obspy.kernels.pounding_lanes.lanes import (
    CONTACT_FUNCTION,
    CONTACT_ROUNDING,
    DISPLACEMENT_ERROR,
    LARGEST_RATE,
    OMEGA,
    STRUCTURE_ROWS,
    VELOCITY_ERROR,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import complete_state, may_yield, raise_maxima
from per_obspy.kernels.pounding_lanes.phases import update_phases, write_steps
from per_obspy.kernels.pounding_rows.window_lanes import (
    BEFORE,
    CLEARANCE,
    COURSE,
    LARGEST,
    MAY_EXCEED,
    MET,
    NOW,
    ONCE,
    OPEN,
    PER_ANGLE,
    POLYNOMIAL,
    WIDTH,
    WINDOW_REACH,
    WINDOW_TERMS,
    at,
    closing_share,
    fill_clearances,
    fill_polynomials,
    find_courses,
    load_buildings,
    move_buildings,
)


@inlined
def _now(window, i):
    """Return the state of a building at the start of the window."""
    return window[at(NOW, i)], window[at(NOW + 1, i)], window[at(NOW + 2, i)]


@inlined
def _later(members, window, i, share, ground):
    """Return the state of a building after a share of the step, under a ground acceleration."""
    u = rate = 0.0
    for n in range(WINDOW_TERMS - 1, -1, -1):
        rate = rate * share + u
        u = u * share + window[at(POLYNOMIAL + n, i)]
    return complete_state(members, i * STRUCTURE_ROWS, u, rate * window[at(PER_ANGLE, i)], ground)


@inlined
def _contact_force(members, own, value, ground):
    """Return the contact function of a closed interface, from the state of its left building."""
    form = members[own + CONTACT_FUNCTION + 3] * ground + members[own + CONTACT_FUNCTION + 4]
    by_velocity = members[own + CONTACT_FUNCTION + 2] * value[1]
    return members[own + CONTACT_FUNCTION] * value[0] + by_velocity + form


@inlined
def _may_part(members, row, i, start, end, grounds, share):
    """Return whether a closed interface may open in a window of this share of the step."""
    own = i * STRUCTURE_ROWS
    least = min(
        _contact_force(members, own, start, grounds[0]),
        _contact_force(members, own, end, grounds[1]),
    )
    # what the states leave their chords by
    error = share * abs(members[own + CONTACT_FUNCTION]) * members[own + DISPLACEMENT_ERROR]
    error += abs(members[own + CONTACT_FUNCTION + 2]) * members[own + VELOCITY_ERROR]
    margin = share * error * max(abs(start[2]), abs(end[2]))
    return least - margin < -members[own + CONTACT_ROUNDING] * row[i, LARGEST_DISPLACEMENT]


@inlined
def _may_hold_other_event(members, row, window, grounds, share):
    """Return whether bounds do not exclude a release, yielding or unloading in a window."""
    for i in range(row.shape[0]):
        may_change = row[i, YIELD] < math.inf
        if may_change or row[i, IN_CONTACT]:
            # states at both ends of the window
            start = _now(window, i)
            end = _later(members, window, i, share, grounds[1])
            if may_change and may_yield(members, i * STRUCTURE_ROWS, start, end):
                return True
            if row[i, IN_CONTACT] and _may_part(members, row, i, start, end, grounds, share):
                return True
    return False


@lean
def _safe_closing(row, window, j, room):
    """Return when a clearance falls through zero in a room by safe steps, -1 if it does not."""
    # the clearance over time**order
    order = int(window[at(MET, j)])
    terms = WINDOW_TERMS - order
    for n in range(terms):
        row[j, EVENT_FUNCTION + n] = window[at(CLEARANCE + n + order, j)]
    rounding = 0.0
    if order == 0:
        rounding = abs(window[at(NOW, j)]) + abs(window[at(NOW, j + 1)])
        rounding = GAP_ROUNDING * (rounding + row[j, GAP])
    return first_fall(row, j, EVENT_FUNCTION, terms, 1.0, 0.0, room, rounding)


@inlined
def _next_impact(row, window, room):
    """Return when the next impact of a window happens, infinite if none, and its interface."""
    for first in range(0, row.shape[0] - 1, WIDTH):
        fill_clearances(window[first:])
        find_courses(window[first:], room)
    earliest = math.inf
    hit = -1
    for j in range(row.shape[0] - 1):
        # by bounds, by corrections, or by safe steps
        course = window[at(COURSE, j)]
        if course == OPEN or row[j, IN_CONTACT]:
            continue
        time = closing_share(window, j, room) if course == ONCE else -1.0
        if time < 0.0:
            time = _safe_closing(row, window, j, min(room, earliest))
        if 0.0 <= time < earliest:
            earliest = time
            hit = j
    return earliest, hit


@inlined
def _before(window, i):
    """Return the state of a building before the last move."""
    return window[at(BEFORE, i)], window[at(BEFORE + 1, i)], window[at(BEFORE + 2, i)]


@inlined
def _move(members, row, window, share, ground, change):
    """Move all buildings by a share of the step, with their maxima on the way."""
    for first in range(0, row.shape[0], WIDTH):
        move_buildings(window[first:], share, ground)
    for i in range(row.shape[0]):
        row[i, CLEARANCE_ORDER] = 0.0
        row[i, UNLOADING] = 0.0
        # maxima on the way
        if window[at(MAY_EXCEED, i)]:
            start = _before(window, i)
            raise_maxima(members, row, i, start, _now(window, i), change, share)
            window[at(LARGEST, i)] = row[i, LARGEST_DISPLACEMENT]


@inlined
def _pass_window(members, row, window, segment, elapsed):
    """
    Carry a row to its next impact, or to the end of the window that begins at a share of the step.

    Return the share reached, the interface of the impact (-1 if there is none), and whether bounds
    do not exclude another event in the window: then the row has not moved.
    """
    # polynomials of the window
    change = segment.slope * segment.duration
    end = min(elapsed + WINDOW_REACH / members[LARGEST_RATE], 1.0)
    room = end - elapsed
    grounds = segment.acceleration + elapsed * change, segment.acceleration + end * change
    for first in range(0, row.shape[0], WIDTH):
        fill_polynomials(window[first:], grounds[0], change)
    if _may_hold_other_event(members, row, window, grounds, room):
        return elapsed, -1, True
    # the impact, or the end of the window
    share, hit = _next_impact(row, window, room)
    reached = elapsed + share if hit >= 0 else end
    if share > 0.0:
        ground = segment.acceleration + reached * change
        _move(members, row, window, min(share, room), ground, change)
    return reached, hit, False


@lean
def _write_row(members, row, window, first, last):
    """Copy the states of some buildings from their lanes to the row."""
    for i in range(max(first, 0), min(last + 1, row.shape[0])):
        row[i, U] = window[at(NOW, i)]
        row[i, V] = window[at(NOW + 1, i)] * members[i * STRUCTURE_ROWS + OMEGA]


@lean
def _pass_event(row, log, segment, elapsed):
    """Carry the row to its next event by the event code; return the share reached."""
    time = elapsed * segment.duration
    span, kind, index = find_event(row, segment, time)
    time = time + span if kind else segment.duration
    finish_piece(row, log, segment, time, span, kind, index)
    return time / segment.duration if time < segment.duration else 1.0


@lean
def _read_row(members, row, window):
    """Copy the row to its lanes after contact or an event, with the numbers of new phases."""
    if update_phases(members, row):
        load_buildings(members, row, window)
    _read_states(members, row, window)


@lean
def _read_states(members, row, window):
    """Copy the states of the row, and which interfaces have just met, to its lanes."""
    for i in range(row.shape[0]):
        window[at(NOW, i)] = row[i, U]
        window[at(NOW + 1, i)] = row[i, V] / members[i * STRUCTURE_ROWS + OMEGA]
        # what changes at events only
        window[at(MET, i)] = row[i, CLEARANCE_ORDER]
        window[at(LARGEST, i)] = row[i, LARGEST_DISPLACEMENT]


@inlined
def _is_alone(row, hit):
    """Return whether the two buildings that hit each other are elastic and touch no other."""
    is_single = (row[hit, PHASE] == 0.0) & (row[hit + 1, PHASE] == 0.0)
    if hit > 0:
        is_single &= not is_touching(row, hit - 1)
    if hit < row.shape[0] - 2:
        is_single &= not is_touching(row, hit + 1)
    return is_single


@inlined
def _pass_impact(members, row, log, window, hit, elapsed, segment):
    """
    Apply an impact in which no other building takes part; return whether both then part.

    It is ``resolve_contact`` where bouncing goes on, as after most impacts; all else is left to it.
    """
    if elapsed >= 1.0 or not _is_alone(row, hit):
        return False
    time = elapsed * segment.duration
    ground = segment.acceleration + segment.slope * time
    apply_impact(row, log, hit, time)
    if is_lingering(row, hit, ground):
        return False
    # both part
    row[hit, CLEARANCE_ORDER] = 1.0
    window[at(MET, hit)] = 1.0
    for i in (hit, hit + 1):
        window[at(NOW + 1, i)] = row[i, V] / members[i * STRUCTURE_ROWS + OMEGA]
    return True


@lean
def run_row_impacts(members, row, log, window, segment):
    """
    Carry a row through a step of impacts.

    Parameters
    ----------
    members : (n_buildings * STRUCTURE_ROWS,) ndarray
        Numbers of its lanes; see `lanes` for the rows.
    row : (n_buildings, ROW_COLUMNS) ndarray
        Its lines at the start of the step, then at its end; see `motion` for the columns.
    log : (n_lines, LOG_COLUMNS) ndarray
        Log of impacts.
    window : (WINDOW_SIZE,) ndarray
        Room for the lanes of a window; see `window_lanes` for the rows.
    segment : Segment
        The step.

    Returns
    -------
    bool
        Whether it got through: the step had not too many events.
    """
    load_buildings(members, row, window)
    _read_states(members, row, window)
    elapsed = 0.0
    for _ in range(100 * int(row[0, BOUNCE_LIMIT])):
        elapsed, hit, is_other = _pass_window(members, row, window, segment, elapsed)
        # the buildings at an impact, and their neighbours
        _write_row(members, row, window, hit - 1, hit + 2)
        if hit >= 0 and row[hit, V] - row[hit + 1, V] > row[0, STICKING_SPEED]:
            if _pass_impact(members, row, log, window, hit, elapsed, segment):
                continue
            # its other buildings, unchanged
            _write_row(members, row, window, 0, hit - 2)
            _write_row(members, row, window, hit + 3, row.shape[0])
            resolve_contact(row, log, segment, elapsed * segment.duration, hit)
            _read_row(members, row, window)
        elif is_other or hit >= 0:
            # any other event
            _write_row(members, row, window, 0, row.shape[0])
            elapsed = _pass_event(row, log, segment, elapsed)
            _read_row(members, row, window)
        if elapsed >= 1.0:
            break
    # the row at the end of the step
    _write_row(members, row, window, 0, row.shape[0])
    write_steps(members, row, segment.duration)
    return elapsed >= 1.0
