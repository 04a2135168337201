"""Stations as jobs: station files and their status files, faults that cost one station only."""

import os
import pickle
from dataclasses import replace
from functools import partial

import pytest
import xarray as xr

from per_obspy.config import Processing, Scenario, Spectra
from per_obspy.errors import CatalogError, Unfinished, WriteError, WrongOutput
from per_obspy.records.earthquakes.quakeml import read_event_file
from per_obspy.records.folder import read_station
from per_obspy.records.sources import find_path_sources
from per_obspy.runs.tasks.parallel import DIED, Workers, finish
from per_obspy.runs.tasks.station import StationTask, earlier_station
from per_obspy.simulation.earthquake import simulate, write_simulation
from per_obspy.spectra.storage import read_spectra

GRID = Spectra(count=5, dampings=(0.05,), azimuth_step=90)


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    """A folder with two simulated stations, their metadata and their event."""
    folder = tmp_path_factory.mktemp("records")
    write_simulation(simulate(Scenario(stations=2, dt=0.02, magnitude=5.5)), folder)
    return folder


@pytest.fixture
def make_jobs(records, tmp_path):
    """Return a function that makes the jobs of both stations."""

    def make_jobs(**changes):
        # Records in the folder of the module, station files in that of the test
        found = find_path_sources([records])
        common = {"processing": Processing(), "spectra": GRID} | changes
        return [
            StationTask(
                station=name,
                source=source.files,
                inventory=source.inventory,
                event=read_event_file(records / "event.xml"),
                shard=tmp_path / f"{name}.nc",
                hashes=source.hashes,
                **common,
            )
            for name, source in sorted(found.stations.items())
        ]

    return make_jobs


def done(jobs, workers=1):
    return sorted(finish(jobs, Workers(workers)), key=lambda station: station.station)


def test_a_finished_station_carries_its_spectra_and_the_hash_of_its_shard(make_jobs):
    # would catch spectra that differ from those of the station file, which later stages do not read
    for first, again in zip(done(make_jobs()), done(make_jobs()), strict=True):
        assert (first.resumed, again.resumed) == (False, True)
        whole = read_spectra(first.shard)
        for station in (first, again):
            assert station.hash == first.hash
            xr.testing.assert_identical(station.spectra, whole[list(station.spectra.variables)])
        assert "acceleration" in whole
        assert "acceleration" not in first.spectra


def test_a_shard_knows_where_the_earthquake_started(make_jobs, records):
    origin = read_event_file(records / "event.xml").event.origins[0]
    attributes = done(make_jobs())[0].spectra.attrs
    assert attributes["hypocentre_depth"] == origin.depth
    assert attributes["hypocentre_longitude"] == origin.longitude


CHANGES = {
    "settings": {"processing": Processing(highpass=0.2)},
    "grid": {"spectra": GRID.model_copy(update={"count": 6})},
    "reader": {"reader": partial(read_station, start=None)},
}


@pytest.mark.parametrize("change", CHANGES)
def test_whatever_changes_a_shard_changes_its_key(make_jobs, change):
    done(make_jobs())
    assert not any(station.resumed for station in done(make_jobs(**CHANGES[change])))


def test_a_changed_file_is_read_again(make_jobs):
    first, second = make_jobs()
    done([first, second])
    again = done([replace(first, hashes=("another",) * len(first.hashes)), second])
    assert [station.resumed for station in again] == [False, True]


FAULTS = {
    "shard cut": lambda shard: shard.write_bytes(shard.read_bytes()[:-1]),
    "shard removed": lambda shard: shard.unlink(),
    "status removed": lambda shard: shard.with_suffix(".json").unlink(),
    "status cut": lambda shard: shard.with_suffix(".json").write_bytes(b'{"key": '),
    "status without rejections": lambda shard: shard.with_suffix(".json").write_text(
        '{"key": "x", "outputs": {}}'
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_station_that_is_not_whole_is_done_again(make_jobs, fault):
    before = [station.hash for station in done(make_jobs())]
    FAULTS[fault](make_jobs()[0].shard)
    again = done(make_jobs())
    assert [station.resumed for station in again] == [False, True]
    assert [station.hash for station in again] == before


def test_an_earlier_station_is_found_by_its_status(make_jobs):
    station = done(make_jobs())[0]
    found = earlier_station(station.shard.with_suffix(".json"))
    assert found[:2] == station[:2]
    assert found.hash == station.hash
    # a station file that was damaged since is an error
    station.shard.write_bytes(b"half")
    with pytest.raises(CatalogError, match="damaged: changed since the run wrote it"):
        earlier_station(station.shard.with_suffix(".json"))
    station.shard.with_suffix(".json").write_text("[]")
    with pytest.raises(CatalogError, match="not the note of a station"):
        earlier_station(station.shard.with_suffix(".json"))


@pytest.mark.usefixtures("forked")
def test_finished_stations_travel_to_other_processes(make_jobs):
    first = {station.station: station for station in finish(make_jobs(), Workers(2))}
    # the same job in this process
    for station in done([replace(job, shard=job.shard.with_stem("a")) for job in make_jobs()]):
        xr.testing.assert_identical(first[station.station].spectra, station.spectra)
        again = pickle.loads(pickle.dumps(station))
        xr.testing.assert_identical(again.spectra, station.spectra)


def empty_job(station, folder, **changes):
    """Return a job without files."""
    nothing = {"source": (), "inventory": None, "event": None, "shard": folder / f"{station}.nc"}
    settings = {"processing": Processing(), "spectra": Spectra()}
    return StationTask(station=station, **nothing | settings | changes)


class Poison:
    """Ends the process that unpickles it, as the system does with one that needs too much."""

    def __reduce__(self):
        return os._exit, (9,)


@pytest.mark.usefixtures("forked")
def test_a_worker_that_dies_takes_only_its_station_with_it(tmp_path):
    batch = [empty_job(f"XX.S{number}", tmp_path) for number in range(4)]
    batch[2] = replace(batch[2], reader=partial(read_station, Poison()))
    stations = list[str]()
    with pytest.raises(Unfinished) as unfinished:
        stations.extend(station.station for station in finish(batch, Workers(2)))
    # the guilty one has no result that a later run could take for one
    assert unfinished.value.faults == (f"station XX.S2: {DIED}",)
    assert sorted(stations) == ["XX.S0", "XX.S1", "XX.S3"]
    assert not batch[2].shard.with_suffix(".json").exists()


def test_a_full_disk_takes_no_resumed_station_with_it(make_jobs, monkeypatch):
    # Mutation: the earlier results are passed on after the next new one only
    first, second = make_jobs()
    done([first])

    def full(_task):
        raise WriteError("disk", "no space left")

    monkeypatch.setattr(StationTask, "do", full)
    stations = list[str]()
    with pytest.raises(WriteError):
        stations.extend(station.station for station in finish([first, second], Workers(1)))
    assert stations == [first.station]


def _raises(job):
    raise RuntimeError(f"no luck with {job.station}")


def test_whatever_a_worker_raises_becomes_a_reason(monkeypatch, tmp_path):
    monkeypatch.setattr(StationTask, "do", _raises)
    (station,) = finish([empty_job("XX.S1", tmp_path)], Workers(2))
    assert station.rejected[0].reasons == ("RuntimeError: no luck with XX.S1",)


def test_a_key_that_cannot_be_computed_costs_its_own_station(tmp_path):
    # would catch a run that ends with the metadata of one station
    batch = [empty_job("XX.S1", tmp_path, inventory=object()), empty_job("XX.S2", tmp_path)]
    stations = done(batch)
    assert [station.station for station in stations] == ["XX.S1", "XX.S2"]
    assert stations[0].rejected[0].reasons[0].startswith("AttributeError")


@pytest.mark.parametrize("suffix", [".nc", ".json"])
@pytest.mark.usefixtures("forked")
@pytest.mark.parametrize("workers", [1, 2])
def test_a_folder_in_the_place_of_a_station_file_is_no_property_of_the_station(
    make_jobs, suffix, workers
):
    # would catch a station that is rejected, and a run that ends as if all were well
    first, *others = make_jobs()
    (first.shard.with_suffix(suffix) / "inside").mkdir(parents=True)
    with pytest.raises(WrongOutput, match=rf"S001\{suffix}: cannot be written: Is a directory"):
        done([first, *others], workers)


@pytest.mark.parametrize(
    ("folder", "reason"),
    [("file", "(Not a directory|File exists)"), ("x" * 250, "File name too long"), ("loop", ".*")],
)
def test_a_folder_of_stations_that_cannot_be_is_no_property_of_them(
    make_jobs, tmp_path, folder, reason
):
    (tmp_path / "file").write_text("")
    (tmp_path / "loop").symlink_to("loop")
    name = "XX.S001.nc" if len(folder) < 10 else f"{folder}.nc"
    place = tmp_path / folder / name if len(folder) < 10 else tmp_path / name
    with pytest.raises(WrongOutput, match=f"cannot be written: .*{reason}") as error:
        done([replace(job, shard=place) for job in make_jobs()])
    assert "\n" not in str(error.value)
