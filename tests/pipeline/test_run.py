"""A whole run: from a small simulated earthquake to its tables, again, after a change, after a crash, and at once."""

import json
import os
import shutil
from concurrent.futures import Executor, Future
from pathlib import Path

import netCDF4
import numpy as np
import obspy
import pandas as pd
import pytest
from filelock import FileLock
from pyarrow import parquet

from per_obspy.config import Processing, Spectra
from per_obspy.errors import CatalogError
from per_obspy.jobs import station as jobs
from per_obspy.pipeline.run import run

SCENARIO = "[scenario]\nstations = 3\nmagnitude = 6.5\ndt = 0.02\n[pairs]\ncount = 60\n"
SPECTRA = "[spectra]\ncount = 12\ndampings = [0.05]\nazimuth_step = 30\n"


class Here(Executor):
    """Do the work at once in this process: no test needs more, but the one of the pool."""

    def submit(self, function, /, *arguments):
        future = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:  # noqa: BLE001 - whatever it is, its result raises it
            future.set_exception(error)
        return future


def _configuration(folder: Path, text: str = "") -> Path:
    (folder / "scenario.toml").write_text(SCENARIO)
    file = folder / "run.toml"
    file.write_text(
        f'name = "small"\noutput = "out"\nsimulation = "scenario.toml"\n{text}{SPECTRA}'
    )
    return file


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    return folder, run(_configuration(folder), executor=Here())


@pytest.fixture
def copied(finished, tmp_path):
    """A finished run of one's own to change."""
    shutil.copytree(finished[0], tmp_path, dirs_exist_ok=True)
    return tmp_path


def test_every_result_is_there(finished):
    _, result = finished
    expected = {
        "risk.csv",
        "risk.parquet",
        "risk.columns.csv",
        "spectra.nc",
        "rejected.csv",
        "totals.csv",
        "figures/overview.png",
        "figures/worst_pair.png",
    }
    assert set(result.record["outputs"]) == expected
    assert all((result.folder / name).stat().st_size for name in expected)
    assert json.loads((result.folder / "run.json").read_text()) == result.record


def test_no_pair_is_lost(finished):
    _, result = finished
    table = pd.read_parquet(result.folder / "risk.parquet")
    assert len(table) + result.record["counts"]["rejected_pair"] == 60
    assert table["rank"].tolist() == list(range(1, len(table) + 1))
    assert table["state"].isin(["yes", "possible", "no"]).all()


def test_csv_and_parquet_hold_the_same(finished):
    _, result = finished
    parquet = pd.read_parquet(result.folder / "risk.parquet")
    csv = pd.read_csv(
        result.folder / "risk.csv", keep_default_na=False, na_values=[""], dtype={"derived": str}
    )
    assert csv.columns.tolist() == parquet.columns.tolist()
    numbers = parquet.select_dtypes("number").columns
    pd.testing.assert_frame_equal(
        csv[numbers], parquet[numbers], check_dtype=False, rtol=1e-12
    )  # decimal round trip


def test_every_column_is_explained(finished):
    _, result = finished
    explained = pd.read_csv(result.folder / "risk.columns.csv")
    assert set(pd.read_parquet(result.folder / "risk.parquet").columns) <= set(explained["name"])
    assert explained["meaning"].str.len().min() > 5


def test_simulated_motion_is_said_everywhere(finished):
    _, result = finished
    assert result.record["simulated"] is True
    table = pd.read_parquet(result.folder / "risk.parquet")
    assert table["flags"].str.contains("simulated").all()
    with netCDF4.Dataset(result.folder / "spectra.nc") as spectra:
        assert spectra.simulated == "true"
    said = json.loads(parquet.read_schema(result.folder / "risk.parquet").metadata[b"per_obspy"])
    assert said["simulated"] == "true"


def test_the_same_again_does_nothing(copied):
    progress = []
    result = run(copied / "run.toml", executor=Here(), progress=lambda *told: progress.append(told))
    assert result.did_nothing
    assert not progress


def test_a_damaged_result_is_made_again(copied):
    before = (copied / "out" / "risk.csv").read_bytes()
    (copied / "out" / "risk.csv").write_bytes(before[:-20])
    result = run(copied / "run.toml", executor=Here())
    assert not result.did_nothing
    assert (copied / "out" / "risk.csv").read_bytes() == before
    assert result.record["counts"]["stations_resumed"] == 3


def test_results_do_not_depend_on_the_day(copied):
    before = {name: (copied / "out" / name).read_bytes() for name in ("risk.csv", "risk.parquet")}
    shutil.rmtree(copied / "out")
    run(copied / "run.toml", executor=Here())
    assert {name: (copied / "out" / name).read_bytes() for name in before} == before


def test_a_killed_run_goes_on_where_it_stopped(copied, monkeypatch):
    shutil.rmtree(copied / "out" / "stations")
    (copied / "out" / "run.json").unlink()
    done = []

    def dies_at_the_third(job):
        if len(done) == 2:
            raise KeyboardInterrupt
        done.append(job.station)
        return work(job)

    work = jobs.do_station
    monkeypatch.setattr(jobs, "do_station", dies_at_the_third)
    with pytest.raises(KeyboardInterrupt):
        run(copied / "run.toml", executor=Here())
    assert not (copied / "out" / "run.json").exists()
    monkeypatch.undo()
    assert run(copied / "run.toml", executor=Here()).record["counts"]["stations_resumed"] == 2


def test_changed_settings_are_not_resumed(copied):
    _configuration(copied, "[processing]\nhighpass = 0.2\n")
    assert run(copied / "run.toml", executor=Here()).record["counts"]["stations_resumed"] == 0


def test_one_bad_record_does_not_stop_the_others(copied):
    records = copied / "records"
    shutil.copytree(copied / "out" / "simulated", records)
    victim = sorted(records.glob("*.mseed"))[0]
    stream = obspy.read(victim)
    for trace in stream:
        trace.data = np.zeros_like(trace.data)
    stream.write(victim, format="MSEED")
    (records / "notes.txt").write_text("not a record")
    file = copied / "folder.toml"
    file.write_text(
        f'name = "folder"\noutput = "out2"\n[records]\nfolder = "records"\n[pairs]\nfile = "out/pairs.csv"\n{SPECTRA}'
    )
    result = run(file, executor=Here())
    assert result.record["counts"]["stations"] == 2
    rejected = pd.read_csv(result.folder / "rejected.csv")
    assert {"file", "record"} <= set(rejected["kind"])
    assert rejected["reasons"].str.len().min() > 5
    assert rejected[rejected["kind"] == "record"]["source"].str.contains(victim.name).all()


def test_nothing_usable_ends_with_reasons(copied):
    records = copied / "records"
    records.mkdir()
    trace = obspy.Trace(
        np.zeros(4000, dtype=np.int32), {"station": "DEAD", "network": "XX", "channel": "HNE"}
    )
    trace.write(str(records / "dead.mseed"), format="MSEED")
    file = copied / "folder.toml"
    file.write_text(
        'name = "x"\noutput = "out3"\n[records]\nfolder = "records"\n[pairs]\nfile = "out/pairs.csv"\n'
    )
    result = run(file, executor=Here())
    assert result.record["state"] == "nothing_usable"
    assert len(pd.read_csv(result.folder / "rejected.csv"))
    assert not (result.folder / "risk.csv").exists()


def test_a_second_run_in_the_same_folder_is_told_who_holds_it(copied):
    (copied / "out" / ".holder.json").write_text(
        '{"process": 4711, "host": "quake", "since": "2026-01-01"}'
    )
    with (
        FileLock(copied / "out" / ".lock"),
        pytest.raises(
            CatalogError,
            match=r"another run holds this folder: process 4711 on quake since 2026-01-01",
        ),
    ):
        run(copied / "run.toml", executor=Here())


class Poison:
    """Ends the process that unpickles it, as the kernel does with one that takes too much memory."""

    def __reduce__(self):
        return os._exit, (9,)


def _job(station, folder, inventory=None):
    return jobs.Job(
        station,
        (),
        inventory,
        None,
        Processing(),
        Spectra(),
        folder / f"{station}.nc",
        simulated=False,
    )


def test_a_worker_that_dies_takes_only_its_station_with_it(tmp_path):
    some = [_job(f"XX.S{i}", tmp_path, Poison() if i == 2 else None) for i in range(4)]
    done = {one.station: one for one in jobs.do_stations(some, workers=2)}
    assert set(done) == {job.station for job in some}
    assert done["XX.S2"].rejected[0].reasons == ("its worker process died",)
    assert all("died" not in str(one.rejected) for name, one in done.items() if name != "XX.S2")


def _raises(job):
    raise RuntimeError(f"no luck with {job.station}")


def test_whatever_a_worker_raises_becomes_a_reason(monkeypatch, tmp_path):
    monkeypatch.setattr(jobs, "do_station", _raises)
    (done,) = jobs.do_stations([_job("XX.S1", tmp_path)], workers=2)
    assert done.rejected[0].reasons == ("RuntimeError: no luck with XX.S1",)
