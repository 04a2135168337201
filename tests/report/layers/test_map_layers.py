"""
Layers read back by GDAL and by SQLite, which shares no code with the writers.

Tests of per_obspy.report.layers.geopackage, per_obspy.report.layers.geopackage,
per_obspy.report.layers.map_layers, per_obspy.report.layers.qgis and
per_obspy.report.layers.geopackage and per_obspy.report.layers.kml too:
``write_layers`` calls them.
"""

import json
import sqlite3
import zipfile
from contextlib import closing
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pyarrow as pa
import pyogrio
import pytest
import shapely
from pyarrow import parquet

from per_obspy.report.layers.geopackage import layer_names
from per_obspy.report.layers.map_layers import MapSources, write_layers
from per_obspy.results.totals import RegionTotals
from per_obspy.screening.totals import box_outlines, grid_cells, joined_totals, partial_totals

CLASSES = ("severe", "high", "low")
TABLE = pd.DataFrame(
    {
        "rank": [1, 2, 3],
        "pair_id": ["a", "ü/2", "c"],
        "risk_class": ["severe", "low", "low"],
        "state": ["yes", "no", "no"],
        "longitude": [-99.1, -99.2, -99.1],
        "latitude": [19.4, 19.5, 19.4],
        "longitude_1": [-99.1001, -99.2, -99.1],
        "latitude_1": [19.4, 19.5, 19.3999],
        "longitude_2": [-99.0999, -99.2, -99.1],
        "latitude_2": [19.4, 19.5, 19.4001],
        "building_id_1": ["x", "y", ""],
        "building_id_2": ["y", "z", "z"],
        "demand_ratio": [0.0, np.nan, 2.0],
        "expected_impact_velocity": [0.6, 0.1, 0.0],
        "yield_displacement_1": [np.inf, 0.1, 0.2],
        "floors_misaligned": [True, False, False],
        "probability": [0.5, 0.25, 0.0],
        "remark": [None, None, None],
    }
)
STATIONS = pd.DataFrame(
    {"station": ["XX.A"], "state": ["used"], "longitude": [-99.15], "latitude": [19.45]}
)


def totals(table, area):
    """Return the pairs of every area."""
    return joined_totals([partial_totals(table, area, table["risk_class"].unique())])


@pytest.fixture
def written(tmp_path):
    """Return a function that writes the layers of some pieces, and the path of the package."""

    def written(pieces, stations=STATIONS, found=None, outlines=None):
        facts = {"name": "old town", "simulated": "true"}
        ranked = tmp_path / "buildings.parquet"
        sources = MapSources(CLASSES, facts, stations, lambda: found, ranked, outlines)
        files = tuple(tmp_path / f"risk.{suffix}" for suffix in ("gpkg", "qgz", "geoparquet"))
        write_layers(iter(pieces), sources, files)
        return files[0]

    return written


def _rows(path, query):
    with closing(sqlite3.connect(path)) as database:
        return database.execute(query).fetchall()


def _read(path, layer):
    meta, _, geometry, fields = pyogrio.raw.read(path, layer=layer)
    read = pd.DataFrame(dict(zip(meta["fields"], fields, strict=True)))
    return meta, shapely.from_wkb(geometry), read


@pytest.mark.parametrize("pieces", [[TABLE], [TABLE.iloc[:1], TABLE.iloc[1:]]])
def test_pairs_are_lines_between_their_buildings_with_all_values(written, pieces):
    path = written(pieces)
    meta, lines, read = _read(path, "pairs")
    # would catch columns in another order, lost NaN, and truth values that became text
    pd.testing.assert_frame_equal(read, TABLE, check_dtype=False)
    assert read["floors_misaligned"].dtype == bool
    assert (meta["crs"], meta["geometry_type"]) == ("EPSG:4326", "LineString")
    ends = [shapely.get_coordinates(line).tolist() for line in lines]
    assert ends[0] == [[-99.1001, 19.4], [-99.0999, 19.4]]
    description = _rows(path, "SELECT description FROM gpkg_contents WHERE table_name = 'pairs'")
    assert description == [("name: old town; simulated: true",)]


@pytest.mark.parametrize("pieces", [[TABLE], [TABLE.iloc[:1], TABLE.iloc[1:]]])
def test_geoparquet_has_the_same_pairs(written, pieces):
    file = written(pieces).with_suffix(".geoparquet")
    table = parquet.read_table(file)
    geo = json.loads(table.schema.metadata[b"geo"])
    # https://geoparquet.org/releases/v1.1.0: these three are required, as are the two of a column
    assert (geo["version"], geo["primary_column"]) == ("1.1.0", "geometry")
    assert geo["columns"]["geometry"] == {"encoding": "WKB", "geometry_types": ["LineString"]}
    lines = shapely.from_wkb(table["geometry"].to_numpy())
    assert shapely.get_coordinates(lines[0]).tolist() == [[-99.1001, 19.4], [-99.0999, 19.4]]
    assert table["pair_id"].to_pylist() == TABLE["pair_id"].tolist()
    assert table["yield_displacement_1"].to_pylist() == [np.inf, 0.1, 0.2]


def test_a_pair_across_the_date_line_is_short(written):
    moved = TABLE.assign(longitude_1=179.9999, longitude_2=-179.9999)
    _, lines, _ = _read(written([moved]), "pairs")
    # would catch a line around the Earth
    assert shapely.length(lines).max() < 0.001


def test_buildings_have_their_worst_pair_and_points(written):
    meta, points, read = _read(written([TABLE.iloc[:2], TABLE.iloc[2:]]), "buildings")
    assert meta["geometry_type"] == "Point"
    found = read.set_index("building_id")
    # by hand; the third pair does not name its first building
    assert found["worst_pair"].to_dict() == {"x": "a", "y": "a", "z": "ü/2", "c#1": "c"}
    assert found["risk_class"].to_dict() == {"x": "severe", "y": "severe", "z": "low", "c#1": "low"}
    assert found["pairs"].to_dict() == {"x": 1, "y": 2, "z": 2, "c#1": 1}
    assert found.loc["x", "expected_impact_velocity"] == 0.6
    assert shapely.get_x(points).tolist() == found["longitude"].tolist()
    assert sorted(read["rank"]) == [1, 2, 3, 4]


def test_buildings_with_outlines_are_polygons_and_the_others_points(written, tmp_path):
    outline = shapely.box(-99.1003, 19.39, -99.0998, 19.41)
    table = pd.DataFrame(
        {"building_id": ["x", "x", "other"], "shape": [shapely.to_wkb(outline)] * 3}
    )
    geo = json.dumps({"primary_column": "shape"})
    arrow = pa.Table.from_pandas(table, preserve_index=False).replace_schema_metadata({"geo": geo})
    parquet.write_table(arrow, tmp_path / "outlines.parquet")
    path = written([TABLE], outlines=tmp_path / "outlines.parquet")
    meta, shapes, read = _read(path, "buildings")
    assert (meta["geometry_type"], read["building_id"].tolist()) == ("MultiPolygon", ["x"])
    assert shapely.equals(shapes[0], outline)
    _, _, others = _read(path, "buildings_without_outline")
    assert set(others["building_id"]) == {"y", "z", "c#1"}


def test_a_table_of_buildings_is_shown_as_it_is(written, tmp_path):
    table = {"rank": [1], "building_id": ["x"], "severity": [0.7], "risk_class": ["severe"]}
    frame = pd.DataFrame(table | {"longitude": [-99.1], "latitude": [19.4]})
    frame.to_parquet(tmp_path / "buildings.parquet")
    _, _, read = _read(written([TABLE]), "buildings")
    pd.testing.assert_frame_equal(read, frame, check_dtype=False)


def test_areas_are_polygons_around_their_pairs_or_points_amid_them(written):
    cells = grid_cells(TABLE["longitude"], TABLE["latitude"], 1000.0)
    found = totals(TABLE, cells.cell)
    outlines = box_outlines(cells.boxes.loc[found["area"]])
    meta, shapes, read = _read(written([TABLE], found=RegionTotals(found, outlines)), "areas")
    assert meta["geometry_type"] == "MultiPolygon"
    # two pairs share a place, and each place lies in the polygon of its cell
    assert sorted(read["pairs"]) == [1, 2]
    polygons = dict(zip(read["area"], shapes, strict=True))
    places = shapely.points(TABLE["longitude"], TABLE["latitude"])
    for cell, place in zip(cells.cell, places, strict=True):
        assert polygons[cell].contains(place)
    everywhere = RegionTotals(totals(TABLE, "everywhere"), None)
    _, (point,), _ = _read(written([TABLE], found=everywhere), "areas")
    assert point.x == pytest.approx(TABLE["longitude"].mean(), abs=1e-3)


def test_qgis_finds_the_style_of_every_layer(written):
    # QGIS looks in layer_styles for the table and the geometry column of a layer and takes the
    # default
    path = written([TABLE], found=RegionTotals(totals(TABLE, "everywhere"), None))
    query = (
        "SELECT s.f_table_name, s.styleQML FROM layer_styles s JOIN gpkg_geometry_columns g "
        "ON g.table_name = s.f_table_name AND g.column_name = s.f_geometry_column "
        "WHERE s.useAsDefault = 1"
    )
    styles = dict(_rows(path, query))
    assert set(styles) == {"inspections", "pairs", "buildings", "stations", "areas"}
    aliases = ElementTree.fromstring(styles["pairs"]).iter("alias")
    named = {alias.get("field"): alias.get("name") for alias in aliases}
    assert named["expected_impact_velocity"] == "expected impact velocity (m/s)"
    assert set(named) == set(TABLE)
    kinds = dict(_rows(path, "SELECT table_name, data_type FROM gpkg_contents"))
    assert kinds.pop("layer_styles") == "attributes"
    assert set(kinds.values()) == {"features"}


def test_the_project_opens_every_layer_beside_it(written, tmp_path):
    path = written([TABLE], found=RegionTotals(totals(TABLE, "everywhere"), None))
    with zipfile.ZipFile(path.with_suffix(".qgz")) as archive:
        (name,) = archive.namelist()
        root = ElementTree.fromstring(archive.read(name))
    assert (name, root.tag, root.get("projectname")) == ("risk.qgs", "qgis", "old town")
    # the tree names the layers from top to bottom; each is described, and GDAL can open it
    tree = [layer.get("id") for layer in root.iter("layer-tree-layer")]
    described = {layer.findtext("id"): layer for layer in root.iter("maplayer")}
    names = ("stations", "pairs", "inspections", "buildings", "areas")
    assert tree == [f"per_obspy_{name}" for name in names]
    assert tree == list(described)
    for layer in described.values():
        source, _, name = layer.findtext("datasource").partition("|layername=")
        assert source.startswith("./")
        info = pyogrio.read_info(tmp_path / source, layer=name)
        kind = {"Line": "LineString", "Point": "Point"}[layer.get("geometry")]
        assert (info["geometry_type"], info["features"] > 0) == (kind, True)
        assert layer.find("renderer-v2") is not None
        assert layer.findtext("srs/spatialrefsys/authid") == "EPSG:4326"
    # the first view is that of the pairs
    extent = {part.tag: float(part.text) for part in root.find("mapcanvas/extent")}
    assert extent["xmin"] == -99.2
    assert extent["ymax"] == 19.5


def test_a_table_without_pairs_is_an_empty_layer(written):
    path = written([TABLE.iloc[:0]], stations=STATIONS[:0])
    info = pyogrio.read_info(path, layer="pairs")
    assert (info["features"], list(info["fields"])) == (0, list(TABLE))


def test_pairs_of_which_only_the_middle_is_known_are_points(written):
    only = TABLE.drop(columns=["longitude_1", "latitude_1", "longitude_2", "latitude_2"])
    path = written([only], stations=STATIONS[:0])
    meta, points, _ = _read(path, "pairs")
    assert (meta["geometry_type"], points[0].x) == ("Point", -99.1)
    layers = [name for name, _ in pyogrio.list_layers(path)]
    assert layers == ["pairs", "inspections", "layer_styles"]


def test_a_layer_that_cannot_be_finished_leaves_the_old_files(written, tmp_path):
    # would catch a file that is written in place
    path = written([TABLE])
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}

    def broken():
        yield TABLE
        raise RuntimeError("power cut")

    with pytest.raises(RuntimeError, match="power cut"):
        written(broken())
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before
    assert path.exists()


NAMES = ["fid", "FID", "geom", "Gap", "RANK", "geometry", "map", "rowid", "q\"'`]", "", "x" * 200]


@pytest.mark.parametrize("name", NAMES)
def test_any_name_of_a_carried_column_has_a_place_in_the_layer(written, name):
    # would catch a layer that fails at a name which GDAL, SQLite or DuckDB keeps for itself
    table = TABLE.assign(gap=0.1, **{name: ["$x_$", "[/red]", "\u202ex"]})
    _, _, read = _read(written([table.iloc[:2], table.iloc[2:]]), "pairs")
    assert [*read] == layer_names(table.columns)
    assert read[layer_names(table.columns)[-1]].tolist() == ["$x_$", "[/red]", "\u202ex"]
    assert read["gap"].tolist() == [0.1] * 3


def test_names_of_a_layer_differ_in_more_than_case():
    names = layer_names(["a", "A", "a_2", "A_2", "FID", "fid", "fid_2"])
    assert len({name.lower() for name in names} | {"fid", "geom"}) == len(names) + 2
    assert names[0] == "a"
