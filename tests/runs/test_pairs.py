"""Pairs of a run: from a table, stored inventories, or simulated around stations."""

import datetime
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from per_obspy.config import Run, load
from per_obspy.errors import CatalogError
from per_obspy.inventory.catalogue import Origin, add_inventory
from per_obspy.runs.pairs import named_files, pair_files
from per_obspy.runs.tasks.ground_files import StationFile
from per_obspy.simulation.buildings import simulated_pairs

from .small_run import write_configuration

#: Two stations, on rock and on soil, 11 km from each other.
STATIONS = [
    StationFile("XX.S1", 0.3, 0.0, "rock", Path("a.nc"), ""),
    StationFile("XX.S2", 0.4, 0.0, "soil", Path("b.nc"), ""),
]


def settings(folder, text):
    return load(write_configuration(folder, text), Run)


def test_a_table_is_taken_as_it_is(tmp_path):
    found = pair_files(settings(tmp_path, '[pairs]\nfile = "town.csv"\n'), tmp_path, [])
    assert found == [tmp_path / "town.csv"]


def test_simulated_pairs_are_on_the_ground_of_their_station(tmp_path):
    (file,) = pair_files(settings(tmp_path, ""), tmp_path, STATIONS)
    table = pd.read_csv(file)
    assert len(table) == 60
    # the nearest of two stations at the same latitude
    expected = np.where(table["longitude_1"] < 0.35, "rock", "soil")
    assert table["site_class"].tolist() == expected.tolist()
    assert {"rock", "soil"} == set(expected)


def test_without_known_ground_pairs_have_none(tmp_path):
    stations = [station._replace(site_class="") for station in STATIONS]
    (file,) = pair_files(settings(tmp_path, ""), tmp_path, stations)
    assert "site_class" not in pd.read_csv(file)


def test_nothing_is_simulated_around_no_station(tmp_path):
    with pytest.raises(CatalogError, match="pairs: no station has coordinates"):
        pair_files(settings(tmp_path, ""), tmp_path, [])


@pytest.fixture
def catalog(tmp_path):
    """Three stored inventories: two around the stations, one far away."""
    for name, longitude in (("west", 0.3), ("east", 0.4), ("far", 10.0)):
        table = simulated_pairs([longitude], [0.0], 10, seed=1, radius=2000.0, touching=0.5)
        table.to_csv(tmp_path / f"{name}.csv", index=False)
        # The index has name, source, licence, date and region of each
        origin = Origin(name, "a test", "none", datetime.date(2026, 1, 1))
        add_inventory(tmp_path / "catalog.toml", tmp_path / f"{name}.csv", origin)
    return tmp_path / "catalog.toml"


def names(files):
    return sorted(file.stem for file in files)


def test_stored_inventories_are_found_by_region(catalog, tmp_path):
    # would catch a catalogue that is read whole
    region = settings(tmp_path, f'[pairs]\ncatalog = "{catalog.name}"\n')
    assert names(pair_files(region, tmp_path, STATIONS)) == ["east", "west"]
    beyond = [STATIONS[0]._replace(longitude=50.0)]
    with pytest.raises(CatalogError, match="no stored inventory touches the region"):
        pair_files(region, tmp_path, beyond)


def test_stored_inventories_are_found_by_name(catalog, tmp_path):
    named = settings(tmp_path, f'[pairs]\ncatalog = "{catalog.name}"\nnames = ["far"]\n')
    assert names(pair_files(named, tmp_path, STATIONS)) == ["far"]
    with pytest.raises(CatalogError, match=r"'wst' is not stored here, did you mean west\?"):
        named_files(["wst"], catalog)


def test_a_stored_inventory_that_has_changed_is_refused(catalog, tmp_path):
    (tmp_path / "west.csv").write_text("changed")
    with pytest.raises(CatalogError, match="changed or damaged since it was stored as 'west'"):
        named_files(["west"], catalog)
