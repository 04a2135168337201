"""
Buildings of a layer: outlines, columns, places and areas, and the file that goes with the pairs.

Pairs refer to it by ``building_id_1`` and ``building_id_2``.
"""

import json
from hashlib import blake2b
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet
import pyproj
import shapely
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import written_whole
from per_obspy.inventory.footprints.layers import BLOCK, blocks, polygons, transformed
from per_obspy.inventory.footprints.neighbours import IntArray, Outlines
from per_obspy.inventory.footprints.raw_layer import Geometries

#: A local projection is true to scale within this range of longitudes, degrees.
WIDEST_LAYER = 6.0

#: Version of GeoParquet that is written: https://geoparquet.org/releases/v1.1.0/.
GEOPARQUET = "1.1.0"

#: Column of the outlines.
GEOMETRY = "geometry"


class Buildings(NamedTuple):
    """
    Buildings with usable outlines.

    Attributes
    ----------
    outlines : pa.Array
        WKB in degrees (WGS 84).
    table : DataFrame
        One row per outline: ``building_id``, ``longitude``, ``latitude`` (degrees), ``area`` (m2),
        columns of the schema, all others.
    """

    outlines: pa.Array
    table: pd.DataFrame


def without_repetitions(
    outlines: pa.Array, table: pd.DataFrame, source: str
) -> tuple[Buildings, tuple[Rejection, ...]]:
    """
    Return buildings without those that repeat an earlier outline or ``building_id``.

    Outlines are WKB in degrees; the index of the table is the number of the feature.
    """
    identifiers = table["building_id"]
    same_shape, same_name = _repeated(outlines), identifiers.duplicated().to_numpy()
    repeats = same_shape | same_name
    # Each repetition with its reasons
    rejected = []
    for i in np.flatnonzero(repeats).tolist():
        name, number = identifiers.iloc[i], int(table.index[i])
        shape = ["the polygon repeats an earlier one"] * int(same_shape[i])
        again = [f"building_id = {name!r} occurs in an earlier feature already"] * int(same_name[i])
        rejected.append(Rejection("building", name, source, number, (*shape, *again)))
    if rejected:
        outlines, table = outlines.filter(pa.array(~repeats)), table[~repeats]
    return Buildings(outlines, table), tuple(rejected)


def _repeated(outlines: pa.Array) -> NDArray[np.bool_]:
    """Return where an outline repeats an earlier one, whatever the order of its points."""
    digests = list[bytes]()
    for _, shapes in blocks(outlines):
        # Shorter than the outlines, and never shared by two
        for wkb in shapely.to_wkb(shapely.normalize(shapes)):
            digests.append(blake2b(wkb, digest_size=16).digest())
    return pd.Series(digests, dtype=object).duplicated().to_numpy()


def projected(buildings: Buildings, source: str) -> tuple[Buildings, Outlines]:
    """
    Return buildings with their places, degrees, and areas, m2, and their outlines in metres.

    Raises
    ------
    CatalogError
        If they span more than 6 degrees of longitude.
    """
    outlines = buildings.outlines
    # Places in degrees, and the region for which the projection is to be
    place, boxes = [], []
    for _, degrees in blocks(outlines):
        place.append(shapely.get_coordinates(shapely.centroid(degrees)))
        boxes.append(shapely.bounds(degrees))
    transformer, meridian = _projection(np.concatenate(boxes), source)
    # Boxes and areas in metres
    bounds, area = [], []
    for _, degrees in blocks(outlines):
        metres = transformed(degrees, transformer)
        bounds.append(shapely.bounds(metres))
        area.append(shapely.area(metres))

    def in_metres(numbers: IntArray) -> Geometries:
        return transformed(polygons(outlines.take(pa.array(numbers))), transformer)

    # Outlines may go on beyond 180 degrees, places do not
    longitude, latitude = np.concatenate(place).T
    table = buildings.table.assign(
        longitude=np.where(longitude > 180.0, longitude - 360.0, longitude),
        latitude=latitude,
        area=np.concatenate(area),
    )
    return Buildings(outlines, table), Outlines(np.concatenate(bounds), in_metres, meridian)


def _projection(boxes: FloatArray, source: str) -> tuple[pyproj.Transformer, float]:
    """Return a transverse Mercator projection about the middle of boxes, and its meridian."""
    # Around all boxes; across 180 degrees those to the west of it go on beyond it
    if np.ptp(boxes[:, ::2]) > 180.0:
        beyond = boxes[:, 2] < 0.0
        boxes = np.where(beyond[:, None] & [True, False, True, False], boxes + 360.0, boxes)
    west, south = boxes[:, :2].min(axis=0)
    east, north = boxes[:, 2:].max(axis=0)
    if east - west > WIDEST_LAYER:
        raise CatalogError(
            source,
            f"footprints from {west:g} to {east:g} degrees east: split the layer, "
            f"a local projection covers {WIDEST_LAYER:g} degrees",
        )
    # True to scale along the meridian in their middle
    longitude, latitude = float(west + east) / 2.0, float(south + north) / 2.0
    local = pyproj.CRS.from_dict(
        {"proj": "tmerc", "lon_0": longitude, "lat_0": latitude, "datum": "WGS84"}
    )
    return pyproj.Transformer.from_crs("OGC:CRS84", local, always_xy=True), longitude


def write_buildings(buildings: Buildings, path: Path) -> None:
    """
    Write buildings as GeoParquet, whole or not at all.

    Outlines are the column ``geometry``, longitude and latitude in degrees.
    """
    table = pa.Table.from_pandas(buildings.table, preserve_index=False)
    outlines = buildings.outlines.cast(pa.binary())
    # Without a reference system GeoParquet means degrees, WGS 84
    column = {"encoding": "WKB", "geometry_types": ["Polygon", "MultiPolygon"]}
    geo = {"version": GEOPARQUET, "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}
    table = table.append_column(GEOMETRY, outlines)
    with written_whole(path) as part:
        described = table.replace_schema_metadata({"geo": json.dumps(geo)})
        pa.parquet.write_table(described, part, row_group_size=5 * BLOCK)
