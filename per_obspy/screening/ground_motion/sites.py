"""Places with their site class, Vs30 and distance to the source of the earthquake."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray


class Sites(NamedTuple):
    """
    Places, (n_places,).

    Attributes
    ----------
    longitude, latitude : ndarray
        Degrees east and north.
    site_class : ndarray of str
        Name of the site class, free text; ``""`` where it is unknown.
    source_distance : ndarray
        Distance to the source of the earthquake, m; NaN where it is unknown.
    vs30 : ndarray
        Mean shear-wave velocity of the upper 30 m, m/s; NaN where it is unknown.
    """

    longitude: FloatArray
    latitude: FloatArray
    site_class: NDArray[np.object_]
    source_distance: FloatArray
    vs30: FloatArray

    def at(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> "Sites":
        """Return some of the places."""
        return Sites(
            self.longitude[rows],
            self.latitude[rows],
            self.site_class[rows],
            self.source_distance[rows],
            self.vs30[rows],
        )


def sites(
    longitude: ArrayLike,
    latitude: ArrayLike,
    site_class: ArrayLike = "",
    source_distance: ArrayLike = np.nan,
    vs30: ArrayLike = np.nan,
) -> Sites:
    """Return places with their ground; a single value holds for all (see :class:`Sites`)."""
    # Contiguous: functions of NumPy may differ in the last bit between strides
    east = np.ascontiguousarray(checks.between("longitude", longitude, -180.0, 180.0))
    north = np.ascontiguousarray(checks.between("latitude", latitude, -90.0, 90.0))
    distance = np.broadcast_to(np.asarray(source_distance, dtype=np.float64), east.shape)
    velocity = np.broadcast_to(np.asarray(vs30, dtype=np.float64), east.shape)
    return Sites(
        longitude=east,
        latitude=north,
        site_class=np.broadcast_to(np.asarray(site_class, dtype=object), east.shape),
        source_distance=np.ascontiguousarray(distance),
        vs30=np.ascontiguousarray(velocity),
    )
