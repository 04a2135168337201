"""Files of buildings that GDAL and GeoParquet do not cover, recognised by suffix and content."""

import gzip
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from per_obspy.errors import CatalogError
from per_obspy.files import scratch_folder
from per_obspy.inventory.importers.asset_json import is_asset_json, read_asset_json
from per_obspy.inventory.importers.citygml import read_citygml
from per_obspy.inventory.importers.csv_buildings import read_csv_buildings
from per_obspy.inventory.importers.geojson_lines import read_geojson_lines
from per_obspy.inventory.importers.importer import RawLayer
from per_obspy.inventory.importers.osm_file import read_osm_file

#: Suffixes of files of which a reader here takes all or some.
LINES = (".geojsonl", ".geojsons", ".jsonl", ".ndjson")
SUFFIXES = (*LINES, ".gml", ".xml", ".pbf", ".osm", ".csv", ".gz")

#: Largest unpacked file, bytes: five million footprints of 800 bytes. Largest ratio of it to the
#: packed file, from 64 MiB on: footprints as text have 5 to 20 (reasoned).
LARGEST, LARGEST_RATIO, _SMALL = 4 << 30, 200, 64 << 20

_BLOCK = 1 << 20


def read_buildings(file: Path) -> RawLayer | None:
    """
    Read a file of buildings, or return None if it is for another reader.

    Parameters
    ----------
    file : Path
        CityGML (``.gml``, ``.xml``), OpenStreetMap (``.osm``, ``.pbf``), assets of SimCenter
        (``.json``, ``.geojson``), GeoJSON lines, CSV with outlines or points; the last two also
        packed by gzip. It must exist.

    Raises
    ------
    CatalogError
        If the file cannot be read.
    """
    try:
        if file.suffix.lower() == ".gz":
            with _unpacked(file) as plain:
                return _read(plain, file)
        return _read(file, file)
    except OSError as error:
        raise CatalogError(str(file), f"cannot be read: {error.strerror or error}") from error


def _read(plain: Path, file: Path) -> RawLayer | None:
    """Read an unpacked file; messages name the file that was given."""
    suffix = plain.suffix.lower()
    # Microsoft names lines of GeoJSON .csv
    if suffix in LINES or (suffix == ".csv" and _first_character(plain) == b"{"):
        return read_geojson_lines(plain, str(file))
    if suffix == ".csv":
        buildings = read_csv_buildings(plain, str(file))
        if buildings is None and plain != file:
            raise CatalogError(str(file), "not a CSV file of outlines, nor of a known source")
        return buildings
    if suffix in (".json", ".geojson") and is_asset_json(plain):
        return read_asset_json(plain, str(file))
    if suffix in (".gml", ".xml"):
        return read_citygml(plain, str(file))
    if suffix in (".pbf", ".osm"):
        return read_osm_file(plain, str(file))
    # Packed files of other kinds have no reader elsewhere
    if plain != file:
        expected = ", ".join(f"{name}.gz" for name in (".csv", *LINES))
        raise CatalogError(str(file), f"unknown suffix {file.name[-20:]!r}, expected {expected}")
    return None


def _first_character(file: Path) -> bytes:
    """Return the first character of a file that is no blank."""
    with file.open("rb") as opened:
        return opened.read(4096).lstrip(b"\xef\xbb\xbf \t\r\n")[:1]


@contextmanager
def _unpacked(file: Path) -> Iterator[Path]:
    """Yield the unpacked copy of a gzip file, which is refused if it is too large or damaged."""
    with scratch_folder() as folder:
        plain = folder / file.stem
        # Block by block, up to the limit
        try:
            with gzip.open(file) as packed, plain.open("wb") as copy:
                while block := packed.read(_BLOCK):
                    copy.write(block)
                    if copy.tell() > LARGEST:
                        limit = f"it has more than {LARGEST >> 30} GiB unpacked"
                        raise CatalogError(str(file), f"{limit}: split the file")
                    if copy.tell() > max(LARGEST_RATIO * file.stat().st_size, _SMALL):
                        limit = f"it unpacks to more than {LARGEST_RATIO} times its packed size"
                        raise CatalogError(str(file), f"{limit}: unpack it by hand")
        except (gzip.BadGzipFile, EOFError, zlib.error) as error:
            raise CatalogError(str(file), f"not a file packed by gzip: {error}") from error
        yield plain
