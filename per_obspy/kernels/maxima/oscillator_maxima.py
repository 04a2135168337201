"""
Largest radius and displacement of many oscillators under one record, each with its own azimuth.

Oscillators that are looked at equally often run next to each other through the part of the record
that counts for them. The maxima are exact between samples, and the result for one oscillator does
not depend on which others share its block, bit for bit.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.maxima.window import find_windows
from per_obspy.kernels.oscillator.exact_step import unit_responses
from per_obspy.kernels.oscillator.strides import (
    CHECKPOINT_ROWS,
    DAMPING,
    MAXIMA_LANES,
    OSCILLATOR_ROWS,
    PHASE,
    WEIGHTS,
    pack_oscillator,
    run_strides,
)
from per_obspy.kernels.spectra.response import first_root
from per_obspy.kernels.spectra.tile_search import TILE, raise_between_samples

#: Tiles with a checkpoint at a time: memory stays constant however long the record is.
STRETCH_TILES = 512
#: Displacement times omega² that an oscillator is expected to reach, of the record's peak; less
#: below a phase of a step, because soft oscillators stay behind. An oscillator that does not reach
#: it is run again, through the whole record.
EXPECTED, SOFT_PHASE = 0.1, 0.05


@kernel
def largest_responses(stride, north, east, limits, groups, width, oscillators, order, largest):
    """
    Fill the largest responses of some oscillators, free vibration included.

    Parameters
    ----------
    stride : int
        Steps from one sample that is looked at to the next: 1, 2 or 4.
    north, east : (tiles * TILE + 1,) ndarray
        Components of the ground acceleration, scaled to a peak of order one.
    limits : (4, tiles) ndarray
        Largest absolute north and east acceleration of each tile, then their largest changes over
        a step, in units of the components.
    groups : (2, n_groups) ndarray
        Largest absolute north and east acceleration of each group of tiles.
    width : int
        Tiles in a group.
    oscillators : (4, n) ndarray
        Rows: phase ``omega * dt`` of a step (rad), damping (fraction of critical), weights of
        north and east (cosine and sine of the azimuth).
    order : (m,) ndarray of int
        Oscillators to compute, those next to each other that forget equally fast.
    largest : (2, n) ndarray
        Receives, in the columns ``order``, the largest squared radius and the largest displacement,
        in units of the components' acceleration over ``omega²``.
    """
    table = np.empty((OSCILLATOR_ROWS, MAXIMA_LANES))
    tiles = min(STRETCH_TILES, limits.shape[1])
    checkpoints = np.empty((tiles, CHECKPOINT_ROWS, MAXIMA_LANES))
    floors = np.empty(MAXIMA_LANES)
    best = np.empty((2, MAXIMA_LANES))
    bounds = np.empty((groups.shape[1], MAXIMA_LANES))
    pending = order
    expected = EXPECTED
    while pending.size:
        again = np.empty(pending.size, np.int64)
        count = 0
        for first in range(0, pending.size, MAXIMA_LANES):
            # Fill a block, the last one with copies of its last oscillator
            chosen = pending[first : first + MAXIMA_LANES]
            for lane in range(MAXIMA_LANES):
                index = chosen[min(lane, chosen.size - 1)]
                phase, damping, to_north, to_east = oscillators[:, index]
                pack_oscillator(stride, phase, damping, to_north, to_east, table, lane)
                floors[lane] = (
                    expected * min(1.0, phase / SOFT_PHASE) * _peak(groups, to_north, to_east)
                )
            # Compute the part of the record that the expected displacements ask for
            _run(
                stride, north, east, limits, groups, width, table, checkpoints, floors, bounds, best
            )
            # Store the results; oscillators below their expected displacement come again
            for lane in range(chosen.size):
                if best[1, lane] >= floors[lane]:
                    largest[0, chosen[lane]] = best[0, lane]
                    largest[1, chosen[lane]] = best[1, lane]
                else:
                    again[count] = chosen[lane]
                    count += 1
        # Second round: no displacement is expected, so the whole record is computed
        pending = again[:count]
        expected = 0.0


@kernel
def _peak(groups, north, east):
    """Return a bound of the acceleration along an azimuth."""
    peak = 0.0
    for group in range(groups.shape[1]):
        peak = max(peak, abs(north) * groups[0, group] + abs(east) * groups[1, group])
    return peak


@kernel
def _run(stride, north, east, limits, groups, width, table, checkpoints, floors, bounds, best):
    """Fill the largest values (2, lanes) of a block, from the part of the record that counts."""
    # Windows of the oscillators in groups, and the tiles that they span together
    tiles = limits.shape[1]
    windows = np.empty((3, MAXIMA_LANES))
    find_windows(groups, TILE * width, table, floors, bounds, windows)
    begin, end = tiles, 0
    counted, oscillators = np.empty((2, MAXIMA_LANES)), np.empty((4, MAXIMA_LANES))
    for lane in range(MAXIMA_LANES):
        # From groups to tiles
        windows[0, lane] *= width
        counted[0, lane] = windows[1, lane] * width
        counted[1, lane] = (windows[2, lane] + 1.0) * width - 1.0
        begin, end = min(begin, int(windows[0, lane])), max(end, int(counted[1, lane] + 1.0))
        # Numbers for the search between samples
        oscillators[0, lane], oscillators[1, lane] = table[PHASE, lane], table[DAMPING, lane]
        oscillators[2, lane] = table[WEIGHTS, lane]
        oscillators[3, lane] = table[WEIGHTS + 1, lane]
    end = min(end, tiles)
    best[:] = 0.0
    # Stretch by stretch: first the samples, then the peaks between them
    for stretch in range(begin - begin % STRETCH_TILES, end, STRETCH_TILES):
        first = max(begin, stretch)
        last = min(end, stretch + STRETCH_TILES)
        samples = slice(first * TILE, last * TILE + 1)
        run_strides(stride, north[samples], east[samples], first, windows[0], table, checkpoints)
        raise_between_samples(
            stride,
            north[samples],
            east[samples],
            limits[:, first:last],
            oscillators,
            first,
            counted,
            checkpoints,
            best,
        )
    if end == tiles:
        _ring_down(table, best)


@kernel
def _ring_down(table, best):
    """Raise the largest displacements to those of the free vibration from the last states on."""
    for lane in range(MAXIMA_LANES):
        u, z, damping = table[0, lane], table[1, lane], table[DAMPING, lane]
        # The radius never grows: only it can rule the free vibration out
        if math.hypot(u, z) > best[1, lane]:
            phase = first_root(z, -2.0 * damping * z - u, damping)
            impulse, _, integral_1, _ = unit_responses(phase, damping)
            best[1, lane] = max(best[1, lane], abs(u * (1.0 - integral_1) + z * impulse))
