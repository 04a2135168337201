"""
Time until the command line answers, in seconds of the clock: the fastest of five processes.

Run: ``python tests/benchmarks/start_up.py``. An empty interpreter is the yardstick. Workers are
timed from the start of a pool to the first result of a task that needs the libraries of a station.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from figures import note

RUNS = 5

COMMANDS = {
    "empty interpreter": ["-c", "pass"],
    "import per_obspy": ["-c", "import per_obspy"],
    "per-obspy --help": ["-m", "per_obspy", "--help"],
    "per-obspy run --help": ["-m", "per_obspy", "run", "--help"],
    "per-obspy fetch --help": ["-m", "per_obspy", "fetch", "--help"],
}


CHECKOUT = Path(__file__).parents[2]

#: Program that prints the time until a worker has done its first task, s: as a run begins its
#: workers, after its own libraries are loaded.
WORKER = """
import contextlib, time
from per_obspy.runs.tasks import worker_start
from per_obspy.runs.tasks.parallel import Workers, Work, prepare_workers, results
with {context}:
    prepare_workers(2)
    import per_obspy.runs.stages
    start = time.perf_counter()
    task = "__import__('per_obspy.runs.tasks.station') and 0"
    next(results([task] * 2, Work(eval, print), Workers(2)))
    print(time.perf_counter() - start)
"""

WORKERS = {
    "first result of a forked worker": "worker_start.forked_workers()",
    "first result of a fresh worker": "contextlib.nullcontext()",
}


def worker_time(context: str) -> float:
    """Return the shortest time of three until a worker begins, s."""
    command = [sys.executable, "-c", WORKER.format(context=context)]
    runs = [subprocess.run(command, capture_output=True, check=True) for _ in range(3)]
    return min(float(run.stdout) for run in runs)


def finished_run() -> float:
    """Return the time until a run answers whose work is done, s."""
    with tempfile.TemporaryDirectory() as folder:
        smoke = str(CHECKOUT / "workflows" / "smoke.toml")
        command = ["-m", "per_obspy", "run", smoke, "-o", folder]
        subprocess.run([sys.executable, *command], capture_output=True, check=True)
        return fastest(command)


def fastest(arguments: list[str]) -> float:
    """Return the shortest time of a process with these arguments, s."""
    seconds = []
    for _ in range(RUNS):
        start = time.perf_counter()
        subprocess.run([sys.executable, *arguments], capture_output=True, check=True)
        seconds.append(time.perf_counter() - start)
    return min(seconds)


if __name__ == "__main__":
    found = {name: fastest(arguments) for name, arguments in COMMANDS.items()}
    found["per-obspy run, finished"] = finished_run()
    found |= {name: worker_time(context) for name, context in WORKERS.items()}
    for name, seconds in found.items():
        print(f"{name:32} {seconds:6.2f} s")
        note(name, seconds, "s")
