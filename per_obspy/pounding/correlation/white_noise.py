"""Correlation of two linear structures under white noise: double difference, equation (16)."""

import numpy as np

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray


def ddc_correlation(
    period_1: ArrayLike, damping_1: ArrayLike, period_2: ArrayLike, damping_2: ArrayLike
) -> FloatArray:
    """
    Compute the correlation of two oscillators under white noise, exact for any damping.

    Parameters
    ----------
    period_1, period_2 : array_like
        Undamped periods, s.
    damping_1, damping_2 : array_like
        Fractions of critical, at least 0 and below 1, dimensionless.

    Returns
    -------
    correlation : ndarray
        Broadcast shape, dimensionless, from 0 to 1. Two undamped oscillators give 1 for equal
        periods, else 0.

    Raises
    ------
    ValueError
        If a period is not positive or a damping is outside [0, 1).

    Notes
    -----
    With b = T2/T1, written here in a form that does not change when 1 and 2 are exchanged::

                        8 sqrt(xi1 xi2) (xi2 + xi1 b) b^1.5
        rho = -------------------------------------------------------------
              (1 - b²)² + 4 xi1 xi2 (1 + b²) b + 4 (xi1² + xi2²) b²

    References
    ----------
    Valles-Mattox & Reinhorn (1996), 11WCEE, equation (16); Jeng, Kasai & Maison (1992), Earthquake
    Spectra 8(2).

    Examples
    --------
    >>> print(round(float(ddc_correlation(1.0, 0.05, 1.2, 0.05)), 6))
    0.229814
    """
    period_1 = checks.positive("period_1", period_1)
    period_2 = checks.positive("period_2", period_2)
    damping_1 = checks.fraction_of_critical("damping_1", damping_1)
    damping_2 = checks.fraction_of_critical("damping_2", damping_2)
    ratio = period_1 / period_2

    # T1/T2 - T2/T1 without cancellation
    detuning = (period_1 - period_2) * (1 / period_1 + 1 / period_2)

    # Divided by the largest of the three, squares of small dampings cannot underflow
    scale = np.maximum(np.maximum(damping_1, damping_2), np.abs(detuning))
    same = scale == 0
    scale = np.where(same, 1.0, scale)
    above, below = _fraction(ratio, damping_1 / scale, damping_2 / scale, detuning / scale)
    return np.where(same, 1.0, np.minimum(above / np.where(same, 1.0, below), 1.0))[()]


def _fraction(
    ratio: FloatArray, damping_1: FloatArray, damping_2: FloatArray, detuning: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return numerator and denominator of equation (16), both divided by b²."""
    product = damping_1 * damping_2
    above = 8 * np.sqrt(product) * (damping_2 * np.sqrt(ratio) + damping_1 / np.sqrt(ratio))
    below = detuning**2 + 4 * product * (ratio + 1 / ratio) + 4 * (damping_1**2 + damping_2**2)
    return above, below
