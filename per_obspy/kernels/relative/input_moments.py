"""
Time integrals of an oscillator's response times the ground acceleration, exact for a piecewise-linear record.

Over one step the response is a linear function of the state and the two samples at its ends, so an
integral over the whole record is a weighted sum of products ``state * sample``; the weights are
integrals over one step. A state is a sum over all samples before it, so that what is left of the
record are the sums of the products of its samples that are so many steps apart. Of these only as
many count as the oscillator remembers.
"""

import math

import numpy as np

from per_obspy.kernels._aligned import aligned
from per_obspy.kernels._jit import kernel
from per_obspy.kernels.oscillator.exact_step import integrals, step
from per_obspy.kernels.oscillator.shifted_step import shifted_rest, shifted_step, unshifted

#: Oscillators side by side: a constant trip count, which the compiler turns into vectors.
LANES = 32
#: Lags after which an oscillator may begin.
TILE = 64
#: What an oscillator remembers of the lags that are left out: rounding.
FORGOTTEN = 1e-15

#: Rows of a block's table, one column an oscillator: the step matrix; the shifted state of rest
#: under a first sample; both parts of the sum for north-north, north-east plus east-north, and
#: east-east.
REST, SUMS, ROWS = 4, 6, 12


@kernel
def input_moments(lagged, firsts, dt, omega, damping, order, moments):
    """
    Fill ``moments`` (n, 2, 3) with the integrals of u times a and of v times a, over a record that ends at zero.

    The last axis is north-north, north-east plus east-north, east-east: along an azimuth with
    cosine c and sine s the integral is ``c² m0 + c s m1 + s² m2``. ``lagged`` (3, tiles * TILE + 2)
    are the sums of all products of samples so many steps apart, ``firsts`` the products of the
    first sample with those so many steps later, zero beyond the record. Those neighbours in the
    ``order`` (n,) are best that forget equally fast.
    """
    table, sums, limits = aligned(ROWS, LANES), np.empty((6, LANES)), np.empty(LANES)
    tails = _tails(lagged, firsts)
    squares = np.stack((lagged[:, 0], lagged[:, 1], lagged[:, 0] - firsts[:, 0]), axis=1)
    for first in range(0, order.size, LANES):
        chosen = order[first : first + LANES]
        for lane in range(LANES):
            index = chosen[min(lane, chosen.size - 1)]
            _pack(omega[index], damping[index], dt, table, lane)
            limits[lane] = _limit(math.exp(-damping[index] * omega[index] * dt * TILE), tails)
        _sum_backwards(lagged, firsts, limits, table)
        sums[:] = table[SUMS:]
        for lane in range(chosen.size):
            index = chosen[lane]
            ahead, here = _both_products(omega[index], damping[index], dt, sums[:, lane], squares)
            weights = _step_weights(omega[index], damping[index], dt)
            for row in range(2):
                _combine(weights[row], here, ahead, squares, moments[index, row])


@kernel
def _tails(lagged, firsts):
    """Return which part of all products, by their sizes, comes from each tile of lags on."""
    tiles = (lagged.shape[1] - 2) // TILE
    tails = np.zeros(tiles + 1)
    for row in range(3):
        sizes = np.zeros(tiles + 1)
        for tile in range(tiles - 1, -1, -1):
            lags = slice(tile * TILE, (tile + 1) * TILE)
            sizes[tile] = (
                sizes[tile + 1] + np.abs(lagged[row, lags]).sum() + np.abs(firsts[row, lags]).sum()
            )
        if sizes[0] > 0.0:
            tails = np.maximum(tails, sizes / sizes[0])
    return tails


@kernel
def _limit(decay, tails):
    """Return how many tiles of lags count for an oscillator that forgets at a rate."""
    left, tile = 1.0, 0
    while tile < tails.size - 1 and left * tails[tile] > FORGOTTEN:
        left *= decay
        tile += 1
    return tile


@kernel
def _pack(omega, damping, dt, table, lane):
    """Fill the rows of an oscillator; nothing is summed yet."""
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
    t = aligned(ROWS, LANES)  # of a size that the compiler knows, so that it makes vectors
    t[:] = table
    for tile in range(math.ceil(limits.max()) - 1, -1, -1):
        for row in range(SUMS, ROWS):
            for lane in range(LANES):
                t[row, lane] = t[row, lane] if tile + 1 < limits[lane] else 0.0
        for k in range((tile + 1) * TILE - 4, tile * TILE - 4, -4):
            for row in range(3):
                x0, x1, x2, x3 = (
                    lagged[row, k + 2],
                    lagged[row, k + 3],
                    lagged[row, k + 4],
                    lagged[row, k + 5],
                )
                y0, y1, y2, y3 = (
                    firsts[row, k + 1],
                    firsts[row, k + 2],
                    firsts[row, k + 3],
                    firsts[row, k + 4],
                )
                for lane in range(LANES):
                    u, z = _moved(t, lane, t[6 + 2 * row, lane], t[7 + 2 * row, lane], x3, y3)
                    u, z = _moved(t, lane, u, z, x2, y2)
                    u, z = _moved(t, lane, u, z, x1, y1)
                    t[6 + 2 * row, lane], t[7 + 2 * row, lane] = _moved(t, lane, u, z, x0, y0)
    table[:] = t


@kernel
def _moved(t, lane, u, z, product, first):
    """Return a sum times the step matrix, and what the next lag adds to it."""
    along = t[0, lane] * u + (t[1, lane] * z + (t[4, lane] * first + product))
    return along, t[2, lane] * u + (t[3, lane] * z + t[5, lane] * first)


@kernel
def _both_products(omega, damping, dt, sums, squares):
    """
    Return the sums of ``u, z`` before each step times the sample at its end, and times that at its start, (3, 2) each.

    The sample at a step's end is that at the next one's start, where the state is ``A x + b0 a + b1
    a'``.
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
    Return the weights (2, 7) of one step's integrals of u a and v a.

    In the order u0 a0, u0 a1, z0 a0, z0 a1, a0 a0, a0 a1, a1 a1.
    """
    phase, compliance = omega * dt, 1.0 / (omega * omega)
    _, impulse, once, twice, thrice, four_times = integrals(phase, damping)
    of_slope, of_impulse = _means(impulse, once, phase), _means(once, twice, phase)
    of_once, of_twice = _means(twice, thrice, phase), _means(thrice, four_times, phase)
    weights = np.empty((2, 7))
    remaining = 1.0 - of_once[0], 0.5 - of_once[1]
    _fill(dt, remaining, of_impulse, of_once, of_twice, compliance, phase, weights[0])
    against = -of_impulse[0], -of_impulse[1]
    _fill(dt * omega, against, of_slope, of_impulse, of_once, compliance, phase, weights[1])
    return weights


@kernel
def _means(once, twice, phase):
    """Return the means over a step of a function, and of it times the part of the step, from its two integrals."""
    return once / phase, (once - twice / phase) / phase


@kernel
def _fill(scale, by_u, by_z, constant, growing, compliance, phase, weights):
    """Fill the weights from the means of the responses to the state, and to a constant and a growing acceleration."""
    rising = -compliance * growing[0] / phase, -compliance * growing[1] / phase
    falling = -compliance * constant[0] - rising[0], -compliance * constant[1] - rising[1]
    weights[0], weights[1] = scale * (by_u[0] - by_u[1]), scale * by_u[1]
    weights[2], weights[3] = scale * (by_z[0] - by_z[1]), scale * by_z[1]
    weights[4], weights[6] = scale * (falling[0] - falling[1]), scale * rising[1]
    weights[5] = scale * (falling[1] + rising[0] - rising[1])


@kernel
def _combine(weights, here, ahead, squares, out):
    """Fill one row of moments from the weights of a step and the sums over all steps."""
    for row in range(3):
        out[row] = (
            weights[4] * squares[row, 0]
            + weights[5] * squares[row, 1]
            + weights[6] * squares[row, 2]
        )
        out[row] += weights[0] * here[row, 0] + weights[1] * ahead[row, 0]
        out[row] += weights[2] * here[row, 1] + weights[3] * ahead[row, 1]
