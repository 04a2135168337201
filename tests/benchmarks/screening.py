"""
Time and memory of the whole command as inventories grow.

Run: ``python tests/benchmarks/screening.py [PAIRS...]``, 10 000 and 100 000 if none are given;
Linux. The pairs surround the 24 simulated stations of the demonstration, which is the first run.
Each inventory is screened with estimates only, and up to a million pairs with the exact
demand and history of each. Seconds are by the clock, of screening with ranking, of the report, and
of the whole command from its start; processor time is that of all processes, and that of the client
apart: the process of the command, which joins what the tasks of the others make. ``further`` is the
time of a pair more than in the smaller inventory before, in us of processor time, tasks and client:
``screening.py 200000 600000`` repeats the slopes of ``docs/scaling.md``. Memory is the largest sum
over all processes (proportional set size: shared memory counts once).
"""

import ctypes
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from figures import note

from per_obspy.config import Simulation, load
from per_obspy.simulation.buildings import simulated_pairs
from per_obspy.spectra.storage import read_spectra

SIZES = (10_000, 100_000)
#: Exact histories of more pairs than that take hours.
EXACT = 1_000_000
#: Pairs that are written at once.
TOGETHER = 250_000
#: Number of this call in Linux' ``sys/prctl.h``.
PR_SET_CHILD_SUBREAPER = 36
SCENARIO = Path(__file__).parents[2] / "catalogs" / "demo" / "scenario.toml"

RECORDS = f'''
name = "Benchmark"
output = "output"
simulation = "{SCENARIO}"
'''
PAIRS = """
[pairs]
file = "pairs.parquet"
[screening]
exact = {exact}
"""
HEADER = (
    f"{'pairs':>10} {'way':9} {'screening':>9} {'report':>7} {'whole':>7} "
    f"{'processors':>10} {'client':>8} {'memory':>9} per pair  further: tasks, client"
)


def write_inventory(path: Path, count: int, stations: Path) -> None:
    """Write so many pairs around the stations, a part at a time."""
    shards = [read_spectra(shard) for shard in sorted(stations.glob("*.nc"))]
    longitude, latitude = (
        np.array([one[name].item() for one in shards]) for name in ("longitude", "latitude")
    )
    wanted = load(SCENARIO, Simulation).pairs
    writer = None
    for seed, first in enumerate(range(0, count, TOGETHER)):
        settings = wanted.model_copy(update={"count": min(TOGETHER, count - first), "seed": seed})
        table = simulated_pairs(longitude, latitude, **settings.model_dump())
        # Names count from one in every part
        names = ("pair_id", "building_id_1", "building_id_2")
        unique = {name: f"{seed}-" + table[name] for name in names}
        rows = pa.Table.from_pandas(table.assign(**unique), preserve_index=False)
        writer = writer or pq.ParquetWriter(path, rows.schema)
        writer.write_table(rows)
    assert writer is not None
    writer.close()


def memory(process: int) -> int:
    """Return the memory of a process and its descendants, bytes; 0 for those that have ended."""
    try:
        rollup = Path(f"/proc/{process}/smaps_rollup").read_text()
        own = next(
            int(line.split()[1]) * 1024 for line in rollup.splitlines() if line.startswith("Pss:")
        )
        children = [
            one.read_text().split() for one in Path(f"/proc/{process}/task").glob("*/children")
        ]
    except OSError:
        return 0
    return own + sum(memory(int(child)) for some in children for child in some)


def adopt_orphans() -> None:
    """Become the parent of processes whose own has ended, so that their processor time counts."""
    # Workers are children of a server that ends after the command
    if ctypes.CDLL(None, use_errno=True).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0):
        raise OSError(ctypes.get_errno(), "prctl")


def await_orphans() -> None:
    """Wait for all processes that are left."""
    while True:
        try:
            os.wait()
        except ChildProcessError:
            return


def measured(configuration: Path) -> dict[str, float]:
    """Run the command; return its wall and processor seconds, its client's, and memory in bytes."""
    adopt_orphans()
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [sys.executable, "-m", "per_obspy", "run", str(configuration)]
    said = configuration.with_suffix(".log")
    with said.open("w") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log)
    most = 0
    # Asked as its parent, which learns the processor time of this process alone
    while not (ended := os.wait4(process.pid, os.WNOHANG))[0]:
        most = max(most, memory(process.pid))
        time.sleep(1.0)  # looking at large processes stops them for a moment
    process.returncode = os.waitstatus_to_exitcode(ended[1])
    whole = time.perf_counter() - start
    await_orphans()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert process.returncode == 0, said.read_text()
    processors = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    client = ended[2].ru_utime + ended[2].ru_stime
    return {"whole": whole, "processors": processors, "client": client, "memory": most}


def main(sizes: list[int]) -> None:
    """Print a row for every inventory and way."""
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room)
        output, pairs, configuration = (
            folder / name for name in ("output", "pairs.parquet", "run.toml")
        )
        configuration.write_text(RECORDS)
        # Makes the records and their spectra too
        found = measured(configuration)
        remark = f"{found['whole']:.1f} s by the clock; 24 stations, 2 000 pairs"
        note("demonstration", found["processors"], "s", remark=remark)
        note("demonstration, peak memory", found["memory"] / 1e9, "GB")
        print(f"demonstration: {found['processors']:.1f} s of processor time, {remark}")
        print(HEADER)
        smaller = dict[str, tuple[int, dict[str, float]]]()
        for count in sizes:
            write_inventory(pairs, count, output / "stations")
            for exact in ("false", "true") if count <= EXACT else ("false",):
                shutil.rmtree(output / "chunks")
                configuration.write_text(RECORDS + PAIRS.format(exact=exact))
                found = measured(configuration)
                seconds = json.loads((output / "run.json").read_text())["seconds"]
                further = _further(count, found, *smaller[exact]) if exact in smaller else ""
                print(_row(count, exact, seconds, found) + further, flush=True)
                smaller[exact] = count, found


def _further(count: int, found: dict[str, float], fewer: int, before: dict[str, float]) -> str:
    """Return the processor time of tasks and client for a pair more than in another inventory."""
    client, whole = (
        (found[name] - before[name]) / (count - fewer) * 1e6 for name in ("client", "processors")
    )
    return f" {whole - client:6.1f} {client:6.1f} us"


def _row(count: int, exact: str, seconds: dict[str, float], found: dict[str, float]) -> str:
    way, each = "exact" if exact == "true" else "estimates", found["processors"] / count * 1e6
    remark = f"{each:.0f} us per pair; by the clock {found['whole']:.1f} s, of which screening "
    remark += f"{seconds['screening']:.1f} s"
    note(f"{count} pairs, {way}", found["processors"], "s", remark=remark)
    note(f"{count} pairs, {way}, peak memory", found["memory"] / 1e9, "GB")
    return (
        f"{count:10} {way:9} {seconds['screening']:7.1f} s {seconds['report']:5.1f} s "
        f"{found['whole']:5.1f} s"
        f" {found['processors']:8.1f} s {found['client']:6.1f} s"
        f" {found['memory'] / 1e6:6.0f} MB {each:4.0f} us"
    )


if __name__ == "__main__":
    main([int(one) for one in sys.argv[1:]] or list(SIZES))
