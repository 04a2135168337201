"""
Memory and processor time of finding rows of buildings, as tables grow.

Run: ``python tests/benchmarks/finding_rows.py RISK COPIES...``, where RISK is a ``risk.parquet``
with identifiers of buildings. Each number of copies is measured in a process of its own, whose
copies have names of their own. Memory is the largest resident size; the slope between two numbers
of copies is that of a further pair.
"""

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from per_obspy.buildings.search import find_rows
from per_obspy.config.pairs import Rows
from per_obspy.results.ranked_table import ranked_table

NAMES = ("pair_id", "building_id_1", "building_id_2")


def write_copies(risk: Path, copies: int, path: Path) -> None:
    """Write copies of a risk table one after the other, with ranks and names of their own."""
    with pq.ParquetFile(risk) as file, pq.ParquetWriter(path, file.schema_arrow) as writer:
        rank = 1
        for copy in range(copies):
            for batch in file.iter_batches(50_000):
                table = pa.Table.from_batches([batch])
                for name in NAMES:
                    place = table.column_names.index(name)
                    text = pc.binary_join_element_wise(table[name], str(copy), "-")
                    table = table.set_column(place, name, text)
                ranks = pa.array(np.arange(rank, rank + table.num_rows))
                writer.write_table(table.set_column(0, "rank", ranks))
                rank += table.num_rows


def measured(path: Path) -> None:
    """Find the rows of a table, and print pairs, rows, processor time and memory."""
    before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    with tempfile.TemporaryDirectory() as room, ranked_table([path]) as pairs:
        found = find_rows(pairs, Rows(), None, Path(room))
        disk = found.file.stat().st_size / 1e6
    after, used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time() - start
    print(
        f"{found.contacts:>9} {found.rows:>8} {used:>7.2f} s {before / 1024:>6.0f} MB before "
        f"{after / 1024:>6.0f} MB {disk:>6.0f} MB of disk",
        flush=True,
    )


def main(risk: Path, copies: list[int]) -> None:
    """Print a row per number of copies."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "risk.parquet"
        for count in copies:
            write_copies(risk, count, path)
            subprocess.run([sys.executable, __file__, str(path)], check=True)


if __name__ == "__main__":
    if len(sys.argv) == 2:
        measured(Path(sys.argv[1]))
    else:
        main(Path(sys.argv[1]), [int(copies) for copies in sys.argv[2:]])
