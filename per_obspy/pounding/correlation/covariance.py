"""Covariance of linear structures and the ground filter that drives them: the Lyapunov equation."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag, solve_continuous_lyapunov

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation.stochastic_ground import Ground


def ground_correlation(
    ground: Ground, period_1: float, damping_1: float, period_2: float, damping_2: float
) -> float:
    """
    Correlation of two linear displacements under stationary ground motion, by the Lyapunov equation.

    Parameters
    ----------
    ground : Ground
        White noise, Kanai-Tajimi or Clough-Penzien ground motion; its intensity does not matter.
    period_1, period_2 : float
        Undamped periods, s.
    damping_1, damping_2 : float
        Fractions of critical, above 0 and below 1, dimensionless.

    Returns
    -------
    correlation : float
        Dimensionless, from -1 to 1.

    Raises
    ------
    ValueError
        If a period or damping is out of range.

    Examples
    --------
    >>> from per_obspy.pounding.correlation.stochastic_ground import WhiteNoise
    >>> print(round(ground_correlation(WhiteNoise(0.01), 1.0, 0.05, 1.2, 0.05), 6))
    0.229814
    """
    oscillators = [
        linear_oscillator(_number(f"period_{i}", period), _number(f"damping_{i}", damping))
        for i, period, damping in ((1, period_1, damping_1), (2, period_2, damping_2))
    ]
    return correlation(stationary_covariance(ground, *oscillators), 0, 2)


def _number(name: str, value: ArrayLike) -> float:
    limit = checks.fraction_of_critical if name.startswith("damping") else checks.positive
    return checks.number(name, checks.number(name, value, limit), checks.positive)


def linear_oscillator(period: float, damping: float) -> FloatArray:
    """Return the state matrix of displacement and velocity."""
    omega = 2.0 * np.pi / period
    return np.array([[0.0, 1.0], [-(omega**2), -2.0 * damping * omega]])


def stationary_covariance(ground: Ground, one: FloatArray, two: FloatArray) -> FloatArray:
    """
    Return the covariance of the states of two structures under a ground motion.

    ``one`` and ``two`` are the state matrices; the ground acceleration enters the second state of
    each.
    """
    drive = ground.filter()
    system = block_diag(one, two, drive.state)
    force = np.zeros(len(system))
    structures = len(one) + len(two)
    force[structures:] = drive.force
    for velocity in (1, len(one) + 1):
        system[velocity, structures:] = -drive.output
        force[velocity] = -drive.direct
    covariance = solve_continuous_lyapunov(
        system, -2.0 * np.pi * ground.intensity * np.outer(force, force)
    )
    return np.asarray(0.5 * (covariance + covariance.T), dtype=np.float64)


def correlation(covariance: FloatArray, one: int, two: int) -> float:
    """Return the correlation of two states."""
    return float(covariance[one, two] / np.sqrt(covariance[one, one] * covariance[two, two]))
