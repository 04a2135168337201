"""Risk table on disk: parts of an inventory joined, worst first, in bounded memory."""

import json
import shutil
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import duckdb
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.files import temporary_folder, writing, written_whole
from per_obspy.inventory.files.text_cells import arrow_cells, header
from per_obspy.inventory.places import with_towns
from per_obspy.inventory.schema import Column
from per_obspy.inventory.suspicions import ODD
from per_obspy.results.parts import bounded_database, joined_rows, joined_schema
from per_obspy.results.ranked_cells import CellFiles, cell_files, cells_of_parts, ranked_writer
from per_obspy.results.ranked_table import ROWS, RankedTable, ranked_table, table_files
from per_obspy.results.table_files import (
    rounded_arrow,
    rounded_table,
    write_csv,
    write_parquet,
    write_rejected,
)
from per_obspy.screening.columns import HAZARD, column_table, csv_columns
from per_obspy.screening.design import DESIGN


class RiskFiles(NamedTuple):
    """Files of a risk table."""

    #: ``risk.parquet``, or one file per cell in ``risk/``; ``risk.csv`` and ``risk.columns.csv``.
    files: list[Path]
    #: Number of pairs in each state.
    states: Counter[str]
    #: Number of pairs for which the record of each station is used.
    stations: Counter[str]
    #: Number of pairs by what an earlier earthquake did to them, if the table says it.
    damage: Counter[str]


#: Where no pair could be screened.
NO_RISK = RiskFiles([], Counter(), Counter(), Counter())


def write_risk(
    parts: Sequence[Path],
    folder: Path,
    facts: Mapping[str, str],
    csv_rows: int,
    cell: float | None = None,
) -> RiskFiles:
    """
    Write ``risk.parquet`` or ``risk/``, ``risk.csv`` and ``risk.columns.csv``.

    Parameters
    ----------
    parts : sequence of Path
        From :func:`~per_obspy.results.parts.write_part`, at least one.
    folder : Path
        Folder of the files.
    facts : mapping of str to str
        Facts of the whole table that the Parquet file states, for example whether the motion is
        simulated.
    csv_rows : int
        Number of rows of ``risk.csv``, the worst ones.
    cell : float, optional
        Width and height of the cells in ``risk/``, degrees; one file of all rows if not given.
    """
    text, columns = folder / "risk.csv", folder / "risk.columns.csv"
    # Schema of the parts, and of the table
    schema = joined_schema(parts)
    whole = ranked_schema(schema, facts)
    with written_whole(text) as lines, _opened(parts, folder, whole, cell) as (first, *others):
        rows = _ranked_rows(parts, schema, whole)
        with first as table:
            counted = _write_rows(rows, table, lines, csv_rows)
        # More cells than files that can be open together
        for files in others:
            with files as table:
                for piece in _ranked_rows(parts, schema, whole):
                    table.write_table(piece)
    write_csv(column_table(whole.names), columns)
    return RiskFiles([*table_files(folder), text, columns], *counted)


@contextmanager
def _opened(
    parts: Sequence[Path], folder: Path, schema: pa.Schema, cell: float | None
) -> Iterator[list[AbstractContextManager[pq.ParquetWriter | CellFiles]]]:
    """Yield the file of the table, or those of its cells, to be opened one after the other."""
    if cell is None:
        with written_whole(folder / "risk.parquet") as part:
            yield [ranked_writer(part, schema)]
        return
    # The folder of the cells appears when all of them are finished
    with temporary_folder(folder) as room:
        (room / "risk").mkdir()
        groups = cells_of_parts(parts, cell)
        yield [cell_files(room / "risk", schema, group, cell) for group in groups]
        with writing(folder / "risk"):
            (room / "risk").rename(folder / "risk")


def ranked_schema(schema: pa.Schema, facts: Mapping[str, str]) -> pa.Schema:
    """Return the schema of a ranked table: the rank before the other columns, and its facts."""
    statement = json.dumps({"version": version("per_obspy"), **facts})
    return pa.schema([("rank", pa.int64()), *schema], metadata={"per_obspy": statement})


def _write_rows(
    rows: Iterator[pa.Table], table: pq.ParquetWriter | CellFiles, text: Path, csv_rows: int
) -> tuple[Counter[str], Counter[str], Counter[str]]:
    """Write ranked rows as Parquet, the worst as CSV too; count states, stations and damage."""
    counted = {name: Counter[str]() for name in ("state", "station", "after_damage")}
    before = 0
    short: list[str] = []
    with bounded_database(text.parent) as database:
        for piece in rows:
            table.write_table(piece)
            for name in counted.keys() & set(piece.column_names):
                count_values(piece[name], counted[name])
            if not before:
                short = csv_columns(piece.column_names)
                text.write_text(header(short), encoding="utf-8")
            # Rows whose rank is at most the number of rows of the text
            if before < csv_rows:
                # Columns and digits for a reader
                worst = piece.select(short).slice(0, csv_rows - before)
                _append_csv(database, rounded_arrow(worst), text)
            before += piece.num_rows
    return counted["state"], counted["station"], counted["after_damage"]


def count_values(column: pa.ChunkedArray, counter: Counter[str]) -> None:
    """Add the number of each value of a column to a counter."""
    for value, number in zip(*column.value_counts().flatten(), strict=True):
        counter[value.as_py()] += number.as_py()


def _ranked_rows(parts: Sequence[Path], schema: pa.Schema, whole: pa.Schema) -> Iterator[pa.Table]:
    """Yield the rows of all parts, worst first, with their rank from 1."""
    before = 0
    for rows in joined_rows(parts, schema, ROWS):
        rank = pa.array(np.arange(before + 1, before + 1 + rows.num_rows))
        yield pa.table([rank, *rows.columns], schema=whole)
        before += rows.num_rows


def _append_csv(database: duckdb.DuckDBPyConnection, rows: pa.Table, path: Path) -> None:
    """Append rounded rows to a CSV file with a header; an empty place is the nearest town."""
    names = rows.column_names
    if {"place", "longitude", "latitude"} <= set(names):
        place = with_towns(*(rows[name].to_pandas() for name in ("place", "longitude", "latitude")))
        rows = rows.set_column(names.index("place"), "place", pa.array(place, pa.string()))
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
    with ranked_table([table]) as ranked:
        names = ranked.schema.names
        write_worst_rows(ranked, rows, path, names, names)


def write_worst_rows(
    table: RankedTable, rows: int, path: Path, columns: Sequence[str], own: Collection[str] = ()
) -> None:
    """
    Write the worst rows of a ranked table as CSV.

    Parameters
    ----------
    table : RankedTable
        The table.
    rows : int
        Largest number of rows.
    path : Path
        The file.
    columns : sequence of str
        Its columns.
    own : collection of str
        Columns of numbers that are rounded besides those that the package defines.
    """
    with bounded_database(path.parent) as database, written_whole(path) as part:
        part.write_text(header(columns), encoding="utf-8")
        for piece in table.ranked(rows, columns):
            _append_csv(database, rounded_arrow(piece, own), part)


FILES = ("design.csv", "design.parquet", "design.columns.csv", "rejected.csv")


def write_design(table: pd.DataFrame, folder: Path) -> list[Path]:
    """
    Write the files of a screening by a design spectrum, and return their paths.

    Parameters
    ----------
    table : DataFrame
        From :func:`per_obspy.screening.design.design_table`.
    folder : Path
        Folder of ``design.csv``, ``design.parquet``, ``design.columns.csv``, ``rejected.csv``.
    """
    text, whole, columns, rejected = paths = [folder / name for name in FILES]
    odd = Column(ODD, "str", "", "what is odd in the row: flags of docs/inventories.md")
    names, own = list(map(str, table)), DESIGN | HAZARD | {ODD: odd}
    short = table[csv_columns(names)]
    # A reader finds a place in every row
    place = with_towns(short["place"], short["longitude"], short["latitude"])
    write_csv(rounded_table(short.assign(place=place), own), text)
    write_parquet(table, whole)
    write_csv(column_table(names, own, {}), columns)
    write_rejected(table.attrs["rejected"], rejected)
    return paths
