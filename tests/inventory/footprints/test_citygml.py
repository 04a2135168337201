"""City models: outlines by level of detail, order of axes, units; hostile documents."""

import numpy as np
import pytest
import shapely
from building_samples import (
    geometries,
    gml_building,
    gml_document,
    gml_polygon,
    gml_walls,
    plateau_lod0,
    plateau_lod1,
    small_town,
)

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.building_columns import schema_columns
from per_obspy.inventory.footprints.citygml import read_citygml

HOUSE = shapely.box(139.7, 35.5, 139.7001, 35.5001)


def _read(tmp_path, text):
    path = tmp_path / "town.gml"
    path.write_text(text, encoding="utf-8")
    return read_citygml(path, "town.gml")


def _lod0(polygon=HOUSE, element="lod0RoofEdge"):
    multi = f"<gml:MultiSurface>{gml_polygon(polygon, 9.0)}</gml:MultiSurface>"
    return f"<bldg:{element}>{multi}</bldg:{element}>"


def test_latitude_comes_first_and_both_levels_give_one_outline(tmp_path):
    town = small_town()
    for write in (plateau_lod0, plateau_lod1):
        raw = read_citygml(write(tmp_path, town), "town.gml")
        # would catch axes taken as longitude, latitude
        assert shapely.bounds(geometries(raw)) == pytest.approx(shapely.bounds(town.outlines))
        assert raw.crs.to_epsg() == 6668  # the horizontal part of EPSG:6697
        assert (
            shapely.symmetric_difference(geometries(raw), town.outlines).tolist()
            == [shapely.Polygon()] * 4
        )


def test_attributes_and_values_that_mean_unknown(tmp_path):
    known = gml_building("bldg_1", 9.5, 3, _lod0())
    unknown = gml_building("bldg_2", -9999, 9999, _lod0(shapely.box(139.71, 35.5, 139.7101, 35.6)))
    raw = _read(tmp_path, gml_document(known + unknown))
    table = schema_columns(raw.attributes.to_pandas(), "town.gml")
    assert table["building_id"].tolist() == ["bldg_1", "bldg_2"]
    assert table["height"].tolist()[0] == 9.5
    assert table["storeys"].tolist()[0] == 3
    assert np.isnan(table["height"].tolist()[1])
    assert np.isnan(table["storeys"].tolist()[1])
    assert table["usage"].tolist() == ["411", "411"]
    assert table["address"].tolist()[0] == "丁目"
    assert table["structure_type"].tolist()[0] == "603"


def test_the_footprint_of_walls_comes_before_the_edge_of_the_roof(tmp_path):
    wide = shapely.box(139.7, 35.5, 139.7002, 35.5001)
    both = _lod0(wide) + _lod0(HOUSE, "lod0FootPrint")
    raw = _read(tmp_path, gml_document(gml_building("a", 9, 3, both)))
    assert geometries(raw)[0].equals(HOUSE)
    assert raw.attributes["outline"].to_pylist() == ["lod0FootPrint"]


def test_a_block_with_a_lower_wing_is_seen_from_above(tmp_path):
    # roof surfaces at two heights and a common floor: the outline is their union
    wing = shapely.box(139.7001, 35.5, 139.7002, 35.5001)
    surfaces = gml_polygon(HOUSE, 20.0) + gml_polygon(wing, 10.0)
    surfaces += gml_walls(HOUSE, 3.0, 20.0) + gml_walls(wing, 3.0, 10.0)
    solid = f"<bldg:lod1Solid><gml:Solid>{surfaces}</gml:Solid></bldg:lod1Solid>"
    raw = _read(tmp_path, gml_document(gml_building("a", 9, 3, solid)))
    assert geometries(raw)[0].equals(shapely.union(HOUSE, wing))


def test_parts_give_outline_and_height_to_a_building_without(tmp_path):
    part = (
        '<bldg:consistsOfBuildingPart><bldg:BuildingPart gml:id="p">'
        f'<bldg:measuredHeight uom="m">7.0</bldg:measuredHeight>{_lod0()}'
        "</bldg:BuildingPart></bldg:consistsOfBuildingPart>"
    )
    member = f'<bldg:Building gml:id="whole">{part}</bldg:Building>'
    raw = _read(tmp_path, gml_document(member))
    assert raw.attributes["id"].to_pylist() == ["whole"]
    assert raw.attributes["measuredHeight"].to_pylist() == [7.0]
    assert geometries(raw)[0].equals(HOUSE)


def test_projected_systems_and_the_older_order_of_short_names(tmp_path):
    metres = shapely.box(350000.0, 5500000.0, 350010.0, 5500010.0)
    # the helper writes the second coordinate first
    flipped = shapely.transform(metres, np.fliplr)
    text = gml_document(gml_building("a", 9, 3, _lod0(flipped)), "EPSG:25832")
    raw = _read(tmp_path, text)
    assert raw.crs.to_epsg() == 25832
    assert geometries(raw)[0].equals(metres)
    urn = gml_document(gml_building("a", 9, 3, _lod0(flipped)), "urn:ogc:def:crs:EPSG::25832")
    assert geometries(_read(tmp_path, urn))[0].equals(metres)


def test_feet_are_converted_and_unknown_units_fault_the_building(tmp_path):
    house = gml_building("a", 30, 3, _lod0())
    feet = _read(tmp_path, gml_document(house.replace('uom="m"', 'uom="ft"')))
    assert feet.attributes["measuredHeight"].to_pylist() == [pytest.approx(9.144)]
    other = _read(tmp_path, gml_document(house.replace('uom="m"', 'uom="ell"')))
    assert "unit 'ell'" in other.faults[0]


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("35.5 139.7 9.0", "35.5 139.7", "not a multiple of 3"),
        ("35.5 139.7 9.0", "35.5 nought 9.0", "could not convert"),
        ("35.5 139.7 9.0", "1e999 nan 9.0", "not finite"),
    ],
)
def test_a_wrong_ring_faults_its_building_alone(tmp_path, old, new, fault):
    wrong = gml_building("a", 9, 3, _lod0()).replace(old, new, 1)
    good = gml_building("b", 9, 3, _lod0(shapely.box(139.71, 35.5, 139.7101, 35.6)))
    raw = _read(tmp_path, gml_document(wrong + good))
    assert fault in raw.faults.get(0, "")
    assert 1 not in raw.faults
    assert geometries(raw)[1] is not None


BOMB = (
    '<!DOCTYPE lolz [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">'
    '<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]>'
)
FILE = '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]>'
AWAY = '<!DOCTYPE x SYSTEM "http://127.0.0.1:9/evil.dtd">'


@pytest.mark.parametrize("kind", [BOMB, FILE, AWAY], ids=["bomb", "file", "address"])
def test_type_definitions_are_refused(tmp_path, kind):
    text = gml_document(gml_building("&a;", 9, 3, _lod0()).replace("丁目", "&a;"))
    with pytest.raises(CatalogError, match=r"type definition|not a CityGML file"):
        _read(tmp_path, text.replace("\n", f"\n{kind}\n", 1))
    plain = gml_document(gml_building("a", 9, 3, _lod0()))
    with pytest.raises(CatalogError, match="type definition"):
        _read(tmp_path, plain.replace("\n", f"\n{kind}\n", 1))


def test_depth_and_text_beyond_the_limits_of_the_parser(tmp_path):
    deep = "<a>" * 5000 + "</a>" * 5000
    with pytest.raises(CatalogError, match="not a CityGML file"):
        _read(tmp_path, gml_document(deep))
    long = gml_building("a", 9, 3, _lod0()).replace("丁目", "x" * 11_000_000)
    with pytest.raises(CatalogError, match="not a CityGML file") as error:
        _read(tmp_path, gml_document(long))
    assert len(str(error.value)) < 1000


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "not a CityGML file"),
        ("<html><body>Not found</body></html>", "no bldg:Building"),
        (gml_document("<bldg:x/>"), "no bldg:Building"),
        (gml_document(gml_building("a", 9, 3, _lod0()), ""), "no coordinate reference system"),
        (gml_document(gml_building("a", 9, 3, _lod0()), "EPSG:999999"), "unknown coordinate"),
        (
            gml_document(gml_building("a", 9, 3, '<gml:Envelope srsName="EPSG:25832"/>' + _lod0())),
            "two reference systems",
        ),
        (
            gml_document(gml_building("a", 9, 3, _lod0())).replace("building/2.0", "building/3.0"),
            "CityGML 3.0 is not read",
        ),
    ],
)
def test_what_is_refused_as_a_whole(tmp_path, text, problem):
    with pytest.raises(CatalogError, match=problem) as error:
        _read(tmp_path, text)
    assert "\n" not in str(error.value)


def test_a_building_without_outline_has_no_geometry(tmp_path):
    raw = _read(tmp_path, gml_document(gml_building("a", 9, 3, "")))
    assert geometries(raw).tolist() == [None]
