"""Tables of buildings: outlines from WKT and from sides, missing columns, hostile cells."""

import numpy as np
import pandas as pd
import pytest
import shapely
from building_samples import geometries, google, small_town
from numpy.testing import assert_allclose
from pyproj import Geod

from per_obspy import pairs_from_footprints
from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.csv_buildings import read_csv_buildings

#: Metres per degree of longitude on the equator, and of latitude there, of the WGS 84 ellipsoid.
EAST, NORTH = 6378137.0 * np.pi / 180, 6378137.0 * (1 - 0.00669437999) * np.pi / 180


@pytest.fixture
def write(tmp_path):
    def write(*lines):
        path = tmp_path / "town.csv"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    return write


def test_outlines_as_wkt(write):
    first, second = shapely.box(0.3, 0, 0.3001, 1e-4), shapely.box(0.30011, 0, 0.3002, 1e-4)
    path = write(
        "id,geometry,height,ward", f'a,"{first.wkt}",9 m,east', f'b,"{second.wkt}",20 ft,west'
    )
    pairs = pairs_from_footprints(path)
    assert pairs["pair_id"].tolist() == ["a/b"]
    # 1e-5 degrees on the equator
    assert_allclose(pairs["gap"], 1e-5 * EAST, rtol=1e-5)
    assert pairs.loc[0, ["height_1", "height_2"]].tolist() == [9.0, pytest.approx(6.096)]
    assert pairs.loc[0, ["ward_1", "ward_2"]].tolist() == ["east", "west"]
    # the outline is in the file of buildings
    assert not [name for name in pairs if "geometry" in name]


def test_rectangles_have_their_sides_area_and_axis(write):
    # 20 m towards 30 degrees east of north and 10 m across, at 60 degrees north
    path = write("lon,lat,Width,Length,Azimuth,height", "10.0,60.0,10,20 m,30,9")
    (corners,) = (shapely.get_coordinates(geometries(read_csv_buildings(path, "town.csv"))),)
    geod = Geod(ellps="WGS84")
    azimuth, _, sides = geod.inv(*corners[:-1].T, *corners[1:].T)
    assert_allclose(np.sort(sides), [10, 10, 20, 20], rtol=1e-6)
    long = np.asarray(azimuth)[sides > 15] % 180.0
    assert_allclose(long, 30.0, atol=1e-3)
    assert abs(geod.polygon_area_perimeter(*corners.T)[0]) == pytest.approx(200.0, rel=1e-6)
    assert_allclose(corners[:-1].mean(axis=0), [10.0, 60.0], atol=1e-9)


def test_rectangles_make_pairs(write):
    # two houses of 10 m from west to east, centres 10.5 m apart, and one 30 m north of them
    east = 10.5 / EAST
    path = write(
        "building_id,longitude,latitude,width,length,azimuth,storeys",
        "a,0.3,0,8,10,90,3",
        f"b,{0.3 + east!r},0,8,10,90,4",
        f"c,0.3,{30 / NORTH!r},8,10,90,4",
    )
    pairs = pairs_from_footprints(path)
    assert pairs["pair_id"].tolist() == ["a/b"]
    assert_allclose(pairs["gap"], 0.5, atol=1e-4)
    assert_allclose(pairs["azimuth"], 90.0, atol=0.01)
    assert_allclose(pairs["facing_length"], 8.0, atol=1e-3)


def test_rows_without_an_outline_are_named_by_line_and_the_others_go_on(write):
    head = "id,lon,lat,width,length,azimuth,height"
    good = ["a,0.3,0,8,10,90,9", "b,0.3001,0,8,10,90,9"]
    bad = [
        "c,0.3,0,,10,90,9",
        "d,0.3,0,-8,10,90,9",
        "e,0.3,95,8,10,90,9",
        "f,0.3,0,8,ten,90,9",
        "g",
    ]
    pairs = pairs_from_footprints(write(head, *good, *bad))
    assert len(pairs) == 1
    reasons = {row.row: (row.kind, *row.reasons) for row in pairs.attrs["rejected"]}
    assert reasons == {
        4: ("building", "width is empty"),
        5: ("building", "width = '-8.0' is no usable width"),
        6: ("building", "lat = '95' is no usable latitude"),
        7: ("building", "length = 'ten' is no usable length"),
        8: ("building", "1 columns, the header has 7"),
    }


MISSING = {
    "id,lon,lat,height": r"points have no walls.*add a column wkt .*, or width, length, azimuth",
    "lon,lat,PlanArea": r"an area \(PlanArea\) does not place these: add a column wkt",
    "lon,lat,width,length": r"add a column wkt \(outlines in degrees\), or azimuth \(",
    "name,height": r"no outlines of buildings: .*longitude, latitude, width.*found: name, height",
    "pair_id,gap": r"a table of pairs already, not of buildings: per-obspy pairs check",
    "wkt,a,a": "column a occurs more than once",
}


@pytest.mark.parametrize("header", MISSING)
def test_one_line_says_what_is_missing(write, header):
    with pytest.raises(CatalogError, match=MISSING[header]) as error:
        read_csv_buildings(write(header, "1,2,3,4"), "town.csv")
    assert "\n" not in str(error.value)
    assert str(error.value).count("town.csv") == 1


def test_a_list_without_rows(write):
    with pytest.raises(CatalogError, match="no rows"):
        read_csv_buildings(write("wkt,height"), "town.csv")


@pytest.mark.parametrize(
    ("cell", "reason"),
    [
        ("POLYGON ((20 10, 20.1 10", "no polygon as WKT"),
        ("POLYGON ((20 10, 20.1 10, 20 1e999, 20 10))", "no polygon as WKT|outside|invalid"),
        ("POINT (20 10)", "no polygon as WKT"),
        ("GEOMETRYCOLLECTION (" * 3000, "no polygon as WKT"),
        ("", "geometry is empty"),
        ("x" * ((1 << 20) + 1), "more than 1048576 characters"),
        ("POLYGON ((2000000 10, 2000010 10, 2000010 20, 2000000 10))", "outside"),
    ],
)
def test_a_broken_outline_loses_its_own_building(tmp_path, cell, reason):
    path = google(tmp_path, small_town())
    table = pd.read_csv(path)
    table.loc[3, "geometry"] = cell
    table.to_csv(path, index=False)
    pairs = pairs_from_footprints(path)
    assert len(pairs) == 2
    (rejected,) = pairs.attrs["rejected"]
    assert (rejected.row, rejected.kind) == (5, "building")
    assert any(word in rejected.reasons[0] for word in reason.split("|")), rejected


@pytest.mark.parametrize(
    "content",
    [
        b"area_in_meters,confidence,full_plus_code,geometry\n",
        b"area_in_meters,confidence,full_plus_code,geometry\n1,1,\xff\xfe,POINT (1 1)\n",
        b"geometry,geometry\na,b\n",
        b'geometry,a\n"POINT (1 1),2\n',
        b"geometry,a\n\x00\x00,2\n",
    ],
)
def test_damaged_files_end_in_one_line(tmp_path, content):
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    with pytest.raises(CatalogError) as error:
        pairs_from_footprints(path)
    assert "\n" not in str(error.value)


def test_cells_that_are_no_polygon(write):
    box = shapely.box(0.3, 0, 0.3001, 1e-4).wkt
    nested = "GEOMETRYCOLLECTION(" * 100_000
    lines = [f'a,"{box}",9', "b,,9", "c,POINT (0 0),9", "d,POLYGON ((0 0),9", f"e,{nested},9"]
    found = read_csv_buildings(write("id,wkt,height", *lines), "town.csv")
    assert sorted(found.faults) == [1, 2, 3, 4]
    assert found.faults[1] == "wkt is empty"
    assert found.faults[2] == "wkt = 'POINT (0 0)' is no polygon as WKT or GeoJSON"
    assert len(found.faults[4]) < 100
    assert found.numbers.tolist() == [2, 3, 4, 5, 6]


def test_rows_with_another_number_of_cells_are_named_by_line(tmp_path):
    path = google(tmp_path, small_town())
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0], "1,2,3", *lines[1:]]))
    pairs = pairs_from_footprints(path)
    assert len(pairs) == 2
    (rejected,) = pairs.attrs["rejected"]
    assert (rejected.row, *rejected.reasons) == (2, "3 columns, the header has 7")


def test_outlines_without_heights_say_what_to_add(tmp_path):
    path = google(tmp_path, small_town())
    pd.read_csv(path).drop(columns="building_height").to_csv(path, index=False)
    with pytest.raises(CatalogError, match=r"no column height.*Google Open Buildings.*add one"):
        pairs_from_footprints(path)
