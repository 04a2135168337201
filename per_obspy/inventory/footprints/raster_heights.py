"""
Heights of buildings from a raster of heights above ground, such as a normalised surface model.

A cell belongs to an outline if its centre lies inside; a building smaller than a cell has the cell
of its inner point. The raster is read in the process of readers, as GeoTIFF only, and without the
files beside it.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyproj
import shapely
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError
from per_obspy.files import reading, unreadable_reason
from per_obspy.inventory.footprints.layers import BLOCK, polygons, to_degrees
from per_obspy.inventory.footprints.raw_layer import Geometries
from per_obspy.reader_process import BeyondLimits, Limits, read_apart

#: How TIFF and BigTIFF begin, in either order of bytes.
_BEGINNINGS = (b"II*\x00", b"MM\x00*", b"II+\x00", b"MM\x00+")

#: Most cells around one outline, to bound memory: 400 m by 400 m of cells of 0.1 m.
MOST_CELLS = 1 << 24

#: Share of an outline's cells that must have a height.
KNOWN = 0.5

#: Names of the unit of heights; a raster may have none.
_METRES = ("", "m", "metre", "meter", "metres", "meters")

_OFF = {"GDAL_DISABLE_READDIR_ON_OPEN": "EMPTY_DIR", "GDAL_PAM_ENABLED": False}


def raster_heights(file: Path, outlines: pa.Array) -> FloatArray:
    """
    Compute the median height inside each outline.

    Parameters
    ----------
    file : Path
        GeoTIFF of one band: heights above ground, m, in any coordinate reference system.
    outlines : pa.Array
        WKB in degrees (WGS 84).

    Returns
    -------
    heights : (n_outlines,) ndarray
        m; NaN where fewer than half of the cells of an outline have a height.

    Raises
    ------
    CatalogError
        If the file cannot be read, has several bands, another unit or no place on the Earth, or
        none of the outlines lies in it.
    """
    _require_tiff(file)
    medians, lies_inside = [], False
    for start in range(0, len(outlines), BLOCK):
        block = outlines.slice(start, BLOCK)
        # A building takes milliseconds, the largest one a second (reasoned)
        limits = Limits(120.0 + 0.05 * len(block), 4 << 30)
        try:
            heights, is_inside = read_apart(limits, _read, file, block)
        except BeyondLimits as error:
            problem = f"{error}: damaged, too large, or made to harm"
            raise CatalogError(str(file), problem) from error
        medians.append(heights)
        lies_inside |= is_inside
    if not lies_inside:
        raise CatalogError(str(file), "none of the buildings lies in the raster")
    return np.concatenate(medians)


def _require_tiff(file: Path) -> None:
    """Raise CatalogError if a file is missing or does not begin as TIFF."""
    with reading(file), file.open("rb") as opened:
        head = opened.read(4)
    if head not in _BEGINNINGS:
        raise CatalogError(str(file), "is no GeoTIFF by its first bytes")


def _read(file: Path, outlines: pa.Array) -> tuple[FloatArray, bool]:
    """Return heights, and whether an outline lies in the raster; in the process of readers."""
    import rasterio  # in the process of readers only

    try:
        with rasterio.Env(**_OFF), rasterio.open(file.absolute(), driver="GTiff") as raster:
            # One band of heights, with a place on the Earth
            if problem := _problem(raster):
                raise CatalogError(str(file), problem)
            shapes = _in_cells(file, raster, polygons(outlines))
            # Of each outline, in the file's order
            heights = np.array([_median(raster, shape) for shape in shapes])
            edge = shapely.box(0, 0, raster.width, raster.height)
            return heights, bool(shapely.intersects(shapes, edge).any())
    except CatalogError:
        raise
    # Texts of a damaged file are no UTF-8, its numbers no place
    except (rasterio.errors.RasterioError, ValueError, OverflowError) as error:
        raise CatalogError(str(file), unreadable_reason(file, "GeoTIFF", error)) from error


def _problem(raster: Any) -> str:
    """Return why a raster gives no heights, empty if it does."""
    unit = (raster.units[0] or "").strip().lower()
    if raster.count != 1:
        return f"the raster has {raster.count} bands, expected one of heights"
    if not raster.dtypes[0].startswith(("int", "uint", "float")):
        return f"the raster holds {raster.dtypes[0]}, expected real numbers"
    # Feet would be taken for metres
    if unit not in _METRES:
        return f"heights of the raster are in {unit!r:.20}, expected m"
    if raster.crs is None or raster.transform.is_identity or raster.transform.is_degenerate:
        return "the raster has no coordinate reference system, or no place in it"
    # Where places are in feet, heights often are
    if not unit and raster.crs.is_projected and raster.crs.linear_units_factor[1] != 1.0:
        return f"heights of the raster name no unit, and its system is in {raster.crs.linear_units}"
    return ""


def _in_cells(file: Path, raster: Any, degrees: Geometries) -> Geometries:
    """Return outlines in columns and rows of a raster."""
    # East and north by the file's system, then by the place of its cells
    transformer, _ = to_degrees(file, raster.crs.to_wkt())
    cells, inverse = ~raster.transform, pyproj.enums.TransformDirection.INVERSE

    def columns_and_rows(xy: FloatArray) -> FloatArray:
        east, north = transformer.transform(xy[:, 0], xy[:, 1], direction=inverse)
        column = cells.a * east + cells.b * north + cells.c
        return np.column_stack([column, cells.d * east + cells.e * north + cells.f])

    return np.asarray(shapely.transform(degrees, columns_and_rows))


def _median(raster: Any, outline: shapely.Geometry) -> float:
    """Return the median height inside an outline in cells of a raster, NaN if few have one."""
    bounds = shapely.bounds(outline)
    # Projections have no place for some coordinates
    if not np.isfinite(bounds).all():
        return np.nan
    left, top = np.floor(bounds[:2]).astype(int).tolist()
    right, bottom = np.ceil(bounds[2:]).astype(int).tolist()
    if (right - left) * (bottom - top) > MOST_CELLS:
        return np.nan
    inside = _cells_inside(outline, *np.mgrid[top:bottom, left:right])
    heights = _heights(raster, (top, bottom), (left, right))[inside]
    known = heights[np.isfinite(heights)]
    # The rest of the building may be of another height
    return float(np.median(known)) if known.size >= KNOWN * heights.size > 0 else np.nan


def _cells_inside(
    outline: shapely.Geometry, rows: NDArray[np.int64], columns: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return the cells with their centre inside an outline, else the one of its inner point."""
    shapely.prepare(outline)
    inside = np.asarray(shapely.contains_xy(outline, columns + 0.5, rows + 0.5))
    if inside.any():
        return inside
    # Smaller than a cell, or between the centres
    inner = shapely.get_coordinates(shapely.point_on_surface(outline))[0]
    return np.asarray((columns == np.floor(inner[0])) & (rows == np.floor(inner[1])))


def _heights(raster: Any, rows: tuple[int, int], columns: tuple[int, int]) -> FloatArray:
    """Return the heights in a window, m; NaN outside the raster and where it has none."""
    (top, bottom), (left, right) = rows, columns
    heights = np.full((bottom - top, right - left), np.nan)
    # The part inside the raster
    first, last = max(top, 0), min(bottom, raster.height)
    west, east = max(left, 0), min(right, raster.width)
    if first < last and west < east:
        window = (first, last), (west, east)
        # With the nodata of the file, and its scale
        known = raster.read(1, window=window, masked=True, out_dtype=np.float64)
        metres = known.filled(np.nan) * raster.scales[0] + raster.offsets[0]
        heights[first - top : last - top, west - left : east - left] = metres
    return heights
