"""
Text in cells of CSV files that no spreadsheet takes for a formula.

A text that begins like a formula is written with an apostrophe before it, which a spreadsheet
takes for the mark of text. The readers of the package take that apostrophe away again, so that an
identifier is the same in every file. Numbers stay as they are.
"""

import csv
import io
import re
from collections.abc import Iterable

import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from pandas.api.types import is_numeric_dtype

from per_obspy.errors import printable

# Signs of a formula, or of a command (DDE), also in full width; blanks before them and
# apostrophes as they are written
_SIGNS = "[=+\\-@|\uff1d\uff0b\uff0d\uff20\uff5c]"
FORMULA = rf"^'*\s*{_SIGNS}"
MARKED = rf"^'+\s*{_SIGNS}"

#: Text that is a number, with a sign or without.
NUMBER = r"^[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?$"

#: Characters that become blanks: those of control and format, as in :func:`~.errors.printable`.
_UNPRINTABLE = r"\pC"

_FORMULA, _NUMBER = re.compile(FORMULA), re.compile(NUMBER, re.ASCII)


def cell(value: object) -> object:
    """
    Return a text that a spreadsheet takes as text, on one line; numbers and the like as they are.

    Examples
    --------
    >>> cell("=1+1"), cell("-12.5"), cell("CI.CLC" + chr(10) + "x"), cell(0.5)
    ("'=1+1", '-12.5', 'CI.CLC x', 0.5)
    """
    if not isinstance(value, str):
        return value
    text = printable(value)
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.match(text) else text


def cells(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table whose names and texts are those of :func:`cell`."""
    plain = table.copy(deep=False)
    plain.attrs = {}
    if plain.columns.empty:
        return plain
    columns = [
        column if is_numeric_dtype(column) else column.map(cell) for _, column in plain.items()
    ]
    return pd.concat(columns, axis=1).set_axis(list(map(cell, plain.columns)), axis=1)


def arrow_cells(table: pa.Table) -> pa.Table:
    """Return a table whose texts are those of :func:`cell`; names stay."""
    for position, field in enumerate(table.schema):
        if pa.types.is_string(field.type) or pa.types.is_large_string(field.type):
            # Texts repeat: each is looked at once
            coded = table[position].combine_chunks().dictionary_encode()
            column = _arrow_texts(coded.dictionary).take(coded.indices)
            table = table.set_column(position, field.name, column)
    return table


def _arrow_texts(texts: pa.StringArray) -> pa.StringArray:
    """Return texts as those of :func:`cell`."""
    column = pc.replace_substring_regex(texts, _UNPRINTABLE, " ")
    # A mark of text before formulas that are no numbers
    is_formula = pc.match_substring_regex(column, FORMULA)
    is_number = pc.match_substring_regex(column, NUMBER)
    marked = pc.binary_join_element_wise("'", column, "")
    return pc.if_else(pc.and_not(is_formula, is_number), marked, column)


def header(names: Iterable[str]) -> str:
    """
    Return the header line of a CSV file.

    Examples
    --------
    >>> print(header(["gap", "=a, b"]), end="")
    gap,"'=a, b"
    """
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(map(cell, names))
    return line.getvalue()


def given_text(text: str) -> str:
    """
    Return a text without the apostrophe that :func:`cell` puts before a formula.

    Examples
    --------
    >>> given_text("'=1+1"), given_text("'s-Hertogenbosch")
    ('=1+1', "'s-Hertogenbosch")
    """
    return text[1:] if re.match(MARKED, text) else text


def given_texts(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """Return a column of texts as :func:`given_text` does."""
    marked = pc.match_substring_regex(column, MARKED)
    return pc.if_else(marked, pc.utf8_slice_codeunits(column, 1), column)
