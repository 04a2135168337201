"""
Ranked table of pairs on disk: its files, and its rows piece by piece.

``risk.parquet`` holds all rows, the worst first. A dataset ``risk/`` holds one Parquet file per
cell, each with its worst row first.

The column ``rank``, from 1, counts through all files; in every file it rises.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.errors import CatalogError
from per_obspy.files import is_part, remove_file

if TYPE_CHECKING:
    import pandas as pd


def table_files(folder: Path, name: str = "risk") -> list[Path]:
    """
    Return the files of a ranked table in a folder of results.

    Returns
    -------
    files : list of Path
        One file, or one per cell in the order of their names; empty without a table.
    """
    single = folder / f"{name}.parquet"
    if single.is_file():
        return [single]
    return sorted(path for path in (folder / name).glob("*.parquet") if not is_part(path))


def table_outputs(outputs: Mapping[str, str], name: str = "risk") -> dict[str, str]:
    """
    Return the outputs of a run that are files of its ranked table, with their hashes.

    Examples
    --------
    >>> table_outputs({"risk.parquet": "a", "risk.csv": "b"})
    {'risk.parquet': 'a'}
    >>> table_outputs({"risk/lat35_lon139.parquet": "c", "rows.parquet": "d"})
    {'risk/lat35_lon139.parquet': 'c'}
    """
    places = (f"{name}.parquet", name)
    return {file: digest for file, digest in outputs.items() if PurePath(file).parts[0] in places}


def table_name(folder: Path, name: str = "risk") -> str:
    """Return the name of a ranked table in a folder of results: a file, or a folder of cells."""
    return f"{name}/" if (folder / name).is_dir() else f"{name}.parquet"


def listed_outputs(outputs: Iterable[str], name: str = "risk") -> list[str]:
    """
    Return the names of outputs in their order, with all cells of a dataset as one.

    Examples
    --------
    >>> listed_outputs(["run.json", "risk/lat35_lon139.parquet", "risk/no_place.parquet"])
    ['risk/ (2 cells)', 'run.json']
    """
    names = sorted(outputs)
    others = [file for file in names if PurePath(file).parts[0] != name]
    cells = len(names) - len(others)
    return sorted([*others, f"{name}/ ({cells} cells)"]) if cells else others


def remove_table(folder: Path, name: str = "risk") -> None:
    """Remove the files of a ranked table; other files in the folder of its cells stay."""
    for path in (folder / f"{name}.parquet", *(folder / name).glob("*.parquet")):
        remove_file(path)
    with suppress(OSError):
        (folder / name).rmdir()


#: Rows that are read and written together.
ROWS = 50_000


class RankedTable:
    """
    Ranked table that is open for reading, see :func:`ranked_table`.

    Parameters
    ----------
    files : sequence of Path
        From :func:`~per_obspy.results.ranked_table.table_files`, at least one.
    columns : sequence of str or None
        Columns of the pieces; None: all.
    only : ParquetFile or None
        The open file of a table that has one file only.
    """

    def __init__(
        self, files: Sequence[Path], columns: Sequence[str] | None, only: pq.ParquetFile | None
    ) -> None:
        self._files, self._columns, self._only = files, columns, only
        # All files have the columns of the first
        with self._opened(files[0]) as file:
            self.schema: pa.Schema = file.schema_arrow
        self.pairs = 0
        for path in files:
            with self._opened(path) as file:
                self.pairs += file.metadata.num_rows

    def _opened(self, path: Path) -> "pq.ParquetFile | nullcontext[pq.ParquetFile]":
        """Return the context of an open file."""
        return nullcontext(self._only) if self._only else _opened(path)

    def pieces(self) -> "Iterator[pd.DataFrame]":
        """Yield the rows in pieces, cell by cell; columns that the table lacks are left out."""
        columns = None if self._columns is None else list(self._columns)
        for path in self._files:
            with self._opened(path) as file:
                for batch in file.iter_batches(ROWS, columns=columns, use_threads=False):
                    yield batch.to_pandas()

    def batches(self, size: int, columns: Sequence[str]) -> Iterator[pa.RecordBatch]:
        """Yield some columns of all rows, so many at a time, cell by cell."""
        known = [name for name in columns if name in self.schema.names]
        for path in self._files:
            with self._opened(path) as file:
                yield from file.iter_batches(size, columns=known, use_threads=False)

    def ranked(self, count: int, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
        """Yield the worst rows in the order of their ranks, ``ROWS`` at a time."""
        known = self.schema.names
        names = [name for name in dict.fromkeys(columns or known) if name in known]
        count = min(count, self.pairs)
        for first in range(1, count + 1, ROWS):
            yield self._between(first, min(first + ROWS - 1, count), names)

    def first(self, count: int, columns: Sequence[str]) -> "pd.DataFrame":
        """Return the worst rows with the named columns that the table has."""
        names = [name for name in dict.fromkeys(columns) if name in self.schema.names]
        empty = self.schema.remove_metadata().empty_table().select(names)
        found: pd.DataFrame = pa.concat_tables([empty, *self.ranked(count, names)]).to_pandas()
        return found

    def row(self, rank: int) -> "pd.Series":
        """Return the row of a rank, with all columns."""
        found = self._between(rank, rank, self.schema.names)
        if not found.num_rows:
            raise IndexError(f"the table has no row of rank {rank}")
        row: pd.Series = found.to_pandas().iloc[0]
        return row

    def _between(self, first: int, last: int, names: Sequence[str]) -> pa.Table:
        """Return the rows from one rank to another, in their order."""
        read, found = list(dict.fromkeys(["rank", *names])), list[pa.Table]()
        for path in self._files:
            with self._opened(path) as file:
                found += _rows_between(file, (first, last), read)
        # An empty table has the columns if no file has such a row
        rows = found or [self.schema.remove_metadata().empty_table()]
        # By pyarrow alone: a finished run is shown without waiting for other libraries
        return pa.concat_tables(rows).sort_by("rank").select(list(names))


def _opened(path: Path) -> pq.ParquetFile:
    """Open a file; buffers that are read ahead would stay in memory until its end."""
    return pq.ParquetFile(path.absolute(), pre_buffer=False)


def _rows_between(
    file: pq.ParquetFile, ranks: tuple[int, int], names: list[str]
) -> Iterator[pa.Table]:
    """Yield the rows of a file between two ranks; only groups that may have some are read."""
    column = file.schema_arrow.names.index("rank")
    for group in range(file.num_row_groups):
        known = file.metadata.row_group(group).column(column).statistics
        if known is not None and (known.max < ranks[0] or known.min > ranks[1]):
            continue
        rows = file.read_row_group(group, columns=names, use_threads=False)
        # Ranks rise in every file; other ways from Arrow to NumPy wait for pandas
        rank = np.concatenate([np.from_dlpack(chunk) for chunk in rows["rank"].chunks])
        before, after = np.searchsorted(rank, ranks[0]), np.searchsorted(rank, ranks[1], "right")
        yield rows.select(names).slice(before, after - before).replace_schema_metadata()


@contextmanager
def ranked_table(
    files: Sequence[Path], columns: Sequence[str] | None = None
) -> Iterator[RankedTable]:
    """
    Open a ranked table.

    Parameters
    ----------
    files : sequence of Path
        From :func:`~per_obspy.results.ranked_table.table_files`.
    columns : sequence of str, optional
        Columns of the pieces, all if not given; those that the table lacks are left out.

    Raises
    ------
    CatalogError
        If there is no file.
    """
    if not files:
        raise CatalogError("risk", "the ranked table has no file: run again")
    with _opened(files[0]) if len(files) == 1 else nullcontext() as only:
        yield RankedTable(files, columns, only)
