"""Paths that GDAL takes literally: written and read, and never fetched."""

from pathlib import Path

import numpy as np
import pyogrio
import pytest
import shapely

from per_obspy.inventory.footprints.gdal_paths import literal_path
from per_obspy.inventory.footprints.layers import read_layer

NAMES = [
    "a!b", "new\nline", "ta\tb", "a.zip!x", "zip:", "http:", "s3:", "file:", "a?b", "a;b",
    "run [2]", "x.zip", "%41", "#1", "a::b", "it's", "plain",
]  # fmt: skip


def write(path, driver):
    square = shapely.box(10.0, 50.0, 10.001, 50.001)
    with literal_path(path) as place:
        pyogrio.raw.write(
            place,
            np.array([shapely.to_wkb(square)]),
            [np.array([9.0])],
            ["height"],
            geometry_type="Polygon",
            crs="EPSG:4326",
            driver=driver,
        )


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("is_relative", [False, True])
def test_folders_of_any_name(tmp_path, monkeypatch, name, is_relative):
    monkeypatch.chdir(tmp_path)
    folder = Path(name) if is_relative else tmp_path / name
    folder.mkdir()
    write(folder / "town.gpkg", "GPKG")
    assert [path.name for path in (tmp_path / name).iterdir()] == ["town.gpkg"]
    assert read_layer(folder / "town.gpkg").attributes["height"].tolist() == [9.0]
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a!b", "new\nline", "plain"])
def test_files_of_any_name_with_those_that_belong_to_them(tmp_path, name):
    # would catch a Shapefile without its attributes and projection
    write(tmp_path / "town.shp", "ESRI Shapefile")
    for path in list(tmp_path.iterdir()):
        path.rename(path.with_name(f"{name}{path.suffix}"))
    assert read_layer(tmp_path / f"{name}.shp").attributes["height"].tolist() == [9.0]
