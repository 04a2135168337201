"""Distances between places, and the spatial correlation of residuals about the trend."""

import numpy as np
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.constants import EARTH_RADIUS

#: The longest period for which the correlation was published, s; longer ones take its value.
LONGEST = 10.0


def great_circle(
    longitude_1: ArrayLike, latitude_1: ArrayLike, longitude_2: ArrayLike, latitude_2: ArrayLike
) -> FloatArray:
    """Compute distances on the sphere, m, of places in degrees; 0 between a place and itself."""
    east_1, north_1 = np.radians(longitude_1), np.radians(latitude_1)
    east_2, north_2 = np.radians(longitude_2), np.radians(latitude_2)
    # The haversine formula keeps its digits at small distances
    across = np.cos(north_1) * np.cos(north_2) * np.sin((east_2 - east_1) / 2.0) ** 2
    half_chord = np.sqrt(np.sin((north_2 - north_1) / 2.0) ** 2 + across)
    distance: FloatArray = 2.0 * EARTH_RADIUS * np.arcsin(np.minimum(half_chord, 1.0))
    return distance


def spatial_correlation(
    distance: ArrayLike, period: float, vs30_clustered: bool = False
) -> FloatArray:
    """
    Compute the correlation of within-event residuals of ln SA at two places.

    Parameters
    ----------
    distance : array_like
        Between the places, m.
    period : float
        s; above 10 s that of 10 s.
    vs30_clustered : bool
        Whether Vs30 varies smoothly over the region (case 2), which makes short periods agree over
        longer distances.

    Returns
    -------
    correlation : ndarray
        Dimensionless, 1 at distance 0.

    References
    ----------
    Jayaram & Baker (2009), Earthquake Engineering and Structural Dynamics 38, 1687-1708, equations
    (17) to (20).

    Examples
    --------
    >>> print(spatial_correlation([0.0, 25_700.0], 1.0).round(4))
    [1.     0.0498]
    """
    period = checks.number("period", period, checks.not_negative)
    return residual_correlation(checks.not_negative("distance", distance), period, vs30_clustered)


def residual_correlation(distance: FloatArray, period: float, vs30_clustered: bool) -> FloatArray:
    """Return :func:`spatial_correlation` of arguments that need no check."""
    correlation: FloatArray = np.exp(-distance / decay_length(np.asarray(period), vs30_clustered))
    return correlation


def decay_length(period: FloatArray, vs30_clustered: bool) -> FloatArray:
    """Return the distance at which the correlation is 1/e, m: a third of the published range."""
    # Jayaram & Baker (2009), equations (17) and (18) below 1 s, (19) above
    short = 40.7 - 15.0 * period if vs30_clustered else 8.5 + 17.2 * period
    kilometres = np.where(period >= 1.0, 22.0 + 3.7 * np.minimum(period, LONGEST), short)
    length: FloatArray = 1000.0 / 3.0 * kilometres
    return length
