"""
Parts of the risk table on disk, each in its order, and their rows joined in the order of the whole.

Only the columns of the order are sorted as a whole, by DuckDB. As every part is in that order
already, the next rows of the whole are always the next rows of the parts: they are read once, and
only some thousands of each part at a time.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from per_obspy.files import written_whole
from per_obspy.screening.ranking import KEYS
from per_obspy.tables.database import bounded_database
from per_obspy.tables.writing import as_arrow

#: Rows of a part that are read together: of a hundred parts they need about 800 MB.
TOGETHER = 10_000

#: In which part a row stands.
_PART = "order_part"

_ORDER = f"SELECT {_PART} FROM read_parquet($parts, union_by_name=true) ORDER BY {', '.join(KEYS)}, pair_id"


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
        Where to.
    """
    table = as_arrow(rows.assign(**{_PART: number}))
    with written_whole(path) as part:
        pq.write_table(
            table, part, row_group_size=TOGETHER, use_dictionary=text_columns(table.schema)
        )


def text_columns(schema: pa.Schema) -> list[str]:
    """Return the columns that gain from a dictionary; in numbers, which hardly repeat, it would be sought in vain."""
    return [field.name for field in schema if pa.types.is_string(field.type)]


def joined_schema(parts: Sequence[Path]) -> pa.Schema:
    """Return every column of the parts but those of the order; where types differ it is number or text."""
    found: dict[str, set[pa.DataType]] = {}
    for part in parts:
        for field in pq.read_schema(part):
            found.setdefault(field.name, set()).add(field.type)
    order = {*KEYS, _PART}
    return pa.schema([(name, _common(types)) for name, types in found.items() if name not in order])


def joined_rows(parts: Sequence[Path], schema: pa.Schema, size: int) -> Iterator[pa.Table]:
    """
    Give the rows of all parts in their order, so many at a time.

    Parameters
    ----------
    parts : sequence of Path
        From :func:`write_part`.
    schema : Schema
        From :func:`joined_schema`; columns that a part lacks are empty.
    size : int
        How many rows.
    """
    with bounded_database(parts[0].parent) as database:
        found = database.execute(_ORDER, {"parts": [str(part) for part in parts]}).fetchnumpy()
    order = np.asarray(found[_PART], dtype=np.int64)
    rows = {_number(part): _Rows(part, schema) for part in parts}
    for first in range(0, order.size, size):
        yield _next_rows(rows, order[first : first + size])


def _next_rows(rows: dict[int, "_Rows"], order: NDArray[np.int64]) -> pa.Table:
    numbers, counts = np.unique(order, return_counts=True)
    pieces = [
        rows[number].take(count)
        for number, count in zip(numbers.tolist(), counts.tolist(), strict=True)
    ]
    place = np.empty(order.size, dtype=np.int64)
    place[np.argsort(order, kind="stable")] = np.arange(order.size)
    return pa.concat_tables(pieces).take(place)


class _Rows:
    """The rows of a part from its first to its last; the file is not kept open."""

    def __init__(self, part: Path, schema: pa.Schema) -> None:
        self._left = schema.empty_table()
        self._groups = _groups(part, schema)

    def take(self, count: int) -> pa.Table:
        """Return the next rows."""
        while self._left.num_rows < count:
            self._left = pa.concat_tables([self._left, next(self._groups)])
        taken, self._left = self._left.slice(0, count), self._left.slice(count)
        return taken


def _groups(part: Path, schema: pa.Schema) -> Iterator[pa.Table]:
    for index in range(pq.read_metadata(part).num_row_groups):
        with pq.ParquetFile(part) as file:
            table = file.read_row_group(index, use_threads=False)
        table = table.drop_columns([*KEYS, _PART])
        yield table if table.schema.equals(schema) else _conforming(table, schema)


def _conforming(table: pa.Table, schema: pa.Schema) -> pa.Table:
    columns = [
        table[one.name].cast(one.type)
        if one.name in table.column_names
        else pa.nulls(table.num_rows, one.type)
        for one in schema
    ]
    return pa.table(columns, schema=schema)


def _number(part: Path) -> int:
    with pq.ParquetFile(part) as file:
        number: int = file.read_row_group(0, columns=[_PART])[_PART][0].as_py()
    return number


def _common(types: set[pa.DataType]) -> pa.DataType:
    """Return a type that holds values of all these."""
    if len(types) == 1:
        return next(iter(types))
    numbers = all(pa.types.is_integer(one) or pa.types.is_floating(one) for one in types)
    return pa.float64() if numbers else pa.string()
