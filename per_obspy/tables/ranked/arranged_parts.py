"""
Parts of the risk table with their ranks, arranged by cell.

Only the columns of the order are sorted as a whole (:mod:`per_obspy.tables.parts`), and every part
is then arranged for itself. Arranged parts are Arrow files, of which any rows are read without the
others.
"""

from collections.abc import Iterator, Sequence
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


class CellRows(NamedTuple):
    """
    Rows of one cell in an arranged file, one after the other, of rising rank.

    Attributes
    ----------
    file : Path
        The arranged file.
    first, rows : int
        Number of rows before them, and of these rows.
    """

    file: Path
    first: int
    rows: int


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
    rows = rows.add_column(0, "rank", pa.array(np.fromfile(ranks, dtype="<i8")))
    names = _cells_of(rows, size)
    # Within a cell rows stay in the order of their ranks
    order = np.argsort(names, kind="stable")
    arranged = rows.take(order)
    with (
        written_whole(path) as file,
        pa.OSFile(str(file), "wb") as sink,
        pa.ipc.new_file(sink, arranged.schema) as writer,
    ):
        writer.write_table(arranged)
    cells, first, counts = np.unique(names[order], return_index=True, return_counts=True)
    found = zip(cells.tolist(), first.tolist(), counts.tolist(), strict=True)
    return {cell: CellRows(path, before, count) for cell, before, count in found}


def _cells_of(rows: pa.Table, size: float) -> NDArray[np.object_]:
    """Return the cell of each row; a table without coordinates has one cell."""
    longitude, latitude = (_numbers(rows, name) for name in ("longitude", "latitude"))
    return cell_names(longitude, latitude, size)


def _numbers(rows: pa.Table, name: str) -> NDArray[np.float64]:
    """Return a column of numbers, NaN where it is empty or missing."""
    if name not in rows.column_names:
        return np.full(rows.num_rows, np.nan)
    return np.asarray(rows[name].to_numpy(), dtype=np.float64)
