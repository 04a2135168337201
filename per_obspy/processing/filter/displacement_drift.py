"""The lowest high-pass corner whose displacement does not wander."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq
from scipy.optimize import brentq

from per_obspy.checks import FloatArray
from per_obspy.processing.filter.butterworth import butterworth_amplitude

POLYNOMIAL_ORDER = 5
STEP = 1.2  # ratio of successive trial corners
FASTEST = 10.0  # Hz: what is faster moves displacement by less than a thousandth, so it is left out


def displacement_drift(
    acceleration: FloatArray, dt: float, lowest: float, order: int
) -> Callable[[float], float]:
    r"""
    Return how much of a record's displacement is drift, as a function of the high-pass corner.

    .. math:: d(f_{hp}) = \max_t |p_5(t)| / \max_t |u(t)|

    where u is the displacement of the filtered record, without its pads, and p5 the polynomial of
    fifth order fitted to it.

    Parameters
    ----------
    acceleration : (n_samples,) ndarray
        Tapered, m/s2.
    dt : float
        Sampling interval, s.
    lowest : float
        Lowest corner that will be asked for, Hz: it decides the length of the pads.
    order : int
        Of the Butterworth filter.

    Returns
    -------
    callable
        From the corner, Hz, to the drift, dimensionless.

    References
    ----------
    Ramos-Sepulveda et al. 2023 (algorithm auto_fchp of Brandenberg and others; gmprocess adopted
    it): the criterion and its target; the polynomial of fifth order and the search from above are
    our choices.
    """
    thin = max(int(0.5 / (FASTEST * dt)), 1)
    side = thin * int(np.ceil(0.75 * order / lowest / dt / thin))
    length = thin * next_fast_len(int(np.ceil((acceleration.size + 2 * side) / thin)), real=True)
    points, first, count = length // thin, side // thin, acceleration.size // thin
    frequencies = rfftfreq(length, dt)[: points // 2 + 1]
    angular = 2 * np.pi * np.where(frequencies > 0, frequencies, np.inf)
    padded = np.pad(acceleration, (side, length - acceleration.size - side))
    spectrum = -rfft(padded)[: frequencies.size] / (angular**2 * thin)
    basis = _polynomial_basis(count)

    def drift(highpass: float) -> float:
        displacement = irfft(
            spectrum * butterworth_amplitude(frequencies, highpass, np.inf, order), points
        )
        record = displacement[first : first + count]
        largest = np.abs(record).max()
        return float(np.abs(basis @ (basis.T @ record)).max() / largest) if largest > 0 else 0.0

    return drift


@lru_cache(maxsize=4)
def _polynomial_basis(count: int) -> FloatArray:
    """Return orthonormal polynomials over evenly spaced points, (count, order + 1); components share it."""
    return np.linalg.qr(np.vander(np.linspace(-1, 1, count), POLYNOMIAL_ORDER + 1))[0]


def clean_highpass(
    drift: Callable[[float], float], lowest: float, highest: float = 0.5, target: float = 0.02
) -> float | None:
    """
    Return the lowest corner from which on the displacement is clean, at this corner and at all higher ones.

    Corners are tried from the highest down in steps of a fifth until the drift exceeds the target;
    the root inside that step is found by Brent's method in logarithmic frequency, to 0.1 % of the
    corner.

    Parameters
    ----------
    drift : callable
        From `displacement_drift`.
    lowest, highest : float
        Corners allowed, Hz.
    target : float
        Drift that is clean, dimensionless.

    Returns
    -------
    float or None
        Hz; None if even the highest corner leaves too much.
    """
    lower = highest
    if drift(lower) > target:
        return None
    while lower > lowest:
        upper, lower = lower, max(lower / STEP, lowest)
        if drift(lower) > target:
            root = brentq(
                lambda x: drift(np.exp(x)) - target, np.log(lower), np.log(upper), xtol=1e-3
            )
            return float(np.exp(root))
    return float(lower)
