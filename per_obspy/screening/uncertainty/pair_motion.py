"""What the motion of two oscillators at one place, and the doubt about it, mean for the gap between them."""

import numpy as np
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray

#: Below this period (s) the published correlation has another form.
SHORT = 0.109


def period_correlation(period_1: ArrayLike, period_2: ArrayLike) -> FloatArray:
    """
    Correlation of the residuals of ln SA at two periods of one record; used here for PER.

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
    c1 = 1.0 - np.cos(np.pi / 2.0 - 0.366 * np.log(high / np.maximum(low, SHORT)))
    # the exponent of long periods, whose c2 does not count, would overflow
    fading = 1.0 / (1.0 + np.exp(100.0 * np.minimum(high, 1.0) - 5.0))
    apart = np.where(high > low, (high - low) / np.where(high > low, high - 0.0099, 1.0), 0.0)
    c2 = 1.0 - 0.105 * (1.0 - fading) * apart
    c3 = np.where(high < SHORT, c2, c1)
    c4 = c1 + 0.5 * (np.sqrt(np.maximum(c3, 0.0)) - c3) * (1.0 + np.cos(np.pi * low / SHORT))
    mixed = np.where(high < 0.2, np.minimum(c2, c4), c4)
    correlation: FloatArray = np.where(high <= SHORT, c2, np.where(low > SHORT, c1, mixed))
    return correlation


def pair_motion(
    radii: tuple[FloatArray, FloatArray],
    ln_ratios: tuple[FloatArray, FloatArray],
    log_stds: tuple[FloatArray, FloatArray],
    periods: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """
    Return how the gap that a pair needs changes with the motion of both oscillators, and its log-standard deviation.

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
        both radii alike change the gap alike, a radius of nothing counts nothing, and no
        correlation of the two responses, in which the gap of radii that nearly cancel would be
        infinitely sensitive, is needed. The deviation is that of the same gap to first order, with
        the correlation of :func:`period_correlation` between the two.
    """
    squares = [np.square(radius) for radius in radii]
    at_site = [
        square * np.exp(2.0 * ratio) for square, ratio in zip(squares, ln_ratios, strict=True)
    ]
    before, after = squares[0] + squares[1], at_site[0] + at_site[1]
    moving = before > 0.0
    weights = [np.divide(one, after, out=np.full_like(after, 0.5), where=moving) for one in at_site]
    ln_ratio = 0.5 * np.log(np.divide(after, before, out=np.ones_like(after), where=moving))
    first, second = (weight * std for weight, std in zip(weights, log_stds, strict=True))
    variance = first**2 + second**2 + 2.0 * period_correlation(*periods) * first * second
    return ln_ratio, np.sqrt(np.maximum(variance, 0.0))
