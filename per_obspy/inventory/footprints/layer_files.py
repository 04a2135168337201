"""
Files of building footprints: geometries as WKB, attributes and reference system, unchecked.

They are read in a process of their own, with limits of time and memory, each by the reader of its
suffix if its first bytes are those of such a file. GDAL would choose a driver by the content and
follow it to other files and addresses.
"""

import json
import re
import sqlite3
import warnings
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet
import shapely
from numpy.typing import NDArray

from per_obspy.errors import CatalogError, Rejection, TryLater, shortened
from per_obspy.files import scratch_folder, unreadable_reason, writing
from per_obspy.inventory.files.parquet import plain_columns
from per_obspy.inventory.footprints.building_lists import read_list
from per_obspy.inventory.footprints.gdal_paths import literal_path
from per_obspy.inventory.importers.building_files import SUFFIXES, read_buildings
from per_obspy.inventory.importers.importer import RawLayer as ImportedLayer
from per_obspy.inventory.importers.nested_columns import without_nesting
from per_obspy.reader_process import BeyondLimits, Limits, read_layer_apart, require_own_drivers

#: Files that GDAL reads; GeoParquet is read by pyarrow, lists of buildings by the reader of tables.
GDAL_KINDS = {
    ".gpkg": "GeoPackage",
    ".geojson": "GeoJSON file",
    ".json": "GeoJSON file",
    ".shp": "Shapefile",
    ".fgb": "FlatGeobuf file",
}
JSON_SUFFIXES = (".geojson", ".json")
PARQUET_SUFFIXES = (".parquet", ".geoparquet")
LIST_SUFFIXES = (".csv",)

#: How files that GDAL reads begin; those of JSON after blanks.
_BEGINNINGS = {
    ".gpkg": (b"SQLite format 3\x00",),
    ".shp": (b"\x00\x00\x27\x0a",),
    ".fgb": (b"fgb\x03fgb",),
    **dict.fromkeys(JSON_SUFFIXES, (b"{", b"[")),
}

#: How SQLite keeps a table that holds its rows, and the index of places of one.
_TABLE = re.compile(r"\s*CREATE\s+TABLE\b", re.IGNORECASE)
_PLACES = re.compile(
    r"""\s*CREATE\s+VIRTUAL\s+TABLE\s+(?:"[^"]*"|\w+)\s+USING\s+"?rtree"?\s*\(""", re.IGNORECASE
)

#: Longest beginning of a GeoJSON file in which members of the collection are sought, bytes.
HEAD = 1 << 20


class RawLayer(NamedTuple):
    """
    A layer as its file has it.

    Attributes
    ----------
    wkb : pa.ChunkedArray
        Geometries as WKB; null where there is none.
    attributes : pa.Table
        One row per geometry.
    crs : object
        Coordinate reference system in any form; None if unknown.
    numbers : (n,) ndarray of int
        Number of each feature in the file, or line of a list.
    faults : mapping of int to str
        Position of a feature -> why it has no geometry, where that is known.
    broken : tuple of Rejection
        Lines of a list that are no rows.
    """

    wkb: pa.ChunkedArray
    attributes: pa.Table
    crs: Any
    numbers: NDArray[np.int64]
    faults: Mapping[int, str] = {}
    broken: tuple[Rejection, ...] = ()


def read_raw_layer(file: Path, layer: str | None) -> RawLayer:
    """
    Read a layer by the reader of the file's suffix.

    Parameters
    ----------
    file : Path
        GeoPackage, GeoJSON, Shapefile, FlatGeobuf, GeoParquet or CSV.
    layer : str or None
        Name of the layer, for files that have several.

    Raises
    ------
    CatalogError
        If the file is missing, or cannot be read as its suffix indicates.
    """
    suffix = file.suffix.lower()
    if not file.exists():
        raise CatalogError(str(file), "no such file")
    # GDAL knows further files, but not whether they hold footprints
    known = (*GDAL_KINDS, *PARQUET_SUFFIXES, *LIST_SUFFIXES, *SUFFIXES)
    if suffix not in known:
        expected = ", ".join(known)
        raise CatalogError(str(file), f"unknown suffix {file.suffix!r}, expected one of {expected}")
    if not file.is_file():
        raise CatalogError(str(file), "is no regular file")
    if suffix in GDAL_KINDS:
        _require_beginning(file, GDAL_KINDS[suffix])
    try:
        found: RawLayer = read_layer_apart(_limits(file), _read, file, layer)
    except BeyondLimits as error:
        raise CatalogError(str(file), f"{error}: damaged, too large, or made to harm") from error
    return found


def _limits(file: Path) -> Limits:
    """
    Return the limits of reading a layer.

    Reasoned: the areas of OpenStreetMap, the slowest, take 2 s for each MiB of ``.osm.pbf`` and 20
    times its place in memory.
    """
    size = file.stat().st_size
    return Limits(120.0 + 5.0 * size / 2**20, (4 << 30) + 30 * size)


def _read(file: Path, layer: str | None) -> RawLayer:
    """Read a layer in the process of readers."""
    suffix = file.suffix.lower()
    if (buildings := read_buildings(file)) is not None:
        return raw_features(buildings)
    if suffix in LIST_SUFFIXES:
        found = read_list(file)
        # Positions of a list are degrees
        return RawLayer(
            found.wkb, found.attributes, "OGC:CRS84", found.lines, found.faults, found.broken
        )
    return _read_gdal(file, layer) if suffix in GDAL_KINDS else _read_geoparquet(file)


def _read_gdal(file: Path, layer: str | None) -> RawLayer:
    """Read a layer with GDAL."""
    import pyogrio  # in the process of readers only

    kind = GDAL_KINDS[file.suffix.lower()]
    require_own_drivers(pyogrio.list_drivers())
    try:
        # GDAL warns of its repairs, such as rings that are not closed, and of unreadable features
        with (
            warnings.catch_warnings(action="ignore", category=RuntimeWarning),
            _tables_only(file) as (own, views),
            literal_path(own) as path,
        ):
            name = _layer_name(file, pyogrio.list_layers(path), layer, views)
            meta, table = pyogrio.raw.read_arrow(path, layer=name, force_2d=False)
    except TryLater:
        raise
    except (
        pyogrio.errors.DataSourceError,
        pyogrio.errors.DataLayerError,
        pa.ArrowException,
        sqlite3.Error,
        OSError,
        UnicodeDecodeError,
    ) as error:
        raise CatalogError(str(file), unreadable_reason(file, kind, error)) from error
    # Messages of GDAL, except for a reference system that it does not know
    is_json = file.suffix.lower() in JSON_SUFFIXES
    crs = (_declared_system(file) if is_json else None) or meta["crs"]
    geometry = table.column_names[-1]
    fields = [str(name) for name in meta["fields"]]
    return _raw_layer(file, table[geometry], table.select(fields), crs)


def _require_beginning(file: Path, kind: str) -> None:
    """Check the first bytes of a file for GDAL, and that no part of it is elsewhere."""
    suffix = file.suffix.lower()
    with file.open("rb") as opened:
        head = opened.read(HEAD)
    if suffix in JSON_SUFFIXES:
        head = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if not head.startswith(_BEGINNINGS[suffix]):
        text = shortened(head[:20].decode("latin-1"))
        error = ValueError(f"it begins with {text!r}")
        raise CatalogError(str(file), unreadable_reason(file, kind, error))
    # Parts of a file that is here are here too; a folder of links to all parts is one place
    if suffix == ".shp" and not file.is_symlink():
        for part in file.parent.iterdir():
            if part.is_symlink() and part.stem == file.stem:
                raise CatalogError(
                    str(file), f"its part {part.name} is a link that leads elsewhere"
                )


@contextmanager
def _tables_only(file: Path) -> Iterator[tuple[Path, set[str]]]:
    """
    Yield the place of a layer file, and the views of a GeoPackage, which are not read.

    A view is a search that may be without an end, and a virtual table is a program's: a GeoPackage
    with such ones is read from a copy without them.
    """
    if file.suffix.lower() != ".gpkg":
        yield file, set()
        return
    with closing(sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro", uri=True)) as package:
        foreign = _views(package)
        _require_stored(file, package, foreign)
        # Only a package that has some is copied
        if foreign:
            with scratch_folder() as folder:
                copy = folder / "layer.gpkg"
                with writing(copy), closing(sqlite3.connect(copy)) as target:
                    package.backup(target)
                    _remove(target, foreign)
                yield copy, foreign
            return
    yield file, foreign


def _views(package: sqlite3.Connection) -> set[str]:
    """Return the views and virtual tables of a database but for the index of places."""
    entries = package.execute("SELECT name, sql FROM sqlite_master WHERE type IN ('view', 'table')")
    return {name for name, sql in entries if sql and not (_TABLE.match(sql) or _PLACES.match(sql))}


def _require_stored(file: Path, package: sqlite3.Connection, foreign: set[str]) -> None:
    """Refuse tables whose columns are computed: by functions that may do anything."""
    tables = package.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
    for (table,) in tables:
        columns = "SELECT name FROM pragma_table_xinfo(?) WHERE hidden IN (2, 3)"
        for (column,) in () if table in foreign else package.execute(columns, (table,)):
            problem = f"column {column} of table {table} is computed, expected a stored one"
            raise CatalogError(str(file), problem)


def _remove(package: sqlite3.Connection, foreign: set[str]) -> None:
    """Remove views and virtual tables, triggers, and the layers that they were."""
    package.execute("PRAGMA writable_schema = ON")
    package.execute("DELETE FROM sqlite_master WHERE type = 'trigger'")
    for name in foreign:
        package.execute("DELETE FROM sqlite_master WHERE name = ?", (name,))
    for table in {"gpkg_contents", "gpkg_geometry_columns"} - foreign:
        tables = "SELECT name FROM sqlite_master WHERE type = 'table'"
        package.execute(f"DELETE FROM {table} WHERE table_name NOT IN ({tables})")
    package.commit()


def raw_features(buildings: ImportedLayer) -> RawLayer:
    """Return the buildings of an importer's reader as a layer."""
    shapes = buildings.geometries.copy()
    shapes[list(buildings.faults)] = None
    wkb = pa.chunked_array([pa.array(shapely.to_wkb(shapes), pa.large_binary())])
    # Cells of JSON may be numbers and texts in one column
    columns = {}
    for name in buildings.attributes:
        cells = buildings.attributes[name]
        is_mixed = pd.api.types.infer_dtype(cells, skipna=True).startswith("mixed")
        columns[str(name)] = pa.array(cells.astype(str).where(cells.notna()) if is_mixed else cells)
    numbers = np.arange(1, len(wkb) + 1)
    return RawLayer(wkb, pa.table(columns), buildings.crs, numbers, dict(buildings.faults))


def _raw_layer(file: Path, wkb: pa.ChunkedArray, attributes: pa.Table, crs: Any) -> RawLayer:
    """Return a layer whose attributes are plain columns with unique names."""
    names = attributes.column_names
    repeated = [name for name in names if names.count(name) > 1]
    if repeated:
        raise CatalogError(str(file), f"column {repeated[0]} occurs more than once")
    # Text that is not UTF-8 is refused
    plain, faults = plain_columns(attributes.replace_schema_metadata(None))
    for row, fault in faults.items():
        raise CatalogError(str(file), f"feature {row + 1}: {fault}")
    return RawLayer(wkb, plain, crs, np.arange(1, len(wkb) + 1))


def _declared_system(file: Path) -> str | None:
    """Return the coordinate reference system of a GeoJSON file, for which GDAL may take WGS 84."""
    try:
        declared = _members(file).get("crs")
    except (ValueError, RecursionError) as error:
        raise CatalogError(str(file), f"not a GeoJSON file: {error}") from error
    if declared is None:
        return None
    # The name of the older standard, or its form with a code
    try:
        properties = declared["properties"]
        return str(properties["name"] if "name" in properties else f"EPSG:{properties['code']}")
    except (KeyError, TypeError):
        return json.dumps(declared)


def _members(file: Path) -> dict[str, Any]:
    """Return the members of a GeoJSON file; those before its features if they have the system."""
    with file.open("rb") as stream:
        head, features, _ = stream.read(HEAD).partition(b'"features"')
    # Most writers have the system before the features, whose objects would not fit in memory
    if features and b'"crs"' in head:
        try:
            members = json.loads(head.rstrip().removesuffix(b",") + b"}")
        except ValueError:
            members = {}
        if "crs" in members:
            return dict(members)
    text = file.read_bytes()
    found = json.loads(text) if b'"crs"' in text else {}
    if not isinstance(found, dict):
        raise ValueError(f"a {type(found).__name__} instead of an object")
    return found


def _layer_name(file: Path, layers: Any, layer: str | None, views: set[str]) -> str:
    """Return the requested one of the layers and their geometries, or the only one with them."""
    kinds = {str(name): kind for name, kind in layers}
    # A view may be what the user means
    if layer in views or (views and layer is None and not any(kinds.values())):
        shown = layer or ", ".join(sorted(views))
        problem = f"layer {shown} is a view, which may have no end: save it as a table"
        raise CatalogError(str(file), problem)
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


def _read_geoparquet(file: Path) -> RawLayer:
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
    name, crs = _geometry_column(file, table, described)
    return _raw_layer(file, table[name], table.drop_columns([name]), crs)


def _geometry_column(file: Path, table: pa.Table, described: bytes) -> tuple[str, Any]:
    """Return name and coordinate reference system of the primary geometry column."""
    try:
        geo = json.loads(described)
        name = geo["primary_column"]
        column = geo["columns"][name]
        encoding, kind = column.get("encoding"), table[name].type
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        problem = f"wrong GeoParquet metadata: {type(error).__name__} {error}"
        raise CatalogError(str(file), problem) from error
    if encoding != "WKB":
        raise CatalogError(str(file), f"geometries are encoded as {encoding!r}, expected WKB")
    if not (pa.types.is_binary(kind) or pa.types.is_large_binary(kind)):
        raise CatalogError(
            str(file), f"wrong GeoParquet metadata: column {name} is {kind}, not bytes"
        )
    # A missing CRS means OGC:CRS84 by the GeoParquet specification, an explicit null means unknown
    return name, column.get("crs", "OGC:CRS84")
