"""
Scalar steps of one pair through a tile that may hold an event.

Steps that certainly hold no event use the same formulas as ``lanes``; the others are repeated:
single impacts by ``impact_steps``, yielding and unloading by ``stiffness_changes``, and all else
from event to event, by the code of single histories (``next_event``). Pairs that never touch have
no impacts; an event is then a relative displacement that may pass its largest value.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.pounding_events.motion import (
    BOUNCE_LIMIT,
    BOUNCES,
    GAP,
    IN_CONTACT,
    LARGEST_DISPLACEMENT,
    OPENING,
    TERM_COUNT,
    YIELD,
    Segment,
)
from per_obspy.kernels.pounding_events.next_event import find_event, finish_piece
from per_obspy.kernels.pounding_lanes.impact_steps import run_free_impacts, set_states
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
from per_obspy.kernels.pounding_lanes.phases import load_row, store_row
from per_obspy.kernels.pounding_lanes.relative_in_step import (
    may_exceed_relative,
    raise_relative,
    raise_relative_to,
)
from per_obspy.kernels.pounding_lanes.stiffness_changes import run_stiffness_changes

#: Events of one step above which a history is given up: so many, and so many per bounce allowed.
MOST_EVENTS, EVENTS_PER_BOUNCE = 1000, 100


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


@inlined
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
def _may_meet_or_part(pair, row, least, ends):
    """Return whether the contact function may fall through zero inside a step, by its least end."""
    left, right, next_left, next_right = ends
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
def run_events(row, log, segment, elapsed, is_apart):
    """Carry a row through the rest of one step, event by event; return whether it got through."""
    for _ in range(MOST_EVENTS + EVENTS_PER_BOUNCE * int(row[0, BOUNCE_LIMIT])):
        # the piece until the next event
        span, kind, index = find_event(row, segment, elapsed)
        if is_apart:
            raise_relative(row, span, segment.terms)
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, log, segment, elapsed, span, kind, index)
        if elapsed >= segment.duration:
            return True
    return False


@inlined
def _repeat_step(pair, row, log, ends, segment, happens, yields, is_apart):
    """
    Carry a pair through a step that may hold an event; return whether it got through.

    ``ends`` are the states of both structures at its start, then at its end without event.
    """
    left, right, next_left, next_right = ends
    # yielding and unloading of a free pair that does not meet, or pass its largest distances
    least, largest = -row[0, GAP], math.inf
    if is_apart:
        least, largest = -row[1, OPENING], row[0, OPENING]
    if (
        yields
        and not (happens or row[0, IN_CONTACT])
        and run_stiffness_changes(
            pair, row, left, right, next_left, next_right, segment, least, largest
        )
    ):
        return True
    set_states(pair, left, right)
    row[0, BOUNCES] = 0.0
    elapsed = -1.0
    # single impacts of a free pair
    if not (yields or is_apart or row[0, IN_CONTACT]):
        elapsed = run_free_impacts(pair, row, log, left, right, next_left, next_right, segment)
        if elapsed == segment.duration:
            return True
    # the rest event by event; the row has the state only after an impact
    if elapsed < 0.0:
        load_row(pair, row)
    is_through = run_events(row, log, segment, max(elapsed, 0.0), is_apart)
    store_row(pair, row, segment.duration)
    return is_through


@lean
def step_through_tile(pair, row, log, ground, count, duration, is_apart):
    """
    Carry a pair through a tile that may hold an event.

    Parameters
    ----------
    pair : (2 * STRUCTURE_ROWS,) ndarray
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
    is_apart : bool
        Whether the pair never touches, and its largest relative displacements are raised.

    Returns
    -------
    bool
        Whether it got through: no step had too many events.
    """
    second = STRUCTURE_ROWS
    is_through = True
    is_bilinear = min(row[0, YIELD], row[1, YIELD]) < math.inf
    # states and contact function at the start of the tile
    before = ground_along(pair, ground, 0)
    left = state_at_tile_start(pair, 0, before)
    right = state_at_tile_start(pair, second, before)
    least = _contact_value(pair, left, right, before)
    for k in range(1, count + 1):
        # states after the step, as if no event happened in it
        after = ground_along(pair, ground, k)
        next_left = state_after_step(pair, 0, left, before, after)
        next_right = state_after_step(pair, second, right, before, after)
        next_least = _contact_value(pair, next_left, next_right, after)
        ends = left, right, next_left, next_right
        # events that the error bounds do not exclude
        if is_apart:
            happens = may_exceed_relative(pair, row, left, right, next_left, next_right)
        else:
            happens = _may_meet_or_part(pair, row, min(least, next_least), ends)
        yields = is_bilinear and (
            may_yield(pair, 0, left, next_left) or may_yield(pair, second, right, next_right)
        )
        if happens | yields:
            # repeat the step with its events
            segment = segment_of_step(row, before, after, duration)
            is_through &= _repeat_step(pair, row, log, ends, segment, happens, yields, is_apart)
            next_left = present_state(pair, 0, after)
            next_right = present_state(pair, second, after)
            next_least = _contact_value(pair, next_left, next_right, after)
        else:
            # maxima inside the step
            raise_maxima(pair, row, 0, left, next_left, after - before, 1.0)
            raise_maxima(pair, row, 1, right, next_right, after - before, 1.0)
        left, right, least, before = next_left, next_right, next_least, after
    set_states(pair, left, right)
    if is_apart:
        raise_relative_to(row, right[0] - left[0])
    return is_through
