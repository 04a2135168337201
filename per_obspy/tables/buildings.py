"""
Table of the buildings, worst first, from the rows of buildings and the risk table.

The sides of all buildings are ordered by a database of bounded memory, and reduced to buildings in
pieces; the buildings are then ordered by their ranking.
"""

import json
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

from per_obspy.config import Totals
from per_obspy.files import temporary_folder, written_whole
from per_obspy.inventory.schema import Column
from per_obspy.screening.building_rows.buildings import building_table
from per_obspy.screening.building_rows.row_columns import BUILDING_FLAGS, BUILDINGS, FLAGS
from per_obspy.screening.building_rows.sides import OF_PAIRS, directions
from per_obspy.tables.parts import (
    batches,
    bounded_database,
    text_columns,
)
from per_obspy.tables.risk import write_worst
from per_obspy.tables.table_files import regrouped, schema_of, table_of, write_meanings
from per_obspy.tables.totals import areas_of

#: Sides of buildings that are reduced together, about.
SIDES = 100_000

#: Rows of a file that are read together.
TOGETHER = 10_000

#: Buildings that are written together.
ROWS = 50_000

#: Name of the column of areas in the file of contacts: that of the pair table may be any.
AREA = "area_of_totals"

#: Threads of the database: one needs a quarter less processor time than two.
THREADS = 1

_NUMBER = Column("building_number", "int64", "1", "")

#: Columns of the rows that a side of a building needs.
_OF_ROWS = (
    "row_id", "buildings", "interface", "pair_id", "turned", "azimuth", "impacts",
    "impact_velocity", "impact_velocity_alone", "flags", "longitude", "latitude",
    *(f"{name}_{side}" for side in ("left", "right")
      for name in ("building_id", "building_number", "amplification", "amplification_alone")),
)  # fmt: skip

#: Columns of a building before it has a rank.
UNRANKED = (_NUMBER, *BUILDINGS[1:])

#: Order of the ranking; the last ones only break ties.
_ORDER = (
    "severity DESC NULLS LAST, "
    "greatest(amplification_row, amplification_pair) DESC NULLS LAST, "
    "probability_independent DESC NULLS LAST, importance DESC NULLS LAST, "
    "occupants DESC NULLS LAST, building_id, building_number"
)


class BuildingWays(NamedTuple):
    """
    Settings of classes, counts and places of buildings.

    Attributes
    ----------
    classes : mapping of str to float
        Name and smallest severity of each risk class, m/s.
    totals : Totals
        Areas.
    angle : float
        Rows whose axes differ by more make their building a corner, degrees.
    """

    classes: Mapping[str, float]
    totals: Totals
    angle: float


@contextmanager
def one_thread_database(folder: Path) -> Iterator[duckdb.DuckDBPyConnection]:
    """Yield a database of one thread, which leaves what is too much to a folder inside."""
    with bounded_database(folder) as database:
        database.execute(f"SET threads = {THREADS}")
        yield database


@contextmanager
def stored_rows(file: Path) -> Iterator[pa.RecordBatchReader]:
    """Yield the rows of a Parquet file once, for a database; a dataset would read far ahead."""
    with pq.ParquetFile(file.absolute(), pre_buffer=False) as stored:
        rows = stored.iter_batches(TOGETHER, use_threads=False)
        yield pa.RecordBatchReader.from_batches(stored.schema_arrow, rows)


def write_buildings(
    folder: Path, contacts: Path, ways: BuildingWays, facts: Mapping[str, str], csv_rows: int
) -> list[Path]:
    """
    Write ``buildings.parquet``, ``buildings.csv`` and ``buildings.columns.csv``.

    Parameters
    ----------
    folder : Path
        With ``rows.parquet``.
    contacts : Path
        Parquet file of the columns ``OF_PAIRS`` and those of the areas, as far as they are known,
        in the order of ``rows.parquet``.
    ways : BuildingWays
        Classes, areas and corners.
    facts : mapping of str to str
        Facts of the whole table that the Parquet file states.
    csv_rows : int
        Number of buildings in ``buildings.csv``, the worst ones.
    """
    names = ("buildings.parquet", "buildings.csv", "buildings.columns.csv")
    table, text, columns = files = [folder / name for name in names]
    with temporary_folder(folder) as room, one_thread_database(room) as database:
        # Buildings in the order of their numbers, then in that of their ranking
        unranked = room / "unranked.parquet"
        with pq.ParquetWriter(unranked, schema_of(UNRANKED)) as writer:
            for piece in _pieces(database, folder / "rows.parquet", contacts, ways.totals):
                found = building_table(piece, ways.classes, ways.angle)
                writer.write_table(table_of(found, UNRANKED))
        _write_ranked(database, unranked, table, facts)
    write_worst(table, csv_rows, text)
    write_meanings(BUILDINGS, {**FLAGS, **BUILDING_FLAGS}, columns)
    return files


def _pieces(
    database: duckdb.DuckDBPyConnection, rows: Path, contacts: Path, totals: Totals
) -> Iterator[pd.DataFrame]:
    """Yield the sides of buildings in pieces; all sides of a building are in one piece."""
    # The first ones have the columns of all
    interfaces = _interfaces(rows, contacts, totals)
    first = next(interfaces)
    source = (batch for table in chain([first], interfaces) for batch in table.to_batches())
    database.register("interfaces", pa.RecordBatchReader.from_batches(first.schema, source))
    waiting: list[pd.DataFrame] = []
    for batch in batches(database, sides_query(first.column_names), SIDES):
        waiting.append(batch.to_pandas())
        found = pd.concat(waiting, ignore_index=True) if len(waiting) > 1 else waiting[0]
        # The last building may go on in the next batch
        number = found["building_number"].to_numpy()
        whole = int(np.searchsorted(number, number[-1]))
        waiting = [found.iloc[whole:]]
        if whole:
            yield found.iloc[:whole]
    if waiting:
        yield waiting[0].reset_index(drop=True)


def sides_query(names: Sequence[str]) -> str:
    """
    Return the query of both sides of interfaces, ordered by their buildings.

    Parameters
    ----------
    names : sequence of str
        Columns of a table ``interfaces``. Those that end in ``_left`` and ``_right``, and those in
        ``_1`` and ``_2`` of the pair, become one column of the building of each side.
    """
    columns = []
    for name in names:
        stem, _, end = name.rpartition("_")
        if end == "left":
            columns.append(f"CASE WHEN leftward THEN {name} ELSE {stem}_right END AS {stem}")
        elif end == "1":
            # Building 1 is on the left of a pair that is not turned
            columns.append(f"CASE WHEN leftward <> turned THEN {name} ELSE {stem}_2 END AS {stem}")
        elif end not in ("right", "2"):
            columns.append(name)
    for name in ("number", "id"):
        left, right = (f"building_{name}_{side}" for side in ("left", "right"))
        columns.append(f"CASE WHEN leftward THEN {right} ELSE {left} END AS neighbour_{name}")
    both = "SELECT *, unnest([true, false]) AS leftward FROM interfaces"
    order = "building_number, row_id, interface, leftward DESC"
    return f"SELECT {', '.join(columns)} FROM ({both}) ORDER BY {order}"


def _interfaces(rows: Path, contacts: Path, totals: Totals) -> Iterator[pa.Table]:
    """Yield interfaces with the columns of their pairs and their areas."""
    with (
        pq.ParquetFile(rows.absolute(), pre_buffer=False) as first,
        pq.ParquetFile(contacts.absolute(), pre_buffer=False) as second,
    ):
        known = second.schema_arrow.names
        carried = [name for name in (*OF_PAIRS, AREA) if name in known]
        # Both files have the same rows in the same groups
        for group in range(first.num_row_groups):
            table = first.read_row_group(group, columns=list(_OF_ROWS), use_threads=False)
            pairs = second.read_row_group(group, columns=carried, use_threads=False)
            area = _areas(table, pairs, totals)
            # Columns that the pair table does not have are empty
            for name in OF_PAIRS:
                column = pairs[name] if name in known else pa.nulls(pairs.num_rows, pa.float64())
                table = table.append_column(name, column)
            for name, direction in directions(table["azimuth"], table["flags"]).items():
                table = table.append_column(name, pa.array(direction))
            yield table.drop_columns(["longitude", "latitude"]).append_column("area", area)


def _areas(table: pa.Table, pairs: pa.Table, totals: Totals) -> pa.Array:
    """Return the area of each interface as that of its pair, by the middle of the pair."""
    frame = table.select(["longitude", "latitude"]).to_pandas()
    if totals.area:
        frame[AREA] = pairs[AREA].to_pandas()
    return pa.array(areas_of(frame, totals, AREA), pa.string())


def _write_ranked(
    database: duckdb.DuckDBPyConnection, unranked: Path, table: Path, facts: Mapping[str, str]
) -> None:
    """Write all buildings in the order of their ranking, with their rank from 1."""
    # By their ranking, without the numbers by which they were made
    names = ", ".join(column.name for column in BUILDINGS[1:])
    query = f"SELECT {names} FROM buildings ORDER BY {_ORDER}"
    statement = {"per_obspy": json.dumps({"version": version("per_obspy"), **facts})}
    schema = schema_of(BUILDINGS, statement)
    dictionaries = text_columns(schema)
    before, unnumbered = 0, pa.schema(list(schema)[1:])
    with (
        stored_rows(unranked) as stored,
        written_whole(table) as part,
        pq.ParquetWriter(part, schema, use_dictionary=dictionaries) as writer,
    ):
        database.register("buildings", stored)
        found = (pa.Table.from_batches([batch]) for batch in batches(database, query, ROWS))
        # Ranks count from 1
        for rows in regrouped(found, unnumbered, ROWS):
            rank = pa.array(np.arange(before + 1, before + 1 + rows.num_rows))
            writer.write_table(pa.table([rank, *rows.columns], schema=schema))
            before += rows.num_rows
