"""SIGTERM and the interrupt key end a run in time, with its workers, and lose no finished work."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from per_obspy import termination

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")

#: s, from the signal to the end: the time that a service manager is promised.
PROMISED = 10.0

CHECKOUT = Path(__file__).parents[1]

#: Main thread in compiled code, which no exception of Python interrupts.
IN_COMPILED_CODE = """
import hashlib
from per_obspy import termination
termination.LIMIT = 1.0
with termination.ending_in_time():
    print("ready", flush=True)
    hashlib.pbkdf2_hmac("sha256", b"a", b"b", 2_000_000_000)
"""

#: The signal is lost in a destructor, as exceptions there are.
LOST = """
import time
from per_obspy import termination
termination.LIMIT = 1.0
class Slow:
    def __del__(self):
        print("ready", flush=True)
        time.sleep(2)
with termination.ending_in_time():
    slow = Slow()
    del slow
    time.sleep(1000)
"""


def started_by(pid):
    """Return the numbers of the processes that a process has started, and that these have."""
    found = set()
    for tasks in Path("/proc", str(pid), "task").glob("*/children"):
        with suppress(FileNotFoundError, ProcessLookupError):
            found |= {int(word) for word in tasks.read_text().split()}
    return found.union(*map(started_by, found))


def is_running(pid):
    """Return whether a process works; one that waits to be asked for has ended."""
    try:
        return Path("/proc", str(pid), "stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def end(running, number):
    """Send a signal to a process alone, and return its exit code, duration and errors."""
    started = time.monotonic()
    running.send_signal(number)
    _, errors = running.communicate(timeout=60)
    return running.returncode, time.monotonic() - started, errors


@pytest.mark.parametrize("script", [IN_COMPILED_CODE, LOST])
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_the_program_ends_where_no_exception_arrives(script, number):
    running = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert running.stdout.readline() == "ready\n"
    code, seconds, _ = end(running, number)
    assert code == 128 + number
    assert seconds < PROMISED


def terminated_twice():
    """Send SIGTERM to this process, and again while the first one is cleared up."""
    with termination.ending_in_time():
        assert not termination.requested()
        try:
            os.kill(os.getpid(), signal.SIGTERM)
        finally:
            os.kill(os.getpid(), signal.SIGTERM)
            assert termination.requested()
            assert termination.pause(100)


def test_a_signal_is_an_exception_once_and_the_handler_before_returns():
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(termination.Terminated) as ending:
        terminated_twice()
    assert ending.value.code == termination.TERMINATED == 143
    assert signal.getsignal(signal.SIGTERM) is before


def interrupted_while_held(done):
    """Send a signal to this process while it holds it back, and note what was done after it."""
    with termination.ending_in_time():
        with termination.held():
            with termination.held():
                os.kill(os.getpid(), signal.SIGINT)
            done.append("inside")
        done.append("outside")


def test_a_signal_that_is_held_back_waits():
    done = []
    with pytest.raises(KeyboardInterrupt):
        interrupted_while_held(done)
    assert done == ["inside"]


def smoke_run(output):
    """Start the smoke run on two processes."""
    command = [sys.executable, "-m", "per_obspy", "run", "workflows/smoke.toml", "-o", str(output)]
    return subprocess.Popen(
        [*command, "--set", "workers=2", "--set", "spectra.dampings=[0.05]"],
        cwd=CHECKOUT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_a_run_that_is_ended_at_several_moments_goes_on_to_the_same_bytes(tmp_path):
    # undisturbed
    whole = smoke_run(tmp_path / "whole")
    assert whole.communicate(timeout=300) is not None
    assert whole.returncode == 0
    # each run goes on where the one before was ended
    moments = {"stations: 0 of": 143, "report: 0 of": 130}
    for moment, code in moments.items():
        running = smoke_run(tmp_path / "ended")
        while not (line := running.stderr.readline()).startswith(moment):
            assert line, f"ended before {moment}"
        # the first moment is that of two workers that have just begun, with Python's tracker of
        # resources and the server whose forks they are
        workers = set()
        while moment.startswith("stations") and len(workers) < 4:
            workers = started_by(running.pid)
        number = signal.SIGTERM if code == 143 else signal.SIGINT
        found, seconds, errors = end(running, number)
        assert (found, errors.splitlines()[-1]) == (
            code,
            "terminated" if code == 143 else "interrupted",
        )
        assert seconds < PROMISED
        assert "Traceback" not in errors
        # a process that was killed takes a moment to end, and so does Python's own that follows it
        deadline = time.monotonic() + PROMISED - seconds
        while any(map(is_running, workers)):
            assert time.monotonic() < deadline
            time.sleep(0.05)
    last = smoke_run(tmp_path / "ended")
    last.communicate(timeout=300)
    assert last.returncode == 0
    for name in ("risk.parquet", "risk.csv", "rejected.csv", "totals.csv", "buildings.parquet"):
        assert (tmp_path / "ended" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
