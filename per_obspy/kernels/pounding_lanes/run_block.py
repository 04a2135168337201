"""Histories of 32 pairs at once: the loop over the record and the free vibration after it."""

from per_obspy.kernels._jit import lean
from per_obspy.kernels.pounding_events.row_history import is_settled
from per_obspy.kernels.pounding_lanes.deferred_maxima import (
    fill_ground,
    read_states,
    search_deferred,
    write_lane,
)
from per_obspy.kernels.pounding_lanes.lanes import (
    AXIS_COSINE,
    AXIS_SINE,
    IS_CHANGED,
    PAIR_LANES,
    TILE_STEPS,
    sweep_tile,
)
from per_obspy.kernels.pounding_lanes.pair_rows import (
    load_pair,
    rest_pair,
    write_constants,
    write_phase,
)
from per_obspy.kernels.pounding_lanes.remaining_motion import GROUP_SAMPLES, remains_still
from per_obspy.kernels.pounding_lanes.step_by_step import treat_flagged_lane

#: Sampling intervals of free vibration between two checks whether a pair is settled.
SETTLING_STEPS = 16
#: Groups of samples of the record between two checks whether the rest of it counts.
GROUPS_BETWEEN_CHECKS = 8


@lean
def prepare_block(lanes, pairs, rows, cosine, sine, free_steps, duration):
    """Set all lanes to rest, for good those without a pair (``free_steps`` < 0)."""
    for lane in range(PAIR_LANES):
        pair = pairs[lane]
        pair[:] = 0.0
        write_constants(pair, rows[lane], cosine[lane], sine[lane], duration)
        write_phase(pair, rows[lane], duration)
        if free_steps[lane] < 0:
            rest_pair(pair)
        pair[IS_CHANGED] = 0.0
        write_lane(lanes, lane, pair)


@lean
def advance_block(lanes, flags, pairs, rows, logs, deferred, record, grounds, step, last):
    """Carry all lanes from a step to the last one; return whether all got through."""
    is_through = True
    while step < last:
        # all lanes side by side through one tile
        fill_ground(record, step, grounds[0])
        count = min(TILE_STEPS, last - step)
        if sweep_tile(lanes, flags, grounds[0], count):
            # flagged lanes one by one
            for lane in range(PAIR_LANES):
                if flags[lane]:
                    memory = pairs[lane], rows[lane], logs[lane], deferred[lane]
                    is_through &= treat_flagged_lane(
                        lanes, lane, flags[lane], memory, record, grounds, step, count
                    )
        step += count
    return is_through


@lean
def _is_over(pair, row, record, group):
    """Return whether no result of a pair changes from a group of samples on."""
    duration = GROUP_SAMPLES * record.refinement * record.duration
    cosine, sine = pair[AXIS_COSINE], pair[AXIS_SINE]
    return remains_still(row, cosine, sine, record.sizes, duration, group)


@lean
def retire_still_lanes(lanes, pairs, rows, deferred, record, grounds, free_steps, group):
    """
    Rest the lanes whose result no longer changes in the rest of the record.

    Return the number of the others.
    """
    active = 0
    for lane in range(PAIR_LANES):
        if free_steps[lane] >= 0:
            # maxima of deferred tiles are larger still: a lane that is over now is over with them
            pair = pairs[lane]
            read_states(lanes, lane, pair)
            load_pair(pair, rows[lane])
            if _is_over(pair, rows[lane], record, group):
                search_deferred(lanes, lane, pair, rows[lane], deferred[lane], record, grounds[1])
                free_steps[lane] = -1
                rest_pair(pair)
                write_lane(lanes, lane, pair)
            else:
                active += 1
    return active


@lean
def retire_lanes(lanes, pairs, rows, deferred, record, grounds, free_steps, elapsed):
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
            is_over = is_settled(rows[lane])
            if not is_over:
                is_over = _is_over(pair, rows[lane], record, record.sizes.shape[1])
            if elapsed >= free_steps[lane] or is_over:
                free_steps[lane] = -1
                rest_pair(pair)
                write_lane(lanes, lane, pair)
            else:
                active += 1
    return active


@lean
def run_block(record, lanes, flags, grounds, pairs, deferred, rows, logs, cosine, sine, free_steps):
    """
    Run 32 pairs through a record and the free vibration after it.

    Parameters
    ----------
    record : Record
        Ground motion and the steps through it.
    lanes : (LANE_ROWS * PAIR_LANES,) ndarray
        Room for the numbers of all lanes.
    flags : (PAIR_LANES,) ndarray of int
        Room for their flags.
    grounds : (2, 2, TILE_STEPS + 1) ndarray
        Room for the north and east acceleration of the current tile and of a deferred one.
    pairs : (PAIR_LANES, LANE_ROWS) ndarray
        Room for the numbers of each lane as one line.
    deferred : (PAIR_LANES, 2, DEFERRED_COLUMNS) ndarray
        Deferred tiles of both structures; zero at the start.
    rows : (PAIR_LANES, 2, ROW_COLUMNS) ndarray
        Rows of structures of the pairs at rest, then at the end; see `motion` for the columns. They
        hold the results: LARGEST_DISPLACEMENT (m), LARGEST_RADIUS_SQUARED (m²), APPROACH
        (m/s) and IMPACTS, the lines of the log.
    logs : (PAIR_LANES, n_lines, LOG_COLUMNS) ndarray
        Receive one line per impact that may count, as long as there is room; see `contact` for
        their columns.
    cosine, sine : (PAIR_LANES,) ndarray
        Of the azimuth of the axis from structure 1 to 2.
    free_steps : (PAIR_LANES,) ndarray of int
        Largest number of sampling intervals of free vibration for each pair, negative for a lane
        without pair; it is overwritten.

    Returns
    -------
    bool
        Whether all pairs reached the end: no step had too many events.
    """
    prepare_block(lanes, pairs, rows, cosine, sine, free_steps, record.duration)
    # the record, as far as any pair needs it
    last = (record.components.shape[1] - 1) * record.refinement
    group = 0
    is_through = True
    active = PAIR_LANES
    while active and group < record.sizes.shape[1]:
        step = group * GROUP_SAMPLES * record.refinement
        group = min(group + GROUPS_BETWEEN_CHECKS, record.sizes.shape[1])
        end = min(group * GROUP_SAMPLES * record.refinement, last)
        is_through &= advance_block(
            lanes, flags, pairs, rows, logs, deferred, record, grounds, step, end
        )
        active = retire_still_lanes(
            lanes, pairs, rows, deferred, record, grounds, free_steps, group
        )
    # free vibration, until every pair is settled
    elapsed = 0
    while retire_lanes(lanes, pairs, rows, deferred, record, grounds, free_steps, elapsed):
        step = last
        last += SETTLING_STEPS * record.refinement
        is_through &= advance_block(
            lanes, flags, pairs, rows, logs, deferred, record, grounds, step, last
        )
        elapsed += SETTLING_STEPS
    return is_through
