"""
Kill a watcher at random moments, let another one go on, and compare its tables.

Usage: ``python killed_watcher.py COUNT [SEED]``. Half of the kills meet the first run of an
earthquake, the others the run for a station that came later. Prints one JSON object: the number of
kills, how many of them met a watcher at work, and every fault. It is a program of its own because
only a process without threads can be forked safely; the services are a second process. Each city
writes its messages to a file: one per revision, whenever its watcher is killed.
"""

import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
from pathlib import Path

HERE = Path(__file__).resolve()
ROOMS = (HERE.parent, HERE.parents[1] / "records", HERE.parents[1] / "runs")
sys.path[:0] = list(map(str, ROOMS))

from fdsn_server import serving  # noqa: E402 - after the path
from small_run import InProcess, plain_figure  # noqa: E402 - after the path
from watched_city import FakeClock, city_earthquake, settings_of, write_city  # noqa: E402 - after the path

from per_obspy.config import Notify  # noqa: E402 - after the path
from per_obspy.files import is_part  # noqa: E402 - after the path
from per_obspy.report import files as report_files  # noqa: E402 - after the path
from per_obspy.simulation.earthquake import Simulation  # noqa: E402 - after the path
from per_obspy.watch.watch import watch_once  # noqa: E402 - after the path

#: Tables that must be the same to the byte.
TABLES = ("risk.parquet", "stations.csv", "rejected.csv", "rows.parquet", "buildings.parquet")
TABLES = (*TABLES, "totals.csv", "event.xml")

#: Functions that write a figure, which is most of the time of a small run and not compared.
FIGURES = (
    (report_files, "draw_overview"),
    (report_files, "draw_record_to_pair"),
    (report_files, "write_summary_page"),
)

#: Newest revision in the folder of a city.
LATEST = Path("out", "events", "xx1", "latest")


def serve(simulation: Simulation, orders: int, answers: int) -> None:
    """Serve an earthquake until the orders end; a line names the stations without records."""
    with serving(simulation) as server, os.fdopen(orders) as lines:
        os.write(answers, f"{server.url}\n".encode())
        for line in lines:
            server.silent = set(line.split())
            os.write(answers, b"done\n")


class Services:
    """The services, in a process of their own, which is forked before there is any thread."""

    def __init__(self) -> None:
        simulation = city_earthquake(stations=2)
        self.inventory = simulation.inventory
        orders, self.orders = os.pipe()
        self.answers, answers = os.pipe()
        self.process = os.fork()
        if not self.process:
            os.close(self.orders)
            try:
                serve(simulation, orders, answers)
            finally:
                os._exit(0)
        os.close(orders)
        os.close(answers)
        self.lines = os.fdopen(self.answers)
        self.url = self.lines.readline().strip()

    def silence(self, *stations: str) -> None:
        """Let these stations have no records, and all others have some."""
        os.write(self.orders, f"{' '.join(stations)}\n".encode())
        self.lines.readline()

    def end(self) -> None:
        os.close(self.orders)
        os.waitpid(self.process, 0)


def one_pass(city: Path, seconds: float) -> None:
    """Do one pass of the watcher of a city; raise an error if anything fails."""
    settings = settings_of(city / "city.toml")
    # One line per message
    command = ("sh", "-c", f"echo $PER_OBSPY_KIND >> {city}/messages")
    settings = settings.model_copy(update={"notify": Notify(command=command)})
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
    # At least once: twice if the kill comes between a delivery and its note
    sent, due = ((place / "messages").read_text().split() for place in (city, expected))
    if sent not in (due, [*due, due[-1]]):
        faults.append(f"messages {sent}, expected {due}")
    return faults + [f"{path.name} is left" for path in city.rglob("*") if is_part(path)]


def main(folder: Path, count: int, seed: int) -> None:
    """Kill a number of watchers, and print the faults after the kills."""
    for room, name in FIGURES:
        setattr(room, name, plain_figure)
    services, chance = Services(), random.Random(seed)
    # The first pass compiles; the second tells how long one takes
    early, late, first = folder / "early", folder / "late", folder / "first"
    first.mkdir()
    write_city(first, services, pairs=8)
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
    with tempfile.TemporaryDirectory() as temporary:
        chosen = int(sys.argv[2]) if sys.argv[2:] else 1
        main(Path(temporary), int(sys.argv[1]), chosen)
