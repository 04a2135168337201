"""Which station's record a pair of buildings is given: the nearest one."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from per_obspy.checks import FloatArray

#: Mean radius of the earth (IUGG), m. On the sphere distances are within 0.6 % of the ellipsoid's.
EARTH_RADIUS = 6_371_008.8


def nearest_station(
    longitude: FloatArray, latitude: FloatArray, station_longitude: FloatArray, station_latitude: FloatArray
) -> tuple[NDArray[np.intp], FloatArray]:
    """
    Return the nearest station of every place and the great-circle distance to it.

    Parameters
    ----------
    longitude, latitude : (n_places,) ndarray
        Degrees east and north.
    station_longitude, station_latitude : (n_stations,) ndarray
        Degrees east and north, at least one station.

    Returns
    -------
    station : (n_places,) ndarray of int
        Index of the station.
    distance : (n_places,) ndarray
        On the sphere, m.

    Examples
    --------
    >>> nearest_station(np.array([0.1]), np.array([0.0]), np.array([180.0, 0.0]), np.array([0.0, 0.0]))[1].round()
    array([11120.])
    """
    tree = cKDTree(_on_sphere(station_longitude, station_latitude))
    chord, station = tree.query(_on_sphere(longitude, latitude))
    return np.asarray(station, dtype=np.intp), 2.0 * EARTH_RADIUS * np.arcsin(np.clip(chord / 2.0, 0.0, 1.0))


def _on_sphere(longitude: FloatArray, latitude: FloatArray) -> FloatArray:
    """Return points on the unit sphere, (n, 3)."""
    east, north = np.radians(longitude), np.radians(latitude)
    return np.stack([np.cos(north) * np.cos(east), np.cos(north) * np.sin(east), np.sin(north)], axis=-1)
