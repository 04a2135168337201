"""Parquet tables, and columns of any type in the few types that every later table can hold."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet

from per_obspy.config import TableForm
from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import unreadable_reason
from per_obspy.inventory.files.headings import IDENTIFIER, Meanings, meanings_of
from per_obspy.inventory.files.raw_rows import Contents, RawRows

#: Prefix that pandas gives to a column of row numbers.
INDEX = "__index_level_"

#: Reason for which a row is left out.
NOT_UTF_8 = "{} is not UTF-8"


def open_parquet(file: Path, given: TableForm) -> Contents:
    """
    Open a Parquet table.

    Raises
    ------
    CatalogError
        If it cannot be read, lacks a configured column, or the names of its pairs are no text.
    """
    with _readable(file):
        schema = pa.parquet.read_schema(file.absolute())
        meanings = meanings_of(
            [name for name in schema.names if not name.startswith(INDEX)], given, str(file)
        )
        # Lists and the like are no names
        for heading, name in zip(meanings.cells, meanings.names, strict=True):
            if name == IDENTIFIER and pa.types.is_nested(schema.field(heading).type):
                pa.nulls(1, schema.field(heading).type).cast(pa.string())
    blocks = partial(_parquet_rows, file, meanings)
    return Contents(str(file), meanings, blocks, is_text=False)


def _parquet_rows(file: Path, meanings: Meanings, places: Sequence[int]) -> Iterator[RawRows]:
    """Yield the rows of some columns, with rejections of text that is not UTF-8."""
    columns = [meanings.cells[place] for place in places]
    identifier = dict(zip(meanings.names, meanings.cells, strict=True)).get(IDENTIFIER)
    line = 2  # as if the file had a header
    # Relative names such as http:/x are addresses to the reader
    with _readable(file), pa.parquet.ParquetFile(file.absolute(), pre_buffer=False) as stored:
        for batch in stored.iter_batches(columns=columns):
            table, faults = plain_columns(pa.Table.from_batches([batch]).select(columns))
            broken = []
            for row, fault in faults.items():
                pair = str(table[identifier][row]) if identifier in columns else ""
                broken.append(Rejection("pair", pair, str(file), line + row, (fault,)))
            good = np.delete(np.arange(len(table)), list(faults))
            yield RawRows(str(file), table.take(good), line + good, tuple(broken))
            line += len(table)


@contextmanager
def _readable(file: Path) -> Iterator[None]:
    """Turn a fault of the reader into one of the file."""
    try:
        yield
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        problem = unreadable_reason(file, "Parquet table", error)
        raise CatalogError(str(file), problem) from error


def plain_columns(table: pa.Table) -> tuple[pa.Table, dict[int, str]]:
    """
    Return a table of numbers, truth values, text, dates and times of day, and faults of its text.

    Parameters
    ----------
    table : Table
        Any columns: lists, maps, bytes and the like become text as Python prints them.

    Returns
    -------
    plain : Table
        The same names and rows.
    faults : dict
        Position of a row -> why it cannot be used: text that is not UTF-8, whose bytes have become
        question marks.
    """
    columns, faults = list[pa.ChunkedArray](), dict[int, str]()
    for field, column in zip(table.schema, table.columns, strict=True):
        plain = _plain(column)
        # Text may be any bytes
        if pa.types.is_string(plain.type) and not _is_utf_8(plain):
            plain, wrong = _decoded(plain)
            for row in wrong:
                faults.setdefault(row, NOT_UTF_8.format(field.name))
        columns.append(plain)
    return pa.table(columns, names=table.column_names), faults


def _plain(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """Return a column in a plain type."""
    kind = column.type
    # Other forms of the same text or number
    if pa.types.is_dictionary(kind):
        return _plain(pc.cast(column, kind.value_type))
    if pa.types.is_decimal(kind) or pa.types.is_float16(kind) or pa.types.is_uint64(kind):
        return column.cast(pa.float64(), safe=False)
    if pa.types.is_large_string(kind) or pa.types.is_string_view(kind):
        return column.cast(pa.string())
    # Plain types stay, everything else becomes text
    is_number = pa.types.is_boolean(kind) or pa.types.is_integer(kind) or pa.types.is_floating(kind)
    is_date = pa.types.is_date(kind) or pa.types.is_timestamp(kind)
    if is_number or is_date or pa.types.is_string(kind) or pa.types.is_null(kind):
        return column
    texts = [None if value is None else str(value) for value in column.to_pylist()]
    return pa.chunked_array([pa.array(texts, pa.string())])


def _is_utf_8(column: pa.ChunkedArray) -> bool:
    """Return whether every text of a column can be decoded."""
    try:
        column.validate(full=True)
    except pa.ArrowInvalid:
        return False
    return True


def _decoded(column: pa.ChunkedArray) -> tuple[pa.ChunkedArray, list[int]]:
    """Return a column with question marks for undecodable bytes, and the rows that have them."""
    texts, wrong = list[str | None](), list[int]()
    for row, text in enumerate(column.cast(pa.binary()).to_pylist()):
        # Good text comes back the same
        decoded = None if text is None else text.decode("utf-8", "replace")
        if decoded is not None and decoded.encode() != text:
            wrong.append(row)
        texts.append(decoded)
    return pa.chunked_array([pa.array(texts, pa.string())]), wrong
