"""
The form of a text table: encoding, separator, line of the header, and what its headings mean.

A plain table (UTF-8, commas, header first, the names of the schema) is taken as it is. Of another
one every form that can be is tried, and the one whose headings mean most columns is taken.
"""

import csv
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
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
from per_obspy.inventory.recognition.encodings import JAPANESE, possible_encodings
from per_obspy.inventory.recognition.headings import is_complete
from per_obspy.inventory.schema import COLUMNS

#: Lines among which the header is sought: titles and blank lines may stand above it.
HEADER_LINES = 20

#: Bytes of the file among which the header is sought.
_HEAD = 1 << 18

#: Headings that must mean a column for a line below the first to be the header.
_FEWEST = 3


class TextForm(NamedTuple):
    """
    How a text table is written.

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
    is_doubtful : bool
        Whether another encoding would give other letters, and no heading decides.
    """

    encoding: str
    separator: str
    header: int
    cells: tuple[str, ...]
    meanings: Meanings
    lines: int = 0
    is_doubtful: bool = False

    def sentence(self) -> str:
        """Return what is not plain about the form as one text, empty if nothing is."""
        texts = []
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
    separators = (given.separator,) if given.separator else (",", *OTHER_SEPARATORS)
    forms = list[tuple[int, int, TextForm]]()
    for encoding in encodings:
        head = _first_lines(file, encoding)
        for separator in separators:
            for number, cells in _headers(head, separator):
                found = meanings_of(cells, given, str(file), must_have=False)
                form = TextForm(encoding, separator, number, tuple(cells), found)
                if number == 1 and is_complete({cell for cell in cells if cell in COLUMNS}):
                    return _checked(form, file, given, encodings)
                if encoding != JAPANESE or given.encoding or found.has_language("ja"):
                    forms.append((len(found.columns), len(cells), form))
    if not forms:
        check_text(file)  # names the line that is not UTF-8
    # Most columns that mean something; else the first line in its most cells
    best = max(forms, key=lambda form: form[0], default=None)
    if best is None or best[0] < _FEWEST:
        first = [form for form in forms if form[2].header == 1]
        best = max(first, key=lambda form: (form[0], form[1]), default=None)
    if best is None:
        raise CatalogError(str(file), "line 1: no header can be read")
    return _checked(best[2], file, given, encodings)


def _checked(
    form: TextForm, file: Path, given: TableForm, encodings: Mapping[str, int | None]
) -> TextForm:
    """Return a form whose columns are there, in the encoding of its language if there are two."""
    meanings = meanings_of(form.cells, given, str(file))
    lines = encodings[form.encoding]
    if lines is not None:
        return form._replace(meanings=meanings, lines=lines)
    # Turkish words are in the Turkish code page
    languages = Counter(heading.language for heading in meanings.columns.values())
    del languages[""], languages["en"]
    likely = languages.most_common(1)[0][0] if languages else ""
    if likely == "tr" and form.encoding == "cp1252" and "cp1254" in encodings:
        form = form._replace(encoding="cp1254")
    is_doubtful = not likely and "cp1254" in encodings and form.encoding == "cp1252"
    lines = check_text(file, form.encoding)
    return form._replace(meanings=meanings, lines=lines, is_doubtful=is_doubtful)


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


def _headers(lines: Sequence[str], separator: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines that may be a header, with their cells."""
    for number, line in enumerate(lines, 1):
        try:
            cells = next(csv.reader([line], delimiter=separator, strict=True), [])
        except csv.Error:
            cells = [line] if number == 1 else []
        if cells and (number == 1 or len(cells) >= _FEWEST):
            yield number, [cell.strip() for cell in cells]
