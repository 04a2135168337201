"""Cells of the earth by which a ranked table is divided, and the names of their files."""

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray

#: Name of the cell of all pairs without coordinates.
NO_PLACE = "no_place"


def cell_names(longitude: FloatArray, latitude: FloatArray, size: float) -> NDArray[np.object_]:
    """
    Return the name of the cell of each place, by its corner of least latitude and longitude.

    Names consist of numbers only, so that no text of a pair table becomes part of a path.

    Parameters
    ----------
    longitude, latitude : (n_places,) ndarray
        Degrees east and north; NaN if unknown.
    size : float
        Width and height of a cell, degrees, at least 0.1.

    Examples
    --------
    >>> cell_names(np.array([139.7, -70.2, np.nan]), np.array([35.6, -33.4, 0.0]), 1.0).tolist()
    ['lat35_lon139', 'lat-34_lon-71', 'no_place']
    """
    places = np.floor(np.stack([latitude, longitude]) / size)
    known = np.isfinite(places).all(axis=0)
    cells, number = np.unique(places[:, known], axis=1, return_inverse=True)
    # Zero has no sign; six digits keep corners apart that differ by 0.1
    corners = (cells * size + 0.0).T.tolist()
    corner_names = [f"lat{north:.6g}_lon{east:.6g}" for north, east in corners]
    names = np.full(known.size, NO_PLACE, dtype=object)
    names[known] = np.array(corner_names, dtype=object)[number.ravel()]
    return names
