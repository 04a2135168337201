"""
Workbooks (.xlsx, .xlsm, .xlsb, .xls, .ods): the sheet of pairs as rows of text.

Formulas are read as the values that the spreadsheet program stored; macros, links to other files
and pictures are never opened. The parts of a file are looked at before the library reads them, in
a process of its own, within limits that no hostile file can pass.
"""

import math
import posixpath
import re
import zipfile
import zlib
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from datetime import date, datetime, time
from functools import reduce
from itertools import chain, islice, repeat
from pathlib import Path
from typing import IO, Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from per_obspy.config import TableForm
from per_obspy.errors import CatalogError, printable, require_extra, shortened
from per_obspy.files import looks_like
from per_obspy.inventory.files.headings import Meanings, meanings_of
from per_obspy.inventory.files.raw_rows import Contents, RawRows
from per_obspy.inventory.schema import missing_columns
from per_obspy.reader_process import BeyondLimits, Limits, read_apart

#: Processor time and memory of the library.
LIMITS = Limits(seconds=300.0, memory=4 << 30)

#: Largest size of all parts together unpacked, bytes; above the second size no part may be so many
#: times as large as packed.
LARGEST, LARGE, HIGHEST_RATIO = 1 << 30, 32 << 20, 200

#: Most sheets, rows and columns that are read.
MOST_SHEETS, MOST_ROWS, MOST_COLUMNS = 100, 1 << 20, 1000

#: Rows among which the header is sought.
HEADER_ROWS = 20

#: Rows that are put together at once.
_BLOCK = 1 << 14

#: Text of a cell whose formula was never computed; no cell has it.
_UNCOMPUTED = "\0"

#: A cell with a formula but no value, or with an error, in the XML of a sheet.
_ODD_CELL = re.compile(
    rb"<(?:\w+:)?c\b([^>]*[^>/])>\s*(<(?:\w+:)?f\b[^<]*(?:/>|</(?:\w+:)?f>)\s*)?"
    rb"(?:<(?:\w+:)?v>(#[^<]*)</(?:\w+:)?v>|<(?:\w+:)?v\s*/>|<(?:\w+:)?v>\s*</(?:\w+:)?v>)?"
    rb"\s*</(?:\w+:)?c>"
)

#: Row -> column -> text of cells that the library takes for empty.
_OddCells = Mapping[int, Mapping[int, str]]

_REFERENCE = re.compile(rb'\br="([A-Z]{1,3})(\d{1,7})"')

#: Errors of archives and their XML for damaged files.
_DAMAGES = (
    *(zipfile.BadZipFile, zlib.error, SyntaxError, EOFError, OSError, RuntimeError),
    *(KeyError, ValueError),
)


class _Sheet(NamedTuple):
    """A sheet with the row of its header and the meanings of its columns."""

    #: In the workbook.
    name: str
    #: Row, from 1.
    header: int
    #: Of its cells.
    meanings: Meanings


def open_workbook(file: Path, given: TableForm) -> Contents:
    """
    Open the sheet of a workbook that has pairs.

    Raises
    ------
    CatalogError
        If it is damaged or beyond the limits, more than one sheet has a pair table and none is
        named, or a formula was never computed.
    MissingExtra
        If the library for workbooks is not installed.
    """
    require_extra("spreadsheet", "python_calamine")
    try:
        sheets: dict[str, pa.Table] = read_apart(LIMITS, _read_sheets, file)
    except BeyondLimits as error:
        problem = f"not a readable workbook ({file.suffix}): {error}"
        raise CatalogError(str(file), problem) from error
    # Columns as far as the header has any, rows below it
    sheet = _pair_sheet(file, sheets, given)
    source = f"{file}, sheet {sheet.name!r}"
    meanings = meanings_of(sheet.meanings.cells, given, source)
    rows = sheets[sheet.name].slice(sheet.header, MOST_ROWS).select(range(len(meanings.cells)))
    rows = _computed(source, rows, sheet.header + 1, meanings)
    lines = np.arange(len(rows)) + sheet.header + 1
    # The sheet is named in messages, and all of its rows are one block
    form = f"sheet {sheet.name!r} with the header in row {sheet.header}"
    return Contents(
        source=source,
        meanings=meanings,
        blocks=lambda places: iter([RawRows(source, rows.select(list(places)), lines, ())]),
        form=(form.removesuffix(" with the header in row 1"),),
    )


def _computed(source: str, rows: pa.Table, first: int, meanings: Meanings) -> pa.Table:
    """Return the rows of a sheet; raise CatalogError for a known cell that was never computed."""
    # Formulas matter in known columns, others are empty
    uncomputed = []
    for place in range(rows.num_columns):
        is_odd = pc.equal(rows[place], _UNCOMPUTED)
        row = pc.index(is_odd, True).as_py()
        if row >= 0 and place in meanings.columns:
            uncomputed.append((first + row, place))
        elif row >= 0:
            cells = pc.if_else(is_odd, "", rows[place])
            rows = rows.set_column(place, rows.column_names[place], cells)
    if uncomputed:
        row, place = min(uncomputed)
        cell = f"row {row}, {meanings.columns[place].column}"
        mend = "open the workbook in a spreadsheet program and save it"
        raise CatalogError(source, f"{cell}: a formula without a stored value: {mend}")
    return rows


def _pair_sheet(file: Path, sheets: Mapping[str, pa.Table], given: TableForm) -> _Sheet:
    """Return the sheet that is named, else the only one that has a pair table."""
    names = [name for name in sheets if given.sheet in (None, name)]
    tables = [sheet for name in names if (sheet := _with_header(name, sheets[name], given, file))]
    if not tables:
        reason = f"no sheet {given.sheet!r:.60} with cells" if given.sheet else "no sheet has cells"
        raise CatalogError(str(file), f"{reason}; there are {_listed(sheets)}")
    # Of several pair tables the user chooses one
    whole = [sheet for sheet in tables if not missing_columns(sheet.meanings.names)]
    if len(whole) > 1:
        listed = _listed(sheet.name for sheet in whole)
        mend = f'give sheet = "{whole[0].name}" or another one in [pairs]'
        raise CatalogError(str(file), f"{len(whole)} sheets have a pair table, {listed}: {mend}")
    # Without a suitable sheet take that with most columns; missing ones are reported later
    return max(whole or tables, key=lambda sheet: len(sheet.meanings.columns))


def _with_header(name: str, table: pa.Table, given: TableForm, file: Path) -> _Sheet | None:
    """Return a sheet with the row whose cells mean most columns, the first filled one else."""
    rows = []
    for number, row in enumerate(table.slice(0, HEADER_ROWS).to_pylist(), 1):
        # Headings of workbooks often have line breaks
        cells = [" ".join(printable(cell).split()) for cell in row.values()]
        filled = max((place for place, cell in enumerate(row.values(), 1) if cell), default=0)
        if filled:
            meanings = meanings_of(cells[:filled], given, str(file), must_have=False)
            rows.append(_Sheet(name, number, meanings))
    return max(rows, key=lambda row: len(row.meanings.columns), default=None)


def _listed(names: Iterable[str]) -> str:
    """Return names of sheets for a message."""
    return shortened(", ".join(repr(name) for name in names), 200)


def _read_sheets(file: Path) -> dict[str, pa.Table]:
    """Return the sheets of a workbook, each cell as text."""
    import python_calamine

    kind, worksheet = looks_like(file), python_calamine.SheetTypeEnum.WorkSheet
    try:
        # Only packed workbooks have parts
        odd = {} if "old Excel" in kind else _check_parts(file)
        with python_calamine.load_workbook(file) as book:
            names = [sheet.name for sheet in book.sheets_metadata if sheet.typ == worksheet]
            if len(names) > MOST_SHEETS:
                raise ValueError(f"{len(names)} sheets, at most {MOST_SHEETS} are read")
            return {
                name: _as_text(book.get_sheet_by_name(name), odd.get(name, {})) for name in names
            }
    except CatalogError:  # a ValueError as well
        raise
    except (*_DAMAGES, python_calamine.CalamineError) as error:
        reason = shortened(f"{type(error).__name__} {error}", 200)
        problem = f"not a readable workbook ({file.suffix}): {reason}"
        if kind and "ZIP" not in kind:
            hint = ", or one with a password" if "old Excel" in kind else ""
            problem = f"not a workbook ({file.suffix}): it is {kind}{hint}"
        raise CatalogError(str(file), problem) from error


def _check_parts(file: Path) -> dict[str, _OddCells]:
    """
    Check the parts of a packed workbook; return the odd cells of each sheet.

    Raises
    ------
    CatalogError
        If they are larger than the limits, or have a document type.
    """
    with zipfile.ZipFile(file) as archive:
        # Sizes by the directory of the archive
        parts = archive.infolist()
        size = sum(part.file_size for part in parts)
        if size > LARGEST:
            problem = f"{size >> 20} MB unpacked, at most {LARGEST >> 20} MB are read"
            raise CatalogError(str(file), problem)
        for part in parts:
            _check_part(file, archive, part)
        return _odd_cells(archive) if "xl/workbook.xml" in archive.namelist() else {}


def _check_part(file: Path, archive: zipfile.ZipFile, part: zipfile.ZipInfo) -> None:
    """Raise CatalogError for a part that is packed too well, or has a document type."""
    ratio = part.file_size // max(part.compress_size, 1)
    if part.file_size > LARGE and ratio > HIGHEST_RATIO:
        size = f"{part.filename} has {part.file_size >> 20} MB unpacked"
        problem = f"{size}, {ratio} times as much as packed: at most {HIGHEST_RATIO}"
        raise CatalogError(str(file), problem)
    path = Path(part.filename)
    if path.suffix not in (".xml", ".rels") or path.name == "manifest.xml":
        return
    # Entities can be larger than any file; text in UTF-16 would hide them
    with archive.open(part) as stream:
        head = stream.read(4096).replace(b"<!--", b"")
    if b"<!" in head or b"\0" in head:
        raise CatalogError(str(file), f"{part.filename} has a document type or zero bytes")


def _odd_cells(archive: zipfile.ZipFile) -> dict[str, _OddCells]:
    """Return sheet -> cells that the library takes for empty."""
    # Sheets may have parts of any name
    relations = ElementTree.fromstring(archive.read("xl/_rels/workbook.xml.rels"))
    targets = {relation.get("Id"): relation.get("Target", "") for relation in relations}
    odd = {}
    for sheet in ElementTree.fromstring(archive.read("xl/workbook.xml")).findall(".//{*}sheet"):
        key = next(value for name, value in sheet.attrib.items() if name.endswith("}id"))
        part = posixpath.normpath(posixpath.join("/xl", targets[key]))[1:]
        with archive.open(part) as stream:
            odd[sheet.get("name", "")] = _odd_cells_of(stream)
    return odd


def _odd_cells_of(stream: IO[bytes]) -> _OddCells:
    """Return errors, and formulas without a value, in the XML of a sheet."""
    odd, rest = defaultdict[int, dict[int, str]](dict), b""
    while block := stream.read(1 << 20):
        # Whole cells
        text, end, rest = (rest + block).rpartition(b"c>")
        for attributes, formula, error in _ODD_CELL.findall(text + end):
            place = _REFERENCE.search(attributes)
            is_error = error and b't="e"' in attributes
            # A formula may have an empty text
            is_uncomputed = formula and not error and b't="str"' not in attributes
            if place and int(place[2]) <= MOST_ROWS and (is_error or is_uncomputed):
                value = error.decode("utf-8", "replace") if is_error else _UNCOMPUTED
                column = reduce(lambda number, letter: 26 * number + letter - 64, place[1], 0)
                odd[int(place[2]) - 1][column - 1] = value
    return odd


def _as_text(sheet: Any, odd: _OddCells) -> pa.Table:
    """Return the rows of a sheet from the first one, cells as text, with those of odd cells."""
    # Odd cells may be below and behind all others
    height, width = sheet.end or (-1, -1)
    height, width = max(height, *odd, -1) + 1, max(width, *chain(*odd.values()), -1) + 1
    names = [str(place) for place in range(min(width, MOST_COLUMNS))]
    tables = [pa.table(dict.fromkeys(names, pa.array([], pa.string())))]
    # Some thousands of rows at a time
    rows = islice(_rows(sheet, odd, width), height)
    while block := list(islice(rows, _BLOCK)):
        columns = map(pa.array, zip(*block, strict=True))
        tables.append(pa.table(dict(zip(names, columns, strict=False))))
    return pa.concat_tables(tables)


def _rows(sheet: Any, odd: _OddCells, width: int) -> Iterator[list[str]]:
    """Yield the rows of a sheet, and blank ones without end."""
    # The library leaves out empty columns before the first one
    left = [""] * (sheet.start[1] if sheet.start else 0)
    for number, row in enumerate(chain(sheet.iter_rows(), repeat([]))):
        cells = [*left, *map(_text, row)]
        cells += [""] * (width - len(cells))
        for place, text in odd.get(number, {}).items():
            cells[place] = text
        yield cells


def _text(value: object) -> str:
    """Return a cell as the text that a plain table would have."""
    if isinstance(value, str):
        return value if value.isprintable() else " ".join(value.splitlines())
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError("a number has too many digits")
        return str(int(value)) if value.is_integer() and abs(value) < 1e16 else repr(value)
    # Days have a time of day, as those with one
    if isinstance(value, date) and not isinstance(value, datetime):
        return str(datetime.combine(value, time()))
    return str(value)
