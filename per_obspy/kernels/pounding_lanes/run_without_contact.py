"""
Largest relative displacements of 32 pairs of bilinear structures that never touch.

Exact between samples. The lanes of ``lanes`` with a gap that never closes: a lane is stepped again
through a tile where a structure may yield or unload, or where the relative displacement may pass
its largest value to either side.
"""

import math

from per_obspy.kernels._jit import lean
from per_obspy.kernels.polynomial_roots import first_fall, size_and_curvature, value_and_slope
from per_obspy.kernels.pounding_events.motion import EVENT_FUNCTION, OPENING, TAYLOR, YIELD, U
from per_obspy.kernels.pounding_events.next_event import find_event, finish_piece
from per_obspy.kernels.pounding_events.row_history import is_settled, reach_in_free_vibration
from per_obspy.kernels.pounding_lanes.deferred_maxima import (
    fill_ground,
    raise_maxima_of_tile,
    read_states,
    search_deferred,
    write_lane,
)
from per_obspy.kernels.pounding_lanes.free_impacts import opening_rate
from per_obspy.kernels.pounding_lanes.impact_steps import set_states
from per_obspy.kernels.pounding_lanes.lanes import (
    DISPLACEMENT,
    DISPLACEMENT_ERROR,
    EVENT_FLAG,
    LANE_ROWS,
    OMEGA,
    PAIR_LANES,
    STRUCTURE_ROWS,
    TILE_DISPLACEMENT_ERROR,
    TILE_STEPS,
    UNROLLED_STEPS,
    VELOCITY_ERROR,
    advance_one_step,
    at,
    flag_tile,
    flag_unloading,
    lower_speeds,
    start_tile,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import (
    ground_along,
    may_exceed_maxima,
    may_yield,
    raise_maxima_inside,
    state_after_step,
)
from per_obspy.kernels.pounding_lanes.pair_rows import load_pair, rest_pair, store_pair
from per_obspy.kernels.pounding_lanes.run_block import SETTLING_STEPS, prepare_block
from per_obspy.kernels.pounding_lanes.step_by_step import (
    present_state,
    segment_of_step,
    state_at_tile_start,
    write_back,
)
from per_obspy.kernels.pounding_lanes.stiffness_changes import run_stiffness_changes

#: Gap that no structure reaches, and relative displacement that none passes, m.
UNREACHABLE = 1e12
# rows after those of `lanes`, two each: for u2 - u1, then for u1 - u2
#: largest relative displacement so far (also in OPENING of both lines of the row), and at the
#: samples of the tile
RELATIVE_SO_FAR, TILE_RELATIVE = LANE_ROWS, LANE_ROWS + 2
LANE_ROWS_WITHOUT_CONTACT = LANE_ROWS + 4
#: Changes of stiffness in one step, above which a history is given up.
MOST_STIFFNESS_CHANGES = 1000


@lean
def _raise_tile_relative(lanes, begins):
    """Raise the relative displacements of the tile to those now, or begin with them."""
    for lane in range(PAIR_LANES):
        relative = lanes[at(STRUCTURE_ROWS + DISPLACEMENT, lane)] - lanes[at(DISPLACEMENT, lane)]
        # to either side
        opening = relative if begins else max(lanes[at(TILE_RELATIVE, lane)], relative)
        closing = -relative if begins else max(lanes[at(TILE_RELATIVE + 1, lane)], -relative)
        lanes[at(TILE_RELATIVE, lane)] = opening
        lanes[at(TILE_RELATIVE + 1, lane)] = closing


@lean
def _flag_relative(lanes, flags):
    """Flag lanes whose relative displacement may pass its largest values in the tile."""
    for lane in range(PAIR_LANES):
        # error bound between the samples
        margin = (
            lanes[at(TILE_DISPLACEMENT_ERROR, lane)]
            + lanes[at(STRUCTURE_ROWS + TILE_DISPLACEMENT_ERROR, lane)]
        )
        opens = lanes[at(TILE_RELATIVE, lane)] + margin > lanes[at(RELATIVE_SO_FAR, lane)]
        closes = lanes[at(TILE_RELATIVE + 1, lane)] + margin > lanes[at(RELATIVE_SO_FAR + 1, lane)]
        flags[lane] |= EVENT_FLAG if opens | closes else 0


@lean
def _sweep_tile(lanes, flags, ground, count):
    """Step every lane through a tile as if no event happened, and flag lanes where one may."""
    start_tile(lanes, ground[0, 0], ground[1, 0])
    _raise_tile_relative(lanes, True)
    lower_speeds(lanes, True)
    # step by step: the relative displacement is needed at every sample
    for k in range(count):
        advance_one_step(lanes, ground[0, k], ground[1, k], ground[0, k + 1], ground[1, k + 1])
        _raise_tile_relative(lanes, False)
        if (k + 1) % UNROLLED_STEPS == 0 or k + 1 == count:
            lower_speeds(lanes, False)
    flag_tile(lanes, flags, ground, count)
    flag_unloading(lanes, flags)
    _flag_relative(lanes, flags)


@lean
def raise_relative(row, span, terms):
    """Raise the largest relative displacements to those of a piece, exact between its ends."""
    _raise_relative_at(row, terms, 0.0)
    _raise_relative_at(row, terms, span)
    # rate of u2 - u1; its bound may exclude larger values inside
    for n in range(1, terms):
        row[0, EVENT_FUNCTION + n - 1] = n * (row[1, TAYLOR + n] - row[0, TAYLOR + n])
    size, _ = size_and_curvature(row, 0, EVENT_FUNCTION, terms - 1, span)
    reach = span * (size + abs(row[0, EVENT_FUNCTION]))
    relative = row[1, U] - row[0, U]
    if relative + reach <= row[0, OPENING] and reach - relative <= row[1, OPENING]:
        return
    # values at the roots of the rate, one after another; its sign changes at each
    value, slope = value_and_slope(row, 0, EVENT_FUNCTION, terms - 1, 0.0)
    sign = 1.0 if value > 0.0 or (value == 0.0 and slope > 0.0) else -1.0
    time = first_fall(row, 0, EVENT_FUNCTION, terms - 1, sign, 0.0, span, 0.0)
    while time >= 0.0:
        _raise_relative_at(row, terms, time)
        sign = -sign
        time = first_fall(row, 0, EVENT_FUNCTION, terms - 1, sign, time, span, 0.0)


@lean
def _raise_relative_at(row, terms, time):
    """Raise the largest relative displacements to the one at a time of the piece."""
    left, _ = value_and_slope(row, 0, TAYLOR, terms, time)
    right, _ = value_and_slope(row, 1, TAYLOR, terms, time)
    row[0, OPENING] = max(row[0, OPENING], right - left)
    row[1, OPENING] = max(row[1, OPENING], left - right)


@lean
def _run_events(row, log, segment):
    """Carry a row through one step, event by event; return whether it got through."""
    elapsed = 0.0
    for _ in range(MOST_STIFFNESS_CHANGES):
        span, kind, index = find_event(row, segment, elapsed)
        raise_relative(row, span, segment.terms)
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, log, segment, elapsed, span, kind, index)
        if elapsed >= segment.duration:
            return True
    return False


@lean
def _may_exceed_relative(pair, row, left, next_left, right, next_right):
    """
    Return whether the relative displacement may pass its largest values inside a step.

    Raise these values to the one at the start; the end is not certain before it is known that no
    structure leaves its branch. The rate leaves its chord by ``error`` at most, so that it has no
    root where the sum of its ends is too large.
    """
    second = STRUCTURE_ROWS
    strength = max(abs(left[2]), abs(next_left[2]))
    other_strength = max(abs(right[2]), abs(next_right[2]))
    # relative displacement and its rate at both ends
    before = right[0] - left[0]
    after = next_right[0] - next_left[0]
    rate = opening_rate(pair, left, right)
    next_rate = opening_rate(pair, next_left, next_right)
    row[0, OPENING] = max(row[0, OPENING], before)
    row[1, OPENING] = max(row[1, OPENING], -before)
    # the rate may have a root
    error = (
        pair[OMEGA] * pair[VELOCITY_ERROR] * strength
        + pair[second + OMEGA] * pair[second + VELOCITY_ERROR] * other_strength
    )
    turns = abs(rate + next_rate) <= abs(next_rate - rate) + 2.0 * error
    # the largest values may be passed
    margin = (
        pair[DISPLACEMENT_ERROR] * strength + pair[second + DISPLACEMENT_ERROR] * other_strength
    )
    opens = max(before, after) + margin > row[0, OPENING]
    return turns & (opens | (margin - min(before, after) > row[1, OPENING]))


@lean
def _repeat_step(pair, row, log, left, right, next_left, next_right, segment, exceeds):
    """Carry a pair through a step that may hold an event; return whether it got through."""
    # yielding and unloading below the largest relative displacements
    if not exceeds and run_stiffness_changes(
        pair, row, left, right, next_left, next_right, segment, -row[1, OPENING], row[0, OPENING]
    ):
        return True
    # the rest event by event
    set_states(pair, left, right)
    load_pair(pair, row)
    is_through = _run_events(row, log, segment)
    store_pair(pair, row, segment.duration)
    return is_through


@lean
def _step_through_tile(pair, row, log, ground, count, duration):
    """Carry a pair through a tile that may hold an event; return whether it got through."""
    second = STRUCTURE_ROWS
    is_through = True
    is_bilinear = min(row[0, YIELD], row[1, YIELD]) < math.inf
    # states at the start of the tile
    ground_start = ground_along(pair, ground, 0)
    left = state_at_tile_start(pair, 0, ground_start)
    right = state_at_tile_start(pair, second, ground_start)
    for k in range(1, count + 1):
        # states after the step, as if no event happened in it
        ground_end = ground_along(pair, ground, k)
        next_left = state_after_step(pair, 0, left, ground_start, ground_end)
        next_right = state_after_step(pair, second, right, ground_start, ground_end)
        # events that the error bounds do not exclude
        exceeds = _may_exceed_relative(pair, row, left, next_left, right, next_right)
        yields = is_bilinear and (
            may_yield(pair, 0, left, next_left) or may_yield(pair, second, right, next_right)
        )
        if exceeds | yields:
            # repeat the step with its events
            segment = segment_of_step(row, ground_start, ground_end, duration)
            is_through &= _repeat_step(
                pair, row, log, left, right, next_left, next_right, segment, exceeds
            )
            next_left = present_state(pair, 0, ground_end)
            next_right = present_state(pair, second, ground_end)
        else:
            # maxima inside the step
            change = ground_end - ground_start
            if may_exceed_maxima(pair, row, 0, left, next_left):
                raise_maxima_inside(pair, row, 0, left, next_left, change, 1.0)
            if may_exceed_maxima(pair, row, 1, right, next_right):
                raise_maxima_inside(pair, row, 1, right, next_right, change, 1.0)
        left = next_left
        right = next_right
        ground_start = ground_end
    # end of the tile
    set_states(pair, left, right)
    relative = right[0] - left[0]
    row[0, OPENING] = max(row[0, OPENING], relative)
    row[1, OPENING] = max(row[1, OPENING], -relative)
    return is_through


@lean
def _treat_flagged_lane(lanes, lane, flag, memory, record, grounds, step, count):
    """Treat one flagged lane as ``treat_flagged_lane`` of ``step_by_step``, without contact."""
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
    is_through = _step_through_tile(pair, row, log, grounds[0], count, record.duration)
    lanes[at(RELATIVE_SO_FAR, lane)] = row[0, OPENING]
    lanes[at(RELATIVE_SO_FAR + 1, lane)] = row[1, OPENING]
    write_back(lanes, lane, pair, row)
    return is_through


@lean
def _advance_block(lanes, flags, pairs, rows, logs, deferred, record, grounds, step, last):
    """Carry all lanes from a step to the last one; return whether all got through."""
    is_through = True
    while step < last:
        # all lanes side by side through one tile
        fill_ground(record, step, grounds[0])
        count = min(TILE_STEPS, last - step)
        _sweep_tile(lanes, flags, grounds[0], count)
        # flagged lanes one by one
        for lane in range(PAIR_LANES):
            if flags[lane]:
                memory = pairs[lane], rows[lane], logs[lane], deferred[lane]
                is_through &= _treat_flagged_lane(
                    lanes, lane, flags[lane], memory, record, grounds, step, count
                )
        step += count
    return is_through


@lean
def _is_over(row):
    """Return whether free vibration can no longer raise a displacement or the relative one."""
    low_1, high_1 = reach_in_free_vibration(row, 0)
    low_2, high_2 = reach_in_free_vibration(row, 1)
    return (
        is_settled(row) and high_2 - low_1 <= row[0, OPENING] and high_1 - low_2 <= row[1, OPENING]
    )


@lean
def _retire_lanes(lanes, pairs, rows, deferred, record, grounds, free_steps, elapsed):
    """
    Rest the lanes whose result is final after so many sampling intervals of free vibration.

    Return the number of the others.
    """
    active = 0
    for lane in range(PAIR_LANES):
        if free_steps[lane] >= 0:
            # maxima so far, and the state as a row
            pair = pairs[lane]
            search_deferred(lanes, lane, pair, rows[lane], deferred[lane], record, grounds[1])
            read_states(lanes, lane, pair)
            load_pair(pair, rows[lane])
            if elapsed >= free_steps[lane] or _is_over(rows[lane]):
                free_steps[lane] = -1
                rest_pair(pair)
                write_lane(lanes, lane, pair)
                lanes[at(RELATIVE_SO_FAR, lane)] = UNREACHABLE
                lanes[at(RELATIVE_SO_FAR + 1, lane)] = UNREACHABLE
            else:
                active += 1
    return active


@lean
def run_without_contact(
    record, lanes, flags, grounds, pairs, deferred, rows, logs, cosine, sine, free_steps
):
    """
    Run 32 pairs that never touch through a record and the free vibration after it.

    Parameters
    ----------
    record, flags, grounds, pairs, deferred, logs, cosine, sine, free_steps
        As in `run_block`.
    lanes : (LANE_ROWS_WITHOUT_CONTACT * PAIR_LANES,) ndarray
        Room for the numbers of all lanes.
    rows : (PAIR_LANES, 2, ROW_COLUMNS) ndarray
        As in `run_block`, with gaps that are UNREACHABLE. They hold the results: OPENING, the
        largest ``u2 - u1`` in the first line and ``u1 - u2`` in the second (m),
        LARGEST_DISPLACEMENT (m) and LARGEST_RADIUS_SQUARED (m²).

    Returns
    -------
    bool
        Whether all pairs got through: no step had too many events.
    """
    prepare_block(lanes, pairs, rows, cosine, sine, free_steps, record.duration)
    # a lane without pair is never flagged
    for lane in range(PAIR_LANES):
        largest = 0.0 if free_steps[lane] >= 0 else UNREACHABLE
        lanes[at(RELATIVE_SO_FAR, lane)] = largest
        lanes[at(RELATIVE_SO_FAR + 1, lane)] = largest
    # the record
    last = (record.components.shape[1] - 1) * record.refinement
    is_through = _advance_block(lanes, flags, pairs, rows, logs, deferred, record, grounds, 0, last)
    # free vibration, until every pair is settled
    elapsed = 0
    while _retire_lanes(lanes, pairs, rows, deferred, record, grounds, free_steps, elapsed):
        step = last
        last += SETTLING_STEPS * record.refinement
        is_through &= _advance_block(
            lanes, flags, pairs, rows, logs, deferred, record, grounds, step, last
        )
        elapsed += SETTLING_STEPS
    return is_through
