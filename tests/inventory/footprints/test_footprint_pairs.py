"""Pairs from footprint files: every format, faults of features, real and synthetic cities."""

import json

import numpy as np
import pyarrow as pa
import pyogrio
import pyproj
import pytest
import shapely
from city import city
from numpy.testing import assert_allclose
from pyproj import Transformer

from per_obspy import pairs_from_footprints
from per_obspy.config import Building
from per_obspy.errors import CatalogError
from per_obspy.inventory.checking import checked_pairs
from per_obspy.inventory.completion import completed_pairs

#: metres about a place in a salt flat -> degrees
LOCAL = "+proj=tmerc +lon_0=-67.95 +lat_0=-20.35 +datum=WGS84"
TO_DEGREES = Transformer.from_crs(LOCAL, "OGC:CRS84", always_xy=True)

#: three houses in a row from west to east, gaps 0.25 m and 0 m, and a distant one
ROW = [
    shapely.box(0, 0, 10, 12),
    shapely.box(10.25, 0, 20, 12),
    shapely.box(20, 0, 30, 12),
    shapely.box(99, 0, 110, 9),
]
HEIGHTS, STOREYS = [12.0, 9.0, 6.0, 3.0], [4.0, 3.0, 2.0, 1.0]


def _degrees(polygons):
    return shapely.transform(
        np.array(polygons, dtype=object), lambda xy: np.column_stack(TO_DEGREES.transform(*xy.T))
    )


@pytest.fixture
def write(tmp_path):
    def write(
        polygons,
        name="town.gpkg",
        crs="EPSG:4326",
        kind="Polygon",
        degrees=True,
        **columns,
    ):
        geometries = _degrees(polygons) if degrees else np.array(polygons, dtype=object)
        # FlatGeobuf sorts features in space by default
        options = {"SPATIAL_INDEX": "NO"} if name.endswith(".fgb") else {}
        columns = columns or {
            "height": HEIGHTS[: len(polygons)],
            "storeys": STOREYS[: len(polygons)],
        }
        pyogrio.raw.write(
            tmp_path / name,
            shapely.to_wkb(geometries, output_dimension=3),
            [np.array(values) for values in columns.values()],
            list(columns),
            geometry_type=kind,
            crs=crs,
            **options,
        )
        return tmp_path / name

    return write


def _check_row(pairs):
    assert pairs.attrs["rejected"] == ()
    assert pairs["pair_id"].tolist() == ["feature 1/feature 2", "feature 2/feature 3"]
    # degrees are stored with 15 digits: 1e-9 m; GeoJSON with 7 decimals: 1 cm, which TOUCHING does
    # not hide
    assert_allclose(pairs["gap"], [0.25, 0.0], atol=0.012)
    assert_allclose(pairs["azimuth"], 90.0, atol=0.2)
    assert_allclose(pairs["facing_length"], 12.0, atol=0.05)
    assert pairs["height_1"].tolist() == [12.0, 9.0]
    assert pairs["contact_height"].tolist() == [9.0, 6.0]
    assert pairs["position"].tolist() == ["end", "end"]
    assert_allclose(pairs[["longitude_1", "latitude_1"]], [[-67.95, -20.35]] * 2, atol=3e-4)


@pytest.mark.parametrize("name", ["town.gpkg", "town.geojson", "town.shp", "town.fgb"])
def test_every_format_gives_the_same_row(write, name):
    _check_row(pairs_from_footprints(write(ROW, name)).sort_values("pair_id", ignore_index=True))


def test_other_coordinates_give_the_same_row(write):
    to_utm = Transformer.from_crs("OGC:CRS84", "EPSG:32719", always_xy=True)
    utm = shapely.transform(_degrees(ROW), lambda xy: np.column_stack(to_utm.transform(*xy.T)))
    pairs = pairs_from_footprints(write(utm, crs="EPSG:32719", degrees=False))
    _check_row(pairs)
    # would catch distances taken in UTM, whose scale there is 0.9996
    assert_allclose(pairs["gap"][0], 0.25, atol=1e-6)


def test_heights_above_sea_in_the_polygons_do_not_matter(write):
    raised = [
        shapely.force_3d(house, z)
        for house, z in zip(ROW, (3700.0, 3701.0, 3702.0, 3703.0), strict=True)
    ]
    _check_row(pairs_from_footprints(write(raised, kind="Polygon Z")))


def test_azimuth_is_true_north_also_at_the_edge_of_the_layer(write):
    # two towns of one row each at a distance of 2 degrees: grid north is off by 0.35 degrees, in
    # opposite directions
    crs = pyproj.CRS.from_proj4("+proj=tmerc +lon_0=-66.95 +lat_0=-20.35 +datum=WGS84")
    to_degrees = Transformer.from_crs(crs, "OGC:CRS84", always_xy=True)
    east = shapely.transform(
        np.array(ROW[:2]),
        lambda xy: np.column_stack(to_degrees.transform(*np.add(xy, [104e3, 0]).T)),
    )
    west = _degrees(ROW[:2])
    pairs = pairs_from_footprints(write([*west, *east], degrees=False))
    geod = pyproj.Geod(ellps="WGS84")
    for row in pairs.itertuples():
        true = geod.inv(row.longitude_1, row.latitude_1, row.longitude_2, row.latitude_2)[0] % 360
        assert row.azimuth == pytest.approx(true, abs=0.02)


def test_drawn_gaps_and_touching_outlines_are_uncertain(write):
    path = write(ROW)
    pairs = pairs_from_footprints(path, gap_std=0.2)
    assert pairs["gap"].round(6).tolist() == [0.25, 0.0]
    assert pairs["gap_std"].tolist() == [0.2, 0.2]
    assert set(pairs["gap_std_source"]) == {"given"}
    assert pairs_from_footprints(path, gap_std=0.0)["gap_std"].tolist() == [0.0, 0.0]
    # out of the range of the schema
    for wrong in (-0.1, 3.5):
        with pytest.raises(ValueError, match="gap_std"):
            pairs_from_footprints(path, gap_std=wrong)


def test_a_deviation_that_nobody_gave_is_assumed_and_marked_as_derived(write):
    path = write(ROW)
    assumed = pairs_from_footprints(path)
    assert assumed["gap_std"].tolist() == [0.1, 0.1]
    assert set(assumed["gap_std_source"]) == {"assumed"}
    derived = completed_pairs(assumed, Building())["derived"].str.split()
    assert all("gap_std" in names for names in derived)
    given = completed_pairs(pairs_from_footprints(path, gap_std=0.1), Building())["derived"]
    assert not any("gap_std" in names for names in given.str.split())


def test_floors_that_do_not_meet(write):
    pairs = pairs_from_footprints(write(ROW[:2], height=[12.0, 9.0], storeys=[3.0, 3.0]))
    assert (
        pairs["floor_offset"][0] == 1.0
    )  # floors of the taller one at 4, 8, 12 m; roof of the lower at 9 m


def test_storeys_are_enough_and_storey_heights_make_heights(write):
    pairs = pairs_from_footprints(write(ROW[:2], storeys=[3, 4]))
    assert "height_1" not in pairs
    # storeys times their height, unless a height is given
    pairs = pairs_from_footprints(write(ROW[:2], storeys=[3, 4], storey_height=[3.5, 3.0]))
    assert pairs.loc[0, ["height_1", "height_2"]].tolist() == [10.5, 12.0]
    pairs = pairs_from_footprints(write(ROW[:2], height=[9.0, 6.0], storey_height=[3.5, 3.0]))
    assert pairs.loc[0, ["height_1", "height_2"]].tolist() == [9.0, 6.0]


def test_floors_of_28_metres_reject_the_pair(write):
    pairs = pairs_from_footprints(write(ROW[:2], storeys=[2, 2], storey_height=[28.0, 3.0]))
    assert pairs.empty
    (rejection,) = pairs.attrs["rejected"]
    assert rejection.reasons == (
        "height_1 = 56 m with storeys_1 = 2 makes floors of 28 m, outside 2 to 12 m",
    )


def test_unusable_features_are_named_and_the_others_go_on(write):
    bow_tie = shapely.Polygon([(40, 0), (50, 10), (50, 0), (40, 10)])
    features = [*ROW[:2], None, bow_tie, ROW[1], shapely.Polygon()]
    numbers = {"building_id": list("abcdef"), "height": [9.0] * 6}
    pairs = pairs_from_footprints(write(features, **numbers))
    assert pairs["pair_id"].tolist() == ["a/b"]
    # features by their number in the file, reasons without the place of the fault
    reasons = {}
    for rejection in pairs.attrs["rejected"]:
        reasons[rejection.row] = rejection.kind, rejection.reasons[0].split("[")[0]
    assert reasons == {
        3: ("building", "no geometry"),
        4: ("building", "the polygon is invalid: Self-intersection"),
        5: ("building", "the polygon repeats an earlier one"),
        6: ("building", "the geometry is empty"),
    }


def test_repeated_identifiers(write):
    pairs = pairs_from_footprints(
        write(ROW[:3], building_id=[7.0, 8.0, 8.0], height=[9.0, 9.0, 9.0])
    )
    assert pairs["pair_id"].tolist() == ["7/8"]
    (rejection,) = pairs.attrs["rejected"]
    assert rejection[:2] == ("building", "8")
    assert rejection.reasons == ("building_id = '8' occurs in an earlier feature already",)


def test_an_overlap_is_a_reason_and_no_gap(write):
    pairs = pairs_from_footprints(write([ROW[0], shapely.box(8, 0, 20, 12)]))
    assert pairs.empty
    (rejection,) = pairs.attrs["rejected"]
    assert rejection.reasons == ("footprints overlap by 24 m2, 20% of the smaller one",)


def test_lines_among_polygons_are_named(write):
    line = shapely.LineString([(40, 0), (50, 0)])
    pairs = pairs_from_footprints(write([*ROW[:2], line], "town.geojson", kind="Unknown"))
    assert len(pairs) == 1
    assert pairs.attrs["rejected"][0].reasons == ("the geometry is a LineString, not a polygon",)


def test_coordinates_that_are_no_degrees(write):
    pairs = pairs_from_footprints(
        write([*_degrees(ROW[:2]), shapely.box(5e5, 1e6, 5e5 + 9, 1e6 + 9)], degrees=False)
    )
    assert len(pairs) == 1
    (rejection,) = pairs.attrs["rejected"]
    assert "coordinates 500000, 1e+06 lie outside" in rejection.reasons[0]


def test_degrees_in_a_layer_of_metres(write):
    # would catch a feature at the origin of the projection, which makes the town too wide for a
    # local one
    to_utm = Transformer.from_crs("OGC:CRS84", "EPSG:32719", always_xy=True)
    utm = shapely.transform(_degrees(ROW[:2]), lambda xy: np.column_stack(to_utm.transform(*xy.T)))
    pairs = pairs_from_footprints(write([*utm, _degrees(ROW)[2]], crs="EPSG:32719", degrees=False))
    assert len(pairs) == 1
    (rejection,) = pairs.attrs["rejected"]
    assert rejection.reasons == (
        "coordinates -67.9498, -20.35 are degrees, "
        "the layer's coordinate reference system is in metres",
    )


def test_too_few_footprints_say_why(write):
    swapped = shapely.transform(np.array([shapely.box(-99.1, 19.4, -99.0, 19.5)] * 2), np.fliplr)
    with pytest.raises(
        CatalogError,
        match=r"0 usable .*2 rejected, feature 1: coordinates 19.4, -99.1 lie .*swapped\?",
    ):
        pairs_from_footprints(write(swapped, degrees=False))


def test_heights_that_are_none(write):
    houses = [*ROW[:3], shapely.box(30, 0, 40, 12)]
    pairs = pairs_from_footprints(write(houses, height=["9", "nine", "-3", "6"]))
    assert pairs.empty
    reasons = [rejection.reasons for rejection in pairs.attrs["rejected"]]
    none = "none of height_{0}, storeys_{0}, period_{0} is a number, one is needed"
    assert reasons == [
        (f"{none.format(2)}: height_2 = 'nine' is not a number",),
        # every reason of the pair
        (
            "height_2 = -3 m is outside 2 to 1000 m",
            f"{none.format(1)}: height_1 = 'nine' is not a number",
        ),
        ("height_1 = -3 m is outside 2 to 1000 m",),
    ]


#: message -> arguments of a layer that is wrong as a whole
WRONG_LAYERS = {
    "points, not footprints": {
        "polygons": [shapely.Point(0, 0), shapely.Point(1, 1)],
        "kind": "Point",
    },
    "no features": {"polygons": [], "height": np.zeros(0)},
    "no two footprints lie within 3 m": {"polygons": [ROW[0], ROW[3]]},
    "1 usable footprints make no pair": {"polygons": ROW[:1]},
    "no column height, storeys or period": {"polygons": ROW, "colour": ["red"] * 4},
    r"columns found: HEIGHT\), did you mean HEIGHT\?": {"polygons": ROW, "HEIGHT": HEIGHTS},
    "split the layer": {
        "polygons": [shapely.box(0, 0, 1, 1), shapely.box(9, 0, 10, 1)],
        "degrees": False,
    },
}


@pytest.mark.parametrize("message", WRONG_LAYERS)
def test_layers_that_are_wrong_as_a_whole(write, message):
    path = write(**WRONG_LAYERS[message])
    with pytest.raises(CatalogError, match=message) as error:
        pairs_from_footprints(path)
    assert str(error.value).startswith(f"{path}: ")


@pytest.mark.parametrize("distance", [0.0, -1.0, np.nan, 3000.0])
def test_bad_distance(write, distance):
    with pytest.raises(ValueError, match="distance"):
        pairs_from_footprints(write(ROW), distance)


def test_a_synthetic_town_of_ten_thousand(write):
    # 100 streets of 100 houses of 10 m, gaps of 0.4 and 0 m in turn: 99 pairs per street
    column, street = np.meshgrid(np.arange(100), np.arange(100))
    west = column * 10.2 + (column % 2 == 0) * 0.2
    polygons = shapely.box(west, street * 30.0, west + 10, street * 30.0 + 12).ravel()
    pairs = pairs_from_footprints(write(polygons, height=np.full(10_000, 9.0)), distance=1.0)
    assert len(pairs) == 99 * 100
    # one row of gaps per street
    gaps = pairs["gap"].to_numpy().reshape(100, 99)
    assert_allclose(gaps[:, 0::2], 0.0, atol=1e-9)
    assert_allclose(gaps[:, 1::2], 0.4, atol=1e-5)
    assert (pairs["position"] == "inside").sum() == 97 * 100


def _metres(outlines):
    """
    Return outlines in an azimuthal projection.

    The package uses a cylindrical one: both are true to 1e-6 within 5 km.
    """
    projection = "+proj=aeqd +lon_0=-67.93 +lat_0=-20.34 +datum=WGS84"
    to_metres = Transformer.from_crs("OGC:CRS84", projection, always_xy=True)
    return shapely.transform(outlines, lambda xy: np.column_stack(to_metres.transform(*xy.T)))


@pytest.fixture(scope="module")
def made_up(tmp_path_factory):
    """A city of 2 000 houses with every mistake, its pairs, its usable features by number, in m."""
    made, path = city(2000, seed=6), tmp_path_factory.mktemp("city") / "city.gpkg"
    wkb = shapely.to_wkb(made.outlines)
    pyogrio.raw.write(
        path, wkb, [made.storeys], ["storeys"], geometry_type="Polygon", crs="EPSG:4326"
    )
    # the first of equal outlines is used
    seen, usable = set(), {}
    for number, house in enumerate(_metres(made.outlines), start=1):
        degrees = made.outlines[number - 1]
        if house is not None and house.is_valid and degrees.wkb not in seen:
            seen.add(degrees.wkb)
            usable[number] = house
    return made, pairs_from_footprints(path), usable


def _brute_pairs(usable):
    """Return gap and overlap of every pair within 3 m in plain loops over near bounding boxes."""
    tree, numbers = shapely.STRtree(list(usable.values())), list(usable)
    found = {}
    for number, house in usable.items():
        west, south, east, north = house.bounds
        around = shapely.box(west - 4.0, south - 4.0, east + 4.0, north + 4.0)
        # each pair once
        for near in tree.query(around).tolist():
            other = usable[numbers[near]]
            if number < numbers[near] and house.distance(other) <= 3.0:
                overlap = house.intersection(other).area
                found[f"feature {number}/feature {numbers[near]}"] = house.distance(other), overlap
    return found


def _is_overlap(name, area, usable):
    """Return whether a pair overlaps by more than 2 % of the smaller footprint."""
    first, second = (int(feature.split()[1]) for feature in name.split("/"))
    return area > 0.02 * min(usable[first].area, usable[second].area)


def test_a_made_up_city_against_a_count_by_other_code(made_up):
    # would catch pairs that are lost between chunks or in courtyards
    _, pairs, usable = made_up
    found = _brute_pairs(usable)
    overlaps = {name for name, (_, area) in found.items() if _is_overlap(name, area, usable)}
    assert set(pairs["pair_id"]) == found.keys() - overlaps
    rejected = [row for row in pairs.attrs["rejected"] if row.kind == "pair"]
    assert {row.name for row in rejected} == overlaps
    assert all("overlap" in row.reasons[0] for row in rejected)
    # below a millimetre counts as touching; 1e-6 of a block's place in the projections is 1e-5 m of
    # a gap
    gaps = np.array([found[name][0] for name in pairs["pair_id"]])
    assert_allclose(pairs["gap"], np.where(gaps < 1e-3, 0.0, gaps), atol=1e-5)


def test_unusable_features_of_a_made_up_city_are_rejected_by_number(made_up):
    # would catch numbers shifted by rejected features
    made, pairs, usable = made_up
    rejected = {row.row for row in pairs.attrs["rejected"] if row.kind == "building"}
    assert rejected == set(range(1, len(made.outlines) + 1)) - usable.keys()


def test_a_made_up_city_has_what_it_is_to_have(made_up):
    # else the count above would prove little
    _, pairs, usable = made_up
    reasons = " ".join(
        reason for rejection in pairs.attrs["rejected"] for reason in rejection.reasons
    )
    assert len(pairs) > 2000
    assert 0.3 < (pairs["gap"] == 0.0).mean() < 0.9
    for mistake in ("overlap", "invalid", "repeats an earlier one", "no geometry"):
        assert mistake in reasons
    courtyards = sum(len(house.interiors) > 0 for house in usable.values())
    assert courtyards > 50


def _close_pairs(polygons, utm):
    to_metres = Transformer.from_crs("EPSG:4326", f"EPSG:{utm}", always_xy=True)
    metres = shapely.transform(polygons, lambda xy: np.column_stack(to_metres.transform(*xy.T)))
    shapely.prepare(metres)
    return np.triu(shapely.dwithin(metres[:, None], metres[None, :], 3.0), k=1).sum()


# pairs within 3 m as the shared folder's description counts them, every polygon taken as it is
@pytest.mark.real_data
@pytest.mark.parametrize(
    ("city", "expected", "utm"), [("guatemala", 679, 32615), ("san_jose", 1178, 32616)]
)
def test_real_cities(real_data, city, expected, utm):
    path = real_data / "inventories" / "footprints" / f"{city}_pilot_region_all_fields.gpkg"
    pairs = pairs_from_footprints(path)
    rejected = pairs.attrs["rejected"]
    assert checked_pairs(pairs, "pairs").attrs["rejected"] == ()
    assert (pairs["gap"] == 0).mean() > 0.6  # most touch
    unusable = {row.row for row in rejected if row.kind == "building"}
    polygons = shapely.from_wkb(pyogrio.raw.read(path)[2])
    usable = polygons[[number not in unusable for number in range(1, len(polygons) + 1)]]
    # the scale of another projection moves a gap of 3 m by 1 mm: one pair of San Jose is at 3.000 m
    assert abs(_close_pairs(polygons[~shapely.is_missing(polygons)], utm) - expected) <= 1
    counted = len(pairs) + sum(rejection.kind == "pair" for rejection in rejected)
    assert abs(counted - _close_pairs(usable, utm)) <= 1


@pytest.mark.real_data
def test_points_of_berkeley_are_no_footprints(real_data):
    with pytest.raises(
        CatalogError,
        match=r"points have no walls.*an area \(PlanArea\).*add a column wkt .*or width, length",
    ):
        pairs_from_footprints(real_data / "inventories" / "BerkeleyBuildings_full.csv")


def _write_geoparquet(path, polygons, **column):
    described = {"primary_column": "shape", "columns": {"shape": {"encoding": "WKB"} | column}}
    table = pa.table(
        {
            "height": HEIGHTS,
            "storeys": STOREYS,
            "shape": shapely.to_wkb(_degrees(polygons)).tolist(),
        }
    )
    pa.parquet.write_table(table.replace_schema_metadata({"geo": json.dumps(described)}), path)
    return path


def test_geoparquet_gives_the_same_row(tmp_path):
    _check_row(pairs_from_footprints(_write_geoparquet(tmp_path / "town.parquet", ROW)))
