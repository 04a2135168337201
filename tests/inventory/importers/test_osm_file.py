"""
Extracts of OpenStreetMap: a real one of pyogrio's tests, a made one, damaged ones.

Covers per_obspy.inventory.importers.sources.openstreetmap.
"""

from pathlib import Path

import pyogrio
import pytest
import shapely
from building_samples import osm_xml, small_town

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints
from per_obspy.inventory.importers.osm_file import read_osm_file
from per_obspy.inventory.importers.recognition import imported, recognised
from per_obspy.inventory.importers.sources.openstreetmap import tags_of

REAL = Path(pyogrio.__file__).parent / "tests" / "fixtures" / "sample.osm.pbf"


def test_a_real_extract():
    # its nodes are not in the order of their numbers; Greenacres and Friendship House are the only
    # areas with the tag building
    raw = read_osm_file(REAL, "sample")
    assert sorted(raw.attributes["name"]) == ["Friendship House", "Greenacres"]
    assert recognised(raw.attributes.columns).name == "OpenStreetMap"
    assert {geometry.geom_type for geometry in raw.geometries} == {"MultiPolygon"}
    with pytest.raises(CatalogError, match="OpenStreetMap gives none here"):
        imported(raw.attributes, "sample")


def test_a_made_extract(tmp_path):
    town = small_town()
    raw = read_osm_file(osm_xml(tmp_path, town), "town")
    table = imported(raw.attributes, "town")
    assert table["building_id"].tolist() == ["w1000", "w1001", "w1002", "w1003"]
    assert table["storeys"].tolist() == [4.0, 3.0, 2.0, 3.0]
    # seven decimals of a degree
    assert shapely.bounds(raw.geometries) == pytest.approx(shapely.bounds(town.outlines), abs=6e-8)


@pytest.mark.parametrize("content", [b"", b"text", b"<osm>", b"<osm><node id='1'"])
@pytest.mark.parametrize("name", ["a.osm", "a.osm.pbf"])
def test_damaged_files_end_in_one_line(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(CatalogError) as error:
        pairs_from_footprints(tmp_path / name)
    assert "\n" not in str(error.value)


def test_a_cut_extract(tmp_path):
    path = tmp_path / "a.osm.pbf"
    path.write_bytes(REAL.read_bytes()[:4000])
    with pytest.raises(CatalogError):
        pairs_from_footprints(path)


def test_tags_in_hstore_and_hostile_text():
    assert tags_of(r'"name"=>"The \"Old\" House","height"=>"9"')["height"] == "9"
    assert tags_of("{" * 100_000) == {}
    assert tags_of('"' * 100_000) == {}


@pytest.mark.parametrize(("text", "expected"), [("10", 10.0), ("9.5 m", 9.5), ("40 ft", 12.192)])
def test_heights_with_units(tmp_path, text, expected):
    path = osm_xml(tmp_path, small_town())
    path.write_text(path.read_text().replace('v="12.0"', f'v="{text}"'))
    assert pairs_from_footprints(path)["height_1"].tolist()[0] == pytest.approx(expected)


def test_a_height_that_is_none_leaves_the_storeys_to_decide(tmp_path):
    path = osm_xml(tmp_path, small_town())
    text = path.read_text().replace('v="12.0"', 'v="9;12"')
    path.write_text(text)
    pairs = pairs_from_footprints(path)
    assert len(pairs) == 2
    assert pairs["height_1"].isna()[0]
    assert pairs["storeys_1"][0] == 4.0
    assert pairs["cell_notes"].tolist() == ["height_1 = '9;12' is not a number", ""]
    # Without storeys the building has no size
    path.write_text(text.replace('k="building:levels" v="4"', 'k="building:levels" v="1,2"'))
    pairs = pairs_from_footprints(path)
    assert len(pairs) == 1
    (reason,) = pairs.attrs["rejected"][0].reasons
    assert "height_1 = '9;12' is not a number; storeys_1 = '1,2' is not a number" in reason
