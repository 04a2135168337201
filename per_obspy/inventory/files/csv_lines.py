"""
Lines of a CSV file joined to rows, every line accounted for.

A quoted cell may contain line breaks. A quotation mark that is never closed would take the rows
after it for one cell: such a row is left out by itself, and the next line is a row again.
"""

import csv
import re
from collections import deque
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.cells import is_unknown, read_number
from per_obspy.inventory.recognition.csv_text import UTF_8, text_blocks

#: Most lines of one row; a quotation over more of them is one that is not closed.
LONGEST_ROW = 100

#: Longest line, bytes.
LONGEST_LINE = 8 << 20

#: Longest name of a row in messages, bytes.
LONGEST_NAME = 80

OPEN = "a quotation mark is not closed"
AFTER = "text follows a closing quotation mark"

# Text inside quotation marks, in which a doubled mark represents one mark
_INSIDE = rb'(?:[^"]|"")*+'


class _Patterns(NamedTuple):
    """
    Lines by their quotations.

    Attributes
    ----------
    whole, opening : Pattern
        A line whose quotations are all closed, and one whose last cell is not.
    closing, between : Pattern
        A further line of a quotation, which closes it; or which does not, or opens the next one.
    """

    whole: re.Pattern[bytes]
    opening: re.Pattern[bytes]
    closing: re.Pattern[bytes]
    between: re.Pattern[bytes]


@cache
def _patterns(separator: str) -> _Patterns:
    """Return the patterns of lines whose cells are separated by a sign."""
    sign = re.escape(separator).encode()
    # Cells, and the characters that may follow them
    cell = rb'(?:"%b"|[^"%b][^%b]*+|)' % (_INSIDE, sign, sign)
    cells = rb"(?:%b%b)*+" % (sign, cell)
    # Before a further quotation the last of them is given back
    some = rb"(?:%b%b)*" % (sign, cell)
    return _Patterns(
        whole=re.compile(rb"%b%b" % (cell, cells)),
        opening=re.compile(rb'(?:%b%b)*+"%b' % (cell, sign, _INSIDE)),
        closing=re.compile(rb'%b"%b' % (_INSIDE, cells)),
        between=re.compile(rb'%b(?:"%b%b"%b)?+' % (_INSIDE, some, sign, _INSIDE)),
    )


class RowLines(NamedTuple):
    """
    Consecutive rows of a CSV file as text.

    Attributes
    ----------
    text : bytes
        One line per row; line breaks inside of cells have become blanks.
    numbers : (n_rows,) ndarray of int
        Line of the file on which each row begins; the header is line 1.
    broken : tuple of Rejection
        Lines between the rows whose quotation marks are wrong.
    """

    text: bytes
    numbers: NDArray[np.int64]
    broken: tuple[Rejection, ...]


class Layout(NamedTuple):
    """
    Positions of the rows of a text file.

    Attributes
    ----------
    lines : int
        Number of lines of the file.
    header : int
        Line of the header, whose cells may have line breaks too.
    header_end : int
        Line on which it ends, 0 if that is the same.
    separator, encoding : str
        Of the text.
    """

    lines: int
    header: int = 1
    separator: str = ","
    encoding: str = UTF_8
    header_end: int = 0

    @property
    def last(self) -> int:
        """Last line of the header."""
        return max(self.header, self.header_end)


def header_names(file: Path, layout: Layout) -> list[str]:
    """
    Return the names in the header of a file.

    Raises
    ------
    CatalogError
        If a quotation mark of the line is not closed.
    """
    # Cells of the header may have line breaks
    lines = next(_after_lines(file, layout, layout.header - 1)).split(b"\n")
    first = b" ".join(lines[: layout.last - layout.header + 1])
    patterns = _patterns(layout.separator)
    if not patterns.whole.fullmatch(first):
        problem = OPEN if patterns.opening.fullmatch(first) else AFTER
        raise CatalogError(str(file), f"line {layout.header}: {problem}")
    return _cells(first, layout.separator)


def row_lines(file: Path, names: Sequence[str], layout: Layout) -> Iterator[RowLines]:
    """
    Yield the rows after the header, some thousands at a time.

    Parameters
    ----------
    file : Path
        Checked by :func:`~.csv_text.check_text`.
    names : sequence of str
        Columns of the header, by the schema where it knows them.
    layout : Layout
        Of the file.

    Raises
    ------
    CatalogError
        If the lines that were read are not those that the file had.
    """
    scanner = _Scanner(file, names, layout)
    for block in _after_lines(file, layout, layout.last):
        yield scanner.rows(block)
    yield scanner.rows(b"", is_last=True)
    if scanner.number != layout.lines + 1:
        read = scanner.number - 1
        problem = (
            f"{layout.lines} lines, of which {read} were read: was the file changed meanwhile?"
        )
        raise CatalogError(str(file), problem)


class _Scanner:
    """
    Joins lines to rows, block by block.

    Attributes
    ----------
    number : int
        Number of the next line of the file.
    """

    def __init__(self, file: Path, names: Sequence[str], layout: Layout) -> None:
        self.number = layout.last + 1
        self._file, self._names = file, names
        self._separator, self._patterns = layout.separator, _patterns(layout.separator)
        # Lines of a row that goes on in the next block
        self._waiting: deque[bytes] = deque()

    def rows(self, block: bytes, is_last: bool = False) -> RowLines:
        """Return the rows of some whole lines, and of those that waited for them."""
        # Most blocks have no quotation mark: each line is a row
        if b'"' not in block and not self._waiting:
            first, self.number = self.number, self.number + block.count(b"\n")
            return RowLines(block, np.arange(first, self.number), ())
        self._waiting.extend(block.split(b"\n")[:-1])
        rows, numbers, broken = list[bytes](), list[int](), list[Rejection]()
        # One row after the other, as far as their lines are here
        while (found := self._next(is_last)) is not None:
            count, fault = found
            lines = [self._waiting.popleft() for _ in range(count)]
            if fault:
                broken.append(self._rejection(lines[0], fault))
            else:
                rows.append(b" ".join(lines) + b"\n")
                numbers.append(self.number)
            self.number += count
        return RowLines(b"".join(rows), np.array(numbers, dtype=np.int64), tuple(broken))

    def _next(self, is_last: bool) -> tuple[int, str] | None:
        """Return the number of lines of the next row and its fault; None if more are needed."""
        if not self._waiting:
            return None
        first = self._waiting[0]
        if b'"' not in first or self._patterns.whole.fullmatch(first):
            return 1, ""
        if not self._patterns.opening.fullmatch(first):
            return 1, AFTER
        # Go on to the line that closes the quotation
        for count, line in enumerate(islice(self._waiting, 1, LONGEST_ROW), start=2):
            if self._patterns.closing.fullmatch(line):
                return self._closed(list(islice(self._waiting, count)))
            if self._begins_again(first, line) or not self._patterns.between.fullmatch(line):
                return 1, OPEN
        return (1, OPEN) if is_last or len(self._waiting) >= LONGEST_ROW else None

    def _closed(self, lines: list[bytes]) -> tuple[int, str]:
        """Return how many of the lines of a closed quotation are the next row, and its fault."""
        cells = _cells(b"\n".join(lines), self._separator)
        if len(cells) != len(self._names) or self._begins_again(lines[0], lines[-1]):
            return 1, OPEN
        return len(lines), ""

    def _begins_again(self, first: bytes, line: bytes) -> bool:
        """Return whether a line is a row of its own, and none that goes on with a first line."""
        # A line that closes the first cell of a row has all others too
        has_all = first.count(self._separator.encode()) >= len(self._names) - 1
        return (has_all or b'"' not in line) and self._is_row(line)

    def _is_row(self, line: bytes) -> bool:
        """Return whether a line inside quotation marks is a row by itself, judged by its gap."""
        if line.count(self._separator.encode()) < len(self._names) - 1:
            return False
        cells = dict(zip(self._names, _cells(line, self._separator), strict=False))
        # A number, with either decimal mark, or a word, but no text
        gap = cells.get("gap", "no row")
        return is_unknown(gap) or not np.isnan(read_number("gap", gap.replace(",", ".")).number)

    def _rejection(self, line: bytes, fault: str) -> Rejection:
        """Return the rejection of the next line."""
        name = (
            line.partition(self._separator.encode())[0]
            .strip(b'" ')[:LONGEST_NAME]
            .decode("utf-8", "replace")
        )
        return Rejection("pair", name, str(self._file), self.number, (fault,))


def _cells(row: bytes, separator: str) -> list[str]:
    """Return the cells of a row; none if one of them is longer than any cell should be."""
    try:
        return next(csv.reader([row.decode("utf-8", "replace")], delimiter=separator), [])
    except csv.Error:
        return []


def _after_lines(file: Path, layout: Layout, count: int) -> Iterator[bytes]:
    """Yield whole lines after the first ones, at least one block of them."""
    blocks = _blocks(file, layout.encoding)
    for block in blocks:
        # Lines of the block that are left out
        left_out = min(count, block.count(b"\n"))
        count -= left_out
        rest = block.split(b"\n", left_out)[-1] if left_out else block
        if not count:
            yield rest
            break
    yield from blocks


def _blocks(file: Path, encoding: str) -> Iterator[bytes]:
    """Yield whole lines in UTF-8, which all end with a line feed."""
    rest = b""
    for block in text_blocks(file, encoding):
        rest += block
        # A carriage return at the end may belong to a line feed that follows
        end = 1 + max(rest.rfind(b"\n"), rest.rfind(b"\r", 0, -1))
        if end:
            yield _with_line_feeds(rest[:end])
            rest = rest[end:]
        elif len(rest) > LONGEST_LINE:
            problem = f"a line is longer than {LONGEST_LINE >> 20} MB"
            raise CatalogError(str(file), problem)
    if rest:
        yield _with_line_feeds(rest if rest.endswith(b"\r") else rest + b"\n")


def _with_line_feeds(text: bytes) -> bytes:
    """Return text whose lines all end with a line feed."""
    return text.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in text else text
