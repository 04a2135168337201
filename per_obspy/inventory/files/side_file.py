"""
The form of a table in a small file next to it: ``pairs.xlsx.toml`` for ``pairs.xlsx``.

``per-obspy pairs check --write`` writes it, every reader of the table takes it into account, and
the section ``[pairs]`` of a configuration comes before it.
"""

import json
from pathlib import Path

import tomlkit

from per_obspy.config import TableForm, load
from per_obspy.files import written_whole

#: Comment at the head of the side file.
_HEAD = """\
# How per-obspy reads {name}, the table next to this file; written by per-obspy pairs check --write.
# Columns of the pair table = "heading"; units. The same keys may be in [pairs] of a configuration.
"""


def side_file(table: Path) -> Path:
    """Return the path of the side file of a table, which need not exist."""
    return table.with_name(f"{table.name}.toml")


def form_of(table: Path, given: TableForm | None = None) -> TableForm:
    """
    Return the form of a table from its side file or a configuration.

    Parameters
    ----------
    table : Path
        The table.
    given : TableForm, optional
        From a configuration; its keys come first, in the tables of names and units one by one.

    Raises
    ------
    CatalogError
        If the side file of the table is wrong.
    """
    beside = side_file(table)
    form = load(beside, TableForm) if beside.is_file() else TableForm()
    if given is None:
        return form
    # Configured keys, and those names and units that are not configured
    changes = {name: getattr(given, name) for name in given.model_fields_set}
    for name in ("columns", "units"):
        changes[name] = {**getattr(form, name), **getattr(given, name)}
    return form.model_copy(update=changes)


def write_form(table: Path, form: TableForm) -> Path:
    """Write the form of a table next to it, and return the path."""
    path = side_file(table)
    with written_whole(path) as part:
        text = _HEAD.format(name=json.dumps(table.name, ensure_ascii=False)) + form_as_toml(form)
        part.write_text(text, encoding="utf-8")
    return path


def form_as_toml(form: TableForm, section: str = "") -> str:
    """
    Return the known parts of a form as TOML.

    Parameters
    ----------
    form : TableForm
        A form.
    section : str
        Name of its section; empty for the top of a file.

    Examples
    --------
    >>> print(form_as_toml(TableForm(decimal=",", units={"gap": "cm"}), "pairs"), end="")
    [pairs]
    decimal = ","
    <BLANKLINE>
    [pairs.units]
    gap = "cm"
    """
    values = form.model_dump(exclude_defaults=True)
    return tomlkit.dumps({section: values} if section else values)
