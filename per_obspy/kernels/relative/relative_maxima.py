"""
Largest relative displacement of many pairs under one record.

It is exact for piecewise-linear ground acceleration. Every pair is driven along its own azimuth. A
pass over the samples stores the states before each tile of steps and the largest values in it; only
tiles that could hold a larger value between samples are searched again, pair by pair. Structures
that are equal in everything never separate and are left out.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.relative.bounds import between_sample_margins, may_grow, strongest_inputs
from per_obspy.kernels.relative.relative_peaks import search_pair_tile
from per_obspy.kernels.relative.relative_samples import (
    GREATEST,
    LEAST,
    PAIR_CHECKPOINT_ROWS,
    PAIR_LANES,
    PAIR_ROWS,
    STATE,
    pack_pair,
    run_pair_tiles,
    start_pairs_at_rest,
    state_of,
)
from per_obspy.kernels.spectra.tile_search import TILE, TILES

#: Free vibration is followed for at most this many of the longer period.
FREE_PERIODS = 20.0


@kernel
def relative_maxima(north, east, dt, pairs, largest):
    """
    Fill the largest relative displacements of pairs in both directions, free vibration included.

    Parameters
    ----------
    north, east : (n_samples,) ndarray
        Components of the ground acceleration, m/s²; the record ends with zero.
    dt : float
        Time between samples, s.
    pairs : (8, n) ndarray
        Rows: circular frequency (rad/s), damping (fraction of critical) and participation
        (dimensionless) of structure 1, then of 2; cosine and sine of the azimuth from 1 to 2.
    largest : (2, n) ndarray
        Receives the maxima of ``q1 u1 - q2 u2`` and of ``q2 u2 - q1 u1``, m.
    """
    ground = _whole_tiles(north, east)
    inputs = strongest_inputs(ground, dt)
    # Memory of one block of pairs
    table = np.empty((PAIR_ROWS, PAIR_LANES))
    tiles = min((ground.shape[1] - 1) // TILE, TILES)
    checkpoints = np.empty((tiles, PAIR_CHECKPOINT_ROWS, PAIR_LANES))
    block = np.empty((PAIR_LANES, 8))
    best = np.empty((PAIR_LANES, 2))
    moving = np.empty(PAIR_LANES, np.bool_)
    largest[:] = 0.0
    unequal = _unequal_pairs(pairs)
    for first in range(0, unequal.size, PAIR_LANES):
        # Fill the block, the last one with copies of its last pair
        chosen = unequal[first : first + PAIR_LANES]
        for lane in range(PAIR_LANES):
            block[lane] = pairs[:, chosen[min(lane, chosen.size - 1)]]
            pack_pair(block[lane], dt, table, lane)
            moving[lane] = lane < chosen.size
        # Record, then free vibration
        best[:] = 0.0
        start_pairs_at_rest(ground[0, 0], ground[1, 0], table)
        _shake(ground, dt, block, table, checkpoints, inputs, moving, best)
        _ring_down(dt, block, table, checkpoints, inputs, moving, best)
        for lane in range(chosen.size):
            largest[:, chosen[lane]] = best[lane]


@kernel
def _whole_tiles(north, east):
    """Return both components, filled up with zeros to a whole number of tiles and one sample."""
    ground = np.zeros((2, -(-(north.size - 1) // TILE) * TILE + 1))
    ground[0, : north.size] = north
    ground[1, : east.size] = east
    return ground


@kernel
def _unequal_pairs(pairs):
    """Return the indices of the pairs whose structures are not equal in everything."""
    indices = np.empty(pairs.shape[1], np.int64)
    count = 0
    for index in range(pairs.shape[1]):
        indices[count] = index
        # A pair of equal structures is overwritten by the next one
        twins = pairs[0, index] == pairs[3, index] and pairs[1, index] == pairs[4, index]
        count += 0 if twins and pairs[2, index] == pairs[5, index] else 1
    return indices[:count]


@kernel
def _shake(ground, dt, block, table, checkpoints, inputs, moving, best):
    """Raise the largest values to those during the record."""
    for begin in range(0, ground.shape[1] - 1, TILES * TILE):
        stretch = ground[:, begin : begin + TILES * TILE + 1]
        run_pair_tiles(stretch[0], stretch[1], table, checkpoints)
        _raise(stretch, dt, block, table, checkpoints, inputs, moving, best)


@kernel
def _ring_down(dt, block, table, checkpoints, inputs, moving, best):
    """Raise the largest values to those of the free vibration, tile by tile while one may grow."""
    rest = np.zeros((2, TILE + 1))
    steps = 0
    while _drop_settled(steps, dt, block, table, moving, best):
        run_pair_tiles(rest[0], rest[1], table, checkpoints)
        _raise(rest, dt, block, table, checkpoints, inputs, moving, best)
        steps += TILE


@kernel
def _drop_settled(steps, dt, block, table, moving, best):
    """Drop the pairs that cannot exceed their largest values any more; return if any remains."""
    any_moving = False
    for lane in range(PAIR_LANES):
        # Limit of the free vibration in time
        longest = 2.0 * math.pi / min(block[lane, 0], block[lane, 3])
        moving[lane] &= steps * dt < FREE_PERIODS * longest
        if moving[lane]:
            # Radii of the free vibration
            u1, z1 = state_of(0, table, lane, table[STATE, lane], table[STATE + 1, lane], 0.0)
            u2, z2 = state_of(1, table, lane, table[STATE + 2, lane], table[STATE + 3, lane], 0.0)
            moving[lane] = may_grow(block[lane], (u1, z1, u2, z2), best[lane])
            any_moving |= moving[lane]
    return any_moving


@kernel
def _raise(ground, dt, block, table, checkpoints, inputs, moving, best):
    """Raise the largest values to the samples of the tiles, then to the peaks between them."""
    tiles = (ground.shape[1] - 1) // TILE
    margins = np.zeros((2, PAIR_LANES))
    before = np.empty(4)
    # Samples of all tiles
    for tile in range(tiles):
        for lane in range(PAIR_LANES):
            if moving[lane]:
                best[lane, 0] = max(best[lane, 0], checkpoints[tile, GREATEST, lane])
                best[lane, 1] = max(best[lane, 1], -checkpoints[tile, LEAST, lane])
    # Bounds of how far samples and cubics are exceeded
    for lane in range(PAIR_LANES):
        sample_margin, cubic_margin = between_sample_margins(block[lane], dt, table, lane, inputs)
        margins[0, lane] = sample_margin
        margins[1, lane] = cubic_margin
    # Tiles whose samples come close enough to the largest values
    for tile in range(tiles):
        north = ground[0, tile * TILE :]
        east = ground[1, tile * TILE :]
        for lane in range(PAIR_LANES):
            high = checkpoints[tile, GREATEST, lane] + margins[0, lane]
            low = checkpoints[tile, LEAST, lane] - margins[0, lane]
            if moving[lane] and (high > best[lane, 0] or -low > best[lane, 1]):
                acceleration = block[lane, 6] * north[0] + block[lane, 7] * east[0]
                # States of both structures before the tile
                for body in range(2):
                    along = checkpoints[tile, 2 * body, lane]
                    across = checkpoints[tile, 2 * body + 1, lane]
                    u, z = state_of(body, table, lane, along, across, acceleration)
                    before[2 * body] = u
                    before[2 * body + 1] = z
                search_pair_tile(block[lane], dt, north, east, before, margins[1, lane], best[lane])
