"""
Files of pairs as blocks of raw rows, so that no inventory needs to fit in memory.

A file is gone through twice: once for what must be known of it as a whole (its columns, and which
names of pairs may stand twice), then block by block.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.errors import Rejection

IDENTIFIER = "pair_id"


class RawRows(NamedTuple):
    """
    Consecutive rows of a file as they stand there.

    Attributes
    ----------
    source : str
        The file.
    table : Table
        Numbers that could not all be read are still text.
    lines : (n_rows,) ndarray of int
        Line of each row in its file; the header is line 1.
    broken : tuple of Rejection
        Lines between them that are no rows.
    """

    source: str
    table: pa.Table
    lines: NDArray[np.int64]
    broken: tuple[Rejection, ...]


class PairFile(Protocol):
    """A file of pairs of some kind: its columns, the names of its pairs, its rows."""

    names: Sequence[str]

    def identifiers(self) -> Iterator[pa.Array]:
        """Give the names of the pairs, block by block."""

    def rows(self, size: int) -> Iterator[RawRows]:
        """Give the rows, so many at a time."""


def name_hashes(names: pa.Array) -> NDArray[np.uint64]:
    """Return a hash of each name, blanks around it not counted."""
    text = pc.fill_null(pc.utf8_trim_whitespace(names), "").to_numpy(zero_copy_only=False)
    hashes: NDArray[np.uint64] = pd.util.hash_array(
        np.asarray(text, dtype=object), categorize=False
    )
    return hashes
