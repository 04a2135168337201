r"""
Blocks of oscillators side by side, tiles of steps in a row: what is common to the kernels that look for largest values.

A first pass runs a block over the samples and keeps, per tile, the state before it and the largest sampled values. Only
tiles where a bound exceeds the largest value found are repeated, one oscillator at a time, exactly between the samples.
"""

import numpy as np

from ._jit import kernel
from .between import find_wanted, largest_in_step, radius_bound, rate_bounds, slacks, workspace
from .oscillator import step

#: Oscillators side by side: a constant trip count, which the compiler turns into vectors.
LANES = 64
#: Steps after which the state is kept.
TILE = 64
#: Tiles kept at a time: memory stays the same however long the record is.
TILES = 256
#: States below this are set to zero (records are scaled to a peak of order one): denormal numbers are slow.
SMALLEST_STATE = 1e-140


@kernel
def tile_extremes(acceleration, peaks, jumps):
    """Fill the largest acceleration and the largest change over a step of each tile."""
    for tile in range((acceleration.size - 1) // TILE):
        peak, jump = abs(acceleration[tile * TILE]), 0.0
        for i in range(tile * TILE, tile * TILE + TILE):
            peak = max(peak, abs(acceleration[i + 1]))
            jump = max(jump, abs(acceleration[i + 1] - acceleration[i]))
        peaks[tile], jumps[tile] = peak, jump


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


@kernel
def select(kept, peaks, jumps, phases, dampings, weights, lanes, largest, chosen):
    """
    Raise the largest values to those of the tiles and list as (tile, lane) where more may lie between samples.

    ``kept`` (tile, row, lane) holds the values from row 2 on; only the first ``lanes`` count. Returns how many there are.
    """
    tiles, quantities = peaks.shape[1], largest.shape[0]
    for tile in range(tiles):
        for row in range(quantities):
            for lane in range(LANES):
                largest[row, lane] = max(largest[row, lane], kept[tile, 2 + row, lane])
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
    for number in range(chosen.shape[0]):
        tile, lane = chosen[number]
        phase, damping = phases[lane], dampings[lane]
        along, across = weights[0, lane], weights[1, lane]
        peak = abs(along) * peaks[0, tile] + abs(across) * peaks[1, tile]
        jump = abs(along) * jumps[0, tile] + abs(across) * jumps[1, tile]
        radius = radius_bound(kept[tile, 2, lane], peak, damping, phase)
        slack = slacks(rate_bounds(radius, peak, jump, damping, phase), damping, phase)
        beyond = False
        for row in range(quantities):
            here[row] = largest[row, lane]
            beyond |= kept[tile, 2 + row, lane] + slack[row] > here[row]
        if not beyond:
            continue
        a11, a12, a21, a22, b11, b12, b21, b22 = step(1.0, damping, phase)
        u, z = states[number, 0], states[number, 1]
        square, twice = u * u + z * z, 2.0 * damping
        first = tile * TILE
        end = along * north[first] + across * east[first]
        for i in range(first, first + TILE):
            start, end = end, along * north[i + 1] + across * east[i + 1]
            u_end = a11 * u + a12 * z + (b11 * start + b12 * end)
            z_end = a21 * u + a22 * z + (b21 * start + b22 * end)
            square_end = u_end * u_end + z_end * z_end
            beyond = max(square, square_end) + slack[0] > here[0]
            if quantities > 1:
                beyond |= max(abs(u), abs(u_end)) + slack[1] > here[1]
                beyond |= max(abs(z), abs(z_end)) + slack[2] > here[2]
                beyond |= max(abs(u + twice * z), abs(u_end + twice * z_end)) + slack[3] > here[3]
            if beyond and find_wanted(u, z, start, u_end, z_end, end, damping, phase, radius, quantities, here, wanted):
                largest_in_step(u, z, start, end, damping, phase, wanted, work, here)
            u, z, square = u_end, z_end, square_end
        for row in range(quantities):
            largest[row, lane] = here[row]
