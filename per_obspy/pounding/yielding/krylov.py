"""Statistical linearization of Caughey: slowly varying amplitude (Krylov-Bogoliubov) with a Rayleigh distribution."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import quad
from scipy.special import erfc

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation.covariance import (
    correlation,
    linear_oscillator,
    stationary_covariance,
)
from per_obspy.pounding.correlation.stochastic_ground import StochasticGround
from per_obspy.pounding.structure import Structure
from per_obspy.pounding.yielding.estimate import LinearizedEstimate, failed

RELAXATION = 0.5
TOLERANCE = 1e-12  # of period and damping between two iterations, relative
ITERATIONS = 1000
NEGLIGIBLE = 46.0  # exp(-46) is 1e-20


def krylov_bogoliubov(
    structures: tuple[Structure, Structure], ground: StochasticGround
) -> LinearizedEstimate:
    """Return the estimate in which each structure's yield displacement is compared with its own response."""
    limits = [structure.yield_displacement for structure in structures]
    return _iterate(
        structures,
        ground,
        lambda sigma: [limit / s for limit, s in zip(limits, sigma, strict=True)],
    )


def prescribed_ductility(
    structures: tuple[Structure, Structure],
    ductilities: tuple[float, float],
    peak_factor: float,
    ground: StochasticGround,
) -> LinearizedEstimate:
    """Return the estimate in which the peak response is a given multiple of the yield displacement."""
    levels = [peak_factor / ductility if ductility > 1.0 else math.inf for ductility in ductilities]
    return _iterate(structures, ground, lambda _: levels)


def equivalent_stiffness(level: float) -> float:
    """
    Return the in-phase part of an elastoplastic force over the elastic force (I_C), dimensionless.

    ``level`` is yield displacement over standard deviation of displacement. With the amplitude A
    Rayleigh distributed, ``I_C = E[A C(A)]/E[A²] = 1 - (8/π) ∫ (1/s³ + 1/(ν s)) sqrt(s - 1)
    exp(-s²/ν) ds`` from 1, ``ν = 2/level²``; s = 1 + t² below.
    """
    spread = 2.0 / level**2 if level > 0.0 else math.inf
    if spread < 1.0 / NEGLIGIBLE:
        return 1.0

    def integrand(t: float) -> float:
        s = 1.0 + t * t
        return (1.0 / s**3 + 1.0 / (spread * s)) * 2.0 * t * t * math.exp(-s * s / spread)

    end = math.sqrt(math.sqrt(NEGLIGIBLE * spread))
    return float(
        1.0 - 8.0 / math.pi * quad(integrand, 0.0, end, epsabs=1e-14, epsrel=1e-13, limit=200)[0]
    )


def equivalent_viscosity(level: float) -> float:
    """Return the part of an elastoplastic force in phase with velocity (I_S), dimensionless; level as above."""
    return (
        float(math.sqrt(2.0 / math.pi) * level * erfc(level / math.sqrt(2.0)))
        if math.isfinite(level)
        else 0.0
    )


def _iterate(
    structures: tuple[Structure, Structure],
    ground: StochasticGround,
    levels_of: Callable[[FloatArray], Sequence[float]],
) -> LinearizedEstimate:
    """Alternate between the covariance of two linear oscillators and the oscillators that fit it."""
    oscillators = np.array([[structure.frequency, structure.damping] for structure in structures])
    for _ in range(ITERATIONS):
        periods, dampings = 2.0 * np.pi / oscillators[:, 0], oscillators[:, 1]
        one, two = (linear_oscillator(*both) for both in zip(periods, dampings, strict=True))
        covariance = stationary_covariance(ground, one, two)
        sigma, sigma_velocity = (
            np.sqrt(covariance[[0, 2], [0, 2]]),
            np.sqrt(covariance[[1, 3], [1, 3]]),
        )
        fitted = zip(structures, levels_of(sigma), sigma_velocity / sigma, strict=True)
        change = np.array([_equivalent(*item) for item in fitted]) - oscillators
        if np.all(np.abs(change) < TOLERANCE * oscillators):
            return LinearizedEstimate(
                correlation(covariance, 0, 2), periods, dampings, sigma, converged=True
            )
        oscillators += RELAXATION * change
    return failed()


def _equivalent(structure: Structure, level: float, rate: float) -> tuple[float, float]:
    """Return circular frequency and damping of the fitting oscillator; rate is sigma of velocity over displacement."""
    softened = 1.0 - structure.hardening
    omega = structure.frequency
    fitted = omega * math.sqrt(structure.hardening + softened * equivalent_stiffness(level))
    viscosity = (
        2.0 * structure.damping * omega + softened * omega**2 * equivalent_viscosity(level) / rate
    )
    return fitted, viscosity / (2.0 * fitted)
