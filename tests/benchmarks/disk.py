"""
Speed of the disk, and of writing and reading each kind of table on one core.

Run: ``python tests/benchmarks/disk.py PART``, where PART is a file of ``chunks/`` of a run; Linux.
The disk is written and read past the caches, 2 GB in the folder for temporary files. The others are
processor time, in MB of the file, the best of three.
"""

import mmap
import os
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.files import file_hash
from per_obspy.results.parts import TOGETHER, part_rows, text_columns
from per_obspy.results.ranked_table import ROWS
from per_obspy.threads import use_one_thread

#: Bytes of a block, and number of blocks.
BLOCK, BLOCKS = 8 << 20, 256


def disk_speed(path: Path) -> None:
    """Print the speed of a file that is larger than what is written at once, by the clock."""
    block = mmap.mmap(-1, BLOCK)  # at the begin of a page, as such reading needs
    block.write(os.urandom(BLOCK))
    start = time.perf_counter()
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_DIRECT)
    for _ in range(BLOCKS):
        os.write(file, block)
    os.fsync(file)
    os.close(file)
    written = time.perf_counter()
    file = os.open(path, os.O_RDONLY | os.O_DIRECT)
    while os.readv(file, [block]):
        continue
    os.close(file)
    size = BLOCK * BLOCKS / 1e6
    print(f"disk written: {size / (written - start):.0f} MB/s")
    print(f"disk read: {size / (time.perf_counter() - written):.0f} MB/s")


def timed(name: str, rows: int, path: Path, work: Callable[[], object]) -> None:
    """Print the speed of some work on a file."""
    best = float("inf")
    for _ in range(3):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    size = path.stat().st_size / 1e6
    print(f"{name}: {size / best:.0f} MB/s, {best / rows * 1e6:.2f} us per row")


def drained(tables: Iterator[pa.Table]) -> None:
    """Read all rows, and forget them."""
    deque(tables, maxlen=0)


def main(part: Path) -> None:
    """Print a line for each kind."""
    use_one_thread()
    table = pq.read_table(part, use_threads=False).combine_chunks()
    texts, rows = text_columns(table.schema), table.num_rows
    with tempfile.TemporaryDirectory() as room:
        disk_speed(Path(room) / "disk")
        parquet = Path(room) / "part.parquet"

        def parquet_in_groups(size: int) -> None:
            pq.write_table(table, parquet, row_group_size=size, use_dictionary=texts)

        timed("table written (Parquet)", rows, parquet, lambda: parquet_in_groups(ROWS))
        timed("part written (Parquet)", rows, parquet, lambda: parquet_in_groups(TOGETHER))
        timed(
            "part read (Parquet)", rows, parquet, lambda: drained(part_rows(parquet, table.schema))
        )
        timed("hash", rows, parquet, lambda: file_hash(parquet))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
