"""
One pair through a tile of steps in which something may happen to it, one step after another.

Steps inside which nothing can happen are the same formulas as in ``pounding_lanes``; the others are repeated event by
event, by the code of single histories. The numbers of a lane are copied to one line, ``pair``, row for row.
"""

import math

from ._jit import lean
from .pounding_events import find_event, finish_piece
from .pounding_lanes import (
    CENTRE,
    EVENT,
    FLOOR,
    HIGHEST_PLACE,
    LANES,
    LIMIT,
    OMEGA,
    PEAK,
    PLACE,
    PLACE_SAG,
    ROWS,
    SIDE,
    SPEED,
    SPEED_SAG,
    START_PLACE,
    START_SPEED,
    STRUCTURE_ROWS,
    WIDEST_RADIUS,
)
from .pounding_lanes import GUARD as CLOSING
from .pounding_motion import (
    BOUNCES,
    HIGHEST,
    MOST_BOUNCES,
    PHASE,
    PLASTIC,
    RICHEST,
    TERMS,
    WIDEST,
    YIELD,
    Segment,
    U,
    V,
)
from .pounding_pairs import changes_phase, write_phase
from .pounding_search import along, may_rise, pull, raise_step, search, step


@lean
def may_yield(pair, first, u0, z0, u1, z1, strength):
    """Tell whether a bilinear structure may yield or unload inside a step, with this acceleration at its ends."""
    side, centre = pair[first + SIDE], pair[first + CENTRE]
    if side != 0.0:
        return min(side * z0, side * z1) < pair[first + SPEED_SAG] * strength
    return max(abs(u0 - centre), abs(u1 - centre)) + pair[first + PLACE_SAG] * strength > pair[first + LIMIT]


@lean
def _guard(pair, left, right, speed, ground):
    """Return what stays positive until the pair meets or parts."""
    form = pair[CLOSING + 2] * speed + (pair[CLOSING + 3] * ground + pair[CLOSING + 4])
    return pair[CLOSING] * left + (pair[CLOSING + 1] * right + form)


@lean
def repeat_step(row, log, segment):
    """Carry a pair through one step, event by event; tell whether it got through."""
    row[0, BOUNCES] = 0.0
    elapsed = 0.0
    for _ in range(100 * int(row[0, MOST_BOUNCES])):
        span, kind, place = find_event(row, segment, elapsed)
        elapsed = elapsed + span if kind else segment.duration
        finish_piece(row, log, segment, elapsed, span, kind, place)
        if elapsed >= segment.duration:
            return True
    return False


@lean
def load_pair(pair, row):
    """Copy a pair's state to its row, on which the event code works."""
    for i in range(2):
        first = i * STRUCTURE_ROWS
        row[i, U], row[i, V] = pair[first + PLACE], pair[first + SPEED] * pair[first + OMEGA]
        if row[i, PHASE] != 0.0:
            row[i, PLASTIC] = row[i, U] - row[i, PHASE] * row[i, YIELD]
        row[i, RICHEST] = math.inf  # not asked for


@lean
def store_pair(pair, row, duration):
    """Copy a pair's state back from its row, and what depends on its phase."""
    if changes_phase(pair, row):
        write_phase(pair, row, duration)
    for i in range(2):
        first = i * STRUCTURE_ROWS
        pair[first + PLACE], pair[first + SPEED] = row[i, U], row[i, V] / pair[first + OMEGA]


@lean
def segment_of(row, here, there, duration):
    """Return the segment that a step is."""
    return Segment(0.0, duration, here, (there - here) / duration, int(row[0, TERMS]))


@lean
def walk(pair, row, log, ground, count, duration):
    """Carry a pair through a tile in which something may happen; tell whether it got through."""
    second, through = STRUCTURE_ROWS, True
    here = along(pair, ground, 0)
    u1, z1, u2, z2 = pair[START_PLACE], pair[START_SPEED], pair[second + START_PLACE], pair[second + START_SPEED]
    y1, y2, least = pull(pair, 0, u1, z1, here), pull(pair, second, u2, z2, here), _guard(pair, u1, u2, z1, here)
    for k in range(1, count + 1):
        there = along(pair, ground, k)
        next_u1, next_z1, next_y1 = step(pair, 0, u1, z1, here, there)
        next_u2, next_z2, next_y2 = step(pair, second, u2, z2, here, there)
        next_least = _guard(pair, next_u1, next_u2, next_z1, there)
        strength_1, strength_2 = max(abs(y1), abs(next_y1)), max(abs(y2), abs(next_y2))
        margin = abs(pair[CLOSING]) * pair[PLACE_SAG] + abs(pair[CLOSING + 2]) * pair[SPEED_SAG]
        margin = margin * strength_1 + abs(pair[CLOSING + 1]) * pair[second + PLACE_SAG] * strength_2
        happens = min(least, next_least) - margin < -pair[FLOOR] * row[0, HIGHEST]
        happens |= may_yield(pair, 0, u1, z1, next_u1, next_z1, strength_1)
        happens |= may_yield(pair, second, u2, z2, next_u2, next_z2, strength_2)
        if happens:
            pair[PLACE], pair[SPEED], pair[second + PLACE], pair[second + SPEED] = u1, z1, u2, z2
            load_pair(pair, row)
            through &= repeat_step(row, log, segment_of(row, here, there, duration))
            store_pair(pair, row, duration)
            next_u1, next_z1, next_u2, next_z2 = pair[PLACE], pair[SPEED], pair[second + PLACE], pair[second + SPEED]
            next_y1, next_y2 = pull(pair, 0, next_u1, next_z1, there), pull(pair, second, next_u2, next_z2, there)
            next_least = _guard(pair, next_u1, next_u2, next_z1, there)
        else:
            if may_rise(pair, row, 0, u1, z1, y1, next_u1, next_z1, next_y1, strength_1):
                raise_step(pair, row, 0, u1, z1, y1, next_u1, next_z1, next_y1, here, there)
            if may_rise(pair, row, 1, u2, z2, y2, next_u2, next_z2, next_y2, strength_2):
                raise_step(pair, row, 1, u2, z2, y2, next_u2, next_z2, next_y2, here, there)
        u1, z1, y1, u2, z2, y2 = next_u1, next_z1, next_y1, next_u2, next_z2, next_y2
        least, here = next_least, there
    pair[PLACE], pair[SPEED], pair[second + PLACE], pair[second + SPEED] = u1, z1, u2, z2
    return through


@lean
def revisit(lanes, pair, row, log, lane, flag, ground, count, duration):
    """Do for a flagged lane what the sweep cannot; tell whether it got through."""
    through = True
    read_lane(lanes, lane, pair)
    if flag & EVENT:
        through = walk(pair, row, log, ground, count, duration)
    else:
        search_flagged(pair, row, flag, ground, count)
    write_back(lanes, lane, pair, row)
    return through


@lean
def search_flagged(pair, row, flag, ground, count):
    """Find the maxima of the structures that may pass them in a tile in which nothing else happens."""
    for i in range(2):
        if flag & PEAK[i]:
            search(pair, row, i, ground, count)


@lean
def write_back(lanes, lane, pair, row):
    """Copy a pair back to its lane, with the maxima of its row."""
    for i in range(2):
        first = i * STRUCTURE_ROWS
        pair[first + HIGHEST_PLACE], pair[first + WIDEST_RADIUS] = row[i, HIGHEST], row[i, WIDEST]
    write_lane(lanes, lane, pair)


@lean
def read_lane(lanes, lane, pair):
    """Copy the numbers of a lane to a line."""
    for k in range(ROWS):
        pair[k] = lanes[k * LANES + lane]


@lean
def write_lane(lanes, lane, pair):
    """Copy a line to its lane."""
    for k in range(ROWS):
        lanes[k * LANES + lane] = pair[k]
