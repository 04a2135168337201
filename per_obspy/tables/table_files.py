"""Tables as files: types and meanings of their columns, and the table of rejections."""

import csv
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import pandas as pd
import pyarrow as pa

from per_obspy.errors import Rejection, shortened
from per_obspy.files import written_whole
from per_obspy.inventory.files.text_cells import cell, cells
from per_obspy.inventory.schema import Column
from per_obspy.screening.columns import column_table, known_column

_TYPES = {"float64": pa.float64(), "int64": pa.int64(), "str": pa.string()}


def as_arrow(table: pd.DataFrame) -> pa.Table:
    """Convert a table to the column types of the schema, whatever rows it contains."""
    arrow = pa.Table.from_pandas(_plain(table), preserve_index=False)
    fields = [pa.field(field.name, _type(field)) for field in arrow.schema]
    return arrow.cast(pa.schema(fields))


def _plain(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table without its attributes, such as rejections, which have a separate file."""
    plain = table.copy(deep=False)
    plain.attrs = {}
    return plain


def _type(field: pa.Field) -> pa.DataType:
    """Return the type of a known column; others keep theirs, empty ones become text."""
    column = known_column(field.name)
    if column is not None:
        return _TYPES.get(column.dtype, field.type)
    is_text = pa.types.is_null(field.type) or pa.types.is_large_string(field.type)
    return pa.string() if is_text else field.type


def write_csv(table: pd.DataFrame, path: Path) -> None:
    """Write a table as CSV, with texts escaped that a spreadsheet takes for formulas."""
    with written_whole(path) as part:
        cells(table).to_csv(part, index=False)


def write_parquet(table: pd.DataFrame, path: Path) -> None:
    """Write a table as Parquet."""
    with written_whole(path) as part:
        _plain(table).to_parquet(part, index=False)


def write_columns(names: Iterable[str], path: Path) -> None:
    """Write unit and meaning of each of these columns, and of every flag."""
    write_csv(column_table(names), path)


def write_described(columns: Iterable[Column], path: Path) -> None:
    """Write name, unit and meaning of these columns."""
    rows = [(column.name, column.unit, column.meaning) for column in columns]
    write_csv(pd.DataFrame(rows, columns=["name", "unit", "meaning"]), path)


def write_rejected(rejected: Iterable[Rejection], path: Path) -> Counter[str]:
    """
    Write one row per rejection, its reasons separated by semicolons.

    Parameters
    ----------
    rejected : iterable of Rejection
        Taken one by one.
    path : Path
        The file.

    Returns
    -------
    Counter
        Number of rows of each kind.
    """
    kinds: Counter[str] = Counter()
    with written_whole(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(Rejection._fields)
        # Rejections of a large inventory are never in memory as a whole
        for rejection in rejected:
            kinds[rejection.kind] += 1
            reasons = "; ".join(map(shortened, rejection.reasons))
            kind, name, source, row, _ = rejection
            rows.writerow(map(cell, (kind, shortened(name), source, row, reasons)))
    return kinds
