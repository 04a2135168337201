"""Energy balance (3), (4) of structures that hit each other, as histories."""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray


class Energies(NamedTuple):
    """
    Energies of each structure over time, each (n_structures, n_time), J.

    NaN where the mass is infinite. By eq. (3) and (4), ``kinetic + damping + elastic + hysteretic +
    transfer = input``.

    Attributes
    ----------
    input : ndarray
        Work of the ground, relative formulation, ``-m ∫ a v dt``.
    kinetic : ndarray
        ``m v² / 2``.
    damping : ndarray
        Dissipated by viscous damping, ``∫ c v² dt``.
    elastic : ndarray
        Recoverable deformation energy; ``k u² / 2`` if linear.
    hysteretic : ndarray
        Dissipated by yielding; 0 if linear.
    transfer : ndarray
        Given to the neighbours by impacts and contact forces, ``∫ f v dt``; negative if received.
    """

    input: FloatArray
    kinetic: FloatArray
    damping: FloatArray
    elastic: FloatArray
    hysteretic: FloatArray
    transfer: FloatArray


def energies_of(table: FloatArray, motion: FloatArray, work: FloatArray) -> Energies:
    """
    Compute the energies of a motion and of the work done along it.

    Parameters
    ----------
    table : (n_structures, 6) ndarray
        Half damping rate (1/s), squared frequency (rad²/s²), hardening, yield displacement (m),
        participation, mass (kg).
    motion : (n_time, n_structures, 3) ndarray
        Displacement (m), velocity (m/s), plastic displacement (m).
    work : (n_time, n_structures, 4) ndarray
        Input, damping, hysteretic and transferred energy, J.

    Returns
    -------
    Energies
        In J.
    """
    _, stiffness, hardening, limit, _, mass = table.T
    mass = np.where(np.isinf(mass), np.nan, mass)
    displacement, velocity, plastic = np.moveaxis(motion, 2, 0)
    kinetic = 0.5 * mass * velocity**2

    # Recoverable energy: a spring of the hardened stiffness, and one that slips
    stretch = np.where(np.isinf(limit), displacement, displacement - plastic)
    squares = hardening * displacement**2 + (1.0 - hardening) * stretch**2
    elastic = 0.5 * mass * stiffness * squares

    # Work done along the motion, NaN for structures of infinite mass
    done, damping, hysteretic, transfer = np.moveaxis(work + 0.0 * mass[:, np.newaxis], 2, 0)
    return Energies(done.T, kinetic.T, damping.T, elastic.T, hysteretic.T, transfer.T)


def closure_of(energies: Energies) -> float:
    """
    Compute the largest imbalance of (3), (4) over the largest input or transferred energy.

    Parameters
    ----------
    energies : Energies
        Of all structures, J.

    Returns
    -------
    float
        Dimensionless; structures of infinite mass are left out, and one that never moves counts as
        balanced.
    """
    # Left side of (3), (4)
    stored = energies.kinetic + energies.damping + energies.elastic
    spent = stored + energies.hysteretic + energies.transfer
    finite = ~np.isnan(energies.input[:, 0])
    imbalance = np.abs(spent - energies.input)[finite].max(axis=1, initial=0.0)

    # Relative to the larger of input and transfer of each structure
    exchanged = np.maximum(np.abs(energies.input), np.abs(energies.transfer))
    scale = exchanged[finite].max(axis=1, initial=0.0)
    share = np.divide(imbalance, scale, out=np.zeros_like(scale), where=scale > 0)
    return float(share.max(initial=0.0))
