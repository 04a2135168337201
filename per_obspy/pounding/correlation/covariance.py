"""Covariance of linear structures and the ground filter that drives them: the Lyapunov equation."""

import numpy as np
from scipy.linalg import block_diag, solve_continuous_lyapunov

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.pounding.correlation.stochastic_ground import StochasticGround


def ground_correlation(
    ground: StochasticGround, period_1: float, damping_1: float, period_2: float, damping_2: float
) -> float:
    """
    Compute the correlation of two linear displacements under stationary ground motion.

    Parameters
    ----------
    ground : WhiteNoise, KanaiTajimi or CloughPenzien
        Its intensity does not matter.
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

    See Also
    --------
    per_obspy.psd_correlation : Tabulated power spectral densities.

    Notes
    -----
    The covariance P of the states of both structures and of the ground filter solves the Lyapunov
    equation ``A P + P Aᵀ = -2π S0 b bᵀ``. Under white noise the result is equation (16).

    References
    ----------
    Lin (1967), Probabilistic theory of structural dynamics.

    Examples
    --------
    >>> from per_obspy.pounding.correlation.stochastic_ground import WhiteNoise
    >>> print(round(ground_correlation(WhiteNoise(0.01), 1.0, 0.05, 1.2, 0.05), 6))
    0.229814
    """
    first = linear_oscillator(_number("period_1", period_1), _number("damping_1", damping_1))
    second = linear_oscillator(_number("period_2", period_2), _number("damping_2", damping_2))
    return correlation(stationary_covariance(ground, first, second), 0, 2)


def _number(name: str, value: ArrayLike) -> float:
    """Return a checked period or damping above zero."""
    limit = checks.fraction_of_critical if name.startswith("damping") else checks.positive
    return checks.number(name, checks.number(name, value, limit), checks.positive)


def linear_oscillator(period: float, damping: float) -> FloatArray:
    """Return the state matrix of displacement and velocity."""
    omega = 2.0 * np.pi / period
    return np.array([[0.0, 1.0], [-(omega**2), -2.0 * damping * omega]])


def stationary_covariance(
    ground: StochasticGround, first: FloatArray, second: FloatArray
) -> FloatArray:
    """
    Compute the covariance of the states of two structures under a ground motion.

    ``first`` and ``second`` are the state matrices; the ground acceleration enters the second state
    of each. The covariance P solves the Lyapunov equation ``A P + P Aᵀ = -2π S0 b bᵀ``.
    """
    # State matrix A of both structures and the ground filter, and the vector b of the white noise
    drive = ground.filter()
    system = block_diag(first, second, drive.state)
    force = np.zeros(len(system))
    structures = len(first) + len(second)
    force[structures:] = drive.force

    # The ground acceleration decelerates each structure
    for velocity in (1, len(first) + 1):
        system[velocity, structures:] = -drive.output
        force[velocity] = -drive.direct
    noise = -2.0 * np.pi * ground.intensity * np.outer(force, force)
    covariance = solve_continuous_lyapunov(system, noise)
    return np.asarray(0.5 * (covariance + covariance.T), dtype=np.float64)


def correlation(covariance: FloatArray, first: int, second: int) -> float:
    """Return the correlation of two states."""
    variances = covariance[first, first] * covariance[second, second]
    return float(covariance[first, second] / np.sqrt(variances))
