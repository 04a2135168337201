r"""
Largest radius, displacement, velocity and absolute acceleration of a block of oscillators.

Each oscillator is driven by its own combination of two components of ground acceleration (its
azimuth). Displacements are counted in ``a / omega²``, time as phase; the absolute acceleration is
then ``u + 2 xi z``.
"""

import math

from per_obspy.kernels._aligned import aligned_line, store_line
from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step_coefficients, unit_responses
from per_obspy.kernels.spectra.tile_search import LANES, SMALLEST_STATE, TILE

#: Rows of packed oscillators: state (0, 1) and input, weights of both components, twice the
#: damping, the eight coefficients of a step, and the largest squared radius, displacement, velocity
#: and absolute acceleration of a tile.
STEP, EXTREMES, ROWS = 6, 14, 18
#: Where each begins in one line of memory.
U, Z, P, NORTH, EAST, VISCOSITY = (row * LANES for row in range(STEP))
A11, A12, A21, A22, B11, B12, B21, B22 = (row * LANES for row in range(STEP, EXTREMES))
SQUARE, DISPLACEMENT, VELOCITY, ABSOLUTE = (row * LANES for row in range(EXTREMES, ROWS))


@kernel
def pack_response(weights, phases, dampings, packed):
    """
    Fill the rows of each oscillator, which is at rest.

    Parameters
    ----------
    weights : (2, LANES) ndarray
        Factors of the north and the east component, dimensionless.
    phases, dampings : (LANES,) ndarray
        Phase ``omega * dt`` of a step, rad; fraction of critical.
    packed : (ROWS, LANES) ndarray
        Receives all rows.
    """
    packed[:] = 0.0
    for lane in range(LANES):
        packed[3, lane], packed[4, lane] = weights[0, lane], weights[1, lane]
        packed[5, lane] = 2.0 * dampings[lane]
        # Coefficients of a step (Nigam & Jennings)
        coefficients = step_coefficients(1.0, dampings[lane], phases[lane])
        for row in range(8):
            packed[STEP + row, lane] = coefficients[row]


@kernel
def _open_tile(north, east, t, checkpoint):
    """Store the states before a tile and start its largest values with theirs."""
    for lane in range(LANES):
        # Denormal states become zero
        u = t[U + lane] if abs(t[U + lane]) > SMALLEST_STATE else 0.0
        z = t[Z + lane] if abs(t[Z + lane]) > SMALLEST_STATE else 0.0
        t[U + lane], t[Z + lane] = u, z
        t[P + lane] = t[NORTH + lane] * north + t[EAST + lane] * east
        # Checkpoint and first values
        checkpoint[0, lane], checkpoint[1, lane] = u, z
        t[SQUARE + lane], t[DISPLACEMENT + lane] = u * u + z * z, abs(u)
        t[VELOCITY + lane], t[ABSOLUTE + lane] = abs(z), abs(u + t[VISCOSITY + lane] * z)


@kernel
def run_response_tiles(north, east, packed, checkpoints):
    """
    Advance a block over the samples; store a checkpoint per tile.

    Parameters
    ----------
    north, east : (tiles * TILE + 1,) ndarray
        Components of the ground acceleration, scaled to a peak of order one.
    packed : (ROWS, LANES) ndarray
        Rows from `pack_response`; the state in the first two is advanced to the last sample.
    checkpoints : (TILES, 6, LANES) ndarray
        Receives, per tile, the state ``u, z`` before it (2 rows) and the largest ``u² + z²``,
        ``|u|``, ``|z|`` and ``|u + 2 xi z|`` at its samples, in the unit of the acceleration (over
        ``omega²``) or its square.
    """
    # Of a size and with places that the compiler knows: it makes vectors
    t = aligned_line(packed, ROWS, LANES)
    for first in range(0, north.size - 1, TILE):
        tile = first // TILE
        _open_tile(north[first], east[first], t, checkpoints[tile])
        for i in range(first, first + TILE, 4):
            for lane in range(LANES):
                # State before four steps, and the largest values so far
                u, z, p, viscosity = t[U + lane], t[Z + lane], t[P + lane], t[VISCOSITY + lane]
                square, displacement = t[SQUARE + lane], t[DISPLACEMENT + lane]
                velocity, absolute = t[VELOCITY + lane], t[ABSOLUTE + lane]
                for k in range(1, 5):
                    # One step (Nigam & Jennings) under the acceleration along the azimuth
                    start = p
                    p = t[NORTH + lane] * north[i + k] + t[EAST + lane] * east[i + k]
                    f = t[B11 + lane] * start + t[B12 + lane] * p
                    g = t[B21 + lane] * start + t[B22 + lane] * p
                    u, z = (
                        t[A11 + lane] * u + (t[A12 + lane] * z + f),
                        t[A21 + lane] * u + (t[A22 + lane] * z + g),
                    )
                    # Largest values
                    square, displacement = max(square, u * u + z * z), max(displacement, abs(u))
                    velocity = max(velocity, abs(z))
                    absolute = max(absolute, abs(u + viscosity * z))
                t[U + lane], t[Z + lane], t[P + lane] = u, z, p
                t[SQUARE + lane], t[DISPLACEMENT + lane] = square, displacement
                t[VELOCITY + lane], t[ABSOLUTE + lane] = velocity, absolute
        # Largest values of the tile
        for row in range(4):
            for lane in range(LANES):
                checkpoints[tile, 2 + row, lane] = t[(EXTREMES + row) * LANES + lane]
    # State for the next stretch of the record
    store_line(t, packed, 2)


@kernel
def free_vibration(packed, dampings, largest):
    """
    Raise the largest values to those of the free vibration from the last state on.

    Parameters
    ----------
    packed : (ROWS, LANES) ndarray
        The state ``u, z`` at the end of the record in the first two rows.
    dampings : (LANES,) ndarray
        Fraction of critical.
    largest : (4, LANES) ndarray
        Largest ``u² + z²`` (left alone: it never grows), ``|u|``, ``|z|`` and ``|u + 2 xi z|``,
        raised in place, in the unit of the scaled acceleration (over ``omega²``) or its square.
    """
    for lane in range(LANES):
        u, z, damping = packed[0, lane], packed[1, lane], dampings[lane]
        viscosity = 2.0 * damping
        # First and second derivative of z
        z_1 = -viscosity * z - u
        z_2 = -viscosity * z_1 - z
        # First extremes: z = 0 for |u|, z' = 0 for |z|, z + 2 xi z' = 0 for |u + 2 xi z|
        absolute = (z + viscosity * z_1, z_1 + viscosity * z_2)
        for rate, change in ((z, z_1), (z_1, z_2), absolute):
            phase = first_root(rate, change, damping)
            impulse, slope, integral_1, _ = unit_responses(phase, damping)
            u_then = u * (1.0 - integral_1) + z * impulse
            z_then = z * slope - u * impulse
            largest[1, lane] = max(largest[1, lane], abs(u_then))
            largest[2, lane] = max(largest[2, lane], abs(z_then))
            largest[3, lane] = max(largest[3, lane], abs(u_then + viscosity * z_then))


@kernel
def first_root(start, change, damping):
    """Return the first phase at which a free vibration vanishes, by value and slope at phase 0."""
    root = math.sqrt((1.0 - damping) * (1.0 + damping))
    quadrature = change + damping * start
    return math.atan2(root * abs(start), -quadrature if start > 0.0 else quadrature) / root
