"""
Memory of client and scheduler, and time per task, of many tiny tasks on a Dask cluster.

Run: ``python tests/benchmarks/many_tasks.py [TASKS ...]``, 1 000, 10 000 and 100 000 if not given;
Linux only. The tasks go the way of a run's tasks: the executor keeps two per worker ahead of the
results, and a worker checks versions and shared folder before and after each. Scheduler and two
workers are processes of their own, started as on a cluster, new ones for each row. Results are
counted and dropped, as those of a run are.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from distributed import Client

from per_obspy.config.engine import Engine
from per_obspy.jobs.cluster.dask_executor import DaskExecutor
from per_obspy.jobs.parallel import Work, results

TASKS, WORKERS = (1_000, 10_000, 100_000), 2

#: Bytes of a task, whose work is to count them.
SIZE = 1_000

#: Tasks before the first measurement: workers import the package with theirs.
FIRST = 50

HEADER = (
    f"{'tasks':>8} {'ms per task':>12} {'client, ms':>11} {'scheduler, ms':>14} "
    f"{'client before':>14} {'peak':>7} {'scheduler before':>17} {'peak':>7} MB"
)


def memory(kind: str) -> float:
    """Return the resident memory of this process, MB: VmRSS of now, VmHWM at its highest."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    (found,) = (line for line in lines if line.startswith(f"{kind}:"))
    return int(found.split()[1]) / 1024


def spent() -> float:
    """Return the processor time of this process, s."""
    return time.process_time()


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


def row(count: int) -> str:
    """Do so many tasks and return a row of the table."""
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
            assert sum(results([bytes(SIZE)] * FIRST, work, 1, executor)) == FIRST * SIZE
            before = (memory("VmRSS"), observer.run_on_scheduler(memory, "VmRSS"))
            start = (time.perf_counter(), spent(), observer.run_on_scheduler(spent))
            total = sum(results((bytes(SIZE) for _ in range(count)), work, 1, executor))
            end = (time.perf_counter(), spent(), observer.run_on_scheduler(spent))
            peak = (memory("VmHWM"), observer.run_on_scheduler(memory, "VmHWM"))
    assert total == count * SIZE  # every task once
    clock, client, scheduler = (1e3 * (b - a) / count for a, b in zip(start, end, strict=True))
    return (
        f"{count:>8} {clock:>12.2f} {client:>11.2f} {scheduler:>14.2f} {before[0]:>14.1f} "
        f"{peak[0]:>7.1f} {before[1]:>17.1f} {peak[1]:>7.1f}"
    )


def main(counts: tuple[int, ...]) -> None:
    """Print a row per number of tasks, each of a process of its own."""
    if len(counts) == 1:
        print(row(counts[0]), flush=True)
        return
    print(HEADER, flush=True)
    for count in counts:
        subprocess.run([sys.executable, __file__, str(count)], check=True)


if __name__ == "__main__":
    main(tuple(map(int, sys.argv[1:])) or TASKS)
