"""
Simple kriging of residuals about a fitted trend at many sites, each from its nearest stations.

Only stations that know the site's period serve it. The result for one site does not depend on which
others share its block (bit for bit).
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.vector_functions import exponentials

#: Sites next to each other: a constant trip count, which the compiler turns into vectors.
SITE_LANES = 64


@kernel
def kriged(stations, trend, sites, diameter, neighbours, out):
    """
    Fill median and standard deviation at every site.

    Parameters
    ----------
    stations : tuple of ndarray
        Unit vectors (n, 3), distances between stations (n, n) m, first and last known period (n, 2)
        s, features (n, f), residuals (n, k) on a grid of k periods.
    trend : tuple of ndarray
        On the same grid: coefficients (k, 1 + f), their covariance for a deviation of 1 (k, 1 + f,
        1 + f), middles of the features (k, f), NaN for one that is not used, deviation of the
        residual (k,).
    sites : tuple of ndarray
        Unit vectors (m, 3), features (m, f), period (m,) s, its lower neighbour on the grid (m,)
        int, part of the way to the next (m,), decay length of the correlation (m,) m.
    diameter : float
        Diameter of the sphere, m.
    neighbours : int
        Largest number of stations that serve a site.
    out : (m, 2) ndarray
        Receives median and standard deviation, in the unit of the residuals; a site that no station
        serves is left as it is.
    """
    # Memory of a block: triangle of correlations and, below it, the weights, one column per site
    nearest = np.empty((SITE_LANES, neighbours), dtype=np.int64)
    counts = np.empty(SITE_LANES, dtype=np.int64)
    weights_row = _row(neighbours + 1, 0)
    table = np.zeros((weights_row + neighbours, SITE_LANES))
    integers = np.empty((weights_row, SITE_LANES), dtype=np.int64)
    unexplained, weights = np.empty(SITE_LANES), np.empty(neighbours)
    for first in range(0, out.shape[0], SITE_LANES):
        # Weights of a block
        count = _correlations(stations, sites, diameter, first, nearest, counts, table, integers)
        _factorise(table, count)
        _solve(table, count, weights_row, unexplained)
        # Estimates, site by site
        for lane in range(min(SITE_LANES, out.shape[0] - first)):
            if counts[lane] > 0:
                weights[:] = table[weights_row : weights_row + neighbours, lane]
                serving = nearest[lane, : counts[lane]]
                variance = max(unexplained[lane], 0.0)
                row = first + lane
                _estimate(stations, trend, sites, row, serving, weights, variance, out[row])


@kernel
def _row(i, j):
    """Return the row of the table for station i and an earlier one j; the site is number 0."""
    return i * (i + 1) // 2 + j


@kernel
def _estimate(stations, trend, sites, row, nearest, weights, unexplained, out):
    """Fill median and deviation at a site from its stations' weights and unexplained variance."""
    _, _, _, features, residuals = stations
    _, site_features, _, columns, shares, _ = sites
    unmatched = np.empty(trend[0].shape[1])
    median = variance = 0.0
    # Both neighbours on the grid of periods
    for step in range(2):
        share = shares[row] if step else 1.0 - shares[row]
        column = columns[row] + step
        if share > 0.0:
            own = site_features[row]
            middles = trend[2][column]
            # Median: trend and weighted residuals
            _unmatched(features, own, middles, nearest, weights, unmatched)
            estimate = _trend(trend[0][column], own, middles)
            estimate -= _unknown(trend[0][column], own, middles, unmatched)
            median += share * (estimate + _weighted(weights, residuals, nearest, column))
            # Variance: of the residual, and of the part of the trend that weights do not cancel
            variance += (
                share * trend[3][column] ** 2 * (unexplained + _square(trend[1][column], unmatched))
            )
    out[0] = median
    out[1] = math.sqrt(variance)


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
    count = 0
    room = nearest.size
    for station in range(position.shape[0]):
        if not known[station, 0] <= period <= known[station, 1]:
            continue
        # Squared chord between site and station
        square = 0.0
        for axis in range(3):
            square += (position[station, axis] - vector[axis]) ** 2
        if count == room and square >= chord[room - 1]:
            continue
        # Insert the station in order
        rank = min(count, room - 1)
        while rank > 0 and chord[rank - 1] > square:
            chord[rank] = chord[rank - 1]
            nearest[rank] = nearest[rank - 1]
            rank -= 1
        chord[rank] = square
        nearest[rank] = station
        count = min(count + 1, room)
    return count


@kernel
def _correlations(stations, sites, diameter, first, nearest, counts, table, integers):
    """
    Fill the correlations of sites and their nearest stations; return the largest number of these.

    Each site is followed by its stations as the lower triangle of one matrix; a station too few is
    unlike all others.
    """
    position, separations, known, _, _ = stations
    vectors, _, periods, _, _, lengths = sites
    chord = np.empty(nearest.shape[1])
    most = 0
    # Distances over the decay length, of each site
    for lane in range(SITE_LANES):
        row = min(first + lane, periods.size - 1)
        counts[lane] = _nearest(position, known, vectors[row], periods[row], nearest[lane], chord)
        most = max(most, counts[lane])
        scale = -1.0 / lengths[row]
        column = table[:, lane]
        _fill_distances(separations, nearest[lane], counts[lane], chord, diameter, scale, column)
    # Correlations of the whole block
    used = _row(most + 1, 0)
    exponentials(
        table[:used].reshape(used * SITE_LANES), integers[:used].reshape(used * SITE_LANES)
    )
    for lane in range(SITE_LANES):
        for i in range(counts[lane] + 1, most + 1):
            for j in range(i):
                table[_row(i, j), lane] = 0.0
            table[_row(i, i), lane] = 1.0
    return most


@kernel
def _fill_distances(separations, nearest, count, chord, diameter, scale, column):
    """Fill the distances of a site's stations from it and from each other, each times a scale."""
    column[0] = 0.0
    for i in range(count):
        # Arc between site and station from the chord, then the stored distances
        row = _row(i + 1, 0)
        column[row] = scale * diameter * math.asin(min(0.5 * math.sqrt(chord[i]), 1.0))
        for j in range(i):
            column[row + 1 + j] = scale * separations[nearest[i], nearest[j]]
        column[row + 1 + i] = 0.0


@kernel
def _factorise(t, count):
    """Replace the stations' correlations by their Cholesky factor, inverse on the diagonal."""
    for i in range(1, count + 1):
        for j in range(1, i + 1):
            entry, diagonal = _row(i, j), _row(j, j)
            # Entry less the product of the earlier columns
            for k in range(1, j):
                row_i, row_j = _row(i, k), _row(j, k)
                for lane in range(SITE_LANES):
                    t[entry, lane] -= t[row_i, lane] * t[row_j, lane]
            for lane in range(SITE_LANES):
                t[entry, lane] = (
                    t[entry, lane] * t[diagonal, lane] if j < i else 1.0 / math.sqrt(t[entry, lane])
                )


@kernel
def _solve(t, count, weights_row, unexplained):
    """Fill the stations' weights from ``weights_row`` on, and the unexplained part of variance."""
    unexplained[:] = 1.0
    # Forward substitution with the correlations of the site
    for i in range(1, count + 1):
        forward, diagonal, weight = _row(i, 0), _row(i, i), weights_row + i - 1
        for k in range(1, i):
            factor, earlier = _row(i, k), weights_row + k - 1
            for lane in range(SITE_LANES):
                t[forward, lane] -= t[factor, lane] * t[earlier, lane]
        # Each station explains the square of its transformed correlation
        for lane in range(SITE_LANES):
            t[weight, lane] = t[forward, lane] * t[diagonal, lane]
            unexplained[lane] -= t[weight, lane] ** 2
    # Backward substitution gives the weights
    for i in range(count, 0, -1):
        weight, diagonal = weights_row + i - 1, _row(i, i)
        for k in range(i + 1, count + 1):
            factor, later = _row(k, i), weights_row + k - 1
            for lane in range(SITE_LANES):
                t[weight, lane] -= t[factor, lane] * t[later, lane]
        for lane in range(SITE_LANES):
            t[weight, lane] *= t[diagonal, lane]


@kernel
def _feature(values, middles, number):
    """Return a feature about its middle; 0 if it is not used or not known."""
    value = values[number] - middles[number]
    return 0.0 if math.isnan(value) else value


@kernel
def _trend(coefficients, values, middles):
    """Return the trend at a site."""
    total = coefficients[0]
    for number in range(middles.size):
        total += coefficients[number + 1] * _feature(values, middles, number)
    return total


@kernel
def _unknown(coefficients, values, middles, unmatched):
    """
    Return by how much a trend is too low at a site of which a feature is unknown, with its sign.

    The feature is that of its stations, by their weights: their residuals lack what theirs does.
    """
    total = 0.0
    for number in range(middles.size):
        if math.isnan(values[number]):
            total += coefficients[number + 1] * unmatched[number + 1]
    return total


@kernel
def _unmatched(features, site_features, middles, nearest, weights, out):
    """Fill the part of the site's trend that the weighted stations do not cancel."""
    # Mean
    out[0] = 1.0
    for i in range(nearest.size):
        out[0] -= weights[i]
    # Features
    for number in range(middles.size):
        out[number + 1] = _feature(site_features, middles, number)
        for i in range(nearest.size):
            out[number + 1] -= weights[i] * _feature(features[nearest[i]], middles, number)


@kernel
def _square(matrix, vector):
    """Return the quadratic form of a symmetric matrix, at least 0."""
    total = 0.0
    for i in range(vector.size):
        for j in range(vector.size):
            total += vector[i] * matrix[i, j] * vector[j]
    return max(total, 0.0)
