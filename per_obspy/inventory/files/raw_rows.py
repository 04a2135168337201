"""Rows of a table as its file has them, in blocks, so that an inventory need not fit in memory."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.errors import Rejection
from per_obspy.inventory.files.headings import Meanings
from per_obspy.inventory.files.text_cells import given_text


class RawRows(NamedTuple):
    """Consecutive rows of a file before any check."""

    #: The file.
    source: str
    #: Numbers in the units of the schema, null where a cell is empty or not understood, with what
    #: is said of such cells in ``cell_notes``; text as it is.
    table: pa.Table
    #: Line of each row in its file; the header is line 1. Shape (n_rows,).
    lines: NDArray[np.int64]
    #: Lines between the rows that are no rows.
    broken: tuple[Rejection, ...]


class Contents(NamedTuple):
    """A table as its file has it."""

    #: The file, with the sheet of a workbook.
    source: str
    #: Of its header.
    meanings: Meanings
    #: ``blocks(places)`` yields these columns, named by their place, with the broken lines: every
    #: line of the file is in one of the rows, broken or blank.
    blocks: Callable[[Sequence[int]], Iterator[RawRows]]
    #: How the file is written, where that is not plain.
    form: tuple[str, ...] = ()
    #: Whether every cell is text, so that numbers in it have to be recognised.
    is_text: bool = True
    #: Between the cells of a text.
    separator: str = ""
    #: Whether another encoding would give other letters, and no heading decides.
    is_doubtful: bool = False

    @property
    def names(self) -> list[str]:
        """Of its columns, by the schema where it knows them; empty for a column without a name."""
        names = self.meanings.names
        return [given_text(name.strip()) for name in names] if self.is_text else names


def stripped(names: pa.Array | pa.ChunkedArray) -> pa.StringArray:
    """Return identifiers as text without the blanks around them, "" where there is none."""
    texts = pc.utf8_trim_whitespace(pc.fill_null(pc.cast(names, pa.string()), ""))
    return texts.combine_chunks() if isinstance(texts, pa.ChunkedArray) else texts


def name_hashes(names: pa.StringArray) -> NDArray[np.uint64]:
    """Return a hash of the last 256 bytes of each text, none of which is 0; shape (n_names,)."""
    _, offsets, content = names.buffers()
    edges = np.frombuffer(offsets, np.int32, len(names) + 1, 4 * names.offset)
    length = np.minimum(np.diff(edges), 256)
    start = edges[1:] - length
    # Words of 8 bytes from any byte on
    padded = bytes(content or b"") + bytes(8)
    words = np.ndarray(len(padded) - 7, dtype="<u8", buffer=padded, strides=(1,))
    hashes = length.astype(np.uint64)
    for first in range(0, int(length.max(initial=0)), 8):
        rows = np.flatnonzero(length > first)
        # Bytes beyond the end of a text belong to the next one
        beyond = np.maximum(first + 8 - length[rows], 0).astype(np.uint64)
        word = words[start[rows] + first] << (np.uint64(8) * beyond)
        hashes[rows] = mixed(hashes[rows] + word)
    return hashes | np.uint64(1)


def mixed(hashes: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return hashes whose bits are mixed (finaliser of SplitMix64, Steele and others, 2014)."""
    mixed = (hashes ^ (hashes >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return mixed ^ (mixed >> np.uint64(31))


def regrouped(blocks: Iterable[RawRows], size: int) -> Iterator[RawRows]:
    """Yield the same rows in blocks of so many, each with the broken lines before its end."""
    pending: list[RawRows] = []
    for block in blocks:
        pending.append(block)
        if sum(len(rows.lines) for rows in pending) < size:
            continue
        # Enough rows for a block or several; the rest waits
        whole, first = together(pending), 0
        while len(whole.lines) - first >= size:
            yield _part(whole, first, first + size)
            first += size
        pending = [_part(whole, first, None)]
    if any(len(rows.lines) or rows.broken for rows in pending):
        yield together(pending)


def together(blocks: Sequence[RawRows]) -> RawRows:
    """Return consecutive blocks as a single one."""
    table = pa.concat_tables([rows.table for rows in blocks], promote_options="permissive")
    lines = np.concatenate([rows.lines for rows in blocks])
    broken = tuple(line for rows in blocks for line in rows.broken)
    return RawRows(blocks[0].source, table, lines, broken)


def _part(rows: RawRows, first: int, end: int | None) -> RawRows:
    """Return rows from the first to before the end, with the broken lines between them."""
    # A broken line goes with the row after it
    last_before = rows.lines[first - 1] if first else 0
    last = np.inf if end is None else rows.lines[end - 1]
    broken = tuple(line for line in rows.broken if last_before < (line.row or 0) < last)
    table = rows.table.slice(first, None if end is None else end - first)
    return rows._replace(table=table, lines=rows.lines[first:end], broken=broken)
