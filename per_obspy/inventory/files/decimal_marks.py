"""
Decimal commas and thousands in columns of text, decided by all numbers of a column.

``0,05`` and ``1.234,5`` have a decimal comma, ``1,234.5`` and ``1,234,567`` a comma between
thousands; ``1,234`` may be either, so that another number of the table has to decide.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

#: Signs between thousands other than comma and point: blanks and apostrophes.
_GROUPS = "[ '’\u00a0\u202f]"

#: What the mark of a number can only be: a decimal comma, commas between thousands, or a decimal
#: point; and numbers whose comma may be either of the first two.
_KINDS = {
    "decimal": (
        rf"^\s*[+-]?(?:\d*,\d{{1,2}}|\d*,\d{{4,}}|0*,\d+|0\d*,\d+|\d{{4,}},\d+"
        rf"|[1-9]\d{{0,2}}(?:(?:\.|{_GROUPS})\d{{3}})+,\d+)(?:[eE][+-]?\d+)?\s*$"
    ),
    "thousands": r"^\s*[+-]?[1-9]\d{0,2}(?:(?:,\d{3})+\.\d*|(?:,\d{3}){2,})\s*$",
    "point": (
        r"^\s*[+-]?(?:\d*\.\d{1,2}|\d*\.\d{4,}|0*\.\d+|0\d*\.\d+|\d{4,}\.\d+)"
        r"(?:[eE][+-]?\d+)?\s*$"
    ),
}
_EITHER = r"^\s*[+-]?[1-9]\d{0,2},\d{3}\s*$"

#: Characters to replace in a column of decimal commas; groups of digits among them.
_WITH_COMMA = (
    rf"^\s*[+-]?(?:\d*|[1-9]\d{{0,2}}(?:(?:\.|{_GROUPS})\d{{3}})+),\d*(?:[eE][+-]?\d+)?\s*$"
)
_GROUPED = rf"^\s*[+-]?[1-9]\d{{0,2}}(?:(?:\.\d{{3}}){{2,}}|(?:{_GROUPS}\d{{3}})+)\s*$"

#: In such a column, a number whose point may be either.
_POINT = r"^\s*[+-]?[1-9]\d{0,2}\.\d{3}\s*$"

#: Characters to replace in a column with commas between thousands.
_WITH_THOUSANDS = r"^\s*[+-]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d*)?\s*$"


class Evidence:
    """
    Evidence in the numbers of a column about the meaning of their commas.

    Attributes
    ----------
    kinds : set of str
        What a mark of it can only be: ``"decimal"`` commas, commas between ``"thousands"``, a
        decimal ``"point"``.
    example : str
        The first cell whose comma may be either; empty without one.
    line : int
        Its line in the file.
    """

    def __init__(self) -> None:
        self.kinds, self.example, self.line = set[str](), "", 0

    def add(self, cells: pa.ChunkedArray, lines: Sequence[int] | NDArray[np.int64]) -> None:
        """Add the evidence of further cells, of the lines of a file."""
        commas = cells.filter(pc.match_substring(cells, ","))
        for kind, pattern in _KINDS.items():
            if kind in self.kinds:
                continue
            # The sign alone is sought faster
            is_point = kind == "point"
            some = cells.filter(pc.match_substring(cells, ".")) if is_point else commas
            if pc.any(pc.match_substring_regex(some, pattern)).as_py():
                self.kinds.add(kind)
        if len(commas) and not self.example:
            place = pc.index(pc.match_substring_regex(cells, _EITHER), value=True).as_py()
            if place >= 0:
                self.example, self.line = str(cells[place].as_py()).strip(), int(lines[place])


def marks_of(
    evidence: Mapping[str, Evidence], given: str = ""
) -> tuple[dict[str, str], dict[str, Evidence]]:
    """
    Return the decimal mark of each column that has commas, and the columns that remain undecided.

    A column whose numbers contradict each other keeps its text, so that rows with a comma in it are
    rejected. A ``given`` mark is that of all columns with commas.
    """
    kinds = set[str]().union(*(column.kinds for column in evidence.values()))
    # Ambiguous numbers are decided by the only kind of commas in the table
    others = {"decimal": ",", "thousands": "."}.get("".join(kinds - {"point"}), "")
    if others == "," and "point" in kinds:
        others = ""
    marks, doubtful = dict[str, str](), dict[str, Evidence]()
    for name, column in evidence.items():
        # The numbers of the column decide, else those of the other columns
        if given:
            mark = given if column.example or column.kinds - {"point"} else ""
        elif column.kinds == {"decimal"}:
            mark = ","
        elif "thousands" in column.kinds and "decimal" not in column.kinds:
            mark = "."
        else:
            mark = others if column.example and not column.kinds else ""
            if not mark and column.example and "decimal" not in column.kinds:
                doubtful[name] = column
        if mark:
            marks[name] = mark
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
    is_comma, is_grouped = (
        pc.match_substring_regex(cells, kind) for kind in (_WITH_COMMA, _GROUPED)
    )
    # A point with three digits behind it is no number that anyone can be sure of
    other = pc.binary_join_element_wise(cells, " (or ", bare, "?)", "")
    doubtful = pc.if_else(pc.match_substring_regex(cells, _POINT), other, cells)
    return pc.if_else(pc.or_(is_comma, is_grouped), plain, doubtful)


def two_readings(name: str, column: Evidence) -> str:
    """Return a message on the ambiguous commas of a column, and the remedy."""
    comma, none = column.example.replace(",", "."), column.example.replace(",", "")
    reason = f"line {column.line}: {name} = {column.example!r} is {comma} or {none}"
    return f'{reason}, and no other number decides: give decimal = "," or "." in [pairs]'
