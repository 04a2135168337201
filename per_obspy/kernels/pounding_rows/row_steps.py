"""
Scalar steps of one row through a tile that may hold an event.

Steps that certainly hold no event use the same formulas as ``lanes``; the others go from
event to event, by the code of single histories (``next_event``).
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.pounding_events.contact import has_room
from per_obspy.kernels.pounding_events.motion import (
    BOUNCES,
    IN_CONTACT,
    LARGEST_DISPLACEMENT,
    YIELD,
)
from per_obspy.kernels.pounding_lanes.impact_steps import stays_open
from per_obspy.kernels.pounding_lanes.lanes import (
    CONTACT_FUNCTION,
    CONTACT_ROUNDING,
    DISPLACEMENT,
    DISPLACEMENT_ERROR,
    START_DISPLACEMENT,
    START_VELOCITY,
    STRUCTURE_ROWS,
    VELOCITY,
    VELOCITY_ERROR,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    complete_state,
    ground_along,
    may_yield,
    raise_maxima,
    state_after_step,
)
from per_obspy.kernels.pounding_lanes.phases import load_row
from per_obspy.kernels.pounding_lanes.step_by_step import segment_of_step
from per_obspy.kernels.pounding_rows.pieces import END, START, set_state, state
from per_obspy.kernels.pounding_rows.row_impacts import run_row_impacts


@inlined
def _contact_value(members, states, j, column, ground):
    """Return the contact function of interface j: positive until its buildings meet or part."""
    # part of the velocity and the ground, then both displacements
    own = j * STRUCTURE_ROWS
    form = members[own + CONTACT_FUNCTION + 2] * states[j, column + 1] + (
        members[own + CONTACT_FUNCTION + 3] * ground + members[own + CONTACT_FUNCTION + 4]
    )
    return members[own + CONTACT_FUNCTION] * states[j, column] + (
        members[own + CONTACT_FUNCTION + 1] * states[j + 1, column] + form
    )


@inlined
def _may_meet_or_part(members, row, states, j, ground_start, ground_end):
    """Return whether the contact function of an interface may fall through zero in a piece."""
    own = j * STRUCTURE_ROWS
    # least value at the ends of the piece
    least = min(
        _contact_value(members, states, j, START, ground_start),
        _contact_value(members, states, j, END, ground_end),
    )
    # error bound of the contact function: part of the left building, then of the right one
    margin = (
        abs(members[own + CONTACT_FUNCTION]) * members[own + DISPLACEMENT_ERROR]
        + abs(members[own + CONTACT_FUNCTION + 2]) * members[own + VELOCITY_ERROR]
    )
    margin *= max(abs(states[j, START + 2]), abs(states[j, END + 2]))
    other = (
        abs(members[own + CONTACT_FUNCTION + 1])
        * members[own + STRUCTURE_ROWS + DISPLACEMENT_ERROR]
    )
    margin += other * max(abs(states[j + 1, START + 2]), abs(states[j + 1, END + 2]))
    return least - margin < -members[own + CONTACT_ROUNDING] * row[j, LARGEST_DISPLACEMENT]


@inlined
def _may_yield_in_step(members, row, states):
    """Return whether a building may yield or unload in a piece."""
    for i in range(row.shape[0]):
        if row[i, YIELD] < math.inf and may_yield(
            members, i * STRUCTURE_ROWS, state(states, i, START), state(states, i, END)
        ):
            return True
    return False


@inlined
def _is_open_in_step(members, row, states, j, duration):
    """Return whether an interface is open and certainly stays so in a step, by a cubic."""
    left = state(states, j, START)
    right = state(states, j + 1, START)
    next_left = state(states, j, END)
    next_right = state(states, j + 1, END)
    return row[j, IN_CONTACT] == 0.0 and stays_open(
        members[j * STRUCTURE_ROWS :], left, right, next_left, next_right, 1.0, duration, False
    )


@inlined
def _may_hold_event(members, row, states, before, after, duration):
    """Return whether bounds do not exclude contact, release, yielding or unloading in a step."""
    for j in range(row.shape[0] - 1):
        # by the chord of its contact function, then by a cubic
        if _may_meet_or_part(members, row, states, j, before, after) and not _is_open_in_step(
            members, row, states, j, duration
        ):
            return True
    return _may_yield_in_step(members, row, states)


@lean
def set_members(members, row, states, column):
    """Set displacement and velocity of the members to those of their states."""
    for i in range(row.shape[0]):
        members[i * STRUCTURE_ROWS + DISPLACEMENT] = states[i, column]
        members[i * STRUCTURE_ROWS + VELOCITY] = states[i, column + 1]


@lean
def step_row_through_tile(members, row, log, states, window, ground, count, duration):
    """
    Carry a row through a tile that may hold an event.

    Parameters
    ----------
    members : (n_buildings * STRUCTURE_ROWS,) ndarray
        Numbers of its lanes; see `lanes` for the rows.
    row : (n_buildings, ROW_COLUMNS) ndarray
        Its lines; see `motion` for the columns.
    log : (n_lines, LOG_COLUMNS) ndarray
        Log of impacts.
    states : (n_buildings, STATE_COLUMNS) ndarray
        Room for the states of a step.
    window : (WINDOW_SIZE,) ndarray
        Room for the lanes of a window.
    ground : (2, TILE_STEPS + 1) ndarray
        North and east acceleration at the tile's samples, m/s².
    count : int
        Number of steps of the tile.
    duration : float
        Of a step, s.

    Returns
    -------
    bool
        Whether it got through: no step had too many events, and the log had room.
    """
    # states at the start of the tile
    before = ground_along(members, ground, 0)
    for i in range(row.shape[0]):
        own = i * STRUCTURE_ROWS
        u = members[own + START_DISPLACEMENT]
        z = members[own + START_VELOCITY]
        set_state(states, i, START, complete_state(members, own, u, z, before))
    for k in range(1, count + 1):
        # states after the step, as if no event happened in it
        after = ground_along(members, ground, k)
        for i in range(row.shape[0]):
            start = state(states, i, START)
            own = i * STRUCTURE_ROWS
            set_state(states, i, END, state_after_step(members, own, start, before, after))
        if _may_hold_event(members, row, states, before, after, duration):
            # the step again, from event to event
            set_members(members, row, states, START)
            load_row(members, row)
            row[0, BOUNCES] = 0.0
            segment = segment_of_step(row, before, after, duration)
            is_through = run_row_impacts(members, row, log, states, window, segment)
            if not is_through or not has_room(row, log):
                return False
        else:
            for i in range(row.shape[0]):
                start, end = state(states, i, START), state(states, i, END)
                raise_maxima(members, row, i, start, end, after - before, 1.0)
        # on to the next step
        for i in range(row.shape[0]):
            set_state(states, i, START, state(states, i, END))
        before = after
    set_members(members, row, states, START)
    return True
