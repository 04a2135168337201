"""Correlation of two linear structures under stationary ground motion of any spectral shape."""

import numpy as np
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray


def psd_correlation(
    psd: ArrayLike,
    frequencies: ArrayLike,
    period_1: ArrayLike,
    damping_1: ArrayLike,
    period_2: ArrayLike,
    damping_2: ArrayLike,
) -> FloatArray:
    """
    Correlation of two displacements under a tabulated power spectral density of the ground acceleration.

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
    period_1, period_2 = (
        checks.positive("period_1", period_1),
        checks.positive("period_2", period_2),
    )
    damping_1 = checks.positive("damping_1", checks.fraction_of_critical("damping_1", damping_1))
    damping_2 = checks.positive("damping_2", checks.fraction_of_critical("damping_2", damping_2))
    one, two = _poles(period_1, damping_1), _poles(period_2, damping_2)
    both = _integral(one, two, density, frequencies)
    correlation = both / np.sqrt(
        _integral(one, one, density, frequencies) * _integral(two, two, density, frequencies)
    )
    bounded: FloatArray = np.minimum(np.maximum(correlation, -1.0), 1.0)
    return bounded


def _table(psd: ArrayLike, frequencies: ArrayLike) -> tuple[FloatArray, FloatArray]:
    density, frequencies = (
        checks.not_negative("psd", psd),
        checks.not_negative("frequencies", frequencies),
    )
    if density.ndim != 1 or density.shape != frequencies.shape or density.size < 2:
        raise ValueError(
            f"psd and frequencies must be rows of equal length, got {density.shape}, {frequencies.shape}"
        )
    if not np.all(np.diff(frequencies) > 0):
        raise ValueError(
            f"frequencies must increase, got {frequencies[int(np.argmin(np.diff(frequencies))) + 1]}"
        )
    if not density.any():
        raise ValueError("psd is 0 everywhere: nothing moves")
    return density, frequencies


def _poles(
    period: FloatArray, damping: FloatArray
) -> np.ndarray[tuple[int, ...], np.dtype[np.complex128]]:
    """Return the two poles of H over circular frequency, last axis."""
    omega, side = 2.0 * np.pi / period, np.sqrt((1.0 - damping) * (1.0 + damping))
    return np.stack([omega * (1j * damping + side), omega * (1j * damping - side)], axis=-1)


def _integral(
    one: np.ndarray[tuple[int, ...], np.dtype[np.complex128]],
    two: np.ndarray[tuple[int, ...], np.dtype[np.complex128]],
    density: FloatArray,
    frequencies: FloatArray,
) -> FloatArray:
    """Return the integral of Re(H1 H2*) times the linear interpolation of the density."""
    one, two = np.broadcast_arrays(one, two)
    poles = np.concatenate([one, two.conj()], axis=-1)
    slope = np.diff(density) / np.diff(frequencies)
    start = density[:-1] - slope * frequencies[:-1]
    total = np.zeros(poles.shape[:-1])
    for place in range(4):
        pole = poles[..., place]
        residue = 1.0 / np.prod(pole[..., None] - np.delete(poles, place, axis=-1), axis=-1)
        logarithms = np.diff(np.log(frequencies - pole[..., None]), axis=-1)
        total += (residue * np.sum((start + slope * pole[..., None]) * logarithms, axis=-1)).real
    return total
