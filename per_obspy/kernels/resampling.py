"""Probability of pounding over quasi-random periods and dampings of both buildings of many pairs."""

import math

import numpy as np

from ._jit import kernel


@kernel
def resampled_probabilities(grid, pairs, nodes, probability):
    """
    Fill ``probability`` (n,) with the mean over the nodes (m, 4) of the chance that the critical gap exceeds the gap.

    ``grid``: logarithms of the stored periods, dampings and radii (azimuth, damping, period). ``pairs`` (n, 13): row
    of the azimuth; log period, log damping, dispersions of period and of damping, log radius of 1; the same five of
    2; gap; dispersion of gap and model.
    """
    log_periods, log_dampings, log_radii = grid
    for index in range(pairs.shape[0]):
        pair = pairs[index]
        spectrum = log_radii[int(pair[0])]
        median_1 = _interpolated(log_periods, log_dampings, spectrum, pair[1], pair[2])
        median_2 = _interpolated(log_periods, log_dampings, spectrum, pair[6], pair[7])
        total = 0.0
        for node in nodes:
            period_1, damping_1 = pair[1] + node[0] * pair[3], pair[2] + node[1] * pair[4]
            period_2, damping_2 = pair[6] + node[2] * pair[8], pair[7] + node[3] * pair[9]
            radius_1 = math.exp(
                pair[5] + _interpolated(log_periods, log_dampings, spectrum, period_1, damping_1) - median_1
            )
            radius_2 = math.exp(
                pair[10] + _interpolated(log_periods, log_dampings, spectrum, period_2, damping_2) - median_2
            )
            rho = white_noise_correlation(period_1 - period_2, math.exp(damping_1), math.exp(damping_2))
            squared = radius_1 * radius_1 + radius_2 * radius_2 - 2.0 * rho * radius_1 * radius_2
            total += _chance(math.sqrt(max(squared, 0.0)), pair[11], pair[12])
        probability[index] = total / nodes.shape[0]


@kernel
def _chance(critical_gap, gap, dispersion):
    """Return the probability that a lognormal critical gap exceeds the gap."""
    if critical_gap == 0.0 or gap == 0.0 or dispersion == 0.0:
        return 1.0 if critical_gap > gap else 0.0
    return 0.5 * math.erfc(-math.log(critical_gap / gap) / (dispersion * math.sqrt(2.0)))


@kernel
def white_noise_correlation(log_ratio, damping_1, damping_2):
    """Return eq. (16) for oscillators whose periods differ by a factor exp(log_ratio); 1 at 0 / 0."""
    ratio = math.exp(log_ratio)
    detuning = ratio - 1.0 / ratio
    product = damping_1 * damping_2
    above = 8.0 * math.sqrt(product) * (damping_2 * math.sqrt(ratio) + damping_1 / math.sqrt(ratio))
    below = detuning**2 + 4.0 * product * (ratio + 1.0 / ratio) + 4.0 * (damping_1**2 + damping_2**2)
    return above / below if below > 0.0 else 1.0


@kernel
def _interpolated(log_periods, log_dampings, spectrum, log_period, log_damping):
    """Return the stored logarithm, linear in both logarithms; beyond the grid its edge."""
    column, part = _between(log_periods, log_period)
    plane, share = _between(log_dampings, log_damping)
    next_plane, next_column = min(plane + 1, log_dampings.size - 1), min(column + 1, log_periods.size - 1)
    lower = (1.0 - part) * spectrum[plane, column] + part * spectrum[plane, next_column]
    upper = (1.0 - part) * spectrum[next_plane, column] + part * spectrum[next_plane, next_column]
    return (1.0 - share) * lower + share * upper


@kernel
def _between(grid, value):
    """Return the lower neighbour on a grid and the part of the way to the next."""
    if grid.size == 1:
        return 0, 0.0
    lower = min(max(np.searchsorted(grid, value) - 1, 0), grid.size - 2)
    return lower, min(max((value - grid[lower]) / (grid[lower + 1] - grid[lower]), 0.0), 1.0)
