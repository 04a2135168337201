"""
Speed of the format plugins: megabytes per second of made-up files of several megabytes.

Run as ``python tests/benchmarks/formats.py [SAMPLES]``. Files are read from memory, by processor
time, best of three; ``fixed block`` is one block of numbers without a header, the most that a
format in columns can reach.
"""

import io
import sys
import time
from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
from figures import note

from per_obspy.formats.text.lines import Text, fixed_block

sys.path.insert(0, str(Path(__file__).parents[1] / "formats"))

from format_samples import WRITERS
from sample_file import MOTION, block

SAMPLES = 100_000


def best(read: Callable[[], object]) -> float:
    """Return the shortest processor time of three calls, s."""
    times = []
    for _ in range(3):
        start = time.process_time()
        read()
        times.append(time.process_time() - start)
    return min(times)


def reader(name: str) -> Callable[..., object]:
    """Return the reader of a format."""
    (point,) = entry_points(group=f"obspy.plugin.waveform.{name}", name="readFormat")
    return point.load()


def print_rate(name: str, size: int, seconds: float) -> None:
    """Print one line."""
    print(f"{name:12} {size / 1e6:6.1f} MB {size / 1e6 / seconds:8.1f} MB/s")
    note(name, size / 1e6 / seconds, "MB/s")


def main(samples: int) -> None:
    """Print one line per format."""
    motion = np.resize(MOTION, samples)
    # One block without a header
    rows = block(motion, "%15.7E", 5).split("\n")
    text = Text("memory", rows)
    seconds = best(lambda: fixed_block(text, 0, samples, 15, 5))
    print_rate("fixed block", sum(map(len, rows)), seconds)
    # Whole files, from bytes to traces
    for name, write in WRITERS.items():
        sample = write(motion)
        content = sample.text.encode("latin-1")
        read = reader(sample.name)
        print_rate(
            name, len(content), best(lambda read=read, content=content: read(io.BytesIO(content)))
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else SAMPLES)
