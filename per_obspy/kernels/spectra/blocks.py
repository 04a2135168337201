r"""
Blocks of oscillators side by side, tiles of steps in a row: what is common to the kernels that look for largest values.

A first pass runs a block over the samples and keeps, per tile, the state before it and the largest
sampled values. Only tiles where a bound exceeds the largest value found are repeated, one
oscillator at a time, exactly between the samples.
"""

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step
from per_obspy.kernels.oscillator.within_step import (
    find_wanted,
    largest_in_step,
    radius_bound,
    rate_bounds,
    slacks,
    step_velocity_bound,
    velocity_slack,
    workspace,
)

#: Oscillators side by side: a constant trip count, which the compiler turns into vectors.
LANES = 64
#: Steps after which the state is kept.
TILE = 64
#: Accumulators side by side of a reduction, as many as fit into the widest vectors.
SIDE = 8
#: Tiles kept at a time: memory stays the same however long the record is.
TILES = 256
#: States below this are set to zero (records are scaled to a peak of order one): denormal numbers
#: are slow.
SMALLEST_STATE = 1e-140


@kernel
def tile_extremes(acceleration, peaks, jumps):
    """Fill the largest acceleration and the largest change over a step of each tile."""
    peak, jump = np.empty(SIDE), np.empty(SIDE)
    for tile in range((acceleration.size - 1) // TILE):
        first = tile * TILE
        for k in range(SIDE):
            peak[k], jump[k] = abs(acceleration[first]), 0.0
        for i in range(first, first + TILE, SIDE):
            for k in range(SIDE):
                start, end = acceleration[i + k], acceleration[i + k + 1]
                peak[k], jump[k] = max(peak[k], abs(end)), max(jump[k], abs(end - start))
        peaks[tile], jumps[tile] = peak[0], jump[0]
        for k in range(1, SIDE):
            peaks[tile], jumps[tile] = max(peaks[tile], peak[k]), max(jumps[tile], jump[k])


@kernel
def raise_to_tiles(kept, tiles, largest):
    """Raise the largest values to those of the tiles: the rows of ``kept`` (tile, row, lane) from 2 on."""
    for tile in range(tiles):
        for row in range(largest.shape[0]):
            for lane in range(LANES):
                largest[row, lane] = max(largest[row, lane], kept[tile, 2 + row, lane])


@kernel
def _thresholds(peaks, jumps, phases, dampings, weights, largest, threshold):
    """Fill what a tile's largest value at samples must exceed for a larger one to lie between: bounds of all tiles."""
    peak, jump = np.zeros(2), np.zeros(2)
    for component in range(2):
        for tile in range(peaks.shape[1]):
            peak[component] = max(peak[component], peaks[component, tile])
            jump[component] = max(jump[component], jumps[component, tile])
    for lane in range(LANES):
        north, east = abs(weights[0, lane]), abs(weights[1, lane])
        peak_here, jump_here = north * peak[0] + east * peak[1], north * jump[0] + east * jump[1]
        radius = radius_bound(largest[0, lane], peak_here, dampings[lane], phases[lane])
        rates = rate_bounds(radius, peak_here, jump_here, dampings[lane], phases[lane])
        slack = slacks(rates, dampings[lane], phases[lane])
        for row in range(largest.shape[0]):
            threshold[row, lane] = largest[row, lane] - slack[row]
        if largest.shape[0] > 1:
            more = velocity_slack(largest[2, lane], rates, jump_here, dampings[lane], phases[lane])
            threshold[2, lane] = largest[2, lane] - more


@kernel
def select(kept, peaks, jumps, phases, dampings, weights, lanes, largest, chosen):
    """
    Raise the largest values to those of the tiles and list as (tile, lane) where more may lie between samples.

    ``kept`` (tile, row, lane) holds the values from row 2 on; only the first ``lanes`` count.
    Returns their number.
    """
    tiles, quantities = peaks.shape[1], largest.shape[0]
    raise_to_tiles(kept, tiles, largest)
    threshold = np.empty((quantities, LANES))
    _thresholds(peaks, jumps, phases, dampings, weights, largest, threshold)
    count = 0
    for tile in range(tiles):
        for lane in range(lanes):
            beyond = kept[tile, 2, lane] > threshold[0, lane]
            for row in range(1, quantities):
                beyond |= kept[tile, 2 + row, lane] > threshold[row, lane]
            if beyond:
                chosen[count, 0], chosen[count, 1] = tile, lane
                count += 1
    return count


@kernel
def repeat(north, east, peaks, jumps, phases, dampings, weights, kept, states, chosen, largest):
    """Raise the largest values by what lies between the samples of the chosen (tile, lane), from the states before."""
    quantities = largest.shape[0]
    work, wanted, here = workspace(), np.empty(4, np.bool_), np.full(4, np.inf)
    motion, marks = np.empty((3, TILE + 1)), np.empty(TILE)
    for number in range(chosen.shape[0]):
        tile, lane = chosen[number]
        phase, damping = phases[lane], dampings[lane]
        along, across = weights[0, lane], weights[1, lane]
        peak = abs(along) * peaks[0, tile] + abs(across) * peaks[1, tile]
        jump = abs(along) * jumps[0, tile] + abs(across) * jumps[1, tile]
        radius = radius_bound(kept[tile, 2, lane], peak, damping, phase)
        rates = rate_bounds(radius, peak, jump, damping, phase)
        if not _open(kept[tile, 2:, lane], rates, jump, damping, phase, largest[:, lane], here):
            continue
        motion[0, 0], motion[1, 0] = states[number, 0], states[number, 1]
        for i in range(TILE + 1):
            motion[2, i] = along * north[tile * TILE + i] + across * east[tile * TILE + i]
        _rerun(step(1.0, damping, phase), motion)
        _mark(motion, rates, damping, phase, quantities, here, marks)
        for i in range(TILE):
            if marks[i] > 0.0:
                u, z, start = motion[0, i], motion[1, i], motion[2, i]
                u_end, z_end, end = motion[0, i + 1], motion[1, i + 1], motion[2, i + 1]
                if find_wanted(
                    u, z, start, u_end, z_end, end, damping, phase, radius, quantities, here, wanted
                ):
                    largest_in_step(u, z, start, end, damping, phase, wanted, work, here)
        for row in range(quantities):
            largest[row, lane] = here[row] if here[row] < np.inf else largest[row, lane]


@kernel
def _open(sampled, rates, jump, damping, phase, largest, here):
    """Copy those largest values that a tile can exceed, infinity instead of the others; tell whether there are any."""
    slack, beyond = slacks(rates, damping, phase), False
    for row in range(largest.size):
        more = velocity_slack(sampled[2], rates, jump, damping, phase) if row == 2 else slack[row]
        exceeds = sampled[row] + more > largest[row]
        here[row] = largest[row] if exceeds else np.inf
        beyond |= exceeds
    return beyond


@kernel
def _rerun(coefficients, motion):
    """Fill displacement and velocity at the samples of a tile from those in the first column."""
    a11, a12, a21, a22, b11, b12, b21, b22 = coefficients
    u, z = motion[0, 0], motion[1, 0]
    for i in range(TILE):
        start, end = motion[2, i], motion[2, i + 1]
        u, z = (
            a11 * u + (a12 * z + (b11 * start + b12 * end)),
            a21 * u + (a22 * z + (b21 * start + b22 * end)),
        )
        motion[0, i + 1], motion[1, i + 1] = u, z


@kernel
def _mark(motion, rates, damping, phase, quantities, here, marks):
    """Mark with a positive number the steps of a tile that may hold more than the largest values."""
    slack, twice = slacks(rates, damping, phase), 2.0 * damping
    radius, displacement, velocity, felt = (
        here[0] - slack[0],
        here[1] - slack[1],
        here[2],
        here[3] - slack[3],
    )
    for i in range(TILE):
        u, z, u_end, z_end = motion[0, i], motion[1, i], motion[0, i + 1], motion[1, i + 1]
        marks[i] = max(u * u + z * z, u_end * u_end + z_end * z_end) - radius
    if quantities > 1:
        for i in range(TILE):
            u, z, start = motion[0, i], motion[1, i], motion[2, i]
            u_end, z_end, end = motion[0, i + 1], motion[1, i + 1], motion[2, i + 1]
            marks[i] = max(marks[i], max(abs(u), abs(u_end)) - displacement)
            marks[i] = max(marks[i], max(abs(u + twice * z), abs(u_end + twice * z_end)) - felt)
            bound = step_velocity_bound(u, z, start, u_end, z_end, end, rates, damping, phase)
            marks[i] = max(marks[i], bound - velocity)
