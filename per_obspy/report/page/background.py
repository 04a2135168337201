"""Lines behind the map of the page, of a file of the user: streets, rivers, outlines."""

import re
import sqlite3
import struct
from collections.abc import Mapping, Sequence
from contextlib import closing
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, reason_of, shortened
from per_obspy.files import unreadable_reason
from per_obspy.reader_process import BeyondLimits, Limits, read_tiles_apart

if TYPE_CHECKING:
    import pyarrow as pa

Shapes = NDArray[np.object_]

#: West, south, east and north.
Box = tuple[float, float, float, float]

#: Archives of vector tiles: what they are, and how they begin.
TILES = {
    ".pmtiles": ("PMTiles archive", b"PMTiles\x03"),
    ".mbtiles": ("MBTiles archive", b"SQLite format 3\x00"),
}

#: Lowest and highest longitudes and latitudes of tiles, degrees.
_TILED = ([-180.0, -85.0], [180.0, 85.0])

#: Tiles along the longer side of the region, at most: the finest level that has no more is read.
MOST_TILES = 8

#: The lines reach beyond the pairs by this share of their region, and by so many degrees at least.
MARGIN, LEAST_MARGIN = 0.25, 0.01

#: Corners on a page, at most, and the length of their steps, degrees: 1 m.
MOST_CORNERS, UNIT = 60_000, 1e-5

#: Length of the equator in the projection of tiles, m.
EQUATOR = 40_075_016.685_578_49

#: Longest text on who made the lines, characters.
LONGEST_CREDIT = 200


class Background(NamedTuple):
    """Lines behind the map, and who made them."""

    #: Each the first corner, then steps: east and north by turns, in ``UNIT``.
    lines: Sequence[list[int]] = ()
    #: As the file says it, empty where it does not.
    credit: str = ""


def require_background(path: Path | None) -> None:
    """
    Check that a file may hold a background, by its name and its first bytes.

    Raises
    ------
    CatalogError
        If it does not.
    """
    if path is None:
        return
    # Layers are those of footprints
    if path.suffix.lower() not in TILES:
        from per_obspy.inventory.footprints.layer_files import require_layer_file

        require_layer_file(path, (*TILES,))
        return
    if not path.is_file():
        raise CatalogError(str(path), "is no regular file" if path.exists() else "no such file")
    kind, beginning = TILES[path.suffix.lower()]
    with path.open("rb") as file:
        head = file.read(127)
    if not head.startswith(beginning):
        error = ValueError(f"it begins with {shortened(head[:20].decode('latin-1'))!r}")
        raise CatalogError(str(path), unreadable_reason(path, kind, error))
    # A copy that was interrupted
    size, stated = path.stat().st_size, _stated_size(head.ljust(127, b"\0"))
    if size < max(stated, 127):
        raise CatalogError(str(path), f"is cut short: it has {size} of {stated} bytes")


def _stated_size(head: bytes) -> int:
    """Return the size of an archive by its first bytes."""
    if head.startswith(TILES[".pmtiles"][1]):
        # Directories, description and tiles: where each begins, and its length
        parts = struct.unpack("<8Q", head[8:72])
        return max(map(sum, zip(parts[::2], parts[1::2], strict=True)))
    # Pages of a database, whose size is 65 536 bytes where it says 1
    page = int.from_bytes(head[16:18], "big")
    return int.from_bytes(head[28:32], "big") * (65_536 if page == 1 else page)


def read_background(
    path: Path, layers: Sequence[str], longitude: FloatArray, latitude: FloatArray
) -> Background:
    """
    Read the lines around places, as fine as ``MOST_CORNERS`` allow.

    Parameters
    ----------
    path : Path
        Archive of vector tiles (PMTiles, MBTiles), or a layer of any kind that footprints may be.
    layers : sequence of str
        Names of layers; without one all of an archive that hold lines, or else outlines, and the
        only one of other files.
    longitude, latitude : (n_places,) ndarray
        Degrees, at least one; longitudes without a step at the date line.

    Raises
    ------
    CatalogError
        If the file cannot be read, or has no line near the places.
    """
    low = np.array([longitude.min(), latitude.min()])
    high = np.array([longitude.max(), latitude.max()])
    margin = np.maximum(MARGIN * (high - low), LEAST_MARGIN)
    box = (*(low - margin).tolist(), *(high + margin).tolist())
    # From the file to lines of the page
    if path.suffix.lower() in TILES:
        shapes, credit = _tile_shapes(path, layers, box)
    else:
        shapes, credit = _layer_shapes(path, layers, box), ""
    lines = _simplified(_near(shapes, box))
    if not lines.size:
        raise CatalogError(str(path), "has no line or outline near the pairs")
    return Background(_packed(lines), shortened(re.sub(r"<[^>]*>", "", credit), LONGEST_CREDIT))


def _layer_shapes(path: Path, layers: Sequence[str], box: Box) -> Shapes:
    """Return lines and outlines of the layers of a file, in degrees, at least those in a box."""
    import shapely

    from per_obspy.inventory.footprints.layer_files import read_raw_layer
    from per_obspy.inventory.footprints.layers import polygons, to_degrees, transformed

    # Files have longitudes on either side of 180 degrees: all of theirs are needed there
    found, around = [], box if len(_turns(box)) == 1 else (-180.0, -90.0, 180.0, 90.0)
    for layer in layers or (None,):
        raw = read_raw_layer(path, layer, around=around)
        transformer, _ = to_degrees(path, raw.crs)
        found.append(transformed(_as_lines(polygons(raw.wkb)), transformer))
    return np.concatenate(found) if found else np.array([], dtype=shapely.Geometry)


def _turns(box: Box) -> list[float]:
    """Return the degrees by which longitudes from -180 to 180 may be moved into a box."""
    turns = (-360.0, 0.0, 360.0)
    return [turn for turn in turns if box[0] < turn + 180.0 and box[2] > turn - 180.0]


def _tile_shapes(path: Path, layers: Sequence[str], box: Box) -> tuple[Shapes, str]:
    """Return lines of an archive in degrees, else its outlines, and who made it."""
    import pyproj

    from per_obspy.inventory.footprints.layers import polygons, transformed

    projection = ("OGC:CRS84", "EPSG:3857")
    mercator = pyproj.Transformer.from_crs(*projection, always_xy=True)
    # Tiles end at 85 degrees, and on both sides of 180 degrees
    boxes = []
    for turn in _turns(box):
        low, high = np.clip(np.reshape(box, (2, 2)) - [turn, 0.0], *_TILED).tolist()
        boxes.append((*mercator.transform(*low), *mercator.transform(*high)))
    try:
        # Some megabytes: what a region has at the chosen level
        wkb, side, credit = read_tiles_apart(
            Limits(120.0, 4 << 30), read_tiles, path, tuple(layers), boxes
        )
    except BeyondLimits as error:
        raise CatalogError(str(path), f"{error}: damaged, too large, or made to harm") from error
    shapes = polygons(wkb)
    cut = _without_edges(_as_lines(shapes if layers else _streets(shapes)), side)
    back = pyproj.Transformer.from_crs(*projection[::-1], always_xy=True)
    return transformed(cut, back), credit


def _streets(shapes: Shapes) -> Shapes:
    """Return the lines among shapes if there are any: outlines of fields would hide them."""
    import shapely

    kinds = shapely.GeometryType.LINESTRING, shapely.GeometryType.MULTILINESTRING
    is_line = np.isin(shapely.get_type_id(shapes), kinds)
    return shapes[is_line] if is_line.any() else shapes


def read_tiles(
    path: Path, layers: Sequence[str], boxes: Sequence[Box]
) -> tuple["pa.Array", float, str]:
    """
    Return the shapes of an archive as WKB, the side of its tiles, m, and who made it.

    Parameters
    ----------
    path : Path
        Archive of vector tiles.
    layers : sequence of str
        Names of layers, all without one.
    boxes : sequence of tuple of float
        West, south, east and north of the parts of a region in the projection of tiles, m.
    """
    import pyogrio  # in the process of readers only

    from per_obspy.inventory.footprints.gdal_paths import literal_path

    kind, _ = TILES[path.suffix.lower()]
    try:
        _refuse_programs(path)
        with literal_path(path) as plain:
            names = [str(name) for name, _ in pyogrio.list_layers(plain).tolist()]
            chosen = _chosen_layers(path, layers, names)
            # Layers have one description
            facts: dict[str, Any] = pyogrio.read_info(plain, layer=chosen[0])["dataset_metadata"]
            level = _level(facts, boxes)
            shapes = _shapes_at(level, plain, chosen, boxes)
    except CatalogError:
        raise
    except (RuntimeError, ValueError, TypeError, KeyError, sqlite3.Error) as error:
        problem = f"cannot be read as {kind}: {reason_of(error)}"
        raise CatalogError(str(path), shortened(problem)) from error
    return shapes, EQUATOR / 2.0**level, str(facts.get("attribution", ""))


def _shapes_at(level: int, path: Path, layers: Sequence[str], boxes: Sequence[Box]) -> "pa.Array":
    """Return the shapes of a zoom level as WKB, bytes that can be sent to another process."""
    import pyarrow as pa
    import pyogrio

    # The stream of Arrow would not report the errors of tiles
    options = {"ZOOM_LEVEL": str(level), "CLIP": "YES", "columns": []}
    parts = product(layers, boxes)
    wkb = [pyogrio.raw.read(path, layer=name, bbox=box, **options)[2] for name, box in parts]
    return pa.array(np.concatenate(wkb), pa.large_binary())


def _chosen_layers(path: Path, layers: Sequence[str], names: Sequence[str]) -> Sequence[str]:
    """Return the requested layers of an archive, all without a request."""
    if not names:
        raise CatalogError(str(path), "holds no vector tiles: pictures are no lines")
    if absent := [name for name in layers if name not in names]:
        problem = f"no layer {absent[0]!r} (layers found: {', '.join(names)})"
        raise CatalogError(str(path), problem)
    return layers or names


def _level(facts: Mapping[str, Any], boxes: Sequence[Box]) -> int:
    """Return the finest level of an archive of which a region has few tiles."""
    (_, south, _, north), *_ = boxes
    size = max(sum(east - west for west, _, east, _ in boxes), north - south, 1.0)
    wanted = int(np.log2(MOST_TILES * EQUATOR / size))
    return int(np.clip(wanted, int(facts["minzoom"]), int(facts["maxzoom"])))


def _refuse_programs(path: Path) -> None:
    """Refuse a database with virtual tables, which are programs."""
    if path.suffix.lower() != ".mbtiles":
        return
    search = "SELECT count(*) FROM sqlite_master WHERE sql LIKE '%CREATE%VIRTUAL%'"
    with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as database:
        if database.execute(search).fetchone()[0]:
            raise CatalogError(str(path), "has virtual tables, expected stored ones")


def _as_lines(shapes: Shapes) -> Shapes:
    """Return the lines of shapes, and the outlines of areas."""
    import shapely

    parts = shapely.get_parts(shapes[~shapely.is_missing(shapes)])
    parts = shapely.get_parts(parts)  # collections within collections
    is_area = shapely.get_type_id(parts) == shapely.GeometryType.POLYGON
    parts[is_area] = shapely.boundary(parts[is_area])
    lines = shapely.get_parts(parts)
    has_length = np.isin(
        shapely.get_type_id(lines),
        (shapely.GeometryType.LINESTRING, shapely.GeometryType.LINEARRING),
    )
    return np.asarray(shapely.force_2d(lines[has_length & ~shapely.is_empty(lines)]))


def _without_edges(lines: Shapes, side: float) -> Shapes:
    """Return lines (m) without the edges of tiles of a side, m, at which areas were cut."""
    import shapely

    corners, line = shapely.get_coordinates(lines, return_index=True)
    # A tile has 4096 steps
    if not len(corners):
        return lines
    whole = np.abs(corners / side - np.rint(corners / side)) < 0.5 / 4096
    steps = corners[1:] - corners[:-1]
    along = whole[1:] & whole[:-1] & (np.abs(steps) < 0.5 / 4096 * side)
    # A step along an edge ends a line, as does the first corner of another
    ends = along.any(axis=1) | (line[1:] != line[:-1])
    part = np.concatenate([[0], np.cumsum(ends)])
    has_length = np.bincount(part)[part] > 1
    number = np.unique(part[has_length], return_inverse=True)[1]
    return np.asarray(shapely.linestrings(corners[has_length], indices=number))


def _near(lines: Shapes, box: Box) -> Shapes:
    """Return the parts of lines (degrees) in a box, which may reach beyond 180 degrees."""
    import shapely

    lines = lines[np.isfinite(shapely.bounds(lines)).all(axis=1)]
    # Longitudes of a file end at 180 degrees
    moved = [shapely.transform(lines, partial(np.add, [turn, 0.0])) for turn in _turns(box)]
    lines = np.concatenate(moved)
    west, south, east, north = shapely.bounds(lines).T
    touches = (west <= box[2]) & (east >= box[0]) & (south <= box[3]) & (north >= box[1])
    return _as_lines(shapely.clip_by_rect(lines[touches], *box))


def _simplified(lines: Shapes) -> Shapes:
    """Return lines with few enough corners for a page."""
    import shapely

    tolerance = UNIT
    while True:
        simple = shapely.simplify(lines, tolerance, preserve_topology=False)
        # What is smaller than a step is a point
        west, south, east, north = shapely.bounds(simple).T
        simple = simple[np.maximum(east - west, north - south) >= tolerance]
        if shapely.get_num_coordinates(simple).sum() <= MOST_CORNERS:
            return np.asarray(simple)
        tolerance *= 1.5


def _packed(lines: Shapes) -> list[list[int]]:
    """Return lines (degrees) as whole steps."""
    import shapely

    # Steps within each line; those of nothing are left out
    corners, line = shapely.get_coordinates(lines, return_index=True)
    whole = np.rint(corners / UNIT).astype(np.int64)
    is_first = np.concatenate([[True], line[1:] != line[:-1]])
    steps = np.diff(whole, axis=0, prepend=0)
    steps[is_first] = whole[is_first]
    kept = is_first | steps.any(axis=1)
    starts = np.flatnonzero(is_first[kept])
    return [part.ravel().tolist() for part in np.split(steps[kept], starts[1:])]
