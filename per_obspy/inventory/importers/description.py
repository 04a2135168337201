"""What a file of buildings is: its source, number, columns used and bounds."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely

from per_obspy.inventory.footprints.layers import Geometries, in_degrees, raw_layer
from per_obspy.inventory.importers.recognition import recognised

_POLYGONAL = (shapely.GeometryType.POLYGON, shapely.GeometryType.MULTIPOLYGON)


class BuildingsDescription(NamedTuple):
    """
    A file of buildings.

    Attributes
    ----------
    source : str
        Name of the importer that recognised the columns.
    features : int
        Number of features.
    outlines : int
        Features with a polygon; points have none, and pairs need outlines.
    columns : dict
        Name in the schema -> column of the file that gives it.
    bounds : tuple of float or None
        West, south, east, north, degrees; None if no feature has coordinates on the Earth.
    """

    source: str
    features: int
    outlines: int
    columns: dict[str, str]
    bounds: tuple[float, float, float, float] | None


def describe_buildings(path: str | Path, layer: str | None = None) -> BuildingsDescription:
    """
    Describe a file of buildings, of outlines or points.

    Parameters
    ----------
    path : str or Path
        Any file that :func:`~per_obspy.inventory.footprints.layers.read_layer` reads, and files of
        points.
    layer : str, optional
        Name of the layer, for files that have several.

    Raises
    ------
    CatalogError
        If the file cannot be read.
    """
    raw = raw_layer(path, layer)
    importer = recognised(map(str, raw.attributes.columns))
    names = set(importer.adapted(raw.attributes).columns)
    columns = {name: column for name, column in importer.columns.items() if column in names}
    # Outlines and places
    is_outline = np.isin(shapely.get_type_id(raw.geometries), _POLYGONAL)
    bounds = _bounds(in_degrees(Path(path), raw))
    outlines = int(is_outline.sum())
    return BuildingsDescription(importer.name, len(raw.geometries), outlines, columns, bounds)


def _bounds(degrees: Geometries) -> tuple[float, float, float, float] | None:
    """Return west, south, east and north of the geometries that lie on the Earth, degrees."""
    # Without what a wrong reference system throws off
    box = shapely.bounds(degrees)
    box = box[(np.abs(box) <= [180.0, 90.0, 180.0, 90.0]).all(axis=1)]
    if not len(box):
        return None
    west, south = box[:, :2].min(axis=0).tolist()
    east, north = box[:, 2:].max(axis=0).tolist()
    return west, south, east, north
