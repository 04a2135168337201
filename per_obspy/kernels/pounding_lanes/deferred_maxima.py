"""
Deferred search for maxima between samples: a tile is searched once no later sample exceeds it.

While a motion grows most tiles are never searched. Each building has one deferred tile at most. A
tile that is deferred while another one may still hold more has that one searched first, as has
every change of the row's equations.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.kernels._jit import inlined, lean
from per_obspy.kernels.pounding_events.motion import LARGEST_DISPLACEMENT, LARGEST_RADIUS_SQUARED
from per_obspy.kernels.pounding_lanes.lanes import (
    DISPLACEMENT,
    IS_CHANGED,
    MAXIMUM_SO_FAR,
    RADIUS_SQUARED_SO_FAR,
    START_DISPLACEMENT,
    START_VELOCITY,
    STRUCTURE_ROWS,
    SWEPT_ROWS,
    TILE_DISPLACEMENT_ERROR,
    TILE_HIGH,
    TILE_LOW,
    TILE_RADIUS_SQUARED,
    TILE_RADIUS_SQUARED_BOUND,
    VELOCITY,
    at,
)
from per_obspy.kernels.pounding_lanes.maxima_in_step import search_tile

# columns of the deferred tile of a building
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


@inlined
def fill_ground(record, step, count, ground):
    """
    Fill the north and east acceleration at a step and so many steps after it.

    Steps count the parts of all sampling intervals; after the record the ground rests.
    """
    components = record.components
    refinement = record.refinement
    k = step // refinement
    part = step % refinement
    for column in range(count + 1):
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
def read_states(lanes, place, members, own):
    """Copy the states of a building, now and at the start of the tile, to its line."""
    for k in (DISPLACEMENT, VELOCITY, START_DISPLACEMENT, START_VELOCITY):
        members[own + k] = lanes[at(k, place)]


@lean
def write_lane(lanes, place, members, own):
    """Copy the line of a building to its lane."""
    for k in range(SWEPT_ROWS):
        lanes[at(k, place)] = members[own + k]
    members[own + IS_CHANGED] = 0.0


@lean
def write_back(lanes, place, members, row, i):
    """Copy building i back to its lane, with the maxima of its row, and coefficients if new."""
    own = i * STRUCTURE_ROWS
    if members[own + IS_CHANGED] != 0.0:
        write_lane(lanes, place, members, own)
    # state and maxima
    lanes[at(DISPLACEMENT, place)] = members[own + DISPLACEMENT]
    lanes[at(VELOCITY, place)] = members[own + VELOCITY]
    write_maxima(lanes, place, row, i)


@inlined
def write_maxima(lanes, place, row, i):
    """Copy the maxima of building i from its row to its lane."""
    lanes[at(MAXIMUM_SO_FAR, place)] = row[i, LARGEST_DISPLACEMENT]
    lanes[at(RADIUS_SQUARED_SO_FAR, place)] = row[i, LARGEST_RADIUS_SQUARED]


@inlined
def may_hold_maximum(deferred, row, i):
    """Return whether building i has a deferred tile that may exceed its maxima so far."""
    return (deferred[i, STEP_COUNT] > 0.0) & (
        (deferred[i, DISPLACEMENT_BOUND] > row[i, LARGEST_DISPLACEMENT])
        | (deferred[i, RADIUS_SQUARED_BOUND] > row[i, LARGEST_RADIUS_SQUARED])
    )


@lean
def _search(lanes, place, members, row, i, deferred, record, ground):
    """Search the deferred tile of building i."""
    # ground motion of the tile, then its maxima
    count = int(deferred[i, STEP_COUNT])
    fill_ground(record, int(deferred[i, FIRST_STEP]), count, ground)
    u = deferred[i, FIRST_DISPLACEMENT]
    z = deferred[i, FIRST_VELOCITY]
    search_tile(members, row, i, u, z, ground, count)
    write_maxima(lanes, place, row, i)


@inlined
def search_deferred(lanes, place, members, row, i, deferred, record, ground):
    """Search the deferred tile of building i if it may hold a maximum; none remains deferred."""
    if may_hold_maximum(deferred, row, i):
        _search(lanes, place, members, row, i, deferred, record, ground)
    deferred[i, STEP_COUNT] = 0.0


@inlined
def raise_maxima_of_tile(lanes, place, members, row, i, deferred, record, ground, step, count):
    """Raise the maxima of building i to the samples of the tile from a step on, and defer it."""
    high = lanes[at(TILE_HIGH, place)]
    reach = max(high, -lanes[at(TILE_LOW, place)])
    radius_squared = lanes[at(TILE_RADIUS_SQUARED, place)]
    row[i, LARGEST_DISPLACEMENT] = max(row[i, LARGEST_DISPLACEMENT], reach)
    row[i, LARGEST_RADIUS_SQUARED] = max(row[i, LARGEST_RADIUS_SQUARED], radius_squared)
    write_maxima(lanes, place, row, i)
    # an earlier tile may still hold more
    search_deferred(lanes, place, members, row, i, deferred, record, ground)
    # steps and state at the start
    deferred[i, FIRST_STEP] = step
    deferred[i, STEP_COUNT] = count
    deferred[i, FIRST_DISPLACEMENT] = lanes[at(START_DISPLACEMENT, place)]
    deferred[i, FIRST_VELOCITY] = lanes[at(START_VELOCITY, place)]
    # bounds of its maxima
    deferred[i, DISPLACEMENT_BOUND] = reach + lanes[at(TILE_DISPLACEMENT_ERROR, place)]
    deferred[i, RADIUS_SQUARED_BOUND] = lanes[at(TILE_RADIUS_SQUARED_BOUND, place)]
