"""What a file of buildings is: its source, number, columns used and bounds."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely

from per_obspy.inventory.footprints.layers import in_degrees, raw_layer
from per_obspy.inventory.importers.recognition import recognised


class BuildingsDescription(NamedTuple):
    """
    A file of buildings.

    Attributes
    ----------
    source : str
        Name of the importer that recognised the columns.
    count : int
        Number of features.
    outlines : int
        Features with a polygon; points have none, and pairs need outlines.
    columns : dict
        Name in the schema -> column of the file that gives it.
    bounds : tuple of float or None
        West, south, east, north, degrees; None if no feature has coordinates on the Earth.
    """

    source: str
    count: int
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
    # Features that lie on the Earth
    degrees = in_degrees(Path(path), raw)
    box = shapely.bounds(degrees)
    box = box[(np.abs(box) <= [180.0, 90.0, 180.0, 90.0]).all(axis=1)]
    bounds = None
    if len(box):
        west, south = box[:, :2].min(axis=0).tolist()
        east, north = box[:, 2:].max(axis=0).tolist()
        bounds = (west, south, east, north)
    kinds = (shapely.GeometryType.POLYGON, shapely.GeometryType.MULTIPOLYGON)
    outlines = int(np.isin(shapely.get_type_id(raw.geometries), kinds).sum())
    return BuildingsDescription(importer.name, len(raw.geometries), outlines, columns, bounds)
