"""
A fault of the machine leaves a run unfinished, never complete with fewer results.

The exit code is 75, the state in ``run.json`` is ``unfinished``, and the next run ends as if there
had been no fault.
"""

import errno
import json
import os
import shutil
from pathlib import Path

import pytest

from per_obspy.errors import Unfinished
from per_obspy.records import archive
from per_obspy.runs.run import run
from per_obspy.runs.tasks import chunk, ground_files, station

from .small_run import InProcess, write_configuration, write_smallest_configuration

#: Results that must be the same as without a fault.
COMPARED = ("risk.csv", "risk.parquet", "rejected.csv", "totals.csv", "stations.csv")


pytestmark = pytest.mark.usefixtures("plain_reports")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished run of one station."""
    folder = tmp_path_factory.mktemp("whole")
    run(write_smallest_configuration(folder), executor=InProcess())
    return folder


def system_error(number):
    def fails(*_, **__):
        raise OSError(number, os.strerror(number), "a file")

    return fails


def no_memory(*_, **__):
    raise MemoryError("an array")


#: What fails, and how: at a record, a station file, a chunk, and when a chunk reads a station file.
FAULTS = {
    "record not opened": (archive, "_archive_of", system_error(errno.EMFILE)),
    "shard not read back": (station, "file_hash", system_error(errno.EIO)),
    "part not written": (chunk, "write_part", system_error(errno.EIO)),
    "memory for pairs": (chunk, "risk_rows", no_memory),
    "shard vanished": (ground_files, "read_spectra", system_error(errno.ENOENT)),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_passing_fault_leaves_a_run_unfinished(call, whole, tmp_path, monkeypatch, name):
    # would catch "complete" without these pairs, and "Up to date" afterwards
    shutil.copytree(whole, tmp_path, dirs_exist_ok=True)
    for made in ("stations", "chunks"):
        shutil.rmtree(tmp_path / "out" / made)
    (tmp_path / "out" / "run.json").unlink()
    ground_files.read_station_once.cache_clear()
    module, function, fault = FAULTS[name]
    monkeypatch.setattr(module, function, fault)
    code, _, errors = call("run", tmp_path / "run.toml")
    assert code == 75, errors
    assert errors.strip().splitlines()[-1].startswith("per-obspy: ")
    assert json.loads((tmp_path / "out" / "run.json").read_text())["state"] == "unfinished"
    assert not (tmp_path / "out" / "risk.csv").exists()
    # The next run ends as if there had been no fault
    monkeypatch.undo()
    code, output, errors = call("run", tmp_path / "run.toml")
    assert code == 0, errors
    assert "Up to date" not in output
    for file in COMPARED:
        assert (tmp_path / "out" / file).read_bytes() == (whole / "out" / file).read_bytes()


def test_all_other_stations_are_kept_and_screening_waits(call, tmp_path, monkeypatch):
    # would catch pairs that are screened by the farther station because the nearest one failed
    configuration = write_configuration(tmp_path)
    computed = station.station_spectra

    def fails_for_one(stream, *others):
        if stream[0].stats.station == "S002":
            raise MemoryError("an array")
        return computed(stream, *others)

    monkeypatch.setattr(station, "station_spectra", fails_for_one)
    with pytest.raises(Unfinished) as unfinished:
        run(configuration, executor=InProcess())
    assert unfinished.value.faults == ("station XX.S002: not enough memory: an array",)
    monkeypatch.undo()
    # Neither the later stages nor the report begin without the station
    for command in ("screen", "report"):
        code, _, errors = call(command, configuration)
        assert code == 2
        assert "unfinished" in errors.strip().splitlines()[-1]
    counts = run(configuration, executor=InProcess()).record["counts"]
    assert (counts["stations"], counts["stations_resumed"]) == (3, 2)


def test_the_number_of_rows_outlives_an_unfinished_run(whole, tmp_path, monkeypatch):
    # would catch a pair table that was half saved while the run before was killed
    shutil.copytree(whole, tmp_path, dirs_exist_ok=True)
    table = Path(tmp_path / "folder.toml")
    table.write_text(
        (tmp_path / "run.toml")
        .read_text()
        .replace("[spectra]", '[pairs]\nfile = "p.csv"\n[spectra]')
    )
    lines = (tmp_path / "out" / "pairs.csv").read_text().splitlines(keepends=True)
    (tmp_path / "p.csv").write_text("".join(lines[:-1]))
    monkeypatch.setattr(chunk, "risk_rows", no_memory)
    with pytest.raises(Unfinished):
        run(table, executor=InProcess())
    monkeypatch.undo()
    (sentence,) = run(table, executor=InProcess()).record["losses"]
    assert f"hold {len(lines) - 2} rows, {len(lines) - 1} in the previous run" in sentence
