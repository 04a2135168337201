"""A run by a cluster: the bytes of one machine, and a record that names workers."""

import errno
import json
import os
import platform

import pytest

from per_obspy.errors import CatalogError, Unfinished
from per_obspy.runs.run import run
from per_obspy.runs.tasks import chunk
from per_obspy.runs.tasks.executor import dask_executor

from .small_run import InProcess, write_smallest_configuration

distributed = pytest.importorskip("distributed", reason="an extra: per_obspy[dask]")

pytestmark = [pytest.mark.long, pytest.mark.usefixtures("plain_reports")]

#: Results that must have the same bytes wherever the work is done.
COMPARED = ("risk.csv", "risk.parquet", "rejected.csv", "totals.csv", "stations.csv")


@pytest.fixture(scope="module")
def scheduler():
    """Address of a cluster whose worker is a thread of this process, with compiled kernels."""
    place = {"n_workers": 1, "threads_per_worker": 2, "processes": False}
    with distributed.LocalCluster(**place, dashboard_address=":0", silence_logs=50) as cluster:
        yield cluster.scheduler_address


def folder_of(parent, name):
    folder = parent / name
    folder.mkdir()
    return folder


def test_a_cluster_makes_the_bytes_of_one_machine(scheduler, tmp_path):
    own = write_smallest_configuration(folder_of(tmp_path, "own"))
    other = write_smallest_configuration(folder_of(tmp_path, "other"))
    run(own, executor=InProcess())
    with dask_executor(scheduler) as executor:
        record = run(other, executor=executor).record
    for name in COMPARED:
        assert (own.parent / "out" / name).read_bytes() == (
            other.parent / "out" / name
        ).read_bytes(), name
    (worker,) = record["engine"]["workers"]
    # one station, one chunk of pairs, one of rows
    assert (worker["host"], worker["tasks"]) == (platform.node(), 3)
    assert record["engine"]["dask"] == scheduler
    # no cluster is asked where all is done, and the place of the work is no change of the run
    with dask_executor("127.0.0.1:1") as executor:
        assert run(own, executor=executor).did_nothing
    with dask_executor("127.0.0.1:1") as executor:
        assert run(other, executor=executor).did_nothing


def test_the_record_of_an_unfinished_run_names_the_worker(scheduler, tmp_path, monkeypatch):
    def fails(*_):
        raise OSError(errno.EIO, os.strerror(errno.EIO), "part")

    engine = f'[engine]\ndask = "{scheduler}"\nretries = 1\n'
    file = write_smallest_configuration(tmp_path, engine)
    with monkeypatch.context() as patch:
        patch.setattr(chunk, "write_part", fails)
        with pytest.raises(Unfinished, match="part: Input/output error"):
            run(file)
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert record["state"] == "unfinished"
    events = record["engine"]["events"]
    assert [event["reason"] for event in events] == [
        "failed at a task: part: Input/output error"
    ] * 2  # would catch a task that is not tried again
    assert {event["host"] for event in events} == {platform.node()}
    assert run(file).record["state"] == "complete"


def test_what_is_no_address_is_refused():
    with pytest.raises(CatalogError, match="--dask: 'head' is no scheduler"), dask_executor("head"):
        pass
