"""Pairs of footprints are found once, written next to the results, and again after a change."""

import json
import shutil

import pandas as pd
import pytest

from per_obspy.config import Run, checked
from per_obspy.errors import CatalogError
from per_obspy.progress import silent
from per_obspy.runs.inputs.drawn_pairs import layer_files, write_drawn_pairs
from per_obspy.runs.run import run

from ..small_run import InProcess

pytestmark = pytest.mark.usefixtures("plain_reports")

#: Width of a building and of the gap to its neighbour, degrees: about 11 m and 0.6 m.
WIDTH, GAP = 1e-4, 5e-6


def _layer(path, count, height=9.0):
    """Write a row of houses at the equator as GeoJSON, one of them without an outline."""
    features = [{"type": "Feature", "geometry": None, "properties": {"height": 5.0}}]
    for number in range(count):
        west = 0.3 + number * (WIDTH + GAP)
        ring = [[west, 0.0], [west + WIDTH, 0.0], [west + WIDTH, WIDTH], [west, WIDTH], [west, 0.0]]
        properties = {"building_id": f"B{number}", "height": height + 6 * (number % 2)}
        geometry = {"type": "Polygon", "coordinates": [ring]}
        features.append({"type": "Feature", "geometry": geometry, "properties": properties})
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))


def _settings(folder, **footprints):
    layer = {"file": str(folder / "town.geojson"), **footprints}
    (folder / "scenario.toml").write_text("[scenario]\nstations = 1\nmagnitude = 6.5\ndt = 0.02\n")
    content = {
        "name": "town",
        "output": str(folder / "out"),
        "simulation": str(folder / "scenario.toml"),
        "pairs": {"footprints": layer},
        "spectra": {"count": 5, "dampings": [0.05], "azimuth_step": 30},
        "screening": {"largest_distance": 1e5, "exact": False},
    }
    return checked(Run, content)


def test_pairs_are_those_of_the_search_and_are_kept(tmp_path):
    _layer(tmp_path / "town.geojson", 4)
    settings, steps = _settings(tmp_path), []
    counts = write_drawn_pairs(settings, tmp_path, lambda *step: steps.append(step))
    assert counts == {"pairs": 3, "rejected": 1}
    table = pd.read_parquet(tmp_path / "pairs.parquet")
    # 5e-6 degrees of a great circle on the equator, WGS 84: 0.5566 m
    assert table["gap"].tolist() == pytest.approx([0.5566] * 3, abs=1e-4)
    rejected = pd.read_csv(tmp_path / "pairs.rejected.csv")
    assert rejected["reasons"].tolist() == ["no geometry"]
    # again, nothing is searched
    before = (tmp_path / "pairs.parquet").stat().st_mtime_ns
    assert write_drawn_pairs(settings, tmp_path, lambda *step: steps.append(step)) == counts
    assert (tmp_path / "pairs.parquet").stat().st_mtime_ns == before
    assert [step[0] for step in steps] == ["finding pairs"] * 2


def test_a_change_of_layer_option_or_result_is_noticed(tmp_path):
    _layer(tmp_path / "town.geojson", 4)
    write_drawn_pairs(_settings(tmp_path), tmp_path, silent)
    _layer(tmp_path / "town.geojson", 6)
    assert write_drawn_pairs(_settings(tmp_path), tmp_path, silent)["pairs"] == 5
    # gaps of 0.56 m are wider than 0.1 m
    with pytest.raises(CatalogError, match=r"no two footprints lie within 0\.1 m"):
        write_drawn_pairs(_settings(tmp_path, distance=0.1), tmp_path, silent)
    write_drawn_pairs(_settings(tmp_path, gap_std=0.2), tmp_path, silent)
    assert pd.read_parquet(tmp_path / "pairs.parquet")["gap_std"].tolist() == [0.2] * 5
    # the checks are those of the command; another raster is another input
    with pytest.raises(CatalogError, match="a box needs GeoParquet"):
        write_drawn_pairs(_settings(tmp_path, bbox=[0.0, -1.0, 1.0, 1.0]), tmp_path, silent)
    for content in (b"no raster", b"another one"):
        (tmp_path / "heights.tif").write_bytes(content)
        with pytest.raises(CatalogError, match=r"heights\.tif: is no GeoTIFF"):
            write_drawn_pairs(
                _settings(tmp_path, heights=str(tmp_path / "heights.tif")), tmp_path, silent
            )
    for box in ([1.0, -1.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0, float("nan")]):
        with pytest.raises(CatalogError, match=r"pairs\.footprints\.bbox"):
            _settings(tmp_path, bbox=box)
    (tmp_path / "pairs.parquet").write_bytes(b"damaged")
    assert write_drawn_pairs(_settings(tmp_path, gap_std=0.2), tmp_path, silent)["pairs"] == 5
    assert len(pd.read_parquet(tmp_path / "pairs.parquet")) == 5


def test_a_run_of_footprints_resumes_and_notices_changes(tmp_path):
    _layer(tmp_path / "town.geojson", 4)
    settings = _settings(tmp_path)
    first = run(settings, executor=InProcess())
    assert first.record["counts"]["pairs"] == 3
    assert first.record["drawn"] == {"pairs": 3, "rejected": 1}
    assert run(settings, executor=InProcess()).did_nothing
    # the effective configuration is the same run
    assert run(tmp_path / "out" / "configuration.toml", executor=InProcess()).did_nothing
    _layer(tmp_path / "town.geojson", 6)
    again = run(tmp_path / "out" / "configuration.toml", executor=InProcess())
    assert (again.did_nothing, again.record["counts"]["pairs"]) == (False, 5)
    assert again.record["counts"]["stations_resumed"] == 1
    # a table that was damaged since is made again
    (tmp_path / "out" / "pairs.parquet").unlink()
    assert not run(settings, executor=InProcess()).did_nothing
    assert (tmp_path / "out" / "pairs.parquet").is_file()


def test_a_missing_layer_stops_the_run_first(tmp_path):
    with pytest.raises(CatalogError, match=r"town\.geojson: no such file"):
        run(_settings(tmp_path), executor=InProcess())
    assert not (tmp_path / "out" / "stations").exists()


def test_parts_of_a_shapefile_belong_to_it(tmp_path):
    for suffix in (".shp", ".dbf", ".prj", ".txt"):
        (tmp_path / f"town{suffix}").write_text(suffix)
    names = [path.name for path in layer_files(tmp_path / "town.shp")]
    assert names == ["town.shp", "town.dbf", "town.prj"]
    shutil.copy(tmp_path / "town.shp", tmp_path / "town.gpkg")
    assert [path.name for path in layer_files(tmp_path / "town.gpkg")] == ["town.gpkg"]
