r"""
Largest radius and displacement between the samples of those tiles of steps that can hold them, exact.

A squared radius exceeds the larger of two values looked at by an eighth of their squared distance
in phase times its second derivative at most, and so does a displacement. Only tiles where that may
matter are walked step by step.
"""

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.maxima.roots import raise_to_root
from per_obspy.kernels.maxima.samples import (
    DAMPING,
    DISPLACEMENT,
    LANES,
    PHASE,
    SQUARE,
    STEP,
    WEIGHTS,
)
from per_obspy.kernels.oscillator.within_step import (
    LONGEST_SPAN,
    dips,
    find_wanted,
    largest_in_step,
    may_vanish,
    radius_bound,
    rate_bounds,
    series_terms,
    slacks,
    workspace,
)
from per_obspy.kernels.spectra.blocks import TILE


@kernel
def raise_to_peaks(stride, north, east, limits, begin, windows, table, kept, largest):
    """
    Raise the largest squared radii and displacements (2, LANES) to those in each oscillator's window of tiles.

    ``north`` and ``east`` hold whole tiles of which ``begin`` is the first, ``limits`` (4, tiles)
    their largest accelerations and changes over a step in both components, ``kept`` what
    `run_strides` kept of them; ``windows`` (2, LANES) are the first and the last tile.
    """
    tiles = limits.shape[1]
    highest, threshold, over = np.empty((2, LANES)), np.empty((2, LANES)), np.empty(LANES)
    work, motion = workspace(), np.empty((3, TILE + 1))
    _raise_to_tiles(kept, begin, tiles, windows, largest, highest)
    for lane in range(LANES):
        for row in range(2):
            tile = int(highest[row, lane])
            if tile >= 0 and (row == 0 or tile != highest[0, lane]):
                _walk(stride, north, east, limits, tile, lane, table, kept, motion, work, largest)
    _thresholds(stride, limits, table, largest, threshold)
    for tile in range(tiles):
        if _beyond(kept[tile], threshold, over):
            for lane in range(LANES):
                inside = windows[0, lane] <= begin + tile <= windows[1, lane]
                if (
                    over[lane] > 0.0
                    and inside
                    and tile != highest[0, lane]
                    and tile != highest[1, lane]
                ):
                    _walk(
                        stride, north, east, limits, tile, lane, table, kept, motion, work, largest
                    )


@kernel
def _raise_to_tiles(kept, begin, tiles, windows, largest, highest):
    """Raise the largest values to those looked at; ``highest`` (2, LANES) takes their tiles, -1 where there is none."""
    highest[:] = -1.0
    for tile in range(tiles):
        number, here = float(begin + tile), float(tile)
        for row in range(2):
            for lane in range(LANES):
                inside = windows[0, lane] <= number and number <= windows[1, lane]
                value = kept[tile, SQUARE + row, lane] if inside else 0.0
                highest[row, lane] = here if value > largest[row, lane] else highest[row, lane]
                largest[row, lane] = max(largest[row, lane], value)


@kernel
def _thresholds(stride, limits, table, largest, threshold):
    """Fill what the values looked at in a tile must exceed for larger ones to lie between: bounds of all tiles."""
    strongest = np.zeros((4, 1))
    for row in range(4):
        for tile in range(limits.shape[1]):
            strongest[row, 0] = max(strongest[row, 0], limits[row, tile])
    for lane in range(LANES):
        _, _, slack = _bounds(stride, strongest, 0, lane, table, largest[0, lane])
        for row in range(2):
            threshold[row, lane] = largest[row, lane] - stride * stride * slack[row]


@kernel
def _beyond(kept, threshold, over):
    """Fill by how much oscillators exceed their thresholds in a tile; tell whether any does."""
    most = -np.inf
    for lane in range(LANES):
        over[lane] = max(
            kept[SQUARE, lane] - threshold[0, lane], kept[DISPLACEMENT, lane] - threshold[1, lane]
        )
    for lane in range(LANES):
        most = max(most, over[lane])
    return most > 0.0


@kernel
def _bounds(stride, limits, tile, lane, table, square):
    """Return bounds of the radius and the rates in a tile, and by how much two samples may be exceeded between them."""
    north, east = abs(table[WEIGHTS, lane]), abs(table[WEIGHTS + 1, lane])
    peak = north * limits[0, tile] + east * limits[1, tile]
    jump = north * limits[2, tile] + east * limits[3, tile]
    damping, phase = table[DAMPING, lane], table[PHASE, lane]
    radius = radius_bound(square, peak, damping, stride * phase)
    rates = rate_bounds(radius, peak, jump, damping, phase)
    return radius, rates, slacks(rates, damping, phase)


@kernel
def _walk(stride, north, east, limits, tile, lane, table, kept, motion, work, largest):
    """Raise the largest values of an oscillator to those in one tile, exact between the samples."""
    radius, rates, slack = _bounds(stride, limits, tile, lane, table, kept[tile, SQUARE, lane])
    square, displacement = kept[tile, SQUARE, lane], kept[tile, DISPLACEMENT, lane]
    wide = stride * stride
    if (
        square + wide * slack[0] <= largest[0, lane]
        and displacement + wide * slack[1] <= largest[1, lane]
    ):
        return
    to_north, to_east, first = table[WEIGHTS, lane], table[WEIGHTS + 1, lane], tile * TILE
    for i in range(TILE + 1):
        motion[2, i] = to_north * north[first + i] + to_east * east[first + i]
    square, displacement = _rerun(kept[tile, 0, lane], kept[tile, 1, lane], lane, table, motion)
    best = np.array(
        (max(largest[0, lane], square), max(largest[1, lane], displacement), np.inf, np.inf)
    )
    if square + slack[0] > best[0] or displacement + slack[1] > best[1]:
        damping, phase = table[DAMPING, lane], table[PHASE, lane]
        _search(motion, radius, rates, slack, damping, phase, work, best)
    largest[0, lane], largest[1, lane] = best[0], best[1]


@kernel
def _rerun(u, z, lane, table, motion):
    """Fill the states at the samples of a tile; return the largest squared radius and displacement at them."""
    a11, a12, a21, a22 = (
        table[STEP, lane],
        table[STEP + 1, lane],
        table[STEP + 2, lane],
        table[STEP + 3, lane],
    )
    b11, b12, b21, b22 = (
        table[STEP + 4, lane],
        table[STEP + 5, lane],
        table[STEP + 6, lane],
        table[STEP + 7, lane],
    )
    square, displacement = u * u + z * z, abs(u)
    motion[0, 0], motion[1, 0] = u, z
    for i in range(TILE):
        start, end = motion[2, i], motion[2, i + 1]
        u, z = (
            a11 * u + (a12 * z + (b11 * start + b12 * end)),
            a21 * u + (a22 * z + (b21 * start + b22 * end)),
        )
        motion[0, i + 1], motion[1, i + 1] = u, z
        square, displacement = max(square, u * u + z * z), max(displacement, abs(u))
    return square, displacement


@kernel
def _search(motion, radius, rates, slack, damping, phase, work, best):
    """Raise the largest values to the stationary ones within the steps of a tile."""
    wanted, twice, terms = np.zeros(4, np.bool_), 2.0 * damping, series_terms(phase)
    dip, short = dips(rates, damping, phase), phase <= LONGEST_SPAN
    for i in range(TILE):
        u, z, u_end, z_end = motion[0, i], motion[1, i], motion[0, i + 1], motion[1, i + 1]
        larger = max(u * u + z * z, u_end * u_end + z_end * z_end) + slack[0] > best[0]
        if larger or max(abs(u), abs(u_end)) + slack[1] > best[1]:
            start, end = motion[2, i], motion[2, i + 1]
            ends = (u, z, start, u_end, z_end, end)
            doubtful = False
            if larger and may_vanish(twice * z + start, twice * z_end + end, dip[0]):
                doubtful = not (
                    short and raise_to_root(0, ends, rates, damping, phase, terms, work, best)
                )
            if may_vanish(z, z_end, dip[1]):
                doubtful |= not (
                    short and raise_to_root(1, ends, rates, damping, phase, terms, work, best)
                )
            if doubtful and find_wanted(
                u, z, start, u_end, z_end, end, damping, phase, radius, 4, best, wanted
            ):
                largest_in_step(u, z, start, end, damping, phase, wanted, work, best)
