"""
Simple kriging of residuals about a fitted trend, one place after the other, from its nearest stations that know.

A place's numbers depend on nothing but the place: no product of matrices goes over several places.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.elementary import exponentials


@kernel
def kriged(stations, trend, places, diameter, neighbours, out):
    """
    Fill ``out`` (m, 2) with median and standard deviation at every place; it is left as it is where no station knows.

    ``stations``: unit vectors (n, 3), distances between them (n, n) m, first and last known period (n, 2) s, features
    (n, f), residuals (n, k) on a grid of periods. ``trend``, on the same grid: coefficients (k, 1 + f), their
    covariance for a deviation of 1 (k, 1 + f, 1 + f), middles of the features (k, f), NaN for one that is not used,
    deviation of the residual (k). ``places``: unit vectors (m, 3), features (m, f), period (m) s, its lower neighbour
    on the grid (m), part of the way to the next (m), decay length of the correlation (m) m. ``diameter``: of the
    sphere, m. ``neighbours``: largest number of stations that serve a place.
    """
    position, between, known, features, residuals = stations
    vectors, wanted, periods, columns, shares, lengths = places
    nearest, chord = np.empty(neighbours, dtype=np.int64), np.empty(neighbours)
    across, weights, work = np.empty(neighbours), np.empty(neighbours), np.empty(neighbours)
    factor, unmatched = np.empty((neighbours, neighbours)), np.empty(trend[0].shape[1])
    powers = np.empty(neighbours * (neighbours + 1) // 2)
    integers = np.empty(powers.size, dtype=np.int64)
    for row in range(out.shape[0]):
        count = _nearest(position, known, vectors[row], periods[row], nearest, chord)
        if count == 0:
            continue
        _distances(between, nearest[:count], chord, diameter, -1.0 / lengths[row], powers)
        exponentials(powers[: count * (count + 1) // 2], integers)
        _correlations(powers, count, factor, across)
        _factorise(factor, count)
        left = max(1.0 - _solve(factor, across, count, work, weights), 0.0)
        median = variance = 0.0
        for step in range(2):
            share = shares[row] if step else 1.0 - shares[row]
            column = columns[row] + step
            if share > 0.0:
                _unmatched(features, wanted[row], trend[2][column], nearest[:count], weights, unmatched)
                estimate = _trend(trend[0][column], wanted[row], trend[2][column])
                median += share * (estimate + _weighted(weights, residuals, nearest[:count], column))
                variance += share * trend[3][column] ** 2 * (left + _square(trend[1][column], unmatched))
        out[row, 0], out[row, 1] = median, math.sqrt(variance)


@kernel
def _weighted(weights, residuals, nearest, column):
    """Return the weighted sum of the stations' residuals."""
    total = 0.0
    for i in range(nearest.size):
        total += weights[i] * residuals[nearest[i], column]
    return total


@kernel
def _nearest(position, known, vector, period, nearest, chord):
    """Fill the nearest stations that know the period, and their squared chords; return how many."""
    count, room = 0, nearest.size
    for station in range(position.shape[0]):
        if not known[station, 0] <= period <= known[station, 1]:
            continue
        square = 0.0
        for axis in range(3):
            square += (position[station, axis] - vector[axis]) ** 2
        if count == room and square >= chord[room - 1]:
            continue
        place = min(count, room - 1)
        while place > 0 and chord[place - 1] > square:
            chord[place], nearest[place] = chord[place - 1], nearest[place - 1]
            place -= 1
        chord[place], nearest[place] = square, station
        count = min(count + 1, room)
    return count


@kernel
def _distances(between, nearest, chord, diameter, scale, powers):
    """Fill the distances of the place from each station, then those between stations, each times a scale."""
    for i in range(nearest.size):
        powers[i] = scale * diameter * math.asin(min(0.5 * math.sqrt(chord[i]), 1.0))
    position = nearest.size
    for i in range(nearest.size):
        for j in range(i):
            powers[position + j] = scale * between[nearest[i], nearest[j]]
        position += i


@kernel
def _correlations(powers, count, factor, across):
    """Fill the correlations with the place and, as a lower triangle, between the stations."""
    across[:count] = powers[:count]
    position = count
    for i in range(count):
        factor[i, i] = 1.0
        factor[i, :i] = powers[position : position + i]
        position += i


@kernel
def _factorise(matrix, count):
    """Replace the lower triangle of a matrix by that of its Cholesky factor, with inverses on the diagonal."""
    for j in range(count):
        pivot = matrix[j, j]
        for k in range(j):
            pivot -= matrix[j, k] * matrix[j, k]
        matrix[j, j] = 1.0 / math.sqrt(pivot)
        for i in range(j + 1, count):
            value = matrix[i, j]
            for k in range(j):
                value -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = value * matrix[j, j]


@kernel
def _solve(factor, right, count, forward, weights):
    """Fill the weights that solve for the right side; return what the stations tell, a part of 1."""
    told = 0.0
    for i in range(count):
        value = right[i]
        for k in range(i):
            value -= factor[i, k] * forward[k]
        forward[i] = value * factor[i, i]
        told += forward[i] * forward[i]
    for i in range(count - 1, -1, -1):
        value = forward[i]
        for k in range(i + 1, count):
            value -= factor[k, i] * weights[k]
        weights[i] = value * factor[i, i]
    return told


@kernel
def _feature(values, middles, one):
    """Return a feature about its middle; 0 where it is not used or not known."""
    value = values[one] - middles[one]
    return 0.0 if math.isnan(value) else value


@kernel
def _trend(coefficients, values, middles):
    """Return the trend at a place."""
    total = coefficients[0]
    for one in range(middles.size):
        total += coefficients[one + 1] * _feature(values, middles, one)
    return total


@kernel
def _unmatched(features, wanted, middles, nearest, weights, out):
    """Fill what of the place's trend the weighted stations do not cancel."""
    out[0] = 1.0
    for i in range(nearest.size):
        out[0] -= weights[i]
    for one in range(middles.size):
        out[one + 1] = _feature(wanted, middles, one)
        for i in range(nearest.size):
            out[one + 1] -= weights[i] * _feature(features[nearest[i]], middles, one)


@kernel
def _square(matrix, vector):
    """Return the quadratic form of a symmetric matrix, at least 0."""
    total = 0.0
    for i in range(vector.size):
        for j in range(vector.size):
            total += vector[i] * matrix[i, j] * vector[j]
    return max(total, 0.0)
