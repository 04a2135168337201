"""The risk table on disk: parts of an inventory joined, worst first, without ever being in memory as a whole."""

import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq

from per_obspy.files import written_whole
from per_obspy.report.database import bounded_database, write_worst
from per_obspy.report.tables import write_columns
from per_obspy.screening.ranking import KEYS

#: Rows that are read and written together.
ROWS = 50_000

#: The rows in their order, with the rank before the other columns.
_ORDERED = f"""
    COPY (
        SELECT row_number() OVER () AS rank, * EXCLUDE ({", ".join(KEYS)})
        FROM (SELECT * FROM read_parquet($parts) ORDER BY {", ".join(KEYS)}, pair_id)
    ) TO $path (FORMAT parquet, ROW_GROUP_SIZE {ROWS}, KV_METADATA {{per_obspy: $said}})
"""


def write_risk(parts: Sequence[Path], folder: Path, facts: Mapping[str, str], csv_rows: int) -> list[Path]:
    """
    Write ``risk.parquet``, ``risk.csv`` and ``risk.columns.csv``, and return their paths.

    Parameters
    ----------
    parts : sequence of Path
        Parquet files with rows of the risk table and the columns ``KEYS``, by which they are ordered; at least one.
    folder : Path
        Where to.
    facts : mapping of str to str
        What the Parquet file says of the whole table, for example whether the motion is simulated.
    csv_rows : int
        How many rows ``risk.csv`` holds, the worst ones.
    """
    said = json.dumps({"version": version("per_obspy"), **facts})
    table, text, columns = (folder / name for name in ("risk.parquet", "risk.csv", "risk.columns.csv"))
    with bounded_database(folder) as database, written_whole(table) as part:
        database.execute(_ORDERED, {"parts": [str(one) for one in parts], "path": str(part), "said": said})
    write_worst(table, csv_rows, text)
    write_columns(pq.read_schema(table).names, columns)
    return [table, text, columns]


def ranked(path: Path, columns: Sequence[str] | None = None) -> Iterator[pd.DataFrame]:
    """Give the risk table in pieces, worst pair first; all columns or some."""
    with pq.ParquetFile(path) as table:
        for batch in table.iter_batches(ROWS, columns=columns):
            yield batch.to_pandas()
