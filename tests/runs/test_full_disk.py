"""
A disk that is full, or a file that cannot be written, ends every command alike.

One line names the file, the reason and the remedy; the exit code is 75; no half file stays, and
the same command succeeds when there is room.
"""

import json
import shutil
import subprocess
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from fdsn_server import serving

from per_obspy import reader_process
from per_obspy.config import Run, Scenario, load
from per_obspy.errors import WriteError
from per_obspy.files import is_part
from per_obspy.runs import report
from per_obspy.runs.run import run
from per_obspy.runs.tasks import station as jobs
from per_obspy.simulation.earthquake import simulate

from .small_run import (
    InProcess,
    write_configuration,
    write_smallest_configuration,
)

resource = pytest.importorskip("resource", reason="limits of files exist on POSIX only")

ENSEMBLE = (
    'name = "e"\noutput = "joined"\n[[scenario]]\nname = "a"\nrun = "run.toml"\nweight = 1.0\n'
)


FETCHED = """\
name = "fetched"
output = "out"
workers = 1
[pairs.simulated]
count = 4
[records.fdsn]
providers = ["{url}"]
cache = "cache"
event_id = "xx1"
event_provider = "{url}"
wait = 0.01
"""


@contextmanager
def no_room(size: int):
    """Let no file grow beyond some bytes, as if the disk were full then."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        # A process that was started meanwhile has the limit for ever
        reader_process._reader.end()


pytestmark = [pytest.mark.long, pytest.mark.usefixtures("plain_reports")]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished run of one station."""
    folder = tmp_path_factory.mktemp("whole")
    run(write_smallest_configuration(folder), executor=InProcess())
    return folder


@pytest.fixture
def copied(whole, tmp_path):
    shutil.copytree(whole, tmp_path, dirs_exist_ok=True)
    return tmp_path


def check_ending(called, folder):
    """Check the one line of a command that could not write, and that no half file is left."""
    code, _, errors = called
    line = errors.strip().splitlines()[-1]
    assert code == 75, errors
    assert line.startswith("per-obspy: "), errors
    assert "cannot be written: File too large; try again when there is room" in line
    assert not [path for path in folder.rglob("*") if is_part(path)]


#: Largest file (bytes): the first write, the simulated records, the station file, and tables fail.
SIZES = (0, 500, 8_000, 20_000, 40_000)


@pytest.mark.parametrize("size", SIZES)
def test_a_run_without_room_goes_on_when_there_is_room(call, whole, tmp_path, size):
    # would catch a table of some stations, a traceback, or "Up to date" afterwards
    configuration = write_smallest_configuration(tmp_path)
    with no_room(size):
        ending = call("run", configuration)
    check_ending(ending, tmp_path)
    assert not (tmp_path / "out" / "risk.csv").exists()
    assert call("run", configuration)[0] == 0
    expected = (whole / "out" / "risk.csv").read_bytes()
    assert (tmp_path / "out" / "risk.csv").read_bytes() == expected


def commands(folder: Path) -> dict[str, list[object]]:
    """Return other commands that write, by name."""
    (folder / "ensemble.toml").write_text(ENSEMBLE)
    records = folder / "out" / "simulated"
    return {
        "screen": ["screen", folder / "run.toml"],
        "report": ["report", folder / "run.toml"],
        "ensemble": ["screen", folder / "ensemble.toml"],
        "simulate": ["simulate", folder / "scenario.toml", "-o", folder / "made"],
        "process": ["process", records, "-o", folder / "processed"],
        "spectra": ["spectra", records, "-o", folder / "spectra.nc"],
    }


@pytest.mark.parametrize("name", ["screen", "report", "ensemble", "simulate", "process", "spectra"])
def test_other_commands_end_alike(call, copied, name):
    command = commands(copied)[name]
    with no_room(300):
        ending = call(*command)
    check_ending(ending, copied)
    assert call(*command)[0] == 0


@pytest.mark.parametrize("command", ["fetch", "run"])
@pytest.mark.parametrize("size", [0, 300, 3_000])
def test_records_that_cannot_be_fetched_into_the_cache_come_later(call, tmp_path, command, size):
    # would catch a station that a full disk makes one without data: the event, StationXML and
    # records do not fit, in this order
    with serving(simulate(Scenario(stations=2, dt=0.02, magnitude=5.0))) as server:
        (tmp_path / "run.toml").write_text(FETCHED.format(url=server.url))
        with no_room(size):
            ending = call(command, tmp_path / "run.toml")
        check_ending(ending, tmp_path)
        code, _, errors = call("fetch", tmp_path / "run.toml")
    assert code == 0, errors
    assert len(list((tmp_path / "cache").rglob("*.mseed"))) == 2


def test_a_station_that_cannot_be_written_waits_for_the_next_run(tmp_path, monkeypatch):
    # would catch a failure to write that is kept as a rejection of the station
    configuration = write_configuration(tmp_path)
    written = jobs.write_spectra

    def fails_for_two(dataset, path):
        if "S001" not in path.name:
            raise WriteError(str(path), "No space left on device")
        written(dataset, path)

    monkeypatch.setattr(jobs, "write_spectra", fails_for_two)
    # stations are finished in any order: the first may still wait when another fails
    reason = (
        r"XX\.S00[23]\.nc: cannot be written: No space left on device; (2 stations wait for "
        r"another run: |3 stations wait for another run: XX.S001, )XX.S002, XX.S003$"
    )
    with pytest.raises(WriteError, match=reason):
        run(configuration, executor=InProcess())
    assert json.loads((tmp_path / "out" / "run.json").read_text())["state"] == "unfinished"
    monkeypatch.undo()
    counts = run(configuration, executor=InProcess()).record["counts"]
    assert (counts["stations"], counts["stations_resumed"]) == (3, 1)


def _is_broken(*_):
    raise RuntimeError("no luck")


def test_a_station_whose_work_failed_unexpectedly_is_tried_again(copied, monkeypatch):
    # would catch a run that is final although the work of a station failed
    shutil.rmtree(copied / "out" / "stations")
    (copied / "out" / "run.json").unlink()
    monkeypatch.setattr(jobs, "station_spectra", _is_broken)
    first = run(copied / "run.toml", executor=InProcess())
    assert (first.record["failed"], first.record["counts"]["stations"]) == (True, 0)
    monkeypatch.undo()
    again = run(copied / "run.toml", executor=InProcess())
    assert not again.did_nothing
    assert (again.record["failed"], again.record["counts"]["stations"]) == (False, 1)


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 200 kB; skipped where it cannot be mounted."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounting = ["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", str(disk)]
    if not shutil.which("mount") or subprocess.run(mounting, check=False).returncode:
        pytest.skip("a small disk cannot be mounted here")
    yield disk
    # Libraries may hold the file open that they failed to write: the disk goes with the last one
    subprocess.run(["umount", "--lazy", str(disk)], check=True)


@pytest.mark.parametrize("room", [0, 8_192, 16_384, 40_960, 90_112])
def test_a_full_disk_ends_a_run_in_one_line(call, whole, tmp_path, small_disk, room):
    configuration = write_smallest_configuration(tmp_path)
    # Fill the disk up to the room that is left
    filler = small_disk / "filler"
    filler.write_bytes(bytes(shutil.disk_usage(small_disk).free - room))
    command = ["run", configuration, "-o", small_disk / "out"]
    code, _, errors = call(*command)
    line = errors.strip().splitlines()[-1]
    assert code == 75, errors
    assert "cannot be written: No space left on device; try again when there is room" in line
    assert not [path for path in small_disk.rglob("*") if is_part(path)]
    # Resumes when there is room
    filler.unlink()
    subprocess.run(["mount", "-o", "remount,size=10m", str(small_disk)], check=True)
    assert call(*command)[0] == 0
    expected = (whole / "out" / "risk.csv").read_bytes()
    assert (small_disk / "out" / "risk.csv").read_bytes() == expected


def test_the_configuration_of_these_tests_writes_in_its_own_folder(whole):
    assert load(whole / "run.toml", Run).output == whole / "out"


def write_town(folder: Path) -> Path:
    """Write footprints of two rows of houses."""
    shapely, pyogrio = (pytest.importorskip(name) for name in ("shapely", "pyogrio"))
    houses = [shapely.box(10 + x * 1e-4, 50, 10 + (x + 0.9) * 1e-4, 50.0001) for x in range(40)]
    path = folder / "town.gpkg"
    fields = [np.full(len(houses), 9.0)]
    pyogrio.raw.write(
        path, shapely.to_wkb(houses), fields, ["height"], geometry_type="Polygon", crs="EPSG:4326"
    )
    return path


@pytest.mark.parametrize("kind", ["parquet", "csv"])
@pytest.mark.parametrize("size", [0, 1_000])
def test_pairs_without_room(call, tmp_path, kind, size):
    command = ["pairs", write_town(tmp_path), "-o", tmp_path / f"pairs.{kind}"]
    with no_room(size):
        ending = call(*command)
    check_ending(ending, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["town.gpkg"]
    assert call(*command)[0] == 0


@pytest.mark.parametrize("size", [60_000, 80_000])
def test_a_layer_without_room(call, copied, monkeypatch, size):
    # would catch a layer that is taken for one that cannot be drawn: the machine has no room
    configuration = copied / "run.toml"
    configuration.write_text("geopackage = true\n" + configuration.read_text())
    before = (copied / "out" / "risk.csv").read_bytes()
    # The spectra are larger than the layer and there already
    monkeypatch.setattr(report, "write_spectra", lambda *_: None)
    with no_room(size):
        ending = call("report", configuration)
    check_ending(ending, copied)
    assert "risk.gpkg: cannot be written" in ending[2]
    assert not list(copied.rglob("*.gpkg"))
    assert (copied / "out" / "risk.csv").read_bytes() == before
    assert call("report", configuration)[0] == 0
    assert (copied / "out" / "risk.gpkg").exists()
