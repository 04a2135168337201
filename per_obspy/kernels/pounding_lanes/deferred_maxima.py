"""
Deferred search for maxima between samples: a tile is searched once no later sample exceeds it.

While a motion grows most tiles are never searched. Each structure of a lane has one deferred tile
at most. A tile that is deferred while another one may still hold more has that one searched first,
as has every change of the pair's equations.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.kernels._jit import lean
from per_obspy.kernels.pounding_events.motion import LARGEST_DISPLACEMENT, LARGEST_RADIUS_SQUARED
from per_obspy.kernels.pounding_lanes.lanes import (
    DISPLACEMENT,
    LANE_ROWS,
    MAXIMUM_SO_FAR,
    PAIR_LANES,
    PEAK_FLAGS,
    RADIUS_SQUARED_SO_FAR,
    START_DISPLACEMENT,
    START_VELOCITY,
    STRUCTURE_ROWS,
    TILE_DISPLACEMENT_ERROR,
    TILE_HIGH,
    TILE_LOW,
    TILE_RADIUS_SQUARED,
    TILE_RADIUS_SQUARED_BOUND,
    TILE_STEPS,
    VELOCITY,
    at,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import search_tile

# columns of the deferred tile of a structure
#: first step, number of steps (0: no tile is deferred)
FIRST_STEP, STEP_COUNT = 0, 1
#: displacement and velocity over omega at its start (m)
FIRST_DISPLACEMENT, FIRST_VELOCITY = 2, 3
#: upper bounds of its displacement (m) and squared radius (m²)
DISPLACEMENT_BOUND, RADIUS_SQUARED_BOUND = 4, 5
DEFERRED_COLUMNS = 6


class Record(NamedTuple):
    """
    A ground motion and the steps through it.

    Attributes
    ----------
    components : (2, n_samples) ndarray
        North and east acceleration, m/s².
    refinement : int
        Number of steps into which each sampling interval is cut.
    duration : float
        Of a step, s.
    sizes : (2, n_groups) ndarray
        Integrals of the size of both components over groups of samples, m/s; see
        ``remaining_motion``.
    """

    components: NDArray[np.float64]
    refinement: int
    duration: float
    sizes: NDArray[np.float64]


@lean
def fill_ground(record, step, ground):
    """
    Fill the north and east acceleration at a step and the TILE_STEPS steps after it.

    Steps count the parts of all sampling intervals; after the record the ground rests.
    """
    components = record.components
    refinement = record.refinement
    k = step // refinement
    part = step % refinement
    for column in range(TILE_STEPS + 1):
        # linear between the samples k and k + 1
        for i in range(2):
            before = components[i, k] if k < components.shape[1] else 0.0
            after = components[i, k + 1] if k + 1 < components.shape[1] else 0.0
            ground[i, column] = before + (after - before) * (part / refinement)
        part += 1
        if part == refinement:
            k += 1
            part = 0


@lean
def read_states(lanes, lane, pair):
    """Copy the states of a lane, now and at the start of the tile, to the line of its pair."""
    for first in (0, STRUCTURE_ROWS):
        for k in (DISPLACEMENT, VELOCITY, START_DISPLACEMENT, START_VELOCITY):
            pair[first + k] = lanes[at(first + k, lane)]


@lean
def read_lane(lanes, lane, pair):
    """Copy the numbers of a lane to a line."""
    for k in range(LANE_ROWS):
        pair[k] = lanes[k * PAIR_LANES + lane]


@lean
def write_lane(lanes, lane, pair):
    """Copy a line to its lane."""
    for k in range(LANE_ROWS):
        lanes[k * PAIR_LANES + lane] = pair[k]


@lean
def may_hold_maximum(deferred, row, i):
    """Return whether structure i has a deferred tile that may exceed its maxima so far."""
    return (deferred[i, STEP_COUNT] > 0.0) & (
        (deferred[i, DISPLACEMENT_BOUND] > row[i, LARGEST_DISPLACEMENT])
        | (deferred[i, RADIUS_SQUARED_BOUND] > row[i, LARGEST_RADIUS_SQUARED])
    )


@lean
def search_deferred(lanes, lane, pair, row, deferred, record, ground):
    """Search the deferred tiles of a lane that may hold a maximum; no tile remains deferred."""
    for i in range(2):
        if may_hold_maximum(deferred, row, i):
            # ground motion of the tile
            fill_ground(record, int(deferred[i, FIRST_STEP]), ground)
            # maxima of the tile
            u = deferred[i, FIRST_DISPLACEMENT]
            z = deferred[i, FIRST_VELOCITY]
            search_tile(pair, row, i, u, z, ground, int(deferred[i, STEP_COUNT]))
            first = i * STRUCTURE_ROWS
            lanes[at(first + MAXIMUM_SO_FAR, lane)] = row[i, LARGEST_DISPLACEMENT]
            lanes[at(first + RADIUS_SQUARED_SO_FAR, lane)] = row[i, LARGEST_RADIUS_SQUARED]
        deferred[i, STEP_COUNT] = 0.0


@lean
def raise_maxima_to_samples(lanes, lane, row, i):
    """Raise the maxima of structure i of a lane to those at the samples of the tile."""
    first = i * STRUCTURE_ROWS
    # in the row
    row[i, LARGEST_DISPLACEMENT] = max(
        row[i, LARGEST_DISPLACEMENT],
        lanes[at(first + TILE_HIGH, lane)],
        -lanes[at(first + TILE_LOW, lane)],
    )
    row[i, LARGEST_RADIUS_SQUARED] = max(
        row[i, LARGEST_RADIUS_SQUARED], lanes[at(first + TILE_RADIUS_SQUARED, lane)]
    )
    # in the lane
    lanes[at(first + MAXIMUM_SO_FAR, lane)] = row[i, LARGEST_DISPLACEMENT]
    lanes[at(first + RADIUS_SQUARED_SO_FAR, lane)] = row[i, LARGEST_RADIUS_SQUARED]


@lean
def defer_tile(lanes, lane, deferred, i, step, count):
    """Defer the search of the tile from a step on for structure i of a lane."""
    first = i * STRUCTURE_ROWS
    # steps and state at the start
    deferred[i, FIRST_STEP] = step
    deferred[i, STEP_COUNT] = count
    deferred[i, FIRST_DISPLACEMENT] = lanes[at(first + START_DISPLACEMENT, lane)]
    deferred[i, FIRST_VELOCITY] = lanes[at(first + START_VELOCITY, lane)]
    # bounds of its maxima
    reach = max(lanes[at(first + TILE_HIGH, lane)], -lanes[at(first + TILE_LOW, lane)])
    error = lanes[at(first + TILE_DISPLACEMENT_ERROR, lane)]
    deferred[i, DISPLACEMENT_BOUND] = reach + error
    deferred[i, RADIUS_SQUARED_BOUND] = lanes[at(first + TILE_RADIUS_SQUARED_BOUND, lane)]


@lean
def raise_maxima_of_tile(lanes, lane, flag, pair, row, deferred, record, ground, step, count):
    """Raise the maxima of a lane to the samples of a tile without events, and defer its search."""
    may_hold = False
    for i in range(2):
        if flag & PEAK_FLAGS[i]:
            raise_maxima_to_samples(lanes, lane, row, i)
            may_hold |= may_hold_maximum(deferred, row, i)
    # an earlier tile may still hold more
    if may_hold:
        search_deferred(lanes, lane, pair, row, deferred, record, ground)
    for i in range(2):
        if flag & PEAK_FLAGS[i]:
            defer_tile(lanes, lane, deferred, i, step, count)
