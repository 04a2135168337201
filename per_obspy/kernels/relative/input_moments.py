"""
Time integrals of an oscillator's response times the ground acceleration, exact for linear pieces.

The record is linear between samples. Over one step the response is a linear function of the state
and the two samples at its ends, so an integral over the whole record is a weighted sum of products
``state * sample``; the weights are integrals over one step. A state is a sum over all samples
before it, so that only the sums of the products of samples so many steps from each other (lags) are
needed of the record. Of these only as many count as the oscillator remembers.
"""

import math

import numpy as np

from per_obspy.kernels._aligned import aligned, aligned_copy
from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import (
    integrals,
    shifted_rest,
    shifted_step,
    step_coefficients,
    unshifted,
)

#: Oscillators next to each other: a constant trip count, which the compiler turns into vectors.
MOMENT_LANES = 32
#: Lags after which an oscillator may begin.
LAG_TILE = 64
#: Part that an oscillator remembers of the lags that are left out: rounding.
FORGOTTEN_LAGS = 1e-15

#: Rows of a block's table, one column per oscillator: the step matrix; the shifted state of rest
#: under a first sample; both parts of the sum for north-north, north-east plus east-north, and
#: east-east.
REST, SUMS, MOMENT_ROWS = 4, 6, 12


@kernel
def input_moments(lagged, firsts, dt, omega, damping, order, moments):
    """
    Fill the integrals of ``u a`` and of ``v a`` over a record that ends at zero.

    Parameters
    ----------
    lagged : (3, tiles * LAG_TILE + 2) ndarray
        Sums over the record of all products of samples so many steps from each other, (m/s²)², zero
        beyond the record. Rows: north-north, north-east plus east-north, east-east.
    firsts : (3, tiles * LAG_TILE + 2) ndarray
        Products of the first sample with the one so many steps later, (m/s²)², in the same rows.
    dt : float
        Time between samples, s.
    omega : (n,) ndarray
        Circular frequencies, rad/s.
    damping : (n,) ndarray
        Fractions of critical, dimensionless.
    order : (n,) ndarray of int
        Order in which oscillators share blocks: fastest if neighbours forget equally fast.
    moments : (n, 2, 3) ndarray
        Receives the integrals of ``u a`` (m²/s) and of ``v a`` (m²/s²). Last axis: north-north
        (m0), north-east plus east-north (m1), east-east (m2); along an azimuth with cosine c and
        sine s the integral is ``c² m0 + c s m1 + s² m2``.
    """
    table = aligned(MOMENT_ROWS, MOMENT_LANES)
    sums = np.empty((6, MOMENT_LANES))
    limits = np.empty(MOMENT_LANES)
    tails = _tails(lagged, firsts)
    # Sums of a0 a0, a0 a1 and a1 a1 over all steps
    squares = np.empty((3, 3))
    for row in range(3):
        squares[row, 0], squares[row, 1] = lagged[row, 0], lagged[row, 1]
        squares[row, 2] = lagged[row, 0] - firsts[row, 0]
    for first in range(0, order.size, MOMENT_LANES):
        # Fill a block, the last one with copies of its last oscillator
        chosen = order[first : first + MOMENT_LANES]
        for lane in range(MOMENT_LANES):
            index = chosen[min(lane, chosen.size - 1)]
            _pack(omega[index], damping[index], dt, table, lane)
            decay = math.exp(-damping[index] * omega[index] * dt * LAG_TILE)
            limits[lane] = _limit(decay, tails)
        _sum_backwards(lagged, firsts, limits, table)
        for row in range(6):
            for lane in range(MOMENT_LANES):
                sums[row, lane] = table[SUMS + row, lane]
        # Moments: weights of one step times the sums of products over all steps
        for lane in range(chosen.size):
            index = chosen[lane]
            at_end, at_start = _both_products(
                omega[index], damping[index], dt, sums[:, lane], squares
            )
            weights = _step_weights(omega[index], damping[index], dt)
            for row in range(2):
                _combine(weights[row], at_start, at_end, squares, moments[index, row])


@kernel
def _tails(lagged, firsts):
    """Return the part of all products, by their sizes, that comes from each tile of lags on."""
    tiles = (lagged.shape[1] - 2) // LAG_TILE
    tails = np.zeros(tiles + 1)
    for row in range(3):
        # Sizes from the last tile on
        sizes = np.zeros(tiles + 1)
        for tile in range(tiles - 1, -1, -1):
            sizes[tile] = sizes[tile + 1]
            for lag in range(tile * LAG_TILE, (tile + 1) * LAG_TILE):
                sizes[tile] += abs(lagged[row, lag]) + abs(firsts[row, lag])
        if sizes[0] > 0.0:
            for tile in range(tiles + 1):
                tails[tile] = max(tails[tile], sizes[tile] / sizes[0])
    return tails


@kernel
def _limit(decay, tails):
    """Return the number of tiles of lags that count for an oscillator that forgets at a rate."""
    remaining = 1.0
    tile = 0
    while tile < tails.size - 1 and remaining * tails[tile] > FORGOTTEN_LAGS:
        remaining *= decay
        tile += 1
    return tile


@kernel
def _pack(omega, damping, dt, table, lane):
    """Fill the rows of an oscillator whose sums are zero."""
    matrix, frame = shifted_step(omega, damping, dt)
    table[:, lane] = 0.0
    for row in range(4):
        table[row, lane] = matrix[row]
    table[REST, lane], table[REST + 1, lane] = shifted_rest(frame, 1.0)


@kernel
def _sum_backwards(lagged, firsts, limits, table):
    """
    Sum the shifted states times the samples at the ends of the steps, over all steps.

    ``sum over k of M^k ((1, 0) lagged[k + 2] + rest firsts[k + 1])``, from the largest lag of each
    oscillator down.
    """
    # Of a size that the compiler knows
    t = aligned_copy(table, MOMENT_ROWS, MOMENT_LANES)
    for tile in range(math.ceil(limits.max()) - 1, -1, -1):
        # Oscillators begin at their own largest lag
        for row in range(SUMS, MOMENT_ROWS):
            for lane in range(MOMENT_LANES):
                t[row, lane] = t[row, lane] if tile + 1 < limits[lane] else 0.0
        for k in range((tile + 1) * LAG_TILE - 4, tile * LAG_TILE - 4, -4):
            for row in range(3):
                # Products of four lags, with the first sample and with all
                x0, x1 = lagged[row, k + 2], lagged[row, k + 3]
                x2, x3 = lagged[row, k + 4], lagged[row, k + 5]
                y0, y1 = firsts[row, k + 1], firsts[row, k + 2]
                y2, y3 = firsts[row, k + 3], firsts[row, k + 4]
                # Horner's rule for the step matrix, four lags down
                for lane in range(MOMENT_LANES):
                    u, z = _moved(t, lane, t[6 + 2 * row, lane], t[7 + 2 * row, lane], x3, y3)
                    u, z = _moved(t, lane, u, z, x2, y2)
                    u, z = _moved(t, lane, u, z, x1, y1)
                    t[6 + 2 * row, lane], t[7 + 2 * row, lane] = _moved(t, lane, u, z, x0, y0)
    _store_sums(t, table)


@kernel
def _store_sums(t, table):
    """Store the sums of a block."""
    for row in range(SUMS, MOMENT_ROWS):
        for lane in range(MOMENT_LANES):
            table[row, lane] = t[row, lane]


@kernel
def _moved(t, lane, u, z, product, first):
    """Return a sum times the step matrix, plus the share of the next lag."""
    along = t[0, lane] * u + (t[1, lane] * z + (t[4, lane] * first + product))
    return along, t[2, lane] * u + (t[3, lane] * z + t[5, lane] * first)


@kernel
def _both_products(omega, damping, dt, sums, squares):
    """
    Return the sums of ``u, z`` before each step times the sample at its end and its start, (3, 2).

    The sample at a step's end is that at the next one's start, where the state is ``A x + b0 a + b1
    a'``.
    """
    _, frame = shifted_step(omega, damping, dt)
    a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(omega, damping, dt)
    at_end = np.empty((3, 2))
    at_start = np.empty((3, 2))
    for row in range(3):
        # Undo the shift for the samples at the ends of the steps
        before, end = squares[row, 1], squares[row, 2]
        u, z = unshifted(frame, sums[2 * row], sums[2 * row + 1], before)
        at_end[row, 0] = u
        at_end[row, 1] = z
        # One step further: the same sample at the start
        at_start[row, 0] = a11 * u + a12 * z + (b11 * before + b12 * end)
        at_start[row, 1] = a21 * u + a22 * z + (b21 * before + b22 * end)
    return at_end, at_start


@kernel
def _step_weights(omega, damping, dt):
    """
    Return the weights (2, 7) of one step's integrals of u a and v a.

    In the order u0 a0, u0 a1, z0 a0, z0 a1, a0 a0, a0 a1, a1 a1.
    """
    phase = omega * dt
    compliance = 1.0 / (omega * omega)
    # Means over a step of H', H, I1 and I2
    _, impulse, integral_1, integral_2, integral_3, integral_4 = integrals(phase, damping)
    of_slope = _means(impulse, integral_1, phase)
    of_impulse = _means(integral_1, integral_2, phase)
    of_integral_1 = _means(integral_2, integral_3, phase)
    of_integral_2 = _means(integral_3, integral_4, phase)
    weights = np.empty((2, 7))
    # Displacement: u0 (1 - I1) + z0 H - a I1 - ...
    by_u = 1.0 - of_integral_1[0], 0.5 - of_integral_1[1]
    _fill(dt, by_u, of_impulse, of_integral_1, of_integral_2, compliance, phase, weights[0])
    # Velocity: -u0 H + z0 H' - a H - ...
    by_u = -of_impulse[0], -of_impulse[1]
    _fill(dt * omega, by_u, of_slope, of_impulse, of_integral_1, compliance, phase, weights[1])
    return weights


@kernel
def _means(integral, next_integral, phase):
    """Return the means over a step of a function, and of it times the part of the step."""
    return integral / phase, (integral - next_integral / phase) / phase


@kernel
def _fill(scale, by_u, by_z, constant, growing, compliance, phase, weights):
    """
    Fill the weights of a step from means of the responses.

    The responses are those to the state (``by_u``, ``by_z``), and to a constant and a growing
    acceleration.
    """
    # Responses to an acceleration that rises from 0 to 1 over the step, and to one that falls
    rising = -compliance * growing[0] / phase, -compliance * growing[1] / phase
    falling = -compliance * constant[0] - rising[0], -compliance * constant[1] - rising[1]
    # Products with the samples at the start and at the end
    weights[0] = scale * (by_u[0] - by_u[1])
    weights[1] = scale * by_u[1]
    weights[2] = scale * (by_z[0] - by_z[1])
    weights[3] = scale * by_z[1]
    weights[4] = scale * (falling[0] - falling[1])
    weights[5] = scale * (falling[1] + rising[0] - rising[1])
    weights[6] = scale * rising[1]


@kernel
def _combine(weights, at_start, at_end, squares, out):
    """Fill one row of moments from the weights of a step and the sums over all steps."""
    for row in range(3):
        # Products of samples, then of displacements and velocities with samples
        out[row] = (
            weights[4] * squares[row, 0]
            + weights[5] * squares[row, 1]
            + weights[6] * squares[row, 2]
        )
        out[row] += weights[0] * at_start[row, 0] + weights[1] * at_end[row, 0]
        out[row] += weights[2] * at_start[row, 1] + weights[3] * at_end[row, 1]
