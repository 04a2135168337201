"""
A whole run: from a small simulated earthquake to its tables, again, after a change, after a crash.

Covers per_obspy.runs.stages and per_obspy.progress too: every stage counts up to its size.
"""

import json
import os
import shutil
import subprocess
import sys
from collections import defaultdict
from functools import partial

import netCDF4
import numpy as np
import obspy
import pandas as pd
import pytest
from filelock import FileLock
from pyarrow import parquet

from per_obspy.config import Processing
from per_obspy.errors import CatalogError, FolderInUse
from per_obspy.results.table_files import rounded_table
from per_obspy.runs.output_folder import Result
from per_obspy.runs.process import process_records
from per_obspy.runs.run import report, run, screen
from per_obspy.runs.tasks.parallel import Workers
from per_obspy.runs.tasks.station import StationTask
from per_obspy.screening.columns import BY_CONTACT
from per_obspy.screening.ranking import STATES

from .small_run import SPECTRA, InProcess, write_configuration, write_folder_configuration

pytestmark = pytest.mark.usefixtures("plain_reports")


@pytest.fixture(scope="module")
def finished(small_run):
    """The run that modules share, its figures and page as they are."""
    record = json.loads((small_run / "out" / "run.json").read_text())
    return small_run, Result(small_run / "out", record, False)


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
        "stations.csv",
        "stations.columns.csv",
        "totals.csv",
        "rows.parquet",
        "rows.columns.csv",
        "buildings.parquet",
        "buildings.csv",
        "buildings.columns.csv",
        "report.html",
        "risk.kml",
        "summary.pdf",
        "summary.txt",
        "figures/overview.png",
        "figures/worst_pair.png",
        "worst_pairs.json",
    }
    assert set(result.record["outputs"]) == expected
    assert all((result.folder / name).stat().st_size for name in expected)


def test_no_pair_is_lost(finished):
    _, result = finished
    table = pd.read_parquet(result.folder / "risk.parquet")
    assert len(table) + result.record["counts"]["rejected_pair"] == 60
    assert table["rank"].tolist() == list(range(1, len(table) + 1))
    assert table["state"].isin(STATES).all()


def test_csv_and_parquet_hold_the_same(finished):
    _, result = finished
    parquet = pd.read_parquet(result.folder / "risk.parquet")
    csv = pd.read_csv(result.folder / "risk.csv", keep_default_na=False, na_values=[""])
    # a text that a reader can scan has few columns, and the table of columns names them
    assert len(csv.columns) <= 30
    explained = pd.read_csv(result.folder / "risk.columns.csv").set_index("name")
    assert set(csv) == set(explained.index[explained["in_csv"] == "yes"])
    numbers = parquet[csv.columns].select_dtypes("number").columns
    # half a unit of the last of five significant digits, of two by the contact law; seven decimals
    # of coordinates
    places = [name for name in numbers if name.startswith(("longitude", "latitude"))]
    impacts = numbers.intersection(list(BY_CONTACT))
    others = numbers.difference([*places, *impacts])
    compare = partial(pd.testing.assert_frame_equal, check_dtype=False)
    compare(csv[others], parquet[others], rtol=5e-5, atol=0)
    compare(csv[impacts], parquet[impacts], rtol=5e-2, atol=0)
    compare(csv[places], parquet[places], rtol=0, atol=5.1e-8)
    # and no digit is lost but by that rounding
    compare(csv[numbers], rounded_table(parquet[numbers]), check_exact=True)


def test_every_column_is_explained(finished):
    _, result = finished
    explained = pd.read_csv(result.folder / "risk.columns.csv")
    assert set(pd.read_parquet(result.folder / "risk.parquet").columns) <= set(explained["name"])
    assert explained["meaning"].str.len().min() > 5


def test_simulated_motion_is_marked_everywhere(finished):
    _, result = finished
    assert result.record["simulated"] is True
    table = pd.read_parquet(result.folder / "risk.parquet")
    assert table["flags"].str.contains("simulated").all()
    with netCDF4.Dataset(result.folder / "spectra.nc") as spectra:
        assert spectra.simulated == "true"
    # facts of the whole table
    metadata = parquet.read_schema(result.folder / "risk.parquet").metadata
    assert json.loads(metadata[b"per_obspy"])["simulated"] == "true"


def test_simulated_records_of_a_folder_are_marked_like_those_of_a_scenario(copied, tmp_path):
    # the folder of `per-obspy simulate`, copied, and what `per-obspy process` makes of it
    shutil.copytree(copied / "out" / "simulated", copied / "raw")
    process_records([copied / "raw"], copied / "clean", Processing(), None, False, Workers(1))
    for source in ("raw", "clean"):
        shutil.rmtree(tmp_path / "records", ignore_errors=True)
        shutil.copytree(copied / source, copied / "records")
        result = run(
            write_folder_configuration(copied, f"out-{source}", SPECTRA), executor=InProcess()
        )
        # in the record of the run, every row, the spectra and the facts of the table
        assert result.record["simulated"] is True
        assert result.record["counts"]["stations_simulated"] == 3
        table = pd.read_parquet(result.folder / "risk.parquet")
        assert table["flags"].str.split().map(lambda flags: "simulated" in flags).all()
        with netCDF4.Dataset(result.folder / "spectra.nc") as spectra:
            assert spectra.simulated == "true"
        metadata = parquet.read_schema(result.folder / "risk.parquet").metadata
        assert json.loads(metadata[b"per_obspy"])["simulated"] == "true"


def test_a_second_earthquake_in_the_folder_costs_no_station(copied):
    # would catch records of two earthquakes that are joined into one with a gap of hours
    shutil.copytree(copied / "out" / "simulated", copied / "records" / "main")
    later = copied / "records" / "later"
    later.mkdir()
    for path in (copied / "out" / "simulated").glob("*.S00[12].mseed"):
        stream = obspy.read(str(path))
        for trace in stream:
            trace.stats.starttime += 7200
        stream.write(str(later / path.name), format="MSEED")
    result = run(write_folder_configuration(copied, "both", SPECTRA), executor=InProcess())
    assert result.record["counts"]["stations"] == 3
    assert [group["screened"] for group in result.record["earthquakes"]] == [True, False]
    rejected = pd.read_csv(result.folder / "rejected.csv")
    assert (rejected["kind"] == "record").all()
    assert rejected["reasons"].str.startswith("belongs to another earthquake: starts").all()
    # three components of two stations
    assert len(rejected) == 6


def test_every_stage_counts_up_to_its_size(tmp_path):
    # would catch a stage that ends before its size, or begins after its first step
    calls = defaultdict(list)
    run(
        write_configuration(tmp_path),
        executor=InProcess(),
        progress=lambda stage, done, total: calls[stage].append((done, total)),
    )
    assert {"simulating records", "finding records", "stations", "screening"} < set(calls)
    for steps in calls.values():
        done, totals = zip(*steps, strict=True)
        assert done[0] == 0
        assert sorted(done) == list(done)
        assert set(totals) == {done[-1]}


def test_the_same_again_does_nothing(copied):
    progress = []
    result = run(
        copied / "run.toml", executor=InProcess(), progress=lambda *step: progress.append(step)
    )
    assert result.did_nothing
    assert not progress


def modules_after(code, folder):
    """Return the names of all modules that a process has loaded after some code, and its output."""
    listed = f"try:\n    {code}\nfinally:\n    print(*sys.modules, file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", f"import sys\n{listed}"],
        capture_output=True,
        text=True,
        check=True,
        cwd=folder,
    )
    return set(done.stderr.split()), done.stdout


#: Libraries of the stages, which take seconds to load.
OF_STAGES = {"obspy", "numba", "scipy", "matplotlib", "pandas", "xarray", "duckdb"}


def test_a_finished_run_answers_without_the_libraries_of_its_stages(copied):
    # catches any import on the way that makes people wait three seconds for "up to date"
    code = (
        "from per_obspy.cli.application import main; "
        "sys.argv = ['per-obspy', 'run', 'run.toml']; main()"
    )
    modules, output = modules_after(code, copied)
    assert output.startswith("Up to date")
    assert "The 10 worst pairs" in output
    assert not OF_STAGES & modules


def test_the_key_of_a_run_of_files_needs_no_library_of_its_stages(tmp_path):
    # catches a finished run of records, tables and footprints that is slower than a simulated one
    (tmp_path / "records").mkdir()
    (tmp_path / "records" / "one.mseed").write_bytes(b"one")
    (tmp_path / "pairs.csv").write_text("pair_id\n")
    text = 'name = "x"\noutput = "out"\n[records]\nfolder = "records"\n[pairs]\n'
    (tmp_path / "table.toml").write_text(f'{text}file = "pairs.csv"\n')
    (tmp_path / "drawn.toml").write_text(f'{text}footprints.file = "pairs.csv"\n')
    code = (
        "from per_obspy.runs.provenance import RunSettings; "
        "print(*(sorted(RunSettings(f'{n}.toml', None).head(None, {})['inputs']) "
        "for n in ('table', 'drawn')))"
    )
    modules, output = modules_after(code, tmp_path)
    assert output == "['pairs.csv', 'records/one.mseed'] ['pairs.csv', 'records/one.mseed']\n"
    assert not OF_STAGES & modules


def test_a_damaged_result_is_made_again(copied):
    before = (copied / "out" / "risk.csv").read_bytes()
    (copied / "out" / "risk.csv").write_bytes(before[:-20])
    result = run(copied / "run.toml", executor=InProcess())
    assert not result.did_nothing
    assert (copied / "out" / "risk.csv").read_bytes() == before
    assert result.record["counts"]["stations_resumed"] == 3


def test_a_refused_configuration_leaves_that_of_the_results(copied):
    # `report` and `screen` read it: a mistake of a later day would be theirs
    before = (copied / "out" / "configuration.toml").read_bytes()
    text = (copied / "run.toml").read_text() + '\n[report]\nbackground = "absent.pmtiles"\n'
    (copied / "run.toml").write_text(text)
    with pytest.raises(CatalogError, match=r"absent\.pmtiles"):
        run(copied / "run.toml", executor=InProcess())
    assert (copied / "out" / "configuration.toml").read_bytes() == before


def test_results_do_not_depend_on_the_day(copied):
    names = ("risk.csv", "risk.parquet", "spectra.nc", "totals.csv")
    before = {name: (copied / "out" / name).read_bytes() for name in names}
    shutil.rmtree(copied / "out")
    run(copied / "run.toml", executor=InProcess())
    assert {name: (copied / "out" / name).read_bytes() for name in names} == before


def test_a_killed_run_goes_on_where_it_stopped(copied, monkeypatch):
    shutil.rmtree(copied / "out" / "stations")
    (copied / "out" / "run.json").unlink()
    done = []

    def dies_at_the_third(job):
        if len(done) == 2:
            raise KeyboardInterrupt
        done.append(job.station)
        return work(job)

    # the run is interrupted, then goes on with two stations done
    work = StationTask.do
    monkeypatch.setattr(StationTask, "do", dies_at_the_third)
    with pytest.raises(KeyboardInterrupt):
        run(copied / "run.toml", executor=InProcess())
    assert json.loads((copied / "out" / "run.json").read_text())["state"] == "unfinished"
    monkeypatch.undo()
    result = run(copied / "run.toml", executor=InProcess())
    assert result.record["counts"]["stations_resumed"] == 2


def test_part_files_of_a_killed_run_do_not_hinder_the_next(copied):
    # would catch names of files that are parsed, and part files that are taken for stations
    out = copied / "out"
    # chunks know the path of their pair table, which the copy has changed
    (out / "run.json").unlink()
    run(copied / "run.toml", executor=InProcess())
    left = [out / "chunks" / ".000004.4194305.part.json", out / "stations" / ".S.4194305.part.json"]
    left += [out / "simulated" / ".XX.S001.4194305.part.mseed", out / ".risk.4194305.part.csv"]
    for path in left:
        path.write_bytes(b"{half")
    (out / "run.json").unlink()
    counts = run(copied / "run.toml", executor=InProcess()).record["counts"]
    assert (counts["stations"], counts["stations_resumed"], counts["chunks"]) == (3, 3, 1)
    # no process has a number above the largest of Linux, 2 ** 22
    assert not any(path.exists() for path in left)


@pytest.mark.parametrize("again", [screen, report])
def test_part_files_do_not_hinder_a_part_of_a_run(copied, again):
    # would catch a name of a part file taken for a station or a chunk; 4194305 is no process
    out = copied / "out"
    (out / "run.json").unlink()
    before = run(copied / "run.toml", executor=InProcess()).record["counts"]
    writers = {"dead": "4194305", "living": str(os.getpid()), "elsewhere": "1@another-machine"}
    parts = {name: f".XX.S003.{writer}.part.json" for name, writer in writers.items()}
    for path in parts.values():
        (out / "stations" / path).write_bytes(b"{half")
        (out / "chunks" / path).write_bytes(b"{half")
    (out / ".tmpabc.4194305.part").mkdir()
    after = again(copied / "run.toml").record["counts"]
    assert (after["pairs"], after["stations"]) == (before["pairs"], before["stations"])
    # of stations only what no process can still be writing is removed
    left = {name for name, path in parts.items() if (out / "stations" / path).exists()}
    assert left == {"living", "elsewhere"}
    assert not (out / "chunks" / parts["dead"]).exists()
    assert not (out / ".tmpabc.4194305.part").exists()


def test_changed_settings_are_not_resumed(copied):
    write_configuration(copied, "[processing]\nhighpass = 0.2\n")
    result = run(copied / "run.toml", executor=InProcess())
    assert result.record["counts"]["stations_resumed"] == 0


def test_an_unusable_record_does_not_stop_the_others(copied):
    records = copied / "records"
    shutil.copytree(copied / "out" / "simulated", records)
    # one station without motion, and a file that is no record
    victim = sorted(records.glob("*.mseed"))[0]
    stream = obspy.read(victim)
    for trace in stream:
        trace.data = np.zeros_like(trace.data)
    stream.write(victim, format="MSEED")
    (records / "notes.txt").write_text("not a record")
    file = write_folder_configuration(copied, "out2", SPECTRA)
    result = run(file, executor=InProcess())
    assert result.record["counts"]["stations"] == 2
    # each thing that was left out has a row with a reason
    rejected = pd.read_csv(result.folder / "rejected.csv")
    assert {"file", "record"} <= set(rejected["kind"])
    assert rejected["reasons"].str.len().min() > 5
    assert rejected[rejected["kind"] == "record"]["source"].str.contains(victim.name).all()


def test_nothing_usable_ends_with_reasons(copied):
    records = copied / "records"
    records.mkdir()
    header = {"station": "DEAD", "network": "XX", "channel": "HNE"}
    trace = obspy.Trace(np.zeros(4000, dtype=np.int32), header)
    trace.write(str(records / "dead.mseed"), format="MSEED")
    # neither coordinates nor motion
    result = run(write_folder_configuration(copied, "out3"), executor=InProcess())
    assert result.record["state"] == "nothing_usable"
    assert len(pd.read_csv(result.folder / "rejected.csv"))
    assert not (result.folder / "risk.csv").exists()


def test_a_second_run_in_the_same_folder_names_the_holder(copied):
    holder = '{"process": 4711, "host": "quake", "since": "2026-01-01"}'
    (copied / "out" / ".holder.json").write_text(holder)
    reason = r"another run holds this folder: process 4711 on quake since 2026-01-01"
    with FileLock(copied / "out" / ".lock"), pytest.raises(FolderInUse, match=reason):
        run(copied / "run.toml", executor=InProcess())
