"""Drift of the displacement of a record, and the lowest high-pass corner that cleans it."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from scipy.fft import irfft
from scipy.optimize import brentq

from per_obspy.checks import FloatArray
from per_obspy.processing.filter.butterworth import butterworth_amplitude, thin_spectrum

#: Order of the polynomial that is the drift.
POLYNOMIAL_ORDER = 5

#: Ratio of successive trial corners.
STEP = 1.2

#: Frequencies above move the displacement by less than a thousandth and are left out, Hz.
FASTEST = 10.0

#: A corner is found to this difference of its logarithm.
TOLERANCE = 1e-3


def displacement_drift(
    acceleration: FloatArray, dt: float, lowest: float, order: int
) -> Callable[[float], float]:
    r"""
    Return the share of drift in a record's displacement as a function of the high-pass corner.

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
        Lowest corner to be tried, Hz: it decides the length of the pads.
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
    choices of this package.
    """
    # Spectrum of the displacement before the filter, on a grid thinner by a whole number
    thin = max(int(0.5 / (FASTEST * dt)), 1)
    frequencies, spectrum, points, first = thin_spectrum(acceleration, dt, lowest, order, thin)
    angular = 2 * np.pi * np.where(frequencies > 0, frequencies, np.inf)
    spectrum /= -(angular**2)
    count = acceleration.size // thin
    basis = _polynomial_basis(count)

    def drift(highpass: float) -> float:
        amplitude = butterworth_amplitude(frequencies, highpass, np.inf, order)
        displacement = irfft(spectrum * amplitude, points)
        # Least-squares polynomial over the record without its pads
        record = displacement[first : first + count]
        largest = np.abs(record).max()
        return float(np.abs(basis @ (basis.T @ record)).max() / largest) if largest > 0 else 0.0

    return drift


@lru_cache(maxsize=4)
def _polynomial_basis(count: int) -> FloatArray:
    """Return orthonormal polynomials over evenly spaced points, (count, order + 1)."""
    return np.linalg.qr(np.vander(np.linspace(-1, 1, count), POLYNOMIAL_ORDER + 1))[0]


def clean_highpass(
    drift: Callable[[float], float], lowest: float, highest: float, target: float
) -> float | None:
    """
    Return the lowest corner at which, and above which, the displacement is clean.

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
        Largest drift of a clean displacement, dimensionless.

    Returns
    -------
    float or None
        Hz; None if even the highest corner leaves too much.
    """
    lower = highest
    if drift(lower) > target:
        return None

    def excess(log_corner: float) -> float:
        return drift(np.exp(log_corner)) - target

    # Steps down to the first corner that is not clean, then the root inside the last step
    while lower > lowest:
        upper, lower = lower, max(lower / STEP, lowest)
        if drift(lower) > target:
            root = brentq(excess, np.log(lower), np.log(upper), xtol=TOLERANCE)
            return float(np.exp(root))
    return float(lower)
