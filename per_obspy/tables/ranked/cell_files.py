"""
File of one cell of a ranked table, merged from arranged parts by rank.

Ranks are read first, some millions at a time; they are the order in which the files
have the next row. Of each file one batch of rows is in memory.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import count
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from per_obspy.files import temporary_folder, written_whole
from per_obspy.tables.parts import WaitingRows, next_rows, text_columns
from per_obspy.tables.ranked.arranged_parts import (
    BATCH,
    CellRows,
    arranged_rows,
    arranged_writer,
    ranks_file,
)
from per_obspy.tables.ranked.ranked_table import ROWS

#: Files that are read side by side, 1.2 MB of each; more of them are merged to longer ones first.
MOST_FILES = 512

#: Ranks that are in memory together, 8 bytes each and 40 while they are ordered.
TOGETHER = 2_000_000

#: Ranks in rising order, and the number of the file of each, (2, n).
Order = NDArray[np.int64]


class CellCounts(NamedTuple):
    """
    Numbers of the pairs of one cell.

    Attributes
    ----------
    states, stations : Counter
        Number of pairs in each state, and for which the record of each station is used.
    """

    states: Counter[str]
    stations: Counter[str]


def write_cell(rows: Sequence[CellRows], schema: pa.Schema, path: Path, room: Path) -> CellCounts:
    """
    Write the file of a cell, the worst pair first.

    Memory holds two million ranks, and a batch of rows of at most ``MOST_FILES`` files.

    Parameters
    ----------
    rows : sequence of CellRows
        Its rows in all arranged parts.
    schema : Schema
        Of the file, with ``rank``.
    path : Path
        The file.
    room : Path
        Folder for temporary files.
    """
    counts = CellCounts(Counter(), Counter())
    dictionaries = text_columns(schema)
    with (
        temporary_folder(room) as merged,
        written_whole(path) as part,
        pq.ParquetWriter(part, schema, use_dictionary=dictionaries) as writer,
    ):
        # Pieces of a constant number of rows, so that the file has the same bytes every time
        kept = _unranked(schema)
        for ranks, some in _by_rank(_fewer(rows, kept, merged), kept, ROWS):
            piece = pa.table([pa.array(ranks), *some.columns], schema=schema)
            writer.write_table(piece)
            count_values(piece["state"], counts.states)
            count_values(piece["station"], counts.stations)
    return counts


def count_values(column: pa.ChunkedArray, counter: Counter[str]) -> None:
    """Add the number of each value of a column to a counter."""
    for value, number in zip(*column.value_counts().flatten(), strict=True):
        counter[value.as_py()] += number.as_py()


def _unranked(schema: pa.Schema) -> pa.Schema:
    """Return the schema of the arranged parts of a ranked table."""
    return schema.remove(schema.get_field_index("rank")).remove_metadata()


def _fewer(rows: Sequence[CellRows], schema: pa.Schema, room: Path) -> Sequence[CellRows]:
    """Merge the rows of many files to those of few files in a temporary folder."""
    # A file of the disk for every group, until they are few
    for level in count():
        if len(rows) <= MOST_FILES:
            break
        groups = [rows[first : first + MOST_FILES] for first in range(0, len(rows), MOST_FILES)]
        files = [room / f"{level}-{i}.arrow" for i in range(len(groups))]
        rows = [_merged(some, schema, file) for some, file in zip(groups, files, strict=True)]
    return rows


def _merged(rows: Sequence[CellRows], schema: pa.Schema, path: Path) -> CellRows:
    """Merge rows to one arranged file."""
    # All batches but the last are full, as a piece is a whole number of them
    size = BATCH * (ROWS // BATCH or 1)
    with arranged_writer(path, schema) as writer, ranks_file(path).open("wb") as file:
        for ranks, piece in _by_rank(rows, schema, size):
            writer.write_table(piece.combine_chunks(), BATCH)
            file.write(ranks.astype("<i8").tobytes())
    return CellRows(path, 0, sum(one.rows for one in rows), 0)


def _by_rank(
    rows: Sequence[CellRows], schema: pa.Schema, size: int
) -> Iterator[tuple[NDArray[np.int64], pa.Table]]:
    """Yield ranks and rows of several files in the order of their ranks, so many at a time."""
    waiting = {i: WaitingRows(arranged_rows(one), schema) for i, one in enumerate(rows)}
    for ranks, numbers in _pieces(_order(rows), size):
        yield ranks, next_rows(waiting, numbers)


def _pieces(orders: Iterator[Order], size: int) -> Iterator[Order]:
    """Yield an order that comes in pieces of any size, so many at a time."""
    left = np.empty((2, 0), np.int64)
    for order in orders:
        left = np.concatenate([left, order], axis=1)
        while left.shape[1] >= size:
            yield left[:, :size]
            left = left[:, size:]
    if left.size:
        yield left


def _order(rows: Sequence[CellRows]) -> Iterator[Order]:
    """Yield the ranks of rows of several files, and the number of the file of each."""
    taken = [0] * len(rows)
    # As no rank is twice, so many ranks belong to at most so many rows
    ends = [_ranks_of(one)[[0, -1]] for one in rows]
    first, last = (int(end) for end in (np.min(ends), np.max(ends)))
    for limit in range(first + TOGETHER, last + TOGETHER + 1, TOGETHER):
        found = list[NDArray[np.int64]]()
        # The next ranks of every file
        for number, one in enumerate(rows):
            left = _ranks_of(one)[taken[number] :]
            some = np.array(left[: np.searchsorted(left, limit)], np.int64)
            taken[number] += some.size
            found.append(np.stack([some, np.full(some.size, number)]))
        order = np.concatenate(found, axis=1)
        yield order[:, np.argsort(order[0])]


def _ranks_of(rows: CellRows) -> NDArray[np.int64]:
    """Return the ranks of rows, which stay on the disk until they are used."""
    before = 8 * rows.first
    return np.memmap(ranks_file(rows.file), "<i8", "r", before, (rows.rows,))
