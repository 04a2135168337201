"""Response spectra by azimuth: the two components superpose before the maximum is taken."""

import numpy as np
from numpy.typing import ArrayLike

from .. import checks
from ..checks import FloatArray
from .elastic import OscillatorMaxima, azimuth_maxima

#: Every whole degree of a half turn; the other half repeats it.
AZIMUTHS = np.arange(0, 180)


def azimuthal_per_spectrum(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike = 0.05,
    azimuths: ArrayLike = AZIMUTHS,
) -> FloatArray:
    """Return the PER spectrum along each azimuth, (n_periods, n_azimuths) or (n_damping, n_periods, n_azimuths), m."""
    return _maxima(north, east, dt, periods, damping, azimuths).per


def azimuthal_sd_spectrum(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods: ArrayLike,
    damping: ArrayLike = 0.05,
    azimuths: ArrayLike = AZIMUTHS,
) -> FloatArray:
    """Return the largest displacement along each azimuth, as `azimuthal_per_spectrum`, m."""
    return _maxima(north, east, dt, periods, damping, azimuths).sd


def _maxima(
    north: ArrayLike, east: ArrayLike, dt: float, periods: ArrayLike, damping: ArrayLike, azimuths: ArrayLike
) -> OscillatorMaxima:
    dampings = checks.fraction_of_critical("damping", damping)
    grid = np.broadcast_arrays(
        np.atleast_1d(dampings)[:, None, None], np.atleast_1d(periods)[:, None], np.atleast_1d(azimuths)
    )
    maxima = azimuth_maxima(north, east, dt, grid[1].ravel(), grid[0].ravel(), grid[2].ravel())
    shape = (*dampings.shape, *grid[0].shape[1:])
    return OscillatorMaxima(*(values.reshape(shape) for values in maxima))


def rotd(spectrum: ArrayLike, percentile: float) -> FloatArray:
    """
    Percentile over the azimuths of a spectrum, its last axis (RotD50 is the median, RotD100 the largest).

    Parameters
    ----------
    spectrum : (..., n_azimuths) array_like
        From `azimuthal_per_spectrum` or `azimuthal_sd_spectrum`.
    percentile : float
        From 0 to 100.

    Returns
    -------
    (...) ndarray
        In the unit of the spectrum.

    Raises
    ------
    ValueError
        If the percentile lies outside 0 to 100, or a value is not finite.

    References
    ----------
    Boore, D. M. (2010), Orientation-independent, nongeometric-mean measures of seismic intensity from two horizontal
    components of motion, BSSA 100(4), 1830-1835.

    Examples
    --------
    >>> rotd([[1.0, 3.0, 2.0]], 50)
    array([2.])
    """
    values = checks.finite("spectrum", spectrum)
    if values.ndim == 0 or values.shape[-1] == 0:
        raise ValueError(f"spectrum must have azimuths on its last axis, got the shape {values.shape}")
    share = checks.number("percentile", percentile, lambda name, given: checks.between(name, given, 0.0, 100.0))
    return np.asarray(np.percentile(values, share, axis=-1))
