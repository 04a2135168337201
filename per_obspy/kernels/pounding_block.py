"""Histories of 32 pairs at once: the loop over the record and the free vibration that follows it."""

from ._jit import kernel
from .pounding_lanes import (
    ACTIVE,
    COSINE,
    EVENT,
    FLEXIBILITY,
    LANES,
    LARGEST_PLACE,
    LARGEST_RADIUS,
    LEFT_PEAK,
    PLACE,
    RIGHT_PEAK,
    SINE,
    SPEED,
    STRUCTURE_ROWS,
    accept_step,
    at,
    shake,
    step_lanes,
)
from .pounding_motion import STUCK, Segment, taylor_terms
from .pounding_pairs import (
    changes_phase,
    load_pair,
    raise_inside,
    repeat_step,
    store_pair,
    write_constants,
    write_phase,
)
from .pounding_rows import is_settled

#: Steps between two looks at whether a pair is settled after the record.
SETTLING_STEPS = 16


@kernel
def prepare_block(lanes, rows, cosine, sine, duration):
    """Set all lanes to rest."""
    lanes[:] = 0.0
    for lane in range(LANES):
        write_constants(lanes, rows[lane], lane, cosine[lane], sine[lane], duration)
        write_phase(lanes, rows[lane], lane, duration, taylor_terms(rows[lane], duration))


@kernel
def count_touching(rows):
    """Return how many pairs are in contact."""
    touching = 0
    for lane in range(LANES):
        touching += rows[lane, 0, STUCK] != 0.0
    return touching


@kernel
def repair_lanes(lanes, flags, rows, log, ground, duration):
    """
    Do for every flagged lane what the common step cannot; tell whether all got through.

    ``ground`` is the acceleration of the north and the east component, and the slope of both.
    """
    through = True
    for lane in range(LANES):
        if flags[lane]:
            row, cosine, sine = rows[lane], lanes[at(COSINE, lane)], lanes[at(SINE, lane)]
            acceleration, slope = cosine * ground[0] + sine * ground[1], cosine * ground[2] + sine * ground[3]
            terms = taylor_terms(row, duration)
            if flags[lane] & EVENT:
                load_pair(lanes, row, lane)
                through &= repeat_step(row, log, Segment(0.0, duration, acceleration, slope, terms))
                store_pair(lanes, row, lane)
                if changes_phase(lanes, row, lane):
                    write_phase(lanes, row, lane, duration, terms)
            else:
                if flags[lane] & LEFT_PEAK:
                    raise_inside(lanes, row, lane, 0, acceleration, slope, terms, duration)
                if flags[lane] & RIGHT_PEAK:
                    raise_inside(lanes, row, lane, STRUCTURE_ROWS, acceleration, slope, terms, duration)
    return through


@kernel
def advance_block(block, flags, rows, log, start, end, dt, refinement, bilinear):
    """Carry all lanes from one sample, (north, east), to the next; tell whether all got through."""
    duration, through = dt / refinement, True
    slope_north, slope_east = (end[0] - start[0]) / dt, (end[1] - start[1]) / dt
    for part in range(refinement):
        first, last = part * duration, (part + 1) * duration
        north, east = start[0] + slope_north * first, start[1] + slope_east * first
        shake(block[0], north, east, start[0] + slope_north * last, start[1] + slope_east * last)
        if step_lanes(block, flags, duration, bilinear, count_touching(rows) > 0):
            ground = (north, east, slope_north, slope_east)
            through &= repair_lanes(block[0], flags, rows, log, ground, duration)
        accept_step(block[0])
    return through


@kernel
def include_ends(lanes, lane):
    """Raise the maxima of a lane to its last state."""
    for first in (0, STRUCTURE_ROWS):
        place, speed = lanes[at(first + PLACE, lane)], lanes[at(first + SPEED, lane)]
        radius = place * place + lanes[at(first + FLEXIBILITY, lane)] * speed * speed
        lanes[at(first + LARGEST_PLACE, lane)] = max(lanes[at(first + LARGEST_PLACE, lane)], abs(place))
        lanes[at(first + LARGEST_RADIUS, lane)] = max(lanes[at(first + LARGEST_RADIUS, lane)], radius)


@kernel
def retire_lanes(lanes, rows, free_steps, step):
    """Rest the lanes in which nothing can happen any more after so many steps of free vibration; count the others."""
    active = 0
    for lane in range(LANES):
        if lanes[at(ACTIVE, lane)] > 0.0:
            done = step >= free_steps[lane]
            if not done and step % SETTLING_STEPS == 0:
                load_pair(lanes, rows[lane], lane)
                done = is_settled(rows[lane])
            if done:
                include_ends(lanes, lane)
                lanes[at(ACTIVE, lane)] = lanes[at(STRUCTURE_ROWS + ACTIVE, lane)] = 0.0
            else:
                active += 1
    return active


@kernel
def run_block(components, dt, refinement, lanes, flags, rows, log, cosine, sine, free_steps, bilinear):
    """Run 32 pairs through a record and the free vibration after it; tell whether all got through."""
    block = (lanes, lanes[: STRUCTURE_ROWS * LANES], lanes[STRUCTURE_ROWS * LANES :])
    prepare_block(lanes, rows, cosine, sine, dt / refinement)
    through, rest = True, (0.0, 0.0)
    for k in range(components.shape[1] - 1):
        start, end = (components[0, k], components[1, k]), (components[0, k + 1], components[1, k + 1])
        through &= advance_block(block, flags, rows, log, start, end, dt, refinement, bilinear)
    step = 0
    while retire_lanes(lanes, rows, free_steps, step):
        through &= advance_block(block, flags, rows, log, rest, rest, dt, refinement, bilinear)
        step += 1
    return through
