"""
Files of building footprints: geometries as WKB, attributes and reference system, unchecked.

They are read in a process of their own, with limits of time and memory, each by the reader of its
suffix if its first bytes are those of such a file. GDAL would choose a driver by the content and
follow it to other files and addresses.
"""

import gzip
import json
import re
import sqlite3
import warnings
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet

from per_obspy.errors import CatalogError, TryLater, shortened
from per_obspy.files import reading, scratch_folder, unreadable_reason, writing
from per_obspy.inventory.files.parquet import plain_columns
from per_obspy.inventory.footprints.citygml import read_citygml
from per_obspy.inventory.footprints.csv_buildings import read_csv_buildings
from per_obspy.inventory.footprints.gdal_paths import literal_path
from per_obspy.inventory.footprints.json_buildings import (
    is_asset_json,
    read_asset_json,
    read_geojson_lines,
)
from per_obspy.inventory.footprints.raw_layer import RawLayer
from per_obspy.reader_process import BeyondLimits, Limits, read_layer_apart, require_own_drivers

#: Files that GDAL reads, and how they begin; those of JSON after blanks.
_JSON = ("GeoJSON file", (b"{", b"["))
GDAL_KINDS = {
    ".gpkg": ("GeoPackage", (b"SQLite format 3\x00",)),
    ".geojson": _JSON,
    ".json": _JSON,
    ".shp": ("Shapefile", (b"\x00\x00\x27\x0a",)),
    ".fgb": ("FlatGeobuf file", (b"fgb\x03fgb",)),
}
JSON_SUFFIXES = (".geojson", ".json")
LINES = (".geojsonl", ".geojsons", ".jsonl", ".ndjson")

_PACKED = (".csv", *LINES)
SUFFIXES = (
    *(*GDAL_KINDS, ".parquet", ".geoparquet", ".csv", *LINES, ".gml", ".xml"),
    *(".pbf", ".osm", ".gz"),
)

#: Columns of GDAL's layer of areas of OpenStreetMap; further tags are in ``other_tags``.
_OSM_COLUMNS = ["osm_id", "osm_way_id", "name", "building", "other_tags"]

#: Beginning of GDAL's message for a file whose nodes are not in the order of their numbers.
_UNSORTED = "Non increasing node id"

_OSM = "OpenStreetMap file"

#: How SQLite keeps a table that holds its rows, and the index of places of one.
_TABLE = re.compile(r"\s*CREATE\s+TABLE\b", re.IGNORECASE)
_PLACES = re.compile(
    r"""\s*CREATE\s+VIRTUAL\s+TABLE\s+(?:"[^"]*"|\w+)\s+USING\s+"?rtree"?\s*\(""", re.IGNORECASE
)

#: Longest beginning of a GeoJSON file in which members of the collection are sought, bytes.
HEAD = 1 << 20

#: Largest unpacked file, bytes: five million footprints of 800 bytes. Largest ratio of it to the
#: packed file, from 64 MiB on: footprints as text have 5 to 20 (reasoned).
LARGEST, LARGEST_RATIO, _SMALL = 4 << 30, 200, 64 << 20


#: West, south, east and north of a box, degrees.
Box = tuple[float, float, float, float]


def read_raw_layer(
    file: Path, layer: str | None, box: Box | None = None, around: Box | None = None
) -> RawLayer:
    """
    Read a layer by the reader of the file's suffix.

    Parameters
    ----------
    file : Path
        GeoPackage, GeoJSON, Shapefile, FlatGeobuf, GeoParquet; CityGML (``.gml``, ``.xml``),
        OpenStreetMap (``.osm``, ``.pbf``), assets of SimCenter (``.json``, ``.geojson``); CSV and
        lines of GeoJSON, which may be packed by gzip.
    layer : str or None
        Name of the layer, for files that have several.
    box : tuple of float, optional
        Only features whose own box touches this one, of GeoParquet in degrees; features are
        numbered among them.
    around : tuple of float, optional
        Shapes without attributes: of a GeoPackage, Shapefile or FlatGeobuf those that touch this
        box, of other files all.

    Raises
    ------
    CatalogError
        If the file is missing, or cannot be read as its suffix indicates.
    """
    require_layer_file(file)
    if box is not None and file.suffix.lower() not in (".parquet", ".geoparquet"):
        raise CatalogError(str(file), "a box needs GeoParquet, in longitude and latitude")
    # The slowest, areas of OpenStreetMap, take 2 s and 20 times their place in memory for each MiB
    # of .osm.pbf (reasoned)
    size = file.stat().st_size
    limits = Limits(120.0 + 5.0 * size / 2**20, (4 << 30) + 30 * size)
    try:
        raw: RawLayer = read_layer_apart(limits, _read, file, layer, box, around)
    except BeyondLimits as error:
        raise CatalogError(str(file), f"{error}: damaged, too large, or made to harm") from error
    return raw


def require_layer_file(file: Path, others: Sequence[str] = ()) -> None:
    """Raise CatalogError if a file is no layer by its name, its kind and its first bytes."""
    if problem := _wrong_file(file, others):
        raise CatalogError(str(file), problem)


def _wrong_file(file: Path, others: Sequence[str]) -> str:
    """Return why a file is not read, empty if it is; the caller reads other suffixes too."""
    suffix = file.suffix.lower()
    if not file.exists():
        return "no such file"
    # GDAL knows other suffixes, but not whether they hold outlines
    if suffix not in SUFFIXES:
        return f"unknown suffix {file.suffix!r}, expected one of {', '.join((*SUFFIXES, *others))}"
    if not file.is_file():
        return "is no regular file"
    if suffix == ".gz" and Path(file.stem).suffix.lower() not in _PACKED:
        expected = ", ".join(f"{name}.gz" for name in _PACKED)
        return f"unknown suffix {file.name[-20:]!r}, expected {expected}"
    return _wrong_beginning(file) if suffix in GDAL_KINDS else ""


def _wrong_beginning(file: Path) -> str:
    """Return why GDAL must not see a file, by its first bytes and its parts; empty if it may."""
    suffix = file.suffix.lower()
    kind, beginnings = GDAL_KINDS[suffix]
    with file.open("rb") as opened:
        head = opened.read(HEAD)
    if suffix in JSON_SUFFIXES:
        head = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if not head.startswith(beginnings):
        error = ValueError(f"it begins with {shortened(head[:20].decode('latin-1'))!r}")
        return unreadable_reason(file, kind, error)
    # Parts of a file that is here are here too; a folder of links to all parts is one place
    if suffix == ".shp" and not file.is_symlink():
        for part in file.parent.iterdir():
            if part.is_symlink() and part.stem == file.stem:
                return f"its part {part.name} is a link that leads elsewhere"
    return ""


def _read(file: Path, layer: str | None, box: Box | None, around: Box | None) -> RawLayer:
    """Read a layer in the process of readers; messages name the file that may be packed."""
    source = str(file)
    with reading(file), _unpacked(file) as plain:
        suffix = plain.suffix.lower()
        with plain.open("rb") as opened:
            head = opened.read(1 << 16)
        # Microsoft names lines of GeoJSON .csv
        is_json = head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")
        if suffix in LINES or (suffix == ".csv" and is_json):
            return read_geojson_lines(plain, source)
        # Its words tell assets from other JSON
        if suffix in JSON_SUFFIXES and is_asset_json(head):
            return read_asset_json(plain, source)
        if suffix in GDAL_KINDS or suffix in (".pbf", ".osm"):
            return _read_gdal(plain, layer, around)
        readers = {".csv": read_csv_buildings, ".gml": read_citygml, ".xml": read_citygml}
        if suffix in readers:
            return readers[suffix](plain, source)
        return _read_geoparquet(plain, source, box)


@contextmanager
def _unpacked(file: Path) -> Iterator[Path]:
    """Yield a file, or the unpacked copy of one of gzip, refused if too large or damaged."""
    if file.suffix.lower() != ".gz":
        yield file
        return
    ratio = max(LARGEST_RATIO * file.stat().st_size, _SMALL)
    with scratch_folder() as folder:
        plain, problem = folder / file.stem, ""
        # Block by block, up to the limits
        try:
            with gzip.open(file) as packed, plain.open("wb") as copy:
                while not problem and (block := packed.read(1 << 20)):
                    copy.write(block)
                    if copy.tell() > LARGEST:
                        problem = f"it has more than {LARGEST >> 30} GiB unpacked: split the file"
                    elif copy.tell() > ratio:
                        problem = f"it unpacks to more than {LARGEST_RATIO} times its packed size"
                        problem += ": unpack it by hand"
        except (gzip.BadGzipFile, EOFError, zlib.error) as error:
            raise CatalogError(str(file), f"not a file packed by gzip: {error}") from error
        # The copy is gone with its folder
        if problem:
            raise CatalogError(str(file), problem)
        yield plain


def _read_gdal(file: Path, layer: str | None, around: Box | None) -> RawLayer:
    """Read a layer with GDAL, or its shapes around a place."""
    import pyogrio  # in the process of readers only

    require_own_drivers(pyogrio.list_drivers())
    suffix = file.suffix.lower()
    kind, _ = GDAL_KINDS.get(suffix, (_OSM, ()))
    try:
        # GDAL warns of its repairs, such as rings that are not closed, and of unreadable features
        with (
            warnings.catch_warnings(action="ignore", category=RuntimeWarning),
            _tables_only(file) as (own, views),
            literal_path(own) as path,
        ):
            if kind == _OSM:
                crs, table = _areas(path)
            else:
                name = _layer_name(file, pyogrio.list_layers(path), layer, views)
                options = _only_around(path, name, around) if around else {}
                meta, table = pyogrio.raw.read_arrow(path, layer=name, force_2d=False, **options)
                crs = meta["crs"]
    except (CatalogError, TryLater):
        raise
    except (RuntimeError, ValueError, pa.ArrowException, sqlite3.Error, OSError) as error:
        raise CatalogError(str(file), unreadable_reason(file, kind, error)) from error
    # Messages of GDAL, except for a reference system that it does not know
    crs = (_declared_system(file) if suffix in JSON_SUFFIXES else None) or crs
    return _raw_layer(str(file), table, table.num_columns - 1, crs)


def _only_around(path: Path, layer: str, around: Box) -> dict[str, Any]:
    """Return what to read of a layer for the shapes around a place, without attributes."""
    import pyogrio
    import pyproj

    # JSON is read whole anyway, and may be in another system than GDAL takes it for
    if path.suffix.lower() in JSON_SUFFIXES:
        return {"columns": []}
    crs = pyogrio.read_info(path, layer=layer)["crs"]
    try:
        there = pyproj.Transformer.from_crs("OGC:CRS84", crs, always_xy=True)
        box = there.transform_bounds(*around)
    except (pyproj.exceptions.ProjError, TypeError):
        return {"columns": []}
    return {"columns": [], "bbox": box} if np.isfinite(box).all() else {"columns": []}


def _areas(path: Path) -> tuple[str, pa.Table]:
    """Return system and areas of an extract that are buildings, outlines last."""
    import pyogrio

    # The stream of Arrow would not report the errors of this driver, which keeps nodes in a file
    areas = partial(
        pyogrio.raw.read,
        path,
        layer="multipolygons",
        columns=_OSM_COLUMNS,
        where="building IS NOT NULL",
        TAGS_FORMAT="JSON",
    )
    try:
        meta, _, wkb, fields = areas()
    except pyogrio.errors.FeatureError as error:
        # The slower index takes nodes in any order
        if not str(error).startswith(_UNSORTED):
            raise
        meta, _, wkb, fields = areas(USE_CUSTOM_INDEXING="NO")
    columns = dict(zip(meta["fields"], map(pa.array, fields), strict=True))
    return meta["crs"], pa.table({**columns, "wkb": pa.array(wkb, pa.large_binary())})


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
        foreign = _foreign(file, package)
        # Only a package that has some is copied
        if not foreign:
            yield file, foreign
            return
        with scratch_folder() as folder:
            copy = folder / "layer.gpkg"
            with writing(copy), closing(sqlite3.connect(copy)) as target:
                package.backup(target)
                _remove(target, foreign)
            yield copy, foreign


def _foreign(file: Path, package: sqlite3.Connection) -> set[str]:
    """Return views and virtual tables but for the index of places; refuse computed columns."""
    search = "SELECT name, sql FROM sqlite_master WHERE type IN ('view', 'table')"
    foreign = set[str]()
    for name, sql in package.execute(search).fetchall():
        if sql and not (_TABLE.match(sql) or _PLACES.match(sql)):
            foreign.add(name)
            continue
        # Functions that compute a column may do anything
        computed = "SELECT name FROM pragma_table_xinfo(?) WHERE hidden IN (2, 3)"
        for (column,) in package.execute(computed, (name,)):
            problem = f"column {column} of table {name} is computed, expected a stored one"
            raise CatalogError(str(file), problem)
    return foreign


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


def _layer_name(file: Path, layers: Any, layer: str | None, views: set[str]) -> str:
    """Return the requested one of the layers and their geometries, or the only one with them."""
    kinds: dict[str, str | None] = dict(layers.tolist())
    names = ", ".join(kinds) or "none"
    # A layer without geometries is a table
    spatial = [name for name, kind in kinds.items() if name == layer or (kind and not layer)]
    # A view may be what the user means
    if layer in views or (views and layer is None and not spatial):
        view = layer or ", ".join(sorted(views))
        problem = f"layer {view} is a view, which may have no end: save it as a table"
    elif layer is not None and layer not in kinds:
        problem = f"no layer {layer!r} (layers found: {names})"
    elif not spatial:
        problem = f"no layer has geometries (layers found: {names})"
    elif len(spatial) > 1:
        problem = f"several layers, name one: {', '.join(spatial)}"
    else:
        return spatial[0]
    raise CatalogError(str(file), problem)


def _declared_system(file: Path) -> str | None:
    """Return the coordinate reference system of a GeoJSON file, for which GDAL may take WGS 84."""
    members = {}
    with file.open("rb") as stream:
        head, features, _ = stream.read(HEAD).partition(b'"features"')
    # Most writers have the system before the features, whose objects would not fit in memory
    if features and b'"crs"' in head:
        with suppress(ValueError, RecursionError):
            members = json.loads(head.rstrip().removesuffix(b",") + b"}")
    if "crs" not in members and b'"crs"' in (text := file.read_bytes()):
        try:
            members = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise CatalogError(str(file), f"not a GeoJSON file: {error}") from error
    if (declared := members.get("crs")) is None:
        return None
    # The name of the older standard, or its form with a code
    try:
        properties = declared["properties"]
        return str(properties["name"] if "name" in properties else f"EPSG:{properties['code']}")
    except (KeyError, TypeError):
        return json.dumps(declared)


def _read_geoparquet(file: Path, source: str, box: Box | None = None) -> RawLayer:
    """Read a GeoParquet file, or its features in a box."""
    try:
        # Only the parts of the file that may hold the box
        chosen = None if box is None else _touching(file, source, box)
        table = _without_nesting(pa.parquet.read_table(file.absolute(), filters=chosen))
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise CatalogError(source, unreadable_reason(file, "Parquet table", error)) from error
    name, crs = _geometry_column(source, table)
    if box is not None and not is_in_degrees(crs):
        raise CatalogError(source, "a box needs outlines in longitude and latitude")
    if box is not None and table.num_rows == 0:
        raise CatalogError(
            source, f"no building touches the box {','.join(map(str, box))} (W,S,E,N)"
        )
    return _raw_layer(source, table, table.column_names.index(name), crs)


def _touching(file: Path, source: str, box: Box) -> pc.Expression:
    """Return the filter of rows whose column of boxes, as Overture has it, touches a box."""
    # A box in another form is none
    schema = pa.parquet.read_schema(file.absolute())
    kind = schema.field("bbox").type if "bbox" in schema.names else pa.null()
    fields = kind if pa.types.is_struct(kind) else ()
    names = {field.name for field in fields if pa.types.is_floating(field.type)}
    if not names >= {"xmin", "xmax", "ymin", "ymax"}:
        problem = "a box needs a column bbox with numbers xmin, xmax, ymin and ymax, in degrees"
        raise CatalogError(source, problem)
    west, south, east, north = box
    # A feature without limits may be anywhere, and is kept
    return (
        _unless(pc.field("bbox", "xmin") > east)
        & _unless(pc.field("bbox", "xmax") < west)
        & _unless(pc.field("bbox", "ymin") > north)
        & _unless(pc.field("bbox", "ymax") < south)
    )


def _unless(is_outside: pc.Expression) -> pc.Expression:
    """Return where a comparison is false, or has no value to compare."""
    return ~is_outside | is_outside.is_null()


def is_in_degrees(crs: Any) -> bool:
    """Return whether a reference system is longitude and latitude, in this order."""
    import pyproj

    try:
        return bool(pyproj.CRS.from_user_input(crs).is_geographic)
    except (pyproj.exceptions.CRSError, TypeError, ValueError, AttributeError):
        return False


def _geometry_column(source: str, table: pa.Table) -> tuple[str, Any]:
    """Return name and coordinate reference system of the primary geometry column."""
    # GeoParquet is described by JSON in the metadata
    metadata, problem = table.schema.metadata or {}, "wrong GeoParquet metadata:"
    if b"geo" not in metadata:
        problem = "no GeoParquet metadata: a table of pairs is no layer of footprints"
        raise CatalogError(source, problem)
    try:
        geo = json.loads(metadata[b"geo"])
        name = geo["primary_column"]
        # A missing CRS means OGC:CRS84 by the specification, an explicit null means unknown
        column = {"encoding": None, "crs": "OGC:CRS84", **geo["columns"][name]}
        kind = table[name].type
    except (KeyError, TypeError, ValueError) as error:
        raise CatalogError(source, f"{problem} {type(error).__name__} {error}") from error
    if column["encoding"] != "WKB":
        problem = f"geometries are encoded as {column['encoding']!r}, expected WKB"
        raise CatalogError(source, problem)
    if kind not in (pa.binary(), pa.large_binary()):
        raise CatalogError(source, f"{problem} column {name} is {kind}, not bytes")
    return name, column["crs"]


def _without_nesting(table: pa.Table) -> pa.Table:
    """
    Return a table with the nested columns of Overture Maps as text, without bounding boxes.

    ``names`` becomes its field ``primary``, ``sources`` the ``dataset`` of its first row, a map, as
    tags are, a text of JSON.
    """
    for field in table.schema:
        name, kind = field.name, field.type
        fields = {part.name for part in kind} if pa.types.is_struct(kind) else set()
        # The geometry gives the box anyway
        if fields >= {"xmin", "ymin", "xmax", "ymax"}:
            table = table.drop_columns([name])
            continue
        if name == "names" and "primary" in fields:
            value: Callable[[Any], object] = itemgetter("primary")
        elif name == "sources" and pa.types.is_list(kind):
            value = _first_dataset
        elif pa.types.is_map(kind):
            value = _tags
        else:
            continue
        # As text, whatever the fields are
        values = [None if cell is None else value(cell) for cell in table[name].to_pylist()]
        texts = pa.array([None if each is None else str(each) for each in values], pa.string())
        table = table.set_column(table.column_names.index(name), name, texts)
    return table


def _first_dataset(rows: list[Any]) -> object:
    return rows[0].get("dataset") if rows and isinstance(rows[0], dict) else None


def _tags(tags: list[tuple[str, str]]) -> str:
    return json.dumps(dict(tags))


def _raw_layer(source: str, table: pa.Table, outlines: int, crs: Any) -> RawLayer:
    """Return a table, one column of which is WKB, as a layer of plain columns with unique names."""
    attributes = table.remove_column(outlines).replace_schema_metadata(None)
    names = attributes.column_names
    for name in names:
        if names.count(name) > 1:
            raise CatalogError(source, f"column {name} occurs more than once")
    # Text that is not UTF-8 is refused
    plain, faults = plain_columns(attributes)
    for row, fault in faults.items():
        raise CatalogError(source, f"feature {row + 1}: {fault}")
    return RawLayer(table.column(outlines), plain, crs, np.arange(1, len(table) + 1))
