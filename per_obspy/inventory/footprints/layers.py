"""Read a layer of building footprints: polygons in degrees, their attributes, and what is no polygon."""

import json
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet
import pyogrio
import pyproj
import shapely
from numpy.typing import NDArray

from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import unreadable_reason

#: Files that GDAL reads for us; GeoParquet is read by pyarrow.
GDAL_KINDS = {
    ".gpkg": "GeoPackage",
    ".geojson": "GeoJSON file",
    ".json": "GeoJSON file",
    ".shp": "Shapefile",
    ".fgb": "FlatGeobuf file",
}
PARQUET_SUFFIXES = (".parquet", ".geoparquet")

Geometries = NDArray[np.object_]

_POLYGONAL = (shapely.GeometryType.POLYGON, shapely.GeometryType.MULTIPOLYGON)


class Layer(NamedTuple):
    """
    Footprints of one layer.

    Attributes
    ----------
    polygons : (n_buildings,) ndarray of shapely geometries
        Valid polygons and multipolygons, two-dimensional, longitude and latitude in degrees (WGS
        84).
    attributes : DataFrame
        One row a polygon; its index is the number of the feature in the file, from 1.
    rejected : tuple of Rejection
        Features whose geometry cannot be used.
    """

    polygons: Geometries
    attributes: pd.DataFrame
    rejected: tuple[Rejection, ...]


class _Raw(NamedTuple):
    geometries: Geometries
    attributes: pd.DataFrame
    crs: Any


def read_layer(path: str | Path, layer: str | None = None) -> Layer:
    """
    Read the footprints of a file.

    Parameters
    ----------
    path : str or Path
        GeoPackage, GeoJSON, Shapefile, FlatGeobuf or GeoParquet.
    layer : str, optional
        Name of the layer, for files that have several.

    Raises
    ------
    CatalogError
        If the file cannot be read, has no coordinate reference system, or the layer is empty or
        holds no polygons.
    """
    file = Path(path)
    raw = _read(file, layer)
    if len(raw.geometries) == 0:
        raise CatalogError(str(file), "the layer has no features")
    kinds = shapely.get_type_id(raw.geometries)
    if set(kinds[kinds >= 0].tolist()) <= {
        shapely.GeometryType.POINT,
        shapely.GeometryType.MULTIPOINT,
    }:
        raise CatalogError(
            str(file), "the layer holds points, not footprints: a gap is a distance between walls"
        )
    crs = _reference_system(file, raw.crs)
    degrees = _in_degrees(shapely.force_2d(raw.geometries), crs)
    # a town lies within 180 m and 90 m of the origin of its projection only if its coordinates are
    # degrees
    stray = _on_earth(raw.geometries) & bool(crs.is_projected)
    good = _are_footprints(degrees) & ~stray
    rejected = tuple(
        Rejection(
            "building",
            f"feature {i + 1}",
            str(file),
            i + 1,
            (_fault(degrees[i], raw.geometries[i], stray[i]),),
        )
        for i in np.flatnonzero(~good).tolist()
    )
    attributes = raw.attributes.set_index(pd.RangeIndex(1, len(good) + 1))
    return Layer(degrees[good], attributes[good], rejected)


def _read(file: Path, layer: str | None) -> _Raw:
    suffix = file.suffix.lower()
    if not file.exists():
        raise CatalogError(str(file), "no such file")
    if suffix == ".csv":
        raise CatalogError(
            str(file),
            "a table has no walls, and a gap is a distance between walls: footprints are needed",
        )
    if suffix not in (*GDAL_KINDS, *PARQUET_SUFFIXES):
        expected = ", ".join((*GDAL_KINDS, *PARQUET_SUFFIXES))
        raise CatalogError(str(file), f"unknown suffix {file.suffix!r}, expected one of {expected}")
    return _read_gdal(file, layer) if suffix in GDAL_KINDS else _read_geoparquet(file)


def _read_gdal(file: Path, layer: str | None) -> _Raw:
    try:
        # GDAL warns of what it repairs, such as rings that are not closed, and of what it then
        # cannot read
        with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
            name = _layer_name(file, layer)
            meta, _, geometries, fields = pyogrio.raw.read(file, layer=name, force_2d=False)
    except (
        pyogrio.errors.DataSourceError,
        pyogrio.errors.DataLayerError,
        UnicodeDecodeError,
    ) as error:
        raise CatalogError(
            str(file), unreadable_reason(file, GDAL_KINDS[file.suffix.lower()], error)
        ) from error
    attributes = pd.DataFrame(
        dict(zip(meta["fields"], fields, strict=True)), index=range(len(geometries))
    )
    return _Raw(shapely.from_wkb(geometries, on_invalid="ignore"), attributes, meta["crs"])


def _layer_name(file: Path, layer: str | None) -> str:
    """Return the layer asked for, or the only one with geometries."""
    kinds = {str(name): kind for name, kind in pyogrio.list_layers(file)}
    spatial = [name for name, kind in kinds.items() if kind is not None]
    if layer is not None:
        if layer not in kinds:
            raise CatalogError(str(file), f"no layer {layer!r} (layers found: {', '.join(kinds)})")
        return layer
    if not spatial:
        raise CatalogError(
            str(file), f"no layer has geometries (layers found: {', '.join(kinds) or 'none'})"
        )
    if len(spatial) > 1:
        raise CatalogError(str(file), f"several layers, name one: {', '.join(spatial)}")
    return spatial[0]


def _read_geoparquet(file: Path) -> _Raw:
    try:
        table = pa.parquet.read_table(file)
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise CatalogError(str(file), unreadable_reason(file, "Parquet table", error)) from error
    described = (table.schema.metadata or {}).get(b"geo")
    if described is None:
        raise CatalogError(
            str(file), "no GeoParquet metadata: a table of pairs is no layer of footprints"
        )
    try:
        geo = json.loads(described)
        name = geo["primary_column"]
        column = geo["columns"][name]
        encoding = column.get("encoding")
        geometries = (
            shapely.from_wkb(table[name].to_numpy(), on_invalid="ignore")
            if encoding == "WKB"
            else None
        )
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise CatalogError(
            str(file), f"wrong GeoParquet metadata: {type(error).__name__} {error}"
        ) from error
    if geometries is None:
        raise CatalogError(str(file), f"geometries are encoded as {encoding!r}, expected WKB")
    # a missing CRS means OGC:CRS84 by the GeoParquet specification, an explicit null means unknown
    attributes = table.drop_columns([name]).replace_schema_metadata(None).to_pandas()
    return _Raw(geometries, attributes, column.get("crs", "OGC:CRS84"))


def _reference_system(file: Path, crs: Any) -> pyproj.CRS:
    if crs is None:
        raise CatalogError(str(file), "no coordinate reference system (a Shapefile needs its .prj)")
    try:
        return pyproj.CRS.from_user_input(crs)
    except pyproj.exceptions.CRSError as error:
        raise CatalogError(
            str(file), f"unknown coordinate reference system {str(crs)!r:.60}"
        ) from error


def _in_degrees(geometries: Geometries, crs: pyproj.CRS) -> Geometries:
    transformer = pyproj.Transformer.from_crs(crs, "OGC:CRS84", always_xy=True)
    return np.asarray(
        shapely.transform(geometries, lambda xy: np.column_stack(transformer.transform(*xy.T)))
    )


def _are_footprints(degrees: Geometries) -> NDArray[np.bool_]:
    polygonal = np.isin(shapely.get_type_id(degrees), _POLYGONAL) & ~shapely.is_empty(degrees)
    return np.asarray(polygonal & _on_earth(degrees) & shapely.is_valid(degrees))


def _on_earth(degrees: Geometries | shapely.Geometry) -> NDArray[np.bool_]:
    """Return where coordinates are degrees; a projection gives infinity far outside its range."""
    return np.asarray((np.abs(shapely.bounds(degrees)) <= [180.0, 90.0, 180.0, 90.0]).all(axis=-1))


def _fault(degrees: shapely.Geometry | None, original: shapely.Geometry | None, stray: bool) -> str:
    """Return why a geometry is no footprint."""
    if degrees is None or original is None:
        return "no geometry"
    if degrees.is_empty:
        return "the geometry is empty"
    if shapely.get_type_id(degrees) not in _POLYGONAL:
        return f"the geometry is a {degrees.geom_type}, not a polygon"
    place = ", ".join(f"{value:g}" for value in original.bounds[:2])
    if stray:
        return (
            f"coordinates {place} are degrees, the layer's coordinate reference system is in metres"
        )
    if not _on_earth(degrees):
        swapped = _on_earth(shapely.transform(degrees, np.fliplr))
        asked = " (longitude and latitude swapped?)" if swapped else ""
        return f"coordinates {place} lie outside the layer's coordinate reference system{asked}"
    return f"the polygon is invalid: {shapely.is_valid_reason(original)}"
