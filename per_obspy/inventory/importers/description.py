"""Description of a file of buildings: its source, number, columns used and bounds."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely

from per_obspy.inventory.footprints.layer_files import RawLayer, raw_features, read_raw_layer
from per_obspy.inventory.footprints.layers import BLOCK, in_degrees, polygons, to_degrees
from per_obspy.inventory.importers.csv_buildings import has_outlines, read_csv_points
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
    file = Path(path)
    raw = read_csv_points(file, str(file)) if _is_table_of_points(file) else None
    features = raw_features(raw) if raw else read_raw_layer(file, layer)
    # Columns by the source's table
    attributes = features.attributes.to_pandas()
    importer = recognised(map(str, attributes.columns))
    names = set(importer.adapted(attributes).columns)
    columns = {name: column for name, column in importer.columns.items() if column in names}
    outlines, bounds = _places(file, features)
    return BuildingsDescription(importer.name, len(features.wkb), outlines, columns, bounds)


def _is_table_of_points(file: Path) -> bool:
    """Return whether a file is a CSV table without outlines."""
    return file.suffix.lower() == ".csv" and not has_outlines(file)


def _places(file: Path, features: RawLayer) -> tuple[int, tuple[float, float, float, float] | None]:
    """Return the number of outlines, and the bounds of all features on the Earth, degrees."""
    transformer, _ = to_degrees(file, features.crs)
    # Block by block, to bound memory
    outlines, boxes = 0, [np.empty((0, 4))]
    for start in range(0, len(features.wkb), BLOCK):
        found = polygons(features.wkb.slice(start, BLOCK))
        outlines += int(np.isin(shapely.get_type_id(found), _POLYGONAL).sum())
        degrees = in_degrees(found, transformer)
        # Leave out positions that a wrong reference system moves away
        box = shapely.bounds(degrees)
        boxes.append(box[(np.abs(box) <= [180.0, 90.0, 180.0, 90.0]).all(axis=1)])
    every = np.concatenate(boxes)
    if not len(every):
        return outlines, None
    west, south = every[:, :2].min(axis=0).tolist()
    east, north = every[:, 2:].max(axis=0).tolist()
    return outlines, (west, south, east, north)
