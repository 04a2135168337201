"""
Time until the command line answers, in seconds of the clock: the fastest of five processes.

Run: ``python tests/benchmarks/start_up.py``. An empty interpreter is the yardstick.
"""

import subprocess
import sys
import time

from figures import note

RUNS = 5

COMMANDS = {
    "empty interpreter": ["-c", "pass"],
    "import per_obspy": ["-c", "import per_obspy"],
    "per-obspy --help": ["-m", "per_obspy", "--help"],
    "per-obspy run --help": ["-m", "per_obspy", "run", "--help"],
    "per-obspy fetch --help": ["-m", "per_obspy", "fetch", "--help"],
}


def fastest(arguments: list[str]) -> float:
    """Return the shortest time of a process with these arguments, s."""
    seconds = []
    for _ in range(RUNS):
        start = time.perf_counter()
        subprocess.run([sys.executable, *arguments], capture_output=True, check=True)
        seconds.append(time.perf_counter() - start)
    return min(seconds)


if __name__ == "__main__":
    for name, arguments in COMMANDS.items():
        seconds = fastest(arguments)
        print(f"{name:24} {seconds:6.2f} s")
        note(name, seconds, "s")
