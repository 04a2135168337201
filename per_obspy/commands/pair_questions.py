"""Questions of ``per-obspy pairs check`` about ambiguous column headings and units."""

import sys
from typing import TYPE_CHECKING

from per_obspy.errors import printable

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from per_obspy.config import TableForm
    from per_obspy.inventory.files.formats import PairFile


def is_terminal() -> bool:
    """Return whether standard input and output are a terminal."""
    return sys.stdin.isatty() and sys.stdout.isatty()


def asked_columns(path: "Path", form: "TableForm") -> "TableForm":
    """
    Ask for the headings of missing columns, and return the form of the table with them.

    Parameters
    ----------
    path : Path
        Pair table.
    form : TableForm
        Form of the table as far as it was recognised.
    """
    from per_obspy.inventory.files.formats import pair_file
    from per_obspy.inventory.files.headings import is_building_list
    from per_obspy.inventory.schema import missing_columns

    file = pair_file(path, form)
    columns = dict(form.columns)
    if is_building_list(file.headings):
        return form
    # What is missing, with the headings that may be meant first
    for name, *_ in missing_columns(file.names):
        proposed = file.meanings.proposals().get(name, [])
        heading = _choice(name, proposed, _unused(file, columns))
        if heading:
            columns[name] = heading
    return form.model_copy(update={"columns": columns})


def _unused(file: "PairFile", columns: "Mapping[str, str]") -> list[str]:
    """Return headings of a file without a known meaning."""
    used = {file.meanings.cells[place] for place in file.meanings.columns}
    return [cell for cell in file.meanings.cells if cell not in used | set(columns.values())]


def _choice(name: str, proposed: "Sequence[str]", others: "Sequence[str]") -> str:
    """Return the heading that the user chooses for a column, empty if none."""
    from per_obspy.inventory.schema import COLUMNS

    # The column, and the headings that may be meant
    column = COLUMNS[name]
    unit = f", {column.unit}" if column.unit not in ("", "1") else ""
    print(printable(f"{name} ({column.meaning}{unit}) is missing."))
    headings = [*proposed, *(heading for heading in others if heading not in proposed)]
    for number, heading in enumerate(headings, 1):
        print(printable(f"  {number} {heading}"))
    # Until the answer is one of them
    default = "1" if proposed else "0"
    while True:
        question = f"Which heading is it? number, or 0 for none [{default}]: "
        answer = input(question).strip() or default
        if answer == "0":
            return ""
        if answer.isdecimal() and int(answer) <= len(headings):
            return headings[int(answer) - 1]


def asked_units(units: "Mapping[str, str]") -> dict[str, str]:
    """Ask for the units of columns with implausible numbers, and return them."""
    from per_obspy.inventory.files.words import unit_of, unit_problem
    from per_obspy.inventory.schema import COLUMNS

    confirmed = dict[str, str]()
    for name, proposed in units.items():
        # Until the answer is a unit of the column
        known = COLUMNS[name].unit
        while True:
            question = f"Numbers of {name} look like {proposed}. Unit? [{proposed}; {known}]: "
            answer = input(question).strip() or proposed
            if answer == known or (known == "1" and answer in ("1", "no")):
                break
            if unit_of(answer, name):
                confirmed[name] = answer
                break
            print(unit_problem(answer, name))
    return confirmed
