"""
The oscillator of a building: participation, generalised and effective mass, misaligned floors.

Equal floor masses and a first mode that grows linearly with height are assumed; for a building with
a structural model use ``shear_building.equivalent_sdof``. Numbers of storeys N are at least one,
heights in m are above zero and those of a contact at most the height of the building; what is not
known is NaN.
"""

import numpy as np
from numpy.typing import ArrayLike

from per_obspy.checks import FloatArray


def contact_participation(
    storeys: ArrayLike, height: ArrayLike, contact_height: ArrayLike
) -> FloatArray:
    """
    Compute the displacement at contact height over the oscillator's, ``q = 3N/(2N+1) z_c/H``.

    First-mode participation factor times mode shape at the contact, ``sum(m phi) / sum(m phi**2) *
    phi_c``, for N equal masses and ``phi = z/H``; dimensionless. It is 1 for one storey and tends
    to 1.5.

    Examples
    --------
    >>> contact_participation([1, 2, 3, 5, 10], 30.0, 30.0).round(2)
    array([1.  , 1.2 , 1.29, 1.36, 1.43])
    """
    count = np.asarray(storeys, dtype=np.float64)
    factor = 3.0 * count / (2.0 * count + 1.0)
    return np.asarray(factor * np.divide(contact_height, height))


def contact_mass(
    mass: ArrayLike, storeys: ArrayLike, height: ArrayLike, contact_height: ArrayLike
) -> FloatArray:
    """
    Compute the first-mode mass at contact height, ``m*_c = M (N+1)(2N+1)/(6 N**2) (H/z_c)**2``.

    The generalised mass ``sum(m phi**2) / phi_c**2``, kg, of a building of total mass M: the mass
    that takes part in an impact, neither the effective modal mass nor the mass of a floor.

    Examples
    --------
    >>> float(contact_mass(300e3, 1, 3.0, 3.0))
    300000.0
    """
    total, count = np.asarray(mass, dtype=np.float64), np.asarray(storeys, dtype=np.float64)
    generalised = total * (count + 1.0) * (2.0 * count + 1.0) / (6.0 * count**2)
    return np.asarray(generalised / np.divide(contact_height, height) ** 2)


def effective_mass_ratio(storeys: ArrayLike) -> FloatArray:
    """
    Compute the effective mass of the first mode over the total mass, ``3(N+1) / (2(2N+1))``.

    ``sum(m phi)**2 / (M sum(m phi**2))``, dimensionless: 1 for one storey, 0.75 in the limit. The
    base shear of the first mode is this share of the mass times the pseudo-acceleration.

    Examples
    --------
    >>> effective_mass_ratio([1, 3, 10]).round(3)
    array([1.   , 0.857, 0.786])
    """
    count = np.asarray(storeys, dtype=np.float64)
    return np.asarray(3.0 * (count + 1.0) / (2.0 * (2.0 * count + 1.0)))


def floor_offset(
    height_1: ArrayLike, storeys_1: ArrayLike, height_2: ArrayLike, storeys_2: ArrayLike
) -> FloatArray:
    """
    Compute the height between the lower roof and the nearest floor of the taller building, m.

    Storeys are taken as equally high within a building.

    Examples
    --------
    >>> float(floor_offset(9.0, 3, 16.0, 4))  # floors of the taller one at 4, 8, 12, 16 m
    1.0
    """
    first, second = np.asarray(height_1), np.asarray(height_2)
    # Roof of the lower building against the storeys of the taller one
    lower = np.minimum(first, second)
    storey = np.where(first >= second, first / storeys_1, second / storeys_2)
    nearest = np.maximum(np.rint(lower / storey), 1.0)
    return np.asarray(np.abs(lower - nearest * storey))
