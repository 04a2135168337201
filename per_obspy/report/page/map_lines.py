"""Lines of the map of the page: coasts and borders, and the outlines of buildings."""

from collections.abc import Collection
from functools import cache
from importlib.resources import as_file, files
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import ArrayLike, NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.places import largest_towns

#: The lines reach beyond the region by this share of its size, and by this many degrees at least.
MARGIN, LEAST_MARGIN = 1.0, 2.0

#: Towns that are so near to a place are amid them, degrees.
AMID = 0.1

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


def continuous(longitude: ArrayLike) -> FloatArray:
    """
    Return longitudes (degrees) without a step at the date line.

    Examples
    --------
    >>> print(continuous([179.5, -179.5]), continuous([-71.0, 10.0]))
    [179.5 180.5] [-71.  10.]
    """
    given = np.asarray(longitude, dtype=np.float64)
    if given.size == 0 or np.nanmax(given) - np.nanmin(given) <= 180.0:
        return given
    return np.where(given < 0.0, given + 360.0, given)


def lines_around(longitude: FloatArray, latitude: FloatArray) -> dict[str, list[list[float]]]:
    """
    Return the coast lines and borders around places.

    Parameters
    ----------
    longitude, latitude : (n_places,) ndarray
        Degrees; places that are not finite are left out, longitudes have no step at the date line.

    Returns
    -------
    dict
        ``coast`` and ``borders``: lines of longitude and latitude by turns, degrees; longitudes are
        within 180 degrees of the places. Both are empty without a place.
    """
    found: dict[str, list[list[float]]] = {"coast": [], "borders": []}
    known = np.isfinite(longitude) & np.isfinite(latitude)
    if not known.any():
        return found
    # Corners near the places, of which few enough are kept
    world, places = _world(), np.stack([longitude[known], latitude[known]], axis=1)
    corners = _beside_places(world.corners, places)
    near = _near(corners, places)
    stride = 1 + int(near.sum()) // MOST_CORNERS
    # Line by line, with its index of the first corner
    starts = np.concatenate([[0], world.ends[:-1]])
    for line in np.flatnonzero(np.add.reduceat(near, starts, dtype=np.int64)):
        part = slice(starts[line], world.ends[line])
        kind = "borders" if world.is_border[line] else "coast"
        found[kind] += _pieces(corners[part], near[part], stride)
    return found


def towns_around(
    longitude: FloatArray, latitude: FloatArray, most: int
) -> list[tuple[str, float, float]]:
    """
    Return name, longitude and latitude of the largest towns around places (degrees).

    Those amid the places come first: the neighbourhood may have a hundred larger ones.
    """
    known = np.isfinite(longitude) & np.isfinite(latitude)
    if not known.any():
        return []
    places = np.stack([longitude[known], latitude[known]], axis=1)
    low, high = _box(places)
    # First the region itself
    edges = (places.min(axis=0) - AMID, places.max(axis=0) + AMID)
    towns = largest_towns(edges[0].tolist(), edges[1].tolist(), most)
    return list(dict.fromkeys([*towns, *largest_towns(low.tolist(), high.tolist(), most)]))[:most]


def beside(longitude: FloatArray, middle: float) -> FloatArray:
    """Return longitudes within 180 degrees of the middle of a map."""
    return np.asarray(middle + (longitude - middle + 180.0) % 360.0 - 180.0)


def _beside_places(corners: FloatArray, places: FloatArray) -> FloatArray:
    """Return corners with longitudes within 180 degrees of the middle of places."""
    middle = 0.5 * float(places[:, 0].min() + places[:, 0].max())
    return np.stack([beside(corners[:, 0], middle), corners[:, 1]], axis=1)


def _near(corners: FloatArray, places: FloatArray) -> NDArray[np.bool_]:
    """Return a mask of the corners near places, and of their neighbours."""
    low, high = _box(places)
    near = ((corners >= low) & (corners <= high)).all(axis=1)
    # Steps into the box and out of it belong to the lines
    joined: NDArray[np.bool_] = near | np.roll(near, 1) | np.roll(near, -1)
    return joined


def _box(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and highest longitude and latitude of a region around places."""
    low, high = places.min(axis=0), places.max(axis=0)
    margin = np.maximum(MARGIN * (high - low), LEAST_MARGIN)
    return low - margin, high + margin


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


#: Outlines on the page, and corners of each, at most.
MOST_OUTLINES = 8_000
MOST_RING_CORNERS = 60

#: Decimals of degrees: 0.1 m.
RING_DECIMALS = 6


def read_outlines(path: Path, names: Collection[str]) -> list[tuple[str, list[float]]]:
    """
    Read the outlines of buildings; empty without the table or the library that reads it.

    Parameters
    ----------
    path : Path
        GeoParquet with ``building_id`` and ``geometry`` in degrees.
    names : collection of str
        Buildings that are wanted, the most important first.

    Returns
    -------
    list of (str, list of float)
        Name, and longitude and latitude of the corners by turns.
    """
    if not path.is_file() or find_spec("shapely") is None:
        return []
    # The first names are of the worst pairs
    wanted = set(list(names)[:MOST_OUTLINES])
    outlines = list[tuple[str, list[float]]]()
    with pq.ParquetFile(path, pre_buffer=False) as file:
        if not {"building_id", "geometry"} <= set(file.schema_arrow.names):
            return []
        for batch in file.iter_batches(10_000, columns=["building_id", "geometry"]):
            # Names of buildings may be stored as numbers
            texts = pc.cast(batch["building_id"], "string").to_pylist()
            chosen = [(name, row) for row, name in enumerate(texts) if name in wanted]
            shapes = batch["geometry"]
            outlines += [(name, _corners(shapes[row].as_py())) for name, row in chosen]
    return [(name, corners) for name, corners in outlines if corners]


def _corners(shape: bytes | None) -> list[float]:
    """Return the corners of the largest polygon of a shape, none if it has no finite outline."""
    import shapely

    geometry: Any = shapely.from_wkb(shape, on_invalid="ignore") if shape else None
    if geometry is None or geometry.is_empty:
        return []
    polygon = max(shapely.get_parts(geometry), key=shapely.area)
    tolerance = 0.0
    corners = shapely.get_coordinates(shapely.get_exterior_ring(polygon))
    while len(corners) > MOST_RING_CORNERS:
        # Double the distance by which the outline may be off until it is simple
        tolerance = max(2.0 * tolerance, 1e-6)
        corners = shapely.get_coordinates(shapely.simplify(polygon, tolerance))
    flat = np.round(corners, RING_DECIMALS).ravel()
    return flat.tolist() if np.isfinite(flat).all() else []
