"""
Layers of building footprints: valid polygons in degrees, attributes, unusable features.

Outlines are kept as WKB, a tenth of the memory of polygons, and are polygons only block by block.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyproj
import shapely
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.footprints.layer_files import RawLayer, read_raw_layer

Geometries = NDArray[np.object_]

#: Features per block, to bound memory.
BLOCK = 20_000

#: Least and largest degrees of longitude and latitude; outlines across 180 degrees go on beyond it.
_LOWEST, _HIGHEST = [-180.0, -90.0], [360.0, 90.0]

_POLYGONAL = (shapely.GeometryType.POLYGON, shapely.GeometryType.MULTIPOLYGON)
_POINTS = {shapely.GeometryType.POINT, shapely.GeometryType.MULTIPOINT}


class Layer(NamedTuple):
    """
    Footprints of one layer.

    Attributes
    ----------
    outlines : pa.Array
        WKB of ``n_buildings`` valid polygons and multipolygons, two-dimensional, longitude and
        latitude in degrees (WGS 84); longitudes of one across 180 degrees go on beyond it.
    attributes : DataFrame
        One row per outline; its index is the number of the feature in the file, from 1, or the line
        of a list.
    rejected : tuple of Rejection
        Features whose geometry cannot be used.
    """

    outlines: pa.Array
    attributes: pd.DataFrame
    rejected: tuple[Rejection, ...]


class _Block(NamedTuple):
    """Consecutive features: their geometries as read, the same in degrees, and the usable ones."""

    original: Geometries
    degrees: Geometries
    stray: NDArray[np.bool_]
    good: NDArray[np.bool_]


def read_layer(path: str | Path, layer: str | None = None) -> Layer:
    """
    Read the footprints of a file.

    Parameters
    ----------
    path : str or Path
        GeoPackage, GeoJSON, Shapefile, FlatGeobuf, GeoParquet, or a CSV list of buildings with
        outlines.
    layer : str, optional
        Name of the layer, for files that have several.

    Raises
    ------
    CatalogError
        If the file cannot be read, has no coordinate reference system, or the layer is empty or
        contains no polygons.
    """
    file = Path(path)
    raw = read_raw_layer(file, layer)
    _require_outlines(file, raw)
    transformer, is_projected = to_degrees(file, raw.crs)
    # Outlines that can be used and reasons for the others, block by block
    outlines, rejected, good = [], list(raw.broken), np.zeros(len(raw.wkb), dtype=bool)
    for start, geometries in _blocks(raw.wkb):
        block = _checked_block(geometries, transformer, is_projected)
        outlines.append(pa.array(shapely.to_wkb(block.degrees[block.good]), pa.large_binary()))
        good[start : start + len(geometries)] = block.good
        rejected += _rejections(file, raw, start, block)
    attributes = raw.attributes.filter(pa.array(good)).to_pandas()
    attributes.index = pd.Index(raw.numbers[good])
    # In the order of the file
    rejected.sort(key=lambda row: row.row or 0)
    return Layer(pa.concat_arrays(outlines), attributes, tuple(rejected))


def polygons(outlines: pa.Array) -> Geometries:
    """Return the polygons of outlines that are WKB."""
    wkb = outlines.to_numpy(zero_copy_only=False)
    return np.asarray(shapely.from_wkb(wkb, on_invalid="ignore"), dtype=object)


def _blocks(wkb: pa.ChunkedArray) -> Iterator[tuple[int, Geometries]]:
    """Yield position and geometries of every block."""
    for start in range(0, len(wkb), BLOCK):
        yield start, polygons(wkb.slice(start, BLOCK))


def _require_outlines(file: Path, raw: RawLayer) -> None:
    """Raise CatalogError if a layer is empty or has points only."""
    if len(raw.wkb) == 0:
        raise CatalogError(str(file), "the layer has no features")
    kinds: set[int] = set()
    for _, geometries in _blocks(raw.wkb):
        found = shapely.get_type_id(geometries)
        kinds |= set(found[found >= 0].tolist())
        # One outline is enough
        if kinds - _POINTS:
            return
    if raw.faults and not kinds:
        return
    raise CatalogError(
        str(file), "the layer holds points, not footprints: a gap is a distance between walls"
    )


def in_degrees(original: Geometries, transformer: pyproj.Transformer) -> Geometries:
    """Return geometries in longitude and latitude."""
    degrees = np.asarray(
        shapely.transform(
            shapely.force_2d(original),
            lambda xy: np.column_stack(transformer.transform(*xy.T)),
        )
    )
    # A building across 180 degrees has longitudes of both signs, which would reach around the Earth
    west, _, east, _ = shapely.bounds(degrees).T
    for i in np.flatnonzero((east - west > 180.0) & (east - west <= 360.0)).tolist():
        degrees[i] = shapely.transform(degrees[i], _eastward)
        parts = shapely.get_parts(degrees[i])
        # Its parts on both sides, as GeoJSON demands, are one again
        if len(parts) > 1 and shapely.is_valid(parts).all():
            degrees[i] = shapely.union_all(parts)
    return degrees


def _eastward(places: FloatArray) -> FloatArray:
    """Return longitudes and latitudes with longitudes from 0 to 360 degrees."""
    return np.column_stack([places[:, 0] % 360.0, places[:, 1]])


def _checked_block(
    original: Geometries, transformer: pyproj.Transformer, is_projected: bool
) -> _Block:
    """Return geometries in degrees, and where they are footprints."""
    # Longitude and latitude of every feature
    degrees = in_degrees(original, transformer)
    # A town lies within 180 m and 90 m of the origin of its projection only if its coordinates are
    # degrees
    stray = _on_earth(original) & is_projected
    return _Block(original, degrees, stray, _are_footprints(degrees) & ~stray)


def _rejections(file: Path, raw: RawLayer, start: int, block: _Block) -> list[Rejection]:
    """Return the rejections of the features of a block."""
    # A list knows its faults, other files show them
    rejected = []
    for i in np.flatnonzero(~block.good).tolist():
        number = int(raw.numbers[start + i])
        fault = raw.faults.get(start + i)
        reason = fault or _fault(block.degrees[i], block.original[i], bool(block.stray[i]))
        rejected.append(Rejection("building", f"feature {number}", str(file), number, (reason,)))
    return rejected


def to_degrees(file: Path, crs: Any) -> tuple[pyproj.Transformer, bool]:
    """Return the transformation to longitude and latitude, and whether it is from a projection."""
    system = _reference_system(file, crs)
    try:
        transformer = pyproj.Transformer.from_crs(system, "OGC:CRS84", always_xy=True)
    except pyproj.exceptions.ProjError as error:
        problem = f"coordinate reference system {system.name!r:.60} cannot be turned into WGS 84"
        raise CatalogError(str(file), problem) from error
    return transformer, bool(system.is_projected)


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


def _are_footprints(degrees: Geometries) -> NDArray[np.bool_]:
    """Return where geometries are valid polygons on the Earth."""
    polygonal = np.isin(shapely.get_type_id(degrees), _POLYGONAL) & ~shapely.is_empty(degrees)
    return np.asarray(polygonal & _on_earth(degrees) & shapely.is_valid(degrees))


def _on_earth(degrees: Geometries | shapely.Geometry) -> NDArray[np.bool_]:
    """Return where coordinates are degrees; a projection gives infinity far outside its range."""
    bounds = shapely.bounds(degrees)
    is_inside = (bounds[..., :2] >= _LOWEST) & (bounds[..., 2:] <= _HIGHEST)
    return np.asarray(is_inside.all(axis=-1))


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
