"""GeoPackages read back by GDAL and by SQLite, which shares no code with what wrote them."""

import sqlite3
from contextlib import closing
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely
from per_obspy.report.gis import class_style, layer_names, write_pairs_layer, write_totals_layer

from per_obspy.screening.region.outlines import box_outlines
from per_obspy.screening.region.totals import grid_cells, totals

CLASSES = ("severe", "high", "low")
TABLE = pd.DataFrame(
    {
        "rank": [1, 2, 3],
        "pair_id": ["a", "ü/2", "c"],
        "risk_class": ["severe", "low", "low"],
        "state": ["yes", "no", "no"],
        "longitude": [-99.1, -99.2, -99.1],
        "latitude": [19.4, 19.5, 19.4],
        "demand_ratio": [0.0, np.nan, 2.0],
        "expected_impact_velocity": [0.6, 0.1, 0.0],
        "yield_displacement_1": [np.inf, 0.1, 0.2],
        "floors_misaligned": [True, False, False],
        "probability": [0.5, 0.25, 0.0],
        "remark": [None, None, None],
    }
)
FACTS = {"name": "old town", "simulated": "true"}


def _rows(path, query):
    with closing(sqlite3.connect(path)) as database:
        return database.execute(query).fetchall()


@pytest.mark.parametrize("pieces", [[TABLE], [TABLE.iloc[:1], TABLE.iloc[1:]]])
def test_pairs_come_back_with_their_places_and_values(tmp_path, pieces):
    path = tmp_path / "risk.gpkg"
    write_pairs_layer(iter(pieces), CLASSES, path, FACTS)
    meta, _, geometry, fields = pyogrio.raw.read(path, layer="pairs")
    read = pd.DataFrame(dict(zip(meta["fields"], fields, strict=True)))
    # would catch columns in another order, lost NaN, and truth values that became text
    pd.testing.assert_frame_equal(read, TABLE, check_dtype=False)
    assert read["floors_misaligned"].dtype == bool
    points = shapely.from_wkb(geometry)
    assert shapely.get_x(points).tolist() == TABLE["longitude"].tolist()
    assert shapely.get_y(points).tolist() == TABLE["latitude"].tolist()
    assert meta["crs"] == "EPSG:4326"
    description = _rows(path, "SELECT description FROM gpkg_contents WHERE table_name = 'pairs'")
    assert description == [("name: old town; simulated: true",)]


def test_qgis_finds_its_style(tmp_path):
    # QGIS looks in layer_styles for the table and the geometry column of a layer and takes the
    # default
    path = tmp_path / "risk.gpkg"
    write_pairs_layer([TABLE], CLASSES, path, FACTS)
    query = (
        "SELECT s.styleQML FROM layer_styles s JOIN gpkg_geometry_columns g "
        "ON g.table_name = s.f_table_name AND g.column_name = s.f_geometry_column "
        "WHERE s.useAsDefault = 1"
    )
    ((style,),) = _rows(path, query)
    assert style == class_style(CLASSES)
    kinds = dict(_rows(path, "SELECT table_name, data_type FROM gpkg_contents"))
    assert kinds == {"pairs": "features", "layer_styles": "attributes"}


def test_every_class_has_a_mark_of_its_own_and_the_worst_is_on_top():
    root = ElementTree.fromstring(class_style(CLASSES))
    categories = [(c.get("value"), c.get("symbol")) for c in root.iter("category")]
    assert categories == [*zip([*CLASSES, "gap unknown"], "0123", strict=True)]
    marks = [
        {o.get("name"): o.get("value") for o in symbol.iter("Option") if o.get("name")}
        for symbol in root.iter("symbol")
    ]
    assert [symbol.get("name") for symbol in root.iter("symbol")] == [*"0123"]
    assert len({mark["color"] for mark in marks}) == 4
    assert marks[0]["color"] == "213,94,0,255"  # Okabe & Ito's vermilion
    assert float(marks[0]["size"]) > float(marks[2]["size"])
    # drawn by falling rank: the worst, rank 1, last
    order = next(root.iter("orderByClause"))
    assert (order.text, order.get("asc")) == ('"rank"', "0")


def test_a_class_may_have_any_name_and_be_alone():
    root = ElementTree.fromstring(class_style(['<"grave" & more>']))
    assert next(root.iter("category")).get("value") == '<"grave" & more>'


def test_totals_of_cells_are_polygons_around_their_pairs(tmp_path):
    cells = grid_cells(TABLE["longitude"], TABLE["latitude"], 1000.0)
    found = totals(TABLE, cells.cell)
    outlines = box_outlines(cells.boxes.loc[found["area"]])
    write_totals_layer(found, outlines, tmp_path / "cells.gpkg", FACTS)
    meta, _, geometry, fields = pyogrio.raw.read(tmp_path / "cells.gpkg")
    assert meta["geometry_type"] == "Polygon"

    # two pairs share a place
    values = dict(zip(meta["fields"], fields, strict=True))
    assert sorted(values["pairs"]) == [1, 2]
    # each place lies in the polygon of its cell
    polygons = dict(zip(values["area"], shapely.from_wkb(geometry), strict=True))
    places = shapely.points(TABLE["longitude"], TABLE["latitude"])
    for cell, place in zip(cells.cell, places, strict=True):
        assert polygons[cell].contains(place)


def test_totals_of_areas_without_outlines_are_points(tmp_path):
    write_totals_layer(totals(TABLE, "everywhere"), None, tmp_path / "area.gpkg", FACTS)
    meta, _, geometry, _ = pyogrio.raw.read(tmp_path / "area.gpkg")
    assert meta["geometry_type"] == "Point"
    # amid the pairs
    (point,) = shapely.from_wkb(geometry)
    assert point.x == pytest.approx(TABLE["longitude"].mean(), abs=1e-3)
    assert point.y == pytest.approx(TABLE["latitude"].mean(), abs=1e-3)


def test_a_table_without_pairs_is_an_empty_layer(tmp_path):
    write_pairs_layer([TABLE.iloc[:0]], CLASSES, tmp_path / "risk.gpkg", FACTS)
    info = pyogrio.read_info(tmp_path / "risk.gpkg", layer="pairs")
    assert (info["features"], info["geometry_type"], list(info["fields"])) == (
        0,
        "Point",
        list(TABLE),
    )


def test_a_layer_that_cannot_be_finished_leaves_the_old_one(tmp_path):
    # would catch a file that is written in place
    path = tmp_path / "risk.gpkg"
    write_pairs_layer([TABLE], CLASSES, path, FACTS)
    before = path.read_bytes()

    def broken():
        yield TABLE
        raise RuntimeError("power cut")

    with pytest.raises(RuntimeError, match="power cut"):
        write_pairs_layer(broken(), CLASSES, path, FACTS)
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["risk.gpkg"]


NAMES = ["fid", "FID", "geom", "Gap", "RANK", "geometry", "map", "rowid", "q\"'`]", "", "x" * 200]


@pytest.mark.parametrize("name", NAMES)
def test_any_name_of_a_carried_column_has_a_place_in_the_layer(tmp_path, name):
    # would catch a layer that fails at a name which GDAL or SQLite keeps for itself
    table = TABLE.assign(gap=0.1, **{name: ["$x_$", "[/red]", "\u202ex"]})
    write_pairs_layer([table.iloc[:2], table.iloc[2:]], CLASSES, tmp_path / "risk.gpkg", FACTS)
    meta, _, _, fields = pyogrio.raw.read(tmp_path / "risk.gpkg", layer="pairs")
    read = dict(zip(meta["fields"], fields, strict=True))
    assert [*read] == layer_names(table.columns)
    assert read[layer_names(table.columns)[-1]].tolist() == ["$x_$", "[/red]", "\u202ex"]
    assert read["gap"].tolist() == [0.1] * 3


def test_names_of_a_layer_differ_in_more_than_case():
    names = layer_names(["a", "A", "a_2", "A_2", "FID", "fid", "fid_2"])
    assert len({name.lower() for name in names} | {"fid", "geom"}) == len(names) + 2
    assert names[0] == "a"
