"""Files of an ensemble: risk tables of all scenarios, joined pair by pair on disk."""

import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.errors import Rejection
from per_obspy.files import temporary_folder, written_whole
from per_obspy.screening.ensemble import (
    SAME,
    SEVERITY,
    ensemble_columns,
    ensemble_rejections,
    ensemble_rows,
)
from per_obspy.tables.parts import bounded_database, parquet_rows
from per_obspy.tables.ranked_table import ROWS
from per_obspy.tables.risk import write_worst
from per_obspy.tables.table_files import write_described, write_rejected

_TYPES = {"float64": pa.float64(), "int64": pa.int64(), "str": pa.string()}


class Scenarios(NamedTuple):
    """
    Scenarios whose runs are done.

    Attributes
    ----------
    tables : dict
        Files of the risk table of each; none for a scenario without a usable pair.
    weights : dict
        Weight of each, or its rate (1/year).
    yearly : bool
        Whether they are rates.
    """

    tables: Mapping[str, Sequence[Path]]
    weights: dict[str, float]
    yearly: bool


#: The rows in their order, with the rank before the other columns.
_ORDERED = f"""
    COPY (
        SELECT row_number() OVER () AS rank, *
        FROM (
            SELECT * FROM rows
            ORDER BY expected_impact_velocity DESC, expected_amplification DESC, probability DESC,
                pair_id
        )
    ) TO $path (FORMAT parquet, ROW_GROUP_SIZE {ROWS}, KV_METADATA {{per_obspy: $statement}})
"""


def write_ensemble(
    scenarios: Scenarios, folder: Path, facts: Mapping[str, str], csv_rows: int
) -> tuple[list[Path], dict[str, int]]:
    """
    Write ``ensemble.parquet``, ``ensemble.csv``, ``ensemble.columns.csv`` and ``rejected.csv``.

    Parameters
    ----------
    scenarios : Scenarios
        The scenarios.
    folder : Path
        Folder of the files.
    facts : mapping of str to str
        Facts of the whole table that the Parquet file states.
    csv_rows : int
        Number of rows of ``ensemble.csv``, the worst ones.

    Returns
    -------
    files : list of Path
        Their paths.
    counts : dict
        Number of pairs, and of rejected ones.
    """
    names = ("ensemble.parquet", "ensemble.csv", "ensemble.columns.csv", "rejected.csv")
    table, text, columns, rejected = files = [folder / name for name in names]
    statement = json.dumps({"version": version("per_obspy"), **facts})
    with temporary_folder(folder) as room:
        joined, rows = room / "joined.parquet", room / "rows.parquet"
        # Join by pair, compute the probabilities, and order by them
        _join(scenarios, joined)
        _write_rows(scenarios, joined, rows)
        with bounded_database(room) as database, written_whole(table) as part:
            database.register("rows", parquet_rows([rows]))
            database.execute(_ORDERED, {"path": str(part), "statement": statement})
        kinds = write_rejected(_rejections(scenarios, joined), rejected)
    # The worst rows as text, and the meaning of every column
    write_worst(table, csv_rows, text)
    described = ensemble_columns(scenarios.weights, scenarios.yearly)
    write_described(described.values(), columns)
    counts = {"pairs": pq.read_metadata(table.absolute()).num_rows, "rejected_pair": kinds["pair"]}
    return files, counts


def _join(scenarios: Scenarios, path: Path) -> None:
    """Write one row per pair name, in the form for ``screening.ensemble.ensemble_rows``."""
    tables = list(scenarios.tables.values())
    with bounded_database(path.parent) as database:
        for number, table in enumerate(tables):
            if table:
                database.register(f"table{number}", parquet_rows(table))
        database.execute(_join_query(tables), {"path": str(path)})


def _join_query(tables: Sequence[Sequence[Path]]) -> str:
    """Return the query that joins the risk tables ``table0``, ``table1`` ... by pair."""
    # Without any table there is still a header
    zeros = ", ".join(f"0::DOUBLE AS {name}" for name in ("probability", *SAME, *SEVERITY))
    rows = [f"SELECT -1 AS scenario, '' AS pair_id, {zeros} WHERE false"]
    rows += [
        f"SELECT {number} AS scenario, pair_id, probability, {', '.join((*SAME, *SEVERITY))}"
        f" FROM table{number}"
        for number, table in enumerate(tables)
        if table
    ]
    # Columns of probability and severity per scenario, extremes of columns that should be equal
    columns = [
        f"max({name}) FILTER (scenario = {number}) AS {name}_{number}"
        for number in range(len(tables))
        for name in ("probability", *SEVERITY)
    ]
    columns += [f"min({name}) AS {name}, max({name}) AS {name}_largest" for name in SAME]
    return f"""
        COPY (
            SELECT pair_id, {", ".join(columns)} FROM ({" UNION ALL ".join(rows)})
            GROUP BY pair_id ORDER BY pair_id
        ) TO $path (FORMAT parquet, ROW_GROUP_SIZE {ROWS})
    """


def _pieces(scenarios: Scenarios, joined: Path) -> Iterator[pd.DataFrame]:
    """Yield the joined rows in pieces, with the names of the scenarios."""
    names = {}
    for number, name in enumerate(scenarios.tables):
        for column in ("probability", *SEVERITY):
            names[f"{column}_{number}"] = f"{column}_{name}"
    with pq.ParquetFile(joined, pre_buffer=False) as table:
        for batch in table.iter_batches(ROWS):
            piece: pd.DataFrame = batch.to_pandas().rename(columns=names)
            # A batch of empty cells has no type
            yield piece.astype(dict.fromkeys(names.values(), "float64"))


def _write_rows(scenarios: Scenarios, joined: Path, path: Path) -> None:
    """Write the rows of the ensemble, not ranked yet."""
    described = ensemble_columns(scenarios.weights, scenarios.yearly)
    # The rank is known when the rows are in order
    fields = [(name, _TYPES[column.dtype]) for name, column in described.items() if name != "rank"]
    schema = pa.schema(fields)
    with pq.ParquetWriter(path, schema) as writer:
        for piece in _pieces(scenarios, joined):
            rows = ensemble_rows(piece, scenarios.weights, scenarios.yearly)
            writer.write_table(pa.Table.from_pandas(rows, schema=schema, preserve_index=False))


def _rejections(scenarios: Scenarios, joined: Path) -> Iterator[Rejection]:
    """Yield the pairs that a scenario lacks or that differ between scenarios."""
    for piece in _pieces(scenarios, joined):
        yield from ensemble_rejections(piece, scenarios.weights)
