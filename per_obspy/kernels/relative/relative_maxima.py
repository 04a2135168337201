"""
Largest relative displacement and velocity of many pairs under one record.

Displacements are exact for piecewise-linear ground acceleration. Every pair is driven along its own
azimuth. A pass over the samples stores the states before each tile of steps and bounds of the
displacement in it; the tiles of the largest bounds are searched, pair by pair, and then those whose
bounds exceed what was found. Parts of the record that cannot hold the largest values are left out.
Structures that are equal in everything never separate and are left out.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel, lean
from per_obspy.kernels.relative.bounds import (
    largest_radii,
    may_grow,
    present_radii,
    strongest_inputs,
    tile_inputs,
    tile_margins,
)
from per_obspy.kernels.relative.pair_windows import (
    GROUP,
    bound_motion,
    expected_motion,
    find_pair_windows,
    grouped_inputs,
)
from per_obspy.kernels.relative.relative_peaks import search_pair_tile
from per_obspy.kernels.relative.relative_samples import (
    APPROACH,
    GREATEST,
    LEAST,
    PAIR_CHECKPOINT_ROWS,
    PAIR_LANES,
    PAIR_ROWS,
    STATE,
    pack_pair,
    run_pair_tiles,
    state_of,
)
from per_obspy.kernels.spectra.tile_search import TILE, TILES

#: Free vibration is followed for at most this many of the longer period.
FREE_PERIODS = 20.0
#: Part of the bounds of its motion that a pair is expected to reach; the bounds are wide. One that
#: does not reach it is run again, through the part of the record that may exceed what it reached.
EXPECTED = 0.004
#: Part of what it has reached, so that rounding does not matter.
REACHED = 1.0 - 1e-9


@kernel
def relative_maxima(north, east, dt, pairs, forgotten, both_sides, largest):
    """
    Fill the largest relative displacements and velocities of pairs, free vibration included.

    Parameters
    ----------
    north, east : (n_samples,) ndarray
        Components of the ground acceleration, m/s²; the record ends with zero.
    dt : float
        Time between samples, s.
    pairs : (8, n) ndarray
        Rows: circular frequency (rad/s), damping (fraction of critical) and participation
        (dimensionless) of structure 1, then of 2; cosine and sine of the azimuth from 1 to 2.
    largest : (3, n) ndarray
        Receives the maxima of ``q1 u1 - q2 u2`` and of ``q2 u2 - q1 u1``, m, and that of ``q1 v1 -
        q2 v2`` at the samples, m/s.
    """
    ground = _whole_tiles(north, east)
    inputs = tile_inputs(ground, dt)
    groups = grouped_inputs(inputs)
    # Memory of one block of pairs
    tiles = inputs.shape[0]
    checkpoints = np.empty((min(tiles, TILES), PAIR_CHECKPOINT_ROWS, PAIR_LANES))
    bounds = np.empty((4, groups.shape[0], PAIR_LANES))
    block = np.empty((PAIR_LANES, 8))
    best = np.empty((PAIR_LANES, 3))
    floors = np.empty((2, PAIR_LANES))
    largest[:] = 0.0
    # No displacement exceeds an infinite maximum
    unwanted = 0.0 if both_sides else np.inf
    largest[1] = unwanted
    pending = _unequal_pairs(pairs)
    # The second round begins with what the first has reached
    for again in range(2):
        short, count = np.empty(pending.size, np.int64), 0
        for first in range(0, pending.size, PAIR_LANES):
            # Fill the block, the last one with copies of its last pair
            chosen = pending[first : first + PAIR_LANES]
            _fill_block(pairs, chosen, block)
            bound_motion(groups, GROUP * TILE * dt, block, bounds)
            expected_motion(block, bounds, EXPECTED, floors)
            if again:
                _reached(largest, chosen, floors)
            best[:] = 0.0
            best[:, 1] = unwanted
            limits = floors, forgotten
            _run_block(ground, dt, block, chosen.size, inputs, bounds, limits, checkpoints, best)
            _store(best, chosen, largest)
            for lane in range(0 if again else chosen.size):
                if _is_short(best, floors, lane):
                    short[count] = chosen[lane]
                    count += 1
        pending = short[:count]


@lean
def _reached(largest, chosen, floors):
    """Lower the floors of a block to what its pairs are known to reach."""
    for lane in range(PAIR_LANES):
        # Displacements in both directions count
        index = chosen[min(lane, chosen.size - 1)]
        distance = REACHED * min(largest[0, index], largest[1, index])
        floors[0, lane] = min(floors[0, lane], distance)
        floors[1, lane] = min(floors[1, lane], REACHED * largest[2, index])


@lean
def _fill_block(pairs, chosen, block):
    """Fill a block with pairs (8, n), of which it takes those chosen and copies of the last one."""
    for lane in range(PAIR_LANES):
        for row in range(8):
            block[lane, row] = pairs[row, chosen[min(lane, chosen.size - 1)]]


@lean
def _store(best, chosen, largest):
    """Store the largest values of a block."""
    for lane in range(chosen.size):
        for row in range(3):
            largest[row, chosen[lane]] = best[lane, row]


@lean
def _is_short(best, floors, lane):
    """Return whether a pair does not reach what was expected of it in either direction."""
    return min(best[lane, 0], best[lane, 1]) < floors[0, lane] or best[lane, 2] < floors[1, lane]


@kernel
def _run_block(ground, dt, block, count, inputs, bounds, limits, checkpoints, best):
    """Raise the largest values of a block, (lanes, 3), to the part of the record that counts."""
    table = np.zeros((PAIR_ROWS, PAIR_LANES))
    windows = np.empty((2, PAIR_LANES), np.int64)
    moving = np.empty(PAIR_LANES, np.bool_)
    _pack(block, dt, table)
    floors, forgotten = limits
    find_pair_windows(GROUP * TILE * dt, block, bounds, floors, forgotten, windows)
    # From groups to tiles; copies are not counted
    tiles = inputs.shape[0]
    for lane in range(PAIR_LANES):
        windows[0, lane] *= GROUP
        last = min((windows[1, lane] + 1) * GROUP, tiles) - 1
        windows[1, lane] = last if lane < count else -1
    _shake(ground, dt, block, table, checkpoints, inputs, windows, best)
    # Free vibration of those that count up to the end
    for lane in range(PAIR_LANES):
        moving[lane] = windows[1, lane] == tiles - 1
    _ring_down(dt, tiles, block, table, checkpoints, moving, best)


@lean
def _pack(block, dt, table):
    """Fill the rows of a block of pairs."""
    for lane in range(PAIR_LANES):
        pack_pair(block[lane], dt, table, lane)


@kernel
def _shake(ground, dt, block, table, checkpoints, inputs, windows, best):
    """Raise the largest values to those during the parts of the record that count."""
    begin, end = windows[0, 0], 0
    for lane in range(PAIR_LANES):
        begin, end = min(begin, windows[0, lane]), max(end, windows[1, lane] + 1)
    for first in range(begin, end, TILES):
        # A stretch: first the samples, then the peaks between them
        last = min(first + TILES, end)
        samples = ground[:, first * TILE : last * TILE + 1]
        run_pair_tiles(samples[0], samples[1], first, windows, table, checkpoints)
        _raise(samples, dt, block, table, checkpoints, inputs[first:last], first, windows, best)


@kernel
def _whole_tiles(north, east):
    """Return both components, filled up with zeros to a whole number of tiles and one sample."""
    ground = np.zeros((2, -(-(north.size - 1) // TILE) * TILE + 1))
    for i in range(north.size):
        ground[0, i], ground[1, i] = north[i], east[i]
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
def _ring_down(dt, tile, block, table, checkpoints, moving, best):
    """Raise the largest values to those of the free vibration, tile by tile while one may grow."""
    # Of the layout of a stretch of the record: else all below would be compiled twice
    rest = np.zeros((2, 2 * TILE))[:, : TILE + 1]
    quiet = np.zeros((1, 3, 2))
    windows = np.empty((2, PAIR_LANES), np.int64)
    steps = 0
    while _drop_settled(steps, dt, block, table, moving, best):
        # None starts here, and those that move count
        windows[0] = -1
        for lane in range(PAIR_LANES):
            windows[1, lane] = tile if moving[lane] else -1
        run_pair_tiles(rest[0], rest[1], tile, windows, table, checkpoints)
        _raise(rest, dt, block, table, checkpoints, quiet, tile, windows, best)
        tile += 1
        steps += TILE


@lean
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
def _raise(ground, dt, block, table, checkpoints, inputs, first, windows, best):
    """Raise the largest values to those of the tiles, samples and peaks between them."""
    highest = _raise_velocities(dt, checkpoints, inputs.shape[0], first, windows, best)
    # The tiles of the largest bounds first: few others remain
    for lane in range(PAIR_LANES):
        for side in range(2):
            tile = int(highest[side, lane])
            if tile >= 0:
                _search(ground, dt, block, table, lane, checkpoints, inputs, tile, best)
    # Limits of the bounds of tiles that need no search, from margins over all tiles
    limits = np.empty((2, PAIR_LANES))
    strongest = strongest_inputs(inputs)
    _fill_limits(block, dt, table, strongest, best, limits)
    # Tiles whose bounds come close enough to the largest values
    for tile in range(inputs.shape[0]):
        near = 0
        for lane in range(PAIR_LANES):
            high = checkpoints[tile, GREATEST, lane] > limits[0, lane]
            near += high or -checkpoints[tile, LEAST, lane] > limits[1, lane]
        if near:
            # Pair by pair
            now = tile, first + tile
            _search_lanes(ground, dt, block, table, checkpoints, inputs, now, windows, limits, best)


@lean
def _fill_limits(block, dt, table, strongest, best, limits):
    """Fill the bounds above which a tile may hold larger values than those that are known."""
    for lane in range(PAIR_LANES):
        radii = largest_radii(block[lane], table, lane, strongest)
        _, margin = tile_margins(block[lane], dt, radii, strongest)
        limits[0, lane], limits[1, lane] = best[lane, 0] - margin, best[lane, 1] - margin


@kernel
def _raise_velocities(dt, checkpoints, tiles, first, windows, best):
    """
    Raise the largest velocities to the samples of the tiles that count.

    Return the tiles that count of the largest bounds of displacements that are wanted, (2, lanes);
    -1 where no bound exceeds what was reached.
    """
    sampled = np.zeros((3, PAIR_LANES))
    highest = np.full((2, PAIR_LANES), -1.0)
    # What was reached before
    for lane in range(PAIR_LANES):
        sampled[0, lane], sampled[1, lane] = best[lane, 0], best[lane, 1]
    for tile in range(tiles):
        number = float(tile)
        for lane in range(PAIR_LANES):
            # Largest velocity of a pair at rest is not below 0
            counts = windows[0, lane] <= first + tile <= windows[1, lane]
            part = 1.0 if counts else 0.0
            high, low = (
                part * checkpoints[tile, GREATEST, lane],
                -part * checkpoints[tile, LEAST, lane],
            )
            highest[0, lane] = number if high > sampled[0, lane] else highest[0, lane]
            highest[1, lane] = number if low > sampled[1, lane] else highest[1, lane]
            sampled[0, lane] = max(sampled[0, lane], high)
            sampled[1, lane] = max(sampled[1, lane], low)
            sampled[2, lane] = max(sampled[2, lane], part * checkpoints[tile, APPROACH, lane])
    # A reach is a third of what a velocity adds per step
    for lane in range(PAIR_LANES):
        best[lane, 2] = max(best[lane, 2], 3.0 / dt * sampled[2, lane])
    return highest


@lean
def _search_lanes(ground, dt, block, table, checkpoints, inputs, now, windows, limits, best):
    """Search a tile (place, number) of all pairs whose bounds are above limits."""
    tile, number = now
    for lane in range(PAIR_LANES):
        near = checkpoints[tile, GREATEST, lane] > limits[0, lane]
        near |= -checkpoints[tile, LEAST, lane] > limits[1, lane]
        # Only pairs of which the tile counts
        if near and windows[0, lane] <= number <= windows[1, lane]:
            _search(ground, dt, block, table, lane, checkpoints, inputs, tile, best)


@lean
def _search(ground, dt, block, table, lane, checkpoints, inputs, tile, best):
    """Raise the largest values of a pair to its peaks in a tile, if they may exceed them."""
    pair, checkpoint, first = block[lane], checkpoints[tile], tile * TILE
    # States of both structures before the tile
    acceleration = pair[6] * ground[0, first] + pair[7] * ground[1, first]
    u1, z1 = state_of(0, table, lane, checkpoint[0, lane], checkpoint[1, lane], acceleration)
    u2, z2 = state_of(1, table, lane, checkpoint[2, lane], checkpoint[3, lane], acceleration)
    before = (u1, z1, u2, z2)
    # The bound of this tile alone
    _, margin = tile_margins(pair, dt, present_radii(pair, before), inputs[tile])
    high = checkpoint[GREATEST, lane] + margin > best[lane, 0]
    if high or margin - checkpoint[LEAST, lane] > best[lane, 1]:
        north, east = ground[0, first : first + TILE + 1], ground[1, first : first + TILE + 1]
        search_pair_tile(pair, dt, north, east, before, margin, best[lane])
        # It is not searched again
        checkpoint[GREATEST, lane], checkpoint[LEAST, lane] = -np.inf, np.inf
