"""Results as a workbook: one sheet per table, without formulas."""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from per_obspy.errors import shortened
from per_obspy.files import written_whole
from per_obspy.inventory.files.text_cells import FORMULA
from per_obspy.results.table_files import rounded_table

#: Largest number of rows of a sheet: a workbook is opened whole.
ROWS = 5000

#: Longest text of a cell, characters; a spreadsheet allows 32 767.
LONGEST_TEXT = 1000

_FORMULA = re.compile(FORMULA)


class Sheet(NamedTuple):
    """A table, of which the first ``ROWS`` rows are written, with the units of its columns."""

    name: str
    table: pd.DataFrame
    #: Columns without a unit have none.
    units: Mapping[str, str]
    #: Columns that are computed, besides those of every risk table: their numbers are rounded.
    own: Collection[str] = ()


def write_workbook(sheets: Sequence[Sheet], path: Path) -> None:
    """
    Write a workbook, whole or not at all: header and units stay in view, texts are texts.

    Parameters
    ----------
    sheets : sequence of Sheet
        In their order.
    path : Path
        ``.xlsx``. Needs the extra ``spreadsheet``.
    """
    from openpyxl import Workbook

    book = Workbook(write_only=True)
    for sheet in sheets:
        _add_sheet(book, sheet)
    with written_whole(path) as part:
        book.save(part)


def _add_sheet(book: Any, sheet: Sheet) -> None:
    """Add a sheet: names, units, then the rows."""
    page = book.create_sheet(sheet.name)
    names = [str(name) for name in sheet.table]
    # Two rows and the columns up to the name stay in view
    page.freeze_panes = "C3" if "rank" in names else "B3"
    page.append([_text_cell(page, name, bold=True) for name in names])
    page.append([_text_cell(page, sheet.units.get(name, ""), bold=False) for name in names])
    plain = rounded_table(sheet.table.head(ROWS), sheet.own)
    for row in plain.itertuples(index=False, name=None):
        page.append([_cell(page, value) for value in row])


def _cell(page: Any, value: object) -> object:
    """Return a value as a cell: numbers as numbers, missing values as empty, others as text."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    # A workbook has neither NaN nor infinity
    if isinstance(value, (int, float, np.integer, np.floating)):
        number = value.item() if isinstance(value, np.generic) else value
        if isinstance(number, int) or math.isfinite(number):
            return number
        return None if math.isnan(number) else _text_cell(page, str(number), bold=False)
    missing = value is None or value is pd.NA or value is pd.NaT or value == ""
    return None if missing else _text_cell(page, str(value), bold=False)


def _text_cell(page: Any, text: str, bold: bool) -> Any:
    """Return a cell of text, also where it begins like a formula."""
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.styles import Font

    cell = WriteOnlyCell(page, value="")
    cell.value = shortened(text, LONGEST_TEXT)
    # The library takes text that begins with = for a formula, a spreadsheet that is edited too
    cell.data_type = "s"
    if _FORMULA.match(text):
        cell.quotePrefix = True
    if bold:
        cell.font = Font(bold=True)
    return cell
