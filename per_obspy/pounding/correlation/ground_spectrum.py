"""Correlation of two linear structures under stationary ground motion of any spectral shape."""

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray

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
