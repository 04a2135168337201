"""Packed files, extracts of OpenStreetMap and nested columns of GeoParquet."""

import gzip
import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pyogrio
import pytest
import shapely
from building_samples import (
    geometries,
    google,
    microsoft_packed,
    osm_geoparquet,
    osm_xml,
    overture,
    small_town,
)

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints import layer_files
from per_obspy.inventory.footprints.building_columns import schema_columns
from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints
from per_obspy.inventory.footprints.layer_files import read_raw_layer
from per_obspy.inventory.footprints.sources import source_of, tags_of

REAL = Path(pyogrio.__file__).parent / "tests" / "fixtures" / "sample.osm.pbf"


def test_a_bomb_is_refused_before_it_fills_the_disk(tmp_path, monkeypatch):
    monkeypatch.setattr(layer_files, "LARGEST", 1 << 20)
    path = tmp_path / "a.csv.gz"
    path.write_bytes(gzip.compress(bytes(1 << 24)))
    with pytest.raises(CatalogError, match=r"a\.csv\.gz: it has more than .* split the file"):
        layer_files._read(path, None, None, None)


def test_a_bomb_is_refused_by_its_ratio(tmp_path):
    path = tmp_path / "a.csv.gz"
    path.write_bytes(gzip.compress(b"wkt,height\n" + b"0" * (100 << 20)))
    with pytest.raises(CatalogError, match=r"a\.csv\.gz: it unpacks to more than 200 times"):
        pairs_from_footprints(path)


@pytest.mark.parametrize("damage", [lambda b: b[: len(b) // 2], lambda b: b"x" + b, lambda _: b""])
def test_damaged_packing(tmp_path, damage):
    path = microsoft_packed(tmp_path, small_town())
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(CatalogError, match=r"microsoft\.csv\.gz: not ") as error:
        pairs_from_footprints(path)
    assert "\n" not in str(error.value)


def test_other_packed_files_are_refused(tmp_path):
    path = tmp_path / "town.gpkg.gz"
    path.write_bytes(gzip.compress(b"text"))
    with pytest.raises(CatalogError, match=r"unknown suffix 'town\.gpkg\.gz', expected \.csv\.gz"):
        pairs_from_footprints(path)


def test_a_real_extract():
    # its nodes are not in the order of their numbers; Greenacres and Friendship House are the only
    # areas with the tag building
    raw = read_raw_layer(REAL, None)
    assert sorted(raw.attributes["name"].to_pylist()) == ["Friendship House", "Greenacres"]
    assert source_of(raw.attributes.column_names).name == "OpenStreetMap"
    assert {geometry.geom_type for geometry in geometries(raw)} == {"MultiPolygon"}
    with pytest.raises(CatalogError, match="OpenStreetMap gives none here"):
        schema_columns(raw.attributes.to_pandas(), "sample")


def test_a_made_extract(tmp_path):
    town = small_town()
    raw = read_raw_layer(osm_xml(tmp_path, town), None)
    table = schema_columns(raw.attributes.to_pandas(), "town")
    assert table["building_id"].tolist() == ["w1000", "w1001", "w1002", "w1003"]
    assert table["storeys"].tolist() == [4.0, 3.0, 2.0, 3.0]
    # seven decimals of a degree
    assert shapely.bounds(geometries(raw)) == pytest.approx(shapely.bounds(town.outlines), abs=6e-8)


@pytest.mark.parametrize("content", [b"", b"text", b"<osm>", b"<osm><node id='1'"])
@pytest.mark.parametrize("name", ["a.osm", "a.osm.pbf"])
def test_damaged_files_end_in_one_line(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(CatalogError) as error:
        pairs_from_footprints(tmp_path / name)
    assert "\n" not in str(error.value)


def test_tags_in_hstore_and_hostile_text():
    assert tags_of(r'"name"=>"The \"Old\" House","height"=>"9"')["height"] == "9"
    assert tags_of("{" * 100_000) == {}
    assert tags_of('"' * 100_000) == {}


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


def test_names_sources_and_boxes_of_overture(tmp_path):
    attributes = read_raw_layer(overture(tmp_path, small_town()), None).attributes.to_pandas()
    assert attributes["names"].fillna("").tolist() == ["House", "", "", ""]
    assert attributes["sources"].tolist() == ["OpenStreetMap"] * 4
    assert "bbox" not in attributes


def test_a_box_keeps_the_buildings_that_touch_it(tmp_path):
    # would catch a box that cuts buildings off, and one that is passed over
    town = small_town()
    path = overture(tmp_path, town)
    west, south, east, north = shapely.bounds(town.outlines[1])
    inside = shapely.intersects(town.outlines, shapely.box(west, south, east, north))
    raw = read_raw_layer(path, None, (west, south, east, north))
    assert 0 < inside.sum() < len(inside)
    assert raw.attributes["id"].to_pylist() == np.array(town.names)[inside].tolist()
    whole = read_raw_layer(path, None, (-180.0, -90.0, 180.0, 90.0))
    assert whole.attributes.equals(read_raw_layer(path, None).attributes)
    with pytest.raises(CatalogError, match=r"no building touches the box 0\.0,0\.0,0\.001"):
        read_raw_layer(path, None, (0.0, 0.0, 1e-3, 1e-3))


@pytest.mark.parametrize("unknown", [None, {"xmin": None, "xmax": None}])
def test_a_building_of_unknown_box_is_kept(tmp_path, unknown):
    # would catch neighbours that are lost without a word
    town = small_town()
    path = overture(tmp_path, town)
    table = pa.parquet.read_table(path)
    at, field = table.column_names.index("bbox"), table.schema.field("bbox")
    boxes = [unknown and {**unknown, "ymin": -90.0, "ymax": 90.0}, *table["bbox"].to_pylist()[1:]]
    pa.parquet.write_table(table.set_column(at, field, pa.array(boxes, field.type)), path)
    raw = read_raw_layer(path, None, tuple(shapely.bounds(town.outlines[1])))
    assert town.names[0] in raw.attributes["id"].to_pylist()
    # Text is no box
    texts = pa.array([{"xmin": "1", "xmax": "2", "ymin": "3", "ymax": "4"}] * len(boxes))
    pa.parquet.write_table(table.set_column(at, "bbox", texts), path)
    with pytest.raises(CatalogError, match="a box needs a column bbox with numbers"):
        read_raw_layer(path, None, (-180.0, -90.0, 180.0, 90.0))


def test_a_box_needs_degrees_and_a_column_of_boxes(tmp_path):
    box = (-180.0, -90.0, 180.0, 90.0)
    town = small_town()
    with pytest.raises(CatalogError, match="a box needs a column bbox"):
        read_raw_layer(osm_geoparquet(tmp_path, town), None, box)
    with pytest.raises(CatalogError, match="a box needs GeoParquet"):
        read_raw_layer(osm_xml(tmp_path, town), None, box)
    path = overture(tmp_path, town)
    table = pa.parquet.read_table(path)
    geo = json.loads(table.schema.metadata[b"geo"])
    geo["columns"]["geometry"]["crs"] = "EPSG:32719"
    pa.parquet.write_table(table.replace_schema_metadata({"geo": json.dumps(geo)}), path)
    with pytest.raises(CatalogError, match="outlines in longitude and latitude"):
        read_raw_layer(path, None, box)


def test_maps_become_json_and_other_columns_stay():
    kind = pa.map_(pa.string(), pa.string())
    tags = pa.array([[("height", "9")], None, []], kind)
    table = pa.table({"tags": tags, "names": ["a", "b", None], "list": [[1], [], None]})
    plain = layer_files._without_nesting(table)
    texts = plain["tags"].to_pylist()
    assert json.loads(texts[0]) == {"height": "9"}
    assert texts[1:] == [None, "{}"]
    assert plain["names"].to_pylist() == ["a", "b", None]
    assert plain["list"].to_pylist() == [[1], [], None]


def test_a_source_without_rows_and_another_structure():
    source = pa.list_(pa.struct({"dataset": pa.string()}))
    table = pa.table({"sources": pa.array([[], None, [{"dataset": None}]], source)})
    assert layer_files._without_nesting(table)["sources"].to_pylist() == [None, None, None]
    table = pa.table({"sources": pa.array([[1], None])})
    assert layer_files._without_nesting(table)["sources"].to_pylist() == [None, None]


def test_packed_csv_of_google(tmp_path):
    path = google(tmp_path, small_town())
    packed = tmp_path / "0c5_buildings.csv.gz"
    packed.write_bytes(gzip.compress(path.read_bytes()))
    assert len(pairs_from_footprints(packed)) == 2


def test_a_cut_extract(tmp_path):
    path = tmp_path / "a.osm.pbf"
    path.write_bytes(REAL.read_bytes()[:4000])
    with pytest.raises(CatalogError):
        pairs_from_footprints(path)


@pytest.mark.parametrize(("text", "expected"), [("10", 10.0), ("9.5 m", 9.5), ("40 ft", 12.192)])
def test_heights_with_units(tmp_path, text, expected):
    path = osm_xml(tmp_path, small_town())
    path.write_text(path.read_text().replace('v="12.0"', f'v="{text}"'))
    assert pairs_from_footprints(path)["height_1"].tolist()[0] == pytest.approx(expected)
