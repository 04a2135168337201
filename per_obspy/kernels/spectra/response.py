r"""
Largest radius, displacement, velocity and absolute acceleration of a block of oscillators.

Each oscillator is driven by its own combination of two components of ground acceleration (its
azimuth). Displacements are counted in ``a / omega²``, time as phase; the absolute acceleration is
then ``u + 2 xi z``.
"""

import math

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step_coefficients, unit_responses
from per_obspy.kernels.spectra.tile_search import LANES, SMALLEST_STATE, TILE

#: Rows of packed oscillators: state (2), input, two weights, twice the damping, eight coefficients.
ROWS = 14


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
        Receives state ``u, z`` and acceleration (zero), both weights, twice the damping, and the
        eight coefficients of a step.
    """
    for lane in range(LANES):
        packed[0, lane] = 0.0
        packed[1, lane] = 0.0
        packed[2, lane] = 0.0
        packed[3, lane] = weights[0, lane]
        packed[4, lane] = weights[1, lane]
        packed[5, lane] = 2.0 * dampings[lane]
        # Coefficients of a step (Nigam & Jennings)
        coefficients = step_coefficients(1.0, dampings[lane], phases[lane])
        for row, coefficient in enumerate(coefficients):
            packed[6 + row, lane] = coefficient


@kernel
def _open_tile(u, z, viscosity, square, displacement, velocity, absolute, checkpoint):
    """Store the states before a tile and start its largest values with theirs."""
    for lane in range(LANES):
        # Denormal states become zero
        u[lane] = u[lane] if abs(u[lane]) > SMALLEST_STATE else 0.0
        z[lane] = z[lane] if abs(z[lane]) > SMALLEST_STATE else 0.0
        checkpoint[0, lane], checkpoint[1, lane] = u[lane], z[lane]
        square[lane] = u[lane] * u[lane] + z[lane] * z[lane]
        displacement[lane], velocity[lane] = abs(u[lane]), abs(z[lane])
        absolute[lane] = abs(u[lane] + viscosity[lane] * z[lane])


@kernel
def _close_tile(square, displacement, velocity, absolute, checkpoint):
    """Store the largest values of a tile."""
    for lane in range(LANES):
        checkpoint[2, lane], checkpoint[3, lane] = square[lane], displacement[lane]
        checkpoint[4, lane], checkpoint[5, lane] = velocity[lane], absolute[lane]


@kernel
def run_response_tiles(north, east, packed, checkpoints):
    """
    Advance a block over the samples; store a checkpoint per tile.

    Parameters
    ----------
    north, east : (tiles * TILE + 1,) ndarray
        Components of the ground acceleration, scaled to a peak of order one.
    packed : (ROWS, LANES) ndarray
        Rows from `pack_response`; the state in the first three is advanced to the last sample.
    checkpoints : (TILES, 6, LANES) ndarray
        Receives, per tile, the state ``u, z`` before it (2 rows) and the largest ``u² + z²``,
        ``|u|``, ``|z|`` and ``|u + 2 xi z|`` at its samples, in the unit of the acceleration (over
        ``omega²``) or its square.
    """
    # Local copies of a size that the compiler knows: it makes vectors
    u, z, p = packed[0].copy(), packed[1].copy(), packed[2].copy()
    square, displacement = packed[3].copy(), packed[3].copy()
    velocity, absolute = packed[3].copy(), packed[3].copy()
    to_north, to_east, viscosity = packed[3].copy(), packed[4].copy(), packed[5].copy()
    # Coefficients of a step
    a11, a12, a21, a22 = packed[6].copy(), packed[7].copy(), packed[8].copy(), packed[9].copy()
    b11, b12, b21, b22 = packed[10].copy(), packed[11].copy(), packed[12].copy(), packed[13].copy()
    for first in range(0, north.size - 1, TILE):
        # Start of a tile, with the acceleration along each azimuth at its first sample
        for lane in range(LANES):
            p[lane] = to_north[lane] * north[first] + to_east[lane] * east[first]
        _open_tile(
            u, z, viscosity, square, displacement, velocity, absolute, checkpoints[first // TILE]
        )
        for i in range(first + 1, first + TILE + 1, 4):
            # Samples of four steps, of both components
            north_1, north_2, north_3, north_4 = north[i], north[i + 1], north[i + 2], north[i + 3]
            east_1, east_2, east_3, east_4 = east[i], east[i + 1], east[i + 2], east[i + 3]
            for lane in range(LANES):
                # Acceleration along the azimuth
                u0, z0, p0 = u[lane], z[lane], p[lane]
                p1 = to_north[lane] * north_1 + to_east[lane] * east_1
                p2 = to_north[lane] * north_2 + to_east[lane] * east_2
                p3 = to_north[lane] * north_3 + to_east[lane] * east_3
                p4 = to_north[lane] * north_4 + to_east[lane] * east_4
                # First step (Nigam & Jennings)
                u1 = a11[lane] * u0 + (a12[lane] * z0 + (b11[lane] * p0 + b12[lane] * p1))
                z1 = a21[lane] * u0 + (a22[lane] * z0 + (b21[lane] * p0 + b22[lane] * p1))
                # Second step
                u2 = a11[lane] * u1 + (a12[lane] * z1 + (b11[lane] * p1 + b12[lane] * p2))
                z2 = a21[lane] * u1 + (a22[lane] * z1 + (b21[lane] * p1 + b22[lane] * p2))
                # Third step
                u3 = a11[lane] * u2 + (a12[lane] * z2 + (b11[lane] * p2 + b12[lane] * p3))
                z3 = a21[lane] * u2 + (a22[lane] * z2 + (b21[lane] * p2 + b22[lane] * p3))
                # Fourth step
                u4 = a11[lane] * u3 + (a12[lane] * z3 + (b11[lane] * p3 + b12[lane] * p4))
                z4 = a21[lane] * u3 + (a22[lane] * z3 + (b21[lane] * p3 + b22[lane] * p4))
                u[lane], z[lane], p[lane] = u4, z4, p4
                # Largest squared radius
                early = max(u1 * u1 + z1 * z1, u2 * u2 + z2 * z2)
                late = max(u3 * u3 + z3 * z3, u4 * u4 + z4 * z4)
                square[lane] = max(square[lane], early, late)
                # Largest displacement
                early = max(abs(u1), abs(u2))
                late = max(abs(u3), abs(u4))
                displacement[lane] = max(displacement[lane], early, late)
                # Largest velocity
                early = max(abs(z1), abs(z2))
                late = max(abs(z3), abs(z4))
                velocity[lane] = max(velocity[lane], early, late)
                # Largest absolute acceleration
                early = max(abs(u1 + viscosity[lane] * z1), abs(u2 + viscosity[lane] * z2))
                late = max(abs(u3 + viscosity[lane] * z3), abs(u4 + viscosity[lane] * z4))
                absolute[lane] = max(absolute[lane], early, late)
        _close_tile(square, displacement, velocity, absolute, checkpoints[first // TILE])
    # State for the next stretch of the record
    for lane in range(LANES):
        packed[0, lane], packed[1, lane], packed[2, lane] = u[lane], z[lane], p[lane]


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
