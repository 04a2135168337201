"""
Assets of SimCenter: units, outlines in cells, broken and hostile files.

Covers per_obspy.inventory.importers.sources.simcenter.
"""

import json

import numpy as np
import pytest
from building_samples import brails_geojson, r2d_assets, simcenter_csv, small_town

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints
from per_obspy.inventory.importers import asset_json
from per_obspy.inventory.importers.asset_json import is_asset_json, read_asset_json
from per_obspy.inventory.importers.recognition import imported


def test_heights_are_in_the_unit_of_the_file(tmp_path):
    path = brails_geojson(tmp_path, small_town())
    content = json.loads(path.read_text())
    heights = {}
    for unit in ("ft", "m", "furlong", None):
        path.write_text(json.dumps(content | {"units": {"length": unit}}))
        table = imported(read_asset_json(path, "a").attributes, "a")
        heights[unit] = table["height"].tolist()[0]
    assert heights["ft"] == pytest.approx(12.0)
    assert heights["m"] == pytest.approx(12.0 / 0.3048)
    # a unit that is unknown makes a height unknown; the storeys remain
    assert np.isnan(heights["furlong"])
    assert np.isnan(heights[None])


def test_building_types_of_hazus(tmp_path):
    path = r2d_assets(tmp_path, small_town())
    text = path.read_text()
    for code, system in (
        ("C1", "concrete_mrf"),
        ("S1M", "steel_mrf"),
        ("URML", "other"),
        ("?", ""),
    ):
        path.write_text(text.replace('"StructureType": "C1"', f'"StructureType": "{code}"'))
        assert imported(read_asset_json(path, "a").attributes, "a")["system"].tolist()[0] == system


def test_a_single_asset_and_one_without_outline(tmp_path):
    assets = json.loads(r2d_assets(tmp_path, small_town()).read_text())
    path = tmp_path / "one.json"
    path.write_text(json.dumps(assets[0]))
    assert is_asset_json(path)
    assert read_asset_json(path, "one").geometries[0].geom_type == "Polygon"
    del assets[0]["GeneralInformation"]["Footprint"]
    path.write_text(json.dumps(assets[0]))
    assert read_asset_json(path, "one").geometries[0].geom_type == "Point"


@pytest.mark.parametrize(
    ("footprint", "reason"),
    [
        ("{", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ("3", "not a geometry"),
        ('{"type": "Polygon", "coordinates": [[["a", 1]]]}', "not a geometry"),
    ],
)
@pytest.mark.parametrize("write", [r2d_assets, simcenter_csv])
def test_a_broken_outline_loses_its_own_building(tmp_path, write, footprint, reason):
    path = write(tmp_path, small_town())
    if path.suffix == ".json":
        assets = json.loads(path.read_text())
        assets[3]["GeneralInformation"]["Footprint"] = footprint
        path.write_text(json.dumps(assets))
    else:
        lines = path.read_text().splitlines()
        cell = footprint.replace('"', '""')
        lines[4] = lines[4].split('"{')[0] + f'"{cell}"'
        path.write_text("\n".join(lines))
    pairs = pairs_from_footprints(path)
    assert len(pairs) == 2
    (rejected,) = pairs.attrs["rejected"]
    assert (rejected.row, rejected.kind) == (4, "building")
    assert reason in rejected.reasons[0]


@pytest.mark.parametrize(
    "text",
    [
        '{"GeneralInformation": ',
        '{"GeneralInformation": ' + "[" * 100_000,
        '{"GeneralInformation": ' + "9" * 5000 + "}",
        '["GeneralInformation", 3]',
        '{"GeneralInformation": 3}',
        '{"features": {"GeneralInformation": 3}}',
        '{"features": [], "GeneralInformation": 3}',
    ],
)
def test_damaged_files_end_in_one_line(tmp_path, text):
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(CatalogError) as error:
        pairs_from_footprints(path)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 1200


def test_too_large_a_file_is_refused_unread(tmp_path, monkeypatch):
    monkeypatch.setattr(asset_json, "LARGEST", 1 << 10)
    with pytest.raises(CatalogError, match="split the file"):
        read_asset_json(r2d_assets(tmp_path, small_town()), "a")
