"""
Simple kriging of residuals about a fitted trend, places side by side, each from its nearest stations that know.

A place's numbers depend on nothing but the place: its company shares the operations, not the
numbers.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.elementary import exponentials

#: Places side by side: a constant trip count, which the compiler turns into vectors.
LANES = 64


@kernel
def kriged(stations, trend, places, diameter, neighbours, out):
    """
    Fill ``out`` (m, 2) with median and standard deviation at every place; it is left as it is where no station knows.

    ``stations``: unit vectors (n, 3), distances between them (n, n) m, first and last known period
    (n, 2) s, features (n, f), residuals (n, k) on a grid of periods. ``trend``, on the same grid:
    coefficients (k, 1 + f), their covariance for a deviation of 1 (k, 1 + f, 1 + f), middles of the
    features (k, f), NaN for one that is not used, deviation of the residual (k). ``places``: unit
    vectors (m, 3), features (m, f), period (m) s, its lower neighbour on the grid (m), part of the
    way to the next (m), decay length of the correlation (m) m. ``diameter``: of the sphere, m.
    ``neighbours``: largest number of stations that serve a place.
    """
    nearest, counts = np.empty((LANES, neighbours), dtype=np.int64), np.empty(LANES, dtype=np.int64)
    room = _row(neighbours + 1, 0)
    table, integers = np.zeros((room + neighbours, LANES)), np.empty((room, LANES), dtype=np.int64)
    left, weights = np.empty(LANES), np.empty(neighbours)
    for first in range(0, out.shape[0], LANES):
        count = _correlations(stations, places, diameter, first, nearest, counts, table, integers)
        _factorise(table, count)
        _solve(table, count, room, left)
        for lane in range(min(LANES, out.shape[0] - first)):
            if counts[lane] > 0:
                weights[:] = table[room : room + neighbours, lane]
                told = nearest[lane, : counts[lane]]
                _estimate(
                    stations,
                    trend,
                    places,
                    first + lane,
                    told,
                    weights,
                    max(left[lane], 0.0),
                    out[first + lane],
                )


@kernel
def _row(i, j):
    """Return the row of the table for station i and an earlier one j, or for the place, which comes before them all."""
    return i * (i + 1) // 2 + j


@kernel
def _estimate(stations, trend, places, row, nearest, weights, left, out):
    """Fill median and deviation at a place from the weights of its stations and what they leave, a part of 1."""
    _, _, _, features, residuals = stations
    _, wanted, _, columns, shares, _ = places
    unmatched = np.empty(trend[0].shape[1])
    median = variance = 0.0
    for step in range(2):
        share = shares[row] if step else 1.0 - shares[row]
        column = columns[row] + step
        if share > 0.0:
            _unmatched(features, wanted[row], trend[2][column], nearest, weights, unmatched)
            estimate = _trend(trend[0][column], wanted[row], trend[2][column])
            median += share * (estimate + _weighted(weights, residuals, nearest, column))
            variance += (
                share * trend[3][column] ** 2 * (left + _square(trend[1][column], unmatched))
            )
    out[0], out[1] = median, math.sqrt(variance)


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
def _correlations(stations, places, diameter, first, nearest, counts, table, integers):
    """
    Fill the correlations of places with their nearest stations and between these; return how many serve one at most.

    Each place is followed by its stations as the lower triangle of one matrix; a station too few is
    unlike all others.
    """
    position, between, known, _, _ = stations
    vectors, _, periods, _, _, lengths = places
    chord = np.empty(nearest.shape[1])
    most = 0
    for lane in range(LANES):
        row = min(first + lane, periods.size - 1)
        counts[lane] = _nearest(position, known, vectors[row], periods[row], nearest[lane], chord)
        most = max(most, counts[lane])
        _fill_distances(
            between,
            nearest[lane],
            counts[lane],
            chord,
            diameter,
            -1.0 / lengths[row],
            table[:, lane],
        )
    used = _row(most + 1, 0)
    exponentials(table[:used].reshape(used * LANES), integers[:used].reshape(used * LANES))
    for lane in range(LANES):
        for i in range(counts[lane] + 1, most + 1):
            for j in range(i):
                table[_row(i, j), lane] = 0.0
            table[_row(i, i), lane] = 1.0
    return most


@kernel
def _fill_distances(between, nearest, count, chord, diameter, scale, column):
    """Fill the distances of a place's stations from it and from each other, each times a scale."""
    column[0] = 0.0
    for i in range(count):
        row = _row(i + 1, 0)
        column[row] = scale * diameter * math.asin(min(0.5 * math.sqrt(chord[i]), 1.0))
        for j in range(i):
            column[row + 1 + j] = scale * between[nearest[i], nearest[j]]
        column[row + 1 + i] = 0.0


@kernel
def _factorise(t, count):
    """Replace the stations' correlations by those of their Cholesky factor, with inverses on the diagonal."""
    for i in range(1, count + 1):
        for j in range(1, i + 1):
            entry, diagonal = _row(i, j), _row(j, j)
            for k in range(1, j):
                one, other = _row(i, k), _row(j, k)
                for lane in range(LANES):
                    t[entry, lane] -= t[one, lane] * t[other, lane]
            for lane in range(LANES):
                t[entry, lane] = (
                    t[entry, lane] * t[diagonal, lane] if j < i else 1.0 / math.sqrt(t[entry, lane])
                )


@kernel
def _solve(t, count, room, left):
    """Fill the weights, from the row ``room`` on, that solve for the correlations with the place, and what is left."""
    left[:] = 1.0
    for i in range(1, count + 1):
        forward, diagonal, weight = _row(i, 0), _row(i, i), room + i - 1
        for k in range(1, i):
            one, other = _row(i, k), room + k - 1
            for lane in range(LANES):
                t[forward, lane] -= t[one, lane] * t[other, lane]
        for lane in range(LANES):
            t[weight, lane] = t[forward, lane] * t[diagonal, lane]
            left[lane] -= t[weight, lane] ** 2
    for i in range(count, 0, -1):
        weight, diagonal = room + i - 1, _row(i, i)
        for k in range(i + 1, count + 1):
            one, other = _row(k, i), room + k - 1
            for lane in range(LANES):
                t[weight, lane] -= t[one, lane] * t[other, lane]
        for lane in range(LANES):
            t[weight, lane] *= t[diagonal, lane]


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
