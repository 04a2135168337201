"""
Largest relative displacement of many pairs against one record, exact for piecewise-linear ground acceleration.

Every pair is driven along its own azimuth. A pass over the samples keeps the states before each
tile of steps and the largest values in it; only tiles that could hold a larger value between
samples are walked again, pair by pair. Structures that are equal in everything never part and are
left out.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.relative.bounds import excess, may_grow, strongest_inputs
from per_obspy.kernels.relative.peaks import walk_tile
from per_obspy.kernels.relative.samples import (
    HIGHEST,
    KEPT,
    LANES,
    LOWEST,
    ROWS,
    STATE,
    TILE,
    pack_pair,
    run_tiles,
    start_at_rest,
    state_of,
)

TILES = 256  # kept at a time: memory stays the same however long the record is
FREE_PERIODS = 20.0  # free vibration is followed for at most this many of the longer period


@kernel
def relative_maxima(north, east, dt, pairs, largest):
    """
    Fill ``largest`` (2, n) with the maxima of ``q1 u1 - q2 u2`` and of ``q2 u2 - q1 u1``, free vibration included.

    ``pairs`` (8, n): circular frequency, damping and participation of 1, then of 2; cosine and sine
    of the azimuth. The record ends with zero acceleration.
    """
    ground = _whole_tiles(north, east)
    inputs = strongest_inputs(ground, dt)
    table = np.empty((ROWS, LANES))
    kept = np.empty((min((ground.shape[1] - 1) // TILE, TILES), KEPT, LANES))
    block, best, going = np.empty((LANES, 8)), np.empty((LANES, 2)), np.empty(LANES, np.bool_)
    largest[:] = 0.0
    parting = _parting(pairs)
    for first in range(0, parting.size, LANES):
        chosen = parting[first : first + LANES]
        for lane in range(LANES):
            block[lane] = pairs[:, chosen[min(lane, chosen.size - 1)]]
            pack_pair(block[lane], dt, table, lane)
            going[lane] = lane < chosen.size
        best[:] = 0.0
        start_at_rest(ground[0, 0], ground[1, 0], table)
        _shake(ground, dt, block, table, kept, inputs, going, best)
        _ring_down(dt, block, table, kept, inputs, going, best)
        for lane in range(chosen.size):
            largest[:, chosen[lane]] = best[lane]


@kernel
def _whole_tiles(north, east):
    """Return both components, filled up with zeros to a whole number of tiles and one sample."""
    ground = np.zeros((2, -(-(north.size - 1) // TILE) * TILE + 1))
    ground[0, : north.size], ground[1, : east.size] = north, east
    return ground


@kernel
def _parting(pairs):
    """Return the indices of the pairs whose structures are not equal in everything."""
    indices, count = np.empty(pairs.shape[1], np.int64), 0
    for index in range(pairs.shape[1]):
        indices[count] = index
        twins = pairs[0, index] == pairs[3, index] and pairs[1, index] == pairs[4, index]
        count += 0 if twins and pairs[2, index] == pairs[5, index] else 1
    return indices[:count]


@kernel
def _shake(ground, dt, block, table, kept, inputs, going, best):
    """Raise the largest values to those during the record."""
    for begin in range(0, ground.shape[1] - 1, TILES * TILE):
        stretch = ground[:, begin : begin + TILES * TILE + 1]
        run_tiles(stretch[0], stretch[1], table, kept)
        _raise(stretch, dt, block, table, kept, inputs, going, best)


@kernel
def _ring_down(dt, block, table, kept, inputs, going, best):
    """Raise the largest values to those of the free vibration, tile by tile while a pair may still exceed one."""
    rest = np.zeros((2, TILE + 1))
    steps = 0
    while _drop_settled(steps, dt, block, table, going, best):
        run_tiles(rest[0], rest[1], table, kept)
        _raise(rest, dt, block, table, kept, inputs, going, best)
        steps += TILE


@kernel
def _drop_settled(steps, dt, block, table, going, best):
    """Drop the pairs that cannot exceed their largest values any more; tell whether any is left."""
    left = False
    for lane in range(LANES):
        longest = 2.0 * math.pi / min(block[lane, 0], block[lane, 3])
        going[lane] &= steps * dt < FREE_PERIODS * longest
        if going[lane]:
            u1, z1 = state_of(0, table, lane, table[STATE, lane], table[STATE + 1, lane], 0.0)
            u2, z2 = state_of(1, table, lane, table[STATE + 2, lane], table[STATE + 3, lane], 0.0)
            going[lane] = may_grow(block[lane], (u1, z1, u2, z2), best[lane])
            left |= going[lane]
    return left


@kernel
def _raise(ground, dt, block, table, kept, inputs, going, best):
    """Raise the largest values to the samples' of the tiles kept, then to the peaks between them."""
    tiles = (ground.shape[1] - 1) // TILE
    margins, before = np.zeros((2, LANES)), np.empty(4)
    for tile in range(tiles):
        for lane in range(LANES):
            if going[lane]:
                best[lane, 0] = max(best[lane, 0], kept[tile, HIGHEST, lane])
                best[lane, 1] = max(best[lane, 1], -kept[tile, LOWEST, lane])
    for lane in range(LANES):
        margins[0, lane], margins[1, lane] = excess(block[lane], dt, table, lane, inputs)
    for tile in range(tiles):
        north, east = ground[0, tile * TILE :], ground[1, tile * TILE :]
        for lane in range(LANES):
            high, low = (
                kept[tile, HIGHEST, lane] + margins[0, lane],
                kept[tile, LOWEST, lane] - margins[0, lane],
            )
            if going[lane] and (high > best[lane, 0] or -low > best[lane, 1]):
                acceleration = block[lane, 6] * north[0] + block[lane, 7] * east[0]
                for body in range(2):
                    along, across = kept[tile, 2 * body, lane], kept[tile, 2 * body + 1, lane]
                    u, z = state_of(body, table, lane, along, across, acceleration)
                    before[2 * body], before[2 * body + 1] = u, z
                walk_tile(block[lane], dt, north, east, before, margins[1, lane], best[lane])
