"""
The risk table on disk: parts of an inventory joined, worst pair first, without ever being in memory as a whole.

DuckDB orders the rows; what does not fit its memory goes to the disk.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import duckdb
import pandas as pd
import pyarrow.parquet as pq

from per_obspy.files import written_whole
from per_obspy.report.tables import write_columns
from per_obspy.screening.ranking import KEYS

#: Memory for ordering.
MEMORY = "1GB"

#: Rows that are read and written together.
ROWS = 50_000


#: The rows in their order, with the rank before the other columns.
_ORDERED = f"""
    COPY (
        SELECT row_number() OVER () AS rank, * EXCLUDE ({", ".join(KEYS)})
        FROM (SELECT * FROM read_parquet($parts) ORDER BY {", ".join(KEYS)}, pair_id)
    ) TO $path (FORMAT parquet, ROW_GROUP_SIZE {ROWS}, KV_METADATA {{per_obspy: $said}})
"""

_WORST = "COPY (SELECT * FROM read_parquet($table) WHERE rank <= $rows ORDER BY rank) TO $path (FORMAT csv, HEADER)"


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
    with TemporaryDirectory(dir=folder) as room:
        settings: dict[str, str | bool | int | float | list[str]] = {"memory_limit": MEMORY, "temp_directory": room}
        with duckdb.connect(config=settings) as database, written_whole(table) as part:
            # else columns without empty cells are marked so when there is one part, and not when there are two
            database.execute("SET disabled_optimizers = 'statistics_propagation'")
            database.execute(_ORDERED, {"parts": [str(one) for one in parts], "path": str(part), "said": said})
        with duckdb.connect(config=settings) as database, written_whole(text) as part:
            database.execute(_WORST, {"table": str(table), "rows": csv_rows, "path": str(part)})
    write_columns(pq.read_schema(table).names, columns)
    return [table, text, columns]


def ranked(path: Path, columns: Sequence[str] | None = None) -> Iterator[pd.DataFrame]:
    """Give the risk table in pieces, worst pair first; all columns or some."""
    with pq.ParquetFile(path) as table:
        for batch in table.iter_batches(ROWS, columns=columns):
            yield batch.to_pandas()
