r"""
Largest radius and displacement between the samples of those tiles of steps that can hold them.

A squared radius exceeds the larger of two values looked at by an eighth of their squared distance
in phase times its second derivative at most, and so does a displacement. Only tiles where that may
matter are searched step by step; there the maxima are exact.
"""

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.maxima.strided_samples import (
    DAMPING,
    DISPLACEMENT,
    MAXIMA_LANES,
    PHASE,
    SQUARE,
    STEP,
    WEIGHTS,
)
from per_obspy.kernels.oscillator.stationary import raise_within_step
from per_obspy.kernels.oscillator.within_step import (
    radius_bound,
    rate_bounds,
    sags,
    series_terms,
    slacks,
    workspace,
)
from per_obspy.kernels.spectra.tile_search import TILE


@kernel
def raise_to_tile_peaks(stride, north, east, limits, begin, windows, table, checkpoints, largest):
    """
    Raise the largest squared radii and displacements (2, lanes) to those of the peaks.

    ``north`` and ``east`` hold whole tiles of which ``begin`` is the first, ``limits`` (4, tiles)
    their largest accelerations and changes over a step in both components, ``checkpoints`` the rows
    of `run_strides`; ``windows`` (2, lanes) are the first and the last tile
    that counts for each oscillator.
    """
    tiles = limits.shape[1]
    highest = np.empty((2, MAXIMA_LANES))
    threshold = np.empty((2, MAXIMA_LANES))
    excess = np.empty(MAXIMA_LANES)
    work = workspace()
    motion = np.empty((3, TILE + 1))
    # Search the tiles with the largest samples first: they raise the thresholds of all others
    _raise_to_tiles(checkpoints, begin, tiles, windows, largest, highest)
    for lane in range(MAXIMA_LANES):
        for row in range(2):
            tile = int(highest[row, lane])
            if tile >= 0 and (row == 0 or tile != highest[0, lane]):
                _search_tile(
                    stride,
                    north,
                    east,
                    limits,
                    tile,
                    lane,
                    table,
                    checkpoints,
                    motion,
                    work,
                    largest,
                )
    # Then every other tile of a window whose samples come close enough to the largest values
    _thresholds(stride, limits, table, largest, threshold)
    for tile in range(tiles):
        if _any_beyond(checkpoints[tile], threshold, excess):
            for lane in range(MAXIMA_LANES):
                # In the oscillator's window, and not searched before
                inside = windows[0, lane] <= begin + tile <= windows[1, lane]
                is_searched = tile == highest[0, lane] or tile == highest[1, lane]
                if excess[lane] > 0.0 and inside and not is_searched:
                    _search_tile(
                        stride,
                        north,
                        east,
                        limits,
                        tile,
                        lane,
                        table,
                        checkpoints,
                        motion,
                        work,
                        largest,
                    )


@kernel
def _raise_to_tiles(checkpoints, begin, tiles, windows, largest, highest):
    """Raise the largest values to the samples; fill their tiles (2, lanes), -1 if there is none."""
    highest[:] = -1.0
    for tile in range(tiles):
        number = float(begin + tile)
        index = float(tile)
        for row in range(2):
            for lane in range(MAXIMA_LANES):
                # Samples count inside the oscillator's window only
                inside = windows[0, lane] <= number and number <= windows[1, lane]
                value = checkpoints[tile, SQUARE + row, lane] if inside else 0.0
                highest[row, lane] = index if value > largest[row, lane] else highest[row, lane]
                largest[row, lane] = max(largest[row, lane], value)


@kernel
def _thresholds(stride, limits, table, largest, threshold):
    """Fill the sampled values of a tile above which larger ones may lie between its samples."""
    # Strongest motion of any tile
    strongest = np.zeros((4, 1))
    for row in range(4):
        for tile in range(limits.shape[1]):
            strongest[row, 0] = max(strongest[row, 0], limits[row, tile])
    for lane in range(MAXIMA_LANES):
        _, _, slack = _bounds(stride, strongest, 0, lane, table, largest[0, lane])
        for row in range(2):
            threshold[row, lane] = largest[row, lane] - stride * stride * slack[row]


@kernel
def _any_beyond(checkpoint, threshold, excess):
    """Fill by how much oscillators exceed their thresholds in a tile; return whether any does."""
    most = -np.inf
    for lane in range(MAXIMA_LANES):
        excess[lane] = max(
            checkpoint[SQUARE, lane] - threshold[0, lane],
            checkpoint[DISPLACEMENT, lane] - threshold[1, lane],
        )
    for lane in range(MAXIMA_LANES):
        most = max(most, excess[lane])
    return most > 0.0


@kernel
def _bounds(stride, limits, tile, lane, table, square):
    """Return bounds of radius and rates in a tile, and slacks between two samples."""
    # Largest acceleration and change over a step along the oscillator's azimuth
    north = abs(table[WEIGHTS, lane])
    east = abs(table[WEIGHTS + 1, lane])
    peak = north * limits[0, tile] + east * limits[1, tile]
    jump = north * limits[2, tile] + east * limits[3, tile]
    damping = table[DAMPING, lane]
    phase = table[PHASE, lane]
    radius = radius_bound(square, peak, damping, stride * phase)
    rates = rate_bounds(radius, peak, jump, damping, phase)
    return radius, rates, slacks(rates, damping, phase)


@kernel
def _search_tile(
    stride, north, east, limits, tile, lane, table, checkpoints, motion, work, largest
):
    """Raise the largest values of an oscillator to those in one tile, exact between the samples."""
    # Rule the tile out by the samples that were looked at
    square = checkpoints[tile, SQUARE, lane]
    displacement = checkpoints[tile, DISPLACEMENT, lane]
    radius, rates, slack = _bounds(stride, limits, tile, lane, table, square)
    wide = stride * stride
    if (
        square + wide * slack[0] <= largest[0, lane]
        and displacement + wide * slack[1] <= largest[1, lane]
    ):
        return
    # States at every sample
    to_north = table[WEIGHTS, lane]
    to_east = table[WEIGHTS + 1, lane]
    first = tile * TILE
    for i in range(TILE + 1):
        motion[2, i] = to_north * north[first + i] + to_east * east[first + i]
    square, displacement = _rerun(
        checkpoints[tile, 0, lane], checkpoints[tile, 1, lane], lane, table, motion
    )
    best = np.array(
        (max(largest[0, lane], square), max(largest[1, lane], displacement), np.inf, np.inf)
    )
    # Search between the samples where these come close enough
    if square + slack[0] > best[0] or displacement + slack[1] > best[1]:
        damping = table[DAMPING, lane]
        phase = table[PHASE, lane]
        _search_steps(motion, radius, rates, slack, damping, phase, work, best)
    largest[0, lane] = best[0]
    largest[1, lane] = best[1]


@kernel
def _rerun(u, z, lane, table, motion):
    """Fill the states at a tile's samples; return their largest squared radius and displacement."""
    # Coefficients of a step
    a11 = table[STEP, lane]
    a12 = table[STEP + 1, lane]
    a21 = table[STEP + 2, lane]
    a22 = table[STEP + 3, lane]
    b11 = table[STEP + 4, lane]
    b12 = table[STEP + 5, lane]
    b21 = table[STEP + 6, lane]
    b22 = table[STEP + 7, lane]
    square = u * u + z * z
    displacement = abs(u)
    motion[0, 0] = u
    motion[1, 0] = z
    for i in range(TILE):
        start = motion[2, i]
        end = motion[2, i + 1]
        # One exact step (Nigam & Jennings)
        u_end = a11 * u + (a12 * z + (b11 * start + b12 * end))
        z_end = a21 * u + (a22 * z + (b21 * start + b22 * end))
        u = u_end
        z = z_end
        # Store the state and raise the largest values
        motion[0, i + 1] = u
        motion[1, i + 1] = z
        square = max(square, u * u + z * z)
        displacement = max(displacement, abs(u))
    return square, displacement


@kernel
def _search_steps(motion, radius, rates, slack, damping, phase, work, best):
    """Raise the largest values to the stationary ones within the steps of a tile."""
    selected = np.zeros(4, np.bool_)
    terms = series_terms(phase)
    bounds = radius, rates, slack, sags(rates, damping, phase)
    for i in range(TILE):
        # Steps whose ends come close enough to the largest values
        u, z, u_end, z_end = motion[0, i], motion[1, i], motion[0, i + 1], motion[1, i + 1]
        is_larger = max(u * u + z * z, u_end * u_end + z_end * z_end) + slack[0] > best[0]
        if is_larger or max(abs(u), abs(u_end)) + slack[1] > best[1]:
            # The largest values inside them
            ends = (u, z, motion[2, i], u_end, z_end, motion[2, i + 1])
            raise_within_step(ends, bounds, damping, phase, terms, 4, selected, work, best)
