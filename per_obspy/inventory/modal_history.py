"""The history of every floor of a shear building, by modes: to check the oscillator that stands for it."""

import numpy as np
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.inventory.shear_building import shear_building
from per_obspy.spectra.bilinear import bilinear_response


def modal_history(
    acceleration: ArrayLike,
    dt: float,
    masses: ArrayLike,
    stiffnesses: ArrayLike,
    damping: float = 0.05,
) -> FloatArray:
    """
    Displacement of every floor of a linear shear building, all modes superposed.

    Parameters
    ----------
    acceleration : (n_samples,) array_like
        Ground acceleration, m/s².
    dt : float
        Sampling interval, s.
    masses : (n_floors,) array_like
        Floor masses from the lowest floor to the roof, kg.
    stiffnesses : (n_floors,) array_like
        Stiffness of the storey below each floor, N/m.
    damping : float
        Of every mode, fraction of critical.

    Returns
    -------
    displacement : (n_floors, n_samples) ndarray
        Relative to the ground at the samples, m.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Notes
    -----
    ``u(t) = sum(phi_k Gamma_k D_k(t))`` with the participation factors ``Gamma_k = sum(m phi_k) /
    sum(m phi_k**2)`` and the response D_k of an oscillator with the period of mode k.

    References
    ----------
    Chopra (2012), Dynamics of Structures, ch. 13.

    Examples
    --------
    >>> floors = modal_history(np.sin(np.arange(200) * 0.1), 0.01, [2e5, 2e5], [4e7, 4e7])
    >>> floors.shape, bool(abs(floors[1]).max() > abs(floors[0]).max())
    ((2, 200), True)
    """
    ground, mass = checks.record("acceleration", acceleration), checks.positive("masses", masses)
    building = shear_building(masses, stiffnesses)
    displacement = np.zeros((mass.size, ground.size))
    for period, shape in zip(building.periods, building.shapes.T, strict=True):
        factor = (mass @ shape) / (mass @ shape**2)
        response = bilinear_response(ground, dt, float(period), damping, np.inf, 0.0).displacement[
            : ground.size
        ]
        displacement += factor * np.outer(shape, response)
    return displacement
