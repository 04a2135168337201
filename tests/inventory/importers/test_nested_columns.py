"""Nested columns of GeoParquet files."""

import json

import pyarrow as pa
from building_samples import overture, small_town

from per_obspy.inventory.footprints.layer_files import read_raw_layer
from per_obspy.inventory.importers.nested_columns import without_nesting


def test_names_sources_and_boxes_of_overture(tmp_path):
    attributes = read_raw_layer(overture(tmp_path, small_town()), None).attributes.to_pandas()
    assert attributes["names"].fillna("").tolist() == ["House", "", "", ""]
    assert attributes["sources"].tolist() == ["OpenStreetMap"] * 4
    assert "bbox" not in attributes


def test_maps_become_json_and_other_columns_stay():
    kind = pa.map_(pa.string(), pa.string())
    tags = pa.array([[("height", "9")], None, []], kind)
    table = pa.table({"tags": tags, "names": ["a", "b", None], "list": [[1], [], None]})
    plain = without_nesting(table)
    texts = plain["tags"].to_pylist()
    assert json.loads(texts[0]) == {"height": "9"}
    assert texts[1:] == [None, "{}"]
    assert plain["names"].to_pylist() == ["a", "b", None]
    assert plain["list"].to_pylist() == [[1], [], None]


def test_a_source_without_rows_and_another_structure():
    source = pa.list_(pa.struct({"dataset": pa.string()}))
    table = pa.table({"sources": pa.array([[], None, [{"dataset": None}]], source)})
    assert without_nesting(table)["sources"].to_pylist() == [None, None, None]
    table = pa.table({"sources": pa.array([[1], None])})
    assert without_nesting(table)["sources"].to_pylist() == [None, None]
