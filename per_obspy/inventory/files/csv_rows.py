"""Pairs in a CSV file as blocks of raw rows, with the line of each and with the lines that are no rows."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
from numpy.typing import NDArray

from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.files.csv_text import (
    check_separator,
    check_text,
    line_breaks,
    open_quotation,
)
from per_obspy.inventory.files.raw_rows import IDENTIFIER, RawRows
from per_obspy.inventory.schema import COLUMNS, EMPTY


class CsvFile:
    """Pairs in a CSV file: every cell is read as text, so that each bad value can be named."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self._quoted = check_text(file)
        with self._readable():
            self._raw_names = list(
                pa.csv.open_csv(file, _ORDERED, _skipping(lambda _: "skip")).schema.names
            )
        check_separator(file, self._raw_names)
        self.names: Sequence[str] = [name.strip() for name in self._raw_names]
        if len(set(self.names)) < len(self.names):
            twice = next(name for name in self.names if self.names.count(name) > 1)
            raise CatalogError(str(file), f"column {twice} stands more than once")

    @cached_property
    def _kinds(self) -> dict[str, pa.DataType | None]:
        """What kind of number each column is that the schema does not know; None for text."""
        kinds: dict[str, list[pa.DataType]] = {
            n: [pa.int64(), pa.float64()] for n in self.names if n not in COLUMNS
        }
        for batch in self._batches([], *kinds) if kinds else ():
            for name, cells in zip(kinds, batch.columns, strict=True):
                kinds[name] = [kind for kind in kinds[name] if _as_numbers(cells, kind) is not None]
        return {name: possible[0] if possible else None for name, possible in kinds.items()}

    def identifiers(self) -> Iterator[pa.Array]:
        """Give the names of the pairs, block by block."""
        for batch in self._batches([], IDENTIFIER):
            yield batch.column(0)

    def rows(self, size: int) -> Iterator[RawRows]:
        """Give the rows, so many at a time; lines without any content are left out."""
        broken: list[Rejection] = []
        row = 2
        swallowed = 0
        for table in _regrouped(self._batches(broken, *self.names), size):
            rows = _lines(row, len(table), broken)
            breaks = line_breaks(table) if self._quoted else np.zeros(len(table), dtype=np.int64)
            row = int(rows[-1]) + 1
            offset = swallowed + np.concatenate([[0], np.cumsum(breaks)])
            lines, swallowed = rows + offset[:-1], int(offset[-1])
            before = [_moved(one, rows, offset) for one in _taken(broken, row)]
            before += self._torn(table, lines, breaks)
            full = _has_content(table) & (breaks == 0)
            cells = pa.table({name: self._as_kind(name, table[name]) for name in self.names})
            yield RawRows(str(self.file), cells.filter(pa.array(full)), lines[full], tuple(before))
        if broken:
            nothing = pa.table({name: pa.array([], pa.string()) for name in self.names})
            left = tuple(one._replace(row=(one.row or 0) + swallowed) for one in broken)
            yield RawRows(str(self.file), nothing, np.zeros(0, np.int64), left)

    def _torn(
        self, table: pa.Table, lines: NDArray[np.int64], breaks: NDArray[np.int64]
    ) -> Iterator[Rejection]:
        """Give the rows that have swallowed lines, which may have been rows themselves."""
        for i in np.flatnonzero(breaks).tolist():
            cells = {name: table[name][i].as_py() for name in self.names}
            column = next(name for name, cell in cells.items() if "\n" in cell)
            lost = sum(cell.rstrip("\n").count("\n") for cell in cells.values())
            reason = f"{column} has a line break: is a quotation mark not closed? {lost} further lines are lost"
            yield Rejection("pair", cells[IDENTIFIER], str(self.file), int(lines[i]), (reason,))

    def _as_kind(self, name: str, cells: pa.ChunkedArray) -> pa.ChunkedArray:
        """Return cells as numbers where all are; otherwise the text, whose faults are named later."""
        if name in COLUMNS:
            return (
                cells if COLUMNS[name].dtype == "str" else _as_numbers(cells, pa.float64()) or cells
            )
        return cells if self._kinds[name] is None else _as_numbers(cells, self._kinds[name])

    def _batches(self, broken: list[Rejection], *names: str) -> Iterator[pa.RecordBatch]:
        """Give some columns as text, and add lines that are no rows to a list as they are met."""

        def skip(row: pa.csv.InvalidRow) -> str:
            reason = f"{row.actual_columns} columns, the header has {row.expected_columns}"
            broken.append(
                Rejection("pair", row.text.split(",")[0], str(self.file), row.number, (reason,))
            )
            return "skip"

        raw = [self._raw_names[self.names.index(name)] for name in names]
        with self._readable():
            reader = pa.csv.open_csv(
                self.file,
                read_options=_ORDERED,
                parse_options=_skipping(skip),
                convert_options=pa.csv.ConvertOptions(
                    column_types=dict.fromkeys(raw, pa.string()), include_columns=raw
                ),
            )
            for batch in reader:
                yield batch.rename_columns(list(names))

    @contextmanager
    def _readable(self) -> Iterator[None]:
        try:
            yield
        except pa.ArrowInvalid as error:
            raise CatalogError(
                str(self.file), open_quotation(self.file) or f"not a CSV table: {error}"
            ) from error


#: With threads, rows have no numbers.
_ORDERED = pa.csv.ReadOptions(use_threads=False)


def _skipping(handler: Callable[[pa.csv.InvalidRow], str]) -> pa.csv.ParseOptions:
    return pa.csv.ParseOptions(ignore_empty_lines=False, invalid_row_handler=handler)


def _regrouped(batches: Iterable[pa.RecordBatch], size: int) -> Iterator[pa.Table]:
    """Give the same rows, so many at a time."""
    waiting: list[pa.RecordBatch] = []
    for batch in batches:
        waiting.append(batch)
        while sum(map(len, waiting)) >= size:
            table = pa.Table.from_batches(waiting)
            waiting = table.slice(size).to_batches()
            yield table.slice(0, size)
    if sum(map(len, waiting)):
        yield pa.Table.from_batches(waiting)


def _lines(first: int, count: int, broken: list[Rejection]) -> NDArray[np.int64]:
    """Return the lines of so many rows, leaving out those that are no rows."""
    gone = [one.row for one in broken if one.row is not None]
    lines: NDArray[np.int64] = np.setdiff1d(np.arange(first, first + count + len(gone)), gone)[
        :count
    ]
    return lines


def _taken(broken: list[Rejection], line: int) -> tuple[Rejection, ...]:
    """Return the broken lines before a line, and take them off the list."""
    before = tuple(one for one in broken if one.row is not None and one.row < line)
    del broken[: len(before)]
    return before


def _moved(rejection: Rejection, rows: NDArray[np.int64], offset: NDArray[np.int64]) -> Rejection:
    """Return a broken line at its place in the file: line breaks in the cells before it count."""
    row = rejection.row or 0
    return rejection._replace(row=row + int(offset[np.searchsorted(rows, row)]))


def _has_content(table: pa.Table) -> NDArray[np.bool_]:
    full = np.zeros(len(table), dtype=bool)
    for column in table.columns:
        full |= np.asarray(pc.not_equal(column, ""))
    return full


def _as_numbers(cells: pa.ChunkedArray | pa.Array, kind: pa.DataType) -> pa.ChunkedArray | None:
    """Return text as numbers if every cell is one or is empty."""
    text = pc.utf8_trim_whitespace(cells)
    empty = pc.is_in(pc.utf8_lower(text), value_set=_NOTHING)
    try:
        return pc.cast(pc.if_else(empty, None, text), kind)
    except pa.ArrowInvalid:
        return None


_NOTHING = pa.array(sorted(EMPTY))
