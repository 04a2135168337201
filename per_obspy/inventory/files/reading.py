"""Readers of pair tables, whole or in chunks, with reasons for rejected rows."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from per_obspy.config import TableForm
from per_obspy.errors import CatalogError, Rejection, printable
from per_obspy.inventory.cells import read_columns
from per_obspy.inventory.checking import Rejections, check_columns, checked_pairs, row_names
from per_obspy.inventory.files.formats import PairFile, pair_file
from per_obspy.inventory.files.headings import IDENTIFIER
from per_obspy.inventory.files.raw_rows import RawRows, name_hashes, stripped
from per_obspy.inventory.schema import COLUMNS
from per_obspy.inventory.suspicions import ODD, Suspicions

#: More rows than any table has.
ALL = 1 << 40


class PairChunk(NamedTuple):
    """Consecutive rows of an inventory, not checked yet."""

    #: Before any check.
    rows: RawRows
    #: Whether an earlier row of the inventory has the row's ``pair_id``. Shape (n_rows,).
    repeated: NDArray[np.bool_]
    #: Names of each row's suspicions, see :mod:`per_obspy.inventory.suspicions`. Shape (n_rows,).
    odd: NDArray[np.object_]


def read_pairs(path: str | Path | pd.DataFrame, form: TableForm | None = None) -> pd.DataFrame:
    """
    Read and check a table of building pairs.

    Parameters
    ----------
    path : str, Path or DataFrame
        ``.csv``, ``.tsv``, ``.txt``, ``.parquet`` or a workbook; or a table in memory, whose rows
        count as following a header in line 1. Columns, units and allowed ranges are in
        ``per_obspy.inventory.schema.COLUMNS``; further columns are carried through. Text that is
        not plain (UTF-8, commas, the names of the schema) is recognised where it is unambiguous.
    form : TableForm, optional
        Form of the file, where it cannot be recognised: encoding, separator, decimal mark,
        sheet, names and units of columns.

    Returns
    -------
    pairs : DataFrame
        Accepted rows in file order: numbers as float64 in SI (NaN where empty), text as str (""
        where empty). ``pairs.attrs["rejected"]`` is a tuple of
        :class:`~per_obspy.errors.Rejection`, one for each other row, with every reason;
        ``pairs.attrs["recognised"]`` lists recognised peculiarities of the file, empty without any;
        ``pairs.attrs["suspicions"]`` has a sentence for each thing that is possible but odd, and
        the column ``odd_values``, which only tables with odd rows have, the names of each row's
        suspicions.

    Raises
    ------
    CatalogError
        If the file cannot be read, is of an unknown kind, can be read in two ways, is empty or
        lacks a required column.
    MissingExtra
        If it is a workbook and the library for workbooks is not installed.
    TypeError
        If the argument is neither a path nor a table.
    """
    # A table in memory is checked as it is
    if isinstance(path, pd.DataFrame):
        return _checked_table(path)
    if not isinstance(path, str | Path):
        raise TypeError(f"path must be a path or a DataFrame, got {type(path).__name__}")
    file = checked_file(Path(path), form)
    rows = next(file.rows(ALL), None)
    if rows is None or not (len(rows.table) or rows.broken):
        raise CatalogError(str(path), "the table has no rows")
    pairs = _checked_whole(_named(rows, ""))
    pairs.attrs["recognised"] = file.recognised
    return pairs


def checked_file(path: Path, form: TableForm | None = None) -> PairFile:
    """
    Open a file of pairs that has the columns it needs.

    Raises
    ------
    CatalogError
        If it cannot be read, or in two ways; or if it lacks a column, with the headings that may be
        meant.
    """
    file = pair_file(path, form)
    try:
        check_columns(file.names, str(path))
    except CatalogError as error:
        if "missing" not in error.problem:
            raise
        raise CatalogError(error.source, error.problem + file.meanings.asked()) from error
    file.check_cells()
    return file


def _checked_table(table: pd.DataFrame) -> pd.DataFrame:
    """Check a pair table that is in memory already."""
    if table.empty:
        raise CatalogError("table", "the table has no rows")
    check_columns([str(name) for name in table], "table")
    table = table.reset_index(drop=True)
    # As if it followed a header
    lines = np.arange(2, len(table) + 2)
    known = {name: table[name] for name in table if name in COLUMNS}
    # Values for the account; the checks read the cells themselves, with their notes
    numbers = {name: cells for name, cells in known.items() if COLUMNS[name].dtype != "str"}
    texts = {name: cells.astype(str).mask(cells.isna()) for name, cells in known.items()}
    cells = pd.DataFrame(
        texts | read_columns(numbers) | {IDENTIFIER: row_names(table.get(IDENTIFIER), lines)}
    )
    raw = RawRows("table", pa.Table.from_pandas(cells, preserve_index=False), lines, ())
    return _checked_whole(raw, table)


def _checked_whole(rows: RawRows, table: pd.DataFrame | None = None) -> pd.DataFrame:
    """Check all rows of a file, or of a table in memory, with suspicions and proposed units."""
    # The account comes first, as the checks leave rows out
    account = Suspicions()
    repeated = pd.Series(name_hashes(stripped(rows.table[IDENTIFIER]))).duplicated().to_numpy()
    odd = account.add(rows.source, rows.table, rows.lines, repeated)
    if table is None:
        pairs = _checked(rows, None, odd)
    else:
        pairs = checked_pairs(_with_odd(table, odd), rows.source)
    pairs.attrs |= {"suspicions": account.sentences(), "proposed_units": account.units()}
    return pairs


def _with_odd(table: pd.DataFrame, odd: NDArray[np.object_]) -> pd.DataFrame:
    """Return a table with the names of each row's suspicions, if there are any."""
    table = table.drop(columns=ODD, errors="ignore")
    return table.assign(**{ODD: odd}) if any(odd) else table


class PairInventory:
    """
    An inventory in one file or several, read in chunks, file after file.

    Parameters
    ----------
    paths : sequence of Path
        As :func:`read_pairs`. Besides a chunk, memory holds 8 bytes per row to find repeated
        identifiers, 16 per pair and, where buildings have identifiers, 16 per building.
    form : TableForm, optional
        Form of the files.

    Attributes
    ----------
    count : int
        Number of rows.
    rows : dict of Path to int
        Number of rows of each file.
    names : set of str
        Columns that all files have.
    suspicions : Suspicions
        Of the chunks that were read.

    Raises
    ------
    CatalogError
        As :func:`read_pairs`.
    """

    def __init__(self, paths: Sequence[Path], form: TableForm | None = None) -> None:
        self._files = {path: checked_file(path, form) for path in paths}
        self.suspicions = Suspicions()
        self.names = set.intersection(*(set(file.names) for file in self._files.values()))
        # Hashes that occur twice: candidates for repeated identifiers
        # Every file is read before any is refused
        hashes = {path: file.hashes for path, file in self._files.items()}
        self.rows = {path: len(names) for path, names in hashes.items()}
        for path, count in self.rows.items():
            if not count:
                raise CatalogError(str(path), "the table has no rows")
        self.count = sum(self.rows.values())
        distinct, times = np.unique(np.concatenate([*hashes.values()]), return_counts=True)
        self._repeated: NDArray[np.uint64] = distinct[times > 1]

    def chunks(self, size: int) -> Iterator[PairChunk]:
        """Yield chunks of so many rows; no chunk has rows of two files."""
        seen: set[str] = set()
        self.suspicions = Suspicions()
        stems = [path.stem for path in self._files]
        for path, file in self._files.items():
            # Rows without a name of several files are named by both
            prefix = path.stem if stems.count(path.stem) == 1 else str(path)
            for rows in file.rows(size):
                named = _named(rows, f"{prefix} " if len(stems) > 1 else "")
                repeated = _repeated(named.table, self._repeated, seen)
                odd = self.suspicions.add(named.source, named.table, named.lines, repeated)
                yield PairChunk(named, repeated, odd)

    def recognised(self) -> list[str]:
        """Return a sentence for each file that is not plain: how it is read."""
        sentences = {path: file.recognised for path, file in self._files.items()}
        return [recognised_line(path, text) for path, text in sentences.items() if text]


def _named(rows: RawRows, prefix: str) -> RawRows:
    """Return rows of which each has an identifier, the number of its row if it has no other."""
    table, is_named = rows.table, IDENTIFIER in rows.table.column_names
    if is_named and not prefix:
        return rows  # empty names are left to the checks
    names = row_names(table[IDENTIFIER].to_pandas() if is_named else None, rows.lines, prefix)
    others = table.drop_columns([IDENTIFIER]) if is_named else table
    return rows._replace(table=others.append_column(IDENTIFIER, pa.array(names, pa.string())))


def recognised_line(path: Path, recognised: str) -> str:
    """Return the line that describes how a table is read, with the name of its file."""
    return printable(f"{path.name}: read as {recognised}")


def _repeated(table: pa.Table, hashes: NDArray[np.uint64], seen: set[str]) -> NDArray[np.bool_]:
    """
    Return the rows whose identifier occurred before.

    Only identifiers whose hash is repeated are added to those seen.
    """
    text = stripped(table[IDENTIFIER])
    # A hash may be shared by chance: the identifiers themselves decide
    repeated = np.isin(name_hashes(text), hashes)
    for row in np.flatnonzero(repeated).tolist():
        name = text[row].as_py()
        # Rows without a name are named by their number
        repeated[row] = name in seen and name != ""
        seen.add(name)
    return repeated


def checked_chunk(chunk: PairChunk) -> pd.DataFrame:
    """Return the accepted rows of a chunk in the form of :func:`read_pairs`."""
    return _checked(chunk.rows, chunk.repeated, chunk.odd)


def _checked(
    rows: RawRows, repeated: NDArray[np.bool_] | None, odd: NDArray[np.object_]
) -> pd.DataFrame:
    """Check raw rows and add the broken lines to the rejected rows, in the order of the file."""
    pairs = checked_pairs(_with_odd(rows.table.to_pandas(), odd), rows.source, rows.lines, repeated)
    rejected: list[Rejection] = [*pairs.attrs["rejected"], *rows.broken]
    pairs.attrs["rejected"] = Rejections(sorted(rejected, key=lambda row: row.row or 0))
    return pairs
