"""
First natural periods from height and structural system, for buildings without a measured period.

A code's period formula is calibrated as a *lower bound*, because a short period gives a large
design force. For pounding that is the unsafe side: displacements grow with the period. The
functions here return medians (best fits) where the literature has them, and each value carries a
logarithmic standard deviation, ``period_log_std``.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.inventory.schema import SYSTEMS

#: system -> best fit / lower bound, coefficient of the lower bound in s/m**exponent and exponent of
#: ASCE 7, table 12.8-2, metric; C_t of EN 1998-1, eq. (4.6), for buildings up to EC8_HEIGHT;
#: logarithmic standard deviation of a period by either formula. The two ratios are those of Goel &
#: Chopra (1997). No best fit is known for the other systems: their lower bound is used as a median,
#: unverified. Buildings with concrete walls are among ASCE 7's "all other structural systems". The
#: deviation is 0.4 for masonry, unknown systems, and walls, whose period depends on their area more
#: than on the height.
_COEFFICIENTS = {
    "steel_mrf": (1.25, 0.0724, 0.80, 0.085, 0.3),
    "concrete_mrf": (1.13, 0.0466, 0.90, 0.075, 0.3),
    "concrete_frame_wall": (1.0, 0.0488, 0.75, 0.050, 0.4),
    "concrete_wall": (1.0, 0.0488, 0.75, 0.050, 0.4),
    "ebf_brbf": (1.0, 0.0731, 0.75, 0.075, 0.3),
    "other": (1.0, 0.0488, 0.75, 0.050, 0.4),
}
EC8_HEIGHT = 40.0


def _coefficients(system: ArrayLike) -> NDArray[Any]:
    """Return the five coefficients of structural systems, (5, ...); ValueError if one is none."""
    names = np.asarray(system, dtype=str)
    is_system = names[..., None] == np.array(SYSTEMS)
    unknown = names[~is_system.any(axis=-1)]
    if unknown.size:
        raise ValueError(f"system must be one of {', '.join(SYSTEMS)}, got {str(min(unknown))!r}")
    # A row of the table for each name
    return np.moveaxis(is_system @ np.array([_COEFFICIENTS[name] for name in SYSTEMS]), -1, 0)


def asce7_period(height: ArrayLike, system: ArrayLike) -> FloatArray:
    """
    Compute the median period ``ratio * C h**x`` with the coefficients of ASCE 7.

    For moment frames this is the best fit of Goel & Chopra (1.25 and 1.13 times the code's lower
    bound). For the other systems it is the value of the code, which is a lower bound
    (unverified as a median).

    Parameters
    ----------
    height : array_like
        From ground to roof, m.
    system : array_like of str
        One of ``SYSTEMS``; broadcast with the height.

    Returns
    -------
    period : ndarray
        Median first natural period, s.

    Raises
    ------
    ValueError
        If a height is not positive or a system is unknown.

    References
    ----------
    ASCE 7-16, 12.8.2.1; Goel & Chopra (1997), J. Struct. Eng. 123(11), 1454-1461.

    Examples
    --------
    >>> asce7_period([10.0, 30.0], "concrete_mrf").round(2)
    array([0.42, 1.12])
    """
    ratio, coefficient, exponent, *_ = _coefficients(system)
    # Median = best fit over lower bound, times the code's lower bound
    period: FloatArray = ratio * coefficient * checks.positive("height", height) ** exponent
    return period


def ec8_period(height: ArrayLike, system: ArrayLike) -> FloatArray:
    """
    Compute the period ``C_t h**0.75`` of Eurocode 8; above 40 m that of :func:`asce7_period`.

    The code gives one approximate value, not marked as a bound; it is used as the median. The two
    forms do not meet at 40 m.

    Parameters
    ----------
    height : array_like
        From ground to roof, m.
    system : array_like of str
        One of ``SYSTEMS``; broadcast with the height.

    Returns
    -------
    period : ndarray
        First natural period, s.

    Raises
    ------
    ValueError
        If a height is not positive or a system is unknown.

    References
    ----------
    EN 1998-1:2004, 4.3.3.2.2(3), eq. (4.6).

    Examples
    --------
    >>> float(ec8_period(16.0, "concrete_mrf").round(2))
    0.6
    """
    metres = checks.positive("height", height)
    low = _coefficients(system)[3] * metres**0.75
    return np.where(metres <= EC8_HEIGHT, low, asce7_period(metres, system))


def period_log_std(system: ArrayLike, height_log_std: ArrayLike = 0.0) -> FloatArray:
    """
    Return the logarithmic standard deviation of a derived period: the root of both squares.

    That of the height comes with the exponent of ASCE 7; that of Eurocode 8 is not larger.

    Examples
    --------
    >>> period_log_std("concrete_mrf", [0.0, 0.4]).round(3)
    array([0.3  , 0.469])
    """
    *_, exponent, _, scatter = _coefficients(system)
    return np.asarray(np.hypot(scatter, exponent * np.asarray(height_log_std)))
