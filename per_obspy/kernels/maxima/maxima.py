"""
Largest radius and displacement of many oscillators under one record, each with its own azimuth, exact.

Oscillators that are looked at equally often run side by side through the part of the record that
counts for them. What an oscillator is told does not depend on its company.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.maxima.peaks import raise_to_peaks
from per_obspy.kernels.maxima.samples import (
    DAMPING,
    KEPT,
    LANES,
    ROWS,
    pack_oscillator,
    run_strides,
)
from per_obspy.kernels.maxima.window import find_windows
from per_obspy.kernels.oscillator.exact_step import unit_responses
from per_obspy.kernels.spectra.blocks import TILE
from per_obspy.kernels.spectra.response import first_root

#: Tiles kept at a time: memory stays the same however long the record is.
TILES = 512
#: What a displacement times omega² is expected to reach, of the record's peak; less below a phase
#: of a step, because soft oscillators stay behind. One that does not reach it is run again, through
#: the whole record.
EXPECTED, SOFT_PHASE = 0.1, 0.05


@kernel
def largest_responses(stride, north, east, limits, groups, width, oscillators, order, largest):
    """
    Fill the columns ``order`` of ``largest`` (2, n) with squared radii and displacements, free vibration included.

    ``north`` and ``east`` have (tiles * TILE + 1,) samples; ``limits`` (4, tiles) are the largest
    accelerations and changes over a step in both components, ``groups`` (2, m) the former over
    ``width`` tiles each. ``oscillators`` (4, n): phase of a step, damping, weights of both
    components. Lengths are counted in the record's acceleration over omega².
    """
    table, kept = np.empty((ROWS, LANES)), np.empty((min(TILES, limits.shape[1]), KEPT, LANES))
    floors, best, bounds = np.empty(LANES), np.empty((2, LANES)), np.empty((groups.shape[1], LANES))
    pending, expected = order, EXPECTED
    while pending.size:
        again, count = np.empty(pending.size, np.int64), 0
        for first in range(0, pending.size, LANES):
            chosen = pending[first : first + LANES]
            for lane in range(LANES):
                phase, damping, to_north, to_east = oscillators[
                    :, chosen[min(lane, chosen.size - 1)]
                ]
                pack_oscillator(stride, phase, damping, to_north, to_east, table, lane)
                floors[lane] = (
                    expected * min(1.0, phase / SOFT_PHASE) * _peak(groups, to_north, to_east)
                )
            _run(stride, north, east, limits, groups, width, table, kept, floors, bounds, best)
            for lane in range(chosen.size):
                if best[1, lane] >= floors[lane]:
                    largest[:, chosen[lane]] = best[:, lane]
                else:
                    again[count] = chosen[lane]
                    count += 1
        pending, expected = again[:count], 0.0


@kernel
def _peak(groups, north, east):
    """Return what the acceleration along an azimuth cannot exceed."""
    peak = 0.0
    for group in range(groups.shape[1]):
        peak = max(peak, abs(north) * groups[0, group] + abs(east) * groups[1, group])
    return peak


@kernel
def _run(stride, north, east, limits, groups, width, table, kept, floors, bounds, best):
    """Fill the largest values (2, LANES) of a block, from as much of the record as its floors ask for."""
    tiles = limits.shape[1]
    windows = np.empty((3, LANES))
    find_windows(groups, TILE * width, table, floors, bounds, windows)
    begin, end = int(windows[0].min()) * width, min(int(windows[2].max() + 1.0) * width, tiles)
    windows[0] *= width
    windows[1] *= width
    windows[2] = (windows[2] + 1.0) * width - 1.0
    best[:] = 0.0
    for stretch in range(begin - begin % TILES, end, TILES):
        first, last = max(begin, stretch), min(end, stretch + TILES)
        samples = slice(first * TILE, last * TILE + 1)
        run_strides(stride, north[samples], east[samples], first, windows[0], table, kept)
        raise_to_peaks(
            stride,
            north[samples],
            east[samples],
            limits[:, first:last],
            first,
            windows[1:],
            table,
            kept,
            best,
        )
    if end == tiles:
        _ring_down(table, best)


@kernel
def _ring_down(table, best):
    """Raise the largest displacements to those of the free vibration from the last states on."""
    for lane in range(LANES):
        u, z, damping = table[0, lane], table[1, lane], table[DAMPING, lane]
        if math.hypot(u, z) > best[1, lane]:
            impulse, _, once, _ = unit_responses(
                first_root(z, -2.0 * damping * z - u, damping), damping
            )
            best[1, lane] = max(best[1, lane], abs(u * (1.0 - once) + z * impulse))
