"""Tables too large for memory: DuckDB orders and joins them, and what does not fit its memory goes to the disk."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import duckdb

from per_obspy.files import written_whole

#: Memory for ordering.
MEMORY = "1GB"

_WORST = "COPY (SELECT * FROM read_parquet($table) WHERE rank <= $rows ORDER BY rank) TO $path (FORMAT csv, HEADER)"


@contextmanager
def bounded_database(folder: Path) -> Iterator[duckdb.DuckDBPyConnection]:
    """Give a database whose memory is bounded; a room in the folder takes the rest, and is gone afterwards."""
    with TemporaryDirectory(dir=folder) as room:
        settings: dict[str, str | bool | int | float | list[str]] = {
            "memory_limit": MEMORY,
            "temp_directory": room,
        }
        with duckdb.connect(config=settings) as database:
            # else columns without empty cells are marked so when there is one part, and not when
            # there are two
            database.execute("SET disabled_optimizers = 'statistics_propagation'")
            yield database


def write_worst(table: Path, rows: int, path: Path) -> None:
    """Write the rows of a ranked Parquet table up to a rank as CSV."""
    with bounded_database(path.parent) as database, written_whole(path) as part:
        database.execute(_WORST, {"table": str(table), "rows": rows, "path": str(part)})
