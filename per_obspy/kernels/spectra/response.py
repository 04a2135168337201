r"""
Largest radius, displacement, velocity and absolute acceleration of a block of oscillators side by side.

Each oscillator feels its own combination of two components of ground acceleration (its azimuth).
Displacements are counted in ``a / omega²``, time as phase; the absolute acceleration is then ``u +
2 xi z``.
"""

import math

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import step, unit_responses
from per_obspy.kernels.spectra.blocks import LANES, SMALLEST_STATE, TILE

#: State, input, two weights, twice the damping, eight coefficients: one row each.
ROWS = 14


@kernel
def pack_response(weights, phases, dampings, packed):
    """Fill the rows of each oscillator, which is at rest."""
    for lane in range(LANES):
        packed[0, lane], packed[1, lane], packed[2, lane] = 0.0, 0.0, 0.0
        packed[3, lane], packed[4, lane], packed[5, lane] = (
            weights[0, lane],
            weights[1, lane],
            2.0 * dampings[lane],
        )
        for row, coefficient in enumerate(step(1.0, dampings[lane], phases[lane])):
            packed[6 + row, lane] = coefficient


@kernel
def _open_tile(u, z, twice, square, displacement, velocity, felt, kept):
    """Keep the states before a tile and start its largest values with theirs."""
    for lane in range(LANES):
        u[lane] = u[lane] if abs(u[lane]) > SMALLEST_STATE else 0.0
        z[lane] = z[lane] if abs(z[lane]) > SMALLEST_STATE else 0.0
        kept[0, lane], kept[1, lane] = u[lane], z[lane]
        square[lane] = u[lane] * u[lane] + z[lane] * z[lane]
        displacement[lane], velocity[lane] = abs(u[lane]), abs(z[lane])
        felt[lane] = abs(u[lane] + twice[lane] * z[lane])


@kernel
def _close_tile(square, displacement, velocity, felt, kept):
    """Keep the largest values of a tile."""
    for lane in range(LANES):
        kept[2, lane], kept[3, lane] = square[lane], displacement[lane]
        kept[4, lane], kept[5, lane] = velocity[lane], felt[lane]


@kernel
def run_response_tiles(north, east, packed, kept):
    """Advance a block; keep, per tile, the state before it and the largest ``u² + z², |u|, |z|, |u + 2 xi z|``."""
    u, z, p = packed[0].copy(), packed[1].copy(), packed[2].copy()
    square, displacement, velocity, felt = (
        packed[3].copy(),
        packed[3].copy(),
        packed[3].copy(),
        packed[3].copy(),
    )
    to_north, to_east, twice = packed[3].copy(), packed[4].copy(), packed[5].copy()
    a11, a12, a21, a22 = packed[6].copy(), packed[7].copy(), packed[8].copy(), packed[9].copy()
    b11, b12, b21, b22 = packed[10].copy(), packed[11].copy(), packed[12].copy(), packed[13].copy()
    for first in range(0, north.size - 1, TILE):
        for lane in range(LANES):
            p[lane] = to_north[lane] * north[first] + to_east[lane] * east[first]
        _open_tile(u, z, twice, square, displacement, velocity, felt, kept[first // TILE])
        for i in range(first + 1, first + TILE + 1, 4):
            north_1, north_2, north_3, north_4 = north[i], north[i + 1], north[i + 2], north[i + 3]
            east_1, east_2, east_3, east_4 = east[i], east[i + 1], east[i + 2], east[i + 3]
            for lane in range(LANES):
                u0, z0, p0 = u[lane], z[lane], p[lane]
                p1 = to_north[lane] * north_1 + to_east[lane] * east_1
                p2 = to_north[lane] * north_2 + to_east[lane] * east_2
                p3 = to_north[lane] * north_3 + to_east[lane] * east_3
                p4 = to_north[lane] * north_4 + to_east[lane] * east_4
                u1 = a11[lane] * u0 + (a12[lane] * z0 + (b11[lane] * p0 + b12[lane] * p1))
                z1 = a21[lane] * u0 + (a22[lane] * z0 + (b21[lane] * p0 + b22[lane] * p1))
                u2 = a11[lane] * u1 + (a12[lane] * z1 + (b11[lane] * p1 + b12[lane] * p2))
                z2 = a21[lane] * u1 + (a22[lane] * z1 + (b21[lane] * p1 + b22[lane] * p2))
                u3 = a11[lane] * u2 + (a12[lane] * z2 + (b11[lane] * p2 + b12[lane] * p3))
                z3 = a21[lane] * u2 + (a22[lane] * z2 + (b21[lane] * p2 + b22[lane] * p3))
                u4 = a11[lane] * u3 + (a12[lane] * z3 + (b11[lane] * p3 + b12[lane] * p4))
                z4 = a21[lane] * u3 + (a22[lane] * z3 + (b21[lane] * p3 + b22[lane] * p4))
                u[lane], z[lane], p[lane] = u4, z4, p4
                early, late = (
                    max(u1 * u1 + z1 * z1, u2 * u2 + z2 * z2),
                    max(u3 * u3 + z3 * z3, u4 * u4 + z4 * z4),
                )
                square[lane] = max(square[lane], early, late)
                early, late = max(abs(u1), abs(u2)), max(abs(u3), abs(u4))
                displacement[lane] = max(displacement[lane], early, late)
                early, late = max(abs(z1), abs(z2)), max(abs(z3), abs(z4))
                velocity[lane] = max(velocity[lane], early, late)
                early = max(abs(u1 + twice[lane] * z1), abs(u2 + twice[lane] * z2))
                late = max(abs(u3 + twice[lane] * z3), abs(u4 + twice[lane] * z4))
                felt[lane] = max(felt[lane], early, late)
        _close_tile(square, displacement, velocity, felt, kept[first // TILE])
    for lane in range(LANES):
        packed[0, lane], packed[1, lane], packed[2, lane] = u[lane], z[lane], p[lane]


@kernel
def free_vibration(packed, dampings, largest):
    """Raise the largest ``|u|, |z|, |u + 2 xi z|`` to those of the free vibration from the last state on."""
    for lane in range(LANES):
        u, z, damping = packed[0, lane], packed[1, lane], dampings[lane]
        twice = 2.0 * damping
        z_1 = -twice * z - u  # first and second derivative of z
        z_2 = -twice * z_1 - z
        for rate, change in ((z, z_1), (z_1, z_2), (z + twice * z_1, z_1 + twice * z_2)):
            phase = first_root(rate, change, damping)
            impulse, slope, once, _ = unit_responses(phase, damping)
            u_then, z_then = u * (1.0 - once) + z * impulse, z * slope - u * impulse
            largest[1, lane] = max(largest[1, lane], abs(u_then))
            largest[2, lane] = max(largest[2, lane], abs(z_then))
            largest[3, lane] = max(largest[3, lane], abs(u_then + twice * z_then))


@kernel
def first_root(start, change, damping):
    """Return the first phase at which a free vibration vanishes, from its value and its derivative at phase 0."""
    root = math.sqrt((1.0 - damping) * (1.0 + damping))
    quadrature = change + damping * start
    return math.atan2(root * abs(start), -quadrature if start > 0.0 else quadrature) / root
