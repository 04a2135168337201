"""The gap that a grid of period pairs needs whatever the azimuth of their axis."""

import numpy as np
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation.by_azimuth import worst_azimuth
from per_obspy.pounding.history.relative import directional_relative_displacement


def azimuthal_gap_surface(
    north: ArrayLike,
    east: ArrayLike,
    dt: float,
    periods_1: ArrayLike,
    periods_2: ArrayLike,
    damping_1: float = 0.05,
    damping_2: float = 0.05,
) -> FloatArray:
    """
    Largest relative displacement of every pair of periods over all azimuths.

    Parameters
    ----------
    north, east : (n_samples,) array_like
        Ground acceleration, m/s².
    dt : float
        Sampling interval, s.
    periods_1, periods_2 : (n_1,), (n_2,) array_like
        Undamped periods, s.
    damping_1, damping_2 : float
        Fractions of critical.

    Returns
    -------
    gap : (n_1, n_2) ndarray
        m; exact along the worst azimuth, which is found at the samples.

    Raises
    ------
    ValueError
        If an argument is out of range.

    See Also
    --------
    per_obspy.pounding.history.relative.critical_gap_surface : along one azimuth.
    """
    first, second = np.meshgrid(
        np.atleast_1d(checks.positive("periods_1", periods_1)),
        np.atleast_1d(checks.positive("periods_2", periods_2)),
        indexing="ij",
    )
    period_1, period_2, one = first.ravel(), second.ravel(), np.ones(first.size)
    xi_1 = checks.number("damping_1", damping_1, checks.fraction_of_critical) * one
    xi_2 = checks.number("damping_2", damping_2, checks.fraction_of_critical) * one
    azimuth = worst_azimuth(north, east, dt, period_1, xi_1, period_2, xi_2, one, one)
    apart = directional_relative_displacement(
        north, east, dt, period_1, xi_1, period_2, xi_2, azimuth
    )
    surface: FloatArray = apart.largest.reshape(first.shape)
    return surface
