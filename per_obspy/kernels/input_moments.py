"""
Time integrals of an oscillator's response times the ground acceleration, exact for a piecewise-linear record.

Over one step the response is a linear function of the state and the two samples at its ends, so an integral over the
whole record is a weighted sum of products ``state * sample``; the weights are integrals over one step. Only the
products of the state before each step with the sample at its end are summed: one step relates them to the others.
"""

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator import step, unit_responses
from per_obspy.kernels.shifted import shifted_rest, shifted_step, unshifted

#: Oscillators side by side: a constant trip count, which the compiler turns into vectors.
LANES = 32

#: Rows of a block's table, one column an oscillator: the step matrix; the shifted states under north and under east;
#: the sums of both parts of the state times the sample at the step's end, for north-north, north-east plus east-north,
#: and east-east.
STATE, SUMS, ROWS = 4, 8, 14

#: Gauss-Legendre nodes and weights on [0, 1]; 24 integrate a step of up to one radian of phase to round-off.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
NODES, WEIGHTS = (_NODES + 1.0) / 2.0, _WEIGHTS / 2.0


@kernel
def input_moments(north, east, dt, omega, damping, moments):
    """
    Fill ``moments`` (n, 2, 3) with the integrals of u times a and of v times a, over a record that ends at zero.

    The last axis is north-north, north-east plus east-north, east-east: along an azimuth with cosine c and sine s the
    integral is ``c² m0 + c s m1 + s² m2``.
    """
    squares = _sample_products(north, east)
    sums = np.empty((6, LANES))
    for first in range(0, omega.size, LANES):
        count = min(LANES, omega.size - first)
        _state_products(north, east, dt, omega[first : first + count], damping[first : first + count], sums)
        for lane in range(count):
            ahead, here = _both_products(omega[first + lane], damping[first + lane], dt, sums[:, lane], squares)
            weights = _step_weights(omega[first + lane], damping[first + lane], dt)
            for row in range(2):
                _combine(weights[row], here, ahead, squares, moments[first + lane, row])


@kernel
def _sample_products(north, east):
    """Return the sums of a0 a0, a0 a1 and a1 a1 for north-north, north-east plus east-north and east-east, (3, 3)."""
    out = np.zeros((3, 3))
    for i in range(north.size - 1):
        n0, n1, e0, e1 = north[i], north[i + 1], east[i], east[i + 1]
        out[0, 0] += n0 * n0
        out[0, 1] += n0 * n1
        out[0, 2] += n1 * n1
        out[1, 0] += 2.0 * n0 * e0
        out[1, 1] += n0 * e1 + n1 * e0
        out[1, 2] += 2.0 * n1 * e1
        out[2, 0] += e0 * e0
        out[2, 1] += e0 * e1
        out[2, 2] += e1 * e1
    return out


@kernel
def _state_products(north, east, dt, omega, damping, sums):
    """Fill the sums (6, lane) over all steps of the shifted states times the samples at the ends of the steps."""
    table = np.zeros((ROWS, LANES))
    for lane in range(omega.size):
        matrix, frame = shifted_step(omega[lane], damping[lane], dt)
        for row in range(4):
            table[row, lane] = matrix[row]
        table[STATE, lane], table[STATE + 1, lane] = shifted_rest(frame, north[0])
        table[STATE + 2, lane], table[STATE + 3, lane] = shifted_rest(frame, east[0])
    last = north.size - 1
    for i in range(0, last - 1, 2):
        n0, n1, n2, e0, e1, e2 = north[i], north[i + 1], north[i + 2], east[i], east[i + 1], east[i + 2]
        for lane in range(LANES):
            _sum_and_step(table, lane, n0, n1, e0, e1)
            _sum_and_step(table, lane, n1, n2, e1, e2)
    if last % 2:
        for lane in range(LANES):
            _sum_and_step(table, lane, north[last - 1], north[last], east[last - 1], east[last])
    sums[:] = table[SUMS:]


@kernel
def _sum_and_step(t, lane, north, next_north, east, next_east):
    """Add the products of a step to the sums, and advance the states."""
    u, z, w, y = t[4, lane], t[5, lane], t[6, lane], t[7, lane]
    t[8, lane] += u * next_north
    t[9, lane] += z * next_north
    t[10, lane] += u * next_east + w * next_north
    t[11, lane] += z * next_east + y * next_north
    t[12, lane] += w * next_east
    t[13, lane] += y * next_east
    t[4, lane], t[5, lane] = t[0, lane] * u + (t[1, lane] * z + north), t[2, lane] * u + t[3, lane] * z
    t[6, lane], t[7, lane] = t[0, lane] * w + (t[1, lane] * y + east), t[2, lane] * w + t[3, lane] * y


@kernel
def _both_products(omega, damping, dt, sums, squares):
    """
    Return the sums of ``u, z`` before each step times the sample at its end, and times that at its start, (3, 2) each.

    The sample at a step's end is that at the next one's start, where the state is ``A x + b0 a + b1 a'``.
    """
    _, frame = shifted_step(omega, damping, dt)
    a11, a12, a21, a22, b11, b12, b21, b22 = step(omega, damping, dt)
    ahead, here = np.empty((3, 2)), np.empty((3, 2))
    for row in range(3):
        before, end = squares[row, 1], squares[row, 2]
        u, z = unshifted(frame, sums[2 * row], sums[2 * row + 1], before)
        ahead[row, 0], ahead[row, 1] = u, z
        here[row, 0] = a11 * u + a12 * z + (b11 * before + b12 * end)
        here[row, 1] = a21 * u + a22 * z + (b21 * before + b22 * end)
    return ahead, here


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
def _combine(weights, here, ahead, squares, out):
    """Fill one row of moments from the weights of a step and the sums over all steps."""
    for row in range(3):
        out[row] = weights[4] * squares[row, 0] + weights[5] * squares[row, 1] + weights[6] * squares[row, 2]
        out[row] += weights[0] * here[row, 0] + weights[1] * ahead[row, 0]
        out[row] += weights[2] * here[row, 1] + weights[3] * ahead[row, 1]
