"""
Scalar steps of one row through a tile that may hold an event.

Steps that certainly hold no event use the same formulas as ``building_lanes``; the others go from
event to event, by the code of single histories (``next_event``).
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.pounding_events.motion import (
    BOUNCES,
    LARGEST_DISPLACEMENT,
    YIELD,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    CONTACT_FUNCTION,
    CONTACT_ROUNDING,
    DISPLACEMENT,
    DISPLACEMENT_ERROR,
    START_DISPLACEMENT,
    START_VELOCITY,
    VELOCITY,
    VELOCITY_ERROR,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    complete_state,
    ground_along,
    may_exceed_maxima,
    may_yield,
    raise_maxima_inside,
    state_after_step,
)
from per_obspy.kernels.pounding_lanes.step_by_step import run_events, segment_of_step
from per_obspy.kernels.pounding_rows.member_phases import load_row, store_row

# columns of the states of a row in a step: displacement, velocity over omega and acceleration over
# omega² (m), at its start and at its end
START, END = 0, 3
STATE_COLUMNS = 6


@inlined
def state(states, i, column):
    """Return the state of building i at the start or the end of a step."""
    return states[i, column], states[i, column + 1], states[i, column + 2]


@inlined
def set_state(states, i, column, value):
    """Set the state of building i at the start or the end of a step."""
    states[i, column] = value[0]
    states[i, column + 1] = value[1]
    states[i, column + 2] = value[2]


@inlined
def _contact_value(members, states, j, column, ground):
    """Return the contact function of interface j: positive until its buildings meet or part."""
    form = members[j, CONTACT_FUNCTION + 2] * states[j, column + 1] + (
        members[j, CONTACT_FUNCTION + 3] * ground + members[j, CONTACT_FUNCTION + 4]
    )
    return members[j, CONTACT_FUNCTION] * states[j, column] + (
        members[j, CONTACT_FUNCTION + 1] * states[j + 1, column] + form
    )


@inlined
def _may_meet_or_part(members, row, states, j, grounds):
    """Return whether the contact function of an interface may fall through zero inside a step."""
    least = min(
        _contact_value(members, states, j, START, grounds[0]),
        _contact_value(members, states, j, END, grounds[1]),
    )
    # error bound of the contact function: part of the left building, then of the right one
    margin = (
        abs(members[j, CONTACT_FUNCTION]) * members[j, DISPLACEMENT_ERROR]
        + abs(members[j, CONTACT_FUNCTION + 2]) * members[j, VELOCITY_ERROR]
    )
    margin *= max(abs(states[j, START + 2]), abs(states[j, END + 2]))
    other = abs(members[j, CONTACT_FUNCTION + 1]) * members[j + 1, DISPLACEMENT_ERROR]
    margin += other * max(abs(states[j + 1, START + 2]), abs(states[j + 1, END + 2]))
    return least - margin < -members[j, CONTACT_ROUNDING] * row[j, LARGEST_DISPLACEMENT]


@lean
def _may_hold_event(members, row, states, grounds):
    """Return whether bounds do not exclude contact, release, yielding or unloading in a step."""
    for j in range(row.shape[0] - 1):
        if _may_meet_or_part(members, row, states, j, grounds):
            return True
    for i in range(row.shape[0]):
        if row[i, YIELD] < math.inf and may_yield(
            members[i], 0, state(states, i, START), state(states, i, END)
        ):
            return True
    return False


@lean
def set_members(members, row, states, column):
    """Set displacement and velocity of the members to those of their states."""
    for i in range(row.shape[0]):
        members[i, DISPLACEMENT] = states[i, column]
        members[i, VELOCITY] = states[i, column + 1]


@lean
def _repeat_step(members, row, log, states, grounds, duration):
    """Carry a row through a step that may hold an event; return whether it got through."""
    set_members(members, row, states, START)
    load_row(members, row)
    row[0, BOUNCES] = 0.0
    segment = segment_of_step(row, grounds[0], grounds[1], duration)
    is_through = run_events(row, log, segment, 0.0)
    store_row(members, row, duration)
    # states at the end of the step
    for i in range(row.shape[0]):
        u = members[i, DISPLACEMENT]
        z = members[i, VELOCITY]
        set_state(states, i, END, complete_state(members[i], 0, u, z, grounds[1]))
    return is_through


@lean
def raise_maxima(members, row, states, change, share):
    """Raise the maxima of every building to those of a piece of a step."""
    for i in range(row.shape[0]):
        start = state(states, i, START)
        end = state(states, i, END)
        one = row[i : i + 1]
        if may_exceed_maxima(members[i], one, 0, start, end):
            raise_maxima_inside(members[i], one, 0, start, end, change, share)


@lean
def step_row_through_tile(members, row, log, states, ground, count, duration):
    """
    Carry a row through a tile that may hold an event.

    Parameters
    ----------
    members : (n_buildings, LANE_ROWS) ndarray
        Numbers of its lanes; see `lanes` for the columns.
    row : (n_buildings, ROW_COLUMNS) ndarray
        Its lines; see `motion` for the columns.
    log : (n_lines, LOG_COLUMNS) ndarray
        Log of impacts.
    states : (n_buildings, STATE_COLUMNS) ndarray
        Room for the states of a step.
    ground : (2, TILE_STEPS + 1) ndarray
        North and east acceleration at the tile's samples, m/s².
    count : int
        Number of steps of the tile.
    duration : float
        Of a step, s.

    Returns
    -------
    bool
        Whether it got through: no step had too many events.
    """
    is_through = True
    # states at the start of the tile
    before = ground_along(members[0], ground, 0)
    for i in range(row.shape[0]):
        u = members[i, START_DISPLACEMENT]
        z = members[i, START_VELOCITY]
        set_state(states, i, START, complete_state(members[i], 0, u, z, before))
    for k in range(1, count + 1):
        # states after the step, as if no event happened in it
        after = ground_along(members[0], ground, k)
        for i in range(row.shape[0]):
            start = state(states, i, START)
            set_state(states, i, END, state_after_step(members[i], 0, start, before, after))
        grounds = before, after
        if _may_hold_event(members, row, states, grounds):
            is_through &= _repeat_step(members, row, log, states, grounds, duration)
        else:
            raise_maxima(members, row, states, after - before, 1.0)
        # on to the next step
        for i in range(row.shape[0]):
            set_state(states, i, START, state(states, i, END))
        before = after
    set_members(members, row, states, START)
    return is_through
