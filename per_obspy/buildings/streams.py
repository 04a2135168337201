"""Tables of any length that are ordered by a database of bounded memory, and read in pieces."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import duckdb
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.tables.parts import batches, bounded_database

#: Rows of a group of a Parquet file.
GROUP = 10_000

#: Threads of the database: one needs a quarter less processor time than two.
THREADS = 1


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
        rows = stored.iter_batches(GROUP, use_threads=False)
        yield pa.RecordBatchReader.from_batches(stored.schema_arrow, rows)


def tables_of(database: duckdb.DuckDBPyConnection, query: str, size: int) -> Iterator[pa.Table]:
    """Yield the rows of a query as tables of some rows each."""
    for batch in batches(database, query, size):
        yield pa.Table.from_batches([batch])


def whole_groups(tables: Iterable[pa.Table], name: str) -> Iterator[pa.Table]:
    """
    Yield the rows of tables cut only where a number changes.

    Parameters
    ----------
    tables : iterable of Table
        At least one, none of them empty.
    name : str
        Column of the numbers, which never fall.
    """
    waiting = list[pa.Table]()
    for table in tables:
        number = table[name].to_numpy()
        last = waiting[-1][name][-1].as_py() if waiting else number[0]
        # The last group may go on in the next table
        whole = int(np.searchsorted(number, number[-1]))
        if whole or number[0] != last:
            yield pa.concat_tables([*waiting, table.slice(0, whole)]).combine_chunks()
            waiting = []
        waiting.append(table.slice(whole))
    yield pa.concat_tables(waiting).combine_chunks()
