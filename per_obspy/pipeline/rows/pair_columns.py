"""Columns of a risk table for rows of buildings, read from one open file as often as needed."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

#: Pairs that are read together.
TOGETHER = 20_000


class PairColumns(NamedTuple):
    """
    Open risk table.

    Attributes
    ----------
    names : tuple of str
        Its columns.
    count : int
        Number of pairs.
    batches : callable
        Yield some columns of all pairs in the order of their ranks, some thousands at a time;
        columns that the table lacks are left out.
    """

    names: tuple[str, ...]
    count: int
    batches: Callable[[Sequence[str]], Iterator[pa.RecordBatch]]


@contextmanager
def pair_columns(path: Path) -> Iterator[PairColumns]:
    """Open a risk table for any number of passes over it."""
    with pq.ParquetFile(path.absolute(), pre_buffer=False) as file:
        names = tuple(file.schema_arrow.names)

        def batches(wanted: Sequence[str]) -> Iterator[pa.RecordBatch]:
            known = [name for name in wanted if name in names]
            return file.iter_batches(TOGETHER, columns=known, use_threads=False)

        yield PairColumns(names, int(file.metadata.num_rows), batches)
