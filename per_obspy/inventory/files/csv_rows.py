"""
CSV files of pairs as blocks of raw rows.

Each row has its line in the file, and lines that are no rows become rejections.
"""

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
    """
    Pairs in a CSV file.

    Every cell is read as text, so that a message can contain a bad value as it is in the file.
    """

    def __init__(self, file: Path) -> None:
        self.file = file
        self._quoted = check_text(file)
        # Names of the columns from the header
        options = _skipping(lambda _: "skip")
        with self._readable():
            self._raw_names = list(pa.csv.open_csv(file, _ORDERED, options).schema.names)
        check_separator(file, self._raw_names)
        self.names: Sequence[str] = [name.strip() for name in self._raw_names]
        if len(set(self.names)) < len(self.names):
            twice = next(name for name in self.names if self.names.count(name) > 1)
            raise CatalogError(str(file), f"column {twice} stands more than once")

    @cached_property
    def _number_types(self) -> dict[str, pa.DataType | None]:
        """Return the type of number of each column unknown to the schema; None for text."""
        unknown = [name for name in self.names if name not in COLUMNS]
        possible: dict[str, list[pa.DataType]] = {
            name: [pa.int64(), pa.float64()] for name in unknown
        }
        # Drop every type that a cell contradicts
        for batch in self._batches([], *unknown) if unknown else ():
            for name, cells in zip(unknown, batch.columns, strict=True):
                types = possible[name]
                possible[name] = [kind for kind in types if _as_numbers(cells, kind) is not None]
        return {name: types[0] if types else None for name, types in possible.items()}

    def identifiers(self) -> Iterator[pa.Array]:
        """Yield the identifiers of the pairs, block by block."""
        for batch in self._batches([], IDENTIFIER):
            yield batch.column(0)

    def rows(self, size: int) -> Iterator[RawRows]:
        """Yield blocks of so many rows; lines without any content are left out."""
        broken: list[Rejection] = []
        next_row = 2
        swallowed = 0
        for table in _regrouped(self._batches(broken, *self.names), size):
            # Rows as the reader counts them, without those that it skipped
            rows = _row_numbers(next_row, len(table), broken)
            next_row = int(rows[-1]) + 1
            # Lines in the file: the line breaks inside the cells before a row are added
            breaks = line_breaks(table) if self._quoted else np.zeros(len(table), dtype=np.int64)
            offset = swallowed + np.concatenate([[0], np.cumsum(breaks)])
            lines, swallowed = rows + offset[:-1], int(offset[-1])
            # Lines that are no rows, and rows that may contain other lines
            rejected = [_moved(line, rows, offset) for line in _taken(broken, next_row)]
            rejected += self._torn(table, lines, breaks)
            yield self._block(table, lines, breaks, tuple(rejected))
        if broken:
            yield self._block_without_rows(broken, swallowed)

    def _block(
        self,
        table: pa.Table,
        lines: NDArray[np.int64],
        breaks: NDArray[np.int64],
        rejected: tuple[Rejection, ...],
    ) -> RawRows:
        """Return the rows with content and without line breaks, numbers converted."""
        full = _has_content(table) & (breaks == 0)
        cells = pa.table({name: self._converted(name, table[name]) for name in self.names})
        return RawRows(str(self.file), cells.filter(pa.array(full)), lines[full], rejected)

    def _block_without_rows(self, broken: list[Rejection], swallowed: int) -> RawRows:
        """Return the broken lines after the last row, counting line breaks in cells before them."""
        empty = pa.table({name: pa.array([], pa.string()) for name in self.names})
        moved = [line._replace(row=(line.row or 0) + swallowed) for line in broken]
        return RawRows(str(self.file), empty, np.zeros(0, np.int64), tuple(moved))

    def _torn(
        self, table: pa.Table, lines: NDArray[np.int64], breaks: NDArray[np.int64]
    ) -> Iterator[Rejection]:
        """Yield the rows whose cells contain further lines, which may have been rows themselves."""
        for i in np.flatnonzero(breaks).tolist():
            cells = {name: table[name][i].as_py() for name in self.names}
            column = next(name for name, cell in cells.items() if "\n" in cell)
            # A break at the end of a cell contains no line
            contained = sum(cell.rstrip("\n").count("\n") for cell in cells.values())
            fault = f"{column} has a line break: is a quotation mark not closed?"
            reason = f"{fault} {contained} further lines are lost"
            yield Rejection("pair", cells[IDENTIFIER], str(self.file), int(lines[i]), (reason,))

    def _converted(self, name: str, cells: pa.ChunkedArray) -> pa.ChunkedArray:
        """Return a column as numbers if every cell is one, else as text for the checks to come."""
        if name not in COLUMNS:
            kind = self._number_types[name]
            return cells if kind is None else _as_numbers(cells, kind)
        if COLUMNS[name].dtype == "str":
            return cells
        return _as_numbers(cells, pa.float64()) or cells

    def _batches(self, broken: list[Rejection], *names: str) -> Iterator[pa.RecordBatch]:
        """Yield columns as text, and append lines that are no rows to a list as they are met."""

        def skip(row: pa.csv.InvalidRow) -> str:
            reason = f"{row.actual_columns} columns, the header has {row.expected_columns}"
            identifier = row.text.split(",")[0]
            broken.append(Rejection("pair", identifier, str(self.file), row.number, (reason,)))
            return "skip"

        # The header may have blanks around names
        raw = [self._raw_names[self.names.index(name)] for name in names]
        as_text = pa.csv.ConvertOptions(
            column_types=dict.fromkeys(raw, pa.string()), include_columns=raw
        )
        with self._readable():
            reader = pa.csv.open_csv(
                self.file,
                read_options=_ORDERED,
                parse_options=_skipping(skip),
                convert_options=as_text,
            )
            for batch in reader:
                yield batch.rename_columns(list(names))

    @contextmanager
    def _readable(self) -> Iterator[None]:
        """Turn a fault of the reader into one of the file."""
        try:
            yield
        except pa.ArrowInvalid as error:
            problem = open_quotation(self.file) or f"not a CSV table: {error}"
            raise CatalogError(str(self.file), problem) from error


#: With threads, the reader does not number the rows.
_ORDERED = pa.csv.ReadOptions(use_threads=False)


def _skipping(handler: Callable[[pa.csv.InvalidRow], str]) -> pa.csv.ParseOptions:
    """Return options that keep empty lines and hand lines that are no rows to a function."""
    return pa.csv.ParseOptions(ignore_empty_lines=False, invalid_row_handler=handler)


def _regrouped(batches: Iterable[pa.RecordBatch], size: int) -> Iterator[pa.Table]:
    """Yield the same rows in tables of so many rows."""
    pending: list[pa.RecordBatch] = []
    for batch in batches:
        pending.append(batch)
        while sum(map(len, pending)) >= size:
            table = pa.Table.from_batches(pending)
            pending = table.slice(size).to_batches()
            yield table.slice(0, size)
    if sum(map(len, pending)):
        yield pa.Table.from_batches(pending)


def _row_numbers(first: int, count: int, broken: list[Rejection]) -> NDArray[np.int64]:
    """Return the numbers of so many rows from the first on, leaving out the skipped lines."""
    skipped = [line.row for line in broken if line.row is not None]
    numbers = np.arange(first, first + count + len(skipped))
    rows: NDArray[np.int64] = np.setdiff1d(numbers, skipped)[:count]
    return rows


def _taken(broken: list[Rejection], row: int) -> tuple[Rejection, ...]:
    """Remove the skipped lines before a row from their list and return them."""
    taken = tuple(line for line in broken if line.row is not None and line.row < row)
    del broken[: len(taken)]
    return taken


def _moved(rejection: Rejection, rows: NDArray[np.int64], offset: NDArray[np.int64]) -> Rejection:
    """Return a skipped line with its line in the file, counting line breaks in cells before it."""
    row = rejection.row or 0
    return rejection._replace(row=row + int(offset[np.searchsorted(rows, row)]))


def _has_content(table: pa.Table) -> NDArray[np.bool_]:
    """Return the rows that have text in any cell."""
    full = np.zeros(len(table), dtype=bool)
    for column in table.columns:
        full |= np.asarray(pc.not_equal(column, ""))
    return full


def _as_numbers(cells: pa.ChunkedArray | pa.Array, kind: pa.DataType) -> pa.ChunkedArray | None:
    """Return text as numbers if every cell is empty or a number, else None."""
    text = pc.utf8_trim_whitespace(cells)
    empty = pc.is_in(pc.utf8_lower(text), value_set=_EMPTY_WORDS)
    try:
        return pc.cast(pc.if_else(empty, None, text), kind)
    except pa.ArrowInvalid:
        return None


#: Words for an empty cell.
_EMPTY_WORDS = pa.array(sorted(EMPTY))
