"""Critical gap of a pair: the smallest clear distance at which two structures do not touch."""

import numpy as np

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray


def critical_gap(per_1: ArrayLike, per_2: ArrayLike, correlation: ArrayLike) -> FloatArray:
    """
    Compute the critical gap by double difference combination of two radii.

    Parameters
    ----------
    per_1, per_2 : array_like
        Pseudo Energy Radius (or peak displacement) of each structure at contact level, m.
    correlation : array_like
        Correlation of the two responses, from -1 to 1, dimensionless.

    Returns
    -------
    gap : ndarray
        Broadcast shape, m; never below ``|per_1 - per_2|``, never above ``per_1 + per_2``.

    Raises
    ------
    ValueError
        If a radius is negative or the correlation is outside [-1, 1].

    Notes
    -----
    ``g = sqrt(r1² + r2² - 2 rho r1 r2)``, computed as ``sqrt((r1 - r2)² + 2 (1 - rho) r1 r2)``,
    whose terms are not negative and do not cancel.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), 11WCEE, equation (15).

    Examples
    --------
    >>> print(critical_gap(3.0, 4.0, [-1.0, 0.0, 1.0]))
    [7. 5. 1.]
    """
    per_1, per_2 = _radii(per_1, per_2)
    correlation = checks.between("correlation", correlation, -1.0, 1.0)

    # Equation (15) as the hypotenuse of two lengths that are not negative
    difference = np.abs(per_1 - per_2)
    uncorrelated = np.sqrt(2.0 * (1.0 - correlation)) * np.sqrt(per_1) * np.sqrt(per_2)
    gap: FloatArray = np.hypot(difference, uncorrelated)

    # Bounds that rounding must not pass
    bounded: FloatArray = np.minimum(np.maximum(gap, difference), per_1 + per_2)
    return bounded


def srss_gap(per_1: ArrayLike, per_2: ArrayLike) -> FloatArray:
    """
    Compute the gap by the square root of the sum of squares: uncorrelated responses.

    Parameters
    ----------
    per_1, per_2 : array_like
        Radius or peak displacement of each structure at contact level, m.

    Returns
    -------
    gap : ndarray
        Broadcast shape, m.

    Raises
    ------
    ValueError
        If a radius is negative.

    Examples
    --------
    >>> print(srss_gap(3.0, 4.0))
    5.0
    """
    return np.hypot(*_radii(per_1, per_2))


def absolute_gap(per_1: ArrayLike, per_2: ArrayLike) -> FloatArray:
    """
    Compute the gap by the absolute sum, an upper bound: both peaks at once, towards each other.

    Parameters
    ----------
    per_1, per_2 : array_like
        Radius or peak displacement of each structure at contact level, m.

    Returns
    -------
    gap : ndarray
        Broadcast shape, m.

    Raises
    ------
    ValueError
        If a radius is negative.

    Examples
    --------
    >>> print(absolute_gap(3.0, 4.0))
    7.0
    """
    per_1, per_2 = _radii(per_1, per_2)
    return per_1 + per_2


def _radii(per_1: ArrayLike, per_2: ArrayLike) -> tuple[FloatArray, FloatArray]:
    return checks.not_negative("per_1", per_1), checks.not_negative("per_2", per_2)
