"""
How far 32 pairs of bilinear structures come apart and together if they never touch, exact between samples.

The lanes of ``pounding_lanes`` with a gap that nothing closes. A lane is walked again step by step where a structure
may yield or unload, or where the relative displacement may pass its largest value to either side.
"""

from ._jit import lean
from .polynomial_roots import first_fall, size_and_curvature, value_and_slope
from .pounding_block import SETTLING_STEPS, fill_ground, prepare_block
from .pounding_events import find_event, finish_piece
from .pounding_lanes import (
    EVENT,
    LANES,
    OMEGA,
    PLACE,
    PLACE_SAG,
    ROWS,
    SAG,
    SPEED,
    SPEED_SAG,
    START_PLACE,
    START_SPEED,
    STRUCTURE_ROWS,
    TILE,
    advance_one,
    at,
    flag_tile,
    start_tile,
)
from .pounding_motion import CURVE, GUARD, OPENING, U
from .pounding_pairs import read_state, rest
from .pounding_rows import is_settled, reach_in_free_vibration
from .pounding_search import along, may_rise, pull, raise_step, step
from .pounding_walk import (
    load_pair,
    may_yield,
    read_lane,
    search_flagged,
    segment_of,
    store_pair,
    write_back,
    write_lane,
)

#: Beyond the reach of any structure, m.
FAR = 1e12
#: Largest ``u2 - u1`` and ``u1 - u2`` so far, and at the samples of the tile: rows after those of the lanes. The former
#: are also OPENING of both lines of a pair.
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
def _may_part(pair, row, before, after, rate, next_rate, strength_1, strength_2):
    """
    Tell whether the relative displacement may pass its largest values where its rate has a root inside a step.

    Raise these values to the one at the start; the end is not certain before it is known that no structure leaves its
    branch. The rate leaves its chord by ``sag`` at most, so that it has no root where the sum of its ends is too large.
    """
    second = STRUCTURE_ROWS
    row[0, OPENING] = max(row[0, OPENING], before)
    row[1, OPENING] = max(row[1, OPENING], -before)
    sag = pair[OMEGA] * pair[SPEED_SAG] * strength_1 + pair[second + OMEGA] * pair[second + SPEED_SAG] * strength_2
    turns = abs(rate + next_rate) <= abs(next_rate - rate) + 2.0 * sag
    margin = pair[PLACE_SAG] * strength_1 + pair[second + PLACE_SAG] * strength_2
    wider = max(before, after) + margin > row[0, OPENING]
    return turns & (wider | (margin - min(before, after) > row[1, OPENING]))


@lean
def walk_apart(pair, row, log, ground, count, duration):
    """Carry a pair through a tile in which something may happen; tell whether it got through."""
    second, through = STRUCTURE_ROWS, True
    here = along(pair, ground, 0)
    u1, z1, u2, z2 = pair[START_PLACE], pair[START_SPEED], pair[second + START_PLACE], pair[second + START_SPEED]
    y1, y2 = pull(pair, 0, u1, z1, here), pull(pair, second, u2, z2, here)
    rate = pair[second + OMEGA] * z2 - pair[OMEGA] * z1
    for k in range(1, count + 1):
        there = along(pair, ground, k)
        next_u1, next_z1, next_y1 = step(pair, 0, u1, z1, here, there)
        next_u2, next_z2, next_y2 = step(pair, second, u2, z2, here, there)
        strength_1, strength_2 = max(abs(y1), abs(next_y1)), max(abs(y2), abs(next_y2))
        next_rate = pair[second + OMEGA] * next_z2 - pair[OMEGA] * next_z1
        happens = _may_part(pair, row, u2 - u1, next_u2 - next_u1, rate, next_rate, strength_1, strength_2)
        happens |= may_yield(pair, 0, u1, z1, next_u1, next_z1, strength_1)
        happens |= may_yield(pair, second, u2, z2, next_u2, next_z2, strength_2)
        if happens:
            pair[PLACE], pair[SPEED], pair[second + PLACE], pair[second + SPEED] = u1, z1, u2, z2
            load_pair(pair, row)
            through &= repeat_apart(row, log, segment_of(row, here, there, duration))
            store_pair(pair, row, duration)
            next_u1, next_z1, next_u2, next_z2 = pair[PLACE], pair[SPEED], pair[second + PLACE], pair[second + SPEED]
            next_y1, next_y2 = pull(pair, 0, next_u1, next_z1, there), pull(pair, second, next_u2, next_z2, there)
            next_rate = pair[second + OMEGA] * next_z2 - pair[OMEGA] * next_z1
        else:
            if may_rise(pair, row, 0, u1, z1, y1, next_u1, next_z1, next_y1, strength_1):
                raise_step(pair, row, 0, u1, z1, y1, next_u1, next_z1, next_y1, here, there)
            if may_rise(pair, row, 1, u2, z2, y2, next_u2, next_z2, next_y2, strength_2):
                raise_step(pair, row, 1, u2, z2, y2, next_u2, next_z2, next_y2, here, there)
        u1, z1, y1, u2, z2, y2 = next_u1, next_z1, next_y1, next_u2, next_z2, next_y2
        rate, here = next_rate, there
    pair[PLACE], pair[SPEED], pair[second + PLACE], pair[second + SPEED] = u1, z1, u2, z2
    row[0, OPENING], row[1, OPENING] = max(row[0, OPENING], u2 - u1), max(row[1, OPENING], u1 - u2)
    return through


@lean
def _revisit(lanes, pair, row, log, lane, flag, ground, count, duration):
    """Do for a flagged lane what the sweep cannot; tell whether it got through."""
    through = True
    read_lane(lanes, lane, pair)
    if flag & EVENT:
        through = walk_apart(pair, row, log, ground, count, duration)
        lanes[at(APART, lane)], lanes[at(APART + 1, lane)] = row[0, OPENING], row[1, OPENING]
    else:
        search_flagged(pair, row, flag, ground, count)
    write_back(lanes, lane, pair, row)
    return through


@lean
def _advance(lanes, flags, pair, rows, log, components, ground, dt, refinement, first, last):
    """Carry all lanes from a step to the last one; tell whether all got through."""
    through, duration = True, dt / refinement
    while first < last:
        fill_ground(components, refinement, first, ground)
        count = min(TILE, last - first)
        sweep_apart(lanes, flags, ground, count)
        for lane in range(LANES):
            if flags[lane]:
                through &= _revisit(lanes, pair, rows[lane], log, lane, flags[lane], ground, count, duration)
        first += count
    return through


@lean
def _is_over(row):
    """Tell whether in free vibration neither a displacement nor the relative one can exceed its maximum."""
    low_1, high_1 = reach_in_free_vibration(row, 0)
    low_2, high_2 = reach_in_free_vibration(row, 1)
    return is_settled(row) and high_2 - low_1 <= row[0, OPENING] and high_1 - low_2 <= row[1, OPENING]


@lean
def _retire(lanes, pair, rows, free_steps, free):
    """Rest the lanes in which nothing can happen any more after so many steps of free vibration; count the others."""
    active = 0
    for lane in range(LANES):
        if free_steps[lane] >= 0:
            read_lane(lanes, lane, pair)
            read_state(pair, rows[lane])
            if free >= free_steps[lane] or _is_over(rows[lane]):
                free_steps[lane] = -1
                rest(pair)
                write_lane(lanes, lane, pair)
                lanes[at(APART, lane)] = lanes[at(APART + 1, lane)] = FAR
            else:
                active += 1
    return active


@lean
def run_apart(components, dt, refinement, lanes, flags, ground, pair, rows, log, cosine, sine, free_steps):
    """
    Run 32 pairs through a record and the free vibration after it; tell whether all got through.

    As ``run_block``; the gaps of ``rows`` are FAR, ``lanes`` have ROWS_APART rows.
    """
    prepare_block(lanes, pair, rows, cosine, sine, free_steps, dt / refinement)
    for lane in range(LANES):
        lanes[at(APART, lane)] = lanes[at(APART + 1, lane)] = 0.0 if free_steps[lane] >= 0 else FAR
    last = (components.shape[1] - 1) * refinement
    through = _advance(lanes, flags, pair, rows, log, components, ground, dt, refinement, 0, last)
    free = 0
    while _retire(lanes, pair, rows, free_steps, free):
        first, last = last, last + SETTLING_STEPS * refinement
        through &= _advance(lanes, flags, pair, rows, log, components, ground, dt, refinement, first, last)
        free += SETTLING_STEPS
    return through
