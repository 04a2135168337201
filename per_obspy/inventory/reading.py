"""Read a table of building pairs, CSV or Parquet, into accepted rows and reasons for the others."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import NDArray

from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.checking import Rejections, checked_pairs
from per_obspy.inventory.schema import COLUMNS

#: A table as read, the line of each of its rows, and lines that are no rows with their reasons.
RawTable = tuple[pd.DataFrame, NDArray[np.int64], tuple[Rejection, ...]]


def read_pairs(path: str | Path) -> pd.DataFrame:
    """
    Read and check a table of building pairs.

    Parameters
    ----------
    path : str or Path
        ``.csv`` (UTF-8, comma separated, one header line) or ``.parquet``. Columns, units and allowed ranges stand in
        ``per_obspy.inventory.schema.COLUMNS``; further columns are carried through.

    Returns
    -------
    pairs : DataFrame
        Accepted rows in file order: numbers as float64 in SI (NaN where empty), text as str ("" where empty).
        ``pairs.attrs["rejected"]`` is a tuple of :class:`~per_obspy.errors.Rejection`, one for each other row, with
        every reason.

    Raises
    ------
    CatalogError
        If the file cannot be read, is of an unknown kind, is not UTF-8, is empty or lacks a required column.
    """
    file = Path(path)
    if file.suffix.lower() not in _READERS:
        raise CatalogError(str(file), f"unknown suffix {file.suffix!r}, expected {' or '.join(_READERS)}")
    if not file.is_file():
        raise CatalogError(str(file), "no such file")
    table, lines, broken = _READERS[file.suffix.lower()](file)
    pairs = checked_pairs(table, str(file), lines)
    rejected = (*pairs.attrs["rejected"], *broken)
    pairs.attrs["rejected"] = Rejections(sorted(rejected, key=lambda rejection: rejection.row or 0))
    return pairs


def _read_csv(file: Path) -> RawTable:
    broken: list[Rejection] = []

    def skip(row: pa.csv.InvalidRow) -> str:
        reason = f"{row.actual_columns} columns, the header has {row.expected_columns}"
        broken.append(Rejection("pair", row.text.split(",")[0], str(file), row.number, (reason,)))
        return "skip"

    read = _arrow_csv(file, skip)
    data = {name.strip(): _numbers_if_all(read[name]) if _is_number(name) else read[name] for name in read.column_names}
    table = pa.table(data).to_pandas()
    lines = np.setdiff1d(np.arange(2, len(table) + len(broken) + 2), [rejection.row for rejection in broken])
    blank = np.asarray((table.isna() | (table == "")).all(axis=1))
    return table[~blank], lines[~blank], tuple(broken)


def _arrow_csv(file: Path, skip: Callable[[pa.csv.InvalidRow], str]) -> pa.Table:
    """Return a table whose known columns are text, so that each bad value can be named."""
    try:
        table = pa.csv.read_csv(
            file,
            read_options=pa.csv.ReadOptions(use_threads=False),  # with threads, rows have no numbers
            parse_options=pa.csv.ParseOptions(ignore_empty_lines=False, invalid_row_handler=skip),
            convert_options=pa.csv.ConvertOptions(column_types=dict.fromkeys(COLUMNS, pa.string())),
        )
        names = [name.strip() for name in table.column_names]
    except (pa.ArrowInvalid, UnicodeDecodeError) as error:
        raise CatalogError(str(file), _undecodable(file) or f"not a CSV table: {error}") from error
    if any(pa.types.is_binary(column.type) for column in table.columns):
        raise CatalogError(str(file), _undecodable(file) or "a column holds binary data")
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise CatalogError(str(file), f"column {twice} stands more than once")
    return table


def _undecodable(file: Path) -> str | None:
    """Return where the file is not UTF-8, or None."""
    with file.open("rb") as text:
        for number, line in enumerate(text, start=1):
            try:
                line.decode("utf-8")
            except UnicodeDecodeError as error:
                return f"line {number} is not UTF-8 (byte 0x{line[error.start]:02x} at position {error.start + 1})"
    return None


def _is_number(name: str) -> bool:
    column = COLUMNS.get(name.strip())
    return column is not None and column.dtype == "float64"


def _numbers_if_all(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """Return text as numbers if every cell is one or is empty; otherwise the text, whose faults are named later."""
    text = pc.utf8_trim_whitespace(pc.cast(column, pa.string()))
    try:
        return pc.cast(pc.if_else(pc.equal(text, ""), None, text), pa.float64())
    except pa.ArrowInvalid:
        return text


def _read_parquet(file: Path) -> RawTable:
    try:
        table = pa.parquet.read_table(file).to_pandas()
    except pa.ArrowInvalid as error:
        raise CatalogError(str(file), f"not a Parquet table: {error}") from error
    return table, np.arange(2, len(table) + 2), ()


_READERS = {".csv": _read_csv, ".parquet": _read_parquet}
