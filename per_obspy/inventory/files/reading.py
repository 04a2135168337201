"""Read tables of building pairs, CSV or Parquet, into accepted rows and reasons for the others: whole or in chunks."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.checking import Rejections, check_columns, checked_pairs
from per_obspy.inventory.files.formats import pair_file
from per_obspy.inventory.files.raw_rows import IDENTIFIER, RawRows, name_hashes

#: As many rows as any table has.
ALL = 1 << 40


class PairChunk(NamedTuple):
    """
    Consecutive rows of an inventory, not checked yet.

    Attributes
    ----------
    rows : RawRows
        As they stand in their file.
    repeated : (n_rows,) ndarray of bool
        Whether the row's ``pair_id`` stands in an earlier row of the inventory.
    """

    rows: RawRows
    repeated: NDArray[np.bool_]


def read_pairs(path: str | Path) -> pd.DataFrame:
    """
    Read and check a table of building pairs.

    Parameters
    ----------
    path : str or Path
        ``.csv`` (UTF-8, comma separated, one header line) or ``.parquet``. Columns, units and
        allowed ranges stand in ``per_obspy.inventory.schema.COLUMNS``; further columns are carried
        through.

    Returns
    -------
    pairs : DataFrame
        Accepted rows in file order: numbers as float64 in SI (NaN where empty), text as str (""
        where empty). ``pairs.attrs["rejected"]`` is a tuple of
        :class:`~per_obspy.errors.Rejection`, one for each other row, with every reason.

    Raises
    ------
    CatalogError
        If the file cannot be read, is of an unknown kind, is not UTF-8, is empty or lacks a
        required column.
    """
    file = pair_file(Path(path))
    check_columns(file.names, str(path))
    blocks = list(file.rows(ALL))
    if not any(len(block.table) or block.broken for block in blocks):
        raise CatalogError(str(path), "the table has no rows")
    rows = RawRows(
        str(path),
        pa.concat_tables(
            [block.table for block in blocks if len(block.table)] or [blocks[0].table]
        ),
        np.concatenate([block.lines for block in blocks]),
        tuple(one for block in blocks for one in block.broken),
    )
    return _checked(rows, None)


class PairInventory:
    """
    An inventory in one file or several, read in chunks, its files one after the other.

    Parameters
    ----------
    paths : sequence of Path
        CSV or Parquet. Apart from a chunk, memory holds 8 bytes a row, to know which names are
        repeated.

    Attributes
    ----------
    count : int
        Number of rows.
    names : set of str
        Columns that all files have.

    Raises
    ------
    CatalogError
        As :func:`read_pairs`.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self._files = {path: pair_file(path) for path in paths}
        for path, file in self._files.items():
            check_columns(file.names, str(path))
        self.names = set.intersection(*(set(file.names) for file in self._files.values()))
        counts = {
            path: [name_hashes(block) for block in file.identifiers()]
            for path, file in self._files.items()
        }
        for path, blocks in counts.items():
            if not sum(map(len, blocks)):
                raise CatalogError(str(path), "the table has no rows")
        hashes = np.concatenate([block for blocks in counts.values() for block in blocks])
        self.count = len(hashes)
        names, times = np.unique(hashes, return_counts=True)
        self._repeated: NDArray[np.uint64] = names[times > 1]

    def chunks(self, size: int) -> Iterator[PairChunk]:
        """Give so many rows at a time; no chunk holds rows of two files."""
        seen: set[str] = set()
        for file in self._files.values():
            for rows in file.rows(size):
                yield PairChunk(rows, _repeated(rows.table[IDENTIFIER], self._repeated, seen))


def _repeated(
    identifiers: pa.ChunkedArray, hashes: NDArray[np.uint64], seen: set[str]
) -> NDArray[np.bool_]:
    """Return which names were seen before; only names whose hash is repeated are remembered."""
    text = pc.utf8_trim_whitespace(pc.fill_null(identifiers.cast(pa.string()), "")).combine_chunks()
    repeated = np.isin(name_hashes(text), hashes)
    for row in np.flatnonzero(repeated).tolist():
        name = text[row].as_py()
        repeated[row] = name in seen
        seen.add(name)
    return repeated


def checked_chunk(chunk: PairChunk) -> pd.DataFrame:
    """Return the accepted rows of a chunk, as :func:`read_pairs` gives those of a table."""
    return _checked(chunk.rows, chunk.repeated)


def _checked(rows: RawRows, repeated: NDArray[np.bool_] | None) -> pd.DataFrame:
    # what pandas once said of the table counts for nothing: it would take a column of names for the
    # index
    table: pd.DataFrame = rows.table.replace_schema_metadata(None).to_pandas()
    pairs = checked_pairs(table, rows.source, rows.lines, repeated)
    rejected: tuple[Rejection, ...] = (*pairs.attrs["rejected"], *rows.broken)
    pairs.attrs["rejected"] = Rejections(sorted(rejected, key=lambda rejection: rejection.row or 0))
    return pairs
