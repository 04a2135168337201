"""
Stationary ground motions: filtered white noise with a power spectral density and a state space.

Intensities are two-sided power spectral densities S0 of the white noise, m²/s³, over circular
frequency.
"""

from dataclasses import dataclass, fields
from typing import NamedTuple, Protocol

import numpy as np

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
    """Refuse parameters that are not positive."""
    for field in fields(ground):
        checks.number(field.name, getattr(ground, field.name), checks.positive)
