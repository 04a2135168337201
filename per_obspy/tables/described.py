"""Tables of one schema: types of the columns, and the file of their meanings."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from per_obspy.inventory.schema import Column
from per_obspy.tables.table_files import write_described

_TYPES = {"float64": pa.float64(), "int64": pa.int64(), "str": pa.string(), "bool": pa.bool_()}


def schema_of(columns: Iterable[Column], facts: Mapping[str, str] | None = None) -> pa.Schema:
    """Return the types of columns, and facts of the whole table as its metadata."""
    metadata = {} if facts is None else dict(facts)
    return pa.schema([(column.name, _TYPES[column.dtype]) for column in columns], metadata=metadata)


def table_of(values: Mapping[str, Any] | pd.DataFrame, columns: Sequence[Column]) -> pa.Table:
    """Return columns in the order and types of a schema; NaN is an empty cell."""
    arrays = [_array(np.asarray(values[column.name]), column.dtype) for column in columns]
    return pa.table(arrays, schema=schema_of(columns))


def _array(values: Any, dtype: str) -> pa.Array:
    """Convert values to the type of their column."""
    if dtype != "int64":
        return pa.array(values, type=_TYPES[dtype], from_pandas=True)
    numbers = np.asarray(values)
    empty = np.isnan(numbers) if numbers.dtype.kind == "f" else np.zeros(numbers.shape, dtype=bool)
    return pa.array(np.where(empty, 0, numbers).astype(np.int64), mask=empty)


def regrouped(tables: Iterable[pa.Table], schema: pa.Schema, size: int) -> Iterator[pa.Table]:
    """
    Yield the rows of tables in groups of a constant number.

    A Parquet file that is written piece by piece depends on the size of the pieces.
    """
    waiting = schema.empty_table()
    for table in tables:
        waiting = pa.concat_tables([waiting, table.replace_schema_metadata(schema.metadata)])
        # Full pieces; the rest waits for the next table
        while waiting.num_rows >= size:
            yield waiting.slice(0, size).combine_chunks()
            waiting = waiting.slice(size)
    if waiting.num_rows:
        yield waiting.combine_chunks()


def write_meanings(columns: Sequence[Column], flags: Mapping[str, str], path: Path) -> None:
    """Write name, unit and meaning of columns, and one row ``flag_...`` per flag."""
    noted = [Column(f"flag_{name}", "str", "", meaning) for name, meaning in flags.items()]
    write_described([*columns, *noted], path)
