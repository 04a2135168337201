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

from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.footprints.layer_files import Box, read_raw_layer
from per_obspy.inventory.footprints.raw_layer import Geometries, RawLayer, as_wkb

#: Features per block, to bound memory.
BLOCK = 20_000

#: Least and largest degrees of longitude and latitude; outlines across 180 degrees go on beyond it.
_LOWEST, _HIGHEST = [-180.0, -90.0], [360.0, 90.0]

_POLYGONAL = (shapely.GeometryType.POLYGON, shapely.GeometryType.MULTIPOLYGON)
_POINTS = {shapely.GeometryType.POINT, shapely.GeometryType.MULTIPOINT}


class Layer(NamedTuple):
    """Footprints of one layer."""

    #: WKB of valid polygons and multipolygons, two-dimensional, longitude and latitude in degrees
    #: (WGS 84); longitudes of one across 180 degrees go on beyond it.
    outlines: pa.Array
    #: One row per outline; the index is the number of the feature in the file, from 1, or the line
    #: of a table.
    attributes: pd.DataFrame
    #: Features whose geometry cannot be used.
    rejected: tuple[Rejection, ...]


def read_layer(path: str | Path, layer: str | None = None, box: Box | None = None) -> Layer:
    """
    Read the footprints of a file.

    Parameters
    ----------
    path : str or Path
        GeoPackage, GeoJSON, Shapefile, FlatGeobuf, GeoParquet, CSV with outlines, or a file of a
        source in ``docs/importers.md``.
    layer : str, optional
        Name of the layer, for files that have several.
    box : tuple of float, optional
        West, south, east and north of the buildings, degrees; of GeoParquet only.

    Raises
    ------
    CatalogError
        If the file cannot be read, has no coordinate reference system, or the layer is empty or
        contains no polygons.
    """
    file = Path(path)
    raw = read_raw_layer(file, layer, box)
    _require_outlines(file, raw)
    transformer, is_projected = to_degrees(file, raw.crs)
    # Outlines that can be used and reasons for the others, block by block
    outlines, rejected, good = [], list(raw.broken), np.ones(len(raw.wkb), dtype=bool)
    for start, original in blocks(raw.wkb):
        degrees = _in_degrees(original, transformer)
        faults = _faults(degrees, original, is_projected)
        outlines.append(as_wkb(np.delete(degrees, list(faults))))
        for i, fault in faults.items():
            good[start + i] = False
            rejected.append(_rejection(file, raw, start + i, fault))
    # In the order of the file
    rejected.sort(key=lambda row: row.row or 0)
    return Layer(pa.concat_arrays(outlines), _attributes(raw, good), tuple(rejected))


def _rejection(file: Path, raw: RawLayer, i: int, fault: str) -> Rejection:
    """Return the rejection of a feature, by the fault that its reader knows, else its geometry."""
    number, reason = int(raw.numbers[i]), raw.faults.get(i, fault)
    return Rejection("building", f"feature {number}", str(file), number, (reason,))


def _attributes(raw: RawLayer, good: NDArray[np.bool_]) -> pd.DataFrame:
    """Return the attributes of usable features by their number; a layer may have no column."""
    mask, columns = pa.array(good), raw.attributes
    cells = {name: columns[name].filter(mask).to_pandas().array for name in columns.column_names}
    return pd.DataFrame(cells, index=pd.Index(raw.numbers[good]), copy=False)


def polygons(outlines: pa.Array) -> Geometries:
    """Return the polygons of outlines that are WKB."""
    wkb = outlines.to_numpy(zero_copy_only=False)
    return np.asarray(shapely.from_wkb(wkb, on_invalid="ignore"), dtype=object)


def blocks(wkb: pa.Array | pa.ChunkedArray) -> Iterator[tuple[int, Geometries]]:
    """Yield position and geometries of every block of outlines that are WKB."""
    for start in range(0, len(wkb), BLOCK):
        yield start, polygons(wkb.slice(start, BLOCK))


def _require_outlines(file: Path, raw: RawLayer) -> None:
    """Raise CatalogError if a layer is empty or has points only."""
    if len(raw.wkb) == 0:
        raise CatalogError(str(file), "the layer has no features")
    kinds: set[int] = set()
    for _, geometries in blocks(raw.wkb):
        kinds |= set(shapely.get_type_id(geometries).tolist()) - {-1}
        # One outline is enough
        if kinds - _POINTS:
            return
    if kinds or not raw.faults:
        problem = "the layer holds points, not footprints: a gap is a distance between walls"
        raise CatalogError(str(file), problem)


def to_degrees(file: Path, crs: Any) -> tuple[pyproj.Transformer, bool]:
    """Return the transformation to longitude and latitude, and whether it is from a projection."""
    if crs is None:
        raise CatalogError(str(file), "no coordinate reference system (a Shapefile needs its .prj)")
    try:
        system = pyproj.CRS.from_user_input(crs)
    except (pyproj.exceptions.CRSError, TypeError, ValueError, AttributeError) as error:
        problem = f"unknown coordinate reference system {str(crs)!r:.60}"
        raise CatalogError(str(file), problem) from error
    # Heights, local systems of a building site and positions from the centre of the Earth
    name = f"coordinate reference system {system.name!r:.60}"
    if not (system.is_geographic or system.is_projected):
        problem = f"{name} is of another kind, expected a geographic or projected one"
        raise CatalogError(str(file), problem)
    try:
        transformer = pyproj.Transformer.from_crs(system, "OGC:CRS84", always_xy=True)
    except pyproj.exceptions.ProjError as error:
        raise CatalogError(str(file), f"{name} cannot be turned into WGS 84") from error
    return transformer, bool(system.is_projected)


def transformed(shapes: Geometries, transformer: pyproj.Transformer) -> Geometries:
    """Return two-dimensional geometries in another reference system."""
    moved = shapely.transform(shapes, lambda xy: np.column_stack(transformer.transform(*xy.T)))
    return np.asarray(moved)


def _in_degrees(original: Geometries, transformer: pyproj.Transformer) -> Geometries:
    """Return geometries in longitude and latitude."""
    degrees = transformed(original, transformer)
    # A building across 180 degrees has longitudes of both signs, which would reach around the Earth
    west, _, east, _ = shapely.bounds(degrees).T
    for i in np.flatnonzero((east - west > 180.0) & (east - west <= 360.0)).tolist():
        degrees[i] = shapely.transform(degrees[i], lambda xy: np.c_[xy[:, 0] % 360.0, xy[:, 1]])
        parts = shapely.get_parts(degrees[i])
        # Its parts on both sides, as GeoJSON demands, are one again
        if len(parts) > 1 and shapely.is_valid(parts).all():
            degrees[i] = shapely.union_all(parts)
    return degrees


def _faults(degrees: Geometries, original: Geometries, is_projected: bool) -> dict[int, str]:
    """Return the geometries that are no footprints, by position, with the reasons."""
    # A town lies within 180 m and 90 m of the origin of its projection only if its coordinates are
    # degrees
    stray = _on_earth(original) & is_projected
    polygonal = np.isin(shapely.get_type_id(degrees), _POLYGONAL) & ~shapely.is_empty(degrees)
    good = polygonal & _on_earth(degrees) & shapely.is_valid(degrees) & ~stray
    bad = np.flatnonzero(~good).tolist()
    return {i: _fault(degrees[i], original[i], bool(stray[i])) for i in bad}


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
    place = f"coordinates {', '.join(f'{value:g}' for value in original.bounds[:2])}"
    if stray:
        return f"{place} are degrees, the layer's coordinate reference system is in metres"
    if not _on_earth(degrees):
        is_swapped = _on_earth(shapely.transform(degrees, np.fliplr))
        question = " (longitude and latitude swapped?)" if is_swapped else ""
        return f"{place} lie outside the layer's coordinate reference system{question}"
    return f"the polygon is invalid: {shapely.is_valid_reason(original)}"
