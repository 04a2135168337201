"""
Share of a run's processor time outside of its tasks, on 1, 2 and 4 worker processes.

Run: ``python tests/benchmarks/cluster.py [PAIRS]``, 1 000 000 if not given; estimates only. Tasks
are stations, chunks of pairs and rows of buildings; outside of them are reading, joining, ranking
and the report in the one process that a cluster does not speed up. Processor times do not depend on
what else runs on the machine, seconds by the clock do.
"""

import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from screening import PAIRS, RECORDS, write_inventory

WORKERS = (1, 2, 4)
HEADER = f"{'workers':>7} {'clock':>8} {'tasks':>8} {'outside':>8} {'share':>6} {'screening':>9}"


def measured(configuration: Path, workers: int, output: Path) -> str:
    """Run the command on so many workers and return a row of the table."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [sys.executable, "-m", "per_obspy", "run", str(configuration)]
    subprocess.run([*command, "--dask", f"local:{workers}"], check=True, capture_output=True)
    clock, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    whole = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    record = json.loads((output / "run.json").read_text())
    tasks = sum(worker["seconds"] for worker in record["engine"]["workers"])
    share, screening = (whole - tasks) / whole, record["seconds"]["screening"]
    return (
        f"{workers:>7} {clock:>7.1f}s {tasks:>7.1f}s {whole - tasks:>7.1f}s {share:>6.0%} "
        f"{screening:>8.1f}s"
    )


def main(count: int) -> None:
    """Print a row per number of workers."""
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room)
        output, configuration = folder / "output", folder / "run.toml"
        configuration.write_text(RECORDS)
        command = [sys.executable, "-m", "per_obspy", "run", str(configuration)]
        subprocess.run(command, check=True, capture_output=True)
        write_inventory(folder / "pairs.parquet", count, output / "stations")
        configuration.write_text(RECORDS + PAIRS.format(exact="false"))
        print(HEADER)
        for workers in WORKERS:
            # A finished run is not done again, however many workers there are
            (output / "run.json").unlink()
            for name in ("chunks", "rows"):
                shutil.rmtree(output / name, ignore_errors=True)
            print(measured(configuration, workers, output), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
