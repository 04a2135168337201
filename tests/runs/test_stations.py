"""The first stage: jobs of all stations, simulated records that are whole, an earlier run."""

import json
import shutil
from functools import partial

import pytest
import xarray as xr

from per_obspy.config import Processing, Run, Spectra, load
from per_obspy.errors import CatalogError, Rejection
from per_obspy.records.folder import read_station
from per_obspy.records.sources import StationSource
from per_obspy.runs.provenance import RunContext
from per_obspy.runs.stations import (
    all_rejections,
    find_station_tasks,
    finished_stations,
    simulated_motion,
    simulated_stations,
    station_tasks,
    stations_of_earlier_run,
)
from per_obspy.runs.tasks.parallel import Workers
from per_obspy.runs.tasks.station import FinishedStation

from .small_run import SPECTRA

SCENARIO = "[scenario]\nstations = 2\nmagnitude = 5.0\ndt = 0.02\n[pairs]\ncount = 2\n"


@pytest.fixture
def settings(tmp_path):
    """Settings of a simulated run whose output folder is that of the test."""
    (tmp_path / "scenario.toml").write_text(SCENARIO)
    text = f'name = "x"\noutput = "out"\nsimulation = "scenario.toml"\n{SPECTRA}'
    (tmp_path / "run.toml").write_text(text)
    return load(tmp_path / "run.toml", Run)


def found(settings):
    """Return the stages that were done, and the jobs."""
    stages = []

    def progress(stage, done, total):
        if done == total:
            stages.append(stage)

    return stages, find_station_tasks(
        RunContext(settings, settings.output, Workers(1, progress=progress)), None
    )


def test_every_station_has_a_job_with_the_hashes_of_its_files(settings):
    stages, (jobs, rejected, hashes, earthquakes, known) = found(settings)
    assert stages == ["simulating records", "finding records"]
    assert [job.station for job in jobs] == ["XX.S001", "XX.S002"]
    assert rejected == []
    assert known.expected == known.received == ("XX.S001", "XX.S002")
    assert [group["stations"] for group in earthquakes] == [2]
    # hashes of the records and of the event are known, so that no file is read for them again
    for job in jobs:
        assert job.event.hash == hashes[job.event.path]
        assert job.hashes == tuple(hashes[path] for path in job.source)
        assert job.shard == settings.output / "stations" / f"{job.station}.nc"


def test_simulated_stations_are_counted_by_their_spectra():
    marked, real = (
        FinishedStation("N.A", None, (), False, spectra=xr.Dataset(attrs={"simulated": mark}))
        for mark in ("true", "false")
    )
    unusable = FinishedStation("N.B", None, (), False)
    assert simulated_stations([marked, real, unusable]) == 1
    assert simulated_stations([real, unusable]) == 0


@pytest.mark.parametrize(("kind", "expected"), [("SCENARIO", True), ("ACTUAL", False)])
def test_a_scenario_shakemap_is_simulated_motion(tmp_path, kind, expected):
    grid = tmp_path / "grid.xml"
    grid.write_text(f'<?xml version="1.0"?>\n<shakemap_grid shakemap_event_type="{kind}">')
    pairs = {"file": tmp_path / "pairs.csv"}
    settings = Run(name="x", output=tmp_path, records={"shakemap": grid}, pairs=pairs)
    assert simulated_motion(settings, []) is expected


def test_simulated_records_are_kept(settings):
    before = found(settings)[1].hashes
    stages, jobs = found(settings)
    assert stages == ["finding records"]
    assert jobs.hashes == before


def change_a_sample(out):
    file = out / "simulated" / "XX.S001.mseed"
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)


FAULTS = {
    "changed file": change_a_sample,
    "missing file": lambda out: (out / "simulated" / "XX.S002.mseed").unlink(),
    "missing folder": lambda out: shutil.rmtree(out / "simulated"),
    "missing event": lambda out: (out / "simulated" / "event.xml").unlink(),
    "half a status": lambda out: (out / "simulated.json").write_text('{"key": '),
    "status of an older program": lambda out: (out / "simulated.json").write_text('{"key": "x"}'),
    "no status": lambda out: (out / "simulated.json").unlink(),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_simulated_records_that_are_not_whole_are_made_again(settings, fault):
    before = found(settings)[1].hashes
    FAULTS[fault](settings.output)
    stages, jobs = found(settings)
    assert stages == ["simulating records", "finding records"]
    assert jobs.hashes == before


def test_another_scenario_leaves_no_record_of_this_one(settings, tmp_path):
    found(settings)
    (tmp_path / "scenario.toml").write_text(SCENARIO.replace("stations = 2", "stations = 1"))
    stages, (jobs, _, hashes, *_) = found(settings)
    assert stages == ["simulating records", "finding records"]
    assert [job.station for job in jobs] == ["XX.S001"]
    # the status lists just what is there
    status = json.loads((settings.output / "simulated.json").read_text())
    assert set(status["outputs"].values()) == set(hashes.values())
    assert len(list((settings.output / "simulated").iterdir())) == len(hashes)


def test_an_earlier_run_has_its_stations(settings):
    _, (jobs, *_) = found(settings)
    done = finished_stations(jobs, Workers(1))
    (settings.output / "stations" / ".XX.S003.1.part.json").write_text("{")
    again = stations_of_earlier_run(settings.output)
    # would catch half a status that is taken for a station
    for before, after in zip(done, again, strict=True):
        assert after[:3] == before[:3]
    assert all(station.resumed for station in again)
    shutil.rmtree(settings.output / "stations")
    with pytest.raises(CatalogError, match="no stations here: run `per-obspy run` first"):
        stations_of_earlier_run(settings.output)


def test_jobs_are_sorted_and_named_by_their_stations(tmp_path):
    source = StationSource((), (), None, partial(read_station))
    stations = {"XX.B": source, ".A": source, "XX.A": source}
    jobs = station_tasks(stations, tmp_path, Processing(), Spectra())
    # a station without network is no hidden file
    assert [job.shard.name for job in jobs] == ["A.nc", "XX.A.nc", "XX.B.nc"]


def test_rejections_of_sources_come_before_those_of_stations():
    rows = [Rejection("station", name, "", None, ("why",)) for name in "abc"]
    stations = [FinishedStation("XX.A", None, (rows[1],), False)]
    stations.append(FinishedStation("XX.B", None, (rows[2],), True))
    assert all_rejections(rows[:1], stations) == rows
