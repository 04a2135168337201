"""
One pair through a tile of steps in which something may happen to it, one step after another.

Steps inside which nothing can happen are the same formulas as in ``pounding_lanes``; the others are
repeated: plain impacts by ``pounding_bounce``, and all else event by event, by the code of single
histories.
"""

import math

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.pounding_events.motion import (
    BOUNCES,
    HIGHEST,
    MOST_BOUNCES,
    STUCK,
    TERMS,
    WIDEST,
    YIELD,
    Segment,
)
from per_obspy.kernels.pounding_events.next_event import find_event, finish_piece
from per_obspy.kernels.pounding_lanes.deferred_maxima import (
    find_maxima,
    read_lane,
    search_waiting,
    write_lane,
)
from per_obspy.kernels.pounding_lanes.free_impacts import bounce, put
from per_obspy.kernels.pounding_lanes.lanes import (
    EVENT,
    FLOOR,
    HIGHEST_PLACE,
    PLACE,
    PLACE_SAG,
    SPEED,
    SPEED_SAG,
    START_PLACE,
    START_SPEED,
    STRUCTURE_ROWS,
    WIDEST_RADIUS,
)
from per_obspy.kernels.pounding_lanes.lanes import GUARD as CLOSING
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    along,
    may_rise,
    may_yield,
    raise_inside,
    state,
    step,
)
from per_obspy.kernels.pounding_lanes.pair_rows import load_pair, store_pair


@inlined
def present(pair, first, ground):
    """Return the state of a structure of a pair."""
    return state(pair, first, pair[first + PLACE], pair[first + SPEED], ground)


@inlined
def at_start(pair, first, ground):
    """Return the state of a structure at the start of the tile."""
    return state(pair, first, pair[first + START_PLACE], pair[first + START_SPEED], ground)


@lean
def segment_of(row, here, there, duration):
    """Return the segment that a step is."""
    return Segment(0.0, duration, here, (there - here) / duration, int(row[0, TERMS]))


@inlined
def _guard(pair, left, right, ground):
    """Return what stays positive until the pair meets or parts."""
    form = pair[CLOSING + 2] * left[1] + (pair[CLOSING + 3] * ground + pair[CLOSING + 4])
    return pair[CLOSING] * left[0] + (pair[CLOSING + 1] * right[0] + form)


@inlined
def _may_meet_or_part(pair, row, least, left, next_left, right, next_right):
    """Tell whether the guard, with this least value at the ends of a step, may fall through zero inside it."""
    margin = abs(pair[CLOSING]) * pair[PLACE_SAG] + abs(pair[CLOSING + 2]) * pair[SPEED_SAG]
    margin *= max(abs(left[2]), abs(next_left[2]))
    other = abs(pair[CLOSING + 1]) * pair[STRUCTURE_ROWS + PLACE_SAG]
    return (
        least - margin - other * max(abs(right[2]), abs(next_right[2]))
        < -pair[FLOOR] * row[0, HIGHEST]
    )


@lean
def repeat_step(row, log, segment, elapsed):
    """Carry a pair through what is left of one step, event by event; tell whether it got through."""
    for _ in range(100 * int(row[0, MOST_BOUNCES])):
        span, kind, place = find_event(row, segment, elapsed)
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, log, segment, elapsed, span, kind, place)
        if elapsed >= segment.duration:
            return True
    return False


@lean
def _repeat(pair, row, log, left, right, next_left, next_right, segment, yields):
    """Carry a pair through a step in which it may meet or part, or one may yield; tell whether it got through."""
    put(pair, left, right)
    row[0, BOUNCES], elapsed = 0.0, -1.0
    if not (yields or row[0, STUCK]):
        elapsed = bounce(pair, row, log, left, right, next_left, next_right, segment)
        if elapsed == segment.duration:
            return True
    if elapsed < 0.0:
        load_pair(pair, row)
    through = repeat_step(row, log, segment, max(elapsed, 0.0))
    store_pair(pair, row, segment.duration)
    return through


@lean
def walk(pair, row, log, ground, count, duration):
    """Carry a pair through a tile in which something may happen; tell whether it got through."""
    second, through, bilinear = STRUCTURE_ROWS, True, min(row[0, YIELD], row[1, YIELD]) < math.inf
    here = along(pair, ground, 0)
    left, right = at_start(pair, 0, here), at_start(pair, second, here)
    least = _guard(pair, left, right, here)
    for k in range(1, count + 1):
        there = along(pair, ground, k)
        next_left, next_right = (
            step(pair, 0, left, here, there),
            step(pair, second, right, here, there),
        )
        next_least = _guard(pair, next_left, next_right, there)
        happens = _may_meet_or_part(
            pair, row, min(least, next_least), left, next_left, right, next_right
        )
        yields = bilinear and (
            may_yield(pair, 0, left, next_left) or may_yield(pair, second, right, next_right)
        )
        if happens | yields:
            segment = segment_of(row, here, there, duration)
            through &= _repeat(pair, row, log, left, right, next_left, next_right, segment, yields)
            next_left, next_right = present(pair, 0, there), present(pair, second, there)
            next_least = _guard(pair, next_left, next_right, there)
        else:
            if may_rise(pair, row, 0, left, next_left):
                raise_inside(pair, row, 0, left, next_left, there - here, 1.0)
            if may_rise(pair, row, 1, right, next_right):
                raise_inside(pair, row, 1, right, next_right, there - here, 1.0)
        left, right, least, here = next_left, next_right, next_least, there
    put(pair, left, right)
    return through


@lean
def write_back(lanes, lane, pair, row):
    """Copy a pair back to its lane, with the maxima of its row."""
    for i in range(2):
        first = i * STRUCTURE_ROWS
        pair[first + HIGHEST_PLACE], pair[first + WIDEST_RADIUS] = row[i, HIGHEST], row[i, WIDEST]
    write_lane(lanes, lane, pair)


@lean
def revisit(lanes, lane, flag, own, record, grounds, step, count):
    """
    Do for a flagged lane what the sweep cannot; tell whether it got through.

    ``own`` is room for its numbers, its row, the log and its waiting tiles.
    """
    pair, row, log, waiting = own
    if not flag & EVENT:
        find_maxima(lanes, lane, flag, pair, row, waiting, record, grounds[1], step, count)
        return True
    search_waiting(lanes, lane, pair, row, waiting, record, grounds[1])
    read_lane(lanes, lane, pair)
    through = walk(pair, row, log, grounds[0], count, record.duration)
    write_back(lanes, lane, pair, row)
    return through
