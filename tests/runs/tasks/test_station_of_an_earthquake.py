"""An updated earthquake: stations whose processing it does not change are not processed again."""

import json

import pytest

from per_obspy.config import Processing, Scenario, Spectra
from per_obspy.records.earthquakes.quakeml import EventFile
from per_obspy.records.sources import find_path_sources
from per_obspy.runs.tasks import station as jobs
from per_obspy.runs.tasks.parallel import Workers, finish
from per_obspy.runs.tasks.station import StationTask
from per_obspy.simulation.earthquake import simulate, write_simulation

GRID = Spectra(count=5, dampings=(0.05,), azimuth_step=90)


@pytest.fixture(scope="module")
def region(tmp_path_factory):
    """Sources of two simulated stations, and their earthquake."""
    folder = tmp_path_factory.mktemp("records")
    simulation = simulate(Scenario(stations=2, dt=0.02, magnitude=5.5))
    write_simulation(simulation, folder)
    return find_path_sources([folder]), simulation.event


def job_list(region, folder, event):
    found, _ = region
    common = {"event": event, "processing": Processing(), "spectra": GRID}
    return [
        StationTask(
            station=name,
            source=source.files,
            inventory=source.inventory,
            hashes=source.hashes,
            shard=folder / f"{name}.nc",
            **common,
        )
        for name, source in sorted(found.stations.items())
    ]


def updated(region, **changes):
    """Return the earthquake with other facts, as a file of another hash."""
    event = region[1].copy()
    for name, value in changes.items():
        if name == "magnitude":
            event.magnitudes[0].mag = value
        else:
            event.origins[0][name] = value
    return EventFile("event.xml", repr(changes), event)


def content(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


ORIGIN = {"latitude": 0.03, "depth": 9_000.0}


@pytest.fixture(scope="module")
def finished(region, tmp_path_factory):
    """A folder with stations of the first facts."""
    folder = tmp_path_factory.mktemp("stations")
    list(finish(job_list(region, folder, updated(region)), Workers(1)))
    return folder


@pytest.mark.parametrize(
    "changes", [{"magnitude": 7.2}, {**ORIGIN, "magnitude": 5.9}], ids=["magnitude", "origin"]
)
def test_an_update_processes_no_station_and_leaves_the_files_of_a_fresh_run(
    region, finished, tmp_path, monkeypatch, changes
):
    kept, fresh = tmp_path / "kept", tmp_path / "fresh"
    fresh.mkdir()
    kept.mkdir()
    for name, text in content(finished).items():
        (kept / name).write_bytes(text)
    list(finish(job_list(region, fresh, updated(region, **changes)), Workers(1)))
    # Neither its records are read nor are they processed
    with monkeypatch.context() as patch:
        patch.setattr(jobs, "_products", lambda *_: 1 / 0)
        done = list(finish(job_list(region, kept, updated(region, **changes)), Workers(1)))
    assert [station.resumed for station in done] == [True, True]
    assert content(kept) == content(fresh)
    if "latitude" in changes:
        assert [one.spectra.attrs["hypocentre_depth"] for one in done] == [9_000.0] * 2
        assert content(kept) != content(finished)
    else:
        assert [one.hash for one in done] == [
            json.loads((finished / f"{one.station}.json").read_text())["shard"] for one in done
        ]


def test_an_update_that_moves_the_first_wave_processes_again(region, finished, tmp_path):
    for name, text in content(finished).items():
        (tmp_path / name).write_bytes(text)
    time = region[1].origins[0].time - 25.0
    done = list(finish(job_list(region, tmp_path, updated(region, time=time)), Workers(1)))
    assert [station.resumed for station in done] == [False, False]


@pytest.mark.parametrize("changes", [{"depth": None}, None], ids=["no depth", "no earthquake"])
def test_an_unknown_hypocentre_processes_again(region, finished, tmp_path, changes):
    # would catch: a hypocentre of the past in the station files
    for name, text in content(finished).items():
        (tmp_path / name).write_bytes(text)
    event = None if changes is None else updated(region, **changes)
    done = list(finish(job_list(region, tmp_path, event), Workers(1)))
    assert [station.resumed for station in done] == [False, False]
    assert all("hypocentre_depth" not in station.spectra.attrs for station in done)
