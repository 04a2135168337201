"""
Memory of client and scheduler, and time per task, of many tiny tasks on a Dask cluster.

Run: ``python tests/benchmarks/many_tasks.py [TASKS ...]``, 1 000, 10 000 and 100 000 if not given;
Linux only. The tasks go the way of a run's tasks: the executor keeps two per worker ahead of the
results, and a worker checks versions and shared folder before and after each. Scheduler and two
workers are processes of their own, started as on a cluster. Results are checked and dropped.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from distributed import Client

from per_obspy.config.engine import Engine
from per_obspy.runs.tasks.executor import DaskExecutor
from per_obspy.runs.tasks.parallel import Work, Workers, results

TASKS, WORKERS = (1_000, 10_000, 100_000), 2

#: Bytes of a task, whose work is to count them.
SIZE = 1_000

#: Tasks before the first measurement: workers import the package with theirs.
FIRST = 50

HEADER = (
    f"{'tasks':>8} {'ms per task':>12} {'client, ms':>11} {'scheduler, ms':>14} "
    f"{'client':>9} {'peak':>7} {'scheduler':>10} {'peak':>7} MB"
)


def memory(kind: str) -> float:
    """Return the resident memory of this process, MB: VmRSS of now, VmHWM at its highest."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    (found,) = (line for line in lines if line.startswith(f"{kind}:"))
    return int(found.split()[1]) / 1024


def failed(content: bytes, reason: str) -> int:
    """Stop: no task fails."""
    raise RuntimeError(f"{len(content)} bytes: {reason}")


@contextmanager
def cluster(folder: Path) -> Iterator[str]:
    """Yield the scheduler file of a scheduler and its workers, which end with it."""
    file = folder / "scheduler.json"
    place = ["--scheduler-file", str(file)]
    commands = [["scheduler", "--host", "127.0.0.1", "--port", "0", "--dashboard-address", ":0"]]
    commands += [["worker", "--nthreads", "1", "--dashboard-address", ":0"]] * WORKERS
    processes = []
    try:
        for command in commands:
            # The module is found from any folder
            program = [sys.executable, "-m", "distributed.cli.dask_" + command[0]]
            log = (folder / "log").open("ab")
            processes.append(
                subprocess.Popen([*program, *command[1:], *place], cwd=folder, stderr=log)
            )
            while not file.exists():
                time.sleep(0.1)
        yield str(file)
    finally:
        for process in reversed(processes):
            process.terminate()
            process.wait()


class Spent(NamedTuple):
    """Seconds by the clock and of both processes, and their memory now and at its highest, MB."""

    clock: float
    client: float
    scheduler: float
    memory: tuple[float, float, float, float]


def used(observer: Client) -> Spent:
    """Return time and memory of client and scheduler so far."""
    ask = observer.run_on_scheduler
    now, highest = ask(memory, "VmRSS"), ask(memory, "VmHWM")
    kept = (memory("VmRSS"), memory("VmHWM"), now, highest)
    return Spent(time.perf_counter(), time.process_time(), ask(time.process_time), kept)


def row(count: int, start: Spent, end: Spent) -> str:
    """Return a row of the table."""
    clock, client, scheduler = (
        1e3 * (b - a) / max(count, 1) for a, b in zip(start[:3], end[:3], strict=True)
    )
    now, highest, there, highest_there = end.memory
    return (
        f"{count:>8} {clock:>12.2f} {client:>11.2f} {scheduler:>14.2f} "
        f"{now:>9.1f} {highest:>7.1f} {there:>10.1f} {highest_there:>7.1f}"
    )


def main(counts: Sequence[int]) -> None:
    """Print a row at the begin and after each number of tasks."""
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room)
        with (
            cluster(folder) as file,
            DaskExecutor(file) as executor,
            executor.sharing(folder, Engine()),
            Client(scheduler_file=file, set_as_default=False) as observer,
        ):
            observer.wait_for_workers(WORKERS)
            work: Work[bytes, int] = Work(len, failed)
            assert sum(results([bytes(SIZE)] * FIRST, work, Workers(1, executor))) == FIRST * SIZE
            start = used(observer)
            print(HEADER, row(0, start, start), sep="\n", flush=True)
            tasks = (bytes(SIZE) for _ in range(max(counts)))
            for number, result in enumerate(results(tasks, work, Workers(1, executor)), 1):
                assert result == SIZE
                if number in counts:
                    print(row(number, start, used(observer)), flush=True)
            assert number == max(counts)  # every task once
            assert executor.facts()["events"] == []


if __name__ == "__main__":
    main(list(map(int, sys.argv[1:])) or TASKS)
