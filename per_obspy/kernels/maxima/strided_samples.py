r"""
Displacement and radius of a block of oscillators at every sample, every second or every fourth one.

Over several steps of a piecewise-linear record the state is the power of the step's matrix times
the state before, plus a weighted sum of the samples in between, so that slow oscillators need not
be looked at after every step. Time runs outside, oscillators inside, four or eight steps at a time:
fewer take longer, more need more registers than there are. Displacements are counted in ``a /
omega²``, time as phase.
"""

from per_obspy.kernels._aligned import aligned
from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.oscillator.exact_stride import fill_stride_weights
from per_obspy.kernels.spectra.tile_search import SMALLEST_STATE, TILE

#: Oscillators next to each other: a constant trip count, which the compiler turns into vectors.
MAXIMA_LANES = 32
#: Rows of a block's table, one column per oscillator: displacement and velocity (0, 1), its own
#: acceleration (2); weights of both components; largest squared radius and displacement of a tile
#: (5, 6); the matrix of a stride, and the weights of its samples in displacement and in velocity;
#: phase of a step, damping, and the coefficients of a step. One table, because the compiler would
#: have to prove of several arrays that they do not overlap.
WEIGHTS, MATRIX, DISPLACED, MOVED, PHASE, DAMPING, STEP = 3, 7, 11, 16, 21, 22, 23
OSCILLATOR_ROWS = 31
#: Rows that a step uses.
LOCAL = PHASE
#: Rows of a tile's checkpoint: the state before the tile (0, 1), the largest squared radius and
#: displacement of the samples looked at.
SQUARE, DISPLACEMENT, CHECKPOINT_ROWS = 2, 3, 4


@kernel
def pack_oscillator(stride, phase, damping, north, east, table, lane):
    """Fill the rows of an oscillator at rest, which is looked at every 1, 2 or 4 steps."""
    table[:, lane] = 0.0
    table[WEIGHTS, lane] = north
    table[WEIGHTS + 1, lane] = east
    table[PHASE, lane] = phase
    table[DAMPING, lane] = damping
    # Coefficients of one step, and the matrix of a whole stride
    coefficients = step_coefficients(1.0, damping, phase)
    stride_coefficients = step_coefficients(1.0, damping, stride * phase)
    for row in range(8):
        table[STEP + row, lane] = coefficients[row]
    for row in range(4):
        table[MATRIX + row, lane] = stride_coefficients[row]
    # Weights of the samples of a stride
    displaced, moved = table[DISPLACED:MOVED, lane], table[MOVED:PHASE, lane]
    fill_stride_weights(coefficients, stride, displaced[: stride + 1], moved[: stride + 1])


@kernel
def run_strides(stride, north, east, begin, starts, table, checkpoints):
    """
    Advance a block over whole tiles; store the state before each and its largest values.

    Oscillators are at rest before the tile ``starts`` (lanes,); ``begin`` is the number of the
    first tile of ``north`` and ``east``.
    """
    if stride == 4:
        _run_by_four(north, east, begin, starts, table, checkpoints)
    elif stride == 2:
        _run_by_two(north, east, begin, starts, table, checkpoints)
    else:
        _run_by_one(north, east, begin, starts, table, checkpoints)


@kernel
def _open_tile(north, east, tile, starts, t, checkpoint):
    """Store the states before a tile and start its largest values with theirs."""
    for lane in range(MAXIMA_LANES):
        # Denormal states, and those before the start of the oscillator, become zero
        u = t[0, lane] if abs(t[0, lane]) > SMALLEST_STATE and tile > starts[lane] else 0.0
        z = t[1, lane] if abs(t[1, lane]) > SMALLEST_STATE and tile > starts[lane] else 0.0
        t[0, lane], t[1, lane], t[2, lane] = u, z, t[3, lane] * north + t[4, lane] * east
        # Largest values begin with those of the state
        t[5, lane], t[6, lane] = u * u + z * z, abs(u)
        checkpoint[0, lane], checkpoint[1, lane] = u, z


@kernel
def _close_tile(t, checkpoint):
    """Store the largest values of a tile."""
    for lane in range(MAXIMA_LANES):
        checkpoint[SQUARE, lane], checkpoint[DISPLACEMENT, lane] = t[5, lane], t[6, lane]


@kernel
def _run_by_four(north, east, begin, starts, table, checkpoints):
    """Look at every fourth step."""
    t = aligned(LOCAL, MAXIMA_LANES)  # of a size that the compiler knows: it makes vectors
    t[:] = table[:LOCAL]
    for first in range(0, north.size - 1, TILE):
        tile = first // TILE
        _open_tile(north[first], east[first], begin + tile, starts, t, checkpoints[tile])
        for i in range(first + 1, first + TILE + 1, 8):
            # Samples of eight steps, of both components
            north_1, north_2, north_3, north_4 = north[i], north[i + 1], north[i + 2], north[i + 3]
            north_5, north_6 = north[i + 4], north[i + 5]
            north_7, north_8 = north[i + 6], north[i + 7]
            east_1, east_2, east_3, east_4 = east[i], east[i + 1], east[i + 2], east[i + 3]
            east_5, east_6, east_7, east_8 = east[i + 4], east[i + 5], east[i + 6], east[i + 7]
            for lane in range(MAXIMA_LANES):
                # Acceleration along the oscillator's azimuth: the first four steps
                p1 = t[3, lane] * north_1 + t[4, lane] * east_1
                p2 = t[3, lane] * north_2 + t[4, lane] * east_2
                p3 = t[3, lane] * north_3 + t[4, lane] * east_3
                p4 = t[3, lane] * north_4 + t[4, lane] * east_4
                # The same for the last four steps
                p5 = t[3, lane] * north_5 + t[4, lane] * east_5
                p6 = t[3, lane] * north_6 + t[4, lane] * east_6
                p7 = t[3, lane] * north_7 + t[4, lane] * east_7
                p8 = t[3, lane] * north_8 + t[4, lane] * east_8
                # Two strides of four steps
                u4, z4 = _by_four(t, lane, t[0, lane], t[1, lane], t[2, lane], p1, p2, p3, p4)
                u8, z8 = _by_four(t, lane, u4, z4, p4, p5, p6, p7, p8)
                t[0, lane], t[1, lane], t[2, lane] = u8, z8, p8
                # Largest squared radius and displacement
                t[5, lane] = max(t[5, lane], u4 * u4 + z4 * z4, u8 * u8 + z8 * z8)
                t[6, lane] = max(t[6, lane], abs(u4), abs(u8))
        _close_tile(t, checkpoints[tile])
    # States at the end, for the next stretch
    table[:LOCAL] = t


@kernel
def _by_four(t, lane, u, z, p0, p1, p2, p3, p4):
    """Return the state four steps later."""
    # Weighted samples of the stride in displacement (f) and in velocity (g)
    f = (t[11, lane] * p0 + t[12, lane] * p1) + (
        t[13, lane] * p2 + (t[14, lane] * p3 + t[15, lane] * p4)
    )
    g = (t[16, lane] * p0 + t[17, lane] * p1) + (
        t[18, lane] * p2 + (t[19, lane] * p3 + t[20, lane] * p4)
    )
    return t[7, lane] * u + (t[8, lane] * z + f), t[9, lane] * u + (t[10, lane] * z + g)


@kernel
def _run_by_two(north, east, begin, starts, table, checkpoints):
    """Look at every second step."""
    t = aligned(LOCAL, MAXIMA_LANES)  # of a size that the compiler knows: it makes vectors
    t[:] = table[:LOCAL]
    for first in range(0, north.size - 1, TILE):
        tile = first // TILE
        _open_tile(north[first], east[first], begin + tile, starts, t, checkpoints[tile])
        for i in range(first + 1, first + TILE + 1, 4):
            # Samples of four steps, of both components
            north_1, north_2, north_3, north_4 = north[i], north[i + 1], north[i + 2], north[i + 3]
            east_1, east_2, east_3, east_4 = east[i], east[i + 1], east[i + 2], east[i + 3]
            for lane in range(MAXIMA_LANES):
                # Acceleration along the oscillator's azimuth
                p1 = t[3, lane] * north_1 + t[4, lane] * east_1
                p2 = t[3, lane] * north_2 + t[4, lane] * east_2
                p3 = t[3, lane] * north_3 + t[4, lane] * east_3
                p4 = t[3, lane] * north_4 + t[4, lane] * east_4
                # Two strides of two steps
                u2, z2 = _by_two(t, lane, t[0, lane], t[1, lane], t[2, lane], p1, p2)
                u4, z4 = _by_two(t, lane, u2, z2, p2, p3, p4)
                t[0, lane], t[1, lane], t[2, lane] = u4, z4, p4
                # Largest squared radius and displacement
                t[5, lane] = max(t[5, lane], u2 * u2 + z2 * z2, u4 * u4 + z4 * z4)
                t[6, lane] = max(t[6, lane], abs(u2), abs(u4))
        _close_tile(t, checkpoints[tile])
    # States at the end, for the next stretch
    table[:LOCAL] = t


@kernel
def _by_two(t, lane, u, z, p0, p1, p2):
    """Return the state two steps later."""
    # Weighted samples of the stride in displacement (f) and in velocity (g)
    f = t[11, lane] * p0 + (t[12, lane] * p1 + t[13, lane] * p2)
    g = t[16, lane] * p0 + (t[17, lane] * p1 + t[18, lane] * p2)
    return t[7, lane] * u + (t[8, lane] * z + f), t[9, lane] * u + (t[10, lane] * z + g)


@kernel
def _run_by_one(north, east, begin, starts, table, checkpoints):
    """Look at every step."""
    t = aligned(LOCAL, MAXIMA_LANES)  # of a size that the compiler knows: it makes vectors
    t[:] = table[:LOCAL]
    for first in range(0, north.size - 1, TILE):
        tile = first // TILE
        _open_tile(north[first], east[first], begin + tile, starts, t, checkpoints[tile])
        for i in range(first + 1, first + TILE + 1, 4):
            # Samples of four steps, of both components
            north_1, north_2, north_3, north_4 = north[i], north[i + 1], north[i + 2], north[i + 3]
            east_1, east_2, east_3, east_4 = east[i], east[i + 1], east[i + 2], east[i + 3]
            for lane in range(MAXIMA_LANES):
                # Acceleration along the oscillator's azimuth
                p1 = t[3, lane] * north_1 + t[4, lane] * east_1
                p2 = t[3, lane] * north_2 + t[4, lane] * east_2
                p3 = t[3, lane] * north_3 + t[4, lane] * east_3
                p4 = t[3, lane] * north_4 + t[4, lane] * east_4
                # Four steps
                u1, z1 = _by_one(t, lane, t[0, lane], t[1, lane], t[2, lane], p1)
                u2, z2 = _by_one(t, lane, u1, z1, p1, p2)
                u3, z3 = _by_one(t, lane, u2, z2, p2, p3)
                u4, z4 = _by_one(t, lane, u3, z3, p3, p4)
                t[0, lane], t[1, lane], t[2, lane] = u4, z4, p4
                # Largest squared radius
                early = max(u1 * u1 + z1 * z1, u2 * u2 + z2 * z2)
                late = max(u3 * u3 + z3 * z3, u4 * u4 + z4 * z4)
                t[5, lane] = max(t[5, lane], early, late)
                # Largest displacement
                early = max(abs(u1), abs(u2))
                late = max(abs(u3), abs(u4))
                t[6, lane] = max(t[6, lane], early, late)
        _close_tile(t, checkpoints[tile])
    # States at the end, for the next stretch
    table[:LOCAL] = t


@kernel
def _by_one(t, lane, u, z, p0, p1):
    """Return the state one step later."""
    # Both samples of the step in displacement (f) and in velocity (g)
    f = t[11, lane] * p0 + t[12, lane] * p1
    g = t[16, lane] * p0 + t[17, lane] * p1
    return t[7, lane] * u + (t[8, lane] * z + f), t[9, lane] * u + (t[10, lane] * z + g)
