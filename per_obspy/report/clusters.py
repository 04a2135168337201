"""Clusters of pairs on a map: towns of a region, each drawn at a separate scale."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import label

from per_obspy.checks import FloatArray
from per_obspy.constants import METRES_PER_DEGREE

IntArray = NDArray[np.int64]

#: Cells along the longer side of a region; pairs in cells that touch are one cluster.
CELLS = 24

#: Smallest side of a map, m: a street with its buildings.
SMALLEST = 200.0


class Frame(NamedTuple):
    """
    Rectangle on a map.

    Attributes
    ----------
    west, east, south, north : float
        Degrees; east is above 180 where the rectangle crosses the date line.
    """

    west: float
    east: float
    south: float
    north: float

    @property
    def stretch(self) -> float:
        """Length of a degree of longitude over one of latitude, in the middle."""
        return max(float(np.cos(np.radians(0.5 * (self.south + self.north)))), 0.01)

    @property
    def size(self) -> float:
        """Longer side, m."""
        sides = (self.east - self.west) * self.stretch, self.north - self.south
        return METRES_PER_DEGREE * max(sides)

    def padded(self, share: float) -> "Frame":
        """Return a frame that is larger by a share of its longer side, and not too small."""
        room = max(share * self.size, 0.5 * (SMALLEST - self.size)) / METRES_PER_DEGREE
        east = room / self.stretch
        return Frame(self.west - east, self.east + east, self.south - room, self.north + room)


def frame_of(longitude: ArrayLike, latitude: ArrayLike) -> Frame:
    """Return the smallest frame around some points (degrees), at least one."""
    east, north = np.asarray(longitude, dtype=np.float64), np.asarray(latitude, dtype=np.float64)
    return Frame(float(east.min()), float(east.max()), float(north.min()), float(north.max()))


def continuous(longitude: ArrayLike) -> FloatArray:
    """
    Return longitudes (degrees) without a step at the date line.

    Examples
    --------
    >>> print(continuous([179.5, -179.5]), continuous([-71.0, 10.0]))
    [179.5 180.5] [-71.  10.]
    """
    given = np.asarray(longitude, dtype=np.float64)
    if given.size == 0 or np.ptp(given) <= 180.0:
        return given
    return np.where(given < 0.0, given + 360.0, given)


def clusters(longitude: FloatArray, latitude: FloatArray, whole: Frame) -> list[IntArray]:
    """
    Separate points into clusters, in the order of their first points.

    A grid of ``CELLS`` cells covers the frame; points in cells that touch belong together.

    Parameters
    ----------
    longitude, latitude : (n_points,) ndarray
        Degrees, within the frame.
    whole : Frame
        The map.

    Returns
    -------
    members : list of ndarray of int
        Positions of the points of each cluster, ascending; the cluster of point 0 is the first.
    """
    cell = max(whole.size, SMALLEST) / CELLS / METRES_PER_DEGREE
    column = ((longitude - whole.west) * whole.stretch / cell).astype(np.int64)
    row = ((latitude - whole.south) / cell).astype(np.int64)
    occupied = np.zeros((row.max(initial=0) + 1, column.max(initial=0) + 1), dtype=bool)
    occupied[row, column] = True
    # Cells touch by sides and corners
    numbers, _ = label(occupied, structure=np.ones((3, 3)))
    found = numbers[row, column]
    order = list(dict.fromkeys(found.tolist()))
    return [np.flatnonzero(found == number).astype(np.int64) for number in order]
