"""
Text tables: their encoding, separator and header, and their lines joined to rows.

A plain table (UTF-8, commas, header first, the names of the schema) is taken as it is. Of another
one every form that can be is tried, and the one whose headings mean most columns is taken.

Every line is accounted for. A quoted cell may contain line breaks; a quotation mark that is never
closed would take the rows after it for one cell: such a row is left out by itself, and the next
line is a row again.
"""

import codecs
import csv
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from mmap import ACCESS_READ, mmap
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.csv
from numpy.typing import NDArray

from per_obspy.config import TableForm
from per_obspy.errors import CatalogError, Rejection, did_you_mean
from per_obspy.files import looks_like
from per_obspy.inventory.cells import is_unknown, read_number
from per_obspy.inventory.files.headings import Meanings, meanings_of
from per_obspy.inventory.files.raw_rows import Contents, RawRows
from per_obspy.inventory.schema import missing_columns

#: Characters read at once.
BLOCK = 1 << 20

#: Most lines of one row; a quotation over more of them is one that is not closed.
LONGEST_ROW = 100

#: Longest line, characters, and longest name of a row in messages.
LONGEST_LINE, LONGEST_NAME = 8 << 20, 80

#: Lines among which the header is sought: titles and blank lines may precede it.
HEADER_LINES = 20

#: Headings that must mean a column for a line below the first to be the header.
_FEWEST = 3

#: Separators other than the comma, as messages name them.
OTHER_SEPARATORS = {";": "semicolons", "\t": "tabulators", "|": "vertical bars"}

OPEN = "a quotation mark is not closed"
AFTER = "text follows a closing quotation mark"

#: The encoding of plain tables, and the code pages that are tried where a text is not UTF-8: of
#: western Europe, Turkey and Japan. Headings decide for the last two.
UTF_8, WESTERN, TURKISH_PAGE, JAPANESE = "utf-8", "cp1252", "cp1254", "cp932"

#: Encodings that a configuration may name: those of texts, none of which is a program.
NAMED = (
    *(UTF_8, "utf-16", "utf-16-le", "utf-16-be", "ascii", "latin-1", "iso8859-9", "iso8859-15"),
    *(f"cp125{number}" for number in range(9)),
    *("cp437", "cp850", "cp852", "cp857", "cp932", "shift_jis", "euc_jp", "gb18030", "big5"),
    *("euc_kr", "mac-roman"),
)

#: Letters of the western code page whose bytes are other letters in the Turkish one.
TURKISH = "ÐÝÞðýþ"

# A letter of several bytes as UTF-8 has it
_UTF_8_LETTER = re.compile(
    rb"[\xc2-\xdf][\x80-\xbf]|[\xe1-\xec\xee\xef][\x80-\xbf]{2}|[\xf1-\xf3][\x80-\xbf]{3}"
)

_MARKS = {codecs.BOM_UTF8: UTF_8, codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}

_MEND = 'save it as "CSV UTF-8", or give encoding = "cp1254" or the like in [pairs]'


class TextForm(NamedTuple):
    """Form of a text table."""

    #: Of the text.
    encoding: str
    separator: str
    #: First and last line of the header, whose cells may have line breaks.
    header: int
    header_end: int
    #: Of its cells.
    meanings: Meanings
    #: What is wrong with its quotation marks.
    fault: str = ""
    #: Number of lines of the file.
    lines: int = 0
    #: Whether another encoding would give other letters, and no heading decides.
    is_doubtful: bool = False


def open_text(file: Path, given: TableForm) -> Contents:
    """
    Open a text table.

    Raises
    ------
    CatalogError
        If it is no text in any encoding that is known, or a column given for it is not there.
    """
    form = text_form(file, given)
    meanings = form.meanings
    # Only differences from a plain table
    texts = [f"text in {form.encoding}"] if form.encoding not in (UTF_8, "ascii") else []
    if form.separator in OTHER_SEPARATORS:
        texts.append(f"columns separated by {OTHER_SEPARATORS[form.separator]}")
    if form.header > 1:
        texts.append(f"the header in line {form.header}")
    return Contents(
        source=str(file),
        meanings=meanings,
        blocks=partial(_text_rows, file, form),
        form=tuple(texts),
        separator=form.separator,
        is_doubtful=form.is_doubtful,
    )


def text_form(file: Path, given: TableForm) -> TextForm:
    """
    Return the form of a text table.

    Raises
    ------
    CatalogError
        If it is no text in any encoding that is known, has no header, or lacks a configured column.
    """
    encodings = possible_encodings(file, given.encoding)
    forms = list(_possible_forms(file, given, list(encodings)))
    if not forms:
        check_text(file)  # names the line that is not UTF-8
        raise CatalogError(str(file), "line 1: no header can be read")
    best = max(forms, key=_rank)
    if len(best.meanings.columns) < _FEWEST:
        # No heading is recognised: the first line, in most cells
        first = [form for form in forms if form.header == 1] or forms
        best = max(first, key=lambda form: (len(form.meanings.columns), len(form.meanings.cells)))
    # Now every configured column must be there
    meanings = meanings_of(best.meanings.cells, given, str(file))
    lines = encodings[best.encoding] or check_text(file, best.encoding)
    if best.fault:
        raise CatalogError(str(file), f"line {best.header}: {best.fault}")
    is_western = best.encoding == WESTERN and TURKISH_PAGE in encodings
    is_doubtful = is_western and not meanings.language
    return best._replace(meanings=meanings, lines=lines, is_doubtful=is_doubtful)


def _rank(form: TextForm) -> tuple[bool, int, bool]:
    """
    Return the criteria between forms.

    A plain table comes first, then most columns that have a meaning, and Turkish words in the
    Turkish code page.
    """
    columns = form.meanings.columns
    is_plain = form.header == 1 and not missing_columns(form.meanings.cells)
    is_turkish = form.encoding == TURKISH_PAGE and form.meanings.language == "tr"
    return is_plain, len(columns), is_turkish


def _possible_forms(file: Path, given: TableForm, encodings: Sequence[str]) -> Iterator[TextForm]:
    """Yield every form that a text table may have, the usual ones first."""
    separators = (given.separator,) if given.separator else (",", *OTHER_SEPARATORS)
    for encoding in encodings:
        head = next(_whole_lines(file, encoding), "").split("\n")[:HEADER_LINES]
        for separator in separators:
            for number, end, cells, fault in _headers(head, separator):
                meanings = meanings_of(cells, given, str(file), must_have=False)
                languages = {means.language for means in meanings.columns.values()}
                # Any bytes may be Japanese: only a heading decides
                if encoding != JAPANESE or given.encoding or "ja" in languages:
                    yield TextForm(encoding, separator, number, end, meanings, fault)


def _headers(lines: Sequence[str], separator: str) -> Iterator[tuple[int, int, list[str], str]]:
    """Yield first and last line of what may be a header, with its cells and its fault."""
    for number, line in enumerate(lines, 1):
        # A cell with line breaks ends on a later line
        end, text = number, line
        cells, fault = _cells(line, separator)
        while not cells and '"' in line and end < len(lines):
            text, end = f"{text}\n{lines[end]}", end + 1
            cells, _ = _cells(text, separator)
        if cells:
            fault = ""
        elif fault and number == 1:
            cells, end = [line], 1
        if cells and (number == 1 or len(cells) >= _FEWEST):
            yield number, end, [" ".join(cell.split()) for cell in cells], fault


def _cells(text: str, separator: str, strict: bool = True) -> tuple[list[str], str]:
    """Return the cells of a row, and the fault of its quotation marks: none of the cells then."""
    limit = csv.field_size_limit()
    csv.field_size_limit(max(limit, len(text)))
    try:
        return next(csv.reader([text], delimiter=separator, strict=strict), []), ""
    except csv.Error as error:
        return [], OPEN if "unexpected end" in str(error) else AFTER
    finally:
        csv.field_size_limit(limit)


def check_separator(file: Path, names: list[str]) -> None:
    """
    Check that the columns of a header are separated by commas.

    Raises
    ------
    CatalogError
        If the header is one name that contains another separator.
    """
    for sign, kind in OTHER_SEPARATORS.items():
        if len(names) == 1 and sign in names[0]:
            raise CatalogError(str(file), f"columns are separated by {kind}, commas are expected")


def possible_encodings(file: Path, given: str | None = None) -> dict[str, int | None]:
    """
    Return the encodings in which the whole of a text can be, the most usual first.

    Each has the number of lines, None where they have not been counted.

    Parameters
    ----------
    file : Path
        Text.
    given : str, optional
        The encoding, if it is known.

    Raises
    ------
    CatalogError
        If it is in none, or not in the configured one.
    """
    with file.open("rb") as stream:
        start = stream.read(4)
    marked = next((name for mark, name in _MARKS.items() if start.startswith(mark)), None)
    if given is not None:
        marked = _configured(file, given)
    if marked:
        return {marked: check_text(file, marked)}
    try:
        return {UTF_8: check_text(file)}
    except CatalogError as error:
        # A fault that is none of the encoding is raised as it is
        cause = error.__cause__
        if not isinstance(cause, UnicodeDecodeError):
            raise
        # Damaged UTF-8: its letters are hardly ever text of a code page, nor if the last is cut
        pages = (JAPANESE,) if _has_letters(file) else (WESTERN, TURKISH_PAGE, JAPANESE)
        is_cut = "unexpected end" in cause.reason
        able = [] if is_cut else [page for page in pages if _can_be(file, page)]
        if not able:
            raise CatalogError(str(file), f"{error.problem}; {_MEND}") from error
        return dict.fromkeys(able)


def _has_letters(file: Path) -> bool:
    """Return whether a text has a letter of several bytes as UTF-8 has it."""
    with file.open("rb") as stream, mmap(stream.fileno(), 0, access=ACCESS_READ) as content:
        return _UTF_8_LETTER.search(content) is not None


def _can_be(file: Path, encoding: str) -> bool:
    """Return whether a text can be in an encoding."""
    with suppress(UnicodeDecodeError):
        return all(text_blocks(file, encoding))
    return False


def _configured(file: Path, given: str) -> str:
    """Return the encoding for a configured name, in any spelling that Python knows."""
    try:
        name = codecs.lookup(given).name
    except (LookupError, ValueError):
        name = ""
    # Texts only: other codecs are programs
    encodings = {codecs.lookup(encoding).name: encoding for encoding in NAMED}
    if name not in encodings:
        meant = did_you_mean(given, NAMED)
        problem = f"encoding = {given!r:.40} is not known{meant}; known are {', '.join(NAMED)}"
        raise CatalogError(str(file), problem)
    return encodings[name]


def two_pages(name: str, text: str) -> str:
    """Return a message on uncertain letters of a text in a Western code page, and the remedy."""
    turkish = text.encode(WESTERN).decode(TURKISH_PAGE)
    reason = f"{name} = {text!r:.40} in {WESTERN}, {turkish!r:.40} in {TURKISH_PAGE}"
    return f'{reason}, and no heading decides: give encoding = "cp1252" or "cp1254" in [pairs]'


def text_blocks(file: Path, encoding: str = UTF_8) -> Iterator[str]:
    """
    Yield the text of a file whose lines all end with a line feed, without a mark of the byte order.

    Raises
    ------
    UnicodeDecodeError
        If the file is in another encoding.
    """
    with file.open(encoding="utf-8-sig" if encoding == UTF_8 else encoding) as stream:
        while block := stream.read(BLOCK):
            yield block


def check_text(file: Path, encoding: str = UTF_8) -> int:
    """
    Check that a file is text in an encoding and return the number of its lines.

    Raises
    ------
    CatalogError
        If it is of another kind, contains a zero byte or is not in this encoding, naming the line.
    """
    if kind := looks_like(file):
        raise CatalogError(str(file), f"not a CSV table: it is {kind}")
    lines, block = 0, ""
    try:
        for block in text_blocks(file, encoding):
            lines += block.count("\n")
            if "\0" in block:
                problem = "not a CSV table: it holds zero bytes, as no text does"
                raise CatalogError(str(file), problem)
    except UnicodeDecodeError as error:
        problem = _undecodable(file) if encoding == UTF_8 else f"is no text in {encoding}: {error}"
        raise CatalogError(str(file), problem) from error
    # The last line may lack its end
    return lines + (not block.endswith("\n"))


def _undecodable(file: Path) -> str:
    """Return the line and byte at which a file is not UTF-8."""
    with file.open("rb") as text:
        for number, line in enumerate(text, start=1):
            try:
                line.decode("utf-8")
            except UnicodeDecodeError as error:
                byte, position = line[error.start], error.start + 1
                return f"line {number} is not UTF-8 (byte 0x{byte:02x} at position {position})"
    return "the end is not UTF-8"


def _text_rows(file: Path, form: TextForm, places: Sequence[int]) -> Iterator[RawRows]:
    """Yield the cells of some columns, some thousands of rows at a time, and the broken lines."""
    # Columns by their position, as names may be anything
    chosen = [str(place) for place in places]
    options = pa.csv.ConvertOptions(
        column_types=dict.fromkeys(chosen, pa.string()), include_columns=chosen
    )
    empty = pa.table([pa.array([], pa.string())] * len(chosen), names=chosen)
    for rows in row_lines(file, form):
        invalid: dict[int, Rejection] = {}
        table = _parsed(file, form, rows, options, invalid) if rows.text else empty
        lines = np.delete(rows.numbers, list(invalid))
        # Every line that was given is a row or a broken one
        if len(table) != lines.size:
            problem = f"line {rows.numbers[0]} and the next ones make no rows"
            raise CatalogError(str(file), problem)
        broken = sorted((*rows.broken, *invalid.values()), key=attrgetter("row"))
        yield RawRows(str(file), table, lines, tuple(broken))


def _parsed(
    file: Path,
    form: TextForm,
    rows: "RowLines",
    options: pa.csv.ConvertOptions,
    invalid: dict[int, Rejection],
) -> pa.Table:
    """Return rows as a table of text; add those with too few or too many cells by position."""

    def skip(row: pa.csv.InvalidRow) -> str:
        fault = f"{row.actual_columns} columns, the header has {row.expected_columns}"
        name, line = row.text.split(form.separator)[0], int(rows.numbers[row.number - 1])
        rejection = Rejection("pair", name[:LONGEST_NAME], str(file), line, (fault,))
        invalid[row.number - 1] = rejection
        return "skip"

    # With threads, the reader does not number the rows; a block is read in one piece
    text = rows.text.encode()
    columns = [str(place) for place in range(len(form.meanings.cells))]
    reading = pa.csv.ReadOptions(use_threads=False, column_names=columns, block_size=len(text) + 1)
    # Blank lines are rows here, so that all are counted
    parsing = pa.csv.ParseOptions(
        delimiter=form.separator, ignore_empty_lines=False, invalid_row_handler=skip
    )
    return pa.csv.read_csv(pa.BufferReader(text), reading, parsing, options)


class RowLines(NamedTuple):
    """Consecutive rows of a text table."""

    #: One line per row; line breaks inside of cells have become blanks.
    text: str
    #: Line of the file on which each row begins; the header is line 1. Shape (n_rows,).
    numbers: NDArray[np.int64]
    #: Lines between the rows whose quotation marks are wrong.
    broken: Sequence[Rejection]


def row_lines(file: Path, form: TextForm) -> Iterator[RowLines]:
    """
    Yield the rows after the header, some thousands at a time.

    Raises
    ------
    CatalogError
        If the lines that were read are not those that the file had.
    """
    scanner, header = _Scanner(file, form), form.header_end
    for block in _whole_lines(file, form.encoding):
        # Lines up to the header, which may be in several blocks
        above = min(header, block.count("\n"))
        header -= above
        yield scanner.rows(block.split("\n", above)[-1])
    yield scanner.rows("", is_last=True)
    if scanner.number != form.lines + 1:
        read = scanner.number - 1
        problem = f"{form.lines} lines, of which {read} were read: was the file changed meanwhile?"
        raise CatalogError(str(file), problem)


def _whole_lines(file: Path, encoding: str) -> Iterator[str]:
    """Yield the whole lines of a file, which all end with a line feed."""
    rest = ""
    for block in text_blocks(file, encoding):
        lines, end, rest = (rest + block).rpartition("\n")
        if end:
            yield lines + end
        elif len(rest) > LONGEST_LINE:
            raise CatalogError(str(file), f"a line is longer than {LONGEST_LINE >> 20} MB")
    if rest:
        yield rest + "\n"


class _Scanner:
    """
    Joins lines to rows, block by block.

    Attributes
    ----------
    number : int
        Number of the next line of the file.
    """

    def __init__(self, file: Path, form: TextForm) -> None:
        self.number = form.header_end + 1
        self._file, self._separator = file, form.separator
        # Lines of a row that goes on in the next block
        self._waiting: list[str] = []
        names = [name.strip() for name in form.meanings.names]
        self._width, self._gap = len(names), names.index("gap") if "gap" in names else len(names)

    def rows(self, block: str, is_last: bool = False) -> RowLines:
        """Return the rows of some whole lines, and of those that waited for them."""
        # Most blocks have no quotation mark: each line is a row
        if '"' not in block and not self._waiting:
            first, self.number = self.number, self.number + block.count("\n")
            return RowLines(block, np.arange(first, self.number), ())
        lines = self._waiting + block.split("\n")[:-1]
        at = 0
        rows, numbers, broken = list[str](), list[int](), list[Rejection]()
        # One row after the other, as far as their lines are here
        while row := self._next(lines[at : at + LONGEST_ROW], is_last):
            count, fault = row
            if fault:
                broken.append(self._rejection(lines[at], fault))
            else:
                rows.append(" ".join(lines[at : at + count]) + "\n")
                numbers.append(self.number)
            at += count
            self.number += count
        # The others wait for further lines
        self._waiting = lines[at:]
        return RowLines("".join(rows), np.array(numbers, np.int64), broken)

    def _rejection(self, line: str, fault: str) -> Rejection:
        """Return the rejection of the next line."""
        name = line.partition(self._separator)[0].strip('" ')[:LONGEST_NAME]
        return Rejection("pair", name, str(self._file), self.number, (fault,))

    def _next(self, lines: Sequence[str], is_last: bool) -> tuple[int, str] | None:
        """Return the number of lines of the next row and its fault; None if more are needed."""
        if not lines:
            return None
        # A row on one line, or a fault on it
        first = lines[0]
        fault = _cells(first, self._separator)[1] if '"' in first else ""
        if fault != OPEN:
            return 1, fault
        # Go on to the line that closes the quotation
        for count, line in enumerate(lines[1:], start=2):
            _, rest = _cells(f'"{line}', self._separator)
            if not rest:
                cells, _ = _cells("\n".join(lines[:count]), self._separator)
                is_row = len(cells) == self._width and not self._begins_again(first, line)
                return (count, "") if is_row else (1, OPEN)
            if rest == AFTER or self._begins_again(first, line):
                return 1, OPEN
        return (1, OPEN) if is_last or len(lines) >= LONGEST_ROW else None

    def _begins_again(self, first: str, line: str) -> bool:
        """Return whether a line is a row of its own, and none that goes on with a first line."""
        # A line that closes the first cell of a row has all others too
        has_all = first.count(self._separator) >= self._width - 1
        is_whole = line.count(self._separator) >= self._width - 1
        if not is_whole or ('"' in line and not has_all):
            return False
        # A gap that is a number, with either decimal mark, or a word, but no text
        cells, _ = _cells(line, self._separator, strict=False)
        gap = cells[self._gap] if self._gap < len(cells) else "no row"
        return is_unknown(gap) or not np.isnan(read_number("gap", gap.replace(",", ".")).number)
