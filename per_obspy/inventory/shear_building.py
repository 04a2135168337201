"""Modes of a shear building, and its equivalent oscillator at the floor of contact."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh_tridiagonal

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray


class ShearBuilding(NamedTuple):
    """
    Modes of a shear building, longest period first.

    Attributes
    ----------
    periods : (n_modes,) ndarray
        Natural periods, s.
    shapes : (n_floors, n_modes) ndarray
        Mode shapes, one column per mode, 1 at the roof; dimensionless.
    """

    periods: FloatArray
    shapes: FloatArray


class EquivalentSDOF(NamedTuple):
    """
    Equivalent oscillator of the first mode of a building at one floor.

    Attributes
    ----------
    period : float
        First natural period, s.
    participation : float
        Displacement of the floor over that of the oscillator; dimensionless.
    mass : float
        Generalised mass at the floor, kg.
    """

    period: float
    participation: float
    mass: float


def _floors(masses: ArrayLike, stiffnesses: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return checked masses, kg, and stiffnesses, N/m, of the floors."""
    mass, stiffness = checks.positive("masses", masses), checks.positive("stiffnesses", stiffnesses)
    if mass.ndim != 1 or mass.size == 0 or mass.shape != stiffness.shape:
        raise ValueError(
            "masses and stiffnesses must be rows of equal length, "
            f"got {mass.shape} and {stiffness.shape}"
        )
    return mass, stiffness


def shear_building(masses: ArrayLike, stiffnesses: ArrayLike) -> ShearBuilding:
    """
    Compute the natural periods and mode shapes of a shear building.

    Parameters
    ----------
    masses : (n_floors,) array_like
        Floor masses from the lowest floor to the roof, kg.
    stiffnesses : (n_floors,) array_like
        Stiffness of the storey below each floor, N/m.

    Returns
    -------
    building : ShearBuilding
        Periods in s, longest first, and shapes that are 1 at the roof.

    Raises
    ------
    ValueError
        If a mass or stiffness is not positive, or the two differ in length.

    Notes
    -----
    The eigenproblem ``K phi = omega**2 M phi`` in the coordinates ``sqrt(m) u``, where it is
    symmetric and tridiagonal.

    References
    ----------
    Chopra (2012), Dynamics of Structures, ch. 10.

    Examples
    --------
    >>> shear_building([1.0, 1.0], [1.0, 1.0]).periods.round(3)
    array([10.166,  3.883])
    """
    mass, stiffness = _floors(masses, stiffnesses)
    # Diagonals of M**-1/2 K M**-1/2
    above = np.append(stiffness[1:], 0.0)
    diagonal = (stiffness + above) / mass
    neighbouring = -stiffness[1:] / np.sqrt(mass[:-1] * mass[1:])
    eigenvalues, vectors = eigh_tridiagonal(diagonal, neighbouring)
    # Back from sqrt(m) u to displacements, 1 at the roof
    shapes = vectors / np.sqrt(mass)[:, None]
    return ShearBuilding(2.0 * np.pi / np.sqrt(eigenvalues), shapes / shapes[-1])


def equivalent_sdof(masses: ArrayLike, stiffnesses: ArrayLike, level: int) -> EquivalentSDOF:
    """
    Compute period, participation and generalised mass of the first mode at one floor.

    Parameters
    ----------
    masses : (n_floors,) array_like
        Floor masses from the lowest floor to the roof, kg.
    stiffnesses : (n_floors,) array_like
        Stiffness of the storey below each floor, N/m.
    level : int
        The floor at which the buildings meet, counted from 0 (the lowest floor above ground); -1 is
        the roof.

    Returns
    -------
    oscillator : EquivalentSDOF
        Period in s, participation ``sum(m phi) phi_c / sum(m phi**2)`` and mass ``sum(m phi**2) /
        phi_c**2`` in kg.

    Raises
    ------
    ValueError
        If a mass or stiffness is not positive, the two differ in length or there is no such floor.

    Examples
    --------
    >>> oscillator = equivalent_sdof([2e5], [8e6], 0)
    >>> round(oscillator.period, 4), oscillator.participation, oscillator.mass
    (0.9935, 1.0, 200000.0)
    """
    mass, stiffness = _floors(masses, stiffnesses)
    if not -mass.size <= level < mass.size:
        raise ValueError(f"level must be below the number of floors, {mass.size}, got {level}")
    periods, shapes = shear_building(mass, stiffness)
    # First mode, 1 at the floor of contact
    shape = shapes[:, 0] / shapes[level, 0]
    generalised = float(mass @ shape**2)
    return EquivalentSDOF(float(periods[0]), float(mass @ shape) / generalised, generalised)
