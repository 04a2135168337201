"""
Time integrals of an oscillator's response times the ground acceleration, exact for a piecewise-linear record.

Over one step the response is a linear function of the state and the two samples at its ends, so an integral over the
whole record is a weighted sum of products ``state * sample``; the weights are integrals over one step.
"""

import numpy as np

from ._jit import kernel
from .oscillator import step, unit_responses

#: Oscillators side by side.
LANES = 32

#: Products that are summed: (u north, z north, u east, z east) times (a0 north, a1 north, a0 east, a1 east).
PRODUCTS = 16

#: Gauss-Legendre nodes and weights on [0, 1]; 24 integrate a step of up to one radian of phase to round-off.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
NODES, WEIGHTS = (_NODES + 1.0) / 2.0, _WEIGHTS / 2.0


@kernel
def input_moments(north, east, dt, omega, damping, moments):
    """
    Fill ``moments`` (n, 2, 3) with the integrals of u times a and of v times a, over the record.

    The last axis is north-north, north-east plus east-north, east-east: along an azimuth with cosine c and sine s the
    integral is ``c² m0 + c s m1 + s² m2``.
    """
    squares = _sample_products(north, east)
    sums = np.empty((PRODUCTS, LANES))
    for first in range(0, omega.size, LANES):
        count = min(LANES, omega.size - first)
        _state_products(north, east, dt, omega[first : first + count], damping[first : first + count], sums)
        for lane in range(count):
            weights = _step_weights(omega[first + lane], damping[first + lane], dt)
            for row in range(2):
                _combine(weights[row], sums[:, lane], squares, moments[first + lane, row])


@kernel
def _sample_products(north, east):
    """Return the sums of a0 a0, (a0 b1 + a1 b0) / 2 and a1 a1 for north-north, north-east and east-east, (3, 3)."""
    out = np.zeros((3, 3))
    for i in range(north.size - 1):
        n0, n1, e0, e1 = north[i], north[i + 1], east[i], east[i + 1]
        out[0, 0] += n0 * n0
        out[0, 1] += n0 * n1
        out[0, 2] += n1 * n1
        out[1, 0] += n0 * e0
        out[1, 1] += 0.5 * (n0 * e1 + n1 * e0)
        out[1, 2] += n1 * e1
        out[2, 0] += e0 * e0
        out[2, 1] += e0 * e1
        out[2, 2] += e1 * e1
    return out


@kernel
def _state_products(north, east, dt, omega, damping, sums):
    """Fill the sums over all steps of the products of state and samples, a column an oscillator."""
    c = np.zeros((8, LANES))
    for lane in range(omega.size):
        values = step(omega[lane], damping[lane], dt)
        for row in range(8):
            c[row, lane] = values[row]
    state = np.zeros((4, LANES))
    sums[:] = 0.0
    for i in range(north.size - 1):
        n0, n1, e0, e1 = north[i], north[i + 1], east[i], east[i + 1]
        for lane in range(LANES):
            un, zn, ue, ze = state[0, lane], state[1, lane], state[2, lane], state[3, lane]
            sums[0, lane] += un * n0
            sums[1, lane] += un * n1
            sums[2, lane] += un * e0
            sums[3, lane] += un * e1
            sums[4, lane] += zn * n0
            sums[5, lane] += zn * n1
            sums[6, lane] += zn * e0
            sums[7, lane] += zn * e1
            sums[8, lane] += ue * n0
            sums[9, lane] += ue * n1
            sums[10, lane] += ue * e0
            sums[11, lane] += ue * e1
            sums[12, lane] += ze * n0
            sums[13, lane] += ze * n1
            sums[14, lane] += ze * e0
            sums[15, lane] += ze * e1
            state[0, lane] = c[0, lane] * un + c[1, lane] * zn + (c[4, lane] * n0 + c[5, lane] * n1)
            state[1, lane] = c[2, lane] * un + c[3, lane] * zn + (c[6, lane] * n0 + c[7, lane] * n1)
            state[2, lane] = c[0, lane] * ue + c[1, lane] * ze + (c[4, lane] * e0 + c[5, lane] * e1)
            state[3, lane] = c[2, lane] * ue + c[3, lane] * ze + (c[6, lane] * e0 + c[7, lane] * e1)


@kernel
def _step_weights(omega, damping, dt):
    """
    Return the weights (2, 8) of one step's integrals of u a and v a.

    In the order u0 a0, u0 a1, z0 a0, z0 a1, a0 a0, a0 a1, a1 a1 (the eighth is not used).
    """
    phase = omega * dt
    panels = int(np.ceil(phase))
    compliance = 1.0 / (omega * omega)
    weights = np.zeros((2, 8))
    for panel in range(panels):
        for node in range(NODES.size):
            part = (panel + NODES[node]) / panels
            impulse, slope, once, twice = unit_responses(part * phase, damping)
            # the response to the samples at the start and at the end of the step, displacement then velocity
            rising_u, rising_v = -compliance * twice / phase, -compliance * once / phase
            falling_u, falling_v = -compliance * once - rising_u, -compliance * impulse - rising_v
            weight = WEIGHTS[node] * dt / panels
            _add(weights[0], weight, part, 1.0 - once, impulse, falling_u, rising_u)
            _add(weights[1], weight * omega, part, -impulse, slope, falling_v, rising_v)
    return weights


@kernel
def _add(weights, weight, part, by_u, by_z, by_start, by_end):
    weights[0] += weight * by_u * (1.0 - part)
    weights[1] += weight * by_u * part
    weights[2] += weight * by_z * (1.0 - part)
    weights[3] += weight * by_z * part
    weights[4] += weight * by_start * (1.0 - part)
    weights[5] += weight * (by_start * part + by_end * (1.0 - part))
    weights[6] += weight * by_end * part


@kernel
def _combine(weights, sums, squares, out):
    """Fill one row of moments from the weights of a step and the sums over all steps."""
    for column in range(3):
        out[column] = (
            weights[4] * squares[column, 0] + weights[5] * squares[column, 1] + weights[6] * squares[column, 2]
        )
    out[1] *= 2.0
    for product in range(4):
        displacement = 4 * (product // 2) + product % 2  # u or z with a0 or a1 of the same component
        out[0] += weights[product] * sums[displacement]
        out[1] += weights[product] * (sums[displacement + 2] + sums[displacement + 8])
        out[2] += weights[product] * sums[displacement + 10]
