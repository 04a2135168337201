"""Tables as files: the types of their columns, what these mean, and what was left out."""

import csv
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import pandas as pd
import pyarrow as pa

from per_obspy.errors import Rejection
from per_obspy.files import written_whole
from per_obspy.inventory.schema import Column
from per_obspy.screening.columns import column_table, known_column


def as_arrow(table: pd.DataFrame) -> pa.Table:
    """Return a table whose columns have the types of the schema, whatever rows it happens to hold."""
    plain = table.copy(deep=False)
    plain.attrs = {}
    arrow = pa.Table.from_pandas(plain, preserve_index=False)
    return arrow.cast(pa.schema([pa.field(one.name, _type(one)) for one in arrow.schema]))


_TYPES = {"float64": pa.float64(), "int64": pa.int64(), "str": pa.string()}


def _type(field: pa.Field) -> pa.DataType:
    """Return the type of a known column; of others what they hold, text if that is nothing."""
    known = known_column(field.name)
    if known is not None:
        return _TYPES.get(known.dtype, field.type)
    return (
        pa.string()
        if pa.types.is_null(field.type) or pa.types.is_large_string(field.type)
        else field.type
    )


def write_columns(names: Iterable[str], path: Path) -> None:
    """Write unit and meaning of each of these columns, and of every flag."""
    with written_whole(path) as part:
        column_table(names).to_csv(part, index=False)


def write_described(columns: Iterable[Column], path: Path) -> None:
    """Write name, unit and meaning of these columns."""
    rows = [(column.name, column.unit, column.meaning) for column in columns]
    with written_whole(path) as part:
        pd.DataFrame(rows, columns=["name", "unit", "meaning"]).to_csv(part, index=False)


def write_rejected(rejected: Iterable[Rejection], path: Path) -> Counter[str]:
    """Write what was left out, one row a thing, its reasons separated by semicolons; return how many of each kind."""
    kinds: Counter[str] = Counter()
    with written_whole(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(Rejection._fields)
        for one in rejected:
            kinds[one.kind] += 1
            rows.writerow((*one[:-1], "; ".join(one.reasons)))
    return kinds
