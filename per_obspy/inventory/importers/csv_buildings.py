"""
CSV files of buildings: outlines as WKT or GeoJSON in a column, or points.

Google Open Buildings have WKT in ``geometry``, inventories of SimCenter GeoJSON in ``Footprint``;
GEM exposures, the National Structure Inventory and others have two columns of coordinates.
"""

import codecs
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.csv
import shapely
from numpy.typing import NDArray

from per_obspy.errors import CatalogError
from per_obspy.inventory.cells import plain_numbers
from per_obspy.inventory.importers.asset_json import footprint_of
from per_obspy.inventory.importers.importer import RawLayer
from per_obspy.inventory.importers.recognition import recognised
from per_obspy.inventory.importers.sources.own_names import OWN

#: Columns of outlines as WKT and as GeoJSON, and pairs of columns of coordinates, degrees.
WKT = ("geometry", "WKT", "wkt", "the_geom", "geom")
GEOJSON = ("Footprint",)
POINTS = (("lon", "lat"), ("longitude", "latitude"), ("Longitude", "Latitude"), ("x", "y"))

_DEGREES = "OGC:CRS84"

#: Largest block of lines, and therefore largest line, bytes.
_BLOCK = 16 << 20

#: Most rows that are read, and largest text of an outline, characters.
MOST_ROWS = 5_000_000
LONGEST_OUTLINE = 1 << 20


def has_outlines(file: Path) -> bool:
    """Return whether the header of a CSV file has a column of outlines."""
    return bool({*WKT, *GEOJSON} & set(_header(file)))


def read_csv_buildings(file: Path, source: str) -> RawLayer | None:
    """
    Read a CSV file of outlines, or return None if it has none or is of no known source.

    Parameters
    ----------
    file : Path
        UTF-8, comma separated, one header line, WGS 84. A row with another number of cells is
        a separate fault, after the good ones.
    source : str
        Name of the file, for messages.

    Raises
    ------
    CatalogError
        If the file cannot be read or has more than ``MOST_ROWS`` rows.
    """
    names = _header(file)
    geometry = next((name for name in (*WKT, *GEOJSON) if name in names), None)
    if geometry is None or recognised(names) is OWN:
        return None
    return _read(file, source, names, lambda block: _with_outlines(block, geometry))


def read_csv_points(file: Path, source: str) -> RawLayer | None:
    """
    Read a CSV file of points, or return None if it has no two columns of coordinates.

    Parameters and errors are those of :func:`read_csv_buildings`.
    """
    names = _header(file)
    points = next((pair for pair in POINTS if set(pair) <= set(names)), None)
    if points is None:
        return None
    return _read(file, source, names, lambda block: _with_points(block, points))


def _read(
    file: Path, source: str, names: list[str], layer: Callable[[pd.DataFrame], RawLayer]
) -> RawLayer:
    """Read a file block by block, so that the text of outlines is forgotten."""
    # Text, and columns that differ in name
    _require_utf_8(file, source)
    if repeated := next((name for name in names if names.count(name) > 1), None):
        raise CatalogError(source, f"column {repeated[:200]} occurs more than once")
    broken, found = list[str](), list[RawLayer]()
    for block in _blocks(file, source, names, broken):
        found.append(layer(block))
    if not any(len(each.geometries) for each in found):
        raise CatalogError(source, "the table has no rows")
    return _joined(found, broken)


def _with_outlines(block: pd.DataFrame, geometry: str) -> RawLayer:
    """Return a block of rows with the outlines of a column."""
    shapes, faults = _outlines(block.pop(geometry), is_wkt=geometry in WKT)
    return RawLayer(shapes, block, _DEGREES, faults)


def _with_points(block: pd.DataFrame, names: tuple[str, str]) -> RawLayer:
    """Return a block of rows with points from two columns of coordinates."""
    east, north = (plain_numbers(block[name]).to_numpy(np.float64) for name in names)
    known = np.isfinite(east) & np.isfinite(north)
    shapes = np.full(len(block), None, dtype=object)
    shapes[known] = shapely.points(east[known], north[known])
    return RawLayer(shapes, block, _DEGREES)


def _joined(blocks: Sequence[RawLayer], broken: Sequence[str]) -> RawLayer:
    """Return all blocks as one; rows that are no rows come last, without cells."""
    faults, first = dict[int, str](), 0
    for block in blocks:
        faults |= {first + row: fault for row, fault in block.faults.items()}
        first += len(block.geometries)
    faults |= dict(enumerate(broken, start=first))
    # Geometries and cells of the same length
    lost = np.full(len(broken), None, dtype=object)
    shapes = np.concatenate([*(block.geometries for block in blocks), lost])
    table = pd.concat([block.attributes for block in blocks], ignore_index=True)
    return RawLayer(shapes, table.reindex(range(len(shapes))), _DEGREES, faults)


def _header(file: Path) -> list[str]:
    """Return the names in the header, none if it cannot be read."""
    with file.open("rb") as opened:
        line = opened.readline(1 << 16)
    text = line.decode("utf-8-sig", "replace").strip()
    return [name.strip().strip('"') for name in text.split(",")]


def _require_utf_8(file: Path, source: str) -> None:
    """Raise CatalogError if the bytes of a file are no text in UTF-8."""
    decoder = codecs.getincrementaldecoder("utf-8")()
    with file.open("rb") as opened:
        try:
            while block := opened.read(_BLOCK):
                decoder.decode(block)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError as error:
            raise CatalogError(source, "not UTF-8: save the table as UTF-8") from error


def _blocks(
    file: Path, source: str, names: Sequence[str], broken: list[str]
) -> Iterator[pd.DataFrame]:
    """Yield the blocks of a file as tables of text, and add the faults of broken rows."""

    def is_skipped(row: pa.csv.InvalidRow) -> str:
        cells = f"{row.actual_columns} cells instead of {row.expected_columns}"
        broken.append(f"a row has {cells}: {row.text[:60]}")
        return "skip"

    reading = pa.csv.ReadOptions(block_size=_BLOCK, use_threads=False)
    parsing = pa.csv.ParseOptions(newlines_in_values=True, invalid_row_handler=is_skipped)
    texts = dict.fromkeys(names, pa.string())
    converting = pa.csv.ConvertOptions(column_types=texts, strings_can_be_null=True)
    # Rows of all blocks so far
    rows = 0
    try:
        # Relative names such as http:/x are addresses to the reader
        with pa.csv.open_csv(file.absolute(), reading, parsing, converting) as reader:
            for batch in reader:
                rows += batch.num_rows
                if rows + len(broken) > MOST_ROWS:
                    raise CatalogError(source, f"it has more than {MOST_ROWS} rows: split the file")
                yield batch.to_pandas()
    except pa.ArrowException as error:
        raise CatalogError(source, f"not a CSV file: {str(error)[:200]}") from error


def _outlines(cells: pd.Series, is_wkt: bool) -> tuple[NDArray[np.object_], dict[int, str]]:
    """Return outlines, and the fault of each cell that holds none."""
    faults = dict[int, str]()
    texts = cells.astype(object).where(cells.notna(), None).to_numpy(copy=True)
    # Texts that would take too much memory as outlines
    for row in np.flatnonzero(cells.str.len().fillna(0) > LONGEST_OUTLINE).tolist():
        faults[row] = f"the outline has more than {LONGEST_OUTLINE} characters"
        texts[row] = None
    shapes, wrong = _from_wkt(texts) if is_wkt else _from_geojson(texts)
    return shapes, faults | wrong


def _from_wkt(texts: NDArray[np.object_]) -> tuple[NDArray[np.object_], dict[int, str]]:
    """Return outlines from WKT, and the fault of each text that is none."""
    # A number beyond all numbers becomes infinite, which no place on the Earth is
    with np.errstate(all="ignore"):
        shapes = shapely.from_wkt(texts, on_invalid="ignore")
    is_text = np.array([text is not None for text in texts])
    lost = np.flatnonzero(shapely.is_missing(shapes) & is_text).tolist()
    return shapes, {row: f"geometry = {str(texts[row])[:40]!r} is not WKT" for row in lost}


def _from_geojson(texts: NDArray[np.object_]) -> tuple[NDArray[np.object_], dict[int, str]]:
    """Return outlines from GeoJSON, and the fault of each text that is none."""
    shapes, faults = np.full(len(texts), None, dtype=object), dict[int, str]()
    for row, text in enumerate(texts):
        try:
            shapes[row] = None if text is None else footprint_of(text)
        except ValueError as error:
            faults[row] = str(error)
    return shapes, faults
