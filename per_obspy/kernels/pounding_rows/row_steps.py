"""
Scalar steps of one row through a tile that may hold an event.

Steps that certainly hold no event use the same formulas as ``building_lanes``; the others go from
event to event, by the code of single histories (``next_event``).
"""

from per_obspy.kernels._jit import lean
from per_obspy.kernels.pounding_events.motion import BOUNCES, IN_CONTACT
from per_obspy.kernels.pounding_lanes.impact_steps import stays_open
from per_obspy.kernels.pounding_lanes.lanes import (
    DISPLACEMENT,
    START_DISPLACEMENT,
    START_VELOCITY,
    VELOCITY,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    complete_state,
    ground_along,
    state_after_step,
)
from per_obspy.kernels.pounding_lanes.step_by_step import segment_of_step
from per_obspy.kernels.pounding_rows.member_phases import load_row
from per_obspy.kernels.pounding_rows.row_impacts import (
    END,
    START,
    may_meet_or_part,
    may_yield_in_piece,
    raise_maxima,
    run_row_impacts,
    set_state,
    state,
)


@lean
def _is_open_in_step(members, row, states, j, duration):
    """Return whether an interface is open and certainly stays so in a step, by a cubic."""
    left = state(states, j, START)
    right = state(states, j + 1, START)
    next_left = state(states, j, END)
    next_right = state(states, j + 1, END)
    return row[j, IN_CONTACT] == 0.0 and stays_open(
        members[j], left, right, next_left, next_right, 1.0, duration, False
    )


@lean
def _may_hold_event(members, row, states, before, after, duration):
    """Return whether bounds do not exclude contact, release, yielding or unloading in a step."""
    for j in range(row.shape[0] - 1):
        # by the chord of its contact function, then by a cubic
        if may_meet_or_part(members, row, states, j, before, after) and not _is_open_in_step(
            members, row, states, j, duration
        ):
            return True
    return may_yield_in_piece(members, row, states)


@lean
def set_members(members, row, states, column):
    """Set displacement and velocity of the members to those of their states."""
    for i in range(row.shape[0]):
        members[i, DISPLACEMENT] = states[i, column]
        members[i, VELOCITY] = states[i, column + 1]


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
        if _may_hold_event(members, row, states, before, after, duration):
            # the step again, from event to event
            set_members(members, row, states, START)
            load_row(members, row)
            row[0, BOUNCES] = 0.0
            segment = segment_of_step(row, before, after, duration)
            is_through &= run_row_impacts(members, row, log, states, segment)
        else:
            raise_maxima(members, row, states, END, after - before, 1.0)
        # on to the next step
        for i in range(row.shape[0]):
            set_state(states, i, START, state(states, i, END))
        before = after
    set_members(members, row, states, START)
    return is_through
