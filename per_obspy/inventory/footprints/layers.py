"""Readers of layers of building footprints: polygons in degrees, attributes, unusable features."""

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
from per_obspy.inventory.files.plain_columns import plain_columns
from per_obspy.inventory.footprints.gdal_paths import literal_path
from per_obspy.inventory.importers.building_files import SUFFIXES, read_buildings
from per_obspy.inventory.importers.importer import RawLayer as _Raw
from per_obspy.inventory.importers.nested_columns import without_nesting

#: Files that GDAL reads; GeoParquet is read by pyarrow.
GDAL_KINDS = {
    ".gpkg": "GeoPackage",
    ".geojson": "GeoJSON file",
    ".json": "GeoJSON file",
    ".shp": "Shapefile",
    ".fgb": "FlatGeobuf file",
}
JSON_SUFFIXES = (".geojson", ".json")
PARQUET_SUFFIXES = (".parquet", ".geoparquet")

Geometries = NDArray[np.object_]

#: Largest degrees of longitude and latitude, in the order of bounds.
_DEGREES = [180.0, 90.0, 180.0, 90.0]

_POLYGONAL = (shapely.GeometryType.POLYGON, shapely.GeometryType.MULTIPOLYGON)
_POINTS = {shapely.GeometryType.POINT, shapely.GeometryType.MULTIPOINT}


class Layer(NamedTuple):
    """
    Footprints of one layer.

    Attributes
    ----------
    polygons : (n_buildings,) ndarray of shapely geometries
        Valid polygons and multipolygons, two-dimensional, longitude and latitude in degrees (WGS
        84).
    attributes : DataFrame
        One row per polygon; its index is the number of the feature in the file, from 1.
    rejected : tuple of Rejection
        Features whose geometry cannot be used.
    """

    polygons: Geometries
    attributes: pd.DataFrame
    rejected: tuple[Rejection, ...]


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
        contains no polygons.
    """
    file = Path(path)
    raw = _read(file, layer)
    _require_outlines(file, raw.geometries)
    # Longitude and latitude of every feature
    crs = _reference_system(file, raw.crs)
    degrees = _in_degrees(file, shapely.force_2d(raw.geometries), crs)
    # A town lies within 180 m and 90 m of the origin of its projection only if its coordinates are
    # degrees
    stray = _on_earth(raw.geometries) & bool(crs.is_projected)
    good = _are_footprints(degrees) & ~stray
    good[list(raw.faults)] = False
    # Features without a usable polygon
    rejected = []
    for i in np.flatnonzero(~good).tolist():
        fault = raw.faults.get(i) or _fault(degrees[i], raw.geometries[i], stray[i])
        rejected.append(_rejection(file, i + 1, fault))
    attributes = raw.attributes.set_index(pd.RangeIndex(1, len(good) + 1))
    return Layer(degrees[good], attributes[good], tuple(rejected))


def raw_layer(path: str | Path, layer: str | None = None) -> _Raw:
    """Return a layer as its file has it, with points and unusable features."""
    return _read(Path(path), layer)


def in_degrees(file: Path, raw: _Raw) -> Geometries:
    """Return the geometries of a layer in longitude and latitude."""
    return _in_degrees(file, shapely.force_2d(raw.geometries), _reference_system(file, raw.crs))


def _require_outlines(file: Path, geometries: Geometries) -> None:
    """Raise CatalogError if a layer is empty or has points only."""
    if len(geometries) == 0:
        raise CatalogError(str(file), "the layer has no features")
    kinds = shapely.get_type_id(geometries)
    if set(kinds[kinds >= 0].tolist()) <= _POINTS:
        raise CatalogError(
            str(file), "the layer holds points, not footprints: a gap is a distance between walls"
        )


def _rejection(file: Path, number: int, fault: str) -> Rejection:
    """Return the rejection of a feature by its number in the file."""
    return Rejection("building", f"feature {number}", str(file), number, (fault,))


def _read(file: Path, layer: str | None) -> _Raw:
    """Read a layer by the reader of the file's suffix."""
    suffix = file.suffix.lower()
    if not file.exists():
        raise CatalogError(str(file), "no such file")
    if (buildings := read_buildings(file)) is not None:
        return buildings
    if suffix == ".csv":
        raise CatalogError(
            str(file),
            "a table has no walls, and a gap is a distance between walls: footprints are needed",
        )
    # GDAL knows further files, but not whether they hold footprints
    if suffix not in (*GDAL_KINDS, *PARQUET_SUFFIXES):
        expected = ", ".join((*GDAL_KINDS, *PARQUET_SUFFIXES, *SUFFIXES))
        raise CatalogError(str(file), f"unknown suffix {file.suffix!r}, expected one of {expected}")
    return _read_gdal(file, layer) if suffix in GDAL_KINDS else _read_geoparquet(file)


def _read_gdal(file: Path, layer: str | None) -> _Raw:
    """Read a layer with GDAL."""
    try:
        # GDAL warns of its repairs, such as rings that are not closed, and of unreadable features
        with (
            warnings.catch_warnings(action="ignore", category=RuntimeWarning),
            literal_path(file) as path,
        ):
            name = _layer_name(file, path, layer)
            meta, _, geometries, fields = pyogrio.raw.read(path, layer=name, force_2d=False)
    except (
        pyogrio.errors.DataSourceError,
        pyogrio.errors.DataLayerError,
        UnicodeDecodeError,
    ) as error:
        problem = unreadable_reason(file, GDAL_KINDS[file.suffix.lower()], error)
        raise CatalogError(str(file), problem) from error
    # What GDAL found, but for a reference system that it does not know
    columns = dict(zip(meta["fields"], fields, strict=True))
    attributes = pd.DataFrame(columns, index=range(len(geometries)))
    is_json = file.suffix.lower() in JSON_SUFFIXES
    crs = (_declared_system(file) if is_json else None) or meta["crs"]
    return _Raw(shapely.from_wkb(geometries, on_invalid="ignore"), attributes, crs)


def _declared_system(file: Path) -> str | None:
    """Return the coordinate reference system of a GeoJSON file, for which GDAL may take WGS 84."""
    text = file.read_bytes()
    if b'"crs"' not in text:
        return None
    try:
        declared = json.loads(text).get("crs")
    except (ValueError, AttributeError, RecursionError) as error:
        raise CatalogError(str(file), f"not a GeoJSON file: {error}") from error
    if declared is None:
        return None
    # The name of the older standard, or its form with a code
    try:
        properties = declared["properties"]
        return str(properties["name"] if "name" in properties else f"EPSG:{properties['code']}")
    except (KeyError, TypeError):
        return json.dumps(declared)


def _layer_name(file: Path, path: Path, layer: str | None) -> str:
    """Return the requested layer of a path, or the only one with geometries."""
    kinds = {str(name): kind for name, kind in pyogrio.list_layers(path)}
    if layer is not None:
        if layer not in kinds:
            raise CatalogError(str(file), f"no layer {layer!r} (layers found: {', '.join(kinds)})")
        return layer
    # A layer without geometries is a table
    spatial = [name for name, kind in kinds.items() if kind is not None]
    if not spatial:
        found = ", ".join(kinds) or "none"
        raise CatalogError(str(file), f"no layer has geometries (layers found: {found})")
    if len(spatial) > 1:
        raise CatalogError(str(file), f"several layers, name one: {', '.join(spatial)}")
    return spatial[0]


def _read_geoparquet(file: Path) -> _Raw:
    """Read a GeoParquet file."""
    try:
        table = without_nesting(pa.parquet.read_table(file.absolute()))
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise CatalogError(str(file), unreadable_reason(file, "Parquet table", error)) from error
    # GeoParquet is described by JSON in the metadata
    described = (table.schema.metadata or {}).get(b"geo")
    if described is None:
        raise CatalogError(
            str(file), "no GeoParquet metadata: a table of pairs is no layer of footprints"
        )
    name, geometries, crs = _geometry_column(file, table, described)
    attributes, faults = plain_columns(table.drop_columns([name]).replace_schema_metadata(None))
    for row, fault in faults.items():
        raise CatalogError(str(file), f"feature {row + 1}: {fault}")
    return _Raw(geometries, attributes.to_pandas(), crs)


def _geometry_column(file: Path, table: pa.Table, described: bytes) -> tuple[str, Geometries, Any]:
    """Return name, geometries and coordinate reference system of the primary geometry column."""
    try:
        geo = json.loads(described)
        name = geo["primary_column"]
        column = geo["columns"][name]
        encoding = column.get("encoding")
        # Other encodings are refused below
        geometries = None
        if encoding == "WKB":
            geometries = shapely.from_wkb(table[name].to_numpy(), on_invalid="ignore")
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        problem = f"wrong GeoParquet metadata: {type(error).__name__} {error}"
        raise CatalogError(str(file), problem) from error
    if geometries is None:
        raise CatalogError(str(file), f"geometries are encoded as {encoding!r}, expected WKB")
    # A missing CRS means OGC:CRS84 by the GeoParquet specification, an explicit null means unknown
    return name, geometries, column.get("crs", "OGC:CRS84")


def _reference_system(file: Path, crs: Any) -> pyproj.CRS:
    """Return the coordinate reference system of a layer, if it is one of the horizontal."""
    if crs is None:
        raise CatalogError(str(file), "no coordinate reference system (a Shapefile needs its .prj)")
    try:
        found = pyproj.CRS.from_user_input(crs)
    except (pyproj.exceptions.CRSError, TypeError, ValueError, AttributeError) as error:
        problem = f"unknown coordinate reference system {str(crs)!r:.60}"
        raise CatalogError(str(file), problem) from error
    # Heights, local systems of a building site and positions from the centre of the Earth
    if not (found.is_geographic or found.is_projected):
        problem = f"coordinate reference system {found.name!r:.60} is of another kind"
        raise CatalogError(str(file), f"{problem}, expected a geographic or projected one")
    return found


def _in_degrees(file: Path, geometries: Geometries, crs: pyproj.CRS) -> Geometries:
    """Return geometries in longitude and latitude."""
    try:
        transformer = pyproj.Transformer.from_crs(crs, "OGC:CRS84", always_xy=True)
    except pyproj.exceptions.ProjError as error:
        problem = f"coordinate reference system {crs.name!r:.60} cannot be turned into WGS 84"
        raise CatalogError(str(file), problem) from error
    return np.asarray(
        shapely.transform(geometries, lambda xy: np.column_stack(transformer.transform(*xy.T)))
    )


def _are_footprints(degrees: Geometries) -> NDArray[np.bool_]:
    """Return where geometries are valid polygons on the Earth."""
    polygonal = np.isin(shapely.get_type_id(degrees), _POLYGONAL) & ~shapely.is_empty(degrees)
    return np.asarray(polygonal & _on_earth(degrees) & shapely.is_valid(degrees))


def _on_earth(degrees: Geometries | shapely.Geometry) -> NDArray[np.bool_]:
    """Return where coordinates are degrees; a projection gives infinity far outside its range."""
    return np.asarray((np.abs(shapely.bounds(degrees)) <= _DEGREES).all(axis=-1))


def _fault(degrees: shapely.Geometry | None, original: shapely.Geometry | None, stray: bool) -> str:
    """Return the reason for which a geometry is no footprint."""
    if degrees is None or original is None:
        return "no geometry"
    if degrees.is_empty:
        return "the geometry is empty"
    if shapely.get_type_id(degrees) not in _POLYGONAL:
        return f"the geometry is a {degrees.geom_type}, not a polygon"
    # Coordinates that do not fit the coordinate reference system
    place = ", ".join(f"{value:g}" for value in original.bounds[:2])
    if stray:
        return (
            f"coordinates {place} are degrees, the layer's coordinate reference system is in metres"
        )
    if not _on_earth(degrees):
        is_swapped = _on_earth(shapely.transform(degrees, np.fliplr))
        question = " (longitude and latitude swapped?)" if is_swapped else ""
        return f"coordinates {place} lie outside the layer's coordinate reference system{question}"
    return f"the polygon is invalid: {shapely.is_valid_reason(original)}"
