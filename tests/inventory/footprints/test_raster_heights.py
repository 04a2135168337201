"""Heights from a raster: laws of the median, what a raster lacks, deviation, wrong rasters."""

import json

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
import shapely
from numpy.testing import assert_allclose
from pyproj import Transformer

from per_obspy.config import Building
from per_obspy.errors import CatalogError
from per_obspy.inventory.completion import completed_pairs
from per_obspy.inventory.files.reading import read_pairs
from per_obspy.inventory.footprints.building_columns import schema_columns, with_raster_heights
from per_obspy.inventory.footprints.raster_heights import raster_heights
from per_obspy.screening.flags import heights_are_from_raster

# rasterio 1.4 writes by the older operator of affine
pytestmark = pytest.mark.filterwarnings("ignore:Use `@` matmul:PendingDeprecationWarning")

UTM = "EPSG:32719"
WEST, NORTH = 500_000.0, 7_750_000.0


def _outlines(*boxes):
    """Return outlines in degrees of boxes (west, south, width, depth), m from the raster's edge."""
    to_degrees = Transformer.from_crs(UTM, "OGC:CRS84", always_xy=True)
    shapes = [
        shapely.transform(
            shapely.box(WEST + x, NORTH - y, WEST + x + width, NORTH - y + depth),
            lambda xy: np.column_stack(to_degrees.transform(*xy.T)),
        )
        for x, y, width, depth in boxes
    ]
    return np.array(shapes)


def _wkb(outlines):
    return pa.array(shapely.to_wkb(outlines), pa.large_binary())


@pytest.fixture
def write(tmp_path):
    """Return a function that writes a raster with cells of 2 m, its upper left at WEST, NORTH."""
    rasterio = pytest.importorskip("rasterio")

    def write(heights, scale=1.0, unit=None, crs=UTM, place=None, name="heights.tif", **profile):
        bands = np.atleast_3d(np.asarray(heights)).transpose(2, 0, 1)
        count, height, width = bands.shape
        place = place or rasterio.transform.from_origin(WEST, NORTH, 2.0, 2.0)
        profile |= {"width": width, "height": height, "count": count, "transform": place}
        with rasterio.open(
            tmp_path / name, "w", driver="GTiff", dtype=bands.dtype, crs=crs, **profile
        ) as raster:
            raster.write(bands)
            raster.scales = [scale] * count
            if unit:
                raster.units = [unit] * count
        return tmp_path / name

    return write


def test_a_constant_raster_gives_its_height_times_its_scale(write):
    outlines = _wkb(_outlines((10.0, 90.0, 12.0, 9.0), (51.3, 47.1, 0.4, 0.4)))
    for scale in (1.0, 0.1):
        file = write(np.full((60, 50), 90, dtype=np.uint16), scale)
        # the second building lies within one cell
        assert_allclose(raster_heights(file, outlines), 90.0 * scale, rtol=1e-12)


def test_the_median_of_a_slope_is_that_of_the_middle_in_any_system(write):
    from rasterio.transform import from_bounds

    # east by 0.2 m and south by 0.1 m per metre; a median of a plane in a box is at its middle
    boxes = [(10.0, 90.0, 16.0, 12.0), (40.0, 60.0, 20.0, 8.0)]
    rows, columns = np.mgrid[0:60, 0:50] + 0.5
    file = write(3.0 + 0.4 * columns + 0.2 * rows)
    expected = [3.0 + 0.2 * (x + w / 2) + 0.1 * (y - d / 2) for x, y, w, d in boxes]
    # half a cell in each direction
    assert_allclose(raster_heights(file, _wkb(_outlines(*boxes))), expected, atol=0.3)
    # the same plane, in degrees and of finer cells
    east, south, north = WEST + 100.0, NORTH - 120.0, NORTH
    degrees = Transformer.from_crs(UTM, "OGC:CRS84", always_xy=True)
    bounds = degrees.transform_bounds(WEST, south, east, north)
    place = from_bounds(*bounds, 200, 240)
    row, column = np.mgrid[0:240, 0:200] + 0.5
    x, y = degrees.transform(*(place * (column, row)), direction="INVERSE")
    fine = 3.0 + 0.2 * (x - WEST) + 0.1 * (NORTH - y)
    file = write(fine, crs="EPSG:4326", place=place)
    assert_allclose(raster_heights(file, _wkb(_outlines(*boxes))), expected, atol=0.08)


def test_half_of_an_outline_must_have_heights(write):
    heights = np.full((60, 50), 8.0)
    heights[:, :10] = -9999.0
    heights[:, 10:12] = np.nan
    file = write(heights, nodata=-9999.0)
    # cells without a height reach to 24 m, the raster to 100 m
    boxes = [(4.0, 60.0, 12.0, 9.0), (18.0, 60.0, 10.0, 9.0), (20.0, 60.0, 10.0, 9.0)]
    boxes += [(96.0, 60.0, 6.0, 9.0), (98.0, 60.0, 8.0, 9.0), (300.0, 60.0, 8.0, 9.0)]
    found = raster_heights(file, _wkb(_outlines(*boxes)))
    assert_allclose(found, [np.nan, np.nan, 8.0, 8.0, np.nan, np.nan])


WRONG = {
    "3 bands": ({"heights": np.full((9, 9, 3), 8.0)}, "has 3 bands, expected one"),
    "feet": ({"heights": np.full((9, 9), 8.0), "unit": "ft"}, "in 'ft', expected m"),
    "feet perhaps": ({"heights": np.full((9, 9), 8.0), "crs": "EPSG:2263"}, "name no unit.* foot"),
    "no system": ({"heights": np.full((9, 9), 8.0), "crs": None}, "no coordinate reference"),
    "complex": ({"heights": np.full((9, 9), 8j)}, "holds complex128"),
    "elsewhere": ({"heights": np.full((9, 9), 8.0), "crs": "EPSG:32720"}, "none of the buildings"),
}


@pytest.mark.parametrize(("options", "message"), WRONG.values(), ids=WRONG)
def test_wrong_rasters(write, options, message):
    file = write(**options)
    with pytest.raises(CatalogError, match=message) as error:
        raster_heights(file, _wkb(_outlines((2.0, 12.0, 8.0, 8.0))))
    assert "heights.tif" in str(error.value)


def test_files_that_are_no_raster(write, tmp_path):
    outlines = _wkb(_outlines((2.0, 12.0, 8.0, 8.0)))
    with pytest.raises(CatalogError, match="No such file"):
        raster_heights(tmp_path / "none.tif", outlines)
    (tmp_path / "a.tif").write_text("<VRTDataset/>")
    with pytest.raises(CatalogError, match="no GeoTIFF by its first bytes"):
        raster_heights(tmp_path / "a.tif", outlines)
    whole = write(np.random.default_rng(1).random((60, 50)), unit="metre").read_bytes()
    # cut, and with a text that is no UTF-8
    for damaged in (whole[: len(whole) // 2], whole.replace(b"metre", b"m\x96tre")):
        (tmp_path / "a.tif").write_bytes(damaged)
        with pytest.raises(CatalogError, match="not a GeoTIFF"):
            raster_heights(tmp_path / "a.tif", outlines)


def test_only_buildings_without_a_size_take_the_raster():
    layer = pd.DataFrame({"height": [9.0, None, None, "tall"], "storeys": [None, 3, None, None]})
    table = schema_columns(layer, "town", raster=np.array([20.0, 20.0, 20.0, 20.0]))
    assert_allclose(table["height"], [9.0, np.nan, 20.0, np.nan])
    assert table["height_source"].tolist() == ["", "", "raster", ""]
    # a lognormal height of 3.7 m, the deviation of heights from coarse images
    assert_allclose(np.sqrt(np.expm1(table["height_log_std"][2] ** 2)) * 20.0, 3.7, rtol=1e-12)
    # ground, and metres above sea level, are no heights
    for raster in (0.3, 2500.0):
        bare = schema_columns(layer, "town", raster=np.full(4, raster))
        assert bare["height_source"].tolist() == [""] * 4
    # a layer without any column of sizes will do
    bare = schema_columns(pd.DataFrame({"a": [1, 2]}), "town", raster=np.full(2, 7.0))
    assert bare["height"].tolist() == [7.0, 7.0]


def test_known_heights_measure_a_raster_and_refuse_another_unit():
    errors = np.random.default_rng(3).normal(0.1, 0.3, 4000)
    known = pd.DataFrame({"height": np.append(np.full(4000, 9.0), np.nan)})
    raster = 9.0 * np.exp(np.append(errors, 0.0))
    filled = with_raster_heights(known, raster, True, "town")
    # root mean square, bias included; of 4000 it is off by 1.1 %
    expected = np.hypot(0.1, 0.3)
    assert filled["height_log_std"].iloc[-1] == pytest.approx(expected, rel=0.04)
    assert filled["height_log_std"].iloc[:-1].isna().all()
    with pytest.raises(CatalogError, match=r"times the 4000 known ones.*metres above ground"):
        with_raster_heights(known, raster / 0.3048, True, "town")


def test_the_command_says_what_the_raster_gave(call, write, tmp_path):
    file = write(np.full((60, 50), 8.0))
    # touching houses, the last one outside the raster
    outlines = _outlines(*((12.0 * k, 60.0, 12.0, 9.0) for k in (0, 1, 2, 9)))
    features = [
        {"type": "Feature", "geometry": json.loads(shapely.to_geojson(shape)), "properties": own}
        for shape, own in zip(outlines, ({"height": 5.0}, {}, {}, {}), strict=True)
    ]
    layer = tmp_path / "town.geojson"
    layer.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    code, out, _ = call("pairs", layer, "--heights", file, "-o", tmp_path / "pairs.csv")
    assert code == 0
    assert "height from the raster: 2 buildings, log-deviation up to 0.44; 1 without a size" in out
    pairs = completed_pairs(read_pairs(tmp_path / "pairs.csv"), Building())
    assert sorted([*pairs["height_1"], *pairs["height_2"]]) == pytest.approx([5.0, 8.0, 8.0, 8.0])
    assert all("height_2" in names.split() for names in pairs["derived"])
    assert (pairs["period_log_std_2"] > pairs["period_log_std_1"].min()).all()
    # a check knows every column
    assert json.loads(call("pairs", "check", tmp_path / "pairs.csv", "--json")[1])["unused"] == []
    assert heights_are_from_raster(pairs).tolist() == [True, True]
