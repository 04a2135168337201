"""
The oscillator of a building: participation, generalised and effective mass, misaligned floors.

Equal floor masses and a first mode that grows linearly with height are assumed; for a building with
a structural model use ``shear_building.equivalent_sdof``.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray


def _height_ratio(contact_height: ArrayLike, height: ArrayLike) -> FloatArray:
    """Return z_c / H after checking both heights, m."""
    contact = checks.positive("contact_height", contact_height)
    total = checks.positive("height", height)
    ratio: FloatArray = np.asarray(contact / total)
    if np.any(ratio > 1.0):
        raise ValueError(
            f"contact_height must not be above the building, got {ratio.max():.6g} times its height"
        )
    return ratio


def contact_participation(
    storeys: ArrayLike, height: ArrayLike, contact_height: ArrayLike
) -> FloatArray:
    """
    Compute the displacement at contact height over the oscillator's, ``q = 3N/(2N+1) z_c/H``.

    Parameters
    ----------
    storeys : array_like
        Number of storeys N.
    height : array_like
        From ground to roof H, m.
    contact_height : array_like
        Height of contact z_c, m; at most the height.

    Returns
    -------
    participation : ndarray
        Dimensionless.

    Raises
    ------
    ValueError
        If a number is not positive, or the contact lies above the building.

    Notes
    -----
    First-mode participation factor times mode shape at the contact, ``sum(m phi) / sum(m phi**2) *
    phi_c``, for N equal masses and ``phi = z/H``. It is 1 for one storey and tends to 1.5.

    Examples
    --------
    >>> contact_participation([1, 2, 3, 5, 10], 30.0, 30.0).round(2)
    array([1.  , 1.2 , 1.29, 1.36, 1.43])
    """
    count = checks.positive("storeys", storeys)
    factor = 3.0 * count / (2.0 * count + 1.0)
    participation: FloatArray = factor * _height_ratio(contact_height, height)
    return participation


def contact_mass(
    mass: ArrayLike, storeys: ArrayLike, height: ArrayLike, contact_height: ArrayLike
) -> FloatArray:
    """
    Compute the first-mode mass at contact height, ``m*_c = M (N+1)(2N+1)/(6 N**2) (H/z_c)**2``.

    The generalised mass ``sum(m phi**2) / phi_c**2`` with the assumptions of
    :func:`contact_participation`: the mass that takes part in an impact, neither the effective
    modal mass nor the mass of a floor.

    Parameters
    ----------
    mass : array_like
        Total mass M, kg.
    storeys : array_like
        Number of storeys N.
    height : array_like
        From ground to roof H, m.
    contact_height : array_like
        Height of contact z_c, m; at most the height.

    Returns
    -------
    mass : ndarray
        kg.

    Raises
    ------
    ValueError
        If a number is not positive, or the contact lies above the building.

    Examples
    --------
    >>> float(contact_mass(300e3, 1, 3.0, 3.0))
    300000.0
    """
    total, count = checks.positive("mass", mass), checks.positive("storeys", storeys)
    ratio = _height_ratio(contact_height, height)
    generalised: FloatArray = (
        total * (count + 1.0) * (2.0 * count + 1.0) / (6.0 * count**2) / ratio**2
    )
    return generalised


def effective_mass_ratio(storeys: ArrayLike) -> FloatArray:
    """
    Compute the effective mass of the first mode over the total mass, ``3(N+1) / (2(2N+1))``.

    ``sum(m phi)**2 / (M sum(m phi**2))`` with the assumptions of :func:`contact_participation`. The
    base shear of the first mode is this share of the mass times the pseudo-acceleration.

    Parameters
    ----------
    storeys : array_like
        Number of storeys N.

    Returns
    -------
    ratio : ndarray
        Dimensionless; 1 for one storey, 0.75 in the limit.

    Raises
    ------
    ValueError
        If a number is not positive.

    Examples
    --------
    >>> effective_mass_ratio([1, 3, 10]).round(3)
    array([1.   , 0.857, 0.786])
    """
    count = checks.positive("storeys", storeys)
    ratio: FloatArray = 3.0 * (count + 1.0) / (2.0 * (2.0 * count + 1.0))
    return ratio


def floor_offset(
    height_1: ArrayLike, storeys_1: ArrayLike, height_2: ArrayLike, storeys_2: ArrayLike
) -> FloatArray:
    """
    Compute the height between the lower roof and the nearest floor of the taller building, m.

    Storeys are taken as equally high within a building. Every argument may be an array (m and
    numbers of storeys).

    Examples
    --------
    >>> float(floor_offset(9.0, 3, 16.0, 4))  # floors of the taller one at 4, 8, 12, 16 m
    1.0
    """
    first, second = checks.positive("height_1", height_1), checks.positive("height_2", height_2)
    storey_1 = first / checks.positive("storeys_1", storeys_1)
    storey_2 = second / checks.positive("storeys_2", storeys_2)
    # Roof of the lower building against the storeys of the taller one
    lower = np.minimum(first, second)
    storey = np.where(first >= second, storey_1, storey_2)
    nearest = np.maximum(np.rint(lower / storey), 1.0)
    offset: FloatArray = np.abs(lower - nearest * storey)
    return offset


def floors_misaligned(offset: ArrayLike, tolerance: float) -> NDArray[np.bool_]:
    """
    Return where a floor offset (m) exceeds the tolerance (m).

    Floors of one building may then hit columns of the other, which is outside the method.
    """
    return np.asarray(np.abs(checks.finite("offset", offset)) > tolerance)
