"""Outlines of buildings for the page, from the table next to pairs made from footprints."""

from collections.abc import Collection
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.compute as pc
import pyarrow.parquet as pq

#: Outlines on the page, and corners of each, at most.
MOST_OUTLINES = 8_000
MOST_CORNERS = 60

#: Decimals of degrees: 0.1 m.
DECIMALS = 6


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
    while len(corners) > MOST_CORNERS:
        # Double the distance by which the outline may be off until it is simple
        tolerance = max(2.0 * tolerance, 1e-6)
        corners = shapely.get_coordinates(shapely.simplify(polygon, tolerance))
    flat = np.round(corners, DECIMALS).ravel()
    return flat.tolist() if np.isfinite(flat).all() else []
