r"""
Largest radius ``sqrt(u² + (v / omega)²)`` of a block of oscillators under one ground acceleration.

Time runs outside, oscillators inside, four steps at a time. The state is rotated so that the
acceleration at the end of a step enters one axis only, shifted by that input, and scaled so that
the acceleration at the start enters the same axis with factor 1, which leaves eight multiply-adds
per step::

    s1' = a11 s1 + (a12 s2 + a);  s2' = a21 s1 + (a22 s2 + b a);  radius² = (s1' + d a')² + s2'²

A rotation keeps radii. Displacements are counted in ``a / omega²``, time as phase.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import SMALLEST_INPUT, step_coefficients
from per_obspy.kernels.spectra.tile_search import LANES, SMALLEST_STATE, TILE

#: Rows of packed oscillators: a11, a12, a21, a22, b, d; scale, cosine and sine of the rotation.
ROWS = 9


@kernel
def pack(phases, dampings, packed):
    """
    Fill the coefficients of the rotated, shifted and scaled step of each oscillator.

    Parameters
    ----------
    phases, dampings : (LANES,) ndarray
        Phase ``omega * dt`` of a step, rad; fraction of critical.
    packed : (ROWS, LANES) ndarray
        Receives the rows a11, a12, a21, a22, b, d of the module's equations, then scale, cosine and
        sine of the rotation, dimensionless.
    """
    for lane in range(LANES):
        # Rotation that turns the input at the end of a step into the first axis
        a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(
            1.0, dampings[lane], phases[lane]
        )
        size = math.hypot(b12, b22)
        c, s = b12 / size, b22 / size
        # Step matrix in the rotated axes
        packed[0, lane] = c * (a11 * c + a12 * s) + s * (a21 * c + a22 * s)
        packed[1, lane] = c * (a12 * c - a11 * s) + s * (a22 * c - a21 * s)
        packed[2, lane] = c * (a21 * c + a22 * s) - s * (a11 * c + a12 * s)
        packed[3, lane] = c * (a22 * c - a21 * s) - s * (a12 * c - a11 * s)
        # Scale: input at the start of a step, with that of the shift
        entering = packed[0, lane] * size + c * b11 + s * b21
        scale = math.copysign(max(abs(entering), SMALLEST_INPUT * size), entering)
        packed[4, lane] = (packed[2, lane] * size + c * b21 - s * b11) / scale
        packed[5, lane] = size / scale
        packed[6, lane] = scale
        packed[7, lane] = c
        packed[8, lane] = s


@kernel
def start_at_rest(acceleration, packed, state):
    """
    Fill the shifted state of oscillators at rest.

    Parameters
    ----------
    acceleration : float
        First sample of the ground acceleration, scaled.
    packed : (ROWS, LANES) ndarray
        Rows from `pack`.
    state : (2, LANES) ndarray
        Receives both parts of the shifted state, in the unit of the acceleration.
    """
    for lane in range(LANES):
        state[0, lane] = -packed[5, lane] * acceleration
        state[1, lane] = 0.0


@kernel
def run_tiles(acceleration, packed, state, checkpoints):
    """
    Advance a block over the samples; store a checkpoint per tile.

    Parameters
    ----------
    acceleration : (tiles * TILE + 1,) ndarray
        Ground acceleration, scaled to a peak of order one.
    packed : (ROWS, LANES) ndarray
        Rows from `pack`.
    state : (2, LANES) ndarray
        Shifted state before the first sample, replaced by that at the last one.
    checkpoints : (TILES, 3, LANES) ndarray
        Receives, per tile, the shifted state before it (2 rows) and the largest squared radius at
        its samples, in the squared unit of the acceleration (over ``omega⁴``).
    """
    # Local copies of a size that the compiler knows: it makes vectors
    a11, a12, a21, a22 = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    b, d = np.empty(LANES), np.empty(LANES)
    s1, s2, largest = np.empty(LANES), np.empty(LANES), np.empty(LANES)
    for lane in range(LANES):
        a11[lane], a12[lane], a21[lane] = packed[0, lane], packed[1, lane], packed[2, lane]
        a22[lane], b[lane], d[lane] = packed[3, lane], packed[4, lane], packed[5, lane]
        s1[lane], s2[lane] = state[0, lane], state[1, lane]
    for first in range(0, acceleration.size - 1, TILE):
        # Start of a tile: denormal states become zero, the largest radius is that of the state
        tile = first // TILE
        for lane in range(LANES):
            u = s1[lane] if abs(s1[lane]) > SMALLEST_STATE else 0.0
            z = s2[lane] if abs(s2[lane]) > SMALLEST_STATE else 0.0
            y = u + d[lane] * acceleration[first]
            s1[lane], s2[lane], largest[lane] = u, z, y * y + z * z
            checkpoints[tile, 0, lane], checkpoints[tile, 1, lane] = u, z
        for i in range(first, first + TILE, 4):
            # Samples of four steps
            p0, p1, p2 = acceleration[i], acceleration[i + 1], acceleration[i + 2]
            p3, p4 = acceleration[i + 3], acceleration[i + 4]
            for lane in range(LANES):
                u, z, best = s1[lane], s2[lane], largest[lane]
                # First step, s to (x, w); y undoes the shift
                x = a11[lane] * u + (a12[lane] * z + p0)
                w = a21[lane] * u + (a22[lane] * z + b[lane] * p0)
                y = x + d[lane] * p1
                best = max(best, y * y + w * w)
                # Second step, back to (u, z)
                u = a11[lane] * x + (a12[lane] * w + p1)
                z = a21[lane] * x + (a22[lane] * w + b[lane] * p1)
                y = u + d[lane] * p2
                best = max(best, y * y + z * z)
                # Third step
                x = a11[lane] * u + (a12[lane] * z + p2)
                w = a21[lane] * u + (a22[lane] * z + b[lane] * p2)
                y = x + d[lane] * p3
                best = max(best, y * y + w * w)
                # Fourth step
                u = a11[lane] * x + (a12[lane] * w + p3)
                z = a21[lane] * x + (a22[lane] * w + b[lane] * p3)
                y = u + d[lane] * p4
                best = max(best, y * y + z * z)
                # State and largest value are stored once per four steps
                s1[lane], s2[lane], largest[lane] = u, z, best
        # Undo the scale
        for lane in range(LANES):
            checkpoints[tile, 2, lane] = packed[6, lane] * packed[6, lane] * largest[lane]
    # State for the next stretch of the record
    for lane in range(LANES):
        state[0, lane], state[1, lane] = s1[lane], s2[lane]


@kernel
def states_before(acceleration, packed, checkpoints, chosen, states):
    """
    Fill displacement and velocity before the chosen tiles.

    Parameters
    ----------
    acceleration : (tiles * TILE + 1,) ndarray
        Ground acceleration, scaled to a peak of order one.
    packed : (ROWS, LANES) ndarray
        Rows from `pack`.
    checkpoints : (TILES, 3, LANES) ndarray
        From `run_tiles`.
    chosen : (count, 2) ndarray of int
        Tile and lane, from `tile_search.choose_tiles`.
    states : (count, 2) ndarray
        Receives ``u`` and ``z = v / omega``, in the unit of the acceleration (over ``omega²``).
    """
    for number in range(chosen.shape[0]):
        tile, lane = chosen[number]
        scale, c, s = packed[6, lane], packed[7, lane], packed[8, lane]
        # Undo shift and scale, then the rotation
        along = scale * (checkpoints[tile, 0, lane] + packed[5, lane] * acceleration[tile * TILE])
        across = scale * checkpoints[tile, 1, lane]
        states[number, 0], states[number, 1] = c * along - s * across, s * along + c * across
