"""
CSV files of pairs as blocks of raw rows.

Each row has its line in the file, and lines that are no rows become rejections: every line of the
file is in one of them, or blank.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
from numpy.typing import NDArray

from per_obspy.config import TableForm
from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.cells import CellForm, bare_name
from per_obspy.inventory.files.csv_lines import (
    LONGEST_NAME,
    Layout,
    RowLines,
    header_names,
    row_lines,
)
from per_obspy.inventory.files.raw_rows import RawRows, cell_form, with_values
from per_obspy.inventory.files.text_cells import given_text, given_texts
from per_obspy.inventory.recognition.column_meanings import IDENTIFIER
from per_obspy.inventory.recognition.decimal_marks import (
    evidence_of,
    has_quoted_commas,
    marks_of,
    two_readings,
    with_points,
)
from per_obspy.inventory.recognition.encodings import TURKISH, two_pages
from per_obspy.inventory.recognition.table_form import text_form
from per_obspy.inventory.schema import COLUMNS, EMPTY

#: The default: the form of a table is recognised, not configured.
PLAIN = TableForm()


class CsvFile:
    """
    Pairs in a CSV file.

    Every cell is read as text, so that a message can contain a bad value as it is in the file.

    Parameters
    ----------
    file : Path
        Text of any form that :func:`~.table_form.text_form` recognises.
    given : TableForm
        Form of the table as configured by the user.
    language : str
        Of headings that had other names before; empty if it is that of the header.
    """

    def __init__(self, file: Path, given: TableForm = PLAIN, language: str = "") -> None:
        self.file, self._given, self._language = file, given, language
        form = text_form(file, given)
        self._form = form
        self._layout = Layout(
            form.lines, form.header, form.separator, form.encoding, form.header_end
        )
        self.headings = header_names(file, self._layout)
        self.meanings = form.meanings
        self._columns = [given_text(name.strip()) for name in form.meanings.names]
        # Spreadsheets leave columns without a name
        self.names: Sequence[str] = [name for name in self._columns if name]

    @property
    def own_names(self) -> list[str]:
        """Names of the columns as the file has them, in the order of ``names``."""
        pairs = zip(self.headings, self._columns, strict=True)
        return [given_text(heading.strip()) for heading, column in pairs if column]

    @property
    def recognised(self) -> str:
        """Recognised peculiarities of the file, empty if there are none; reads the whole file."""
        return "; ".join(text for text in (self._form.sentence(), self.recognised_numbers) if text)

    @property
    def recognised_numbers(self) -> str:
        """Description of columns with decimal commas, or commas between thousands."""
        # Columns by their decimal mark
        commas = [name for name, mark in self._marks.items() if mark == ","]
        thousands = [name for name, mark in self._marks.items() if mark == "."]
        texts = [f"decimal commas in {', '.join(commas)}"] if commas else []
        texts += [f"commas between thousands in {', '.join(thousands)}"] if thousands else []
        return "; ".join(texts)

    def check_cells(self) -> None:
        """Raise CatalogError if a cell can be read in two ways, or rows exceed the header."""
        _ = self._marks
        if self._layout.separator != ",":
            return
        # Decimal commas between commas make more cells, in every row
        first = next(self._blocks(self.names[:1]))
        counts = [
            re.match(r"(\d+) columns, the header has", row.reasons[0]) for row in first.broken
        ]
        wide = [found and int(found[1]) > len(self._columns) for found in counts]
        if len(first.lines) == 0 and wide and all(wide):
            reason = f"no row has as many columns as the header ({first.broken[0].reasons[0]})"
            mend = "separate columns by semicolons, or put cells with commas in quotation marks"
            raise CatalogError(str(self.file), f"{reason}, as decimal commas make: {mend}")

    @cached_property
    def _marks(self) -> dict[str, str]:
        """
        Return the decimal mark of each column of numbers that has commas.

        Raises
        ------
        CatalogError
            If a number may be read in two ways, or a text of a known column may be.
        """
        self._check_letters()
        # Between commas only quoted numbers can have one
        if self._layout.separator == "," and not has_quoted_commas(self.file, self._form.encoding):
            return {}
        blocks = self._blocks(self._known(is_text=False))
        evidence = evidence_of((rows.table, rows.lines.tolist()) for rows in blocks)
        if self._given.decimal:
            commas = [name for name, found in evidence.items() if found.has_commas]
            return dict.fromkeys(commas, self._given.decimal)
        # The user has to decide if no number in the file does
        marks, doubtful = marks_of(evidence)
        if doubtful:
            raise CatalogError(str(self.file), two_readings(*next(iter(doubtful.items()))))
        return marks

    def _known(self, is_text: bool) -> list[str]:
        """Return the columns of the schema that hold text, or numbers."""
        known = [name for name in self.names if name in COLUMNS]
        return [name for name in known if (COLUMNS[name].dtype == "str") == is_text]

    def _check_letters(self) -> None:
        """Raise CatalogError if the text of a known column depends on the code page."""
        names = self._known(is_text=True)
        for rows in self._blocks(names) if self._form.is_doubtful else ():
            for name, cells in zip(names, rows.table.columns, strict=True):
                # The first cell with a letter that is another one in Turkey
                is_other = pc.match_substring_regex(cells, f"[{TURKISH}]")
                place = pc.index(is_other, True).as_py()
                if place >= 0:
                    problem = two_pages(name, cells[place].as_py())
                    raise CatalogError(str(self.file), f"line {rows.lines[place]}: {problem}")

    @cached_property
    def _number_types(self) -> dict[str, pa.DataType | None]:
        """Return the type of number of each column unknown to the schema; None for text."""
        unknown = [name for name in self.names if name not in COLUMNS]
        possible: dict[str, list[pa.DataType]] = {
            name: [pa.int64(), pa.float64()] for name in unknown
        }
        # Drop every type that a cell contradicts
        for block in self._blocks(unknown) if unknown else ():
            for name, cells in zip(unknown, block.table.columns, strict=True):
                types = possible[name]
                possible[name] = [kind for kind in types if _as_numbers(cells, kind) is not None]
        return {name: types[0] if types else None for name, types in possible.items()}

    def identifiers(self) -> Iterator[pa.Array]:
        """Yield the identifiers of the pairs, block by block."""
        is_named = IDENTIFIER in self.names
        for block in self._blocks([IDENTIFIER] if is_named else self.names[:1]):
            names = given_texts(block.table.column(0)).combine_chunks()
            yield names if is_named else pa.nulls(len(names), pa.string())

    def rows(self, size: int, are_pairs: bool = True) -> Iterator[RawRows]:
        """
        Yield blocks of so many rows; lines without any content are left out.

        Rows of pairs have values by the schema; others have text where a cell is no number.
        """
        for rows in _regrouped(self._blocks(self.names), size):
            # Numbers and texts as far as they are plain, then values
            full = _has_content(rows.table)
            cells = {name: self._converted(name, rows.table[name]) for name in self.names}
            table = pa.table(cells).filter(pa.array(full))
            table = with_values(table, self._cell_form) if are_pairs else table
            yield rows._replace(table=table, lines=rows.lines[full])

    @cached_property
    def _cell_form(self) -> CellForm:
        """Return how the cells are written; reads the gaps of the whole file."""
        blocks = self._blocks(["gap"]) if "gap" in self.names else ()
        form = cell_form(self.meanings, (rows.table["gap"] for rows in blocks), self._marks)
        return form._replace(language=form.language or self._language)

    def _converted(self, name: str, cells: pa.ChunkedArray) -> pa.ChunkedArray:
        """Return a column as numbers if every cell is one, else as text."""
        if name not in COLUMNS:
            kind = self._number_types[name]
            return given_texts(cells) if kind is None else _as_numbers(cells, kind)
        if COLUMNS[name].dtype == "str":
            return given_texts(cells)
        # Commas between storeys may make a list
        mark = self._marks.get(name) if bare_name(name) != "storeys" else None
        points = with_points(cells, mark) if mark else cells
        numbers = _as_numbers(points, pa.float64())
        return points if numbers is None else numbers

    def _blocks(self, names: Sequence[str]) -> Iterator[RawRows]:
        """Yield these columns as text, some thousands of rows at a time, and the broken lines."""
        # Columns by their position, as names may be anything
        columns = [str(position) for position in range(len(self._columns))]
        chosen = [columns[self._columns.index(name)] for name in names]
        options = pa.csv.ConvertOptions(
            column_types=dict.fromkeys(chosen, pa.string()), include_columns=chosen
        )
        for rows in row_lines(self.file, self._columns, self._layout):
            table, skipped = _parsed(rows.text, columns, options, self._layout.separator)
            lines = np.delete(rows.numbers, list(skipped))
            # Every line that was given is a row or a broken one
            if len(table) != lines.size:
                problem = f"line {rows.numbers[0]} and the next ones make no rows"
                raise CatalogError(str(self.file), problem)
            broken = tuple(self._broken(rows, skipped))
            yield RawRows(str(self.file), table.rename_columns(list(names)), lines, broken)

    def _broken(self, rows: RowLines, skipped: dict[int, pa.csv.InvalidRow]) -> list[Rejection]:
        """Return the broken lines and those with too few or too many cells, in their order."""
        broken = [*rows.broken]
        for position, invalid in skipped.items():
            line = int(rows.numbers[position])
            broken.append(_rejection(self.file, line, invalid, self._layout.separator))
        return sorted(broken, key=lambda line: line.row or 0)


def _parsed(
    text: bytes, columns: list[str], options: pa.csv.ConvertOptions, separator: str
) -> tuple[pa.Table, dict[int, pa.csv.InvalidRow]]:
    """Return rows as a table of text, and the invalid ones by their position."""
    skipped: dict[int, pa.csv.InvalidRow] = {}

    def skip(row: pa.csv.InvalidRow) -> str:
        skipped[row.number - 1] = row
        return "skip"

    if not text:
        empty = [pa.array([], pa.string()) for _ in options.include_columns]
        return pa.table(empty, names=options.include_columns), skipped
    # With threads, the reader does not number the rows; a block is read in one piece
    reading = pa.csv.ReadOptions(use_threads=False, column_names=columns, block_size=len(text) + 1)
    parsing = pa.csv.ParseOptions(
        delimiter=separator, ignore_empty_lines=False, invalid_row_handler=skip
    )
    table = pa.csv.read_csv(pa.BufferReader(text), reading, parsing, options)
    return table, skipped


def _rejection(file: Path, line: int, row: pa.csv.InvalidRow, separator: str) -> Rejection:
    """Return the rejection of a line with too few or too many cells."""
    reason = f"{row.actual_columns} columns, the header has {row.expected_columns}"
    name = row.text.split(separator)[0][:LONGEST_NAME]
    return Rejection("pair", name, str(file), line, (reason,))


def _regrouped(blocks: Iterable[RawRows], size: int) -> Iterator[RawRows]:
    """Yield the same rows in blocks of so many, each with the broken lines before its end."""
    pending: list[RawRows] = []
    for block in blocks:
        pending.append(block)
        if sum(len(rows.lines) for rows in pending) < size:
            continue
        # Enough rows for a block or several; the rest waits
        whole = _together(pending)
        first = 0
        while len(whole.lines) - first >= size:
            yield _part(whole, first, first + size)
            first += size
        pending = [_part(whole, first, None)]
    if any(len(rows.lines) or rows.broken for rows in pending):
        yield _together(pending)


def _together(blocks: Sequence[RawRows]) -> RawRows:
    """Return consecutive blocks as a single one."""
    table = pa.concat_tables([rows.table for rows in blocks])
    lines = np.concatenate([rows.lines for rows in blocks])
    broken = tuple(line for rows in blocks for line in rows.broken)
    return RawRows(blocks[0].source, table, lines, broken)


def _part(rows: RawRows, first: int, end: int | None) -> RawRows:
    """Return rows from the first to before the end, with the broken lines between them."""
    # A broken line goes with the row after it
    last_before = rows.lines[first - 1] if first else 0
    last = np.inf if end is None else rows.lines[end - 1]
    broken = [line for line in rows.broken if last_before < (line.row or 0) < last]
    length = None if end is None else end - first
    table = rows.table.slice(first, length)
    return RawRows(rows.source, table, rows.lines[first:end], tuple(broken))


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
