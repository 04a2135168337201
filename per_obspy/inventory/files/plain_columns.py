"""Columns of Parquet files in the few types that every later table can hold."""

import pyarrow as pa
import pyarrow.compute as pc

#: Reason for which a row is left out.
NOT_UTF_8 = "{} is not UTF-8"


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
