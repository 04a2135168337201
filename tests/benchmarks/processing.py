"""
Time of the processing of the eleven Ridgecrest stations, and of gmprocess on the same files.

Run: ``python tests/benchmarks/processing.py FOLDER [PYTHON]``, where FOLDER holds MiniSEED and
StationXML, and PYTHON is the interpreter of an environment of its own with gmprocess 2.x in it
(``python -m venv E; E/bin/pip install gmprocess``). Prints seconds of processor time: the clock
depends on who else uses the machine.
"""

import cProfile
import pstats
import subprocess
import sys
import time
from pathlib import Path

from per_obspy.config import Processing
from per_obspy.processing.chain import process_station
from per_obspy.records.folder import find_stations, read_station

ROUNDS = 3

#: step -> the functions whose time is its own, with everything they call
STEPS = {
    "read, attach metadata": ("read_station",),
    "merge, orient, pair": ("merged", "orient", "paired"),
    "checks of raw samples": ("raw_findings",),
    "response removal": ("in_acceleration",),
    "first wave": ("noise_windows",),
    "means and lines": ("without_mean", "without_line"),
    "noise spectra": ("noise_spectra",),
    "corner by displacement": ("_clean_baseline",),
    "pad and filter": ("pad", "bandpass"),
    "final checks": ("final_findings",),
}

#: gmprocess with its own defaults, on streams it has read itself
PEER = """
import logging, sys, time, warnings
warnings.simplefilter("ignore"); logging.disable(logging.CRITICAL)
from gmprocess.core.scalar_event import ScalarEvent
from gmprocess.core.streamcollection import StreamCollection
from gmprocess.utils.config import get_config
from gmprocess.waveform_processing.processing import process_streams
from obspy import UTCDateTime
origin = UTCDateTime("2019-07-06T03:19:53.04")
event = ScalarEvent.from_params("ci38457511", origin, 35.7695, -117.5993, 8.0, 7.1, "mw")
start = time.process_time(); streams = StreamCollection.from_directory(sys.argv[1])
read = time.process_time(); done = process_streams(streams, event, config=get_config())
end = time.process_time()
print(len(streams), sum(one.passed for one in done), read - start, end - read)
"""


def work(folder: Path) -> tuple[int, int]:
    """Read and process every station; return how many there are and how many survive."""
    found = find_stations(folder)
    kept = 0
    for name, paths in found.stations.items():
        stream, _ = read_station(paths, found.inventory, name)
        kept += bool(process_station(stream, Processing())[0])
    return len(found.stations), kept


def seconds_of(folder: Path) -> float:
    """Return the least processor time of a few rounds, s."""
    times = []
    for _ in range(ROUNDS):
        start = time.process_time()
        work(folder)
        times.append(time.process_time() - start)
    return min(times)


def print_steps(folder: Path) -> None:
    """Print the share of each step in the time of all, under the profiler."""
    profile = cProfile.Profile()
    profile.runcall(work, folder)
    table = pstats.Stats(profile).stats  # type: ignore[attr-defined]
    own = {}
    for (_, _, function), (_, _, _, cumulative, _) in table.items():
        own[function] = max(own.get(function, 0.0), cumulative)
    whole = own["work"]
    for step, functions in STEPS.items():
        print(f"  {step:24s} {sum(own.get(one, 0.0) for one in functions) / whole:6.1%}")


def main(folder: Path, python: str | None) -> None:
    """Print ours, where it goes, and theirs."""
    work(folder)  # imports, caches
    seconds = seconds_of(folder)
    stations, kept = work(folder)
    print(
        f"per_obspy: {stations} stations, {kept} kept, {seconds:.2f} s: "
        f"{stations / seconds:.1f} stations a second"
    )
    print_steps(folder)
    if python:
        done = subprocess.run(
            [python, "-c", PEER, str(folder)], capture_output=True, text=True, check=True
        )
        number, passed, read, processed = map(float, done.stdout.split()[-4:])
        print(
            f"gmprocess: {number:.0f} stations, {passed:.0f} kept, {read:.2f} s to read, "
            f"{processed:.2f} s to process"
        )
        print(f"ratio, reading included: {(read + processed) / seconds:.1f}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else None)
