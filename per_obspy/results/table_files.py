"""
Files of tables: CSV with rounded numbers and Parquet with described columns, written whole.

CSV files and workbooks have numbers of five significant digits, of two where the contact law
decides, and coordinates of seven decimals (a centimetre). Parquet files keep all digits. Columns
that the pair table brings along stay as they are: they may be identifiers.
"""

import csv
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray
from pandas.api.types import is_float_dtype

from per_obspy.checks import FloatArray
from per_obspy.errors import Rejection, shortened
from per_obspy.files import written_whole
from per_obspy.inventory.files.text_cells import cell, cells
from per_obspy.inventory.schema import Column
from per_obspy.screening.columns import BY_CONTACT, known_column

_TYPES = {"float64": pa.float64(), "int64": pa.int64(), "str": pa.string()}

#: Arrow type of a column of tables whose columns all are described.
_DESCRIBED = {**_TYPES, "bool": pa.bool_()}


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


def write_described(columns: Iterable[Column], path: Path) -> None:
    """Write name, unit and meaning of these columns."""
    rows = [(column.name, column.unit, column.meaning) for column in columns]
    write_csv(pd.DataFrame(rows, columns=["name", "unit", "meaning"]), path)


def write_rejected(rejected: Iterable[Rejection], path: Path) -> Counter[str]:
    """Write one row per rejection, its reasons separated by semicolons."""
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


#: Significant digits of numbers, of those by the contact law, and decimals of degrees.
DIGITS, CONTACT_DIGITS, DECIMALS = 5, 2, 7

#: Powers of ten that are exact as numbers: 10^22 is the largest.
_EXACT = 22


def rounded(values: FloatArray, digits: int = DIGITS) -> FloatArray:
    """
    Round numbers to significant digits.

    Parameters
    ----------
    values : (n,) ndarray
        Numbers; NaN and infinity stay.
    digits : int
        At least 1.

    Returns
    -------
    values : (n,) ndarray
        The numbers nearest to the decimal ones, so that they are written with these digits.

    Examples
    --------
    >>> print(rounded(np.array([0.123456789, 402888.8888, 0.0, np.inf, -1e-5])))
    [ 1.2346e-01  4.0289e+05  0.0000e+00         inf -1.0000e-05]
    """
    given = np.asarray(values, dtype=np.float64)
    usable = np.isfinite(given) & (given != 0.0)
    safe = np.where(usable, np.abs(given), 1.0)
    places = digits - 1 - np.floor(np.log10(safe)).astype(np.int64)
    # Multiplied or divided by an exact power of ten, a whole number gives the nearest number
    known = usable & (np.abs(places) <= _EXACT)
    usable, beyond = known, usable & ~known
    factor = 10.0 ** np.where(usable, np.abs(places), 0)
    whole = np.where(places >= 0, np.round(safe * factor), np.round(safe / factor))
    found = np.where(places >= 0, whole / factor, whole * factor)
    given = np.where(usable, np.copysign(found, given), given)
    # Few numbers are beyond these powers, such as a probability of 1e-30
    given[beyond] = [float(f"{value:.{digits - 1}e}") for value in given[beyond]]
    return given


def rounded_table(table: pd.DataFrame, own: Collection[str] = ()) -> pd.DataFrame:
    """
    Return a table whose known columns of numbers are rounded.

    Parameters
    ----------
    table : DataFrame
        It stays as it is.
    own : collection of str
        Further columns that the package has computed, and not the user brought along.
    """
    found = table.copy(deep=False)
    for position, name in enumerate(map(str, table.columns)):
        column = table.iloc[:, position]
        if is_float_dtype(column) and _is_own(name, own):
            found.isetitem(position, _rounded_column(name, column.to_numpy(np.float64)))
    return found


def rounded_arrow(table: pa.Table, own: Collection[str] = ()) -> pa.Table:
    """Return a table whose known columns of numbers are rounded; empty cells stay empty."""
    for position, field in enumerate(table.schema):
        if not pa.types.is_floating(field.type) or not _is_own(field.name, own):
            continue
        # Empty cells of a column without gaps are NaN here
        column = table[position].combine_chunks()
        numbers = column.to_numpy(zero_copy_only=False)
        found = _rounded_column(field.name, numbers)
        cells = pa.array(found, field.type, mask=column.is_null().to_numpy(zero_copy_only=False))
        table = table.set_column(position, field.name, cells)
    return table


def _is_own(name: str, own: Collection[str]) -> bool:
    """Return whether a column is defined by the package."""
    return name in own or known_column(name) is not None


def _rounded_column(name: str, numbers: FloatArray) -> NDArray[np.float64]:
    """Round the numbers of a column: coordinates to decimals, others to significant digits."""
    if name.startswith(("longitude", "latitude")):
        return np.asarray(np.round(numbers, DECIMALS))
    return rounded(numbers, CONTACT_DIGITS if name in BY_CONTACT else DIGITS)


def schema_of(columns: Iterable[Column], facts: Mapping[str, str] | None = None) -> pa.Schema:
    """Return the types of columns, and facts of the whole table as its metadata."""
    metadata = {} if facts is None else dict(facts)
    return pa.schema(
        [(column.name, _DESCRIBED[column.dtype]) for column in columns], metadata=metadata
    )


def table_of(values: Mapping[str, Any] | pd.DataFrame, columns: Sequence[Column]) -> pa.Table:
    """Return columns in the order and types of a schema; NaN is an empty cell."""
    arrays = [_array(values[column.name], column.dtype) for column in columns]
    return pa.table(arrays, schema=schema_of(columns))


def _array(values: Any, dtype: str) -> pa.Array:
    """Convert values to the type of their column."""
    if dtype == "str" and isinstance(values, pd.Series):
        # Texts of a frame are those of Arrow already
        return pa.Array.from_pandas(values, type=_DESCRIBED[dtype])
    numbers = np.asarray(values)
    if dtype != "int64":
        return pa.array(numbers, type=_DESCRIBED[dtype], from_pandas=True)
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
