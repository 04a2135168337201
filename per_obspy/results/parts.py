"""
Parts of the risk table on disk, each in its order, and their rows joined in the order of the whole.

Only the columns of the order are sorted as a whole, by DuckDB, whose memory is bounded and which
leaves to the disk rows that do not fit. As every part is in that order already, the next rows of
the whole are always the next rows of the parts: only some thousands of each part are read at a
time. Many parts are merged in several passes, so that memory does not grow with their number.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import NamedTuple

import duckdb
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from pyarrow.dataset import Dataset, dataset
from pyarrow.fs import LocalFileSystem

from per_obspy.errors import MachineFault, PerError
from per_obspy.files import temporary_folder, written_whole
from per_obspy.results.table_files import as_arrow
from per_obspy.screening.ranking import KEYS
from per_obspy.termination import interrupted_by_signals, raise_swallowed_end

#: Memory of the database for ordering.
MEMORY = "1GB"

#: Rows of a part that are read together, about 8 MB.
TOGETHER = 10_000

#: Parts that are read side by side; more of them are merged to longer ones first.
MOST_PARTS = 64

#: Errors that a query ends with: of the database, of what reads its rows, of what they are for.
_ENDS = (duckdb.Error, pa.ArrowException, PerError, OSError, RuntimeError, ValueError)

#: Column with the number of the part to which a row belongs.
_PART = "order_part"


class Order(NamedTuple):
    """Order of rows."""

    #: As a database takes it.
    by: str
    #: Columns on which it depends.
    columns: tuple[str, ...]
    #: Those of them that only parts have.
    of_parts: tuple[str, ...] = ()


#: Pairs, the worst first.
WORST_FIRST = Order(", ".join((*KEYS, "pair_id")), (*KEYS, "pair_id"), KEYS)


@contextmanager
def bounded_database(folder: Path) -> Iterator[duckdb.DuckDBPyConnection]:
    """
    Yield a database of bounded memory, which leaves the rest to a temporary folder inside.

    Raises
    ------
    MachineFault
        If the machine has less memory than the database needs.
    Terminated, KeyboardInterrupt
        If a signal ends the program: the query ends at once.
    """
    with temporary_folder(folder) as room:
        settings: dict[str, str | bool | int | float | list[str]] = {
            "memory_limit": MEMORY,
            "temp_directory": str(room),
        }
        with duckdb.connect(config=settings) as database:
            # Otherwise columns without empty cells are marked so when there is one part, and not
            # when there are two
            database.execute("SET disabled_optimizers = 'statistics_propagation'")
            try:
                # Without this its threads go on with the query, which waits for them
                with interrupted_by_signals(database.interrupt):
                    yield database
            except _ENDS as error:
                raise_swallowed_end(error)
                if _is_out_of_memory(error):
                    reason = f"{folder}: not enough memory to join the rows"
                    raise MachineFault(reason) from error
                raise


def _is_out_of_memory(error: Exception) -> bool:
    """Return whether a database had too little memory; its streams report all as OSError."""
    by_stream = isinstance(error, OSError) and "Out of Memory Error" in str(error)
    return by_stream or isinstance(error, duckdb.OutOfMemoryException)


def parquet_rows(files: Sequence[Path], columns: Sequence[str] | None = None) -> Dataset:
    """
    Return Parquet files for a database, which reads them row by row.

    Databases take signs such as ``[``, ``*`` and ``?`` in a path for wildcards, and would read
    other files than these.
    """
    schema = pq.read_schema(files[0].absolute())
    if columns is not None:
        schema = pa.schema([schema.field(name) for name in columns])
    paths = [str(file.absolute()) for file in files]
    return dataset(paths, schema=schema, format="parquet", filesystem=LocalFileSystem())


def batches(database: duckdb.DuckDBPyConnection, query: str, size: int) -> Iterator[pa.RecordBatch]:
    """Yield the rows of a query, so many at a time."""
    yield from database.sql(query).to_arrow_reader(size)


def write_part(rows: pd.DataFrame, number: int, path: Path) -> None:
    """
    Write a part.

    Parameters
    ----------
    rows : DataFrame
        In their order, with the columns ``KEYS`` and ``pair_id``.
    number : int
        Of the part, another one for each.
    path : Path
        The file.
    """
    write_ordered(as_arrow(rows), number, path)


def write_ordered(table: pa.Table, number: int, path: Path) -> None:
    """Write a part of a table that is in some order, with its number."""
    dictionaries = text_columns(table.schema)
    table = table.append_column(_PART, pa.array(np.full(table.num_rows, number)))
    with written_whole(path) as part:
        pq.write_table(table, part, row_group_size=TOGETHER, use_dictionary=dictionaries)


#: Columns of texts that hardly repeat within a group.
_NAMES = {
    "pair_id", "row_id", "rows", "worst_pair", "worst_neighbour", "prevention", "building_id",
    *(f"building_id_{end}" for end in ("1", "2", "left", "right")),
}  # fmt: skip


def text_columns(schema: pa.Schema) -> list[str]:
    """Return the columns of text that a dictionary makes smaller."""
    texts = (field.name for field in schema if pa.types.is_string(field.type))
    return [name for name in texts if name not in _NAMES]


def joined_schema(parts: Sequence[Path]) -> pa.Schema:
    """Return the schema of all parts without the columns of the order; types are reconciled."""
    types: dict[str, set[pa.DataType]] = {}
    for part in parts:
        for field in pq.read_schema(part.absolute()):
            types.setdefault(field.name, set()).add(field.type)
    order = {*KEYS, _PART}
    return pa.schema([(name, _common(kinds)) for name, kinds in types.items() if name not in order])


def joined_rows(
    parts: Sequence[Path], schema: pa.Schema, size: int, order: Order = WORST_FIRST
) -> Iterator[pa.Table]:
    """
    Yield the rows of all parts in their order, so many at a time.

    Parameters
    ----------
    parts : sequence of Path
        From :func:`write_part`, or :func:`write_ordered` in another order.
    schema : Schema
        From :func:`joined_schema`; columns that a part lacks are empty.
    size : int
        Number of rows.
    order : Order
        Of all parts and of the whole.
    """
    with temporary_folder(parts[0].parent) as room:
        for level in count():
            if len(parts) <= MOST_PARTS:
                break
            parts = _merged_groups(parts, schema, room / str(level), order)
        yield from _merged(parts, schema, size, order)


def _merged_groups(
    parts: Sequence[Path], schema: pa.Schema, room: Path, order: Order
) -> list[Path]:
    """Merge many parts to fewer and longer ones in a folder of their own."""
    room.mkdir()
    # Columns of the order are needed once more, with the number of the longer part
    keys = [pq.read_schema(parts[0].absolute()).field(name) for name in order.of_parts]
    kept, merged = pa.schema([*schema, *keys]), []
    whole = kept.append(pa.field(_PART, pa.int64()))
    for number, first in enumerate(range(0, len(parts), MOST_PARTS)):
        merged.append(room / f"{number:06}.parquet")
        with pq.ParquetWriter(merged[-1], whole, use_dictionary=text_columns(whole)) as writer:
            # As a part of a chunk: in its order, a few thousand rows per group
            for rows in _merged(parts[first : first + MOST_PARTS], kept, TOGETHER, order):
                numbers = pa.array(np.full(rows.num_rows, number))
                writer.write_table(rows.append_column(whole.field(_PART), numbers))
    return merged


def _merged(
    parts: Sequence[Path], schema: pa.Schema, size: int, order: Order
) -> Iterator[pa.Table]:
    """Yield the rows of few parts in their order, so many at a time."""
    rows = {part_number(part): WaitingRows(part_rows(part, schema), schema) for part in parts}
    # For each row of the whole the part in which it is the next one
    left = np.empty(0, np.int64)
    for numbers in parts_in_order(parts, size, order):
        left = np.concatenate([left, numbers])
        # The database gives batches of fewer rows than are asked for
        while left.size >= size:
            yield next_rows(rows, left[:size])
            left = left[size:]
    if left.size:
        yield next_rows(rows, left)


def parts_in_order(
    parts: Sequence[Path], size: int, order: Order = WORST_FIRST
) -> Iterator[NDArray[np.int64]]:
    """Yield the number of the part of each row in the order of the whole, at most so many."""
    with bounded_database(parts[0].parent) as database:
        database.register("parts", _one_after_another(parts, [_PART, *order.columns]))
        query = f"SELECT {_PART} FROM parts ORDER BY {order.by}"
        for batch in batches(database, query, size):
            yield np.asarray(batch[_PART], dtype=np.int64)


def _one_after_another(parts: Sequence[Path], names: Sequence[str]) -> pa.RecordBatchReader:
    """Return some columns of all parts, once; a dataset would read many parts ahead."""
    schema = pq.read_schema(parts[0].absolute())
    some = pa.schema([schema.field(name) for name in names])
    rows = (batch for part in parts for batch in _columns(part, some))
    return pa.RecordBatchReader.from_batches(some, rows)


def _columns(part: Path, schema: pa.Schema) -> Iterator[pa.RecordBatch]:
    """Yield some columns of a part, some thousands of rows at a time."""
    with pq.ParquetFile(part.absolute(), pre_buffer=False) as file:
        for batch in file.iter_batches(TOGETHER, columns=schema.names, use_threads=False):
            yield pa.RecordBatch.from_arrays([batch[name] for name in schema.names], schema=schema)


def next_rows(rows: dict[int, "WaitingRows"], order: NDArray[np.int64]) -> pa.Table:
    """Take the next rows of each part and return them in the order of the whole."""
    numbers, counts = np.unique(order, return_counts=True)
    taken = zip(numbers.tolist(), counts.tolist(), strict=True)
    pieces = [rows[number].take(count) for number, count in taken]
    # Row i of the whole is row place[i] of the pieces one after the other
    place = np.empty(order.size, dtype=np.int64)
    place[np.argsort(order, kind="stable")] = np.arange(order.size)
    return pa.concat_tables(pieces).take(place)


class WaitingRows:
    """
    Rows of one part in order, read as they are taken.

    Parameters
    ----------
    groups : iterator of Table
        Consecutive rows.
    schema : Schema
        Of all groups.
    """

    def __init__(self, groups: Iterator[pa.Table], schema: pa.Schema) -> None:
        self._left = schema.empty_table()
        self._groups = groups

    def take(self, count: int) -> pa.Table:
        """Return the next rows."""
        while self._left.num_rows < count:
            self._left = pa.concat_tables([self._left, next(self._groups)])
        taken, self._left = self._left.slice(0, count), self._left.slice(count)
        return taken


def part_rows(part: Path, schema: pa.Schema) -> Iterator[pa.Table]:
    """Yield the rows of a part with the columns of the whole; the file is closed between reads."""
    for index in range(pq.read_metadata(part.absolute()).num_row_groups):
        with pq.ParquetFile(part.absolute(), pre_buffer=False) as file:
            # The file makes its schema anew whenever it is asked for
            known = set(file.schema_arrow.names)
            names = [name for name in schema.names if name in known]
            table = file.read_row_group(index, columns=names, use_threads=False)
        yield table if table.schema.equals(schema) else _conforming(table, schema)


def _conforming(table: pa.Table, schema: pa.Schema) -> pa.Table:
    """Return a table with the columns and types of a schema; missing columns are empty."""
    columns = []
    for field in schema:
        if field.name in table.column_names:
            columns.append(table[field.name].cast(field.type))
        else:
            columns.append(pa.nulls(table.num_rows, field.type))
    return pa.table(columns, schema=schema)


def part_number(part: Path) -> int:
    """Return the number of a part."""
    with pq.ParquetFile(part.absolute(), pre_buffer=False) as file:
        number: int = file.read_row_group(0, columns=[_PART])[_PART][0].as_py()
    return number


def _common(types: set[pa.DataType]) -> pa.DataType:
    """Return a common type of columns: equal types as they are, else a number, else text."""
    if len(types) == 1:
        return next(iter(types))
    numbers = all(pa.types.is_integer(kind) or pa.types.is_floating(kind) for kind in types)
    return pa.float64() if numbers else pa.string()
