"""Spectra alone: one file of all stations, no work done twice, figures."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from obspy import Stream, Trace

import per_obspy
from per_obspy.config import Processing, Scenario, Spectra
from per_obspy.errors import CatalogError
from per_obspy.records.processed_files import write_description, write_processed
from per_obspy.runs.process import plot_station, spectra_of
from per_obspy.runs.stations import file_stem
from per_obspy.runs.tasks.parallel import Workers
from per_obspy.simulation.earthquake import simulate, write_simulation
from per_obspy.spectra.storage import read_spectra, region, write_spectra

GRID = Spectra(count=8, dampings=(0.05,), azimuth_step=90)


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    """A folder with two simulated stations and a file that is no record."""
    folder = tmp_path_factory.mktemp("records")
    write_simulation(simulate(Scenario(stations=2, dt=0.02, magnitude=5.5)), folder)
    (folder / "notes.txt").write_text("bring an umbrella")
    return folder


def spectra(records, folder):
    return spectra_of([records], folder / "spectra.nc", Processing(), GRID, Workers(1))


def test_one_file_holds_the_spectra_of_all_shards(records, tmp_path):
    done, rejected = spectra(records, tmp_path)
    assert [station.station for station in done] == ["XX.S001", "XX.S002"]
    joined = read_spectra(tmp_path / "spectra.nc")
    xr.testing.assert_identical(joined, region(read_spectra(station.shard) for station in done))
    # what was left out is a table too
    assert [row.kind for row in rejected] == ["file"]
    assert pd.read_csv(tmp_path / "spectra.rejected.csv")["name"].tolist() == ["notes.txt"]


def test_the_same_again_has_the_same_file(records, tmp_path):
    spectra(records, tmp_path)
    before = (tmp_path / "spectra.nc").read_bytes()
    done, _ = spectra(records, tmp_path)
    assert all(station.resumed for station in done)
    assert (tmp_path / "spectra.nc").read_bytes() == before


def test_a_part_file_of_a_killed_process_is_removed(records, tmp_path):
    # no process has a number above the largest of Linux, 2 ** 22
    left = tmp_path / "spectra.stations" / ".XX.S001.4194305.part.nc"
    left.parent.mkdir()
    left.write_bytes(b"half")
    spectra(records, tmp_path)
    assert not left.exists()


def test_files_of_a_station_in_several_sources_are_joined(records, tmp_path):
    sources = [records / "XX.S001.mseed", records / "stations.xml", records]
    with pytest.raises(CatalogError, match="there is only metadata"):
        spectra_of(sources, tmp_path / "a.nc", Processing(), GRID, Workers(1))
    sources = [records, records / "XX.S001.mseed"]
    done, _ = spectra_of(sources, tmp_path / "a.nc", Processing(), GRID, Workers(1))
    # metadata of the folder serves the single file
    assert [station.shard is not None for station in done] == [True, True]


def test_a_station_is_drawn(records, tmp_path):
    done, _ = spectra(records, tmp_path)
    files = plot_station(done[0].shard, 0.05, 1.0, tmp_path)
    assert [file.name for file in files] == ["XX.S001.spectra.png", "XX.S001.state_space.png"]
    assert all(file.read_bytes().startswith(b"\x89PNG") for file in files)


def test_figures_of_a_station_without_network_are_no_hidden_files(tmp_path, monkeypatch):
    # would catch: the dot before the station as the start of a file's name
    monkeypatch.setattr("per_obspy.runs.process.draw_spectra", lambda *_: None)
    monkeypatch.setattr("per_obspy.runs.process.draw_state_space", lambda *_: None)
    motion = np.random.default_rng(3).normal(size=2000)
    trace = Trace(motion, {"station": "ELC", "channel": "HNN", "delta": 0.01, "units": "m/s2"})
    write_spectra(per_obspy.station_spectra(trace), tmp_path / "ELC.nc")
    files = plot_station(tmp_path / "ELC.nc", 0.05, 1.0, tmp_path)
    assert [file.name for file in files] == ["ELC.spectra.png", "ELC.state_space.png"]


def test_no_station_writes_or_removes_outside_the_shards(tmp_path):
    # a description may hold any codes
    (tmp_path / "in").mkdir()
    header = {"network": "XX", "station": "S001", "channel": "HNE", "delta": 0.01, "units": "m/s2"}
    stream = Stream([Trace(np.sin(np.arange(3000) / 20), header)])
    facts = write_processed(stream, tmp_path / "in" / "a.mseed")
    facts["traces"][0] |= {"network": "XX_/../..", "station": "victim"}
    write_description(tmp_path / "in" / "a.mseed", facts)
    # files that station file and status would replace
    for name in ("victim.nc", "victim.json"):
        (tmp_path / name).write_text("valuable")
    (tmp_path / "out").mkdir()
    done, rejected = spectra(tmp_path / "in", tmp_path / "out")
    assert done == []
    assert "network code 'XX_/': expected letters" in rejected[0].reasons[0]
    assert {(tmp_path / f"victim.{suffix}").read_text() for suffix in ("nc", "json")} == {
        "valuable"
    }


def test_stations_with_half_of_the_codes_have_files_of_their_own():
    names = [".ABC", "ABC.", ".", "AB.C"]
    assert len({file_stem(name) for name in names}) == len(names)
    assert not any(file_stem(name).startswith(".") for name in names)
