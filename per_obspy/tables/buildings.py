"""
Table of the buildings, worst first, from the rows of buildings and the risk table.

The sides of all buildings are ordered by a database of bounded memory, and reduced to buildings in
pieces; the buildings are then ordered by their ranking.
"""

import json
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import duckdb
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow.dataset import Dataset

from per_obspy.config import Totals
from per_obspy.files import temporary_folder, written_whole
from per_obspy.inventory.schema import Column
from per_obspy.screening.building_rows.buildings import building_table
from per_obspy.screening.building_rows.row_columns import BUILDING_FLAGS, BUILDINGS, FLAGS
from per_obspy.screening.building_rows.sides import OF_PAIRS, sides_of
from per_obspy.tables.described import regrouped, schema_of, table_of, write_meanings
from per_obspy.tables.parts import (
    batches,
    bounded_database,
    parquet_rows,
    some_columns,
    text_columns,
)
from per_obspy.tables.risk import write_worst
from per_obspy.tables.totals import areas_of

#: Sides of buildings that are reduced together, about.
SIDES = 100_000

#: Buildings that are written together.
ROWS = 50_000

#: Name of the column of areas while it is in use: that of the pair table may be any.
_AREA = "area_of_totals"

_NUMBER = Column("building_number", "int64", "1", "")

#: Both sides of all interfaces.
_SIDES = (
    "SELECT *, true AS leftward, building_number_left AS building_number FROM joined UNION ALL "
    "SELECT *, false AS leftward, building_number_right AS building_number FROM joined"
)

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


def write_buildings(
    folder: Path, risk: Dataset, ways: BuildingWays, facts: Mapping[str, str], csv_rows: int
) -> list[Path]:
    """
    Write ``buildings.parquet``, ``buildings.csv`` and ``buildings.columns.csv``.

    Parameters
    ----------
    folder : Path
        With ``rows.parquet``.
    risk : Dataset
        The risk table.
    ways : BuildingWays
        Classes, areas and corners.
    facts : mapping of str to str
        Facts of the whole table that the Parquet file states.
    csv_rows : int
        Number of buildings in ``buildings.csv``, the worst ones.
    """
    names = ("buildings.parquet", "buildings.csv", "buildings.columns.csv")
    table, text, columns = files = [folder / name for name in names]
    with temporary_folder(folder) as room, bounded_database(room) as database:
        # Buildings in the order of their numbers, then in that of their ranking
        unranked = room / "unranked.parquet"
        with pq.ParquetWriter(unranked, schema_of(UNRANKED)) as writer:
            for piece in _pieces(database, folder, risk, ways.totals):
                found = building_table(piece, ways.classes, ways.angle)
                writer.write_table(table_of(found, UNRANKED))
        _write_ranked(database, unranked, table, facts)
    write_worst(table, csv_rows, text)
    write_meanings(BUILDINGS, {**FLAGS, **BUILDING_FLAGS}, columns)
    return files


def _pieces(
    database: duckdb.DuckDBPyConnection, folder: Path, risk: Dataset, totals: Totals
) -> Iterator[pd.DataFrame]:
    """Yield the sides of buildings in pieces; all sides of a building are in one piece."""
    database.register("interfaces", parquet_rows([folder / "rows.parquet"]))
    query = _sides_query(database, risk, totals)
    waiting: list[pd.DataFrame] = []
    for batch in batches(database, query, SIDES):
        waiting.append(batch.to_pandas())
        rows = pd.concat(waiting, ignore_index=True)
        # The last building may go on in the next batch
        last = rows["building_number"].to_numpy() == rows["building_number"].iloc[-1]
        waiting = [rows[last]]
        if not last.all():
            yield _sides(rows[~last], totals)
    if waiting:
        yield _sides(waiting[0], totals)


def _sides(rows: pd.DataFrame, totals: Totals) -> pd.DataFrame:
    """Return rows of the query as sides of buildings with their areas."""
    table = rows.drop(columns="building_number").reset_index(drop=True)
    # Areas as those of the pairs, by the middle of each pair
    area = areas_of(table, totals, _AREA)
    sides = sides_of(table.drop(columns=["longitude", "latitude", _AREA], errors="ignore"))
    return sides.assign(area=area)


def _sides_query(database: duckdb.DuckDBPyConnection, risk: Dataset, totals: Totals) -> str:
    """Register the risk table, and return the query of all sides, ordered by their buildings."""
    # Columns of the pairs that the sides need, as far as they exist
    known = risk.schema.names
    wanted = {name: name for name in OF_PAIRS} | ({_AREA: totals.area} if totals.area else {})
    present = {name: column for name, column in wanted.items() if column in known}
    read = list(dict.fromkeys(["pair_id", *present.values()]))
    database.register("risk", some_columns(risk, read))
    # Columns that the pair table does not have are empty
    columns = [f"risk.{_quoted(column)} AS {name}" for name, column in present.items()]
    columns += [f"CAST(NULL AS DOUBLE) AS {name}" for name in wanted if name not in present]
    joined = f"SELECT interfaces.*, {', '.join(columns)} FROM interfaces JOIN risk USING (pair_id)"
    return f"WITH joined AS ({joined}) {_SIDES} ORDER BY building_number, row_id, interface"


def _quoted(name: str) -> str:
    """Return the name of a column as SQL has it."""
    doubled = name.replace('"', '""')
    return f'"{doubled}"'


def _write_ranked(
    database: duckdb.DuckDBPyConnection, unranked: Path, table: Path, facts: Mapping[str, str]
) -> None:
    """Write all buildings in the order of their ranking, with their rank from 1."""
    # By their ranking, without the numbers by which they were made
    database.register("buildings", parquet_rows([unranked]))
    names = ", ".join(column.name for column in BUILDINGS[1:])
    query = f"SELECT {names} FROM buildings ORDER BY {_ORDER}"
    statement = {"per_obspy": json.dumps({"version": version("per_obspy"), **facts})}
    schema = schema_of(BUILDINGS, statement)
    dictionaries = text_columns(schema)
    found = (pa.Table.from_batches([batch]) for batch in batches(database, query, ROWS))
    before, unnumbered = 0, pa.schema(list(schema)[1:])
    with (
        written_whole(table) as part,
        pq.ParquetWriter(part, schema, use_dictionary=dictionaries) as writer,
    ):
        # Ranks count from 1
        for rows in regrouped(found, unnumbered, ROWS):
            rank = pa.array(np.arange(before + 1, before + 1 + rows.num_rows))
            writer.write_table(pa.table([rank, *rows.columns], schema=schema))
            before += rows.num_rows
