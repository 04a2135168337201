"""
The form of a text table: encoding, separator, line of the header, and meanings of its headings.

A plain table (UTF-8, commas, header first, the names of the schema) is taken as it is. Of another
one every form that can be is tried, and the one whose headings mean most columns is taken.
"""

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from per_obspy.config import TableForm
from per_obspy.errors import CatalogError
from per_obspy.inventory.recognition.column_meanings import Meanings, meanings_of
from per_obspy.inventory.recognition.csv_text import (
    OTHER_SEPARATORS,
    check_text,
    text_blocks,
)
from per_obspy.inventory.recognition.encodings import (
    JAPANESE,
    TURKISH_PAGE,
    possible_encodings,
)
from per_obspy.inventory.recognition.headings import is_complete
from per_obspy.inventory.schema import COLUMNS

#: Lines among which the header is sought: titles and blank lines may precede it.
HEADER_LINES = 20

#: Bytes of the file among which the header is sought.
_HEAD = 1 << 18

#: Headings that must mean a column for a line below the first to be the header.
_FEWEST = 3


class TextForm(NamedTuple):
    """
    Form of a text table.

    Attributes
    ----------
    encoding, separator : str
        Of the text.
    header : int
        Line of the header.
    cells : tuple of str
        The header.
    meanings : Meanings
        Of its cells.
    lines : int
        Number of lines of the file.
    header_end : int
        Last line of the header, whose cells may have line breaks.
    is_doubtful : bool
        Whether another encoding would give other letters, and no heading decides.
    """

    encoding: str
    separator: str
    header: int
    cells: tuple[str, ...]
    meanings: Meanings
    lines: int = 0
    header_end: int = 0
    is_doubtful: bool = False

    def sentence(self) -> str:
        """Return the peculiarities of the form as one text, empty if there are none."""
        texts = []
        # Only differences from a plain table
        if self.encoding not in ("utf-8", "ascii"):
            texts.append(f"text in {self.encoding}")
        if self.separator in OTHER_SEPARATORS:
            texts.append(f"columns separated by {OTHER_SEPARATORS[self.separator]}")
        if self.header > 1:
            texts.append(f"the header in line {self.header}")
        if columns := self.meanings.sentence():
            texts.append(columns)
        return "; ".join(texts)


def text_form(file: Path, given: TableForm) -> TextForm:
    """
    Return the form of a text table.

    Raises
    ------
    CatalogError
        If it is no text in any encoding that is known, or a column given for it is not there.
    """
    encodings = possible_encodings(file, given.encoding)
    found = list(_possible_forms(file, given, list(encodings)))
    if not found:
        check_text(file)  # names the line that is not UTF-8
        raise CatalogError(str(file), "line 1: no header can be read")
    # A plain table, else the form with most columns that have a meaning
    plain = next((form for form in found if _is_plain(form)), None)
    best = plain or max(found, key=_rank)
    if len(best.meanings.columns) < _FEWEST:
        # No heading is recognised: the first line, in most cells
        first = [form for form in found if form.header == 1]
        best = max(first, key=lambda form: (len(form.meanings.columns), len(form.cells)))
    # Now every configured column must be there
    meanings = meanings_of(best.cells, given, str(file))
    lines = encodings[best.encoding] or check_text(file, best.encoding)
    is_western = best.encoding == "cp1252" and TURKISH_PAGE in encodings
    is_doubtful = is_western and not meanings.language
    return best._replace(meanings=meanings, lines=lines, is_doubtful=is_doubtful)


def _is_plain(form: TextForm) -> bool:
    """Return whether the first line has the names of the schema that a pair table needs."""
    return form.header == 1 and is_complete({cell for cell in form.cells if cell in COLUMNS})


def _rank(form: TextForm) -> tuple[int, bool]:
    """Return the criteria between forms: columns, and Turkish words in the Turkish code page."""
    is_turkish = form.encoding == TURKISH_PAGE and form.meanings.language == "tr"
    return len(form.meanings.columns), is_turkish


def _possible_forms(file: Path, given: TableForm, encodings: Sequence[str]) -> Iterator[TextForm]:
    """Yield every form that a text table may have, the usual ones first."""
    separators = (given.separator,) if given.separator else (",", *OTHER_SEPARATORS)
    for encoding in encodings:
        head = _first_lines(file, encoding)
        for separator in separators:
            for number, end, cells in _headers(head, separator):
                found = meanings_of(cells, given, str(file), must_have=False)
                form = TextForm(encoding, separator, number, tuple(cells), found, header_end=end)
                # Any bytes may be Japanese: only a heading decides
                if encoding != JAPANESE or given.encoding or found.has_language("ja"):
                    yield form


def _first_lines(file: Path, encoding: str) -> list[str]:
    """Return the first lines of a file."""
    head = b""
    try:
        for block in text_blocks(file, encoding):
            head += block
            if len(head) >= _HEAD:
                break
    except UnicodeDecodeError:
        return []
    text = head.decode("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n")
    return text.split("\n")[:HEADER_LINES]


def _headers(lines: Sequence[str], separator: str) -> Iterator[tuple[int, int, list[str]]]:
    """Yield first and last line of what may be a header, with its cells."""
    for number, line in enumerate(lines, 1):
        # A cell with line breaks ends on a later line
        end, text = number, line
        while (cells := _strict_cells(text, separator)) is None and end < len(lines):
            text, end = f"{text}\n{lines[end]}", end + 1
            if '"' not in line:
                break
        if cells is None:
            end, cells = number, [line] if number == 1 else []
        if cells and (number == 1 or len(cells) >= _FEWEST):
            yield number, end, [" ".join(cell.split()) for cell in cells]


def _strict_cells(text: str, separator: str) -> list[str] | None:
    """Return the cells of a row, None if its quotation marks are wrong."""
    try:
        return next(
            csv.reader(text.splitlines(keepends=True), delimiter=separator, strict=True), []
        )
    except csv.Error:
        return None
