"""
How far 32 pairs of bilinear structures come apart and together if they never touch, exact between samples.

The lanes of ``pounding_lanes`` with a gap that nothing closes. A lane is walked again step by step
where a structure may yield or unload, or where the relative displacement may pass its largest value
to either side.
"""

import math

from per_obspy.kernels._jit import lean
from per_obspy.kernels.polynomial_roots import first_fall, size_and_curvature, value_and_slope
from per_obspy.kernels.pounding_events.motion import CURVE, GUARD, OPENING, YIELD, U
from per_obspy.kernels.pounding_events.next_event import find_event, finish_piece
from per_obspy.kernels.pounding_events.row_history import is_settled, reach_in_free_vibration
from per_obspy.kernels.pounding_lanes.deferred_maxima import (
    fill_ground,
    find_maxima,
    read_lane,
    search_waiting,
    write_lane,
)
from per_obspy.kernels.pounding_lanes.free_impacts import opening, put
from per_obspy.kernels.pounding_lanes.lanes import (
    EVENT,
    LANES,
    OMEGA,
    PLACE,
    PLACE_SAG,
    ROWS,
    SAG,
    SPEED_SAG,
    STRUCTURE_ROWS,
    TILE,
    advance_one,
    at,
    flag_tile,
    start_tile,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    along,
    may_rise,
    may_yield,
    raise_inside,
    step,
)
from per_obspy.kernels.pounding_lanes.pair_rows import load_pair, rest, store_pair
from per_obspy.kernels.pounding_lanes.run_block import SETTLING_STEPS, prepare_block
from per_obspy.kernels.pounding_lanes.step_by_step import at_start, present, segment_of, write_back

#: Beyond the reach of any structure, m.
FAR = 1e12
#: Largest ``u2 - u1`` and ``u1 - u2`` so far, and at the samples of the tile: rows after those of
#: the lanes. The former are also OPENING of both lines of a pair.
APART, APART_NOW = ROWS, ROWS + 2
ROWS_APART = ROWS + 4
#: More changes of stiffness in one step than any record causes.
MOST_CHANGES = 1000


@lean
def note_apart(lanes, begins):
    """Raise the relative displacements of the tile to those now, or begin with them."""
    for lane in range(LANES):
        apart = lanes[at(STRUCTURE_ROWS + PLACE, lane)] - lanes[at(PLACE, lane)]
        widest = apart if begins else max(lanes[at(APART_NOW, lane)], apart)
        closest = -apart if begins else max(lanes[at(APART_NOW + 1, lane)], -apart)
        lanes[at(APART_NOW, lane)], lanes[at(APART_NOW + 1, lane)] = widest, closest


@lean
def flag_apart(lanes, flags):
    """Flag lanes whose relative displacement may pass its largest values in the tile."""
    for lane in range(LANES):
        margin = lanes[at(SAG, lane)] + lanes[at(STRUCTURE_ROWS + SAG, lane)]
        wider = lanes[at(APART_NOW, lane)] + margin > lanes[at(APART, lane)]
        closer = lanes[at(APART_NOW + 1, lane)] + margin > lanes[at(APART + 1, lane)]
        flags[lane] |= EVENT if wider | closer else 0


@lean
def sweep_apart(lanes, flags, ground, count):
    """Step every lane through a tile, as if nothing happened, and flag those where something may."""
    start_tile(lanes, ground[0, 0], ground[1, 0])
    note_apart(lanes, True)
    for k in range(count):
        advance_one(lanes, ground[0, k], ground[1, k], ground[0, k + 1], ground[1, k + 1])
        note_apart(lanes, False)
    flag_tile(lanes, flags, ground, count)
    flag_apart(lanes, flags)


@lean
def raise_apart(row, span, terms):
    """Raise the largest relative displacements to those of a piece, exact between its ends."""
    _raise_apart_at(row, terms, 0.0)
    _raise_apart_at(row, terms, span)
    for n in range(1, terms):
        row[0, GUARD + n - 1] = n * (row[1, CURVE + n] - row[0, CURVE + n])
    size, _ = size_and_curvature(row, 0, GUARD, terms - 1, span)
    reach, here = span * (size + abs(row[0, GUARD])), row[1, U] - row[0, U]
    if here + reach <= row[0, OPENING] and reach - here <= row[1, OPENING]:
        return
    value, slope = value_and_slope(row, 0, GUARD, terms - 1, 0.0)
    sign = 1.0 if value > 0.0 or (value == 0.0 and slope > 0.0) else -1.0
    time = first_fall(row, 0, GUARD, terms - 1, sign, 0.0, span, 0.0)
    while time >= 0.0:
        _raise_apart_at(row, terms, time)
        sign = -sign
        time = first_fall(row, 0, GUARD, terms - 1, sign, time, span, 0.0)


@lean
def _raise_apart_at(row, terms, time):
    """Raise the largest relative displacements to the one at a time of the piece."""
    left, _ = value_and_slope(row, 0, CURVE, terms, time)
    right, _ = value_and_slope(row, 1, CURVE, terms, time)
    row[0, OPENING] = max(row[0, OPENING], right - left)
    row[1, OPENING] = max(row[1, OPENING], left - right)


@lean
def repeat_apart(row, log, segment):
    """Carry a pair through one step, event by event; tell whether it got through."""
    elapsed = 0.0
    for _ in range(MOST_CHANGES):
        span, kind, place = find_event(row, segment, elapsed)
        raise_apart(row, span, segment.terms)
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, log, segment, elapsed, span, kind, place)
        if elapsed >= segment.duration:
            return True
    return False


@lean
def _may_part(pair, row, left, next_left, right, next_right):
    """
    Tell whether the relative displacement may pass its largest values where its rate has a root inside a step.

    Raise these values to the one at the start; the end is not certain before it is known that no
    structure leaves its branch. The rate leaves its chord by ``sag`` at most, so that it has no
    root where the sum of its ends is too large.
    """
    second = STRUCTURE_ROWS
    strength, other = max(abs(left[2]), abs(next_left[2])), max(abs(right[2]), abs(next_right[2]))
    before, after = right[0] - left[0], next_right[0] - next_left[0]
    rate, next_rate = opening(pair, left, right), opening(pair, next_left, next_right)
    row[0, OPENING], row[1, OPENING] = max(row[0, OPENING], before), max(row[1, OPENING], -before)
    sag = (
        pair[OMEGA] * pair[SPEED_SAG] * strength
        + pair[second + OMEGA] * pair[second + SPEED_SAG] * other
    )
    turns = abs(rate + next_rate) <= abs(next_rate - rate) + 2.0 * sag
    margin = pair[PLACE_SAG] * strength + pair[second + PLACE_SAG] * other
    wider = max(before, after) + margin > row[0, OPENING]
    return turns & (wider | (margin - min(before, after) > row[1, OPENING]))


@lean
def walk_apart(pair, row, log, ground, count, duration):
    """Carry a pair through a tile in which something may happen; tell whether it got through."""
    second, through, bilinear = STRUCTURE_ROWS, True, min(row[0, YIELD], row[1, YIELD]) < math.inf
    here = along(pair, ground, 0)
    left, right = at_start(pair, 0, here), at_start(pair, second, here)
    for k in range(1, count + 1):
        there = along(pair, ground, k)
        next_left, next_right = (
            step(pair, 0, left, here, there),
            step(pair, second, right, here, there),
        )
        happens = _may_part(pair, row, left, next_left, right, next_right)
        if bilinear:
            happens |= may_yield(pair, 0, left, next_left) | may_yield(
                pair, second, right, next_right
            )
        if happens:
            put(pair, left, right)
            load_pair(pair, row)
            through &= repeat_apart(row, log, segment_of(row, here, there, duration))
            store_pair(pair, row, duration)
            next_left, next_right = present(pair, 0, there), present(pair, second, there)
        else:
            if may_rise(pair, row, 0, left, next_left):
                raise_inside(pair, row, 0, left, next_left, there - here, 1.0)
            if may_rise(pair, row, 1, right, next_right):
                raise_inside(pair, row, 1, right, next_right, there - here, 1.0)
        left, right, here = next_left, next_right, there
    put(pair, left, right)
    apart = right[0] - left[0]
    row[0, OPENING], row[1, OPENING] = max(row[0, OPENING], apart), max(row[1, OPENING], -apart)
    return through


@lean
def _revisit(lanes, lane, flag, own, record, grounds, first, count):
    """Do for a flagged lane what the sweep cannot, as ``revisit`` of ``pounding_walk``; tell whether it got through."""
    pair, row, log, waiting = own
    if not flag & EVENT:
        find_maxima(lanes, lane, flag, pair, row, waiting, record, grounds[1], first, count)
        return True
    search_waiting(lanes, lane, pair, row, waiting, record, grounds[1])
    read_lane(lanes, lane, pair)
    through = walk_apart(pair, row, log, grounds[0], count, record.duration)
    lanes[at(APART, lane)], lanes[at(APART + 1, lane)] = row[0, OPENING], row[1, OPENING]
    write_back(lanes, lane, pair, row)
    return through


@lean
def _advance(lanes, flags, pair, rows, log, waiting, record, grounds, first, last):
    """Carry all lanes from a step to the last one; tell whether all got through."""
    through = True
    while first < last:
        fill_ground(record, first, grounds[0])
        count = min(TILE, last - first)
        sweep_apart(lanes, flags, grounds[0], count)
        for lane in range(LANES):
            if flags[lane]:
                own = pair, rows[lane], log, waiting[lane]
                through &= _revisit(lanes, lane, flags[lane], own, record, grounds, first, count)
        first += count
    return through


@lean
def _is_over(row):
    """Tell whether in free vibration neither a displacement nor the relative one can exceed its maximum."""
    low_1, high_1 = reach_in_free_vibration(row, 0)
    low_2, high_2 = reach_in_free_vibration(row, 1)
    return (
        is_settled(row) and high_2 - low_1 <= row[0, OPENING] and high_1 - low_2 <= row[1, OPENING]
    )


@lean
def _retire(lanes, pair, rows, waiting, record, grounds, free_steps, free):
    """Rest the lanes in which nothing can happen any more after so many steps of free vibration; count the others."""
    active = 0
    for lane in range(LANES):
        if free_steps[lane] >= 0:
            search_waiting(lanes, lane, pair, rows[lane], waiting[lane], record, grounds[1])
            read_lane(lanes, lane, pair)
            load_pair(pair, rows[lane])
            if free >= free_steps[lane] or _is_over(rows[lane]):
                free_steps[lane] = -1
                rest(pair)
                write_lane(lanes, lane, pair)
                lanes[at(APART, lane)] = lanes[at(APART + 1, lane)] = FAR
            else:
                active += 1
    return active


@lean
def run_apart(record, lanes, flags, grounds, pair, waiting, rows, log, cosine, sine, free_steps):
    """
    Run 32 pairs through a record and the free vibration after it; tell whether all got through.

    As ``run_block``; the gaps of ``rows`` are FAR, ``lanes`` have ROWS_APART rows.
    """
    prepare_block(lanes, pair, rows, cosine, sine, free_steps, record.duration)
    for lane in range(LANES):
        lanes[at(APART, lane)] = lanes[at(APART + 1, lane)] = 0.0 if free_steps[lane] >= 0 else FAR
    last = (record.components.shape[1] - 1) * record.refinement
    through = _advance(lanes, flags, pair, rows, log, waiting, record, grounds, 0, last)
    free = 0
    while _retire(lanes, pair, rows, waiting, record, grounds, free_steps, free):
        first, last = last, last + SETTLING_STEPS * record.refinement
        through &= _advance(lanes, flags, pair, rows, log, waiting, record, grounds, first, last)
        free += SETTLING_STEPS
    return through
