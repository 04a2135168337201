"""Columns of a risk table for rows of buildings, read as often as needed."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa

from per_obspy.tables.ranked_table import ranked_table

#: Pairs that are read together.
TOGETHER = 20_000


class PairColumns(NamedTuple):
    """
    Open risk table.

    Attributes
    ----------
    names : tuple of str
        Its columns.
    pairs : int
        Number of pairs.
    batches : callable
        Yield some columns of all pairs, in the same order every time, some thousands at a time;
        columns that the table lacks are left out.
    """

    names: tuple[str, ...]
    pairs: int
    batches: Callable[[Sequence[str]], Iterator[pa.RecordBatch]]


@contextmanager
def pair_columns(files: Sequence[Path]) -> Iterator[PairColumns]:
    """Open a risk table, in one file or one per cell, for any number of passes over it."""
    with ranked_table(files) as table:
        yield PairColumns(tuple(table.schema.names), table.pairs, partial(table.batches, TOGETHER))
