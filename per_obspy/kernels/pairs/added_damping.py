"""Least damping to add to both buildings of many pairs, from stored spectra."""

import math

from per_obspy.kernels._jit import kernel
from per_obspy.kernels.pairs.resampling import white_noise_correlation

#: Step of the scan over the added damping; halved so many times before the first that is enough.
STEP = 0.02
HALVINGS = 20


@kernel
def least_dampings(log_dampings, stored, pairs, largest, added):
    """
    Fill ``added`` (n,) with the least damping that brings a pair's critical gap to its gap; NaN if none does.

    ``stored`` (n, 2, dampings): logarithms of the radii of both buildings at their periods.
    ``pairs`` (n, 6): log ratio of the periods (NaN: the buildings are uncorrelated), damping of 1
    and of 2, log radius of 1 and of 2, gap. Up to ``largest`` is added as far as both buildings
    still vibrate.
    """
    for index in range(pairs.shape[0]):
        pair, radii = pairs[index], stored[index]
        scale_1 = pair[3] - _log_radius(log_dampings, radii[0], pair[1])
        scale_2 = pair[4] - _log_radius(log_dampings, radii[1], pair[2])
        most = min(largest, 0.99 - max(pair[1], pair[2]))
        added[index] = _least(log_dampings, radii, pair, scale_1, scale_2, most)


@kernel
def _least(log_dampings, radii, pair, scale_1, scale_2, most):
    """Scan the added damping, which need not always help, and halve the step before the first that is enough."""
    if _excess(log_dampings, radii, pair, scale_1, scale_2, 0.0) <= 0.0:
        return 0.0
    steps = math.ceil(most / STEP - 1e-9)
    for k in range(1, steps + 1):
        high = min(k * STEP, most)
        if _excess(log_dampings, radii, pair, scale_1, scale_2, high) <= 0.0:
            low = (k - 1) * STEP
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                if _excess(log_dampings, radii, pair, scale_1, scale_2, middle) <= 0.0:
                    high = middle
                else:
                    low = middle
            return high
    return math.nan


@kernel
def _excess(log_dampings, radii, pair, scale_1, scale_2, added):
    """Return by how much the squared critical gap, eq. (15), is above the squared gap."""
    damping_1, damping_2 = pair[1] + added, pair[2] + added
    radius_1 = math.exp(scale_1 + _log_radius(log_dampings, radii[0], damping_1))
    radius_2 = math.exp(scale_2 + _log_radius(log_dampings, radii[1], damping_2))
    rho = 0.0 if math.isnan(pair[0]) else white_noise_correlation(pair[0], damping_1, damping_2)
    return (
        radius_1 * radius_1
        + radius_2 * radius_2
        - 2.0 * rho * radius_1 * radius_2
        - pair[5] * pair[5]
    )


@kernel
def _log_radius(log_dampings, radii, damping):
    """
    Return the stored logarithm, linear in that of the damping.

    Below the stored dampings that of the smallest; above them the last slope goes on.
    """
    last = log_dampings.size - 1
    if last == 0:
        return radii[0]
    place = math.log(max(damping, 1e-12))
    k = 0
    while k < last - 1 and place > log_dampings[k + 1]:
        k += 1
    part = max((place - log_dampings[k]) / (log_dampings[k + 1] - log_dampings[k]), 0.0)
    return radii[k] + part * (radii[k + 1] - radii[k])
