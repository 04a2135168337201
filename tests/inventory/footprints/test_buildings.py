"""Buildings of a layer: repetitions, places, the file that goes with the pairs."""

import json

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet
import pyogrio
import pytest
import shapely

from per_obspy import pairs_from_footprints
from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints import footprint_pairs
from per_obspy.inventory.footprints.footprint_pairs import (
    find_footprint_pairs,
    without_repetitions,
    write_buildings,
)
from per_obspy.inventory.footprints.layers import polygons, read_layer

HOUSES = [shapely.box(0.3 + 1e-4 * i, 0.0, 0.3 + 1e-4 * (i + 1), 1e-4) for i in range(6)]


@pytest.fixture
def town(tmp_path):
    path = tmp_path / "town.gpkg"
    columns = {
        "building_id": np.array(list("abcdef"), dtype=object),
        "height": np.array([9.0, 12.0, 6.0, 9.0, 9.0, 9.0]),
        "ward": np.array(["east", "west", None, "east", "east", "="], dtype=object),
    }
    pyogrio.raw.write(
        path,
        shapely.to_wkb(HOUSES),
        list(columns.values()),
        list(columns),
        geometry_type="Polygon",
        crs="EPSG:4326",
    )
    return path


def test_pairs_find_their_buildings_in_the_file_beside_them(town, tmp_path):
    found = find_footprint_pairs(town)
    write_buildings(found.buildings, tmp_path / "buildings.parquet")
    stored = pa.parquet.read_table(tmp_path / "buildings.parquet").to_pandas()
    by_name = stored.set_index("building_id")
    assert by_name.index.is_unique
    for i in (1, 2):
        chosen = by_name.loc[found.pairs[f"building_id_{i}"]]
        for name in ("height", "longitude", "latitude", "area"):
            assert chosen[name].tolist() == found.pairs[f"{name}_{i}"].tolist()
        assert chosen["ward"].fillna("").tolist() == found.pairs[f"ward_{i}"].fillna("").tolist()
    shapes = shapely.from_wkb(by_name["geometry"].to_numpy())
    assert shapely.equals_exact(shapes, np.array(HOUSES), 1e-12).all()


def test_the_file_of_buildings_is_a_layer_that_gives_the_same_pairs(town, tmp_path):
    found = find_footprint_pairs(town)
    path = tmp_path / "buildings.parquet"
    write_buildings(found.buildings, path)
    assert len(read_layer(path).outlines) == len(HOUSES)
    again = pairs_from_footprints(path)
    pd.testing.assert_frame_equal(again[list(found.pairs)], found.pairs)


def test_blocks_do_not_change_the_pairs(town, monkeypatch):
    whole = pairs_from_footprints(town)
    monkeypatch.setattr(footprint_pairs, "CHUNK", 2)
    monkeypatch.setattr(footprint_pairs, "BLOCK", 2)
    pd.testing.assert_frame_equal(pairs_from_footprints(town), whole)
    assert whole["position_1"].tolist() == ["end", "inside", "inside", "inside", "inside"]
    assert whole["position_2"].tolist() == ["inside", "inside", "inside", "inside", "end"]


def test_repetitions_far_apart_are_found_whatever_the_first_point(monkeypatch):
    # would catch repetitions within a block only, and bytes instead of shapes
    monkeypatch.setattr(footprint_pairs, "BLOCK", 2)
    turned = shapely.Polygon(np.roll(shapely.get_coordinates(HOUSES[0])[:-1], 1, axis=0))
    wkb = pa.array(shapely.to_wkb([*HOUSES[:5], turned]), pa.large_binary())
    table = pd.DataFrame({"building_id": list("abcdea")}, index=range(1, 7))
    kept, rejected = without_repetitions(wkb, table, "town")
    assert kept.table["building_id"].tolist() == list("abcde")
    assert shapely.equals(polygons(kept.outlines), np.array(HOUSES[:5])).all()
    assert [(row.row, len(row.reasons)) for row in rejected] == [(6, 2)]


def test_names_of_pairs_that_repeat_in_another_block_are_rejected(tmp_path, monkeypatch):
    # a/b + c and a + b/c have one name
    monkeypatch.setattr(footprint_pairs, "CHUNK", 1)
    path = tmp_path / "town.gpkg"
    near = [HOUSES[0], HOUSES[1], HOUSES[3], HOUSES[4]]
    names = np.array(["a/b", "c", "a", "b/c"], dtype=object)
    fields = [names, np.full(4, 9.0)]
    pyogrio.raw.write(
        path,
        shapely.to_wkb(near),
        fields,
        ["building_id", "height"],
        geometry_type="Polygon",
        crs="EPSG:4326",
    )
    pairs = pairs_from_footprints(path)
    assert pairs["pair_id"].tolist() == ["a/b/c"]
    (rejection,) = pairs.attrs["rejected"]
    assert "occurs in an earlier row already" in rejection.reasons[0]


def _across(west: float, east: float) -> list[shapely.Polygon]:
    """Return three houses in a row of 1e-4 degrees that begins at a longitude, 1e-5 apart."""
    starts = west + np.arange(3) * 1.1e-4
    return [shapely.box(x, -17.0, x + (east - west), -16.9999) for x in starts]


@pytest.mark.parametrize(
    "shape",
    [
        # Beyond 180 degrees, with both signs, in two parts, and in the convention of 0 to 360
        lambda xy: xy,
        lambda xy: np.column_stack([(xy[:, 0] + 180.0) % 360.0 - 180.0, xy[:, 1]]),
        None,
        lambda xy: np.column_stack([xy[:, 0] % 360.0, xy[:, 1]]),
    ],
    ids=["beyond", "signs", "parts", "turn"],
)
def test_a_town_across_the_date_line_is_like_any_other(tmp_path, shape):
    # Houses of 1e-4 degrees, the second of which lies across 180, and the same ones near 11
    houses = np.array(_across(179.99985, 179.99995))
    if shape is None:
        west, east = shapely.box(0, -90, 180, 90), shapely.box(180, -90, 190, 90)
        back = shapely.transform(shapely.intersection(houses, east), lambda xy: xy - [360.0, 0.0])
        moved = [
            each if shapely.is_empty(other) else (other if shapely.is_empty(each) else each | other)
            for each, other in zip(shapely.intersection(houses, west), back, strict=True)
        ]
    else:
        moved = [shapely.transform(house, shape) for house in houses]
    plain = [shapely.transform(house, lambda xy: xy - [169.0, 0.0]) for house in houses]
    tables = []
    for name, shapes in (("town", moved), ("plain", plain)):
        features = [
            {
                "type": "Feature",
                "geometry": json.loads(shapely.to_geojson(shape)),
                "properties": {"building_id": f"b{n}", "height": 9.0},
            }
            for n, shape in enumerate(shapes)
        ]
        path = tmp_path / f"{name}.geojson"
        path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
        tables.append(find_footprint_pairs(path))
    (pairs, buildings, _), (expected, *_) = tables
    assert pairs["pair_id"].tolist() == expected["pair_id"].tolist() == ["b0/b1", "b1/b2"]
    # Figures of coordinates near 180 and near 11 differ by their rounding, 3e-14 degrees or 3 nm
    for column in ("gap", "facing_length", "area_1", "area_2", "azimuth"):
        np.testing.assert_allclose(pairs[column], expected[column], rtol=0.0, atol=1e-5)
    # Places are those of the Earth
    place, plain_place = (
        table[["longitude_1", "longitude_2"]].to_numpy() for table in (pairs, expected)
    )
    turn = np.where(plain_place + 169.0 > 180.0, 360.0, 0.0)
    np.testing.assert_allclose(place, plain_place + 169.0 - turn, rtol=0.0, atol=1e-12)
    assert buildings.table["longitude"].between(-180.0, 180.0).all()


def test_towns_far_apart_are_refused_on_both_sides_of_the_date_line(tmp_path):
    boxes = [shapely.box(x, 50.0, x + 1e-4, 50.0001) for x in (174.0, -175.0)]
    features = [
        {
            "type": "Feature",
            "geometry": json.loads(shapely.to_geojson(box)),
            "properties": {"height": 9.0},
        }
        for box in boxes
    ]
    path = tmp_path / "town.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    with pytest.raises(CatalogError, match="from 174 to 185 degrees east: split the layer"):
        find_footprint_pairs(path)
