"""
Pairs in a sheet of a workbook, transcribed once to a plain table.

Each row of the sheet is one line of a temporary CSV file, so that everything after it is as with
any table, and the line of a row is its number in the sheet.
"""

import csv
import shutil
import weakref
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from tempfile import mkdtemp

import pyarrow as pa

from per_obspy.config import TableForm
from per_obspy.errors import CatalogError, printable
from per_obspy.files import writing
from per_obspy.inventory.files.csv_rows import PLAIN, CsvFile
from per_obspy.inventory.files.raw_rows import RawRows
from per_obspy.inventory.recognition.column_meanings import Meanings, meanings_of
from per_obspy.inventory.recognition.headings import is_complete
from per_obspy.inventory.recognition.table_form import HEADER_LINES
from per_obspy.inventory.recognition.workbook import (
    cells_without_value,
    sheet_list,
    sheet_rows,
    workbook_sheets,
)


class _Found:
    """A sheet with the row of its header and the meanings of its columns."""

    def __init__(self, sheet: str, header: int, meanings: Meanings) -> None:
        self.sheet, self.header, self.meanings = sheet, header, meanings
        self.names = {means.column for means in meanings.columns.values()}


class WorkbookFile:
    """
    Pairs in a workbook (.xlsx, .xlsm).

    Parameters
    ----------
    file : Path
        The workbook.
    given : TableForm
        Sheet, names and units of the user.

    Raises
    ------
    CatalogError
        If it cannot be read, or more than one sheet has a pair table and none is named.
    """

    def __init__(self, file: Path, given: TableForm = PLAIN) -> None:
        self.file, self._given = file, given
        self._found = _found_sheet(file, given)
        self.source = f"{file}, sheet {self._found.sheet!r}"
        self.meanings = meanings_of(self._found.meanings.cells, given, self.source)
        self.headings = self.meanings.cells
        self.names: Sequence[str] = [name for name in self.meanings.names if name]

    @property
    def recognised(self) -> str:
        """Sheet, names and units."""
        found = self._found
        header = f" with the header in row {found.header}" if found.header > 1 else ""
        texts = [f"sheet {found.sheet!r}{header}", self.meanings.sentence()]
        # Numbers that are text may have decimal commas
        with self._named():
            texts.append(self._table.recognised_numbers)
        return "; ".join(text for text in texts if text)

    def check_cells(self) -> None:
        """Raise CatalogError for numbers that can be read in two ways or were never computed."""
        with self._named():
            self._table.check_cells()

    def identifiers(self) -> Iterator[pa.Array]:
        """Yield the identifiers of the pairs, block by block."""
        with self._named():
            yield from self._table.identifiers()

    def rows(self, size: int) -> Iterator[RawRows]:
        """Yield blocks of so many rows."""
        with self._named():
            for rows in self._table.rows(size):
                broken = tuple(line._replace(source=self.source) for line in rows.broken)
                yield rows._replace(source=self.source, broken=broken)

    @cached_property
    def _path(self) -> Path:
        """The transcribed table, in a folder that is removed with this object."""
        folder = mkdtemp(prefix="per-obspy-")
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        return Path(folder, "sheet.csv")

    @cached_property
    def _table(self) -> CsvFile:
        """The sheet as a plain table, whose lines are the rows of the sheet."""
        self._check_values()
        # Rows above the header become blank lines
        path = self._path
        names, header = self.meanings.names, self._found.header
        rows = sheet_rows(self.file, self._found.sheet, len(names))
        with writing(path), path.open("w", encoding="utf-8", errors="replace", newline="") as text:
            writer = csv.writer(text, lineterminator="\n")
            for number, cells in enumerate(rows, 1):
                if number <= header:
                    writer.writerow(names if number == header else [])
                    continue
                writer.writerow([_on_one_line(cell) for cell in cells])
        # The names are those of the schema now, the numbers as they were
        units = {name: unit.name for name, unit in self.meanings.units.items()}
        form = TableForm(encoding="utf-8", separator=",", units=units, **self._mark)
        return CsvFile(path, form, self.meanings.language)

    @property
    def _mark(self) -> dict[str, str]:
        """The decimal mark of numbers that are text, if it is configured."""
        return {"decimal": self._given.decimal} if self._given.decimal else {}

    def _check_values(self) -> None:
        """Raise CatalogError if a cell of a known column is a formula that was never computed."""
        # Columns of the sheet are counted from 1
        known = {place + 1: means.column for place, means in self.meanings.columns.items()}
        for row, column in cells_without_value(self.file, self._found.sheet):
            if row > self._found.header and column in known:
                reason = f"row {row}, {known[column]}: a formula without a stored value"
                mend = "open the workbook in a spreadsheet program and save it"
                raise CatalogError(self.source, f"{reason}: {mend}")

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Name the workbook and its sheet in errors of the transcribed table."""
        try:
            yield
        except CatalogError as error:
            if error.source != str(self._path):
                raise
            raise CatalogError(self.source, error.problem) from error


def _on_one_line(cell: str) -> str:
    """Return a cell without line breaks."""
    return " ".join(cell.splitlines()) if not cell.isprintable() else cell


def _filled(cells: Sequence[str]) -> Sequence[str]:
    """Return the cells of a row up to the last one with text."""
    last = max((place for place, cell in enumerate(cells, 1) if cell), default=0)
    return cells[:last]


def _found_sheet(file: Path, given: TableForm) -> _Found:
    """Return the sheet that is named, else the only one that has a pair table."""
    sheets = {sheet.name: sheet.head for sheet in workbook_sheets(file, HEADER_LINES)}
    names = [name for name in sheets if given.sheet in (None, name)]
    found = [_with_header(name, sheets[name], given, file) for name in names if sheets[name]]
    if not found:
        reason = f"no sheet {given.sheet!r:.60} with cells" if given.sheet else "no sheet has cells"
        raise CatalogError(str(file), f"{reason}; there are {sheet_list(sheets)}")
    # Of several pair tables the user chooses one
    whole = [sheet for sheet in found if is_complete(sheet.names)]
    if len(whole) > 1:
        tables = sheet_list(sheet.sheet for sheet in whole)
        mend = f'give sheet = "{whole[0].sheet}" or another one in [pairs]'
        raise CatalogError(str(file), f"{len(whole)} sheets have a pair table, {tables}: {mend}")
    # Without a suitable sheet take that with most columns; missing ones are reported later
    return max(whole or found, key=lambda sheet: len(sheet.names))


def _with_header(sheet: str, head: Sequence[Sequence[str]], given: TableForm, file: Path) -> _Found:
    """Return a sheet with the row whose cells mean most columns, the first filled one else."""
    # Headings of workbooks often have line breaks
    rows = [
        (number, [" ".join(printable(cell).split()) for cell in _filled(cells)])
        for number, cells in enumerate(head, 1)
        if cells
    ]
    found = [
        _Found(sheet, number, meanings_of(cells, given, str(file), must_have=False))
        for number, cells in rows
    ]
    return max(found, key=lambda row: len(row.names))
