"""
Layers of footprints: files of another kind, damaged files, layers to choose from.

The files themselves are read by per_obspy.inventory.footprints.layer_files.
"""

import json

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet
import pyogrio
import pytest
import shapely

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints import layers
from per_obspy.inventory.footprints.layers import polygons, read_layer

#: four houses of 1e-4 degrees
HOUSES = [shapely.box(10 + x * 1e-3, 50, 10.0001 + x * 1e-3, 50.0001) for x in range(4)]
HEIGHTS = [12.0, 9.0, 6.0, 3.0]


@pytest.fixture
def write(tmp_path):
    def write(shapes, name="town.gpkg", crs="EPSG:4326", **options):
        path = tmp_path / name
        pyogrio.raw.write(
            path,
            shapely.to_wkb(np.array(shapes, dtype=object)),
            [np.array(HEIGHTS[: len(shapes)])],
            ["height"],
            geometry_type="Polygon",
            crs=crs,
            **options,
        )
        return path

    return write


def _write_geoparquet(path, **column):
    described = {"primary_column": "shape", "columns": {"shape": {"encoding": "WKB"} | column}}
    table = pa.table({"height": HEIGHTS, "shape": shapely.to_wkb(HOUSES).tolist()})
    pa.parquet.write_table(table.replace_schema_metadata({"geo": json.dumps(described)}), path)
    return path


def test_polygons_and_attributes_have_the_number_of_the_feature(write):
    # would catch numbers counted from the features that are left
    layer = read_layer(write([HOUSES[0], None, HOUSES[2]]))
    assert layer.attributes.index.tolist() == [1, 3]
    assert layer.attributes["height"].tolist() == [12.0, 6.0]
    assert [(row.row, row.reasons) for row in layer.rejected] == [(2, ("no geometry",))]
    kept = np.array([HOUSES[0], HOUSES[2]])
    assert shapely.equals_exact(polygons(layer.outlines), kept, 1e-12).all()


def test_blocks_do_not_change_a_layer(write, monkeypatch):
    # would catch numbers and attributes that start anew in every block
    path = write([None, HOUSES[0], HOUSES[1], None])
    whole = read_layer(path)
    monkeypatch.setattr(layers, "BLOCK", 1)
    parts = read_layer(path)
    assert parts.outlines.equals(whole.outlines)
    assert parts.attributes.equals(whole.attributes)
    assert parts.rejected == whole.rejected
    assert [row.row for row in parts.rejected] == [1, 4]


KINDS = {
    "town.gpkg": "GeoPackage",
    "town.geojson": "GeoJSON file",
    "town.shp": "Shapefile",
    "town.fgb": "FlatGeobuf file",
    "town.parquet": "Parquet table",
}


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"Dear colleague,\n", ": "),
        (b"%PDF-1.4\n", ": it is a PDF document$"),
        (b"", ": it is an empty file$"),
    ],
)
def test_files_of_another_kind(tmp_path, name, content, reason):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(CatalogError, match=f"{name}: not a {KINDS[name]}{reason}"):
        read_layer(tmp_path / name)


@pytest.mark.parametrize("name", ["town.gpkg", "town.geojson"])
def test_files_that_were_cut(write, name):
    path = write(HOUSES, name)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(CatalogError, match=f"{name}: not a Geo") as error:
        read_layer(path)
    assert "\n" not in str(error.value)


def test_missing_files_and_unknown_suffixes(write, tmp_path):
    with pytest.raises(CatalogError, match=r"absent\.gpkg: no such file"):
        read_layer(tmp_path / "absent.gpkg")
    (tmp_path / "plan.dwg").touch()
    with pytest.raises(CatalogError, match=r"plan\.dwg: unknown suffix '\.dwg', expected one of"):
        read_layer(tmp_path / "plan.dwg")
    write(HOUSES, "town.shp")
    (tmp_path / "town.prj").unlink()
    with pytest.raises(CatalogError, match=r"town\.shp: no coordinate reference system"):
        read_layer(tmp_path / "town.shp")


def test_damaged_geoparquet(tmp_path):
    path = _write_geoparquet(tmp_path / "town.parquet")
    content = path.read_bytes()
    path.write_bytes(content[:100] + bytes(400) + content[500:])
    with pytest.raises(CatalogError, match=r"town\.parquet: not a Parquet table"):
        read_layer(path)


@pytest.mark.parametrize(
    "geo", ["{", "{}", "[]", '{"primary_column": "x", "columns": {"x": {"encoding": "WKB"}}}']
)
def test_wrong_geoparquet_metadata(tmp_path, geo):
    table = pa.table({"height": HEIGHTS}).replace_schema_metadata({"geo": geo})
    pa.parquet.write_table(table, tmp_path / "town.parquet")
    with pytest.raises(CatalogError, match="wrong GeoParquet metadata"):
        read_layer(tmp_path / "town.parquet")


def test_another_encoding_of_geoparquet(tmp_path):
    path = _write_geoparquet(tmp_path / "town.parquet", encoding="polygon")
    with pytest.raises(CatalogError, match="encoded as 'polygon', expected WKB"):
        read_layer(path)


def test_a_parquet_table_of_pairs_is_no_layer(tmp_path):
    pd.DataFrame({"pair_id": ["a"]}).to_parquet(tmp_path / "pairs.parquet")
    with pytest.raises(CatalogError, match="no GeoParquet metadata"):
        read_layer(tmp_path / "pairs.parquet")


def test_unknown_coordinate_reference_system_of_geoparquet(tmp_path):
    with pytest.raises(CatalogError, match="no coordinate reference system"):
        read_layer(_write_geoparquet(tmp_path / "town.parquet", crs=None))
    with pytest.raises(CatalogError, match="unknown coordinate reference system 'EPSG:1'"):
        read_layer(_write_geoparquet(tmp_path / "town.parquet", crs="EPSG:1"))


def test_several_layers_need_a_name(write):
    path = write(HOUSES, layer="old_town")
    write(HOUSES[:2], layer="new_town", crs="EPSG:4258", append=True)
    with pytest.raises(CatalogError, match="several layers, name one: old_town, new_town"):
        read_layer(path)
    with pytest.raises(
        CatalogError, match=r"no layer 'harbour' \(layers found: old_town, new_town\)"
    ):
        read_layer(path, "harbour")
    assert len(read_layer(path, "new_town").outlines) == 2


#: A name that no database has, one of heights, one from the centre of the Earth, one of the Moon.
SYSTEMS = [
    ("EPSG:999999", "unknown coordinate reference system 'EPSG:999999'"),
    ("junk", "unknown coordinate reference system 'junk'"),
    ("EPSG:5703", "coordinate reference system 'NAVD88 height' is of another kind"),
    ("EPSG:4978", "coordinate reference system 'WGS 84' is of another kind"),
    ("IAU_2015:30100", "cannot be turned into WGS 84"),
]


@pytest.mark.parametrize(("crs", "problem"), SYSTEMS)
def test_reference_systems_without_places_on_the_earth(tmp_path, crs, problem):
    with pytest.raises(CatalogError, match=problem) as error:
        read_layer(_write_geoparquet(tmp_path / "town.parquet", crs=crs))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("declared", "problem"),
    [
        ({"type": "name", "properties": {"name": "EPSG:999999"}}, "unknown .* 'EPSG:999999'"),
        ({"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::999999"}}, "unknown"),
        ({"type": "EPSG", "properties": {"code": 999999}}, "unknown .* 'EPSG:999999'"),
        ({"type": "link", "properties": {"href": "http://127.0.0.1/"}}, "unknown"),
        ("junk", "unknown"),
    ],
)
def test_an_unknown_system_of_geojson_is_not_taken_for_degrees(write, declared, problem):
    # GDAL takes WGS 84 then: would catch footprints elsewhere
    path = write(HOUSES, "town.geojson")
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {"crs": declared}))
    with pytest.raises(CatalogError, match=problem):
        read_layer(path)
    known = {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
    path.write_text(json.dumps(content | {"crs": known}))
    assert len(read_layer(path).outlines) == len(HOUSES)


def test_the_system_of_geojson_stands_anywhere_at_its_top(write):
    path = write(HOUSES, "town.geojson")
    content = json.loads(path.read_text())
    content.pop("crs", None)
    unknown = {"type": "name", "properties": {"name": "EPSG:999999"}}
    # after the features, as JSON has no order
    path.write_text(json.dumps(content | {"crs": unknown}))
    with pytest.raises(CatalogError, match="unknown"):
        read_layer(path)
    # inside of another member it is none of the layer
    path.write_text(json.dumps({"metadata": {"crs": unknown}} | content))
    assert len(read_layer(path).outlines) == len(HOUSES)


def test_a_column_that_stands_twice(tmp_path):
    path = _write_geoparquet(tmp_path / "town.parquet")
    table = pa.parquet.read_table(path)
    pa.parquet.write_table(table.append_column("height", table["height"]), path)
    with pytest.raises(CatalogError, match=r"Multiple matches for .*height"):
        read_layer(path)
    # FlatGeobuf may repeat a name as well
    path, columns = tmp_path / "town.fgb", [np.array(HEIGHTS)] * 2
    wkb, kind = shapely.to_wkb(np.array(HOUSES)), "Polygon"
    names = ["height", "height"]
    pyogrio.raw.write(path, wkb, columns, names, geometry_type=kind, crs="EPSG:4326")
    with pytest.raises(CatalogError, match=r"town\.fgb: column height occurs more than once"):
        read_layer(path)


@pytest.mark.parametrize("prj", ["junk", "", "GEOGCS[", 'LOCAL_CS["site"]'])
def test_a_projection_file_that_is_none(write, prj):
    path = write(HOUSES, "town.shp")
    path.with_suffix(".prj").write_text(prj)
    with pytest.raises(CatalogError, match=r"town\.shp: .*(reference system|not a Shapefile)"):
        read_layer(path)


def test_text_of_geoparquet_that_is_not_utf_8(tmp_path):
    path = _write_geoparquet(tmp_path / "town.parquet")
    table = pa.parquet.read_table(path)
    text = pa.array([b"\xff"] * 4, pa.binary()).view(pa.string())
    pa.parquet.write_table(table.append_column("building_id", text), path)
    with pytest.raises(CatalogError, match="feature 1: building_id is not UTF-8"):
        read_layer(path)
