"""Histories of 32 pairs at once: the loop over the record and the free vibration that follows it."""

from per_obspy.kernels._jit import lean
from per_obspy.kernels.pounding_events.row_history import is_settled
from per_obspy.kernels.pounding_lanes.deferred_maxima import (
    fill_ground,
    read_lane,
    search_waiting,
    write_lane,
)
from per_obspy.kernels.pounding_lanes.lanes import LANES, TILE, sweep
from per_obspy.kernels.pounding_lanes.pair_rows import load_pair, rest, write_constants, write_phase
from per_obspy.kernels.pounding_lanes.step_by_step import revisit

#: Steps between two looks at whether a pair is settled after the record.
SETTLING_STEPS = 16


@lean
def prepare_block(lanes, pair, rows, cosine, sine, free_steps, duration):
    """Set all lanes to rest, for good those that no pair has (``free_steps`` < 0)."""
    for lane in range(LANES):
        pair[:] = 0.0
        write_constants(pair, rows[lane], cosine[lane], sine[lane], duration)
        write_phase(pair, rows[lane], duration)
        if free_steps[lane] < 0:
            rest(pair)
        write_lane(lanes, lane, pair)


@lean
def advance_block(lanes, flags, pair, rows, log, waiting, record, grounds, step, last):
    """Carry all lanes from a step to the last one; tell whether all got through."""
    through = True
    while step < last:
        fill_ground(record, step, grounds[0])
        count = min(TILE, last - step)
        if sweep(lanes, flags, grounds[0], count):
            for lane in range(LANES):
                if flags[lane]:
                    own = pair, rows[lane], log, waiting[lane]
                    through &= revisit(lanes, lane, flags[lane], own, record, grounds, step, count)
        step += count
    return through


@lean
def retire_lanes(lanes, pair, rows, waiting, record, grounds, free_steps, step):
    """Rest the lanes in which nothing can happen any more after so many steps of free vibration; count the others."""
    active = 0
    for lane in range(LANES):
        if free_steps[lane] >= 0:
            search_waiting(lanes, lane, pair, rows[lane], waiting[lane], record, grounds[1])
            read_lane(lanes, lane, pair)
            load_pair(pair, rows[lane])
            if step >= free_steps[lane] or is_settled(rows[lane]):
                free_steps[lane] = -1
                rest(pair)
                write_lane(lanes, lane, pair)
            else:
                active += 1
    return active


@lean
def run_block(record, lanes, flags, grounds, pair, waiting, rows, log, cosine, sine, free_steps):
    """
    Run 32 pairs through a record and the free vibration after it; tell whether all got through.

    ``free_steps`` is how many sampling intervals of free vibration each pair has at most, negative
    where there is no pair; it is used up.
    """
    prepare_block(lanes, pair, rows, cosine, sine, free_steps, record.duration)
    last = (record.components.shape[1] - 1) * record.refinement
    through = advance_block(lanes, flags, pair, rows, log, waiting, record, grounds, 0, last)
    free = 0
    while retire_lanes(lanes, pair, rows, waiting, record, grounds, free_steps, free):
        step, last = last, last + SETTLING_STEPS * record.refinement
        through &= advance_block(
            lanes, flags, pair, rows, log, waiting, record, grounds, step, last
        )
        free += SETTLING_STEPS
    return through
