"""
Stations from raw records to station files: processor time of one, and the clock for 300.

    python tests/benchmarks/stations.py [STATIONS] [FOLDER]

Simulates stations of the demonstration's earthquake (records of 60 to 120 s at 0.01 s, which
processing pads to some 24 000 samples) and screens twenty pairs against them with ``per-obspy run``
on two processes. Simulation is not counted. One station is timed in this process: 100 periods, 4
dampings, 180 azimuths, the fastest of eight. A folder that is kept saves the simulation next time.
"""

import re
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from figures import note

CHECKOUT = Path(__file__).parents[2]
SCENARIO = CHECKOUT / "catalogs" / "demo" / "scenario.toml"
STATIONS, PAIRS, ALONE = 300, 20, 8


def simulated(stations: int, folder: Path) -> tuple[Path, Path]:
    """Return a folder of records and a table of pairs, made unless they are there."""
    records, pairs = folder / "records", folder / "pairs.csv"
    if not records.exists():
        text = re.sub(r"(?m)^stations = \d+", f"stations = {stations}", SCENARIO.read_text())
        scenario = folder / "scenario.toml"
        scenario.write_text(text)
        subprocess.run(
            [sys.executable, "-m", "per_obspy", "simulate", str(scenario), "-o", str(records)],
            check=True,
            capture_output=True,
        )
    lines = SCENARIO.with_name("pairs.csv").read_text().splitlines(keepends=True)
    pairs.write_text("".join(lines[: PAIRS + 1]))
    return records, pairs


def one_station(records: Path, folder: Path) -> tuple[float, dict[str, float], int]:
    """Return processor time of a station, that of its parts, and samples, the fastest of some."""
    from per_obspy.config import Processing, Records, Spectra
    from per_obspy.records.sources import find_sources
    from per_obspy.runs.stations import station_tasks
    from per_obspy.runs.tasks import station as work

    parts: dict[str, float] = {}

    def timed(name: str) -> None:
        """Let a function of the module note its shortest processor time."""
        function = getattr(work, name)

        def measured(*arguments: object) -> object:
            start = time.process_time()
            result = function(*arguments)
            parts[name] = min(parts.get(name, 1e9), time.process_time() - start)
            return result

        setattr(work, name, measured)

    for name in ("process_station", "station_spectra", "write_spectra"):
        timed(name)
    found = find_sources(Records(folder=records, event=records / "event.xml"), None)
    output = folder / "alone"
    output.mkdir(exist_ok=True)
    jobs = station_tasks(found.stations, output, Processing(), Spectra(), found.event)
    fastest, samples = 1e9, 0
    for job in jobs[: ALONE + 1]:
        start = time.process_time()
        done = replace(job, key="benchmark").do()
        fastest = min(fastest, time.process_time() - start)
        samples = max(samples, work.read_spectra(done.shard).sizes["time"] if done.shard else 0)
    return fastest, parts, samples


def main(stations: int, folder: Path) -> None:
    """Measure one station, then a whole run of all."""
    records, pairs = simulated(stations, folder)
    fastest, parts, samples = one_station(records, folder)
    texts = [f"{name} {1e3 * value:.0f} ms" for name, value in parts.items()]
    print(f"one station, up to {samples} samples: {1e3 * fastest:.0f} ms; {', '.join(texts)}")
    note("one station", 1e3 * fastest, "ms", remark="; ".join(texts))
    # The whole command, with its workers; nothing of an earlier run is used
    with tempfile.TemporaryDirectory() as output:
        command = [sys.executable, "-m", "per_obspy", "run", str(records), str(pairs)]
        start = time.perf_counter()
        subprocess.run(
            [*command, "-o", output, "--set", "workers=2"], check=True, capture_output=True
        )
        clock = time.perf_counter() - start
    what = f"{stations} stations, {PAIRS} pairs, two processes"
    print(f"{what}: {clock:.1f} s by the clock")
    note(what, clock, "s", remark="by the clock, the whole command")


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else STATIONS
    if len(sys.argv) > 2:
        kept = Path(sys.argv[2])
        kept.mkdir(parents=True, exist_ok=True)
        main(count, kept)
    else:
        with tempfile.TemporaryDirectory() as temporary:
            main(count, Path(temporary))
