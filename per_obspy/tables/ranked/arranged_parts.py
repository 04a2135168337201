"""
Parts of the risk table with their ranks, arranged by cell.

Only the columns of the order are sorted as a whole (:mod:`per_obspy.tables.parts`), and every part
is then arranged for itself. Arranged parts are compressed Arrow files, of which any batch of rows
is read without the others. The ranks of the rows are in a file next to it, so that the order of
all rows is known before any of them is read.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from per_obspy.files import written_whole
from per_obspy.tables.parts import part_number, part_rows, parts_in_order
from per_obspy.tables.ranked.cell_names import cell_names

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
        From :func:`~per_obspy.tables.parts.write_part`.
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
        Of all parts, see :func:`~per_obspy.tables.parts.joined_schema`.
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
