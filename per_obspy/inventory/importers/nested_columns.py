"""Nested columns of GeoParquet files of known sources as plain ones."""

import json
from typing import Any

import pyarrow as pa

#: Fields of the box around a feature, which the geometry gives anyway.
_BOX = {"xmin", "ymin", "xmax", "ymax"}


def without_nesting(table: pa.Table) -> pa.Table:
    """
    Return a table with the nested columns of Overture Maps as text, and without bounding boxes.

    Parameters
    ----------
    table : Table
        ``names`` becomes its field ``primary``, ``sources`` the ``dataset`` of its first row, a map
        becomes a text of JSON, and a structure with the fields of a box is left out. Other columns
        stay as they are.
    """
    for name in table.column_names:
        kind = table.schema.field(name).type
        fields = {field.name for field in kind} if pa.types.is_struct(kind) else set()
        if fields >= _BOX:
            table = table.drop_columns([name])
        elif texts := _texts(table, name, fields):
            table = _replaced(table, name, texts)
    return table


def _texts(table: pa.Table, name: str, fields: set[str]) -> list[str | None]:
    """Return the cells of a nested column of a known source as text; none of other columns."""
    kind = table.schema.field(name).type
    if name == "names" and "primary" in fields:
        return [_field(row, "primary") for row in _rows(table, name)]
    if name == "sources" and pa.types.is_list(kind):
        firsts = [row[0] if row else None for row in _rows(table, name)]
        return [_field(row, "dataset") for row in firsts]
    # Tags
    if pa.types.is_map(kind):
        return [None if row is None else json.dumps(dict(row)) for row in _rows(table, name)]
    return []


def _rows(table: pa.Table, name: str) -> list[Any]:
    """Return the cells of a column as Python has them."""
    cells: list[Any] = table[name].to_pylist()
    return cells


def _field(row: object, name: str) -> str | None:
    """Return a field of a structure as text."""
    value = row.get(name) if isinstance(row, dict) else None
    return None if value is None else str(value)


def _replaced(table: pa.Table, name: str, texts: list[str | None]) -> pa.Table:
    """Return the table with a column of text in place of a nested one."""
    number = table.column_names.index(name)
    return table.set_column(number, name, pa.array(texts, pa.string()))
