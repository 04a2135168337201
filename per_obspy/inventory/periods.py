"""
First natural periods from height and structural system, for buildings without a measured period.

A code's period formula is calibrated as a *lower bound*, because a short period gives a large
design force. For pounding that is the unsafe side: displacements grow with the period. The
functions here return medians (best fits) where the literature has them, and each value carries a
logarithmic standard deviation, ``period_log_std``. Buildings that are alike miss their formula
alike: ``period_correlation``.
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
    "masonry": (1.0, 0.0488, 0.75, 0.050, 0.4),
    "reinforced_masonry": (1.0, 0.0488, 0.75, 0.050, 0.4),
    "other": (1.0, 0.0488, 0.75, 0.050, 0.4),
}
EC8_HEIGHT = 40.0

#: Correlation of ln(period / formula) of two neighbours: of one system and number of storeys, of
#: one system, and of others. Reasoned, as no survey of neighbours was found: the deviations above
#: are those of whole stocks, of many builders, codes, infills and soils, of which neighbours share
#: most. With 0.85 the periods of two alike differ by a log-standard deviation of 0.55 of one
#: period's. Even nine tower blocks of one design at one site have different frequencies ("Dynamic
#: response of nine similar tower blocks", by Ellis and Littler from memory; summary only).
ALIKE, ONE_SYSTEM, OTHERS = 0.85, 0.5, 0.2
#: Chance that two neighbours have one system where one is ``other``, of equal and of other numbers
#: of storeys: surveyors noted one system at 0.87 and 0.75 of touching pairs of
#: San José and at 0.56 and 0.32 of Guatemala City (``workflows/outline_accuracy.py``); rounded
#: means.
ONE_SYSTEM_OF_EQUAL_STOREYS, ONE_SYSTEM_OF_OTHERS = 0.7, 0.5


#: Softest ground on which buildings stand as if it were rigid, Vs30 in m/s, and site classes below
#: it: NEHRP E and F.
SOFT_VS30, SOFT_CLASSES = 180.0, ("E", "F")
#: Log-standard deviation of a derived period on softer ground, besides that of the formula. Soil
#: lengthens periods (FEMA 440, NEHRP: some per cent to a third, most of stiff and heavy buildings;
#: from memory); the number is reasoned. Measured periods have the soil in them.
SOFT_GROUND_LOG_STD = 0.15


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


def period_log_std(
    system: ArrayLike, height_log_std: ArrayLike = 0.0, soft_ground: ArrayLike = False
) -> FloatArray:
    """
    Return the logarithmic standard deviation of a derived period: the root of the squares.

    That of the height comes with the exponent of ASCE 7; that of Eurocode 8 is not larger. Soft
    ground adds its own.

    Examples
    --------
    >>> period_log_std("concrete_mrf", [0.0, 0.4]).round(3)
    array([0.3  , 0.469])
    """
    *_, exponent, _, scatter = _coefficients(system)
    by_height = np.hypot(scatter, exponent * np.asarray(height_log_std))
    by_ground = np.where(soft_ground, SOFT_GROUND_LOG_STD, 0.0)
    return np.asarray(np.hypot(by_height, by_ground))


def period_correlation(
    system_1: ArrayLike, system_2: ArrayLike, storeys_1: ArrayLike, storeys_2: ArrayLike
) -> FloatArray:
    """
    Return the correlation of the residuals ln(period / formula) of two neighbours.

    Parameters
    ----------
    system_1, system_2 : array_like of str
        One of ``SYSTEMS`` each.
    storeys_1, storeys_2 : array_like
        Numbers of storeys.

    Returns
    -------
    correlation : ndarray
        From 0 to 1: ``ALIKE``, ``ONE_SYSTEM`` or ``OTHERS``, or between them where a system is
        unknown.

    Examples
    --------
    >>> period_correlation("concrete_mrf", ["concrete_mrf", "steel_mrf", "other"], 9, 9)
    array([0.85 , 0.2  , 0.655])
    """
    first, second = np.asarray(system_1, dtype=str), np.asarray(system_2, dtype=str)
    is_unknown = (first == "other") | (second == "other")
    is_equal = np.equal(storeys_1, storeys_2)
    of_unknown = np.where(is_equal, ONE_SYSTEM_OF_EQUAL_STOREYS, ONE_SYSTEM_OF_OTHERS)
    # the mean over both cases, of one system and of two
    chance = np.where(is_unknown, of_unknown, first == second)
    of_one_system = np.where(is_equal, ALIKE, ONE_SYSTEM)
    return np.asarray(OTHERS + chance * (of_one_system - OTHERS))
