"""Lines of GeoJSON features: good ones, broken ones, hostile ones."""

import json

import pytest
import shapely
from building_samples import microsoft, small_town

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints
from per_obspy.inventory.importers import geojson_lines
from per_obspy.inventory.importers.geojson_lines import read_geojson_lines

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


def test_what_is_refused_as_a_whole(tmp_path, monkeypatch):
    path = tmp_path / "a.geojsonl"
    for text in ("", "a letter\n", "\n\n"):
        path.write_text(text)
        with pytest.raises(CatalogError, match="not a file of GeoJSON features"):
            read_geojson_lines(path, "a.geojsonl")
    monkeypatch.setattr(geojson_lines, "MOST_LINES", 3)
    path.write_text(f"{POINT}\n" * 4)
    with pytest.raises(CatalogError, match="more than 3 features"):
        read_geojson_lines(path, "a.geojsonl")


def test_properties_that_appear_late_and_nested_ones(tmp_path):
    late = json.loads(POINT) | {"properties": {"height": 3, "who": {"a": 1}, "big": 1 << 80}}
    path = tmp_path / "a.geojsonl"
    path.write_text(f"{POINT}\n{json.dumps(late)}\n{POINT}\n")
    table = read_geojson_lines(path, "a").attributes
    assert table["height"].isna().tolist() == [True, False, True]
    assert table["who"].tolist()[1] == '{"a": 1}'
    assert table["big"].tolist()[1] == str(1 << 80)
