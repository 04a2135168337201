"""
Scalar steps of one pair through a tile that may hold an event.

Steps that certainly hold no event use the same formulas as ``lanes``; the others are repeated:
single impacts by ``impact_steps``, yielding and unloading by ``stiffness_changes``, and all else
from event to event, by the code of single histories (``next_event``).
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.pounding_events.motion import (
    BOUNCE_LIMIT,
    BOUNCES,
    GAP,
    IN_CONTACT,
    LARGEST_DISPLACEMENT,
    LARGEST_RADIUS_SQUARED,
    TERM_COUNT,
    YIELD,
    Segment,
)
from per_obspy.kernels.pounding_events.next_event import find_event, finish_piece
from per_obspy.kernels.pounding_lanes.deferred_maxima import (
    raise_maxima_of_tile,
    read_states,
    search_deferred,
    write_lane,
)
from per_obspy.kernels.pounding_lanes.impact_steps import run_free_impacts, set_states
from per_obspy.kernels.pounding_lanes.lanes import (
    CONTACT_FUNCTION,
    CONTACT_ROUNDING,
    DISPLACEMENT,
    DISPLACEMENT_ERROR,
    EVENT_FLAG,
    IS_CHANGED,
    MAXIMUM_SO_FAR,
    RADIUS_SQUARED_SO_FAR,
    START_DISPLACEMENT,
    START_VELOCITY,
    STRUCTURE_ROWS,
    VELOCITY,
    VELOCITY_ERROR,
    at,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    complete_state,
    ground_along,
    may_exceed_maxima,
    may_yield,
    raise_maxima_inside,
    state_after_step,
)
from per_obspy.kernels.pounding_lanes.pair_rows import load_pair, store_pair
from per_obspy.kernels.pounding_lanes.stiffness_changes import run_stiffness_changes


@inlined
def present_state(pair, first, ground):
    """Return the state of a structure of a pair now."""
    return complete_state(pair, first, pair[first + DISPLACEMENT], pair[first + VELOCITY], ground)


@inlined
def state_at_tile_start(pair, first, ground):
    """Return the state of a structure at the start of the tile."""
    u = pair[first + START_DISPLACEMENT]
    z = pair[first + START_VELOCITY]
    return complete_state(pair, first, u, z, ground)


@lean
def segment_of_step(row, ground_start, ground_end, duration):
    """Return a step as a segment of linear ground acceleration."""
    slope = (ground_end - ground_start) / duration
    return Segment(0.0, duration, ground_start, slope, int(row[0, TERM_COUNT]))


@inlined
def _contact_value(pair, left, right, ground):
    """Return the contact function: positive until the pair meets or parts."""
    form = pair[CONTACT_FUNCTION + 2] * left[1] + (
        pair[CONTACT_FUNCTION + 3] * ground + pair[CONTACT_FUNCTION + 4]
    )
    return pair[CONTACT_FUNCTION] * left[0] + (pair[CONTACT_FUNCTION + 1] * right[0] + form)


@inlined
def _may_meet_or_part(pair, row, least, left, next_left, right, next_right):
    """Return whether the contact function may fall through zero inside a step, by its least end."""
    # error bound of the contact function: part of structure 1, then of structure 2
    margin = (
        abs(pair[CONTACT_FUNCTION]) * pair[DISPLACEMENT_ERROR]
        + abs(pair[CONTACT_FUNCTION + 2]) * pair[VELOCITY_ERROR]
    )
    margin *= max(abs(left[2]), abs(next_left[2]))
    other = abs(pair[CONTACT_FUNCTION + 1]) * pair[STRUCTURE_ROWS + DISPLACEMENT_ERROR]
    return (
        least - margin - other * max(abs(right[2]), abs(next_right[2]))
        < -pair[CONTACT_ROUNDING] * row[0, LARGEST_DISPLACEMENT]
    )


@lean
def run_events(row, log, segment, elapsed):
    """Carry a row through the rest of one step, event by event; return whether it got through."""
    for _ in range(100 * int(row[0, BOUNCE_LIMIT])):
        span, kind, index = find_event(row, segment, elapsed)
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, log, segment, elapsed, span, kind, index)
        if elapsed >= segment.duration:
            return True
    return False


@lean
def _repeat_step(pair, row, log, left, right, next_left, next_right, segment, happens, yields):
    """Carry a pair through a step that may hold an event; return whether it got through."""
    # yielding and unloading of a free pair that does not meet
    if (
        yields
        and not (happens or row[0, IN_CONTACT])
        and run_stiffness_changes(
            pair, row, left, right, next_left, next_right, segment, -row[0, GAP], math.inf
        )
    ):
        return True
    set_states(pair, left, right)
    row[0, BOUNCES] = 0.0
    elapsed = -1.0
    # single impacts of a free pair
    if not (yields or row[0, IN_CONTACT]):
        elapsed = run_free_impacts(pair, row, log, left, right, next_left, next_right, segment)
        if elapsed == segment.duration:
            return True
    # the rest event by event; the row has the state only after an impact
    if elapsed < 0.0:
        load_pair(pair, row)
    is_through = run_events(row, log, segment, max(elapsed, 0.0))
    store_pair(pair, row, segment.duration)
    return is_through


@lean
def step_through_tile(pair, row, log, ground, count, duration):
    """
    Carry a pair through a tile that may hold an event.

    Parameters
    ----------
    pair : (LANE_ROWS,) ndarray
        Numbers of its lane; see `lanes` for its rows.
    row : (2, ROW_COLUMNS) ndarray
        Its row of structures; see `motion` for its columns.
    log : (n_lines, LOG_COLUMNS) ndarray
        Log of impacts.
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
    second = STRUCTURE_ROWS
    is_through = True
    is_bilinear = min(row[0, YIELD], row[1, YIELD]) < math.inf
    # states and contact function at the start of the tile
    ground_start = ground_along(pair, ground, 0)
    left = state_at_tile_start(pair, 0, ground_start)
    right = state_at_tile_start(pair, second, ground_start)
    least = _contact_value(pair, left, right, ground_start)
    for k in range(1, count + 1):
        # states after the step, as if no event happened in it
        ground_end = ground_along(pair, ground, k)
        next_left = state_after_step(pair, 0, left, ground_start, ground_end)
        next_right = state_after_step(pair, second, right, ground_start, ground_end)
        next_least = _contact_value(pair, next_left, next_right, ground_end)
        # events that the error bounds do not exclude
        happens = _may_meet_or_part(
            pair, row, min(least, next_least), left, next_left, right, next_right
        )
        yields = is_bilinear and (
            may_yield(pair, 0, left, next_left) or may_yield(pair, second, right, next_right)
        )
        if happens | yields:
            # repeat the step with its events
            segment = segment_of_step(row, ground_start, ground_end, duration)
            is_through &= _repeat_step(
                pair, row, log, left, right, next_left, next_right, segment, happens, yields
            )
            next_left = present_state(pair, 0, ground_end)
            next_right = present_state(pair, second, ground_end)
            next_least = _contact_value(pair, next_left, next_right, ground_end)
        else:
            # maxima inside the step
            change = ground_end - ground_start
            if may_exceed_maxima(pair, row, 0, left, next_left):
                raise_maxima_inside(pair, row, 0, left, next_left, change, 1.0)
            if may_exceed_maxima(pair, row, 1, right, next_right):
                raise_maxima_inside(pair, row, 1, right, next_right, change, 1.0)
        left = next_left
        right = next_right
        least = next_least
        ground_start = ground_end
    set_states(pair, left, right)
    return is_through


@lean
def write_back(lanes, lane, pair, row):
    """Copy a pair back to its lane, with the maxima of its row, and coefficients that are new."""
    if pair[IS_CHANGED] != 0.0:
        pair[IS_CHANGED] = 0.0
        write_lane(lanes, lane, pair)
    # state and maxima
    for i in range(2):
        first = i * STRUCTURE_ROWS
        lanes[at(first + DISPLACEMENT, lane)] = pair[first + DISPLACEMENT]
        lanes[at(first + VELOCITY, lane)] = pair[first + VELOCITY]
        lanes[at(first + MAXIMUM_SO_FAR, lane)] = row[i, LARGEST_DISPLACEMENT]
        lanes[at(first + RADIUS_SQUARED_SO_FAR, lane)] = row[i, LARGEST_RADIUS_SQUARED]


@lean
def treat_flagged_lane(lanes, lane, flag, memory, record, grounds, step, count):
    """
    Treat one flagged lane after the sweep of a tile; return whether it got through.

    ``memory`` is that of the lane: its line of numbers, its row, the log and its deferred
    tiles; ``grounds`` is the ground of this tile and room for that of a deferred one.
    """
    pair, row, log, deferred = memory
    # a maximum only
    if not flag & EVENT_FLAG:
        raise_maxima_of_tile(
            lanes, lane, flag, pair, row, deferred, record, grounds[1], step, count
        )
        return True
    # an event: earlier maxima first, then the tile again from its start
    search_deferred(lanes, lane, pair, row, deferred, record, grounds[1])
    read_states(lanes, lane, pair)
    is_through = step_through_tile(pair, row, log, grounds[0], count, record.duration)
    write_back(lanes, lane, pair, row)
    return is_through
