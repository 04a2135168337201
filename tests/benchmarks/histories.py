"""
Exact demand and pounding history of many pairs of the demonstration, by two processes.

    python tests/benchmarks/histories.py [PAIRS]

50 000 pairs if no number is given. They surround the 24 simulated stations of the demonstration,
which is the first run, as its own pairs do: half of them touch, most periods are derived. Every
pair gets what an exact screening computes of its own motion: the largest relative displacement
without contact and, unless that stays below the gap, the history with pounding. Populations, rows
of buildings and tables are left out; ``screening.py`` measures whole runs.
"""

import os
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np
from figures import note
from screening import RECORDS, SCENARIO, measured

from per_obspy.config import Building, Screening, Simulation, load
from per_obspy.inventory.checking import checked_pairs
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.assignment import Stations, assigned, stations_of
from per_obspy.screening.exact import exact_outcome, furthest_azimuth
from per_obspy.screening.station_motion import StationMotion, station_motion
from per_obspy.screening.values import Columns
from per_obspy.simulation.buildings import simulated_pairs
from per_obspy.spectra.storage import read_spectra
from per_obspy.threads import use_one_thread

PAIRS, TOGETHER, PROCESSES = 50_000, 10_000, 2


class Measured(NamedTuple):
    """Pairs, histories and impacts of a task, and its processor seconds in this process."""

    process: int
    pairs: int
    histories: int
    impacts: int
    seconds: float


@cache
def stations(folder: Path) -> tuple[Stations, dict[int, StationMotion]]:
    """Return the stations of a run, read once per process."""
    found, _ = stations_of([read_spectra(shard) for shard in sorted(folder.glob("*.nc"))])
    return found, {index: station_motion(found.read(index)) for index in range(found.names.size)}


def pairs_of_stations(found: Stations, seed: int, count: int) -> Iterator[tuple[int, Columns]]:
    """Yield station and completed pairs, as the demonstration makes them with this seed."""
    settings = load(SCENARIO, Simulation).pairs.model_copy(update={"count": count, "seed": seed})
    table = simulated_pairs(found.longitude, found.latitude, **settings.model_dump())
    complete = completed_pairs(checked_pairs(table, "simulated pairs"), Building())
    placed, _ = assigned(complete, found, Screening().largest_distance)
    for station, rows in placed.groupby("station_index"):
        yield int(station), {name: rows[name].to_numpy() for name in rows}


def compute(folder: Path, seed: int, count: int) -> Measured:
    """Compute demand and histories of pairs; only that is timed."""
    found, motions = stations(folder)
    pairs = histories = impacts = 0
    seconds = 0.0
    for station, block in pairs_of_stations(found, seed, count):
        size = block["gap"].size
        start = time.process_time()
        azimuth = block["azimuth"].astype(float)
        unknown = np.isnan(azimuth)
        if unknown.any():
            some = {name: column[unknown] for name, column in block.items()}
            azimuth[unknown] = furthest_azimuth(motions[station], some)
        # radii only scale a column that is not used; no displacement is below a yield displacement
        ones = {f"{name}_{i}": np.full(size, np.inf) for name in ("per", "sd") for i in (1, 2)}
        ones["azimuth_used"] = azimuth
        outcome = exact_outcome(motions[station], block | ones, azimuth)
        seconds += time.process_time() - start
        pairs += size
        histories += int((outcome["demand_exact"] >= block["gap"]).sum())
        impacts += int(outcome["impacts"].sum())
    return Measured(os.getpid(), pairs, histories, impacts, seconds)


def main(count: int) -> None:
    """Print and note the rate of each process, and the time by the clock."""
    with tempfile.TemporaryDirectory() as room:
        configuration = Path(room, "run.toml")
        configuration.write_text(RECORDS)
        measured(configuration)
        folder = Path(room, "output", "stations")
        sizes = [min(TOGETHER, count - first) for first in range(0, count, TOGETHER)]
        with ProcessPoolExecutor(PROCESSES, get_context("spawn"), use_one_thread) as pool:
            # Compiled kernels are loaded before
            list(pool.map(compute, [folder] * 2 * PROCESSES, range(2 * PROCESSES), [500] * 4))
            start = time.perf_counter()
            seeds = range(1000, 1000 + len(sizes))
            tasks = list(pool.map(compute, [folder] * len(sizes), seeds, sizes))
            clock = time.perf_counter() - start
    pairs, seconds = sum(one.pairs for one in tasks), sum(one.seconds for one in tasks)
    share = sum(one.histories for one in tasks) / pairs
    busiest = max(
        sum(one.seconds for one in tasks if one.process == process)
        for process in {one.process for one in tasks}
    )
    remark = f"{pairs} pairs, {100 * share:.0f} % with a history, "
    remark += f"{sum(one.impacts for one in tasks) / pairs:.1f} impacts that count per pair; "
    remark += f"the busier of {PROCESSES} processes {busiest:.1f} s, {clock:.1f} s by the clock "
    remark += "with the making of the pairs"
    print(f"{pairs / seconds:.0f} pairs/s and core; {remark}")
    note("exact demand and history", pairs / seconds, "pairs/s", remark=remark)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else PAIRS)
