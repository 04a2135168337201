"""
Tiles that may hold a maximum wait until it is certain that no later sample passes it: while a motion grows few do.

Each structure of a lane has one waiting tile at most. A tile that comes to wait while another still
may hold more has that one searched first, as has every change of the pair's equations.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.kernels._jit import lean
from per_obspy.kernels.pounding_events.motion import HIGHEST, WIDEST
from per_obspy.kernels.pounding_lanes.lanes import (
    HIGH,
    HIGHEST_PLACE,
    LANES,
    LOW,
    PEAK,
    ROWS,
    SAG,
    START_PLACE,
    START_SPEED,
    STRUCTURE_ROWS,
    TILE,
    WIDE,
    WIDER,
    WIDEST_RADIUS,
    at,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import search

#: First step and number of steps (0: none waits), displacement and speed at the start, what the
#: maxima may be.
STEP, COUNT, PLACE, SPEED, REACH, RADIUS = range(6)
WAITING_COLUMNS = 6


class Record(NamedTuple):
    """North and east component (2, n_samples), in how many steps a sampling interval is cut, and their duration."""

    components: NDArray[np.float64]
    refinement: int
    duration: float


@lean
def fill_ground(record, step, ground):
    """
    Fill the north and east acceleration at a step and the TILE steps after it.

    Steps count the parts of all sampling intervals; after the record the ground rests.
    """
    components, refinement = record.components, record.refinement
    k, part = step // refinement, step % refinement
    for place in range(TILE + 1):
        for i in range(2):
            here = components[i, k] if k < components.shape[1] else 0.0
            after = components[i, k + 1] if k + 1 < components.shape[1] else 0.0
            ground[i, place] = here + (after - here) * (part / refinement)
        part += 1
        if part == refinement:
            k, part = k + 1, 0


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


@lean
def may_hold_more(waiting, row, i):
    """Tell whether a tile waits for structure i that may hold more than its maxima so far."""
    return (waiting[i, COUNT] > 0.0) & (
        (waiting[i, REACH] > row[i, HIGHEST]) | (waiting[i, RADIUS] > row[i, WIDEST])
    )


@lean
def search_waiting(lanes, lane, pair, row, waiting, record, ground):
    """Search the waiting tiles of a lane where they may hold more than its maxima so far; then none waits."""
    loaded = False
    for i in range(2):
        if may_hold_more(waiting, row, i):
            if not loaded:
                read_lane(lanes, lane, pair)
                loaded = True
            fill_ground(record, int(waiting[i, STEP]), ground)
            search(
                pair, row, i, waiting[i, PLACE], waiting[i, SPEED], ground, int(waiting[i, COUNT])
            )
            lanes[at(i * STRUCTURE_ROWS + HIGHEST_PLACE, lane)] = row[i, HIGHEST]
            lanes[at(i * STRUCTURE_ROWS + WIDEST_RADIUS, lane)] = row[i, WIDEST]
        waiting[i, COUNT] = 0.0


@lean
def raise_to_samples(lanes, lane, row, i):
    """Raise the maxima of structure i of a lane to those at the samples of the tile."""
    first = i * STRUCTURE_ROWS
    row[i, HIGHEST] = max(
        row[i, HIGHEST], lanes[at(first + HIGH, lane)], -lanes[at(first + LOW, lane)]
    )
    row[i, WIDEST] = max(row[i, WIDEST], lanes[at(first + WIDE, lane)])
    lanes[at(first + HIGHEST_PLACE, lane)], lanes[at(first + WIDEST_RADIUS, lane)] = (
        row[i, HIGHEST],
        row[i, WIDEST],
    )


@lean
def wait(lanes, lane, waiting, i, step, count):
    """Let the tile from a step on wait for structure i of a lane."""
    first = i * STRUCTURE_ROWS
    waiting[i, STEP], waiting[i, COUNT] = step, count
    waiting[i, PLACE], waiting[i, SPEED] = (
        lanes[at(first + START_PLACE, lane)],
        lanes[at(first + START_SPEED, lane)],
    )
    reach = max(lanes[at(first + HIGH, lane)], -lanes[at(first + LOW, lane)])
    waiting[i, REACH], waiting[i, RADIUS] = (
        reach + lanes[at(first + SAG, lane)],
        lanes[at(first + WIDER, lane)],
    )


@lean
def find_maxima(lanes, lane, flag, pair, row, waiting, record, ground, step, count):
    """Raise the maxima of a lane to those of a tile in which nothing else happens, or let it wait."""
    more = False
    for i in range(2):
        if flag & PEAK[i]:
            raise_to_samples(lanes, lane, row, i)
            more |= may_hold_more(waiting, row, i)
    if more:
        search_waiting(lanes, lane, pair, row, waiting, record, ground)
    for i in range(2):
        if flag & PEAK[i]:
            wait(lanes, lane, waiting, i, step, count)
