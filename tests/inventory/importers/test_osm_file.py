"""
Extracts of OpenStreetMap: a real one of pyogrio's tests, a made one, damaged ones.

Covers per_obspy.inventory.importers.sources.openstreetmap.
"""

from pathlib import Path

import pandas as pd
import pyogrio
import pytest
import shapely
from building_samples import osm_xml, small_town

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.layers import raw_layer
from per_obspy.inventory.importers.recognition import imported, recognised
from per_obspy.inventory.importers.sources.openstreetmap import adapted, tags_of

REAL = Path(pyogrio.__file__).parent / "tests" / "fixtures" / "sample.osm.pbf"


def test_a_real_extract():
    # its nodes are not in the order of their numbers; Greenacres and Friendship House are the only
    # areas with the tag building
    raw = raw_layer(REAL)
    assert sorted(raw.attributes["name"]) == ["Friendship House", "Greenacres"]
    assert recognised(raw.attributes.columns).name == "OpenStreetMap"
    assert {geometry.geom_type for geometry in raw.geometries} == {"MultiPolygon"}
    with pytest.raises(CatalogError, match="OpenStreetMap gives none here"):
        imported(raw.attributes, "sample")


def test_a_made_extract(tmp_path):
    town = small_town()
    raw = raw_layer(osm_xml(tmp_path, town))
    table = imported(raw.attributes, "town")
    assert table["building_id"].tolist() == ["w1000", "w1001", "w1002", "w1003"]
    assert table["storeys"].tolist() == ["4", "3", "2", "3"]
    # seven decimals of a degree
    assert shapely.bounds(raw.geometries) == pytest.approx(shapely.bounds(town.outlines), abs=6e-8)


@pytest.mark.parametrize("content", [b"", b"text", b"<osm>", b"<osm><node id='1'"])
@pytest.mark.parametrize("name", ["a.osm", "a.osm.pbf"])
def test_damaged_files_end_in_one_line(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(CatalogError) as error:
        imported(raw_layer(tmp_path / name).attributes, name)
    assert "\n" not in str(error.value)


def test_a_cut_extract(tmp_path):
    path = tmp_path / "a.osm.pbf"
    path.write_bytes(REAL.read_bytes()[:4000])
    with pytest.raises(CatalogError):
        imported(raw_layer(path).attributes, "a")


def test_tags_in_hstore_and_hostile_text():
    assert tags_of(r'"name"=>"The \"Old\" House","height"=>"9"')["height"] == "9"
    assert tags_of("{" * 100_000) == {}
    assert tags_of('"' * 100_000) == {}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("9", "9"), ("9.5 m", 9.5), ("20 ft", 6.096), ("7'4\"", 2.2352), ("7'", 2.1336),
        ("~9", "~9"), ("9;12", "9;12"), ("9,5", "9,5"), ("nan", "nan"), ("1e9", "1e9"),
    ],
)  # fmt: skip
def test_heights_with_units(text, expected):
    # what is not understood stays text, which the checks of pairs reject with the text
    table = adapted(pd.DataFrame({"height": [text], "building:levels": ["3"]}))
    assert table["height"].tolist()[0] == pytest.approx(expected)
