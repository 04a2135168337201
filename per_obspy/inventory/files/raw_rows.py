"""
Blocks of raw rows of a file of pairs, so that an inventory need not fit in memory.

A file is read twice: once as a whole for its columns and for identifiers of pairs that may occur
twice, then block by block.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.errors import Rejection
from per_obspy.inventory.cells import NOTES, CellForm, read_columns, unit_in_cells
from per_obspy.inventory.recognition.column_meanings import Meanings
from per_obspy.inventory.schema import COLUMNS


class RawRows(NamedTuple):
    """
    Consecutive rows of a file before any check.

    Attributes
    ----------
    source : str
        The file.
    table : Table
        Numbers in the units of the schema, null where a cell is empty or not understood, with what
        is said of such cells in ``cell_notes``; text as it is.
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


def with_values(table: pa.Table, form: CellForm) -> pa.Table:
    """Return a table whose columns of numbers are numbers in the units of the schema."""
    # Text is left to the checks
    known = [name for name in table.column_names if name in COLUMNS]
    chosen = [name for name in known if COLUMNS[name].dtype != "str" or name == NOTES]
    read = read_columns({name: table[name].to_pandas() for name in chosen}, form)
    for name, values in read.items():
        column = pa.chunked_array([pa.array(values, from_pandas=True)])
        if name in chosen:
            table = table.set_column(table.column_names.index(name), name, column)
        else:
            table = table.append_column(name, column)
    return table


def cell_form(
    meanings: Meanings, gaps: Iterable[pa.ChunkedArray], marks: Mapping[str, str]
) -> CellForm:
    """
    Return how the cells of a file are written.

    Parameters
    ----------
    meanings : Meanings
        Of its headings.
    gaps : iterable of ChunkedArray
        The column of the gaps, block by block; only looked at if its heading has no unit.
    marks : mapping of str to str
        Column -> decimal mark.
    """
    # Units of headings, those of the schema too, and configured ones
    units = {means.column: means.unit for means in meanings.columns.values() if means.unit}
    units |= meanings.units
    gap_unit = ""
    for cells in () if "gap" in units else gaps:
        if gap_unit or not pa.types.is_string(cells.type):
            continue
        has_unit = pc.match_substring_regex(cells, r"\d\s*(?:\pL|['’′″”\"])")
        gap_unit = unit_in_cells(pc.unique(cells.filter(has_unit)).to_pylist())
    return CellForm(units, marks, meanings.language, gap_unit)
