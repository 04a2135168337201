"""Workers of the command line are forks of one server, which ends with the program."""

import gc
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from per_obspy.runs.tasks import worker_start

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="workers are forked on Linux only")

#: A program whose workers report their parent, and whether a library is loaded that only the
#: server loads.
PROGRAM = """
import os, sys, time
from per_obspy.runs.tasks import worker_start
from per_obspy.runs.tasks.parallel import Workers, Work, prepare_workers, results
worker_start.LOADED = ("colorsys",)
FACTS = "(__import__('os').getppid(), 'colorsys' in __import__('sys').modules)"
with worker_start.forked_workers():
    prepare_workers(2)
    found = [*results([FACTS] * 4, Work(eval, lambda task, reason: reason), Workers(2))]
    assert {loaded for _, loaded in found} == {True}, found
    server, = {parent for parent, _ in found}
    print(server, os.getpid(), flush=True)
    time.sleep(float(sys.argv[1]))
"""


def is_running(pid):
    """Return whether a process works; one that waits to be asked for has ended."""
    try:
        return Path("/proc", str(pid), "stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.parametrize("is_killed", [False, True])
def test_workers_are_forks_of_a_server_that_ends_with_its_program(is_killed):
    # catches workers that each load their libraries, and a server that stays behind
    command = [sys.executable, "-c", PROGRAM, "1000" if is_killed else "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        server, program = map(int, running.stdout.readline().split())
        assert program == running.pid != server
        if is_killed:
            running.kill()
    assert running.returncode == (-signal.SIGKILL if is_killed else 0)
    # the server notices the end of its program within a moment
    deadline = time.monotonic() + 10.0
    while is_running(server):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_a_program_of_somebody_else_starts_fresh_interpreters():
    # catches a server of this package in a program that may have a server of its own
    assert worker_start.worker_context().get_start_method() == "spawn"
    with worker_start.forked_workers():
        assert worker_start.worker_context().get_start_method() == "forkserver"
    assert worker_start.worker_context().get_start_method() == "spawn"


def test_what_a_watcher_leaves_behind_is_searched_for_garbage():
    # catches: all objects left out of later searches at every run of a long process
    gc.unfreeze()
    try:
        with worker_start.forked_workers(), worker_start.loading():
            pass
        kept = gc.get_freeze_count()
        left = [[] for _ in range(1000)]
        with worker_start.forked_workers(), worker_start.loading():
            pass
        # none of those came to the kept ones, a few of which may have ended
        assert 0 < gc.get_freeze_count() < kept + len(left) // 2
    finally:
        gc.unfreeze()
