"""
Kill a watcher at random moments, let another one go on, and compare its tables.

Usage: ``python killed_watcher.py COUNT [SEED]``. Half of the kills meet the first run of an
earthquake, the others the run for a station that came later. Prints one JSON object: the number of
kills, how many of them met a watcher at work, and every fault. It is a program of its own because
only a process without threads can be forked safely; the services are a second process.
"""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path

HERE = Path(__file__).resolve()
ROOMS = (HERE.parent, HERE.parents[1] / "records", HERE.parents[1] / "pipeline")
sys.path[:0] = list(map(str, ROOMS))

from fdsn_server import serving  # noqa: E402 - after the path
from small_run import InProcess, plain_figure  # noqa: E402 - after the path
from watched_city import FakeClock, city_earthquake, settings_of, write_city  # noqa: E402 - after the path

from per_obspy.files import is_part  # noqa: E402 - after the path
from per_obspy.operation.watch import watch_once  # noqa: E402 - after the path
from per_obspy.pipeline import report  # noqa: E402 - after the path
from per_obspy.records.simulation.earthquake import Simulation  # noqa: E402 - after the path

#: Tables that must be the same to the byte.
TABLES = ("risk.parquet", "stations.csv", "rejected.csv", "rows.parquet", "buildings.parquet")
TABLES = (*TABLES, "totals.csv", "event.xml")

#: Newest revision in the folder of a city.
LATEST = Path("out", "events", "xx1", "latest")


def serve() -> None:
    """Serve an earthquake until the input ends; a line names the stations without records."""
    with serving(_simulation()) as server:
        print(server.url, flush=True)
        for line in sys.stdin:
            server.silent = set(line.split())
            print("done", flush=True)


def _simulation() -> Simulation:
    """Return the earthquake of the city."""
    return city_earthquake(stations=2)


class Services:
    """The services, in a process of their own."""

    def __init__(self) -> None:
        command = [sys.executable, str(HERE), "--serve"]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        self.process = subprocess.Popen(command, text=True, **pipes)
        self.url = self.process.stdout.readline().strip()
        self.inventory = _simulation().inventory

    def silence(self, *stations: str) -> None:
        """Let these stations have no records, and all others have some."""
        self.process.stdin.write(f"{' '.join(stations)}\n")
        self.process.stdin.flush()
        self.process.stdout.readline()

    def end(self) -> None:
        self.process.stdin.close()
        self.process.wait()


def one_pass(city: Path, seconds: float) -> None:
    """Do one pass of the watcher of a city; raise an error if anything fails."""
    settings = settings_of(city / "city.toml")
    found = watch_once(settings, FakeClock().at(seconds), executor=InProcess())
    for error in found.errors:
        raise error


def forked(city: Path, seconds: float) -> int:
    """Start one pass in a process of its own, and return its number."""
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        one_pass(city, seconds)
        code = 0
    except Exception:  # noqa: BLE001 - whatever it is, it is printed
        traceback.print_exc()
    finally:
        os._exit(code)


def exit_code(child: int) -> int:
    """Wait for a process, and return its exit code; negative for a signal."""
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def killed(city: Path, seconds: float, moment: float) -> bool:
    """Start one pass, kill it after some seconds, and return whether it was still at work."""
    child = forked(city, seconds)
    time.sleep(moment)
    os.kill(child, signal.SIGKILL)
    return exit_code(child) == -signal.SIGKILL


def faults_of(city: Path, expected: Path, revisions: list[str]) -> list[str]:
    """Return the differences from the folder of an undisturbed watcher."""
    names = sorted(path.name for path in (city / LATEST).parent.glob("revisions/*"))
    faults = [] if names == revisions else [f"revisions {names}, expected {revisions}"]
    faults += [
        f"{name} differs"
        for name in TABLES
        if (city / LATEST / name).read_bytes() != (expected / LATEST / name).read_bytes()
    ]
    return faults + [f"{path.name} is left" for path in city.rglob("*") if is_part(path)]


def main(folder: Path, count: int, seed: int) -> None:
    """Kill a number of watchers, and print the faults after the kills."""
    for name in ("draw_overview", "draw_record_to_pair"):
        setattr(report, name, plain_figure)
    services, chance = Services(), random.Random(seed)
    # The first pass compiles; the second tells how long one takes
    early, late, first = folder / "early", folder / "late", folder / "first"
    first.mkdir()
    write_city(first, services)
    services.silence("S002")
    shutil.copytree(first, early, symlinks=True)
    one_pass(early, 61)
    services.silence()
    shutil.copytree(early, late, symlinks=True)
    seconds = {late: timed_pass(late), first: 0.0}
    calm = folder / "calm"
    shutil.copytree(first, calm, symlinks=True)
    seconds[first] = timed_pass(calm)
    cases = [(first, calm, ["0001"]), (early, late, ["0001", "0002"])]
    seconds[early] = seconds[late]
    faults, at_work = dict[int, list[str]](), 0
    for number in range(count):
        start, expected, revisions = cases[number % 2]
        city = folder / "killed"
        shutil.copytree(start, city, symlinks=True)
        at_work += killed(city, 901, chance.uniform(0.0, seconds[start]))
        code = exit_code(forked(city, 902))
        faults[number] = faults_of(city, expected, revisions) if code == 0 else [f"exit {code}"]
        shutil.rmtree(city)
        print(f"kill {number + 1} of {count}: {faults[number] or 'equal'}", file=sys.stderr)
    services.end()
    wrong = {number: found for number, found in faults.items() if found}
    print(json.dumps({"kills": count, "at_work": at_work, "faults": wrong}))


def timed_pass(city: Path) -> float:
    """Return the seconds of one pass."""
    start = time.perf_counter()
    if exit_code(forked(city, 901)):
        sys.exit("an undisturbed pass fails")
    return time.perf_counter() - start


if __name__ == "__main__":
    if sys.argv[1] == "--serve":
        serve()
    else:
        with tempfile.TemporaryDirectory() as temporary:
            chosen = int(sys.argv[2]) if sys.argv[2:] else 1
            main(Path(temporary), int(sys.argv[1]), chosen)
