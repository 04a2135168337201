"""Stereomechanical impact of two masses: velocities after it and the energy that it transfers."""

from typing import NamedTuple

import numpy as np

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray


class ImpactVelocities(NamedTuple):
    """Velocities right after an impact, m/s."""

    velocity_1: FloatArray
    velocity_2: FloatArray


class TransferEnergies(NamedTuple):
    """Energy that leaves each structure in an impact, J; negative where a structure gains."""

    transfer_energy_1: FloatArray
    transfer_energy_2: FloatArray


def post_impact_velocities(
    velocity_1: ArrayLike,
    velocity_2: ArrayLike,
    mass_1: ArrayLike,
    mass_2: ArrayLike,
    restitution: ArrayLike,
) -> ImpactVelocities:
    """
    Compute the velocities after a stereomechanical impact.

    Parameters
    ----------
    velocity_1, velocity_2 : array_like
        Velocities before the impact, m/s; an impact needs ``velocity_1 > velocity_2`` (structure 1
        is left of 2).
    mass_1, mass_2 : array_like
        Impact masses, kg; one of the two may be infinite (a wall).
    restitution : array_like
        Coefficient of restitution e, from 0 (plastic) to 1 (elastic), dimensionless.

    Returns
    -------
    ImpactVelocities
        ``velocity_1``, ``velocity_2``: broadcast shape, m/s.

    Raises
    ------
    ValueError
        If a mass is not positive, both are infinite, or the restitution is outside [0, 1].

    Notes
    -----
    ``v1' = v1 - (1 + e) m2/(m1 + m2) (v1 - v2)`` and ``v2' = v2 + (1 + e) m1/(m1 + m2) (v1 - v2)``.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), 11WCEE, equations (7) and (8).

    Examples
    --------
    >>> velocity_1, velocity_2 = post_impact_velocities(1.0, 0.0, 2.0, 2.0, 0.5)
    >>> print(velocity_1, velocity_2)
    0.25 0.75
    """
    velocity_1 = checks.finite("velocity_1", velocity_1)
    velocity_2 = checks.finite("velocity_2", velocity_2)
    share_1, share_2, _ = mass_shares(mass_1, mass_2)

    # Equations (7) and (8)
    factor = 1.0 + checks.between("restitution", restitution, 0.0, 1.0)
    change = factor * (velocity_1 - velocity_2)
    return ImpactVelocities(velocity_1 - share_2 * change, velocity_2 + share_1 * change)


def transfer_energies(
    velocity_1: ArrayLike,
    velocity_2: ArrayLike,
    mass_1: ArrayLike,
    mass_2: ArrayLike,
    restitution: ArrayLike,
) -> TransferEnergies:
    """
    Compute the energy that leaves each structure in one impact.

    Parameters
    ----------
    velocity_1, velocity_2 : array_like
        Velocities before the impact, m/s.
    mass_1, mass_2 : array_like
        Impact masses, kg; one of the two may be infinite.
    restitution : array_like
        Coefficient of restitution, from 0 to 1, dimensionless.

    Returns
    -------
    TransferEnergies
        ``transfer_energy_1`` (the paper's E_Tr12) and ``transfer_energy_2`` (E_Tr21): broadcast
        shape, J. Positive energy leaves the structure; their sum is the loss
        ``½ (1 - e²) m1 m2/(m1 + m2) (v1 - v2)²``.

    Raises
    ------
    ValueError
        If a mass is not positive, both are infinite, or the restitution is outside [0, 1].

    Notes
    -----
    With the impulse ``J = (1 + e) m1 m2/(m1 + m2) (v1 - v2)``: ``E_Tr12 = J (v1 + v1')/2`` and
    ``E_Tr21 = -J (v2 + v2')/2``. The printed (9) and (10) have the opposite sign: they are the
    kinetic energies that the structures gain, which contradicts the energy balance (3) of the
    paper, (4).

    References
    ----------
    Valles-Mattox & Reinhorn (1996), 11WCEE, equations (9) and (10), signs corrected.

    Examples
    --------
    >>> print(*transfer_energies(1.0, 0.0, 2.0, 2.0, 1.0))
    1.0 -1.0
    """
    after_1, after_2 = post_impact_velocities(velocity_1, velocity_2, mass_1, mass_2, restitution)
    velocity_1 = np.asarray(velocity_1, dtype=np.float64)
    velocity_2 = np.asarray(velocity_2, dtype=np.float64)

    # Impulse J = (1 + e) m1 m2/(m1 + m2) (v1 - v2)
    reduced_mass = mass_shares(mass_1, mass_2)[2]
    factor = 1.0 + np.asarray(restitution, dtype=np.float64)
    impulse = factor * reduced_mass * (velocity_1 - velocity_2)

    # Equations (9) and (10) with the signs of the notes
    leaving_1 = impulse * (velocity_1 + after_1) / 2.0
    leaving_2 = -impulse * (velocity_2 + after_2) / 2.0
    return TransferEnergies(leaving_1, leaving_2)


def mass_shares(mass_1: ArrayLike, mass_2: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return ``m1/(m1 + m2)``, ``m2/(m1 + m2)`` and the reduced mass ``m1 m2/(m1 + m2)`` (kg).

    Masses are checked: above zero, and one of the two may be infinite.
    """
    mass_1 = checks.positive_or_infinite("mass_1", mass_1)
    mass_2 = checks.positive_or_infinite("mass_2", mass_2)
    if np.any(np.isinf(mass_1) & np.isinf(mass_2)):
        raise ValueError("mass_1 and mass_2 are both infinite: two walls do not collide")
    inverse_1, inverse_2 = 1.0 / mass_1, 1.0 / mass_2
    total = inverse_1 + inverse_2
    return inverse_2 / total, inverse_1 / total, 1.0 / total
