"""Coast lines and borders around a region, from Natural Earth 1:10 million (public domain)."""

from functools import cache
from importlib.resources import as_file, files
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray

#: The lines reach beyond the region by this share of its size, and by this many degrees at least.
MARGIN, LEAST_MARGIN = 1.0, 2.0

#: Corners on a page, at most: every second, third, ... is kept of more.
MOST_CORNERS = 20_000

#: Decimals of degrees: 100 m, which is finer than the lines are.
DECIMALS = 3


class _Lines(NamedTuple):
    """
    Coast lines and borders of the world.

    Attributes
    ----------
    corners : (n_corners, 2) ndarray
        Longitude and latitude, degrees.
    ends : (n_lines,) ndarray of int
        Index after the last corner of each line.
    is_border : (n_lines,) ndarray of bool
        Whether a line lies between two countries; else it is a coast.
    """

    corners: FloatArray
    ends: NDArray[np.int64]
    is_border: NDArray[np.bool_]


def lines_around(longitude: FloatArray, latitude: FloatArray) -> dict[str, list[list[float]]]:
    """
    Return the coast lines and borders around places.

    Parameters
    ----------
    longitude, latitude : (n_places,) ndarray
        Degrees; places that are not finite are left out.

    Returns
    -------
    dict
        ``coast`` and ``borders``: lines of longitude and latitude by turns, degrees. Both are empty
        without a place.
    """
    found: dict[str, list[list[float]]] = {"coast": [], "borders": []}
    known = np.isfinite(longitude) & np.isfinite(latitude)
    if not known.any():
        return found
    # Corners near the places, of which few enough are kept
    world = _world()
    near = _near(world.corners, np.stack([longitude[known], latitude[known]], axis=1))
    stride = 1 + int(near.sum()) // MOST_CORNERS
    # Line by line, with its index of the first corner
    starts = np.concatenate([[0], world.ends[:-1]])
    for start, end, border in zip(starts, world.ends, world.is_border, strict=True):
        if near[start:end].any():
            pieces = _pieces(world.corners[start:end], near[start:end], stride)
            found["borders" if border else "coast"] += pieces
    return found


def _near(corners: FloatArray, places: FloatArray) -> NDArray[np.bool_]:
    """Return a mask of the corners near places, and of their neighbours."""
    low, high = places.min(axis=0), places.max(axis=0)
    margin = np.maximum(MARGIN * (high - low), LEAST_MARGIN)
    near = ((corners >= low - margin) & (corners <= high + margin)).all(axis=1)
    # Steps into the box and out of it belong to the lines
    joined: NDArray[np.bool_] = near | np.roll(near, 1) | np.roll(near, -1)
    return joined


def _pieces(corners: FloatArray, near: NDArray[np.bool_], stride: int) -> list[list[float]]:
    """Return the near parts of a line, thinned to every n-th corner and the last."""
    # First corners that are near, and first ones that are not, by turns
    edges = np.flatnonzero(np.diff(near.astype(np.int8), prepend=0, append=0))
    pieces = []
    for first, after in edges.reshape(-1, 2):
        part = corners[first:after]
        thinned = np.concatenate([part[:-1:stride], part[-1:]])
        if len(thinned) > 1:
            pieces.append(np.round(thinned, DECIMALS).ravel().tolist())
    return pieces


@cache
def _world() -> _Lines:
    """Read all lines from the file that ``workflows/coast_lines.py`` writes."""
    resource = files("per_obspy.report.page") / "assets" / "coast_lines.npz"
    with as_file(resource) as path, np.load(path, allow_pickle=False) as stored:
        ends = np.cumsum(stored["lengths"])
        starts = ends - stored["lengths"]
        # Steps from the first corner of each line, whose own step is 0
        sums = np.cumsum(stored["steps"].astype(np.int64), axis=0)
        first = np.repeat(stored["starts"] - sums[starts], stored["lengths"], axis=0)
        return _Lines((sums + first) * float(stored["unit"]), ends, stored["is_border"])
