"""
Ranked table of very many pairs as one file per cell of the earth, merged from arranged parts.

Only the columns of the order are sorted as a whole (:mod:`per_obspy.results.parts`), and every part
is then arranged for itself. Arranged parts are compressed Arrow files, of which any batch of rows
is read without the others. The ranks of the rows are in a file next to it, so that the order of
all rows is known before any of them is read.

When a cell is merged, ranks are read first, some millions at a time; they are the order in which
the files have the next row. Of each file one batch of rows is in memory.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.files import temporary_folder, written_whole
from per_obspy.results.parts import (
    WaitingRows,
    next_rows,
    part_number,
    part_rows,
    parts_in_order,
    text_columns,
)
from per_obspy.results.ranked_table import ROWS

#: Name of the cell of all pairs without coordinates.
NO_PLACE = "no_place"


def cell_names(longitude: FloatArray, latitude: FloatArray, size: float) -> NDArray[np.object_]:
    """
    Return the name of the cell of each place, by its corner of least latitude and longitude.

    Names consist of numbers only, so that no text of a pair table becomes part of a path.

    Parameters
    ----------
    longitude, latitude : (n_places,) ndarray
        Degrees east and north; NaN if unknown.
    size : float
        Width and height of a cell, degrees, at least 0.1.

    Examples
    --------
    >>> cell_names(np.array([139.7, -70.2, np.nan]), np.array([35.6, -33.4, 0.0]), 1.0).tolist()
    ['lat35_lon139', 'lat-34_lon-71', 'no_place']
    """
    places = np.floor(np.stack([latitude, longitude]) / size)
    known = np.isfinite(places).all(axis=0)
    cells, number = np.unique(places[:, known], axis=1, return_inverse=True)
    # Zero has no sign; six digits keep corners apart that differ by 0.1
    corners = (cells * size + 0.0).T.tolist()
    corner_names = [f"lat{north:.6g}_lon{east:.6g}" for north, east in corners]
    names = np.full(known.size, NO_PLACE, dtype=object)
    names[known] = np.array(corner_names, dtype=object)[number.ravel()]
    return names


#: Ranks that are collected before they are appended to the files of their parts.
TOGETHER = 4_000_000

#: Rows of a cell that are compressed and read together: of each of many files one such batch is in
#: memory, 1.2 MB. Half as many rows take a twentieth more of the disk and 0.3 us more per row.
BATCH = 1000


class CellRows(NamedTuple):
    """
    Rows of one cell in an arranged file, one after the other, of rising rank.

    Attributes
    ----------
    file : Path
        The arranged file.
    first, rows : int
        Number of rows before them, and of these rows.
    batch : int
        Number of batches before them.
    """

    file: Path
    first: int
    rows: int
    batch: int


def write_ranks(parts: Sequence[Path], folder: Path) -> list[Path]:
    """
    Write the ranks of all rows of every part, from 1 through all parts.

    Parameters
    ----------
    parts : sequence of Path
        From :func:`~per_obspy.results.parts.write_part`.
    folder : Path
        Folder of the files, which is there.

    Returns
    -------
    files : list of Path
        For each part its ranks in the order of its rows, as integers of 8 bytes.
    """
    files = {part_number(part): folder / f"{place}.ranks" for place, part in enumerate(parts)}
    before = 0
    for order in _together(parts_in_order(parts, TOGETHER)):
        # Rows of a part, one after the other
        place = np.argsort(order, kind="stable")
        numbers, first = np.unique(order[place], return_index=True)
        for number, rows in zip(numbers.tolist(), np.split(place, first[1:]), strict=True):
            with files[number].open("ab") as file:
                file.write((rows + (before + 1)).astype("<i8").tobytes())
        before += order.size
    return list(files.values())


def _together(pieces: Iterator[NDArray[np.int64]]) -> Iterator[NDArray[np.int64]]:
    """Yield short pieces together, so that few files are opened often."""
    waiting, rows = list[NDArray[np.int64]](), 0
    for piece in pieces:
        waiting.append(piece)
        rows += piece.size
        if rows >= TOGETHER:
            yield np.concatenate(waiting)
            waiting, rows = [], 0
    if waiting:
        yield np.concatenate(waiting)


def write_arranged(
    part: Path, ranks: Path, schema: pa.Schema, size: float, path: Path
) -> dict[str, CellRows]:
    """
    Write the rows of a part with their ranks, cell by cell.

    Parameters
    ----------
    part, ranks : Path
        The part, and its file of :func:`write_ranks`.
    schema : Schema
        Of all parts, see :func:`~per_obspy.results.parts.joined_schema`.
    size : float
        Width and height of a cell, degrees.
    path : Path
        The arranged file.

    Returns
    -------
    dict of str to CellRows
        Rows of every cell of the part.
    """
    # The whole part is in memory, as it was when its chunk was computed
    rows = pa.concat_tables(part_rows(part, schema)).combine_chunks()
    names = _cells_of(rows, size)
    # Within a cell rows stay in the order of their ranks
    order = np.argsort(names, kind="stable")
    with written_whole(ranks_file(path)) as file:
        np.fromfile(ranks, dtype="<i8")[order].tofile(file)
    arranged = rows.take(order)
    cells = np.unique(names[order], return_index=True, return_counts=True)
    found, batch = dict[str, CellRows](), 0
    with written_whole(path) as file, arranged_writer(file, schema) as writer:
        for cell, before, count in zip(*(facts.tolist() for facts in cells), strict=True):
            found[cell] = CellRows(path, before, count, batch)
            writer.write_table(arranged.slice(before, count), BATCH)
            batch += -(-count // BATCH)
    return found


def ranks_file(path: Path) -> Path:
    """Return the file of the ranks of all rows of an arranged file, integers of 8 bytes."""
    return path.with_suffix(".ranks")


@contextmanager
def arranged_writer(path: Path, schema: pa.Schema) -> Iterator[pa.RecordBatchFileWriter]:
    """Yield a writer of an arranged file."""
    # Half of the bytes for 1 us per row each way; zstd takes 3 us for a fifth less
    options = pa.ipc.IpcWriteOptions(compression="lz4", use_threads=False)
    with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_file(sink, schema, options=options) as file:
        yield file


def arranged_rows(rows: CellRows) -> Iterator[pa.Table]:
    """Yield rows of an arranged file, a batch at a time; the file is closed between reads."""
    # In threads the many small columns of a batch take ten times as long
    options = pa.ipc.IpcReadOptions(use_threads=False)
    for batch in range(rows.batch, rows.batch - (-rows.rows // BATCH)):
        with pa.OSFile(str(rows.file)) as source, pa.ipc.open_file(source, options=options) as file:
            table = pa.Table.from_batches([file.get_batch(batch)])
        yield table


def _cells_of(rows: pa.Table, size: float) -> NDArray[np.object_]:
    """Return the cell of each row; a table without coordinates has one cell."""
    longitude, latitude = (_numbers(rows, name) for name in ("longitude", "latitude"))
    return cell_names(longitude, latitude, size)


def _numbers(rows: pa.Table, name: str) -> NDArray[np.float64]:
    """Return a column of numbers, NaN where it is empty or missing."""
    if name not in rows.column_names:
        return np.full(rows.num_rows, np.nan)
    return np.asarray(rows[name].to_numpy(), dtype=np.float64)


#: Files that are read side by side, 1.2 MB of each; more of them are merged to longer ones first.
MOST_FILES = 512

#: Ranks that are in memory together, 8 bytes each and 40 while they are ordered.
RANKED_TOGETHER = 2_000_000

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
    for limit in range(first + RANKED_TOGETHER, last + RANKED_TOGETHER + 1, RANKED_TOGETHER):
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
