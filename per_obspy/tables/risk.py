"""The risk table on disk: parts of an inventory joined, worst first, without ever being in memory as a whole."""

import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.files import written_whole
from per_obspy.tables.database import write_worst
from per_obspy.tables.parts import joined_rows, joined_schema, text_columns
from per_obspy.tables.writing import write_columns

#: Rows that are read and written together.
ROWS = 50_000


def write_risk(
    parts: Sequence[Path], folder: Path, facts: Mapping[str, str], csv_rows: int
) -> list[Path]:
    """
    Write ``risk.parquet``, ``risk.csv`` and ``risk.columns.csv``, and return their paths.

    Parameters
    ----------
    parts : sequence of Path
        From :func:`~per_obspy.tables.parts.write_part`, at least one.
    folder : Path
        Where to.
    facts : mapping of str to str
        What the Parquet file says of the whole table, for example whether the motion is simulated.
    csv_rows : int
        How many rows ``risk.csv`` holds, the worst ones.
    """
    said = json.dumps({"version": version("per_obspy"), **facts})
    table, text, columns = (
        folder / name for name in ("risk.parquet", "risk.csv", "risk.columns.csv")
    )
    with written_whole(table) as part:
        _write_ranked(parts, part, said)
    write_worst(table, csv_rows, text)
    write_columns(pq.read_schema(table).names, columns)
    return [table, text, columns]


def _write_ranked(parts: Sequence[Path], path: Path, said: str) -> None:
    schema, before = joined_schema(parts), 0
    whole = pa.schema([("rank", pa.int64()), *schema], metadata={"per_obspy": said})
    with pq.ParquetWriter(path, whole, use_dictionary=text_columns(whole)) as table:
        for rows in joined_rows(parts, schema, ROWS):
            rank = pa.array(np.arange(before + 1, before + 1 + rows.num_rows))
            table.write_table(pa.table([rank, *rows.columns], schema=whole))
            before += rows.num_rows


def ranked(path: Path, columns: Sequence[str] | None = None) -> Iterator[pd.DataFrame]:
    """Give the risk table in pieces, worst pair first; all columns or some."""
    with pq.ParquetFile(path) as table:
        for batch in table.iter_batches(ROWS, columns=columns):
            yield batch.to_pandas()
