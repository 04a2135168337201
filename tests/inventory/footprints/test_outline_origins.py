"""Origin of outlines: by source and row, deviations of gaps and heights, the same as a layer."""

import json

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from per_obspy.config import Building
from per_obspy.inventory.completion import completed_pairs
from per_obspy.inventory.footprints.building_columns import schema_columns
from per_obspy.inventory.footprints.footprint_pairs import find_footprint_pairs, write_buildings
from per_obspy.inventory.footprints.sources import ORIGINS, outline_origins, source_of
from per_obspy.report.coverage import search_sentence
from per_obspy.results.coverage import search_of_table

#: A square of 10 m at the equator, in degrees, and its way to the next one with a gap of 0.5 m.
SIDE, STEP = 10.0 / 111_320.0, 10.5 / 111_320.0


def _layer(path, rows, step=STEP):
    """Write a row of houses, one per set of properties, as GeoJSON."""
    features = []
    for number, properties in enumerate(rows):
        west = 20.0 + number * step
        ring = [[west, 0.0], [west + SIDE, 0.0], [west + SIDE, SIDE], [west, SIDE], [west, 0.0]]
        shape = {"type": "Polygon", "coordinates": [ring]}
        features.append({"type": "Feature", "geometry": shape, "properties": properties})
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def _overture(dataset, number):
    sources = [
        {"property": "", "dataset": dataset},
        {"property": "height", "dataset": "USGS Lidar"},
    ]
    return {"id": f"b{number}", "version": 1, "sources": json.dumps(sources), "height": 9.0}


@pytest.fixture
def mixed(tmp_path):
    """Return pairs of Overture's kind: two buildings of OpenStreetMap, then two learned ones."""
    origins = ("OpenStreetMap", "OpenStreetMap", "Microsoft ML Buildings", "Google Open Buildings")
    rows = [_overture(dataset, number) for number, dataset in enumerate(origins)]
    return find_footprint_pairs(_layer(tmp_path / "town.geojson", rows))


def test_the_less_accurate_outline_of_a_pair_counts(mixed):
    assert mixed.pairs["gap_std"].tolist() == [0.3, 1.0, 1.0]
    assert mixed.pairs["gap_std_source"].tolist() == ["assumed", "learned", "learned"]
    derived = completed_pairs(mixed.pairs, Building())["derived"]
    assert all("gap_std" in names.split() for names in derived)


def test_buildings_are_a_layer_of_the_same_accuracy(mixed, tmp_path):
    write_buildings(mixed.buildings, tmp_path / "town.buildings.parquet")
    again = find_footprint_pairs(tmp_path / "town.buildings.parquet").pairs
    for name in ("gap_std", "gap_std_source"):
        assert again[name].tolist() == mixed.pairs[name].tolist()


def test_a_given_deviation_stays_and_learned_outlines_stay_learned(tmp_path):
    rows = [{"height": 9.0, "confidence": 0.9}] * 3
    pairs = find_footprint_pairs(_layer(tmp_path / "town.geojson", rows), gap_std=0.05).pairs
    assert set(pairs["gap_std"]) == {0.05}
    assert set(pairs["gap_std_source"]) == {"learned"}


def test_a_wide_error_does_not_make_touching_outlines_safer(tmp_path):
    # would catch: the deviation of the origin for a gap of 0
    rows = [_overture("Microsoft ML Buildings", number) for number in range(2)]
    pairs = find_footprint_pairs(_layer(tmp_path / "town.geojson", rows, step=SIDE)).pairs
    assert pairs["gap"].tolist() == [0.0]
    assert pairs["gap_std"].tolist() == [0.1]
    assert pairs["gap_std_source"].tolist() == ["learned"]


def test_learned_heights_are_uncertain_by_one_storey():
    layer = pd.DataFrame({"height": [6.0, 30.0, -1.0], "confidence": 0.9})
    deviation = schema_columns(layer, "town")["height_log_std"]
    # the coefficient of variation of a lognormal height is 3 m / height
    assert_allclose(np.sqrt(np.expm1(deviation[:2] ** 2)) * [6.0, 30.0], 3.0, rtol=1e-12)
    assert np.isnan(deviation[2])


def test_heights_of_an_atlas_are_coarse_whatever_the_outline():
    layer = pd.DataFrame({"id": [1, 2], "height": 8.0, "var": 1.0, "source": ["osm", "ours2"]})
    table = schema_columns(layer, "town")
    assert table["outline_source"].tolist() == ["traced", "coarse"]
    assert_allclose(np.sqrt(np.expm1(table["height_log_std"] ** 2)) * 8.0, 3.7, rtol=1e-12)


def test_the_licence_of_an_atlas_is_said_by_the_command_and_kept_for_the_page(call, tmp_path):
    rows = [{"id": k, "height": 8.0, "var": 1.0, "source": "osm"} for k in range(2)]
    code, out, _ = call("pairs", _layer(tmp_path / "a.geojson", rows), "-o", tmp_path / "a.parquet")
    assert code == 0
    assert "not for commercial use: GlobalBuildingAtlas (CC BY-NC 4.0, in part ODbL)" in out
    search = search_of_table(tmp_path / "a.parquet", 1)
    assert "uso comercial: GlobalBuildingAtlas" in search_sentence(search.joined(search), "es")
    # others are not restricted
    rows = [_overture("OpenStreetMap", number) for number in range(2)]
    call("pairs", _layer(tmp_path / "b.geojson", rows), "-o", tmp_path / "b.parquet")
    assert "commercial" not in search_sentence(search_of_table(tmp_path / "b.parquet", 1), "en")


def test_surveyed_columns_have_no_origin_and_the_old_deviation(tmp_path):
    rows = [{"height": 9.0, "storeys": 3}] * 2
    found = find_footprint_pairs(_layer(tmp_path / "town.geojson", rows))
    assert "outline_source" not in found.buildings.table
    assert found.pairs["gap_std"].tolist() == [ORIGINS["drawn"].gap_std] == [0.1]


@pytest.mark.parametrize("cell", [None, "", "x" * 10**6, "Instituto Geográfico", "[]", "\x00", 7.5])
def test_an_unknown_origin_is_that_of_the_source(cell):
    source = source_of(["id", "version", "sources"])
    assert outline_origins(pd.DataFrame({"sources": [cell]}), source).tolist() == ["traced"]
