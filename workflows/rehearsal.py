"""
Rehearse an earthquake: services that fail, late stations, killed processes, a new magnitude.

Usage: ``python workflows/rehearsal.py [FOLDER]``. Services on loopback list and record a simulated
earthquake. The watcher runs by a clock that is given, so that a quarter of an hour is rehearsed in
less than a minute; where it or its worker is killed, it is a process of its own. The tables must be
those of an undisturbed watcher to the byte. Prints the time from origin to each revision: delay of
the run and seconds of work.
"""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import Executor
from datetime import timedelta
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).resolve()
ROOMS = ("watch", "records", "runs")
sys.path[:0] = [str(HERE.parents[1] / "tests" / room) for room in ROOMS]

from fdsn_server import FdsnServer, serving, status  # noqa: E402 - from the tests
from small_run import InProcess, plain_figures  # noqa: E402
from watched_city import ORIGIN, city_earthquake, settings_of, write_city  # noqa: E402

from per_obspy.errors import PerError  # noqa: E402
from per_obspy.watch.watch import Clock, watch_once  # noqa: E402

#: Tables that must be the same to the byte.
TABLES = ("risk.parquet", "risk.csv", "stations.csv", "rejected.csv", "rows.parquet")
TABLES = (*TABLES, "buildings.parquet", "totals.csv", "event.xml")


def main(folder: Path) -> None:
    """Rehearse in an empty folder, and compare with an undisturbed watcher."""
    simulation = city_earthquake(stations=4, magnitude=6.8)
    with serving(simulation) as server:
        calm, rehearsed = folder / "undisturbed", folder / "rehearsed"
        for place in (calm, rehearsed):
            place.mkdir(parents=True)
            write_city(place, server)
        rehearse(rehearsed, server)
        if errors := one_pass(calm, 901, InProcess()):
            sys.exit(f"the undisturbed watcher fails: {errors[0]}")
    compare(calm / LATEST, rehearsed / LATEST)


#: Newest revision in the folder of a city.
LATEST = Path("out", "events", "xx1", "latest")


def rehearse(folder: Path, server: FdsnServer) -> None:
    """Let an earthquake happen, and disturb the watcher in every way."""
    final = server.events["xx1"]
    early = final.copy()
    early.magnitudes[0].mag = 6.3
    server.events["xx1"], server.silent = early, {"S003", "S004"}
    # The list of earthquakes fails at first, and a service of records for one station
    server.fail("event", "*", status(503, Retry_After="20"))
    server.fail("dataselect", "S001", status(503, Retry_After="60"))
    report(folder, 0, "the event service demands a pause", expected=1)
    first = started(folder, 61, workers=2)
    kill_worker(first.process)
    report(folder, 61, "one worker killed, two stations silent, one service fails", first)
    report(folder, 125, "the service that failed is asked again")
    # The watcher is killed in the middle of a run, and started again
    server.silent = set()
    kill_watcher(folder, started(folder, 301, workers=1).process)
    report(folder, 305, "watcher killed and started again, late stations")
    server.events["xx1"] = final
    report(folder, 600, "magnitude 6.3 becomes 6.8", most=0)
    report(folder, 901, "nothing new")


class Started(NamedTuple):
    """A watcher in a process of its own, and when it was started, s."""

    process: "subprocess.Popen[str]"
    since: float


def started(folder: Path, seconds: float, workers: int) -> Started:
    """Start a watcher for one pass, so many seconds after the origin time."""
    file = folder / "city.toml"
    file.write_text(re.sub(r"workers = \d+", f"workers = {workers}", file.read_text()))
    command = [sys.executable, str(HERE), "--pass", str(folder), str(seconds)]
    since = time.perf_counter()
    return Started(subprocess.Popen(command, stderr=subprocess.PIPE, text=True), since)


def one_pass(
    folder: Path, seconds: float, executor: Executor | None = None
) -> tuple[PerError, ...]:
    """Do one pass of the watcher, and return what failed."""
    now = ORIGIN + timedelta(seconds=seconds)
    # Figures are most of the time of a small run, and none is compared
    with plain_figures():
        settings = settings_of(folder / "city.toml")
        return watch_once(settings, Clock(lambda: now), executor=executor).errors


def ended(watcher: Started) -> tuple[str, ...]:
    """Wait for a watcher, and return what failed."""
    _, errors = watcher.process.communicate(timeout=300)
    return (errors,) if watcher.process.returncode else ()


def report(
    folder: Path,
    delay: float,
    event: str,
    watcher: Started | None = None,
    expected: int = 0,
    most: int | None = None,
) -> None:
    """Print the revision that a pass has made, and the time from origin; check what it computed."""
    since = watcher.since if watcher else time.perf_counter()
    errors = ended(watcher) if watcher else one_pass(folder, delay, InProcess())
    seconds = time.perf_counter() - since
    if len(errors) != expected:
        sys.exit(f"{delay:g} s: {len(errors)} errors, expected {expected}: {errors}")
    made = sorted(path.name for path in folder.glob("out/events/*/revisions/*"))
    record = folder / LATEST / "run.json"
    counts = json.loads(record.read_text())["counts"] if record.is_file() else {}
    known = f"revision {made[-1]}, {counts['stations']} stations" if made else "no revision"
    computed = counts["stations"] - counts["stations_resumed"] if made else 0
    if most is not None and computed > most:
        sys.exit(f"{delay:g} s: {computed} stations computed, expected {most}")
    done = f"{computed} computed" if made else ""
    print(f"{delay:4.0f} s + {seconds:4.1f} s of work: {known}, {done:11s} ({event})", flush=True)


def kill_worker(watcher: "subprocess.Popen[str]") -> None:
    """Kill the first worker process that a watcher starts."""
    waited(lambda: workers_of(watcher.pid) or watcher.poll() is not None)
    for worker in workers_of(watcher.pid)[:1]:
        os.kill(worker, signal.SIGKILL)


def workers_of(process: int) -> list[int]:
    """Return the worker processes of a watcher; its other children keep count of resources."""
    children = Path(f"/proc/{process}/task/{process}/children")
    numbers = [int(word) for word in children.read_text().split()] if children.exists() else []
    commands = {number: Path(f"/proc/{number}/cmdline") for number in numbers}
    return [number for number, file in commands.items() if b"spawn_main" in file.read_bytes()]


def kill_watcher(folder: Path, watcher: "subprocess.Popen[str]") -> None:
    """Kill a watcher while it screens."""
    record = folder / "out" / "events" / "xx1" / "work" / "run.json"
    # The record of a run that is complete has times of its stages
    waited(
        lambda: (
            json.loads(record.read_text()).get("stage") == "screening" or watcher.poll() is not None
        )
    )
    watcher.kill()
    watcher.communicate()


def waited(condition: Callable[[], object], seconds: float = 120.0) -> None:
    """Wait until a condition holds."""
    until = time.monotonic() + seconds
    while not condition() and time.monotonic() < until:
        time.sleep(0.02)


def compare(calm: Path, rehearsed: Path) -> None:
    """Stop with an error if a table differs from that of the undisturbed watcher."""
    different = [
        name for name in TABLES if (calm / name).read_bytes() != (rehearsed / name).read_bytes()
    ]
    if different:
        sys.exit(f"differ from the undisturbed run: {', '.join(different)}")
    print(f"{len(TABLES)} tables equal those of an undisturbed watcher to the byte")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--pass"]:
        sys.exit("\n".join(map(str, one_pass(Path(sys.argv[2]), float(sys.argv[3])))) or None)
    with tempfile.TemporaryDirectory() as temporary:
        main(Path(sys.argv[1] if sys.argv[1:] else temporary))
