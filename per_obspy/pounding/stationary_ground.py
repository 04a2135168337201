"""
Stationary ground motions, and the correlation of two linear responses to them.

Ground motions are filtered white noise with a power spectral density and a state space.
Intensities are two-sided power spectral densities S0 of the white noise, m²/s³, over circular
frequency.
"""

from dataclasses import dataclass, fields
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, solve_continuous_lyapunov

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray


class Filter(NamedTuple):
    """State space ``x' = state x + force w``, ``a = output x + direct w`` for white noise w."""

    state: FloatArray
    force: FloatArray
    output: FloatArray
    direct: float


class StochasticGround(Protocol):
    """Stationary ground motion: intensity, power spectral density and filter."""

    @property
    def intensity(self) -> float:
        """Two-sided power spectral density of the white noise, m²/s³."""

    def psd(self, frequency: ArrayLike) -> FloatArray:
        """Return the two-sided power spectral density (m²/s³) at circular frequencies (rad/s)."""

    def filter(self) -> Filter:
        """Return the state space from white noise to ground acceleration."""


@dataclass(frozen=True)
class WhiteNoise:
    """
    Ground acceleration with the same power at all frequencies.

    Parameters
    ----------
    intensity : float
        Two-sided power spectral density S0, m²/s³.

    Raises
    ------
    ValueError
        If the intensity is not positive.
    """

    intensity: float

    def __post_init__(self) -> None:
        _check_positive(self)

    def psd(self, frequency: ArrayLike) -> FloatArray:
        """Return the power spectral density (m²/s³) at circular frequencies (rad/s)."""
        return np.full_like(checks.finite("frequency", frequency), self.intensity)

    def filter(self) -> Filter:
        """Return a state space without a state."""
        return Filter(np.empty((0, 0)), np.empty(0), np.empty(0), 1.0)


@dataclass(frozen=True)
class KanaiTajimi:
    """
    White noise in the bedrock, felt on a soil layer that is one oscillator.

    Parameters
    ----------
    frequency : float
        Circular frequency of the soil, rad/s.
    damping : float
        Of the soil, fraction of critical, dimensionless.
    intensity : float
        Two-sided power spectral density S0 of the bedrock acceleration, m²/s³.

    Raises
    ------
    ValueError
        If a parameter is not positive.

    Notes
    -----
    ``x'' + 2 ξg ωg x' + ωg² x = -w`` and ``a = -(2 ξg ωg x' + ωg² x)``. Without a high-pass the
    displacement of long periods drifts; :class:`CloughPenzien` has one.

    References
    ----------
    Kanai (1957); Tajimi (1960).
    """

    frequency: float
    damping: float
    intensity: float

    def __post_init__(self) -> None:
        _check_positive(self)

    def psd(self, frequency: ArrayLike) -> FloatArray:
        """Return the power spectral density (m²/s³) at circular frequencies (rad/s)."""
        square = (checks.finite("frequency", frequency) / self.frequency) ** 2
        viscous = 4.0 * self.damping**2 * square
        density: FloatArray = self.intensity * (1.0 + viscous) / ((1.0 - square) ** 2 + viscous)
        return density

    def filter(self) -> Filter:
        """Return the state space of the soil layer: displacement, velocity."""
        stiffness, viscosity = self.frequency**2, 2.0 * self.damping * self.frequency
        state = np.array([[0.0, 1.0], [-stiffness, -viscosity]])
        return Filter(state, np.array([0.0, -1.0]), np.array([-stiffness, -viscosity]), 0.0)


@dataclass(frozen=True)
class CloughPenzien:
    """
    Kanai-Tajimi ground motion whose low frequencies are filtered out.

    Parameters
    ----------
    frequency, low_frequency : float
        Circular frequencies of the soil and of the high-pass, rad/s.
    damping, low_damping : float
        Of the soil and of the high-pass, fractions of critical, dimensionless.
    intensity : float
        Two-sided power spectral density S0 of the bedrock acceleration, m²/s³.

    Raises
    ------
    ValueError
        If a parameter is not positive.

    Notes
    -----
    ``y'' + 2 ξc ωc y' + ωc² y = a_KT`` with the acceleration of :class:`KanaiTajimi`; the ground
    moves by ``a = y''``.

    References
    ----------
    Clough & Penzien (1975), Dynamics of Structures.
    """

    frequency: float
    damping: float
    low_frequency: float
    low_damping: float
    intensity: float

    def __post_init__(self) -> None:
        _check_positive(self)

    def psd(self, frequency: ArrayLike) -> FloatArray:
        """Return the power spectral density (m²/s³) at circular frequencies (rad/s)."""
        square = (checks.finite("frequency", frequency) / self.low_frequency) ** 2
        passed = square**2 / ((1.0 - square) ** 2 + 4.0 * self.low_damping**2 * square)
        density: FloatArray = self._soil().psd(frequency) * passed
        return density

    def filter(self) -> Filter:
        """Return the state space: displacement and velocity of the soil layer and the high-pass."""
        soil = self._soil().filter()
        stiffness = self.low_frequency**2
        viscosity = 2.0 * self.low_damping * self.low_frequency
        high_pass = np.array([-stiffness, -viscosity])

        # The high-pass is driven by the output of the soil layer
        state = np.zeros((4, 4))
        state[:2, :2] = soil.state
        state[2, 3] = 1.0
        output = np.concatenate([soil.output, high_pass])
        state[3] = output
        return Filter(state, np.array([0.0, -1.0, 0.0, 0.0]), output, 0.0)

    def _soil(self) -> KanaiTajimi:
        """Return the soil layer without the high-pass."""
        return KanaiTajimi(self.frequency, self.damping, self.intensity)


def _check_positive(ground: WhiteNoise | KanaiTajimi | CloughPenzien) -> None:
    for field in fields(ground):
        checks.number(field.name, getattr(ground, field.name), checks.positive)


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
    >>> from per_obspy.pounding.stationary_ground import WhiteNoise
    >>> print(round(ground_correlation(WhiteNoise(0.01), 1.0, 0.05, 1.2, 0.05), 6))
    0.229814
    """
    first = linear_oscillator(_number("period_1", period_1), _number("damping_1", damping_1))
    second = linear_oscillator(_number("period_2", period_2), _number("damping_2", damping_2))
    return correlation(stationary_covariance(ground, first, second), 0, 2)


def _number(name: str, value: ArrayLike) -> float:
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


ComplexArray = NDArray[np.complex128]


def psd_correlation(
    psd: ArrayLike,
    frequencies: ArrayLike,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
) -> FloatArray:
    """
    Compute the correlation of two displacements under a tabulated ground motion spectrum.

    Parameters
    ----------
    psd : (n_frequencies,) array_like
        Power spectral density of the acceleration, any scale (m²/s³).
    frequencies : (n_frequencies,) array_like
        Circular frequencies, increasing, not negative, rad/s. Between them the density is linear,
        outside it is zero.
    period_1, period_2 : array_like
        Undamped periods, s.
    damping_1, damping_2 : array_like
        Fractions of critical, above 0 and below 1, dimensionless.

    Returns
    -------
    correlation : ndarray
        Broadcast shape of the pairs, dimensionless, from -1 to 1.

    Raises
    ------
    ValueError
        If an argument is out of range, the frequencies do not increase, or the density is zero
        everywhere.

    Notes
    -----
    ``rho = I12 / sqrt(I11 I22)``, ``Ijk = ∫ Re(Hj Hk*) S dω``, ``H = 1/(ωi² - ω² + 2 i ξi ωi ω)``.
    The product is a sum over its four poles p of ``R/(ω - p)``, whose integral with a linear S is a
    logarithm: no sharp resonance is missed, however coarse the table.

    Examples
    --------
    A band that contains both structures acts like white noise, equation (16):

    >>> print(psd_correlation([1.0, 1.0], [0.0, 1e4], 1.0, 0.05, 1.2, 0.05).round(6))
    0.229814
    """
    density, frequencies = _table(psd, frequencies)
    period_1 = checks.positive("period_1", period_1)
    period_2 = checks.positive("period_2", period_2)
    damping_1 = checks.positive("damping_1", checks.fraction_of_critical("damping_1", damping_1))
    damping_2 = checks.positive("damping_2", checks.fraction_of_critical("damping_2", damping_2))

    # rho = I12 / sqrt(I11 I22)
    first, second = _poles(period_1, damping_1), _poles(period_2, damping_2)
    covariance = _integral(first, second, density, frequencies)
    variance_1 = _integral(first, first, density, frequencies)
    variance_2 = _integral(second, second, density, frequencies)
    correlation = covariance / np.sqrt(variance_1 * variance_2)
    bounded: FloatArray = np.minimum(np.maximum(correlation, -1.0), 1.0)
    return bounded


def _table(psd: ArrayLike, frequencies: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the checked spectrum: a density that is not zero everywhere, at rising frequencies."""
    density = checks.not_negative("psd", psd)
    frequencies = checks.not_negative("frequencies", frequencies)
    if density.ndim != 1 or density.shape != frequencies.shape or density.size < 2:
        raise ValueError(
            f"psd and frequencies must be rows of equal length, got {density.shape}, "
            f"{frequencies.shape}"
        )

    # Name the first frequency after the steepest fall
    steps = np.diff(frequencies)
    if not np.all(steps > 0):
        fallen = frequencies[int(np.argmin(steps)) + 1]
        raise ValueError(f"frequencies must increase, got {fallen}")
    if not density.any():
        raise ValueError("psd is 0 everywhere: there is no motion")
    return density, frequencies


def _poles(period: FloatArray, damping: FloatArray) -> ComplexArray:
    """Return the two poles of H over circular frequency, last axis."""
    omega, side = 2.0 * np.pi / period, np.sqrt((1.0 - damping) * (1.0 + damping))
    return np.stack([omega * (1j * damping + side), omega * (1j * damping - side)], axis=-1)


def _integral(
    first: ComplexArray, second: ComplexArray, density: FloatArray, frequencies: FloatArray
) -> FloatArray:
    """Return the integral of Re(H1 H2*) times the linear interpolation of the density."""
    first, second = np.broadcast_arrays(first, second)
    poles = np.concatenate([first, second.conj()], axis=-1)

    # Density as a straight line start + slope omega in each interval
    slope = np.diff(density) / np.diff(frequencies)
    start = density[:-1] - slope * frequencies[:-1]

    # Each of the four poles adds its residue times the integral of density/(omega - pole)
    total = np.zeros(poles.shape[:-1])
    for number in range(4):
        pole = poles[..., number, None]
        others = np.delete(poles, number, axis=-1)
        residue = 1.0 / np.prod(pole - others, axis=-1)
        logarithms = np.diff(np.log(frequencies - pole), axis=-1)
        integral = np.sum((start + slope * pole) * logarithms, axis=-1)
        total += (residue * integral).real
    return total
