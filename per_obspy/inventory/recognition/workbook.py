"""
Sheets of workbooks (.xlsx) as rows of text, within limits that no hostile file can pass.

Formulas are read as the values that the spreadsheet program stored; macros, links to other files
and pictures are never opened. The parts of the file are looked at before the library reads them:
their sizes, the number and length of rows, document types, formulas without a value.
"""

import re
import warnings
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import date, time, timedelta
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from per_obspy.errors import CatalogError, require_extra, shortened
from per_obspy.files import looks_like

#: Largest unpacked size of a sheet, of the table of texts, and of any other part that is read,
#: bytes: the library keeps texts and styles in memory, and reads sheets row by row.
LARGEST_SHEET, LARGEST_TEXTS, LARGEST_PART = 1 << 30, 32 << 20, 2 << 20

#: Longest row, bytes of its XML; most rows, as spreadsheet programs have; most sheets.
LONGEST_ROW, MOST_ROWS, MOST_SHEETS = 2 << 20, 1 << 20, 100

#: Most columns that are read.
MOST_COLUMNS = 1000

#: Replacement for the names of sheets in messages.
_LONGEST_LIST = 200

_ROW = re.compile(rb"<(?:\w+:)?row[\s/>]")
_ROW_END = re.compile(rb"</(?:\w+:)?row>")

#: A cell whose formula has no value behind it.
_NO_VALUE = re.compile(
    rb'<(?:\w+:)?c\b[^>]*?\br="([A-Z]{1,3})(\d{1,7})"[^>]*>\s*<(?:\w+:)?f\b[^<]*'
    rb"(?:/>|</(?:\w+:)?f>)\s*(?:<(?:\w+:)?v\s*/>|<(?:\w+:)?v>\s*</(?:\w+:)?v>)?\s*</(?:\w+:)?c>"
)

#: Errors of the library and the archive for damaged files.
_DAMAGES = (
    zipfile.BadZipFile,
    zlib.error,
    SyntaxError,  # of XML
    EOFError,
    OSError,
    RuntimeError,
    NotImplementedError,
    KeyError,
    IndexError,
    ValueError,
    TypeError,
    AttributeError,
    AssertionError,
    ArithmeticError,
)


class Sheet(NamedTuple):
    """
    One sheet of a workbook.

    Attributes
    ----------
    name : str
        In the workbook.
    head : tuple of tuple of str
        Its first rows, cells as text; blank rows have none.
    """

    name: str
    head: tuple[tuple[str, ...], ...]


def workbook_sheets(file: Path, rows: int) -> list[Sheet]:
    """
    Return the sheets of a workbook with their first rows.

    Parameters
    ----------
    file : Path
        Workbook.
    rows : int
        Number of rows of each.

    Raises
    ------
    CatalogError
        If it is damaged, or larger than the limits.
    MissingExtra
        If the library for workbooks is not installed.
    """
    with _opened(file) as book:
        if len(book.worksheets) > MOST_SHEETS:
            problem = f"{len(book.worksheets)} sheets, at most {MOST_SHEETS} are read"
            raise CatalogError(str(file), problem)
        return [
            Sheet(sheet.title, tuple(_rows(sheet, rows, MOST_COLUMNS))) for sheet in book.worksheets
        ]


def sheet_rows(file: Path, name: str, columns: int) -> Iterator[tuple[str, ...]]:
    """
    Yield the rows of a sheet in so many columns, cells as text; blank rows have none.

    Raises
    ------
    CatalogError
        If it is damaged or larger than the limits.
    """
    with _opened(file) as book:
        (sheet,) = (sheet for sheet in book.worksheets if sheet.title == name)
        yield from _rows(sheet, MOST_ROWS, columns)


def cells_without_value(file: Path, name: str) -> Iterator[tuple[int, int]]:
    """Yield row and column (from 1) of cells of a sheet whose formula was never computed."""
    # The part of the file that is the sheet
    with _opened(file) as book:
        (sheet,) = (sheet for sheet in book.worksheets if sheet.title == name)
        part = sheet._worksheet_path
    with _readable(file), zipfile.ZipFile(file) as archive:
        for text in _row_texts(file, archive, archive.getinfo(part)):
            for cell in _NO_VALUE.finditer(text):
                yield int(cell[2]), _column_number(cell[1].decode())


def _column_number(letters: str) -> int:
    """Return the number of a column, from 1."""
    number = 0
    for letter in letters:
        number = 26 * number + ord(letter) - ord("A") + 1
    return number


@contextmanager
def _opened(file: Path) -> Iterator[Any]:
    """Open a workbook whose parts are within the limits."""
    require_extra("spreadsheet", "openpyxl")
    import openpyxl

    with _readable(file), warnings.catch_warnings():
        # The library warns of everything that it leaves out
        warnings.simplefilter("ignore")
        _check_parts(file)
        options = {"read_only": True, "data_only": True, "keep_links": False}
        book = openpyxl.load_workbook(file, **options)
        try:
            yield book
        finally:
            book.close()


@contextmanager
def _readable(file: Path) -> Iterator[None]:
    """Turn a fault of the library into one of the file."""
    try:
        yield
    except CatalogError:  # a ValueError as well
        raise
    except _DAMAGES as error:
        kind = looks_like(file)
        if kind and "ZIP" not in kind:
            hint = ", or one with a password" if "old Excel" in kind else ""
            raise CatalogError(str(file), f"not a workbook (.xlsx): it is {kind}{hint}") from error
        reason = shortened(f"{type(error).__name__} {error}", 200)
        raise CatalogError(str(file), f"not a readable workbook (.xlsx): {reason}") from error


def _check_parts(file: Path) -> None:
    """Raise CatalogError if a part of the workbook is larger than the limits."""
    with zipfile.ZipFile(file) as archive:
        for part in archive.infolist():
            name = PurePosixPath(part.filename)
            if name.suffix not in (".xml", ".rels") or name.name.startswith("externalLink"):
                continue
            # A sheet may have any name: a large part is a sheet, or is not read
            if "sharedstrings" in name.name.lower():
                limit = LARGEST_TEXTS
            else:
                limit = LARGEST_SHEET if "sheet" in part.filename.lower() else LARGEST_PART
            if part.file_size > limit:
                size = f"{part.file_size >> 20} MB unpacked, at most {limit >> 20} MB are read"
                raise CatalogError(str(file), f"{part.filename} has {size}")
            _check_part(file, archive, part, limit == LARGEST_SHEET)


def _check_part(
    file: Path, archive: zipfile.ZipFile, part: zipfile.ZipInfo, is_sheet: bool
) -> None:
    """Raise CatalogError for a document type, and for too many or too long rows of a sheet."""
    with archive.open(part) as stream:
        head = stream.read(4096)
    # Entities can be larger than any file; text in UTF-16 would hide them
    if b"<!" in head.replace(b"<!--", b"") or b"\0" in head:
        raise CatalogError(str(file), f"{part.filename} has a document type or zero bytes")
    if is_sheet and part.file_size > LARGEST_PART:
        count = sum(len(_ROW.findall(text)) for text in _row_texts(file, archive, part))
        if count > MOST_ROWS:
            raise CatalogError(str(file), f"{part.filename} has {count} rows, at most {MOST_ROWS}")


def _row_texts(file: Path, archive: zipfile.ZipFile, part: zipfile.ZipInfo) -> Iterator[bytes]:
    """Yield the XML of a sheet in pieces that end with rows."""
    rest = b""
    with archive.open(part) as stream:
        while block := stream.read(1 << 18):
            # Text after the last whole row waits for its end
            rest += block
            ends = [end.end() for end in _ROW_END.finditer(rest)]
            if ends:
                yield rest[: ends[-1]]
                rest = rest[ends[-1] :]
            elif len(rest) > LONGEST_ROW:
                problem = f"{part.filename} has a row of more than {LONGEST_ROW >> 20} MB"
                raise CatalogError(str(file), problem)
    yield rest


def _rows(sheet: Any, rows: int, columns: int) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a sheet until the last one with a cell."""
    blank, known = 0, None
    for row in sheet.iter_rows(max_row=rows, max_col=columns, values_only=True):
        # Rows that the sheet leaves out are all the same object
        if row is known or all(value is None for value in row):
            blank, known = blank + 1, row
            continue
        yield from ((),) * blank
        blank = 0
        yield tuple(map(_text, row))


def _text(value: object) -> str:
    """Return a cell as the text that a plain table would have."""
    if value is None:
        return ""
    if isinstance(value, date | time | timedelta):
        return str(value)
    return repr(value) if isinstance(value, float) else str(value)


def sheet_list(names: Iterable[str]) -> str:
    """Return names of sheets for a message."""
    return shortened(", ".join(repr(name) for name in names), _LONGEST_LIST)
