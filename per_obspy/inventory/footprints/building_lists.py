"""
Lists of buildings, a CSV table with one row per building, as outlines.

Outlines are a column of polygons as WKT in degrees, or rectangles from longitude and latitude of
their centres, width, length, and the azimuth of the length.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyproj
import shapely
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, Rejection, shortened
from per_obspy.inventory.cells import is_unknown, read_numbers
from per_obspy.inventory.files.formats import PLAIN, PairFile
from per_obspy.inventory.files.text_lines import open_text

#: More rows than any list has.
ALL = 1 << 40

#: Names of the columns that make an outline, in lower case; the first is the one of messages.
NAMES = {
    "wkt": ("wkt", "geometry", "geom", "the_geom", "wkt_geom", "outline", "footprint", "polygon"),
    "longitude": ("longitude", "lon", "lng", "long", "x"),
    "latitude": ("latitude", "lat", "y"),
    "width": ("width", "breadth"),
    "length": ("length", "depth"),
    "azimuth": ("azimuth", "orientation", "bearing"),
    "area": ("area", "planarea", "plan_area", "footprint_area", "area_in_meters"),
    "building_id": ("building_id", "id"),
}
RECTANGLE = ("longitude", "latitude", "width", "length", "azimuth")

#: Beginnings of WKT that is read: nested collections could exhaust the reader.
_POLYGON = r"(?i)^\s*(?:MULTI)?POLYGON\b"

#: Largest absolute value of each number of a rectangle: degrees, degrees, m, m, degrees.
_LARGEST = {"longitude": 180.0, "latitude": 90.0, "width": 1e3, "length": 1e3, "azimuth": 360.0}


class BuildingList(NamedTuple):
    """
    Buildings of a list.

    Attributes
    ----------
    wkb : pa.ChunkedArray
        Outlines in degrees as WKB; null where a row has none.
    attributes : pa.Table
        Every column but that of the outlines.
    lines : (n,) ndarray of int
        Line of each row in the file.
    faults : mapping of int to str
        Position of a row -> why it has no outline.
    broken : tuple of Rejection
        Lines that are no rows.
    """

    wkb: pa.ChunkedArray
    attributes: pa.Table
    lines: NDArray[np.int64]
    faults: Mapping[int, str]
    broken: tuple[Rejection, ...]


def read_list(file: Path) -> BuildingList:
    """
    Read a list of buildings.

    Parameters
    ----------
    file : Path
        CSV.

    Raises
    ------
    CatalogError
        If it is no CSV table, has a column twice, or lacks the columns that make outlines; the
        message names those.
    """
    table = PairFile(open_text(file, PLAIN))
    # Headings as they are: their translations are those of pairs
    names = table.own_names
    columns = _columns(file, names)
    blocks = list(table.rows(ALL, are_pairs=False))
    if not blocks:
        raise CatalogError(str(file), "the table has no rows")
    broken = tuple(line._replace(kind="building") for rows in blocks for line in rows.broken)
    rows = pa.concat_tables([block.table for block in blocks]).rename_columns(names)
    lines = np.concatenate([block.lines for block in blocks])
    # Outlines as they are, or as rectangles
    outlines, faults = _outlines(rows, columns)
    attributes = rows.drop_columns([columns["wkt"]]) if "wkt" in columns else rows
    # Identifiers under the name of the schema
    identifier = columns.get("building_id", "building_id")
    if identifier != "building_id":
        attributes = attributes.append_column("building_id", rows[identifier])
    wkb = pa.chunked_array([pa.array(shapely.to_wkb(outlines), pa.large_binary())])
    return BuildingList(wkb, attributes, lines, faults, broken)


def _outlines(
    rows: pa.Table, columns: Mapping[str, str]
) -> tuple[NDArray[np.object_], dict[int, str]]:
    """Return outlines, None where a row has none, with the reasons."""
    if "wkt" in columns:
        return _polygons(rows[columns["wkt"]].to_pandas(), columns["wkt"])
    # Numbers of every rectangle, and the first fault of each row
    numbers, faults = {}, dict[int, str]()
    for name in RECTANGLE:
        cells = rows[columns[name]].to_pandas()
        numbers[name], found = _side(name, columns[name], cells)
        faults = found | faults
    return _rectangles(numbers), faults


def _columns(file: Path, names: Sequence[str]) -> dict[str, str]:
    """Return the columns of the file that make outlines, by their names here."""
    repeated = sorted({name for name in names if list(names).count(name) > 1})
    if repeated:
        raise CatalogError(str(file), f"column {repeated[0]} occurs more than once")
    # The first name of each that the file has, whatever the case of its letters
    by_lower = {name.lower(): name for name in reversed(names)}
    found = {}
    for name, known in NAMES.items():
        given = [by_lower[word] for word in known if word in by_lower]
        if given:
            found[name] = given[0]
    if "wkt" not in found and not set(RECTANGLE) <= set(found):
        raise CatalogError(str(file), _missing(names, found))
    return found


def _missing(names: Sequence[str], found: Mapping[str, str]) -> str:
    """Return the columns that are missing for outlines."""
    if {"pair_id", "gap"} & set(names):
        return "a table of pairs already, not of buildings: per-obspy pairs check checks it"
    missing = [name for name in RECTANGLE if name not in found]
    wanted = f"add a column wkt (outlines in degrees), or {', '.join(missing)}"
    units = "width and length in m, azimuth of the length in degrees from north"
    if {"longitude", "latitude"} & set(missing):
        columns = ", ".join(names)
        return f"no outlines of buildings: {wanted} ({units}; columns found: {columns:.200})"
    # Points, and columns that do not help either
    area = f", and an area ({found['area']}) does not place these" if "area" in found else ""
    return f"points have no walls, and a gap is a distance between walls{area}: {wanted} ({units})"


def _polygons(cells: pd.Series, name: str) -> tuple[NDArray[np.object_], dict[int, str]]:
    """Return polygons from WKT, None where a cell has none, with the reasons."""
    # Text that begins like a polygon is read
    text = cells.fillna("").astype(str)
    is_polygon = text.str.contains(_POLYGON, regex=True).to_numpy(dtype=bool)
    outlines = np.full(len(text), None, dtype=object)
    outlines[is_polygon] = shapely.from_wkt(text.to_numpy(object)[is_polygon], on_invalid="ignore")
    # Each other cell with its reason
    faults = {}
    for i in np.flatnonzero(shapely.is_missing(outlines)).tolist():
        cell = text.iloc[i].strip()
        quoted = shortened(cell, 40)
        is_empty = is_unknown(cell)
        faults[i] = f"{name} is empty" if is_empty else f"{name} = {quoted!r} is no polygon as WKT"
    return outlines, faults


def _side(name: str, column: str, cells: pd.Series) -> tuple[FloatArray, dict[int, str]]:
    """Return a number of rectangles, NaN where it cannot be used, with the reasons."""
    read = read_numbers(name, cells)
    values = read.values
    bad, faults = _out_of_range(name, values), {}
    # Empty cells by name, others as they are
    for i in np.flatnonzero(bad).tolist():
        is_empty = np.isnan(values[i]) and i not in read.notes | read.placeholders
        reason = f"= {shortened(str(cells.iloc[i]), 40)!r} is no usable {name}"
        faults[i] = f"{column} {'is empty' if is_empty else reason}"
    return np.where(bad, np.nan, values), faults


def _rectangles(numbers: Mapping[str, FloatArray]) -> NDArray[np.object_]:
    """Return rectangles about their centres, None where a number is missing."""
    good = ~np.isnan(list(numbers.values())).any(axis=0)
    outlines = np.full(good.size, None, dtype=object)
    if good.any():
        corners = _corners(*(numbers[name][good] for name in RECTANGLE))
        outlines[good] = shapely.polygons(corners)
    return outlines


def _out_of_range(name: str, values: FloatArray) -> NDArray[np.bool_]:
    """Return where a number of a rectangle is missing or impossible; sides are above 0."""
    lowest = 0.1 if name in ("width", "length") else -_LARGEST[name]
    return np.asarray(~((values >= lowest) & (values <= _LARGEST[name])))


def _corners(
    longitude: FloatArray,
    latitude: FloatArray,
    width: FloatArray,
    length: FloatArray,
    azimuth: FloatArray,
) -> FloatArray:
    """Return the corners of rectangles in degrees, (n, 4, 2), on the ellipsoid."""
    geod = pyproj.Geod(ellps="WGS84")
    reach = np.hypot(width, length) / 2.0
    turn = np.degrees(np.arctan2(width, length))
    # From the centre to each corner in turn
    corners = []
    for angle in (azimuth + turn, azimuth + 180.0 - turn, azimuth + 180.0 + turn, azimuth - turn):
        east, north, _ = geod.fwd(longitude, latitude, angle, reach)
        corners.append(np.column_stack([east, north]))
    return np.stack(corners, axis=1)
