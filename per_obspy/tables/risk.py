"""Risk table on disk: parts of an inventory joined, worst first, in bounded memory."""

import json
import shutil
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import duckdb
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.files import written_whole
from per_obspy.inventory.files.text_cells import arrow_cells, header
from per_obspy.tables.parts import bounded_database, joined_rows, joined_schema, text_columns
from per_obspy.tables.rounding import rounded_arrow
from per_obspy.tables.table_files import write_columns

#: Rows that are read and written together.
ROWS = 50_000


class RiskFiles(NamedTuple):
    """
    Files of a risk table.

    Attributes
    ----------
    files : list of Path
        ``risk.parquet``, ``risk.csv`` and ``risk.columns.csv``.
    states : Counter
        Number of pairs in each state.
    stations : Counter
        Number of pairs for which the record of each station is used.
    """

    files: list[Path]
    states: Counter[str]
    stations: Counter[str]


class RankedTable(NamedTuple):
    """
    Risk table open for one pass, worst pair first.

    Attributes
    ----------
    file : ParquetFile
        The open file.
    columns : list of str or None
        Columns that are read; None: all.
    """

    file: pq.ParquetFile
    columns: list[str] | None

    @property
    def pairs(self) -> int:
        """Return the number of pairs."""
        return int(self.file.metadata.num_rows)

    def pieces(self) -> Iterator[pd.DataFrame]:
        """Yield the rows in pieces; columns that the table lacks are left out."""
        for batch in self.file.iter_batches(ROWS, columns=self.columns):
            yield batch.to_pandas()

    def first(self, count: int, columns: Sequence[str]) -> pd.DataFrame:
        """Return the first rows with the named columns that the table has."""
        known = set(self.file.schema_arrow.names)
        names = [name for name in dict.fromkeys(columns) if name in known]
        empty = self.file.schema_arrow.empty_table().select(names)
        batch = next(self.file.iter_batches(count, columns=names), empty)
        found: pd.DataFrame = batch.to_pandas()
        return found

    def row(self, index: int) -> pd.Series:
        """Return one row, counted from 0, with all columns."""
        for group in range(self.file.num_row_groups):
            count = self.file.metadata.row_group(group).num_rows
            if index < count:
                rows = self.file.read_row_group(group).slice(index, 1)
                row: pd.Series = rows.to_pandas().iloc[0]
                return row
            index -= count
        raise IndexError(f"the table has no row {index} more")


def write_risk(
    parts: Sequence[Path], folder: Path, facts: Mapping[str, str], csv_rows: int
) -> RiskFiles:
    """
    Write ``risk.parquet``, ``risk.csv`` and ``risk.columns.csv``, in one pass over the parts.

    Parameters
    ----------
    parts : sequence of Path
        From :func:`~per_obspy.tables.parts.write_part`, at least one.
    folder : Path
        Folder of the files.
    facts : mapping of str to str
        Facts of the whole table that the Parquet file states, for example whether the motion is
        simulated.
    csv_rows : int
        Number of rows of ``risk.csv``, the worst ones.
    """
    names = ("risk.parquet", "risk.csv", "risk.columns.csv")
    table, text, columns = files = [folder / name for name in names]
    # Schema of the whole, with the rank before the other columns
    schema = joined_schema(parts)
    statement = json.dumps({"version": version("per_obspy"), **facts})
    whole = pa.schema([("rank", pa.int64()), *schema], metadata={"per_obspy": statement})
    with written_whole(table) as part, written_whole(text) as lines:
        states, stations = _write_rows(_ranked_rows(parts, schema, whole), part, lines, csv_rows)
    write_columns(whole.names, columns)
    return RiskFiles(files, states, stations)


def _write_rows(
    rows: Iterator[pa.Table], table: Path, text: Path, csv_rows: int
) -> tuple[Counter[str], Counter[str]]:
    """Write ranked rows as Parquet, the worst as CSV too; count their states and stations."""
    states, stations, first = Counter[str](), Counter[str](), next(rows)
    dictionaries = text_columns(first.schema)
    text.write_text(header(first.column_names), encoding="utf-8")
    with (
        bounded_database(table.parent) as database,
        pq.ParquetWriter(table, first.schema, use_dictionary=dictionaries) as writer,
    ):
        for piece in chain([first], rows):
            writer.write_table(piece)
            _count(piece["state"], states)
            _count(piece["station"], stations)
            # Rows whose rank is at most the number of rows of the text
            before = piece["rank"][0].as_py() - 1
            if before < csv_rows:
                _append_csv(database, rounded_arrow(piece.slice(0, csv_rows - before)), text)
    return states, stations


def _count(column: pa.ChunkedArray, counter: Counter[str]) -> None:
    """Count the values of a column."""
    for value, count in zip(*column.value_counts().flatten(), strict=True):
        counter[value.as_py()] += count.as_py()


def _ranked_rows(parts: Sequence[Path], schema: pa.Schema, whole: pa.Schema) -> Iterator[pa.Table]:
    """Yield the rows of all parts, worst first, with their rank from 1."""
    before = 0
    for rows in joined_rows(parts, schema, ROWS):
        rank = pa.array(np.arange(before + 1, before + 1 + rows.num_rows))
        yield pa.table([rank, *rows.columns], schema=whole)
        before += rows.num_rows


def _append_csv(database: duckdb.DuckDBPyConnection, rows: pa.Table, path: Path) -> None:
    """Append rounded rows to a CSV file with a header."""
    # Names of columns may differ in case only, or be anything: the database numbers them
    numbered = arrow_cells(rows).rename_columns([f"c{i}" for i in range(rows.num_columns)])
    # It writes a separate file, which is appended to the others
    piece = path.with_suffix(".piece")
    database.register("piece", numbered)
    try:
        query = "COPY piece TO $path (FORMAT csv, HEADER false)"
        database.execute(query, {"path": str(piece)})
        with path.open("ab") as whole, piece.open("rb") as lines:
            shutil.copyfileobj(lines, whole)
    finally:
        database.unregister("piece")
        piece.unlink(missing_ok=True)


def write_worst(table: Path, rows: int, path: Path) -> None:
    """Write the first rows of a ranked Parquet table as CSV, all of whose columns are computed."""
    with (
        bounded_database(path.parent) as database,
        pq.ParquetFile(table.absolute(), pre_buffer=False) as file,
        written_whole(path) as part,
    ):
        part.write_text(header(file.schema_arrow.names), encoding="utf-8")
        # Piece by piece until the rows are written
        for batch in file.iter_batches(ROWS):
            piece = pa.Table.from_batches([batch]).slice(0, rows)
            rows -= piece.num_rows
            if piece.num_rows:
                _append_csv(database, rounded_arrow(piece, piece.column_names), part)


@contextmanager
def ranked_table(path: Path, columns: Sequence[str] | None = None) -> Iterator[RankedTable]:
    """
    Open a risk table for one pass.

    Parameters
    ----------
    path : Path
        Parquet file of the risk table.
    columns : sequence of str, optional
        Columns that are read, all if not given; those that the table lacks are left out.
    """
    # Buffers that are read ahead stay in memory until the end of the file
    with pq.ParquetFile(path.absolute(), pre_buffer=False) as file:
        yield RankedTable(file, None if columns is None else list(columns))
