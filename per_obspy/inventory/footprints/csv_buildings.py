"""
Tables of buildings, CSV with one row per building, as outlines.

Outlines are a column of polygons as WKT or GeoJSON in degrees, or rectangles from longitude and
latitude of their centres, width, length, and the azimuth of the length.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyproj
import shapely

from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, shortened
from per_obspy.inventory.cells import is_unknown, read_numbers
from per_obspy.inventory.files.formats import PLAIN, PairFile
from per_obspy.inventory.files.raw_rows import Contents, RawRows, together
from per_obspy.inventory.files.text_lines import open_text
from per_obspy.inventory.footprints.json_buildings import geojson_text
from per_obspy.inventory.footprints.raw_layer import Geometries, RawLayer, as_wkb

#: More rows than any table has.
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

#: Least and largest value of each number of a rectangle: degrees, degrees, m, m, degrees.
RECTANGLE = {
    "longitude": (-180.0, 180.0),
    "latitude": (-90.0, 90.0),
    "width": (0.1, 1e3),
    "length": (0.1, 1e3),
    "azimuth": (-360.0, 360.0),
}

#: Beginning of WKT that is read: nested collections could exhaust the reader.
_POLYGON = r"(?i)^\s*(?:MULTI)?POLYGON\b"

#: Longest text of an outline, characters.
LONGEST_OUTLINE = 1 << 20


def read_csv_buildings(file: Path, source: str) -> RawLayer:
    """
    Read a table of buildings; messages name its source.

    Raises
    ------
    CatalogError
        If it is no CSV table, has a column twice, or lacks the columns that make outlines; the
        message names those.
    """
    try:
        table = _in_memory(open_text(file, PLAIN))
        # Headings as they are: their translations are those of pairs
        names = table.own_names
        columns = _columns(source, names)
        blocks = list(table.rows(ALL, are_pairs=False))
    except CatalogError as error:
        raise CatalogError(source, error.problem) from error
    if not blocks:
        raise CatalogError(source, "the table has no rows")
    rows = together(blocks)
    attributes = rows.table.rename_columns(names)
    # Outlines as they are, or as rectangles
    if "wkt" in columns:
        outlines, faults = _polygons(columns["wkt"], attributes[columns["wkt"]])
        attributes = attributes.drop_columns([columns["wkt"]])
    else:
        outlines, faults = _rectangles(attributes, columns)
    # Identifiers under the name of the schema
    if columns.get("building_id", "building_id") != "building_id":
        attributes = attributes.append_column("building_id", attributes[columns["building_id"]])
    broken = tuple(line._replace(kind="building", source=source) for line in rows.broken)
    # Positions of a table are degrees
    return RawLayer(as_wkb(outlines), attributes, "OGC:CRS84", rows.lines, faults, broken)


def _in_memory(contents: Contents) -> PairFile:
    """Return a table whose cells are read from the file once: all outlines are needed anyway."""
    named = [place for place, name in enumerate(contents.names) if name]
    stored = list(contents.blocks(named))

    def blocks(places: Sequence[int]) -> Iterator[RawRows]:
        for rows in stored:
            yield rows._replace(table=rows.table.select([str(place) for place in places]))

    return PairFile(contents._replace(blocks=blocks))


def _columns(source: str, names: Sequence[str]) -> dict[str, str]:
    """Return the columns of the file that make outlines, by their names here."""
    for name in sorted(names):
        if names.count(name) > 1:
            raise CatalogError(source, f"column {name} occurs more than once")
    # The first name of each that the file has, whatever the case of its letters
    by_lower = {name.lower(): name for name in reversed(names)}
    columns = {}
    for name, words in NAMES.items():
        if given := [by_lower[word] for word in words if word in by_lower]:
            columns[name] = given[0]
    if "wkt" not in columns and not set(RECTANGLE) <= set(columns):
        raise CatalogError(source, _missing(names, columns))
    return columns


def _missing(names: Sequence[str], columns: Mapping[str, str]) -> str:
    """Return the columns that are missing for outlines."""
    if {"pair_id", "gap"} & set(names):
        return "a table of pairs already, not of buildings: per-obspy pairs check checks it"
    missing = [name for name in RECTANGLE if name not in columns]
    wanted = f"add a column wkt (outlines in degrees), or {', '.join(missing)}"
    units = "width and length in m, azimuth of the length in degrees from north"
    if {"longitude", "latitude"} & set(missing):
        listed = f"columns found: {', '.join(names):.200}"
        return f"no outlines of buildings: {wanted} ({units}; {listed})"
    # Points, and columns that do not help either
    area = f", and an area ({columns['area']}) does not place these" if "area" in columns else ""
    return f"points have no walls, and a gap is a distance between walls{area}: {wanted} ({units})"


def _polygons(name: str, column: pa.ChunkedArray) -> tuple[Geometries, dict[int, str]]:
    """Return polygons from WKT or GeoJSON, None where a cell has none, with the reasons."""
    texts = column.to_pandas().fillna("").astype(str)
    cells = texts.where(texts.str.len() <= LONGEST_OUTLINE, "").to_numpy(dtype=object)
    is_wkt = texts.str.contains(_POLYGON, regex=True).to_numpy(dtype=bool)
    outlines = np.full(len(cells), None, dtype=object)
    # A number beyond all numbers becomes infinite, which no place on the Earth is
    with np.errstate(all="ignore"):
        outlines[is_wkt] = shapely.from_wkt(cells[is_wkt], on_invalid="ignore")
        for i in np.flatnonzero(texts.str.startswith("{")).tolist():
            with suppress(ValueError):
                outlines[i] = shapely.from_geojson(geojson_text(cells[i]), on_invalid="ignore")
    # Each other cell with its reason
    lost = np.flatnonzero(shapely.is_missing(outlines)).tolist()
    return outlines, {i: f"{name} {_no_polygon(texts[i])}" for i in lost}


def _no_polygon(text: str) -> str:
    """Return why a text is no outline."""
    if len(text) > LONGEST_OUTLINE:
        return f"has more than {LONGEST_OUTLINE} characters"
    if is_unknown(text):
        return "is empty"
    return f"= {shortened(text.strip(), 40)!r} is no polygon as WKT or GeoJSON"


def _rectangles(rows: pa.Table, columns: Mapping[str, str]) -> tuple[Geometries, dict[int, str]]:
    """Return rectangles about their centres, None where a row has none, with the first reason."""
    sides, faults = list[FloatArray](), dict[int, str]()
    for name in RECTANGLE:
        side, problems = _side(name, rows[columns[name]].to_pandas())
        sides.append(side)
        faults = {i: f"{columns[name]} {problem}" for i, problem in problems.items()} | faults
    # Rows of which every number is known
    good = ~np.isnan(sides).any(axis=0)
    outlines = np.full(good.size, None, dtype=object)
    if good.any():
        outlines[good] = shapely.polygons(_corners(np.stack(sides)[:, good]))
    return outlines, faults


def _side(name: str, cells: pd.Series) -> tuple[FloatArray, dict[int, str]]:
    """Return a number of rectangles, NaN where it cannot be used, with the reasons."""
    read, (low, high) = read_numbers(name, cells), RECTANGLE[name]
    good, problems = (read.values >= low) & (read.values <= high), dict[int, str]()
    # Empty cells by name, others as they are
    is_empty = np.isnan(read.values)
    is_empty[[*read.notes, *read.placeholders]] = False
    for i in np.flatnonzero(~good).tolist():
        quoted = f"= {shortened(str(cells.iloc[i]), 40)!r} is no usable {name}"
        problems[i] = "is empty" if is_empty[i] else quoted
    return np.where(good, read.values, np.nan), problems


def _corners(sides: FloatArray) -> FloatArray:
    """Return corners in degrees, (n, 4, 2), on the ellipsoid from the numbers of rectangles."""
    longitude, latitude, width, length, azimuth = sides
    geod, reach = pyproj.Geod(ellps="WGS84"), np.hypot(width, length) / 2.0
    turn = np.degrees(np.arctan2(width, length))
    # From the centre to each corner in turn
    corners = []
    for angle in (azimuth + turn, azimuth + 180.0 - turn, azimuth + 180.0 + turn, azimuth - turn):
        east, north, _ = geod.fwd(longitude, latitude, angle, reach)
        corners.append(np.column_stack([east, north]))
    return np.stack(corners, axis=1)
