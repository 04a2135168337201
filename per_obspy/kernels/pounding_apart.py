"""
How far 32 pairs of bilinear structures come apart and together if they never touch, exact between samples.

The lanes of ``pounding_lanes`` with a gap that nothing closes. A lane is repeated event by event where a structure may
yield or unload, or where the relative displacement may pass its largest value to either side.
"""

from ._jit import kernel
from .polynomial_roots import first_fall, size_and_curvature, value_and_slope
from .pounding_block import SETTLING_STEPS, ground_of, prepare_block
from .pounding_events import find_event, finish_piece, raise_peaks
from .pounding_lanes import (
    COSINE,
    EVENT,
    LANES,
    MARGIN,
    PLACE,
    ROWS,
    SECOND,
    SINE,
    SPEED,
    START_PLACE,
    START_SPEED,
    STRUCTURE_ROWS,
    at,
    flag_yielding,
    move,
)
from .pounding_motion import CURVE, GUARD, OPENING, TERMS, Segment, U
from .pounding_pairs import changes_phase, load_pair, raise_inside, read_end, rest_lane, store_pair, write_phase
from .pounding_rows import is_settled, reach_in_free_vibration

#: Beyond the reach of any structure, m.
FAR = 1e12
#: Largest ``u2 - u1`` and ``u1 - u2`` so far: two rows after those of the lanes, and OPENING of both lines of a pair.
APART = ROWS
ROWS_APART = ROWS + 2
#: More changes of stiffness in one step than any record causes.
MOST_CHANGES = 1000


@kernel
def flag_apart(lanes, flags, duration):
    """
    Raise the largest relative displacements to the step's start, and flag lanes that may pass them inside the step.

    The end, which is the next start, is not yet certain: the step may hold an event.
    """
    third, second = duration / 3.0, STRUCTURE_ROWS
    for lane in range(LANES):
        start = lanes[at(second + START_PLACE, lane)] - lanes[at(START_PLACE, lane)]
        end = lanes[at(second + PLACE, lane)] - lanes[at(PLACE, lane)]
        early = start + third * (lanes[at(second + START_SPEED, lane)] - lanes[at(START_SPEED, lane)])
        late = end - third * (lanes[at(second + SPEED, lane)] - lanes[at(SPEED, lane)])
        margin = lanes[at(MARGIN, lane)] + lanes[at(second + MARGIN, lane)]
        widest, closest = max(lanes[at(APART, lane)], start), max(lanes[at(APART + 1, lane)], -start)
        lanes[at(APART, lane)], lanes[at(APART + 1, lane)] = widest, closest
        higher = max(early, late) + margin > max(widest, end)
        lower = margin - min(early, late) > max(closest, -end)
        flags[lane] += EVENT if higher | lower else 0


@kernel
def step_apart(block, flags, ground, duration):
    """Step every lane as if nothing happened, flag those where something may, and return the sum of the flags."""
    lanes, left, right = block
    for lane in range(LANES):
        flags[lane] = 0
    move(left, flags, 1, ground, duration)
    move(right, flags, SECOND, ground, duration)
    flag_apart(lanes, flags, duration)
    flag_yielding(left, flags, ground, duration)
    flag_yielding(right, flags, ground, duration)
    total = 0
    for lane in range(LANES):
        total += flags[lane]
    return total


@kernel
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


@kernel
def _raise_apart_at(row, terms, time):
    """Raise the largest relative displacements to the one at a time of the piece."""
    left, _ = value_and_slope(row, 0, CURVE, terms, time)
    right, _ = value_and_slope(row, 1, CURVE, terms, time)
    row[0, OPENING] = max(row[0, OPENING], right - left)
    row[1, OPENING] = max(row[1, OPENING], left - right)


@kernel
def repeat_apart(row, log, segment):
    """Carry a pair through one step, event by event; tell whether it got through."""
    elapsed = 0.0
    for _ in range(MOST_CHANGES):
        span, kind, place = find_event(row, segment, elapsed)
        raise_peaks(row, span, segment.terms)
        raise_apart(row, span, segment.terms)
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, log, segment, elapsed, span, kind, place)
        if elapsed >= segment.duration:
            return True
    return False


@kernel
def repair_apart(lanes, row, log, lane, flag, ground, duration):
    """Do for a flagged lane what the common step cannot; ``ground`` as for the lanes of ``pounding_block``."""
    cosine, sine = lanes[at(COSINE, lane)], lanes[at(SINE, lane)]
    acceleration, slope = cosine * ground[0] + sine * ground[1], cosine * ground[2] + sine * ground[3]
    if flag < EVENT:
        raise_inside(lanes, row, lane, 0, flag, acceleration, slope, duration)
        raise_inside(lanes, row, lane, STRUCTURE_ROWS, flag // SECOND, acceleration, slope, duration)
        return True
    load_pair(lanes, row, lane)
    row[0, OPENING], row[1, OPENING] = lanes[at(APART, lane)], lanes[at(APART + 1, lane)]
    through = repeat_apart(row, log, Segment(0.0, duration, acceleration, slope, int(row[0, TERMS])))
    store_pair(lanes, row, lane)
    lanes[at(APART, lane)], lanes[at(APART + 1, lane)] = row[0, OPENING], row[1, OPENING]
    if changes_phase(lanes, row, lane):
        write_phase(lanes, row, lane, duration)
    return through


@kernel
def _step_to_flag(block, flags, components, dt, refinement, step, last):
    """Step all lanes from a step on until one is flagged, or to the last; return the step after that."""
    duration = dt / refinement
    while step < last:
        ground = ground_of(components, dt, refinement, step)
        step += 1
        if step_apart(block, flags, ground[:4], duration):
            break
    return step


@kernel
def _repair(lanes, flags, rows, log, ground, duration):
    """Repair every flagged lane; tell whether all got through."""
    through = True
    for lane in range(LANES):
        if flags[lane]:
            through &= repair_apart(lanes, rows[lane], log, lane, flags[lane], ground, duration)
    return through


@kernel
def _advance(block, flags, rows, log, components, dt, refinement, step, last):
    """Carry all lanes from a step to the last one; tell whether all got through."""
    through = True
    while step < last:
        step = _step_to_flag(block, flags, components, dt, refinement, step, last)
        ground = ground_of(components, dt, refinement, step - 1)
        starts = (ground[0], ground[1], ground[4], ground[5])
        through &= _repair(block[0], flags, rows, log, starts, dt / refinement)
    return through


@kernel
def _is_over(row):
    """Tell whether in free vibration neither a displacement nor the relative one can exceed its maximum."""
    low_1, high_1 = reach_in_free_vibration(row, 0)
    low_2, high_2 = reach_in_free_vibration(row, 1)
    return is_settled(row) and high_2 - low_1 <= row[0, OPENING] and high_1 - low_2 <= row[1, OPENING]


@kernel
def _read_apart(lanes, row, lane):
    """Copy the end of the last step to the pair's row, with all maxima."""
    read_end(lanes, row, lane)
    apart = row[1, U] - row[0, U]
    row[0, OPENING] = max(lanes[at(APART, lane)], apart)
    row[1, OPENING] = max(lanes[at(APART + 1, lane)], -apart)


@kernel
def _retire(lanes, rows, free_steps, step):
    """Rest the lanes in which nothing can happen any more after so many steps of free vibration; count the others."""
    active = 0
    for lane in range(LANES):
        if free_steps[lane] >= 0:
            _read_apart(lanes, rows[lane], lane)
            if step >= free_steps[lane] or _is_over(rows[lane]):
                free_steps[lane] = -1
                rest_lane(lanes, lane)
                lanes[at(APART, lane)] = lanes[at(APART + 1, lane)] = FAR
            else:
                active += 1
    return active


@kernel
def run_apart(components, dt, refinement, lanes, flags, rows, log, cosine, sine, free_steps):
    """
    Run 32 pairs through a record and the free vibration after it; tell whether all got through.

    As ``run_block``; the gaps of ``rows`` are FAR, ``lanes`` have ROWS_APART rows.
    """
    block = (lanes, lanes[: STRUCTURE_ROWS * LANES], lanes[STRUCTURE_ROWS * LANES :])
    prepare_block(lanes, flags, rows, cosine, sine, dt / refinement)
    last = (components.shape[1] - 1) * refinement
    through = _advance(block, flags, rows, log, components, dt, refinement, 0, last)
    free = 0
    while _retire(lanes, rows, free_steps, free):
        step, last = last, last + SETTLING_STEPS * refinement
        through &= _advance(block, flags, rows, log, components, dt, refinement, step, last)
        free += SETTLING_STEPS
    return through
