"""
A file is opened at most twice on its way through a run: for its hash, and for its content.

Counted by the kernel, so that no library escapes: per_obspy.runs.run and everything below.
"""

import shutil
import sys

import pytest

from per_obspy.runs.run import report, run, screen
from per_obspy.runs.tasks.ground_files import read_station_once

from .open_counts import OpenCounts
from .small_run import SPECTRA, InProcess, write_configuration

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(sys.platform != "linux", reason="counts with inotify"),
    pytest.mark.usefixtures("plain_figures"),
]

CONFIGURATION = """\
name = "counted"
output = "counted"
geopackage = {layers}
[records]
folder = "records"
event = "event.xml"
[pairs]
file = "out/pairs.csv"
"""


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """Records and event of a small earthquake, in a folder as a user has them."""
    folder = tmp_path_factory.mktemp("counted")
    run(write_configuration(folder), executor=InProcess())
    shutil.copytree(folder / "out" / "simulated", folder / "records")
    (folder / "records" / "event.xml").rename(folder / "event.xml")
    write_counted(folder, "false")
    run(folder / "counted.toml", executor=InProcess())
    return folder


@pytest.fixture
def folder(simulated, tmp_path):
    """The finished run, done by another process."""
    shutil.copytree(simulated, tmp_path, dirs_exist_ok=True)
    read_station_once.cache_clear()
    return tmp_path


def write_counted(folder, layers):
    (folder / "counted.toml").write_text(CONFIGURATION.format(layers=layers) + SPECTRA)


@pytest.fixture
def opens(folder):
    """Count the opens in all folders of the run."""
    stations = folder / "counted" / "stations"
    counts = OpenCounts(folder, folder / "records", stations.parent, stations)
    yield counts
    counts.close()


def largest(counts, folder, pattern):
    """Return the largest number of opens of the files that match."""
    found = [counts[path] for path in folder.glob(pattern)]
    assert found
    return max(found)


def by_kind(counts, folder):
    """Return the largest number of opens of each kind of file."""
    return {
        "records": largest(counts, folder, "records/*.mseed"),
        "metadata": largest(counts, folder, "records/*.xml"),
        "event": largest(counts, folder, "event.xml"),
        "shards": largest(counts, folder, "counted/stations/*.nc"),
        "spectra": largest(counts, folder, "counted/spectra.nc"),
        "risk": largest(counts, folder, "counted/risk.parquet"),
    }


@pytest.mark.parametrize("layers", ["false", "true"])
def test_a_run_opens_each_record_and_shard_at_most_twice(folder, request, layers):
    write_counted(folder, layers)
    shutil.rmtree(folder / "counted")
    (folder / "counted" / "stations").mkdir(parents=True)
    opens = request.getfixturevalue("opens")
    assert run(folder / "counted.toml", executor=InProcess()).record["counts"]["pairs"]
    # records: headers and hash together, then the samples; event, metadata: once for all stations;
    # station files: hash with spectra, then the motion; risk table: rows of buildings (one opening
    # for both passes: identifiers, then the columns of pairs), the worst pairs that are explained,
    # the report, and its hash
    assert by_kind(opens(), folder) == {
        "records": 2,
        "metadata": 1,
        "event": 1,
        "shards": 2,
        "spectra": 1,
        "risk": 4,
    }


def test_the_same_again_opens_each_file_once(folder, opens):
    assert run(folder / "counted.toml", executor=InProcess()).did_nothing
    # inputs, stations and results are compared with their hashes
    assert set(by_kind(opens(), folder).values()) == {1}


def test_a_resumed_run_opens_no_record_for_its_samples(folder, opens):
    (folder / "counted" / "run.json").unlink()
    counts = run(folder / "counted.toml", executor=InProcess()).record["counts"]
    assert counts["stations_resumed"] == 3
    # headers and hash together; the only chunk is resumed too, and needs no station file
    found = by_kind(opens(), folder)
    assert (found["records"], found["event"]) == (1, 1)
    assert found["shards"] == 2  # one station is drawn with its motion


def test_stages_of_their_own_open_each_file_at_most_twice(folder, opens):
    screen(folder / "counted.toml", executor=InProcess())
    counts = by_kind(opens(), folder)
    # rows of buildings, worst pairs, the report, and the hash, as in a whole run
    assert counts.pop("risk") == 4
    assert max(counts.values()) <= 2
    read_station_once.cache_clear()
    report(folder / "counted.toml")
    # hash of the table that is reported, and the report
    counts = by_kind(opens(), folder)
    assert counts["risk"] == 2
    assert counts["records"] == 0
