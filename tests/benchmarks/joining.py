"""
Time and memory of joining and ranking the parts of a risk table.

Run: ``python tests/benchmarks/joining.py [PARTS ROWS NUMBERS [CELL]]``: parts, rows of each, and
columns of numbers in addition to those of the order; with the width of a cell in degrees the table
is a dataset by cell, in this process too. Prints seconds of processor, the largest memory of this
process, and bytes on disk of parts and table. Parts are made up: names and values differ in every
row, and every part has rows in all cells of 10 by 10 degrees.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

from per_obspy.results.parts import write_part
from per_obspy.results.ranked_table import table_files
from per_obspy.results.risk import write_risk
from per_obspy.screening.ranking import in_order


def write_made_up(folder: Path, number: int, rows: int, numbers: int) -> Path:
    """Write one part, and return its file."""
    draw = np.random.default_rng(number)
    first = number * rows
    table = pd.DataFrame(
        {
            "pair_id": [f"P{first + index:012}" for index in range(rows)],
            "state": draw.choice(["yes", "possible", "no"], rows),
            "station": draw.choice([f"XX.S{index:03}" for index in range(24)], rows),
            "probability": draw.random(rows),
            "expected_impact_velocity": draw.random(rows),
            "expected_amplification": draw.random(rows),
            "longitude": draw.random(rows) * 10.0,
            "latitude": draw.random(rows) * 10.0,
        }
    )
    others = pd.DataFrame(draw.random((rows, numbers)), columns=[f"x{i}" for i in range(numbers)])
    path = folder / f"{number:06}.parquet"
    write_part(in_order(pd.concat([table, others], axis=1)), number, path)
    return path


def main(parts: int, rows: int, numbers: int, cell: float) -> None:
    """Print one line."""
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room)
        chunks = folder / "chunks"
        chunks.mkdir()
        files = [write_made_up(chunks, number, rows, numbers) for number in range(parts)]
        before, start = resource.getrusage(resource.RUSAGE_SELF), time.process_time()
        write_risk(files, folder, {"name": "made up"}, 100_000, cell or None)
        seconds = time.process_time() - start
        used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        disk = [
            sum(path.stat().st_size for path in some) / 1e9 for some in (files, table_files(folder))
        ]
    print(
        f"{parts * rows:.0e} pairs in {parts} parts, {numbers + 8} columns: {seconds:.1f} s "
        f"processor, {used:.2f} GB ({before.ru_maxrss / 1e6:.2f} before), parts {disk[0]:.2f} GB, "
        f"table {disk[1]:.2f} GB"
    )


if __name__ == "__main__":
    given = [float(text) for text in sys.argv[1:]]
    counts = [int(number) for number in [*given[:3], *(100, 10_000, 90)[len(given) :]]]
    main(*counts, cell=given[3] if len(given) > 3 else 0.0)
