r"""
Largest radius ``sqrt(u² + (v / omega)²)`` of a block of oscillators under one ground acceleration.

Over a stride of eight steps the state is a matrix times the state before, plus a weighted sum of
the samples in between: 25 operations for eight steps, where step by step they take 80. The radius
``r`` is looked at after every stride. In between it grows by ``|a|`` per unit of phase at most, and
``r²`` exceeds the larger of two values by an eighth of their squared distance times the second
derivative at most. Tiles where both bounds allow a new largest radius are run again step by step.
Displacements are counted in ``a / omega²``, time as phase.
"""

import math

import numpy as np

from per_obspy.kernels._aligned import aligned, aligned_line
from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.oscillator.strides import fill_stride_weights
from per_obspy.kernels.spectra.tile_search import LANES, SMALLEST_STATE, TILE, raise_to_tiles

#: Steps after which the radius is looked at. The more, the fewer operations per step, and the more
#: tiles are run again: of white noise below 20 Hz with 8 an eighth, with 4 a fifteenth.
STRIDE = 8
#: Rows of a block's table, one column per oscillator: state ``u, z`` (0, 1), largest squared radius
#: (2), matrix of a stride, weights of its samples in displacement and in velocity; the eight
#: coefficients of a step. One table, because the compiler would have to prove of several arrays
#: that they do not overlap.
MATRIX, DISPLACED, MOVED = 3, 7, 16
STEP, ROWS = 25, 33
#: Rows that a stride uses, and where each begins in one line of memory.
LOCAL = STEP
U, Z, SQUARE, A11, A12, A21, A22 = (row * LANES for row in range(DISPLACED))
F0, F1, F2, F3, F4, F5, F6, F7, F8 = (row * LANES for row in range(DISPLACED, MOVED))
G0, G1, G2, G3, G4, G5, G6, G7, G8 = (row * LANES for row in range(MOVED, STEP))
#: Oscillators with which a tile is run again together: two of the widest vectors, of which one is
#: computed while the other waits for the step before.
TOGETHER = 16
#: Rows by which tiles are ruled out: radius from which a tile is looked at, and what a unit of the
#: sum of ``|a|`` takes from it, the phase of a step; bound of the radius; largest squared radius;
#: twice the damping; growth of a radius backwards over a stride.
LIMITS = 6


@kernel
def pack(phases, dampings, table):
    """
    Fill the rows of oscillators at rest.

    Parameters
    ----------
    phases, dampings : (LANES,) ndarray
        Phase ``omega * dt`` of a step, rad; fraction of critical.
    table : (ROWS, LANES) ndarray
        Receives a state of zero, matrix and weights of a stride, and the coefficients of a step.
    """
    table[:] = 0.0
    for lane in range(LANES):
        coefficients = step_coefficients(1.0, dampings[lane], phases[lane])
        stride_matrix = step_coefficients(1.0, dampings[lane], STRIDE * phases[lane])
        for row in range(8):
            table[STEP + row, lane] = coefficients[row]
        for row in range(4):
            table[MATRIX + row, lane] = stride_matrix[row]
        # Weights of the samples of a stride
        displaced, moved = table[DISPLACED:MOVED, lane], table[MOVED:STEP, lane]
        fill_stride_weights(coefficients, STRIDE, displaced, moved)


@kernel
def run_strides(acceleration, table, checkpoints):
    """
    Advance a block over whole tiles; store a checkpoint per tile.

    Parameters
    ----------
    acceleration : (tiles * TILE + 1,) ndarray
        Ground acceleration, scaled to a peak of order one.
    table : (ROWS, LANES) ndarray
        Rows from `pack`; the state is advanced to the last sample.
    checkpoints : (TILES, 3, LANES) ndarray
        Receives, per tile, the state ``u, z`` before it (2 rows) and the largest squared radius
        after its strides, in the unit of the acceleration (over ``omega²``) or its square.
    """
    # One line of memory with places that the compiler knows: it needs one pointer, not one per row
    t = aligned_line(table, LOCAL, LANES)
    for first in range(0, acceleration.size - 1, TILE):
        tile = first // TILE
        for lane in range(LANES):
            # Denormal states become zero; the largest radius begins with that of the state
            u = t[U + lane] if abs(t[U + lane]) > SMALLEST_STATE else 0.0
            z = t[Z + lane] if abs(t[Z + lane]) > SMALLEST_STATE else 0.0
            t[U + lane], t[Z + lane], t[SQUARE + lane] = u, z, u * u + z * z
            checkpoints[tile, 0, lane], checkpoints[tile, 1, lane] = u, z
        for i in range(first, first + TILE, STRIDE):
            # Samples of a stride
            p0, p1, p2 = acceleration[i], acceleration[i + 1], acceleration[i + 2]
            p3, p4, p5 = acceleration[i + 3], acceleration[i + 4], acceleration[i + 5]
            p6, p7, p8 = acceleration[i + 6], acceleration[i + 7], acceleration[i + 8]
            for lane in range(LANES):
                # Two sums each of displacement (u, f) and velocity (z, g): half as long a chain
                u0, z0 = t[U + lane], t[Z + lane]
                u = t[A11 + lane] * u0 + t[A12 + lane] * z0 + t[F0 + lane] * p0 + t[F1 + lane] * p1
                z = t[A21 + lane] * u0 + t[A22 + lane] * z0 + t[G0 + lane] * p0 + t[G1 + lane] * p1
                # The later samples of both
                f = t[F4 + lane] * p4 + t[F5 + lane] * p5 + t[F6 + lane] * p6 + t[F7 + lane] * p7
                g = t[G4 + lane] * p4 + t[G5 + lane] * p5 + t[G6 + lane] * p6 + t[G7 + lane] * p7
                u = u + t[F2 + lane] * p2 + t[F3 + lane] * p3 + (f + t[F8 + lane] * p8)
                z = z + t[G2 + lane] * p2 + t[G3 + lane] * p3 + (g + t[G8 + lane] * p8)
                # State after the stride, and its radius
                t[U + lane], t[Z + lane] = u, z
                t[SQUARE + lane] = max(t[SQUARE + lane], u * u + z * z)
        # Largest squared radius of the tile
        for lane in range(LANES):
            checkpoints[tile, 2, lane] = t[SQUARE + lane]
    # State for the next stretch of the record
    for lane in range(LANES):
        table[0, lane], table[1, lane] = t[U + lane], t[Z + lane]


@kernel
def raise_to_samples(acceleration, peaks, jumps, phases, dampings, table, checkpoints, largest):
    """
    Raise the largest squared radii to those at the samples.

    Parameters
    ----------
    acceleration : (tiles * TILE + 1,) ndarray
        Ground acceleration, scaled to a peak of order one.
    peaks, jumps : (tiles,) ndarray
        Largest absolute acceleration and change over a step, from `tile_search.tile_extremes`.
    phases, dampings : (LANES,) ndarray
        Phase ``omega * dt`` of a step, rad; fraction of critical.
    table : (ROWS, LANES) ndarray
        Rows from `pack`.
    checkpoints : (TILES, 3, LANES) ndarray
        From `run_strides`; its last row receives the largest squared radius at all samples of a
        tile, or zero where neither they nor the motion between them can exceed the largest.
    largest : (1, LANES) ndarray
        Largest squared radii, raised in place, in the squared unit of the acceleration (over
        ``omega⁴``).
    """
    # The radii looked at raise the limits of all tiles
    raise_to_tiles(checkpoints, peaks.size, largest)
    limits, marks, pushes = aligned(LIMITS, LANES), np.zeros(LANES, np.int64), np.empty(peaks.size)
    listed, group = np.zeros(LANES, np.int64), aligned(1, 11 * TOGETHER)[0]
    strongest = _fill_pushes(acceleration, pushes)
    for lane in range(LANES):
        limits[5, lane] = math.exp(STRIDE * dampings[lane] * phases[lane])
    _fill_limits(strongest, phases, dampings, largest, 0, LANES, limits)
    for tile in range(peaks.size):
        # Of most tiles no radius that was looked at comes close
        if not _any_close(checkpoints, tile, pushes[tile], limits):
            checkpoints[tile, 2, :] = 0.0
            continue
        _mark_lanes(checkpoints, tile, peaks[tile], jumps[tile], pushes[tile], limits, marks)
        count = _list_lanes(checkpoints, tile, marks, listed)
        for first in range(0, count, TOGETHER):
            # Step by step through the tile
            _open_group(table, checkpoints, tile, listed, first, count, group)
            _run_steps(acceleration, tile * TILE, group)
            for k in range(min(TOGETHER, count - first)):
                lane, square = listed[first + k], group[2 * TOGETHER + k]
                checkpoints[tile, 2, lane] = square
                if square > largest[0, lane]:
                    largest[0, lane] = square
                    _fill_limits(strongest, phases, dampings, largest, lane, 1, limits)


@kernel
def _any_close(checkpoints, tile, push, limits):
    """Return whether the radius of any lane of a tile comes close to its largest."""
    count = 0
    for lane in range(LANES):
        least = max(limits[0, lane] - limits[1, lane] * push, 0.0)
        count += checkpoints[tile, 2, lane] >= least * least
    return count > 0


@kernel
def _list_lanes(checkpoints, tile, marks, listed):
    """List the marked lanes of a tile, set the radii of the others to zero; return the number."""
    count = 0
    for lane in range(LANES):
        listed[count] = lane
        count += marks[lane]
        checkpoints[tile, 2, lane] = checkpoints[tile, 2, lane] if marks[lane] > 0 else 0.0
    return count


@kernel
def _open_group(table, checkpoints, tile, listed, first, count, group):
    """Fill state and squared radius before a tile, and the coefficients of a step."""
    for k in range(TOGETHER):
        # The last lane fills the group up
        lane = listed[min(first + k, count - 1)]
        for row in range(3):
            group[row * TOGETHER + k] = checkpoints[tile, row, lane]
        for row in range(8):
            group[(3 + row) * TOGETHER + k] = table[STEP + row, lane]


@kernel
def _fill_pushes(acceleration, pushes):
    """
    Fill the largest sum of ``|a|`` over half a stride of each tile, by the trapezoidal rule.

    Return the largest of all tiles.
    """
    strongest = 0.0
    for tile in range(pushes.size):
        pushes[tile] = 0.0
        # Every half stride of the tile
        for i in range(tile * TILE, (tile + 1) * TILE, 4):
            ends = 0.5 * (abs(acceleration[i]) + abs(acceleration[i + 4]))
            inner = abs(acceleration[i + 1]) + abs(acceleration[i + 2]) + abs(acceleration[i + 3])
            pushes[tile] = max(pushes[tile], ends + inner)
        strongest = max(strongest, pushes[tile])
    return strongest


@kernel
def _fill_limits(strongest, phases, dampings, largest, first, count, limits):
    """Fill the numbers by which tiles are ruled out, from the largest squared radii."""
    for lane in range(first, first + count):
        # Half a stride back or forth to the nearest radius that was looked at
        phase, growth, root = phases[lane], limits[5, lane], math.sqrt(largest[0, lane])
        limits[0, lane] = root / growth
        limits[1, lane] = phase
        limits[2, lane] = (root + phase * strongest) * growth
        limits[3, lane] = largest[0, lane]
        limits[4, lane] = 2.0 * dampings[lane]


@kernel
def _mark_lanes(checkpoints, tile, peak, jump, push, limits, marks):
    """Mark the lanes of which a tile may hold a new largest radius by 1."""
    for lane in range(LANES):
        square = checkpoints[tile, 2, lane]
        phase, radius, viscosity = limits[1, lane], limits[2, lane], limits[4, lane]
        least = max(limits[0, lane] - phase * push, 0.0)
        # Second derivative as in `within_step.rate_bounds`; 1 + 2 xi² exceeds sqrt(1 + 4 xi²)
        rate = phase * ((1.0 + 0.5 * viscosity * viscosity) * radius + peak)
        bend = rate * (4.0 * viscosity * radius + 2.0 * peak) + 2.0 * radius * jump
        highest = square + (0.125 * STRIDE * STRIDE) * phase * bend
        marks[lane] = (square >= least * least) & (highest > limits[3, lane])


@kernel
def _run_steps(acceleration, first, g):
    """Run a group over the samples of one tile: state, squared radius, coefficients of a step."""
    for i in range(first, first + TILE, 4):
        for lane in range(TOGETHER):
            # State, largest squared radius, and the coefficients of a step
            u, z, square = g[lane], g[TOGETHER + lane], g[2 * TOGETHER + lane]
            a11, a12 = g[3 * TOGETHER + lane], g[4 * TOGETHER + lane]
            a21, a22 = g[5 * TOGETHER + lane], g[6 * TOGETHER + lane]
            b11, b12 = g[7 * TOGETHER + lane], g[8 * TOGETHER + lane]
            b21, b22 = g[9 * TOGETHER + lane], g[10 * TOGETHER + lane]
            # Four steps (Nigam & Jennings)
            for k in range(i, i + 4):
                start, end = acceleration[k], acceleration[k + 1]
                u, z = (
                    a11 * u + (a12 * z + (b11 * start + b12 * end)),
                    a21 * u + (a22 * z + (b21 * start + b22 * end)),
                )
                square = max(square, u * u + z * z)
            # State for the next four
            g[lane], g[TOGETHER + lane], g[2 * TOGETHER + lane] = u, z, square
