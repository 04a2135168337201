"""Motion of two oscillators at one site: median and dispersion of the gap between them."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray

#: Below this period (s) the published correlation has another form.
SHORT = 0.109


def period_correlation(period_1: ArrayLike, period_2: ArrayLike) -> FloatArray:
    """
    Return the correlation of the residuals of ln SA at two periods of one record; used for PER.

    Parameters
    ----------
    period_1, period_2 : array_like
        s; published for 0.01 to 10 s.

    Returns
    -------
    correlation : ndarray
        Broadcast shape, dimensionless, 1 for equal periods.

    Raises
    ------
    ValueError
        If a period is not positive.

    References
    ----------
    Baker & Jayaram (2008), Earthquake Spectra 24, 299-317, equations (2) to (6).

    Examples
    --------
    >>> print(period_correlation(1.0, [1.0, 2.0]).round(3))
    [1.    0.749]
    """
    first, second = np.broadcast_arrays(
        checks.positive("period_1", period_1), checks.positive("period_2", period_2)
    )
    low, high = np.minimum(first, second), np.maximum(first, second)
    # equations (2) to (5)
    c1 = 1.0 - np.cos(np.pi / 2.0 - 0.366 * np.log(high / np.maximum(low, SHORT)))
    c2 = _c2(low, high)
    c3 = np.where(high < SHORT, c2, c1)
    c4 = c1 + 0.5 * (np.sqrt(np.maximum(c3, 0.0)) - c3) * (1.0 + np.cos(np.pi * low / SHORT))
    # equation (6): the branch of both periods
    mixed = np.where(high < 0.2, np.minimum(c2, c4), c4)
    correlation: FloatArray = np.where(high <= SHORT, c2, np.where(low > SHORT, c1, mixed))
    return correlation


def _c2(low: FloatArray, high: FloatArray) -> FloatArray:
    """Return C2, equation (3), for short periods."""
    # the exponent of long periods, whose c2 does not count, would overflow
    fading = 1.0 / (1.0 + np.exp(100.0 * np.minimum(high, 1.0) - 5.0))
    longer = high > low
    distance = np.where(longer, (high - low) / np.where(longer, high - 0.0099, 1.0), 0.0)
    coefficient: FloatArray = 1.0 - 0.105 * (1.0 - fading) * distance
    return coefficient


def pair_motion(
    radii: tuple[FloatArray, FloatArray],
    ln_ratios: tuple[FloatArray, FloatArray],
    log_stds: tuple[FloatArray, FloatArray],
    periods: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """
    Return ln of the needed gap at the site over that at the record, and its deviation.

    Parameters
    ----------
    radii : pair of (n_pairs,) ndarray
        Both radii at contact height, m.
    ln_ratios : pair of (n_pairs,) ndarray
        Logarithm of the radius at the site over this one, dimensionless.
    log_stds : pair of (n_pairs,) ndarray
        Log-standard deviations of the radii at the site, dimensionless.
    periods : pair of (n_pairs,) ndarray
        s.

    Returns
    -------
    ln_ratio, log_std : (n_pairs,) ndarray
        Dimensionless. The ratio is that of the roots of the sums of squares at the site and here:
        both radii alike change the gap alike, a radius of 0 has no weight, and no correlation of
        the two responses, in which the gap of radii that nearly cancel would be infinitely
        sensitive, is needed. The deviation is that of the same gap to first order, with the
        correlation of :func:`period_correlation` between the two.
    """
    (radius_1, radius_2), (ratio_1, ratio_2) = radii, ln_ratios
    square_1, square_2 = np.square(radius_1), np.square(radius_2)
    site_1, site_2 = square_1 * np.exp(2.0 * ratio_1), square_2 * np.exp(2.0 * ratio_2)
    # squared gap of uncorrelated responses, here and at the site
    before, after = square_1 + square_2, site_1 + site_2
    moving = before > 0.0
    growth = np.divide(after, before, out=np.ones_like(after), where=moving)
    ln_ratio = 0.5 * np.log(growth)
    # first-order propagation of both correlated deviations
    weight_1, weight_2 = _share(site_1, after, moving), _share(site_2, after, moving)
    first, second = weight_1 * log_stds[0], weight_2 * log_stds[1]
    variance = first**2 + second**2 + 2.0 * period_correlation(*periods) * first * second
    return ln_ratio, np.sqrt(np.maximum(variance, 0.0))


def _share(part: FloatArray, whole: FloatArray, moving: NDArray[np.bool_]) -> FloatArray:
    """Return part / whole of the squared gap, 0.5 for pairs without motion."""
    return np.divide(part, whole, out=np.full_like(whole, 0.5), where=moving)
