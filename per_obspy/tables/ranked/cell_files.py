"""File of one cell of a ranked table, merged from arranged parts by rank."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import count
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.files import temporary_folder, written_whole
from per_obspy.tables.parts import MOST_PARTS, WaitingRows, next_rows, text_columns
from per_obspy.tables.ranked.arranged_parts import CellRows
from per_obspy.tables.ranked.ranked_table import ROWS


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

    Memory holds the ranks of the cell, 24 bytes per pair, and some thousands of its rows.

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
        for piece in _by_rank(_fewer(rows, merged), ROWS):
            writer.write_table(piece.cast(schema))
            count_values(piece["state"], counts.states)
            count_values(piece["station"], counts.stations)
    return counts


def count_values(column: pa.ChunkedArray, counter: Counter[str]) -> None:
    """Add the number of each value of a column to a counter."""
    for value, number in zip(*column.value_counts().flatten(), strict=True):
        counter[value.as_py()] += number.as_py()


def _fewer(rows: Sequence[CellRows], room: Path) -> Sequence[CellRows]:
    """Merge the rows of many files to those of few files in a temporary folder."""
    for level in count():
        if len(rows) <= MOST_PARTS:
            break
        groups = [rows[first : first + MOST_PARTS] for first in range(0, len(rows), MOST_PARTS)]
        rows = [_merged(some, room / f"{level}-{i}.arrow") for i, some in enumerate(groups)]
    return rows


def _merged(rows: Sequence[CellRows], path: Path) -> CellRows:
    """Merge rows to one file."""
    schema = _mapped(rows[0]).schema
    with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_file(sink, schema) as writer:
        for piece in _by_rank(rows, ROWS):
            writer.write_table(piece)
    return CellRows(path, 0, sum(one.rows for one in rows))


def _by_rank(rows: Sequence[CellRows], size: int) -> Iterator[pa.Table]:
    """Yield rows of several files in the order of their ranks, so many at a time."""
    tables = [_mapped(one) for one in rows]
    waiting = {i: WaitingRows(iter([table]), table.schema) for i, table in enumerate(tables)}
    # For each row the file in which it is the next one
    ranks = np.concatenate([table["rank"].to_numpy() for table in tables])
    number = np.repeat(np.arange(len(tables)), [table.num_rows for table in tables])
    order = number[np.argsort(ranks)]
    for first in range(0, order.size, size):
        yield next_rows(waiting, order[first : first + size])


def _mapped(rows: CellRows) -> pa.Table:
    """Return rows of a file, which stay on the disk until they are used."""
    with pa.memory_map(str(rows.file)) as source:
        table = pa.ipc.open_file(source).read_all()
    return table.slice(rows.first, rows.rows)
