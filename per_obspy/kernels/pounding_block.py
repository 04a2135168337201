"""Histories of 32 pairs at once: the loop over the record and the free vibration that follows it."""

from ._jit import kernel
from .pounding_lanes import COSINE, EVENT, LANES, SECOND, SINE, STRUCTURE_ROWS, at, step_lanes
from .pounding_motion import STUCK, TERMS, Segment
from .pounding_pairs import (
    changes_phase,
    load_pair,
    raise_inside,
    read_end,
    repeat_step,
    rest_lane,
    store_pair,
    write_constants,
    write_phase,
)
from .pounding_rows import is_settled

#: Steps between two looks at whether a pair is settled after the record.
SETTLING_STEPS = 16


@kernel
def prepare_block(lanes, flags, rows, cosine, sine, duration):
    """Set all lanes to rest; the last flag is the number of pairs in contact."""
    lanes[:] = 0.0
    flags[LANES] = 0
    for lane in range(LANES):
        write_constants(lanes, rows[lane], lane, cosine[lane], sine[lane], duration)
        write_phase(lanes, rows[lane], lane, duration)
        flags[LANES] += rows[lane, 0, STUCK] != 0.0


@kernel
def repair_lane(lanes, row, log, lane, flag, ground, duration):
    """
    Do for a flagged lane what the common step cannot; tell whether it got through.

    ``ground`` is the acceleration of the north and the east component, and the slope of both.
    """
    cosine, sine = lanes[at(COSINE, lane)], lanes[at(SINE, lane)]
    acceleration, slope = cosine * ground[0] + sine * ground[1], cosine * ground[2] + sine * ground[3]
    through = True
    if flag < EVENT:
        raise_inside(lanes, row, lane, 0, flag, acceleration, slope, duration)
        raise_inside(lanes, row, lane, STRUCTURE_ROWS, flag // SECOND, acceleration, slope, duration)
    else:
        load_pair(lanes, row, lane)
        through = repeat_step(row, log, Segment(0.0, duration, acceleration, slope, int(row[0, TERMS])))
        store_pair(lanes, row, lane)
        if changes_phase(lanes, row, lane):
            write_phase(lanes, row, lane, duration)
    return through


@kernel
def repair_lanes(lanes, flags, rows, log, ground, duration):
    """Repair every flagged lane; tell whether all got through."""
    through = True
    for lane in range(LANES):
        if flags[lane]:
            touched = int(rows[lane, 0, STUCK])
            through &= repair_lane(lanes, rows[lane], log, lane, flags[lane], ground, duration)
            flags[LANES] += int(rows[lane, 0, STUCK]) - touched
    return through


@kernel
def ground_of(components, dt, refinement, step):
    """
    Return the acceleration of both components at the start of a step, then at its end, then their slopes.

    Steps count the parts of all sampling intervals; after the record the ground rests.
    """
    k, part = step // refinement, step % refinement
    if k + 1 >= components.shape[1]:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    north, east = components[0, k], components[1, k]
    slope_north, slope_east = (components[0, k + 1] - north) / dt, (components[1, k + 1] - east) / dt
    start, end = part * (dt / refinement), (part + 1) * (dt / refinement)
    here = north + slope_north * start, east + slope_east * start
    there = north + slope_north * end, east + slope_east * end
    return here[0], here[1], there[0], there[1], slope_north, slope_east


@kernel
def step_to_flag(block, flags, components, dt, refinement, step, last, bilinear):
    """Step all lanes from a step on until one is flagged, or to the last; return the step after that."""
    touching, duration = flags[LANES] > 0, dt / refinement
    while step < last:
        ground = ground_of(components, dt, refinement, step)
        step += 1
        if step_lanes(block, flags, ground[:4], duration, bilinear, touching):
            break
    return step


@kernel
def advance_block(block, flags, rows, log, components, dt, refinement, step, last, bilinear):
    """Carry all lanes from a step to the last one; tell whether all got through."""
    through = True
    while step < last:
        step = step_to_flag(block, flags, components, dt, refinement, step, last, bilinear)
        ground = ground_of(components, dt, refinement, step - 1)
        starts = (ground[0], ground[1], ground[4], ground[5])
        through &= repair_lanes(block[0], flags, rows, log, starts, dt / refinement)
    return through


@kernel
def retire_lanes(lanes, rows, free_steps, step):
    """Rest the lanes in which nothing can happen any more after so many steps of free vibration; count the others."""
    active = 0
    for lane in range(LANES):
        if free_steps[lane] >= 0:
            read_end(lanes, rows[lane], lane)
            if step >= free_steps[lane] or is_settled(rows[lane]):
                free_steps[lane] = -1
                rest_lane(lanes, lane)
            else:
                active += 1
    return active


@kernel
def run_block(components, dt, refinement, lanes, flags, rows, log, cosine, sine, free_steps, bilinear):
    """
    Run 32 pairs through a record and the free vibration after it; tell whether all got through.

    ``free_steps`` is how many sampling intervals of free vibration each pair has at most; it is used up.
    """
    block = (lanes, lanes[: STRUCTURE_ROWS * LANES], lanes[STRUCTURE_ROWS * LANES :])
    prepare_block(lanes, flags, rows, cosine, sine, dt / refinement)
    last = (components.shape[1] - 1) * refinement
    through = advance_block(block, flags, rows, log, components, dt, refinement, 0, last, bilinear)
    free = 0
    while retire_lanes(lanes, rows, free_steps, free):
        step, last = last, last + SETTLING_STEPS * refinement
        through &= advance_block(block, flags, rows, log, components, dt, refinement, step, last, bilinear)
        free += SETTLING_STEPS
    return through
