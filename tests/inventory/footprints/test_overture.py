"""Buildings of a box from Overture Maps: its package reads a store of files that stands here."""

import io
import json

import pytest
from building_samples import overture, small_town
from pyarrow.fs import LocalFileSystem, SubTreeFileSystem

from per_obspy.inventory.files.reading import read_pairs
from per_obspy.inventory.footprints.layer_files import read_raw_layer

RELEASE = "2026-11-18.0"


@pytest.fixture
def store(monkeypatch, tmp_path):
    """Put the town into a folder in place of the store, and a catalogue in place of the service."""
    core = pytest.importorskip("overturemaps.core")
    place = tmp_path / f"overturemaps-us-west-2/release/{RELEASE}/theme=buildings/type=building"
    place.mkdir(parents=True)
    overture(place, small_town())
    catalogue = {"latest": RELEASE, "links": []}

    def answer(address):
        if not address.endswith("catalog.json"):
            raise OSError("no index here")  # the package then looks through all files
        return io.BytesIO(json.dumps(catalogue).encode())

    monkeypatch.setattr(core, "urlopen", answer)
    monkeypatch.setattr(core, "_cached_stac_catalog", None)
    local = SubTreeFileSystem(str(tmp_path), LocalFileSystem())
    monkeypatch.setattr(core.fs, "S3FileSystem", lambda **_: local)
    return catalogue


@pytest.mark.usefixtures("store")
def test_pairs_of_a_box_without_a_file(call, tmp_path):
    output = tmp_path / "out" / "town.parquet"
    code, out, err = call("pairs", "--bbox", "19.9,9.9,20.1,10.1", "-o", output, "--json")
    assert code == 0
    assert json.loads(out)["pairs"] == 2
    path = tmp_path / "out" / f"town.overture-{RELEASE}.parquet"
    assert str(path) in err
    assert sorted({*read_pairs(output)["building_id_1"]}) == ["b1", "b2"]
    # as if the file had been at hand
    whole = next(tmp_path.rglob("type=building/*.parquet"))
    assert read_raw_layer(path, None).attributes.equals(read_raw_layer(whole, None).attributes)


@pytest.mark.usefixtures("store")
def test_too_many_buildings_leave_no_file(call, tmp_path, monkeypatch):
    monkeypatch.setattr("per_obspy.inventory.footprints.overture.MOST_BUILDINGS", 3)
    code, _, err = call("pairs", "--bbox", "19.9,9.9,20.1,10.1", "-o", tmp_path / "a.parquet")
    assert code == 2
    assert "gives more than 3 buildings: take a smaller box" in err
    assert not list(tmp_path.glob("*.parquet"))


def test_a_box_without_buildings_and_a_store_that_is_not_there(call, store, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = call("pairs", "--bbox", "0,0,1,1")
    assert code == 2
    assert f"Overture Maps {RELEASE}: gives no building of the box" in err
    assert not list(tmp_path.glob("*.parquet"))
    store["latest"] = "../../etc"
    from overturemaps import core

    monkeypatch.setattr(core, "_cached_stac_catalog", None)
    code, _, err = call("pairs", "--bbox", "0,0,1,1")
    assert code == 75
    assert "the latest release is '../../etc'" in err
    monkeypatch.setattr(core, "_cached_stac_catalog", None)
    monkeypatch.setattr(core, "urlopen", lambda _: (_ for _ in ()).throw(OSError("no route")))
    code, _, err = call("pairs", "--bbox", "0,0,1,1")
    assert code == 75
    assert "no route" in err


def test_neither_a_layer_nor_a_box(call):
    code, _, err = call("pairs", "--distance", "2")
    assert code == 2
    assert "give a layer, or --bbox" in err
