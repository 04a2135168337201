"""Buildings as JSON: lines of features and assets of SimCenter, broken and hostile ones."""

import json

import numpy as np
import pytest
import shapely
from building_samples import (
    brails_geojson,
    geometries,
    microsoft,
    r2d_assets,
    simcenter_csv,
    small_town,
)

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints import json_buildings
from per_obspy.inventory.footprints.building_columns import schema_columns
from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints
from per_obspy.inventory.footprints.json_buildings import (
    is_asset_json,
    read_asset_json,
    read_geojson_lines,
)

POINT = '{"type": "Feature", "geometry": {"type": "Point", "coordinates": [20, 10]}}'


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("{", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ('{"a": ' * 50_000 + "1" + "}" * 50_000, "not JSON"),
        ("9" * 5000, "not JSON"),
        ('{"type": "FeatureCollection", "features": []}', "not a GeoJSON feature"),
        (
            '{"type": "Feature", "geometry": {"type": "Polygon", "coordinates": 3}}',
            "not a geometry",
        ),
        ('{"type": "Feature", "geometry": {"type": "Polygon"}}', "not a geometry"),
        ('{"type": "Feature", "geometry": [1, 2]}', "not a geometry"),
        ('{"type": "Feature", "properties": {"height": 9}}', "no geometry"),
        (POINT, "is a Point, not a polygon"),
        (POINT.replace("20, 10", "1e999, 10"), "not a geometry|outside|not a polygon"),
        ('{"a": "' + "x" * (1 << 21) + '"}', "longer than 1048576 bytes"),
    ],
)
def test_a_broken_line_loses_its_own_building(tmp_path, line, reason):
    path = microsoft(tmp_path, small_town())
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0], line, "", *lines[1:]]))
    pairs = pairs_from_footprints(path)
    assert len(pairs) == 2
    rejected = [row for row in pairs.attrs["rejected"] if row.kind == "building"]
    assert [row.row for row in rejected] == [2]
    assert any(word in rejected[0].reasons[0] for word in reason.split("|")), rejected


def test_what_is_refused_as_a_whole(tmp_path, monkeypatch):
    path = tmp_path / "a.geojsonl"
    for text in ("", "a letter\n", "\n\n"):
        path.write_text(text)
        with pytest.raises(CatalogError, match="not a file of GeoJSON features"):
            read_geojson_lines(path, "a.geojsonl")
    monkeypatch.setattr(json_buildings, "MOST_LINES", 3)
    path.write_text(f"{POINT}\n" * 4)
    with pytest.raises(CatalogError, match="more than 3 features"):
        read_geojson_lines(path, "a.geojsonl")


def test_properties_that_appear_late_and_nested_ones(tmp_path):
    late = json.loads(POINT) | {"properties": {"height": 3, "who": {"a": 1}, "big": 1 << 80}}
    path = tmp_path / "a.geojsonl"
    path.write_text(f"{POINT}\n{json.dumps(late)}\n{POINT}\n")
    table = read_geojson_lines(path, "a").attributes.to_pandas()
    assert table["height"].isna().tolist() == [True, False, True]
    assert table["who"].tolist()[1] == '{"a": 1}'
    assert table["big"].tolist()[1] == str(1 << 80)


def test_heights_are_in_the_unit_of_the_file(tmp_path):
    path = brails_geojson(tmp_path, small_town())
    content = json.loads(path.read_text())
    heights = {}
    for unit in ("ft", "m", "furlong", None):
        path.write_text(json.dumps(content | {"units": {"length": unit}}))
        table = schema_columns(read_asset_json(path, "a").attributes.to_pandas(), "a")
        heights[unit] = table["height"].tolist()[0]
    assert heights["ft"] == pytest.approx(12.0)
    assert heights["m"] == pytest.approx(12.0 / 0.3048)
    # a unit that is unknown makes a height unknown; the storeys remain
    assert np.isnan(heights["furlong"])
    assert np.isnan(heights[None])


def test_building_types_of_hazus(tmp_path):
    path = r2d_assets(tmp_path, small_town())
    text = path.read_text()
    for code, system in (
        ("C1", "concrete_mrf"),
        ("S1M", "steel_mrf"),
        ("URML", "masonry"),
        ("RM1M", "reinforced_masonry"),
        ("W1", "other"),
        ("?", ""),
    ):
        path.write_text(text.replace('"StructureType": "C1"', f'"StructureType": "{code}"'))
        table = schema_columns(read_asset_json(path, "a").attributes.to_pandas(), "a")
        assert table["system"].tolist()[0] == system


def test_a_single_asset_and_one_without_outline(tmp_path):
    assets = json.loads(r2d_assets(tmp_path, small_town()).read_text())
    path = tmp_path / "one.json"
    path.write_text(json.dumps(assets[0]))
    assert is_asset_json(path.read_bytes())
    assert geometries(read_asset_json(path, "one"))[0].geom_type == "Polygon"
    del assets[0]["GeneralInformation"]["Footprint"]
    path.write_text(json.dumps(assets[0]))
    assert geometries(read_asset_json(path, "one"))[0].geom_type == "Point"


@pytest.mark.parametrize(
    ("footprint", "reason"),
    [
        ("{", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ("3", "not a geometry"),
        ('{"type": "Polygon", "coordinates": [[["a", 1]]]}', "not a geometry"),
    ],
)
@pytest.mark.parametrize("write", [r2d_assets, simcenter_csv])
def test_a_broken_outline_loses_its_own_building(tmp_path, write, footprint, reason):
    path = write(tmp_path, small_town())
    if path.suffix == ".json":
        assets = json.loads(path.read_text())
        assets[3]["GeneralInformation"]["Footprint"] = footprint
        path.write_text(json.dumps(assets))
    else:
        lines = path.read_text().splitlines()
        cell = footprint.replace('"', '""')
        lines[4] = lines[4].split('"{')[0] + f'"{cell}"'
        path.write_text("\n".join(lines))
    pairs = pairs_from_footprints(path)
    assert len(pairs) == 2
    (rejected,) = pairs.attrs["rejected"]
    # the line of a table, the number of an asset
    assert (rejected.row, rejected.kind) == (4 + (path.suffix == ".csv"), "building")
    assert any(word in rejected.reasons[0] for word in (reason, "no polygon as WKT or GeoJSON"))


@pytest.mark.parametrize(
    "text",
    [
        '{"GeneralInformation": ',
        '{"GeneralInformation": ' + "[" * 100_000,
        '{"GeneralInformation": ' + "9" * 5000 + "}",
        '["GeneralInformation", 3]',
        '{"GeneralInformation": 3}',
        '{"features": {"GeneralInformation": 3}}',
        '{"features": [], "GeneralInformation": 3}',
    ],
)
def test_damaged_files_end_in_one_line(tmp_path, text):
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(CatalogError) as error:
        pairs_from_footprints(path)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 1200


def test_too_large_a_file_is_refused_unread(tmp_path, monkeypatch):
    monkeypatch.setattr(json_buildings, "LARGEST_ASSETS", 1 << 10)
    with pytest.raises(CatalogError, match="split the file"):
        read_asset_json(r2d_assets(tmp_path, small_town()), "a")


def test_coordinates_in_metres_are_outside_of_degrees(tmp_path):
    town = small_town()
    outlines = shapely.transform(town.outlines, lambda xy: xy * 1e5)
    with pytest.raises(CatalogError, match=r"0 usable footprints.*lie outside"):
        pairs_from_footprints(microsoft(tmp_path, town._replace(outlines=outlines)))


def test_a_height_of_minus_one_is_unknown(tmp_path):
    town = small_town()
    path = microsoft(tmp_path, town._replace(heights=[12.0, -1.0, 6.0, 9.0]))
    pairs = pairs_from_footprints(path)
    # too few buildings for an estimate: both pairs of the second building are rejected
    assert pairs.empty
    reasons = {reason for row in pairs.attrs["rejected"] for reason in row.reasons}
    assert any("one is needed" in reason for reason in reasons)
