"""
Blocks of raw rows of a file of pairs, so that an inventory need not fit in memory.

A file is read twice: once as a whole for its columns and for identifiers of pairs that may occur
twice, then block by block.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.errors import Rejection
from per_obspy.inventory.recognition.column_meanings import Meanings

#: Column with the name of the pair.
IDENTIFIER = "pair_id"


class RawRows(NamedTuple):
    """
    Consecutive rows of a file before any check.

    Attributes
    ----------
    source : str
        The file.
    table : Table
        Cells as read; a column of numbers with a cell that is none is still text.
    lines : (n_rows,) ndarray of int
        Line of each row in its file; the header is line 1.
    broken : tuple of Rejection
        Lines between the rows that are no rows.
    """

    source: str
    table: pa.Table
    lines: NDArray[np.int64]
    broken: tuple[Rejection, ...]


class PairFile(Protocol):
    """A file of pairs: its columns, the identifiers of its pairs, its rows."""

    @property
    def names(self) -> Sequence[str]:
        """Columns, by the schema where it knows them."""

    @property
    def headings(self) -> Sequence[str]:
        """The header as it is in the file."""

    @property
    def meanings(self) -> Meanings:
        """Meanings of the headings."""

    @property
    def recognised(self) -> str:
        """Recognised peculiarities of the file as text, empty if there are none."""

    def check_cells(self) -> None:
        """Raise CatalogError if a number or letter of a known column can be read in two ways."""

    def identifiers(self) -> Iterator[pa.Array]:
        """Yield the identifiers of the pairs, block by block."""

    def rows(self, size: int) -> Iterator[RawRows]:
        """Yield blocks of so many rows."""


def name_hashes(names: pa.Array) -> NDArray[np.uint64]:
    """Return a hash of each identifier without the blanks around it."""
    text = pc.fill_null(pc.utf8_trim_whitespace(names), "").to_numpy(zero_copy_only=False)
    hashes: NDArray[np.uint64] = pd.util.hash_array(
        np.asarray(text, dtype=object), categorize=False
    )
    return hashes
