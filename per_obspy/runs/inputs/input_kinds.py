"""The kind of a file or folder, by its content rather than its name or its place in a command."""

import gzip
import json
import re
import tomllib
import zipfile
import zlib
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Any

from per_obspy.errors import CatalogError, reason_of
from per_obspy.inventory.schema import COLUMNS


class Kind(StrEnum):
    """Kinds of inputs and results, each with its name in messages."""

    CONFIGURATION = "configuration of a run"
    DESIGN = "configuration of a screening by a spectrum"
    ENSEMBLE = "configuration of an ensemble"
    SCENARIO = "scenario of a simulated earthquake"
    CATALOG = "index of stored inventories"
    EVENT_ID = "identifier of an earthquake"
    RECORDS = "records"
    SHAKEMAP = "ShakeMap grid"
    STATION_LIST = "amplitudes of stations"
    EVENT = "description of an earthquake"
    STATIONS = "description of stations"
    PAIRS = "pair table"
    FOOTPRINTS = "footprints of buildings"
    SPECTRUM = "design spectrum"
    SPECTRA = "spectra of stations"
    RISK = "risk table"
    RESULT = "results of a run"


#: Kinds that a run takes for its records, and for its pairs.
RECORD_KINDS = (Kind.RECORDS, Kind.SHAKEMAP, Kind.STATION_LIST, Kind.SCENARIO, Kind.EVENT_ID)
PAIR_KINDS = (Kind.PAIRS, Kind.FOOTPRINTS, Kind.CATALOG)

#: Bytes at the beginning of a file by which it is recognised, and largest TOML that is read.
HEAD, LARGEST_TOML = 8192, 2**20

#: First bytes of HDF5, as workspaces of gmprocess and netCDF files are.
HDF5 = b"\x89HDF\r\n\x1a\n"

#: Beginnings of files.
_MAGIC = {
    b"SQLite format 3": Kind.FOOTPRINTS,
    b"\x00\x00\x27\x0a": Kind.FOOTPRINTS,
    b"fgb\x03": Kind.FOOTPRINTS,
    b"CDF": Kind.SPECTRA,
}

#: Words of XML and JSON near the beginning.
_WORDS = {
    b"<FDSNStationXML": Kind.STATIONS,
    b"#Network": Kind.STATIONS,
    b"quakeml": Kind.EVENT,
    b"shakemap_grid": Kind.SHAKEMAP,
    b"CityModel": Kind.FOOTPRINTS,
    b'"commType"': Kind.STATION_LIST,
    b'"FeatureCollection"': Kind.FOOTPRINTS,
    b'"Feature"': Kind.FOOTPRINTS,
}

#: Suffixes of tables and layers whose beginning does not show what they are.
_TABLES = (".csv", ".tsv", ".xlsx", ".xlsm", ".xlsb", ".xls", ".ods")
_SUFFIXES = {**dict.fromkeys(_TABLES, Kind.PAIRS), ".pbf": Kind.FOOTPRINTS}

#: Columns of a table of footprints, and of a risk table.
_GEOMETRY, _RISK = {"geometry", "wkt", "wkb"}, {"pair_id", "state", "rank", "probability"}

#: Columns of a list of buildings that has one place per row.
_EAST, _NORTH = {"longitude", "lon", "long", "lng"}, {"latitude", "lat"}

#: Files that belong to others: parts of a Shapefile, and side files of tables.
SIDECARS = (".dbf", ".shx", ".prj", ".cpg", ".sbn", ".sbx", ".qix", ".qmd")


def kind_of(argument: str | Path) -> Kind:
    """
    Return the kind of an argument: of a path that exists, else the identifier of an earthquake.

    A file that shows no other kind counts as one of records, and so does a folder.

    Raises
    ------
    CatalogError
        If it is neither a path that exists nor looks like an identifier, or cannot be read.
    """
    path = Path(argument)
    try:
        if path.is_dir():
            return _folder_kind(path)
        if path.exists():
            return _file_kind(path)
    except OSError as error:
        raise CatalogError(str(path), f"cannot be read: {reason_of(error)}") from error
    from per_obspy.records.earthquakes.services import is_event_id

    if is_event_id(str(argument)):
        return Kind.EVENT_ID
    raise CatalogError(str(argument), "no such folder or file")


def files_in(folder: Path) -> dict[Path, Kind]:
    """Return the files of a folder with their kinds, without hidden files and subfolders."""
    shown = (path for path in sorted(folder.iterdir()) if not path.name.startswith("."))
    files = [path for path in shown if path.is_file() and path.suffix.lower() not in SIDECARS]
    return {path: _readable_kind(path) for path in files if ".rejected" not in path.suffixes}


def _readable_kind(path: Path) -> Kind:
    """Return the kind of a file; an unreadable one counts as a record, which is rejected later."""
    try:
        return _file_kind(path)
    except OSError:
        return Kind.RECORDS


def records_place(path: Path) -> tuple[Path, bool]:
    """Return the place of records and whether it is a workspace: a folder may hold only one."""
    # A file, or the only file of a folder
    files = [path] if path.is_file() else []
    if path.is_dir():
        inside = sorted(path.iterdir())
        files = inside if len(inside) == 1 and inside[0].is_file() else []
    for file in files:
        with file.open("rb") as opened:
            if opened.read(len(HDF5)) == HDF5:
                return file, True
    return path, False


def _folder_kind(folder: Path) -> Kind:
    """Return the kind of a folder: results, one pair table or layer and no record, or records."""
    if (folder / "run.json").is_file() or (folder / "ensemble.json").is_file():
        return Kind.RESULT
    files = files_in(folder)
    tables = {kind for kind in files.values() if kind in PAIR_KINDS}
    if not tables or any(path.is_dir() for path in folder.iterdir()):
        return Kind.RECORDS
    # Notes and licences are no records
    others = [path for path, kind in files.items() if kind is Kind.RECORDS]
    return Kind.RECORDS if any(map(_holds_records, others)) else min(tables)


def _holds_records(path: Path) -> bool:
    """Return whether a file can be read as a record."""
    from per_obspy.records.folder import find_stations

    try:
        return bool(find_stations(path).stations)
    except CatalogError:
        return False


def _file_kind(path: Path) -> Kind:
    """Return the kind of a file."""
    if not path.is_file():  # a pipe would wait for ever
        raise CatalogError(str(path), "is neither a folder nor a regular file")
    with path.open("rb") as file:
        head = file.read(HEAD)
    # By its first bytes, then by words, then by the columns of a table
    if head.startswith(b"PAR1"):
        return _parquet_kind(path)
    if head.startswith(HDF5):
        return _hdf5_kind(path)
    if head.startswith(b"PK\x03\x04"):
        return _zip_kind(path)
    if head.startswith(b"\x1f\x8b") and path.name.lower().endswith(".xml.gz"):
        head = _unpacked_head(path)
    head = _as_utf8(head)
    kinds = [kind for start, kind in _MAGIC.items() if head.startswith(start)]
    kinds += [kind for word, kind in _WORDS.items() if word in head]
    kind = kinds[0] if kinds else _toml_kind(path, head) or _text_kind(path, head)
    # A list that is empty, or cut before its first station, is known by its name alone
    is_named = "stationlist" in path.name.lower() and _is_json(path)
    return Kind.STATION_LIST if is_named and kind in (Kind.FOOTPRINTS, Kind.RECORDS) else kind


def _as_utf8(head: bytes) -> bytes:
    """Return the beginning of JSON in UTF-8, whichever encoding it has; other bytes as they are."""
    text = head.decode(json.detect_encoding(head), "replace").lstrip("\ufeff \t\r\n")
    return text.encode("utf-8", "replace") if text.startswith("{") else head


def _unpacked_head(path: Path) -> bytes:
    """Return the beginning of a file packed by gzip, empty if it is damaged."""
    try:
        with gzip.open(path) as file:
            return file.read(HEAD)
    except (OSError, EOFError, zlib.error):
        return b""


def _parquet_kind(path: Path) -> Kind:
    """Return the kind of a Parquet file by its columns."""
    import pyarrow as pa
    import pyarrow.parquet

    try:
        schema = pa.parquet.read_schema(path.absolute())
    except (pa.ArrowException, OSError):
        return Kind.PAIRS
    if b"geo" in (schema.metadata or {}):
        return Kind.FOOTPRINTS
    return _table_kind(schema.names) or Kind.PAIRS


def _hdf5_kind(path: Path) -> Kind:
    """Return whether an HDF5 file holds spectra of this package, or else records."""
    import netCDF4

    try:
        with netCDF4.Dataset(str(path)) as file:
            return Kind.SPECTRA if "period" in file.dimensions else Kind.RECORDS
    except (OSError, RuntimeError):
        return Kind.RECORDS


def _zip_kind(path: Path) -> Kind:
    """Return the kind of a zip: a workbook, a packed Shapefile, or an archive of records."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = [name.lower() for name in archive.namelist()]
    except (zipfile.BadZipFile, OSError, ValueError):
        return Kind.RECORDS
    if any(name.startswith("xl/") for name in names):
        return Kind.PAIRS
    return Kind.FOOTPRINTS if any(name.endswith(".shp") for name in names) else Kind.RECORDS


def _toml_kind(path: Path, head: bytes) -> Kind | None:
    """Return the kind of a TOML file, None if it is none."""
    is_named = path.suffix.lower() == ".toml"
    if path.stat().st_size > LARGEST_TOML or (not is_named and b"=" not in head):
        return Kind.CONFIGURATION if is_named else None
    try:
        content: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):
        return Kind.CONFIGURATION if is_named else None
    # By the keys that other kinds do not have
    if isinstance(content.get("spectrum"), str):
        return Kind.DESIGN
    if isinstance(content.get("scenario"), list):
        return Kind.ENSEMBLE
    if isinstance(content.get("scenario"), dict):
        return Kind.SCENARIO
    if isinstance(content.get("inventory"), list):
        return Kind.CATALOG
    is_run = is_named or content.keys() & {"records", "simulation"}
    return Kind.CONFIGURATION if is_run else None


def _text_kind(path: Path, head: bytes) -> Kind:
    """Return the kind of a text file by its header, or by the suffix of its name."""
    lines = head.decode("utf-8-sig", "replace").splitlines()
    header = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    names = [name.strip(" \"'").lower() for name in re.split(r"[,;\t]", header)]
    kind = _table_kind(names)
    # Tables of stations and lists of buildings have fewer names in common with pairs
    if kind is None and path.suffix.lower() == ".csv" and _is_station_table(head):
        return Kind.STATIONS
    if kind is None and set(names) & _EAST and set(names) & _NORTH:
        return Kind.FOOTPRINTS
    if kind is None and lines and lines[0].lstrip().startswith(("[", "{")) and _is_json(path):
        return Kind.FOOTPRINTS
    return kind or _SUFFIXES.get(path.suffix.lower(), Kind.RECORDS)


def _is_station_table(head: bytes) -> bool:
    """Return whether a file begins as a table of stations."""
    from per_obspy.formats.text.station_table import is_station_table

    return is_station_table(head)


def _is_json(path: Path) -> bool:
    """Return whether the name of a file ends in ``json``, as that of a layer of buildings may."""
    return path.suffix.lower() in (".json", ".geojson")


def require_whole_json(path: Path) -> None:
    """Raise ``CatalogError`` for JSON that ends too early to show what it is, with the position."""
    if not (path.is_file() and _is_json(path) and path.stat().st_size <= HEAD):
        return
    try:
        json.loads(path.read_bytes())
    except (ValueError, RecursionError) as error:
        reason = f"a damaged station list or layer of outlines: {reason_of(error)}"
        raise CatalogError(str(path), reason) from error


def _table_kind(names: Sequence[str]) -> Kind | None:
    """Return the kind of a table by its columns, None if they do not show it."""
    columns = set(names)
    if columns >= _RISK:
        return Kind.RISK
    if "period" in columns and columns & {"sd", "psa"}:
        return Kind.SPECTRUM
    if len(columns & set(COLUMNS)) >= 3:
        return Kind.PAIRS
    return Kind.FOOTPRINTS if columns & _GEOMETRY else None
