"""
Probability of pounding over quasi-random periods and dampings of both buildings of many pairs.

The nodes of a pair share one row, so that every step is a loop which the compiler turns into
vectors.
"""

import math

import numpy as np

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.vector_functions import (
    FARTHEST_NORMAL,
    exponentials,
    logarithms,
    normal_tails,
)

#: Rows of a pair's nodes: log period, log damping and log radius of 1, then of 2; two of work.
ROWS, WORK = 8, 6


@kernel
def resampled_probabilities(grid, pairs, nodes, probability):
    """
    Fill the mean over the nodes of the chance that the critical gap exceeds the gap.

    Parameters
    ----------
    grid : tuple of (n_periods,), (n_dampings,) and (n_azimuths, n_dampings, n_periods) ndarray
        Natural logarithms of the stored periods (s), dampings (fractions of critical) and radii
        (m).
    pairs : (n, 13) ndarray
        Columns: row of the azimuth in the radii; logarithm of the period, logarithm of the damping,
        their dispersions, logarithm of the radius of building 1; the same five of building 2; gap
        (m); dispersion of gap and model together.
    nodes : (m, 4) ndarray
        Standard normal deviates of period and damping of building 1, then of 2.
    probability : (n,) ndarray
        Receives the probabilities, from 0 to 1.
    """
    periods = _searchable(grid[0])
    dampings = _searchable(grid[1])
    by_dimension = np.ascontiguousarray(nodes.T)
    # Memory of one pair: its nodes, and the one node at its medians
    rows = np.empty((ROWS, nodes.shape[0]))
    integers = np.empty((2, nodes.shape[0]), np.int64)
    median = np.empty((5, 1))
    median_index = np.empty((2, 1), np.int64)
    for index in range(pairs.shape[0]):
        pair = pairs[index]
        spectrum = grid[2][int(pair[0])]
        for body in range(2):
            own = pair[1 + 5 * body : 6 + 5 * body]
            body_nodes = by_dimension[2 * body : 2 * body + 2]
            body_rows = rows[3 * body : 3 * body + 3]
            # Stored radius at the medians
            median[0, 0] = own[0]
            median[1, 0] = own[1]
            _interpolate(periods, dampings, spectrum, median[:3], median[3:], median_index)
            # Stored radii at the nodes, shifted by the same factor as the building's own
            _scatter(own, body_nodes, body_rows[:2])
            _interpolate(periods, dampings, spectrum, body_rows, rows[WORK:], integers)
            _shift(rows[3 * body + 2], own[4] - median[2, 0])
        probability[index] = _mean_chance(rows, pair[11], pair[12], integers[0])


@kernel
def _searchable(grid):
    """Return the grid filled up with infinity, to one more than a power of two."""
    size = 1
    while size < grid.size:
        size *= 2
    points = np.full(size + 1, np.inf)
    points[: grid.size] = grid
    return points


@kernel
def _scatter(own, nodes, rows):
    """Fill log period and log damping of a building at the nodes."""
    for node in range(nodes.shape[1]):
        rows[0, node] = own[0] + nodes[0, node] * own[2]
        rows[1, node] = own[1] + nodes[1, node] * own[3]


@kernel
def _shift(row, constant):
    for node in range(row.size):
        row[node] += constant


@kernel
def _interpolate(periods, dampings, spectrum, rows, shares, indices):
    """
    Fill the third row with the stored logarithm at log period and log damping, the first two.

    It is linear in both; beyond the grid that of its edge holds.
    """
    _locate(periods, rows[0], indices[0], shares[0])
    _locate(dampings, rows[1], indices[1], shares[1])
    last_plane = spectrum.shape[0] - 1
    last_column = spectrum.shape[1] - 1
    for node in range(rows.shape[1]):
        # Neighbours in period (column) and damping (plane)
        column, plane = indices[0, node], indices[1, node]
        part, share = shares[0, node], shares[1, node]
        next_column, next_plane = min(column + 1, last_column), min(plane + 1, last_plane)
        # Linear in the period at both dampings, then in the damping
        lower = (1.0 - part) * spectrum[plane, column] + part * spectrum[plane, next_column]
        upper = (1.0 - part) * spectrum[next_plane, column] + part * spectrum[
            next_plane, next_column
        ]
        rows[2, node] = (1.0 - share) * lower + share * upper


@kernel
def _locate(points, values, lower, share):
    """Fill the lower neighbour of each value, by halving, and the part of the way to the next."""
    lower[:] = 0
    half = (points.size - 1) // 2
    while half > 0:
        for node in range(values.size):
            further = lower[node] + half
            lower[node] = further if points[further] < values[node] else lower[node]
        half //= 2
    # Values beyond the grid stay at its edge
    for node in range(values.size):
        left = points[lower[node]]
        share[node] = min(max((values[node] - left) / (points[lower[node] + 1] - left), 0.0), 1.0)


@kernel
def _mean_chance(rows, gap, dispersion, integers):
    """Return the mean chance over the nodes that a lognormal critical gap exceeds the gap."""
    count = rows.shape[1]
    _log_critical_gaps(rows, integers)
    margins = rows[WORK]
    # Without dispersion: part of the nodes that exceed the gap
    if gap == 0.0 or dispersion == 0.0:
        log_gap = math.log(gap) if gap > 0.0 else -np.inf
        exceeding = 0.0
        for node in range(count):
            exceeding += 1.0 if margins[node] > log_gap else 0.0
        return exceeding / count
    # With dispersion: mean normal tail
    log_gap = math.log(gap)
    for node in range(count):
        deviate = (log_gap - margins[node]) / dispersion
        margins[node] = min(max(deviate, -FARTHEST_NORMAL), FARTHEST_NORMAL)
    normal_tails(margins, rows[WORK + 1], integers)
    total = 0.0
    for node in range(count):
        total += margins[node]
    return total / count


@kernel
def _log_critical_gaps(rows, integers):
    """
    Fill the first row of work with the logarithm of the critical gap, minus infinity for none.

    With q the smaller radius over the larger one, ``r1² + r2² - 2 rho r1 r2 = larger² (1 + q (q - 2
    rho))``.
    """
    _correlations(rows, integers)
    work, larger = rows[WORK], rows[2]
    ratio = rows[5]
    # Larger radius, and q
    for node in range(work.size):
        log_1, log_2 = rows[2, node], rows[5, node]
        larger[node], ratio[node] = max(log_1, log_2), -abs(log_1 - log_2)
    exponentials(ratio, integers)
    # Squared critical gap over the squared larger radius
    for node in range(work.size):
        work[node] = 1.0 + ratio[node] * (ratio[node] - 2.0 * work[node])
        ratio[node] = work[node]
        work[node] = max(work[node], 1e-300)
    logarithms(work, integers)
    for node in range(work.size):
        work[node] = larger[node] + 0.5 * work[node] if ratio[node] > 0.0 else -np.inf


@kernel
def _correlations(rows, integers):
    """
    Fill the first row of work with the correlations, eq. (16).

    Roots of the period ratio and of the dampings replace the rows of the nodes.
    """
    # Halves of the logarithms
    half_ratio, root_1, root_2 = rows[0], rows[1], rows[4]
    for node in range(half_ratio.size):
        half_ratio[node] = 0.5 * (rows[0, node] - rows[3, node])
        root_1[node], root_2[node] = 0.5 * rows[1, node], 0.5 * rows[4, node]
    exponentials(half_ratio, integers)
    exponentials(root_1, integers)
    exponentials(root_2, integers)
    for node in range(half_ratio.size):
        rows[WORK, node] = _correlation(half_ratio[node], root_1[node], root_2[node])


@kernel
def white_noise_correlation(log_ratio, damping_1, damping_2):
    """Return eq. (16) for oscillators whose periods differ by a factor exp(log_ratio); 1 at 0/0."""
    return _correlation(math.exp(0.5 * log_ratio), math.sqrt(damping_1), math.sqrt(damping_2))


@kernel
def _correlation(root_ratio, root_1, root_2):
    """Return eq. (16) from the roots of the ratio of the periods and of both dampings; 1 at 0/0."""
    # The equation divided by the squared ratio of the periods: symmetric in both structures
    inverse, damping_1, damping_2 = 1.0 / root_ratio, root_1 * root_1, root_2 * root_2
    ratio, inverse_ratio = root_ratio * root_ratio, inverse * inverse
    detuning, product = ratio - inverse_ratio, damping_1 * damping_2
    above = 8.0 * root_1 * root_2 * (damping_2 * root_ratio + damping_1 * inverse)
    below = (
        detuning**2 + 4.0 * product * (ratio + inverse_ratio) + 4.0 * (damping_1**2 + damping_2**2)
    )
    return above / below if below > 0.0 else 1.0
