"""Histories of 32 pairs at once: the loop over the record and the free vibration that follows it."""

from ._jit import lean
from .pounding_lanes import LANES, TILE, sweep
from .pounding_pairs import read_state, rest, write_constants, write_phase
from .pounding_rows import is_settled
from .pounding_walk import read_lane, revisit, write_lane

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
def fill_ground(components, refinement, step, ground):
    """
    Fill the north and east acceleration at a step and the TILE steps after it.

    Steps count the parts of all sampling intervals; after the record the ground rests.
    """
    for place in range(TILE + 1):
        k, part = (step + place) // refinement, (step + place) % refinement
        for i in range(2):
            here = components[i, k] if k < components.shape[1] else 0.0
            after = components[i, k + 1] if k + 1 < components.shape[1] else 0.0
            ground[i, place] = here + (after - here) * (part / refinement)


@lean
def advance_block(lanes, flags, pair, rows, log, components, ground, dt, refinement, step, last):
    """Carry all lanes from a step to the last one; tell whether all got through."""
    through = True
    while step < last:
        fill_ground(components, refinement, step, ground)
        count = min(TILE, last - step)
        if sweep(lanes, flags, ground, count):
            for lane in range(LANES):
                if flags[lane]:
                    through &= revisit(lanes, pair, rows[lane], log, lane, flags[lane], ground, count, dt / refinement)
        step += count
    return through


@lean
def retire_lanes(lanes, pair, rows, free_steps, step):
    """Rest the lanes in which nothing can happen any more after so many steps of free vibration; count the others."""
    active = 0
    for lane in range(LANES):
        if free_steps[lane] >= 0:
            read_lane(lanes, lane, pair)
            read_state(pair, rows[lane])
            if step >= free_steps[lane] or is_settled(rows[lane]):
                free_steps[lane] = -1
                rest(pair)
                write_lane(lanes, lane, pair)
            else:
                active += 1
    return active


@lean
def run_block(components, dt, refinement, lanes, flags, ground, pair, rows, log, cosine, sine, free_steps):
    """
    Run 32 pairs through a record and the free vibration after it; tell whether all got through.

    ``free_steps`` is how many sampling intervals of free vibration each pair has at most, negative where there is no
    pair; it is used up.
    """
    prepare_block(lanes, pair, rows, cosine, sine, free_steps, dt / refinement)
    last = (components.shape[1] - 1) * refinement
    through = advance_block(lanes, flags, pair, rows, log, components, ground, dt, refinement, 0, last)
    free = 0
    while retire_lanes(lanes, pair, rows, free_steps, free):
        step, last = last, last + SETTLING_STEPS * refinement
        through &= advance_block(lanes, flags, pair, rows, log, components, ground, dt, refinement, step, last)
        free += SETTLING_STEPS
    return through
