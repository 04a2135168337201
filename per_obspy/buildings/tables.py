"""
Tables of rows of buildings and of buildings, worst first.

The sides of all buildings are ordered by a database of bounded memory, and reduced to buildings in
pieces; the buildings are then ordered by their ranking.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from per_obspy.buildings.columns import BUILDING_FLAGS, BUILDINGS, FLAGS, ROWS
from per_obspy.buildings.search import (
    AREA,
    BY_STATION,
    GROUP,
    one_thread_database,
    register_tables,
    tables_of,
    whole_groups,
)
from per_obspy.buildings.sides import OF_PAIRS, UNKNOWN, building_table, directions
from per_obspy.config import Run, Totals
from per_obspy.files import written_whole
from per_obspy.inventory.schema import Column
from per_obspy.results.parts import Order, text_columns, write_ordered
from per_obspy.results.risk import write_worst
from per_obspy.results.table_files import regrouped, schema_of, table_of, write_meanings
from per_obspy.results.totals import PLACE, areas_of
from per_obspy.screening.ranking import velocity_of_unknown

#: Sides of buildings that are reduced together, about.
SIDES = 100_000

#: Buildings that are written together.
RANKED = 50_000

#: Columns of the rows that a side of a building needs.
_OF_ROWS = (
    "row_id", "buildings", "interface", "pair_id", "turned", "azimuth", "impacts",
    "impact_velocity", "impact_velocity_84", "impact_velocity_alone", "flags",
    "longitude", "latitude",
    *(f"{name}_{side}" for side in ("left", "right")
      for name in ("building_id", "building_number", "amplification", "amplification_alone")),
)  # fmt: skip

#: Columns of rows that interfaces leave to their pairs.
_PLACES = ("longitude", "latitude")

#: Columns by which an unknown gap is ranked.
_UNKNOWN_BY = ("probability", "demand", "period_1", "period_2")

#: Columns of a building before it has a rank.
UNRANKED = (
    Column("building_number", "int64", "1", ""),
    *BUILDINGS[1:],
    Column(UNKNOWN, "float64", "m/s", ""),
)

#: Order of the ranking; unknown gaps stand beside the others, as among pairs. The last ones only
#: break ties.
BY_SEVERITY = Order(
    f"greatest(severity, {UNKNOWN}) DESC NULLS LAST, "
    "greatest(amplification_row, amplification_pair) DESC NULLS LAST, "
    "probability_independent DESC NULLS LAST, importance DESC NULLS LAST, "
    "occupants DESC NULLS LAST, building_id, building_number",
    ("severity", UNKNOWN, "amplification_row", "amplification_pair", "probability_independent",
     "importance", "occupants", "building_id", "building_number"),
)  # fmt: skip


def write_rows_part(interfaces: Mapping[str, Any], path: Path) -> None:
    """Write some interfaces with the columns ``ROWS``."""
    table = table_of(interfaces, ROWS)
    with written_whole(path) as part:
        texts = text_columns(table.schema)
        pq.write_table(table, part, row_group_size=GROUP, use_dictionary=texts)


def write_parts_of_piece(
    contacts: pa.Table, settings: Run, number: int, rows: Path, buildings: Path
) -> None:
    """Write rows without histories and buildings of the contacts of a piece, each in its order."""
    contacts = contacts.sort_by([(name, "ascending") for name in BY_STATION.columns])
    interfaces = _without_histories(contacts)
    write_ordered(interfaces, number, rows)
    known = _known_interfaces(interfaces, contacts, settings.totals)
    with one_thread_database(buildings.parent) as database:
        ranked = pa.concat_tables(_in_order(database, iter([known]), settings))
    write_ordered(ranked, number, buildings)


def rows_of_parts(parts: Iterable[Path]) -> Iterator[pa.Table]:
    """Yield the interfaces of parts of :func:`write_rows_part`."""
    for part in parts:
        yield pq.ParquetFile(part.absolute()).read(use_threads=False)


def _without_histories(contacts: pa.Table) -> pa.Table:
    """Return contacts as interfaces without any history."""
    schema, columns = schema_of(ROWS), list[pa.Array | pa.ChunkedArray]()
    # Outcomes of histories are empty, as is every other number that is not known
    for field in schema:
        known = field.name in contacts.column_names
        column = contacts[field.name] if known else pa.nulls(contacts.num_rows, field.type)
        if pa.types.is_floating(field.type):
            column = pc.if_else(pc.is_nan(column), None, column)
        columns.append(column.cast(field.type))
    return pa.table(columns, schema=schema)


def write_rows(tables: Iterable[pa.Table], folder: Path, facts: Mapping[str, str]) -> list[Path]:
    """
    Write ``rows.parquet``, which states facts of the whole table, and ``rows.columns.csv``.

    Tables are the interfaces in their order.
    """
    files = [folder / "rows.parquet", folder / "rows.columns.csv"]
    schema = _stated_schema(ROWS, facts)
    _write_table(regrouped(tables, schema, GROUP), schema, files[0])
    write_meanings(ROWS, FLAGS, files[1])
    return files


def _stated_schema(columns: Sequence[Column], facts: Mapping[str, str]) -> pa.Schema:
    """Return the schema of a table with the facts of the risk table."""
    statement = {"per_obspy": json.dumps({"version": version("per_obspy"), **facts})}
    return schema_of(columns, statement)


def _write_table(tables: Iterable[pa.Table], schema: pa.Schema, path: Path) -> None:
    """Write tables as one file, each as a group of rows."""
    with (
        written_whole(path) as part,
        pq.ParquetWriter(part, schema, use_dictionary=text_columns(schema)) as writer,
    ):
        for table in tables:
            writer.write_table(table)


def write_buildings(
    tables: Iterable[pa.Table], folder: Path, settings: Run, facts: Mapping[str, str]
) -> list[Path]:
    """
    Write ``buildings.parquet``, ``buildings.csv`` (the worst) and ``buildings.columns.csv``.

    Tables are the buildings in the order of their ranking, with the columns ``UNRANKED``. The
    Parquet file states facts of the whole table.
    """
    names = ("buildings.parquet", "buildings.csv", "buildings.columns.csv")
    table, text, columns = files = [folder / name for name in names]
    schema = _stated_schema(BUILDINGS, facts)
    _write_table(_ranked(tables, schema), schema, table)
    write_worst(table, settings.csv_rows, text)
    write_meanings(BUILDINGS, {**FLAGS, **BUILDING_FLAGS}, columns)
    return files


def buildings_of(folder: Path, contacts: Path, settings: Run) -> Iterator[pa.Table]:
    """
    Yield all buildings of ``rows.parquet`` in the order of their ranking.

    Contacts, in the order of these rows, have the columns ``OF_PAIRS`` and that of the areas, as
    far as they are known.
    """
    with one_thread_database(folder) as database:
        interfaces = _interfaces(folder / "rows.parquet", contacts, settings.totals)
        yield from _in_order(database, interfaces, settings)


def _in_order(
    database: duckdb.DuckDBPyConnection, interfaces: Iterator[pa.Table], settings: Run
) -> Iterator[pa.Table]:
    """Yield the buildings of interfaces in the order of their ranking."""
    with database.cursor() as inner:
        # In the order of their numbers, then in that of their ranking
        buildings = (
            building_table(some, settings.screening.classes, settings.rows.angle)
            for some in _sides(inner, interfaces)
        )
        register_tables(database, "buildings", (table_of(some, UNRANKED) for some in buildings))
        yield from tables_of(database, f"SELECT * FROM buildings ORDER BY {BY_SEVERITY.by}", RANKED)


def _sides(
    database: duckdb.DuckDBPyConnection, interfaces: Iterator[pa.Table]
) -> Iterator[pd.DataFrame]:
    """Yield the sides of buildings in pieces; all sides of a building are in one piece."""
    names = register_tables(database, "interfaces", interfaces)
    sides = tables_of(database, sides_query(names), SIDES)
    for table in whole_groups(sides, "building_number"):
        yield table.to_pandas()


def sides_query(names: Sequence[str]) -> str:
    """
    Return the query of both sides of a table ``interfaces``, ordered by their buildings.

    Columns that end in ``_left`` and ``_right``, and those in ``_1`` and ``_2`` of the pair, become
    one column of the building of each side.
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
        carried = [name for name in (*OF_PAIRS, AREA) if name in second.schema_arrow.names]
        # Both files have the same rows in the same groups
        for group in range(first.num_row_groups):
            table = first.read_row_group(group, columns=list(_OF_ROWS), use_threads=False)
            pairs = second.read_row_group(group, columns=carried, use_threads=False)
            yield _known_interfaces(table, pairs, totals)


def _known_interfaces(table: pa.Table, pairs: pa.Table, totals: Totals) -> pa.Table:
    """Return interfaces with the columns of their pairs and their areas."""
    columns = {name: table[name] for name in _OF_ROWS if name not in _PLACES}
    columns |= directions(table["azimuth"], table["flags"])
    columns["area"] = _areas(table, pairs, totals)
    # Columns that the pair table does not have are empty
    known, empty = pairs.column_names, pa.nulls(pairs.num_rows, pa.float64())
    columns |= {name: pairs[name] if name in known else empty for name in OF_PAIRS}
    unknown_by = [name for name in _UNKNOWN_BY if name in known]
    columns[UNKNOWN] = velocity_of_unknown(pairs.select(unknown_by).to_pandas())
    return pa.table(columns)


def _areas(table: pa.Table, pairs: pa.Table, totals: Totals) -> pa.Array:
    """Return the area of each interface as that of its pair, by the middle of the pair."""
    frame = table.select(["longitude", "latitude"]).to_pandas()
    if AREA in pairs.column_names:
        frame[AREA if totals.area else PLACE] = pairs[AREA].to_pandas()
    return pa.array(areas_of(frame, totals, AREA), pa.string())


def _ranked(tables: Iterable[pa.Table], schema: pa.Schema) -> Iterator[pa.Table]:
    """Yield buildings with their rank from 1, without the numbers by which they were made."""
    unnumbered, before = schema.remove(0), 0
    # What only their order needs is left out
    known = (table.select(unnumbered.names) for table in tables)
    for rows in regrouped(known, unnumbered, RANKED):
        rank = pa.array(np.arange(before + 1, before + 1 + rows.num_rows))
        yield pa.table([rank, *rows.columns], schema=schema)
        before += rows.num_rows
