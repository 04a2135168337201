"""Histories of 32 pairs at once: the loop over the record and the free vibration that follows it."""

from typing import Any, NamedTuple

from ._jit import kernel
from .pounding_contact import Rules
from .pounding_lanes import (
    ACTIVE,
    COSINE,
    FLEXIBILITY,
    LANES,
    LARGEST_PLACE,
    LARGEST_RADIUS,
    PLACE,
    SINE,
    SPEED,
    STRUCTURE_ROWS,
    accept_step,
    at,
    count_flags,
    step_lanes,
)
from .pounding_motion import Segment, taylor_terms
from .pounding_pairs import load_pair, repeat_step, store_pair, write_constants, write_phase
from .pounding_rows import is_settled

#: Steps between two looks at whether a pair is settled after the record.
SETTLING_STEPS = 16


class Pairs(NamedTuple):
    """
    Pairs of a block, one an entry, as arrays: what they are, where they stand between two events, what was counted.

    ``structures`` (n, 2, 6); ``gaps``, ``restitution``, ``cosine``, ``sine`` (of the azimuth), ``free_steps`` (the
    longest free vibration) and ``still`` (the separation speed that ends bouncing), all (n,); ``stuck``, ``order`` (n,)
    and ``phase``, ``unloading`` (n, 2) as in ``Row``; ``impacts`` and ``approach`` (n,). n is at least 32; entries that
    only fill up the block are any valid pair.
    """

    structures: Any
    gaps: Any
    restitution: Any
    cosine: Any
    sine: Any
    free_steps: Any
    still: Any
    stuck: Any
    order: Any
    phase: Any
    unloading: Any
    impacts: Any
    approach: Any


@kernel
def prepare_block(lanes, row, tally, pairs, duration):
    """Set all lanes to rest."""
    lanes[:] = 0.0
    for lane in range(LANES):
        load_pair(lanes, row, tally, lane, pairs)
        write_constants(lanes, row, lane, pairs.cosine[lane], pairs.sine[lane], duration)
        write_phase(lanes, row, lane, duration, taylor_terms(row.structures, duration))


@kernel
def repair_lanes(lanes, flags, row, tally, rules, pairs, north, east, slope_north, slope_east, duration):
    """Repeat the step of every flagged lane event by event; tell whether all got through."""
    through = True
    for lane in range(LANES):
        if flags[lane]:
            load_pair(lanes, row, tally, lane, pairs)
            cosine, sine = lanes[at(COSINE, lane)], lanes[at(SINE, lane)]
            terms = taylor_terms(row.structures, duration)
            ground, slope = cosine * north + sine * east, cosine * slope_north + sine * slope_east
            own = Rules(pairs.still[lane], rules.delay, rules.bounces)
            through &= repeat_step(row, tally, own, Segment(0.0, duration, ground, slope, terms))
            if store_pair(lanes, row, tally, lane, pairs):
                write_phase(lanes, row, lane, duration, terms)
    return through


@kernel
def advance_block(lanes, flags, row, tally, rules, pairs, north, east, next_north, next_east, dt, refinement):
    """Carry all lanes through one sampling interval; tell whether all got through."""
    duration = dt / refinement
    slope_north, slope_east = (next_north - north) / dt, (next_east - east) / dt
    through = True
    for part in range(refinement):
        shift, end = part * duration, (part + 1) * duration
        start_north, start_east = north + slope_north * shift, east + slope_east * shift
        step_lanes(lanes, flags, start_north, start_east, north + slope_north * end, east + slope_east * end, duration)
        if count_flags(flags):
            through &= repair_lanes(
                lanes, flags, row, tally, rules, pairs, start_north, start_east, slope_north, slope_east, duration
            )
        accept_step(lanes)
    return through


@kernel
def retire_lanes(lanes, row, tally, pairs, step):
    """Rest the lanes in which nothing can happen any more after so many steps of free vibration; count the others."""
    active = 0
    for lane in range(LANES):
        if lanes[at(ACTIVE, lane)] > 0.0:
            done = step >= pairs.free_steps[lane]
            if not done and step % SETTLING_STEPS == 0:
                load_pair(lanes, row, tally, lane, pairs)
                done = is_settled(row, tally)
            if done:
                include_ends(lanes, lane)
                lanes[at(ACTIVE, lane)] = 0.0
            else:
                active += 1
    return active


@kernel
def include_ends(lanes, lane):
    """Raise the maxima of a lane to its last state."""
    for first in (0, STRUCTURE_ROWS):
        place, speed = lanes[at(first + PLACE, lane)], lanes[at(first + SPEED, lane)]
        radius = place * place + lanes[at(first + FLEXIBILITY, lane)] * speed * speed
        lanes[at(first + LARGEST_PLACE, lane)] = max(lanes[at(first + LARGEST_PLACE, lane)], abs(place))
        lanes[at(first + LARGEST_RADIUS, lane)] = max(lanes[at(first + LARGEST_RADIUS, lane)], radius)


@kernel
def run_block(north, east, dt, refinement, lanes, flags, row, tally, rules, pairs):
    """Run 32 pairs through a record and the free vibration after it; tell whether all got through."""
    prepare_block(lanes, row, tally, pairs, dt / refinement)
    through = True
    for k in range(north.size - 1):
        through &= advance_block(
            lanes, flags, row, tally, rules, pairs, north[k], east[k], north[k + 1], east[k + 1], dt, refinement
        )
    step = 0
    while retire_lanes(lanes, row, tally, pairs, step):
        through &= advance_block(lanes, flags, row, tally, rules, pairs, 0.0, 0.0, 0.0, 0.0, dt, refinement)
        step += 1
    return through
