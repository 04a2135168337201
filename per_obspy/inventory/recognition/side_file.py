"""
The form of a table in a small file next to it: ``pairs.xlsx.toml`` for ``pairs.xlsx``.

``per-obspy pairs check --write`` writes it, every reader of the table takes it into account, and
the section ``[pairs]`` of a configuration comes before it.
"""

import json
from pathlib import Path

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
    # Single keys come before the tables of names and units
    values = form.model_dump(exclude_defaults=True)
    tables = [name for name in ("columns", "units") if values.get(name)]
    single = [f"{name} = {_text(value)}" for name, value in values.items() if name not in tables]
    parts = ["\n".join([f"[{section}]", *single] if section else single)] if single else []
    for name in tables:
        lines = [f"{key} = {_text(value)}" for key, value in values[name].items()]
        prefix = f"{section}." if section else ""
        parts.append("\n".join([f"[{prefix}{name}]", *lines]))
    return "\n\n".join(parts) + "\n"


def _text(value: str) -> str:
    """Return a text as TOML: its basic strings have the escapes of JSON."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
