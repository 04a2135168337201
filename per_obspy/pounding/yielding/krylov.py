"""Statistical linearization of Caughey: Krylov-Bogoliubov averaging over Rayleigh amplitudes."""

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

#: Share of each change that an iteration makes.
RELAXATION = 0.5

#: Relative change of frequency and damping between two iterations that ends them.
TOLERANCE = 1e-12

#: Largest number of iterations.
ITERATIONS = 1000

#: Exponent from which on an exponential is negligible: exp(-46) is 1e-20.
NEGLIGIBLE = 46.0


def krylov_bogoliubov(
    structures: tuple[Structure, Structure], ground: StochasticGround
) -> LinearizedEstimate:
    """Return the estimate in which each yield displacement is compared with the response to it."""
    limit_1, limit_2 = (structure.yield_displacement for structure in structures)
    return _iterate(structures, ground, lambda sigma: [limit_1 / sigma[0], limit_2 / sigma[1]])


def prescribed_ductility(
    structures: tuple[Structure, Structure],
    ductilities: tuple[float, float],
    peak_factor: float,
    ground: StochasticGround,
) -> LinearizedEstimate:
    """Return the estimate in which each peak response is a multiple of the yield displacement."""
    levels = [peak_factor / ductility if ductility > 1.0 else math.inf for ductility in ductilities]
    return _iterate(structures, ground, lambda _: levels)


def equivalent_stiffness(level: float) -> float:
    """
    Return the in-phase part of an elastoplastic force over the elastic force (I_C), dimensionless.

    ``level`` is yield displacement over standard deviation of displacement. With the amplitude A
    Rayleigh distributed and ``ν = 2/level²``, ``I_C = E[A C(A)]/E[A²]`` is
    ``1 - (8/π) ∫ (1/s³ + 1/(ν s)) sqrt(s - 1) exp(-s²/ν) ds`` from 1; s = 1 + t² below.
    """
    spread = 2.0 / level**2 if level > 0.0 else math.inf
    if spread < 1.0 / NEGLIGIBLE:
        return 1.0

    def integrand(t: float) -> float:
        """Return the integrand over t, whose root at s = 1 is smooth."""
        s = 1.0 + t * t
        return (1.0 / s**3 + 1.0 / (spread * s)) * 2.0 * t * t * math.exp(-s * s / spread)

    # Integrate up to where the exponential is negligible
    end = math.sqrt(math.sqrt(NEGLIGIBLE * spread))
    integral = quad(integrand, 0.0, end, epsabs=1e-14, epsrel=1e-13, limit=200)[0]
    return float(1.0 - 8.0 / math.pi * integral)


def equivalent_viscosity(level: float) -> float:
    """
    Return the part of an elastoplastic force in phase with velocity (I_S), dimensionless.

    ``level`` is yield displacement over standard deviation of displacement.
    """
    if not math.isfinite(level):
        return 0.0
    return float(math.sqrt(2.0 / math.pi) * level * erfc(level / math.sqrt(2.0)))


def _iterate(
    structures: tuple[Structure, Structure],
    ground: StochasticGround,
    levels_of: Callable[[FloatArray], Sequence[float]],
) -> LinearizedEstimate:
    """Alternate between the covariance of two oscillators and the oscillators that fit it."""
    # Circular frequency and damping of both, at first elastic
    oscillators = np.array([[structure.frequency, structure.damping] for structure in structures])
    for _ in range(ITERATIONS):
        periods, dampings = 2.0 * np.pi / oscillators[:, 0], oscillators[:, 1]
        covariance = _covariance(ground, periods, dampings)
        sigma = np.sqrt(covariance[[0, 2], [0, 2]])
        rates = np.sqrt(covariance[[1, 3], [1, 3]]) / sigma

        # Frequency and damping that fit the bilinear structures at this response
        fitted = zip(structures, levels_of(sigma), rates, strict=True)
        change = np.array([_equivalent(*arguments) for arguments in fitted]) - oscillators
        if np.all(np.abs(change) < TOLERANCE * oscillators):
            rho = correlation(covariance, 0, 2)
            return LinearizedEstimate(rho, periods, dampings, sigma, converged=True)
        oscillators += RELAXATION * change
    return failed()


def _covariance(ground: StochasticGround, periods: FloatArray, dampings: FloatArray) -> FloatArray:
    """Return the covariance of displacement and velocity of oscillator 1, then of 2."""
    first = linear_oscillator(periods[0], dampings[0])
    second = linear_oscillator(periods[1], dampings[1])
    return stationary_covariance(ground, first, second)


def _equivalent(structure: Structure, level: float, rate: float) -> tuple[float, float]:
    """
    Return circular frequency (rad/s) and damping of the fitting oscillator.

    ``rate`` is the standard deviation of velocity over that of displacement, 1/s.
    """
    softened = 1.0 - structure.hardening
    omega = structure.frequency
    stiffness = structure.hardening + softened * equivalent_stiffness(level)
    fitted = omega * math.sqrt(stiffness)

    # Viscous damping and that of the loops, per mass
    loops = softened * omega**2 * equivalent_viscosity(level) / rate
    viscosity = 2.0 * structure.damping * omega + loops
    return fitted, viscosity / (2.0 * fitted)
