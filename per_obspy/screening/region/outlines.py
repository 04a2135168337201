"""Outlines of the cells of a grid, and H3 hexagons as cells."""

from collections.abc import Iterable

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray


def hexagons(longitude: ArrayLike, latitude: ArrayLike, resolution: int) -> NDArray[np.object_]:
    """
    Find the H3 cell of each place.

    Parameters
    ----------
    longitude, latitude : (n_places,) array_like
        Degrees east and north.
    resolution : int
        From 0 to 15; a cell of resolution 8 has about 0.7 km², each further step a seventh of that.

    Returns
    -------
    cell : (n_places,) ndarray of str
        Index of the cell, hexadecimal.

    References
    ----------
    https://h3geo.org. Needs the extra ``gis``.

    Examples
    --------
    >>> hexagons([-122.388903], [37.769377], 9).tolist()
    ['89283082e73ffff']
    """
    from h3 import latlng_to_cell

    east = np.atleast_1d(checks.between("longitude", longitude, -180.0, 180.0)).tolist()
    north = np.atleast_1d(checks.between("latitude", latitude, -90.0, 90.0)).tolist()
    cells = [latlng_to_cell(y, x, resolution) for x, y in zip(east, north, strict=True)]
    return np.array(cells, dtype=object)


def hexagon_outlines(cells: Iterable[str]) -> list[FloatArray]:
    """
    Return the corners of H3 cells, each (n_corners, 2), degrees east and north.

    Longitudes of a cell across the date line go on beyond 180.
    """
    from h3 import cell_to_boundary

    return [_unbroken(np.array(cell_to_boundary(cell))[:, ::-1]) for cell in cells]


def _unbroken(corners: FloatArray) -> FloatArray:
    """Return corners with longitudes without jumps by 360 degrees."""
    east = corners[:, 0]
    if np.ptp(east) <= 180.0:
        return corners
    return np.column_stack([east % 360.0, corners[:, 1]])


def box_outlines(boxes: pd.DataFrame) -> FloatArray:
    """Return the corners of boxes ``west, south, east, north``, (n_boxes, 4, 2), degrees."""
    west, south, east, north = boxes[["west", "south", "east", "north"]].to_numpy(np.float64).T
    corners = np.stack([(west, south), (east, south), (east, north), (west, north)], axis=0)
    return corners.transpose(2, 0, 1)
