"""Processors that a process may use: affinity, containers, and one thread per worker process."""

import math
import os
import threading
from functools import partial

import pytest

from per_obspy import threads
from per_obspy.runs.tasks.parallel import Work, Workers, results
from per_obspy.threads import map_in_threads, usable_processors, use_one_thread


@pytest.fixture
def cgroup(tmp_path, monkeypatch):
    """Stand for the control groups of a container on a machine with eight processors."""
    monkeypatch.setattr(threads, "CGROUP", tmp_path)
    monkeypatch.setattr(threads, "_processors_of_affinity", lambda: 8)
    (tmp_path / "cpu").mkdir()
    return tmp_path


@pytest.mark.usefixtures("cgroup")
def test_without_control_groups_the_affinity_counts():
    assert usable_processors() == 8


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="no affinity mask here")
def test_a_mask_of_one_processor_is_one_processor(monkeypatch, tmp_path):
    # would catch a count of all processors of the machine
    monkeypatch.setattr(threads, "CGROUP", tmp_path)
    mask = os.sched_getaffinity(0)
    assert usable_processors() == len(mask)
    os.sched_setaffinity(0, {min(mask)})
    try:
        assert usable_processors() == 1
    finally:
        os.sched_setaffinity(0, mask)


@pytest.mark.parametrize(
    ("text", "processors"),
    [
        ("200000 100000\n", 2),
        ("150000 100000\n", 2),  # one and a half processors: rounded up
        ("10000 100000\n", 1),
        ("max 100000\n", 8),
        ("6400000 100000\n", 8),  # more than there are
    ],
)
def test_limit_of_a_container(cgroup, text, processors):
    (cgroup / "cpu.max").write_text(text)
    assert usable_processors() == processors


@pytest.mark.parametrize(("quota", "processors"), [("300000", 3), ("50000", 1), ("-1", 8)])
def test_limit_of_an_older_container(cgroup, quota, processors):
    (cgroup / "cpu" / "cpu.cfs_quota_us").write_text(quota + "\n")
    (cgroup / "cpu" / "cpu.cfs_period_us").write_text("100000\n")
    assert usable_processors() == processors


@pytest.mark.parametrize(
    "text",
    [
        "",
        "\n",
        "max",
        "two 100000",
        "200000",
        "1 2 3",
        "200000 0",
        "0 100000",
        "-5 100000",
        "1.5 1",
    ],
)
def test_a_malformed_limit_is_no_limit(cgroup, text):
    (cgroup / "cpu.max").write_text(text)
    (cgroup / "cpu" / "cpu.cfs_quota_us").write_text(text)
    assert usable_processors() == 8


def test_an_unreadable_limit_is_no_limit(cgroup):
    (cgroup / "cpu.max").write_bytes(b"\xff\xfe")
    (cgroup / "cpu" / "cpu.cfs_quota_us").mkdir()
    assert usable_processors() == 8


@pytest.fixture
def _three_processors(monkeypatch):
    monkeypatch.setattr(threads, "usable_processors", lambda: 3)


def _meet(barrier, number):
    """Wait until as many threads have come as the barrier expects: never, were there fewer."""
    barrier.wait(timeout=60)
    return number


@pytest.mark.usefixtures("_three_processors")
def test_blocks_are_shared_by_threads_and_results_keep_their_order():
    work = partial(_meet, threading.Barrier(3))
    assert map_in_threads(work, range(9)) == list(range(9))


@pytest.mark.usefixtures("_three_processors")
def test_never_more_threads_than_processors():
    names = map_in_threads(lambda _: threading.current_thread().name, range(60))
    assert len(set(names)) <= 3
    assert threading.current_thread().name not in names


@pytest.mark.usefixtures("_three_processors")
@pytest.mark.parametrize("blocks", [[], [7]])
def test_one_block_needs_no_thread(blocks):
    names = map_in_threads(lambda _: threading.current_thread(), blocks)
    assert names == [threading.current_thread()] * len(blocks)


@pytest.mark.usefixtures("_three_processors")
def test_an_error_in_a_thread_is_raised():
    with pytest.raises(ValueError, match="isqrt"):
        map_in_threads(math.isqrt, [1, 4, -9, 16])


@pytest.mark.usefixtures("_three_processors")
def test_a_process_can_be_limited_to_one_thread(monkeypatch):
    monkeypatch.setattr(threads, "_limit", dict(threads._limit))
    use_one_thread()
    here = map_in_threads(lambda _: threading.current_thread(), range(4))
    assert here == [threading.current_thread()] * 4


#: Counts the threads, other than that of a worker process, on which four blocks run.
COUNT_THREADS = (
    "len(set(__import__('per_obspy.threads').threads.map_in_threads("
    "lambda _: __import__('threading').current_thread().name, range(4)))"
    " - {__import__('threading').current_thread().name})"
)


def test_a_worker_process_uses_one_thread():
    # would catch n processes of n threads on n processors
    found = list(results([COUNT_THREADS] * 2, Work(eval, lambda _, reason: reason), Workers(2)))
    assert found == [0, 0]
