"""
Ranked table of very many pairs as one file per cell of the earth, in place of one file.

The rows come in the order of their ranks, and each cell keeps its rows until they fill a group of
its Parquet file. All cells together keep a bounded number of rows: where they are full, the largest
cell is written. What is written depends on the rows alone, so that the files have the same bytes
every time.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.files import written_whole
from per_obspy.results.parts import text_columns
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


#: Rows that all cells together keep, about 1 kB each.
KEPT = 4 * ROWS

#: Cells whose files are open together: a process may open about 1 000 files.
OPEN = 500


def cells_of_parts(parts: Sequence[Path], size: float) -> list[list[str]]:
    """Return the names of the cells of all parts, sorted, in groups of files open together."""
    names = set[str]()
    for part in parts:
        # A table without coordinates has one cell
        known = pq.read_schema(part.absolute()).names
        columns = [name for name in ("longitude", "latitude") if name in known]
        names |= {*_cells_of(pq.read_table(part.absolute(), columns=columns), size)}
    cells = sorted(names)
    return [cells[first : first + OPEN] for first in range(0, len(cells), OPEN)]


class CellFiles:
    """
    Files of some cells, which take the rows of a ranked table as one file does.

    Parameters
    ----------
    files : mapping of str to ParquetWriter
        Cell -> its open file; rows of other cells are passed over.
    size : float
        Width and height of a cell, degrees.
    """

    def __init__(self, files: Mapping[str, pq.ParquetWriter], size: float) -> None:
        self._files, self._size = files, size
        self._kept = {cell: list[pa.Table]() for cell in files}
        self._rows = dict.fromkeys(files, 0)

    def write_table(self, rows: pa.Table) -> None:
        """Take the next rows, of higher ranks than those before."""
        names = _cells_of(rows, self._size)
        for cell in self._files.keys() & {*names}:
            # Copies, as a slice would keep all rows of its table in memory
            self._kept[cell].append(rows.take(np.flatnonzero(names == cell)))
            self._rows[cell] += self._kept[cell][-1].num_rows
            if self._rows[cell] >= ROWS:
                self.write_kept(cell)
        while sum(self._rows.values()) > KEPT:
            self.write_kept(max(self._rows, key=lambda cell: (self._rows[cell], cell)))

    def write_kept(self, cell: str) -> None:
        """Write the rows that a cell keeps."""
        if self._rows[cell]:
            self._files[cell].write_table(pa.concat_tables(self._kept[cell]))
        self._kept[cell], self._rows[cell] = [], 0


@contextmanager
def cell_files(
    folder: Path, schema: pa.Schema, cells: Sequence[str], size: float
) -> Iterator[CellFiles]:
    """Yield the open files of some cells in a folder, of which each is written whole."""
    with ExitStack() as stack:
        parts = {
            cell: stack.enter_context(written_whole(folder / f"{cell}.parquet")) for cell in cells
        }
        writers = {
            cell: stack.enter_context(ranked_writer(part, schema)) for cell, part in parts.items()
        }
        files = CellFiles(writers, size)
        yield files
        for cell in cells:
            files.write_kept(cell)


def ranked_writer(path: Path, schema: pa.Schema) -> pq.ParquetWriter:
    """Return a Parquet file of a ranked table that is open for writing."""
    return pq.ParquetWriter(path, schema, use_dictionary=text_columns(schema))


def _cells_of(rows: pa.Table, size: float) -> NDArray[np.object_]:
    """Return the cell of each row; a table without coordinates has one cell."""
    longitude, latitude = (_numbers(rows, name) for name in ("longitude", "latitude"))
    return cell_names(longitude, latitude, size)


def _numbers(rows: pa.Table, name: str) -> NDArray[np.float64]:
    """Return a column of numbers, NaN where it is empty or missing."""
    if name not in rows.column_names:
        return np.full(rows.num_rows, np.nan)
    return np.asarray(rows[name].to_numpy(), dtype=np.float64)
