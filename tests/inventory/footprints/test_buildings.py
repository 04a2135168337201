"""Buildings of a layer, and rows of pairs (per_obspy.inventory.footprints.footprint_rows)."""

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet
import pyogrio
import pytest
import shapely

from per_obspy import pairs_from_footprints
from per_obspy.inventory.footprints import buildings as module
from per_obspy.inventory.footprints import footprint_rows
from per_obspy.inventory.footprints.buildings import without_repetitions, write_buildings
from per_obspy.inventory.footprints.footprint_pairs import find_footprint_pairs
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
    monkeypatch.setattr(footprint_rows, "CHUNK", 2)
    monkeypatch.setattr(module, "BLOCK", 2)
    pd.testing.assert_frame_equal(pairs_from_footprints(town), whole)
    assert whole["position_1"].tolist() == ["end", "inside", "inside", "inside", "inside"]
    assert whole["position_2"].tolist() == ["inside", "inside", "inside", "inside", "end"]


def test_repetitions_far_apart_are_found_whatever_the_first_point(monkeypatch):
    # would catch repetitions within a block only, and bytes instead of shapes
    monkeypatch.setattr(module, "BLOCK", 2)
    turned = shapely.Polygon(np.roll(shapely.get_coordinates(HOUSES[0])[:-1], 1, axis=0))
    wkb = pa.array(shapely.to_wkb([*HOUSES[:5], turned]), pa.large_binary())
    table = pd.DataFrame({"building_id": list("abcdea")}, index=range(1, 7))
    kept, rejected = without_repetitions(wkb, table, "town")
    assert kept.table["building_id"].tolist() == list("abcde")
    assert shapely.equals(polygons(kept.outlines), np.array(HOUSES[:5])).all()
    assert [(row.row, len(row.reasons)) for row in rejected] == [(6, 2)]


def test_names_of_pairs_that_repeat_in_another_block_are_rejected(tmp_path, monkeypatch):
    # a/b + c and a + b/c have one name
    monkeypatch.setattr(footprint_rows, "CHUNK", 1)
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
