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
from per_obspy.config import Run, load
from per_obspy.runs.run import run

from .runs.small_run import SCENARIO, InProcess, plain_figures, write_configuration

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")

#: s, from the signal to the end: the time that a service manager is promised.
PROMISED = 10.0

CHECKOUT = Path(__file__).parents[1]

#: Tables that a run that goes on must write as an undisturbed one does.
TABLES = ("risk.parquet", "risk.csv", "rejected.csv", "totals.csv", "buildings.parquet")

#: The command line; figures are short files, as most of the time of a small run goes into them.
WITHOUT_FIGURES = """
from small_run import plain_figures
from per_obspy.cli import application
with plain_figures():
    application.main()
"""

#: Main thread in compiled code, which no exception of Python interrupts.
IN_COMPILED_CODE = """
import hashlib, threading
from per_obspy import termination
termination.LIMIT = 1.0
with termination.ending_in_time():
    threading.Timer(0.3, print, ["ready"], {"flush": True}).start()
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


#: A query that takes minutes, of the rows of a generator or of none.
IN_DATABASE = """
import sys, threading
from pathlib import Path
import numpy as np
import pyarrow as pa
from per_obspy import termination
from per_obspy.results.parts import batches, bounded_database
def rows():
    while True:
        yield pa.record_batch([pa.array(np.arange(20_000))], names=["number"])
query = "SELECT * FROM {} ORDER BY hash(number), hash(number + 1)"
try:
    with termination.ending_in_time(), bounded_database(Path(sys.argv[1])) as database:
        threading.Timer(0.5, print, ["ready"], {"flush": True}).start()
        if sys.argv[2] == "numbers":
            database.execute("CREATE TABLE a AS " + query.format("range(500000000) AS a(number)"))
        reader = pa.RecordBatchReader.from_batches(pa.schema([("number", pa.int64())]), rows())
        database.register("numbers", reader)
        next(batches(database, query.format("numbers"), 20_000))
except KeyboardInterrupt:
    sys.exit(termination.INTERRUPTED)
"""


def members(session):
    """Return the processes of a session, but for those that have ended and wait to be asked."""
    found = set()
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(FileNotFoundError, ProcessLookupError):
            # after the name in parentheses: state, parent, group, session
            state, _, _, number = path.read_text().rsplit(")", 1)[1].split()[:4]
            if int(number) == session and state not in "ZX":
                found.add(int(path.parent.name))
    return found


def end(running, number, key=False):
    """Send a signal to a process, or to its group; return exit code, duration and errors."""
    started = time.monotonic()
    if key:
        os.killpg(running.pid, number)
    else:
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


@pytest.mark.parametrize(
    ("number", "rows"), [(signal.SIGTERM, "numbers"), (signal.SIGINT, "generator")]
)
def test_a_query_of_the_database_ends_with_the_program(tmp_path, number, rows):
    # Mutations: the error of the query instead of the end; its threads not interrupted
    running = subprocess.Popen(
        [sys.executable, "-c", IN_DATABASE, str(tmp_path), rows],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert running.stdout.readline() == "ready\n"
    code, seconds, _ = end(running, number)
    assert code == 128 + number
    assert seconds < PROMISED
    # an end by force would leave the rows that did not fit into memory
    assert list(tmp_path.iterdir()) == []


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
    """Send a signal to this process while it holds it back, and note the work done afterwards."""
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


def write_run(folder):
    """Write the configuration of a run of two stations and five pairs."""
    write_configuration(folder)
    scenario = SCENARIO.replace("count = 60", "count = 5").replace("stations = 3", "stations = 2")
    (folder / "scenario.toml").write_text(scenario)


def small_run(folder, workers):
    """Start the run of a folder in a session of its own."""
    command = [sys.executable, "-c", WITHOUT_FIGURES, "run", str(folder / "run.toml")]
    return subprocess.Popen(
        [*command, "--set", f"workers={workers}"],
        cwd=CHECKOUT / "tests" / "runs",
        env={**os.environ, "PYTHONPATH": str(CHECKOUT)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def results_of(folder):
    """Run to the end in this process, and return the bytes of the tables."""
    with plain_figures():
        settings = load(folder / "run.toml", Run)
        run(settings.model_copy(update={"workers": 1}), executor=InProcess())
    return {name: (folder / "out" / name).read_bytes() for name in TABLES}


def times(folder, pattern):
    """Return the files of a folder and when they were written."""
    return {path: path.stat().st_mtime_ns for path in folder.rglob(pattern)}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Tables of a run that was not ended."""
    kernels = Path(os.environ.get("NUMBA_CACHE_DIR", CHECKOUT / "per_obspy"))
    for attempt in ("first", "second"):
        folder = tmp_path_factory.mktemp(attempt)
        write_run(folder)
        before = times(kernels, "*.nb[ci]")
        tables = results_of(folder)
        # kernels that were just compiled differ from stored ones in the last bits
        if times(kernels, "*.nb[ci]") == before:
            break
    return tables


def ended_run(folder, line, workers, number):
    """End a run by a signal as it logs a line and its workers begin; check how it ends."""
    running = small_run(folder, workers)
    while not (logged := running.stderr.readline()).startswith(line):
        assert logged, f"ended before {line}"
    # of two workers: both, the server that forks them, the run, and Python's tracker of resources
    while len(members(running.pid)) < (5 if workers == 2 else 1):
        assert running.poll() is None
        time.sleep(0.02)
    # a service manager asks the run alone, the key of a terminal everything that it started
    code, seconds, errors = end(running, number, key=number == signal.SIGINT)
    while members(running.pid):
        seconds += 0.05
        assert seconds < PROMISED
        time.sleep(0.05)
    assert (code, seconds < PROMISED, "Traceback" in errors) == (128 + number, True, False)
    word = {signal.SIGTERM: "terminated", signal.SIGINT: "interrupted"}[number]
    assert errors.splitlines()[-1] == word


def test_a_run_that_is_ended_twice_leaves_no_process_and_goes_on_to_the_same_bytes(
    tmp_path, undisturbed
):
    write_run(tmp_path)
    ended_run(tmp_path, "stations: 0 of 2", 2, signal.SIGTERM)
    ended_run(tmp_path, "screening: 0 of 5", 1, signal.SIGINT)
    stations = times(tmp_path / "out" / "stations", "*.json")
    assert len(stations) == 2
    assert results_of(tmp_path) == undisturbed
    # finished stations were not done again
    assert times(tmp_path / "out" / "stations", "*.json") == stations
