r"""
Blocks of oscillators that are looked at after every stride of 1, 2 or 4 steps.

Over several steps of a piecewise-linear record the state is the power of the step's matrix times
the state before, plus a weighted sum of the samples in between, so that slow oscillators need not
be looked at after every step. Time runs outside, oscillators inside, four or eight steps at a time:
fewer take longer, more need more registers than there are. Displacements are counted in ``a /
omega²``, time as phase.
"""

from per_obspy.kernels._aligned import aligned_line, store_line
from per_obspy.kernels._jit import kernel, vectorised
from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.spectra.tile_search import SMALLEST_STATE, TILE

#: Oscillators next to each other that have a window each: a constant trip count, which the compiler
#: turns into vectors.
MAXIMA_LANES = 32
#: Rows of a block's table, one column per oscillator: displacement and velocity (0, 1), its own
#: acceleration (2); weights of both components; largest squared radius and displacement of a tile
#: (5, 6); the matrix of a stride, and the weights of its samples in displacement and in velocity;
#: phase of a step, and damping. One table, because the compiler would
#: have to prove of several arrays that they do not overlap.
WEIGHTS, MATRIX, DISPLACED, MOVED, PHASE, DAMPING, OSCILLATOR_ROWS = 3, 7, 11, 16, 21, 22, 23
#: Rows that a step uses: where each begins in one line of memory; the weights of the samples of a
#: stride follow each other.
U, Z, P, NORTH, EAST, LARGEST_SQUARE, LARGEST = (row * MAXIMA_LANES for row in range(MATRIX))
A11, A12, A21, A22, F = (row * MAXIMA_LANES for row in range(MATRIX, DISPLACED + 1))
G = MOVED * MAXIMA_LANES
#: Rows of a tile's checkpoint: the state before the tile (0, 1), the largest squared radius and
#: displacement of the samples looked at.
SQUARE, DISPLACEMENT, CHECKPOINT_ROWS = 2, 3, 4


@kernel
def pack_oscillator(stride, phase, damping, north, east, table, lane):
    """Fill the rows of an oscillator at rest, which is looked at after every stride."""
    for row in range(PHASE):
        table[row, lane] = 0.0
    table[WEIGHTS, lane], table[WEIGHTS + 1, lane] = north, east
    table[PHASE, lane], table[DAMPING, lane] = phase, damping
    # Matrix of a whole stride, and the weights of its samples
    coefficients = step_coefficients(1.0, damping, phase)
    matrix = step_coefficients(1.0, damping, stride * phase)
    for row in range(4):
        table[MATRIX + row, lane] = matrix[row]
    displaced, moved = table[DISPLACED:MOVED, lane], table[MOVED:PHASE, lane]
    fill_stride_weights(coefficients, stride, displaced, moved)


@kernel
def fill_stride_weights(coefficients, stride, displaced, moved):
    """
    Fill the weights of a stride's samples in the displacement and in the velocity at its end.

    The state after the stride is the matrix of a step of that length times the state before it,
    plus the weighted samples, those at both ends included. The weights are zero before;
    ``coefficients`` of one step are those of `exact_step.step_coefficients`.
    """
    a11, a12, a21, a22, b11, b12, b21, b22 = coefficients
    for sample in range(stride):
        # Weights of a step, moved on by the steps after it
        for earlier in range(sample + 1):
            u, z = displaced[earlier], moved[earlier]
            displaced[earlier], moved[earlier] = a11 * u + a12 * z, a21 * u + a22 * z
        # The step itself: its first sample was the last one of the step before
        displaced[sample] += b11
        moved[sample] += b21
        displaced[sample + 1], moved[sample + 1] = b12, b22


@kernel
def _open_tile(north, east, tile, starts, t, checkpoint):
    """Store the states before a tile and start its largest values with theirs."""
    for lane in range(MAXIMA_LANES):
        # Denormal states, and those before the start of the oscillator, become zero
        u = t[U + lane] if abs(t[U + lane]) > SMALLEST_STATE and tile > starts[lane] else 0.0
        z = t[Z + lane] if abs(t[Z + lane]) > SMALLEST_STATE and tile > starts[lane] else 0.0
        t[U + lane], t[Z + lane] = u, z
        t[P + lane] = t[NORTH + lane] * north + t[EAST + lane] * east
        # Largest values begin with those of the state
        t[LARGEST_SQUARE + lane], t[LARGEST + lane] = u * u + z * z, abs(u)
        checkpoint[0, lane], checkpoint[1, lane] = u, z


def _stride_kernel(stride, steps):
    """
    Return the kernel that advances a block over whole tiles, so many steps at a time.

    A stride of 8 is written out in `spectra/radius.py`: this form takes 1.2 times as long there.
    """
    strides = steps // stride

    @vectorised
    def run(north, east, begin, starts, t, checkpoints):
        for first in range(0, north.size - 1, TILE):
            tile = first // TILE
            _open_tile(north[first], east[first], begin + tile, starts, t, checkpoints[tile])
            for i in range(first, first + TILE, steps):
                for lane in range(MAXIMA_LANES):
                    # State before the strides, and the largest values so far
                    u, z, p = t[U + lane], t[Z + lane], t[P + lane]
                    square, largest = t[LARGEST_SQUARE + lane], t[LARGEST + lane]
                    for number in range(strides):
                        # Weighted samples of a stride in displacement (f) and in velocity (g)
                        f, g = t[F + lane] * p, t[G + lane] * p
                        for k in range(1, stride + 1):
                            sample, row = i + number * stride + k, k * MAXIMA_LANES + lane
                            # Acceleration along the oscillator's azimuth
                            p = t[NORTH + lane] * north[sample] + t[EAST + lane] * east[sample]
                            f, g = f + t[F + row] * p, g + t[G + row] * p
                        # State after the stride
                        u, z = (
                            t[A11 + lane] * u + (t[A12 + lane] * z + f),
                            t[A21 + lane] * u + (t[A22 + lane] * z + g),
                        )
                        square, largest = max(square, u * u + z * z), max(largest, abs(u))
                    t[U + lane], t[Z + lane], t[P + lane] = u, z, p
                    t[LARGEST_SQUARE + lane], t[LARGEST + lane] = square, largest
            # Largest values of the tile
            for lane in range(MAXIMA_LANES):
                checkpoints[tile, SQUARE, lane] = t[LARGEST_SQUARE + lane]
                checkpoints[tile, DISPLACEMENT, lane] = t[LARGEST + lane]

    return run


_by_four, _by_two, _by_one = _stride_kernel(4, 8), _stride_kernel(2, 4), _stride_kernel(1, 4)


@kernel
def run_strides(stride, north, east, begin, starts, table, checkpoints):
    """Advance a block of `MAXIMA_LANES` oscillators, each along its azimuth."""
    # In one line with places that the compiler knows: it makes vectors
    t = aligned_line(table, PHASE, MAXIMA_LANES)
    if stride == 4:
        _by_four(north, east, begin, starts, t, checkpoints)
    elif stride == 2:
        _by_two(north, east, begin, starts, t, checkpoints)
    else:
        _by_one(north, east, begin, starts, t, checkpoints)
    # States at the end, for the next stretch
    store_line(t, table, PHASE)
