"""The files of several scenarios together; risk tables are joined pair by pair, without ever being in memory."""

import json
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.errors import Rejection
from per_obspy.files import written_whole
from per_obspy.screening.region.ensemble import (
    SAME,
    SEVERITY,
    ensemble_columns,
    ensemble_rejections,
    ensemble_rows,
)
from per_obspy.tables.database import bounded_database, write_worst
from per_obspy.tables.risk import ROWS
from per_obspy.tables.writing import write_described, write_rejected

_TYPES = {"float64": pa.float64(), "int64": pa.int64(), "str": pa.string()}


class Scenarios(NamedTuple):
    """
    Scenarios whose runs are done.

    Attributes
    ----------
    tables : dict
        Risk table of each, Parquet; None where nothing usable was left.
    weights : dict
        Weight of each, or its rate (1/year).
    yearly : bool
        Whether they are rates.
    """

    tables: dict[str, Path | None]
    weights: dict[str, float]
    yearly: bool


#: Severity of a pair in a risk table: the impact velocity that ranks it, the larger amplification.
_SEVERITY = """
    greatest(
        coalesce(nullif(impact_velocity_exact, 'NaN'::DOUBLE), 0.0),
        CASE WHEN demand_rule = 'exact' THEN 0.0
        ELSE coalesce(nullif(impact_velocity, 'NaN'::DOUBLE), 0.0) END
    ) AS impact_velocity,
    greatest(
        1.0,
        nullif(amplification_exact_1, 'NaN'::DOUBLE),
        nullif(amplification_exact_2, 'NaN'::DOUBLE),
        CASE WHEN demand_rule <> 'exact' THEN nullif(amplification_1, 'NaN'::DOUBLE) END,
        CASE WHEN demand_rule <> 'exact' THEN nullif(amplification_2, 'NaN'::DOUBLE) END
    ) AS amplification
"""

#: The rows in their order, with the rank before the other columns.
_ORDERED = f"""
    COPY (
        SELECT row_number() OVER () AS rank, *
        FROM (
            SELECT * FROM read_parquet($rows)
            ORDER BY probability DESC, expected_impact_velocity DESC, expected_amplification DESC,
                pair_id
        )
    ) TO $path (FORMAT parquet, ROW_GROUP_SIZE {ROWS}, KV_METADATA {{per_obspy: $said}})
"""


def write_ensemble(
    scenarios: Scenarios, folder: Path, facts: Mapping[str, str], csv_rows: int
) -> tuple[list[Path], dict[str, int]]:
    """
    Write ``ensemble.parquet``, ``ensemble.csv``, ``ensemble.columns.csv`` and ``rejected.csv``.

    Parameters
    ----------
    scenarios : Scenarios
        What was run.
    folder : Path
        Where to.
    facts : mapping of str to str
        What the Parquet file says of the whole table.
    csv_rows : int
        How many rows ``ensemble.csv`` holds, the worst ones.

    Returns
    -------
    files : list of Path
        Their paths.
    counts : dict
        Number of pairs, and of rejected ones.
    """
    ends = (".parquet", ".csv", ".columns.csv")
    table, text, columns = (folder / f"ensemble{end}" for end in ends)
    rejected = folder / "rejected.csv"
    with TemporaryDirectory(dir=folder) as room:
        joined, rows = Path(room) / "joined.parquet", Path(room) / "rows.parquet"
        _join(scenarios, joined)
        _write_rows(scenarios, joined, rows)
        said = json.dumps({"version": version("per_obspy"), **facts})
        with bounded_database(Path(room)) as database, written_whole(table) as part:
            database.execute(_ORDERED, {"rows": str(rows), "path": str(part), "said": said})
        kinds = write_rejected(_rejections(scenarios, joined), rejected)
    write_worst(table, csv_rows, text)
    write_described(ensemble_columns(scenarios.weights, scenarios.yearly).values(), columns)
    return [table, text, columns, rejected], {
        "pairs": pq.read_metadata(table).num_rows,
        "rejected_pair": kinds["pair"],
    }


def _join(scenarios: Scenarios, path: Path) -> None:
    """Write one row for each name of a pair, as :func:`per_obspy.screening.region.ensemble.ensemble_rows` takes them."""
    tables = list(scenarios.tables.values())
    nothing = ", ".join(f"0::DOUBLE AS {name}" for name in ("probability", *SAME, *SEVERITY))
    parts = [f"SELECT -1 AS scenario, '' AS pair_id, {nothing} WHERE false"]
    same_columns = ", ".join(SAME)
    parts += [
        f"SELECT {number} AS scenario, pair_id, probability, {same_columns}, {_SEVERITY} "
        f"FROM read_parquet($table{number})"
        for number, table in enumerate(tables)
        if table
    ]
    each = [
        f"max({name}) FILTER (scenario = {number}) AS {name}_{number}"
        for number in range(len(tables))
        for name in ("probability", *SEVERITY)
    ]
    same = [f"min({name}) AS {name}, max({name}) AS {name}_largest" for name in SAME]
    query = f"""
        COPY (
            SELECT pair_id, {", ".join([*each, *same])} FROM ({" UNION ALL ".join(parts)})
            GROUP BY pair_id ORDER BY pair_id
        ) TO $path (FORMAT parquet, ROW_GROUP_SIZE {ROWS})
    """
    files = {f"table{number}": str(table) for number, table in enumerate(tables) if table}
    with bounded_database(path.parent) as database:
        database.execute(query, {**files, "path": str(path)})


def _pieces(scenarios: Scenarios, joined: Path) -> Iterator[pd.DataFrame]:
    """Give the joined rows in pieces, with the names of the scenarios."""
    names = {}
    for number, name in enumerate(scenarios.tables):
        for column in ("probability", *SEVERITY):
            names[f"{column}_{number}"] = f"{column}_{name}"
    with pq.ParquetFile(joined) as table:
        for batch in table.iter_batches(ROWS):
            piece: pd.DataFrame = batch.to_pandas().rename(columns=names)
            yield piece.astype(
                dict.fromkeys(names.values(), "float64")
            )  # a batch of empty cells has no type


def _write_rows(scenarios: Scenarios, joined: Path, path: Path) -> None:
    described = ensemble_columns(scenarios.weights, scenarios.yearly)
    schema = pa.schema(
        [(name, _TYPES[one.dtype]) for name, one in described.items() if name != "rank"]
    )
    with pq.ParquetWriter(path, schema) as writer:
        for piece in _pieces(scenarios, joined):
            rows = ensemble_rows(piece, scenarios.weights, scenarios.yearly)
            writer.write_table(pa.Table.from_pandas(rows, schema=schema, preserve_index=False))


def _rejections(scenarios: Scenarios, joined: Path) -> Iterator[Rejection]:
    for piece in _pieces(scenarios, joined):
        yield from ensemble_rejections(piece, scenarios.weights)
