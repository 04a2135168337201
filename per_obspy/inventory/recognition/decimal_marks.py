"""
Decimal commas and thousands in columns of text, decided by all numbers of a column.

``0,05`` and ``1.234,5`` have a decimal comma, ``1,234.5`` and ``1,234,567`` a comma between
thousands; ``1,234`` may be either, so that another number of the table has to decide.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa
import pyarrow.compute as pc

from per_obspy.inventory.recognition.csv_text import text_blocks

#: Signs between thousands other than comma and point: blanks and apostrophes.
_GROUPS = "[ '’\u00a0\u202f]"

#: Numbers whose comma is a decimal mark.
_DECIMAL = (
    rf"^\s*[+-]?(?:\d*,\d{{1,2}}|\d*,\d{{4,}}|0*,\d+|0\d*,\d+|\d{{4,}},\d+"
    rf"|[1-9]\d{{0,2}}(?:(?:\.|{_GROUPS})\d{{3}})+,\d+)(?:[eE][+-]?\d+)?\s*$"
)

#: Numbers whose commas are between thousands.
_THOUSANDS = r"^\s*[+-]?[1-9]\d{0,2}(?:(?:,\d{3})+\.\d*|(?:,\d{3}){2,})\s*$"

#: Numbers whose comma may be either.
_EITHER = r"^\s*[+-]?[1-9]\d{0,2},\d{3}\s*$"

#: Numbers whose mark can only be a decimal point.
_DECIMAL_POINT = (
    r"^\s*[+-]?(?:\d*\.\d{1,2}|\d*\.\d{4,}|0*\.\d+|0\d*\.\d+|\d{4,}\.\d+)(?:[eE][+-]?\d+)?\s*$"
)

#: In the order of :class:`Evidence`.
_KINDS = (_DECIMAL, _THOUSANDS, _EITHER, _DECIMAL_POINT)

#: Characters to replace in a column of decimal commas; groups of digits among them.
_WITH_COMMA = (
    rf"^\s*[+-]?(?:\d*|[1-9]\d{{0,2}}(?:(?:\.|{_GROUPS})\d{{3}})+),\d*(?:[eE][+-]?\d+)?\s*$"
)
_GROUPED = rf"^\s*[+-]?[1-9]\d{{0,2}}(?:(?:\.\d{{3}}){{2,}}|(?:{_GROUPS}\d{{3}})+)\s*$"

#: In such a column, a number whose point may be either.
_POINT = r"^\s*[+-]?[1-9]\d{0,2}\.\d{3}\s*$"

#: Characters to replace in a column with commas between thousands.
_WITH_THOUSANDS = r"^\s*[+-]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d*)?\s*$"


#: A quoted number with a comma, and its greatest length.
_LONGEST_NUMBER = 64
_QUOTED = re.compile(rb"\"\s{0,8}[+-]?[\d.'\xc2\xa0 ]{0,40},\d")


class Evidence(NamedTuple):
    """
    Evidence in the numbers of a column about the meaning of their commas.

    Attributes
    ----------
    decimal, thousands, either, point : int
        Number of cells of each kind; ``point`` are marks that can only be decimal points.
    example : str
        The first cell that may be either.
    line : int
        Its line in the file.
    """

    decimal: int = 0
    thousands: int = 0
    either: int = 0
    point: int = 0
    example: str = ""
    line: int = 0

    @property
    def has_commas(self) -> bool:
        """Whether a number has a comma."""
        return self.decimal + self.thousands + self.either > 0


def has_quoted_commas(file: Path, encoding: str) -> bool:
    """Return whether a text has a number, or a similar text, with a comma in quotation marks."""
    last = b""
    for block in text_blocks(file, encoding):
        text = last + block
        if b'"' in text and _QUOTED.search(text):
            return True
        last = text[-_LONGEST_NUMBER:]
    return False


def evidence_of(blocks: Iterable[tuple[pa.Table, Sequence[int]]]) -> dict[str, Evidence]:
    """Return the evidence of every column, from blocks of text with the lines of their rows."""
    found: dict[str, Evidence] = {}
    for table, lines in blocks:
        for name, cells in zip(table.column_names, table.columns, strict=True):
            found[name] = _more(found.get(name, Evidence()), cells, lines)
    return found


def _more(known: Evidence, cells: pa.ChunkedArray, lines: Sequence[int]) -> Evidence:
    """Return the evidence with that of further cells."""
    matches = [pc.match_substring_regex(cells, kind) for kind in _KINDS]
    counts = [pc.sum(match).as_py() or 0 for match in matches]
    # Messages name the first ambiguous number
    example, line = known.example, known.line
    place = pc.index(matches[2], value=True).as_py()
    if not example and place >= 0:
        example, line = str(cells[place].as_py()).strip(), lines[place]
    return Evidence(
        known.decimal + counts[0],
        known.thousands + counts[1],
        known.either + counts[2],
        known.point + counts[3],
        example,
        line,
    )


def marks_of(evidence: Mapping[str, Evidence]) -> tuple[dict[str, str], dict[str, Evidence]]:
    """
    Return the decimal mark of each column that has commas, and the columns that remain undecided.

    A column whose numbers contradict each other keeps its text, so that rows with a comma in it are
    rejected.
    """
    columns = evidence.values()
    has_points = any(column.point for column in columns)
    has_decimals = any(column.decimal for column in columns)
    has_thousands = any(column.thousands for column in columns)
    # Ambiguous numbers are decided by the only kind of commas in the table
    others = "," if has_decimals and not has_points else "." if has_thousands else ""
    marks, doubtful = dict[str, str](), dict[str, Evidence]()
    for name, column in evidence.items():
        # The numbers of the column decide, else those of the other columns
        kinds = (column.decimal > 0, column.thousands > 0, column.point > 0)
        if kinds == (True, False, False):
            marks[name] = ","
        elif kinds[:2] == (False, True):
            marks[name] = "."
        elif column.either and not any(kinds) and others and has_decimals != has_thousands:
            marks[name] = others
        elif column.either and not column.decimal:
            doubtful[name] = column
    return marks, doubtful


def with_points(cells: pa.ChunkedArray, mark: str) -> pa.ChunkedArray:
    """
    Return numbers as text with a decimal point and without signs between thousands.

    Parameters
    ----------
    cells : ChunkedArray of str
        A column.
    mark : str
        Its decimal mark, ``","`` or ``"."``.

    Examples
    --------
    >>> with_points(pa.chunked_array([["0,05", "1.234,5", "9.5", "1.234", "x"]]), ",").to_pylist()
    ['0.05', '1234.5', '9.5', '1.234 (or 1234?)', 'x']
    """
    if mark == ".":
        is_number = pc.match_substring_regex(cells, _WITH_THOUSANDS)
        return pc.if_else(is_number, pc.replace_substring(cells, ",", ""), cells)
    # Signs between thousands go, the comma becomes a point
    bare = pc.replace_substring_regex(cells, rf"(\d)(?:\.|{_GROUPS})", r"\1")
    plain = pc.replace_substring(bare, ",", ".")
    changes = (_WITH_COMMA, _GROUPED)
    is_comma, is_grouped = (pc.match_substring_regex(cells, kind) for kind in changes)
    # A point with three digits behind it is no number that anyone can be sure of
    other = pc.binary_join_element_wise(cells, " (or ", bare, "?)", "")
    doubtful = pc.if_else(pc.match_substring_regex(cells, _POINT), other, cells)
    return pc.if_else(pc.or_(is_comma, is_grouped), plain, doubtful)


def two_readings(name: str, found: Evidence) -> str:
    """Return a message on the ambiguous commas of a column, and the remedy."""
    comma, none = found.example.replace(",", "."), found.example.replace(",", "")
    reason = f"line {found.line}: {name} = {found.example!r} is {comma} or {none}"
    return f'{reason}, and no other number decides: give decimal = "," or "." in [pairs]'
