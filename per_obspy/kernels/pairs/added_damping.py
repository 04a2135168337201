"""Least damping to add to both buildings of many pairs, from stored spectra."""

import math

from per_obspy.kernels._jit import kernel

#: Step of the scan over the added damping; halved so many times before the first that is enough.
SCAN_STEP = 0.02
HALVINGS = 20


@kernel
def least_dampings(log_dampings, stored, pairs, largest, added):
    """
    Fill the least damping that brings the critical gap of each pair to its gap; NaN if none does.

    Parameters
    ----------
    log_dampings : (n_dampings,) ndarray
        Natural logarithms of the stored dampings (fractions of critical), rising.
    stored : (n, 2, n_dampings) ndarray
        Natural logarithms of the radii (m) of both buildings at their periods.
    pairs : (n, 6) ndarray
        Columns: logarithm of the ratio of the periods (NaN: the buildings are uncorrelated),
        damping of building 1 and of 2 (fractions of critical), logarithm of the radius (m) of 1 and
        of 2, gap (m).
    largest : float
        Largest damping to add, as far as both buildings still vibrate, fraction of critical.
    added : (n,) ndarray
        Receives the damping to add to both buildings, fraction of critical.
    """
    for index in range(pairs.shape[0]):
        pair = pairs[index]
        radii = stored[index]
        # Factors from the stored radii to those of the pair
        scale_1 = pair[3] - _log_radius(log_dampings, radii[0], pair[1])
        scale_2 = pair[4] - _log_radius(log_dampings, radii[1], pair[2])
        most = min(largest, 0.99 - max(pair[1], pair[2]))
        added[index] = _least(log_dampings, radii, pair, scale_1, scale_2, most)


@kernel
def _least(log_dampings, radii, pair, scale_1, scale_2, most):
    """Return the least added damping by a scan: more damping does not always help."""
    if _excess(log_dampings, radii, pair, scale_1, scale_2, 0.0) <= 0.0:
        return 0.0
    steps = math.ceil(most / SCAN_STEP - 1e-9)
    for k in range(1, steps + 1):
        high = min(k * SCAN_STEP, most)
        if _excess(log_dampings, radii, pair, scale_1, scale_2, high) <= 0.0:
            # Halve the step before the first damping that is enough
            low = (k - 1) * SCAN_STEP
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
    damping_1 = pair[1] + added
    damping_2 = pair[2] + added
    # Radii at the new dampings
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
    Return the stored logarithm at a damping, linear in the logarithm of the damping.

    Below the stored dampings that of the smallest; above them the last slope goes on.
    """
    last = log_dampings.size - 1
    if last == 0:
        return radii[0]
    # Lower neighbour among the stored dampings
    log_damping = math.log(max(damping, 1e-12))
    k = 0
    while k < last - 1 and log_damping > log_dampings[k + 1]:
        k += 1
    width = log_dampings[k + 1] - log_dampings[k]
    part = max((log_damping - log_dampings[k]) / width, 0.0)
    return radii[k] + part * (radii[k + 1] - radii[k])


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
