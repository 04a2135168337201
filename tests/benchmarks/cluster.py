"""
Share of a run's processor time outside of its tasks, on 1, 2 and 4 worker processes.

Run: ``python tests/benchmarks/cluster.py [PAIRS [DATASET_FROM]]``, 1 000 000 pairs and one risk
table if not given; estimates only. Tasks are stations, chunks of pairs, cells and rows of
buildings; outside of them are the start of all processes, reading, joining, ranking and the report
in the one process that a cluster does not speed up. A tenth of the pairs is measured first, so that
the last line has the processor time of each further pair, without everything that is done once.
Processor times do not depend on what else runs on the machine, seconds by the clock do.
"""

import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from screening import PAIRS, RECORDS, write_inventory

WORKERS = (1, 2, 4)
HEADER = (
    f"{'pairs':>9} {'workers':>7} {'clock':>8} {'tasks':>8} {'outside':>8} {'share':>6} "
    f"{'screening':>9}"
)


class Measured(NamedTuple):
    """Seconds of one run: by the clock, of its tasks, outside of them, and of its screening."""

    clock: float
    tasks: float
    outside: float
    screening: float


def measured(configuration: Path, workers: int, output: Path) -> Measured:
    """Run the command on so many workers, with all pairs to do."""
    # A finished run is not done again, however many workers there are
    (output / "run.json").unlink()
    for name in ("chunks", "cells", "rows"):
        shutil.rmtree(output / name, ignore_errors=True)
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [sys.executable, "-m", "per_obspy", "run", str(configuration)]
    subprocess.run([*command, "--dask", f"local:{workers}"], check=True, capture_output=True)
    clock, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    whole = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    record = json.loads((output / "run.json").read_text())
    tasks = sum(worker["seconds"] for worker in record["engine"]["workers"])
    return Measured(clock, tasks, whole - tasks, record["seconds"]["screening"])


def row(count: int, workers: int, found: Measured) -> str:
    """Return a row of the table."""
    share = found.outside / (found.tasks + found.outside)
    return (
        f"{count:>9} {workers:>7} {found.clock:>7.1f}s {found.tasks:>7.1f}s "
        f"{found.outside:>7.1f}s {share:>6.0%} {found.screening:>8.1f}s"
    )


def main(count: int, dataset_from: int) -> None:
    """Print a row per number of workers, and the time of each further pair."""
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room)
        output, configuration = folder / "output", folder / "run.toml"
        configuration.write_text(RECORDS)
        command = [sys.executable, "-m", "per_obspy", "run", str(configuration)]
        subprocess.run(command, check=True, capture_output=True)
        head = f"{RECORDS}dataset_from = {dataset_from}\ndataset_cell = 0.1\n"
        configuration.write_text(head + PAIRS.format(exact="false"))
        print(HEADER)
        few = count // 10
        write_inventory(folder / "pairs.parquet", few, output / "stations")
        first = measured(configuration, 1, output)
        print(row(few, 1, first), flush=True)
        write_inventory(folder / "pairs.parquet", count, output / "stations")
        runs = {}
        for workers in WORKERS:
            runs[workers] = measured(configuration, workers, output)
            print(row(count, workers, runs[workers]), flush=True)
    each = (count - few) / 1e6
    tasks, outside = runs[1].tasks - first.tasks, runs[1].outside - first.outside
    print(f"each further pair: {tasks / each:.0f} us in tasks, {outside / each:.0f} us outside")


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:]]
    main(*[*given, *(1_000_000, 20_000_000)[len(given) :]])
