"""The reference of the command line, from the program itself."""

import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer
from tables import code, table, write_page

from per_obspy.cli.application import app

INTRODUCTION = """
# Command line

Every command with its arguments and options, made from the program. `per-obspy COMMAND --help`
prints the same. Exit codes: 0 done, 2 wrong input (one line names file, field and value), 3 no
usable record or pair was left, 75 try again later, 130 interrupted.
"""


def write(folder: Path) -> None:
    """Write ``commands.md`` to the folder."""
    parts = [INTRODUCTION]
    for name, command in commands():
        parts += [f"## `per-obspy {name}`", _help(command), *_parameters(command)]
    write_page(folder / "commands.md", *parts)


def commands() -> Iterator[tuple[str, Any]]:
    """Yield every command with its name; commands of a group as ``group command``."""
    group: Any = typer.main.get_command(app)
    for name, command in group.commands.items():
        inner = getattr(command, "commands", {})
        if not inner or getattr(command, "invoke_without_command", False):
            yield name, command
        for sub, subcommand in inner.items():
            yield f"{name} {sub}", subcommand


def _help(command: Any) -> str:
    """Return the help of a command as Markdown."""
    text = inspect.cleandoc(command.help or "").replace("\b", "").replace("\f", "")
    text = re.sub(r"^Example: (.*)$", r"Example: `\1`", text, flags=re.MULTILINE)
    return text if "`" in text else text.replace("*", r"\*")


def _parameters(command: Any) -> Iterator[str]:
    """Yield the tables of arguments and of options."""
    kinds = {"argument": "arguments", "option": "options"}
    for kind, title in kinds.items():
        parameters = [
            parameter
            for parameter in command.params
            if parameter.param_type_name == kind and not getattr(parameter, "hidden", False)
        ]
        if parameters:
            yield table((title, "default", "help"), map(_row, parameters))


def _row(parameter: Any) -> tuple[str, str, str]:
    """Return name, default and help of a parameter."""
    names = [*parameter.opts, *parameter.secondary_opts]
    name = (parameter.metavar or parameter.name.upper()) if names == [parameter.name] else ""
    default = parameter.default
    shown = "" if default is None or default is False or callable(default) else str(default)
    required = "required" if parameter.required else code(shown)
    text = inspect.cleandoc(getattr(parameter, "help", None) or "")
    return code(name or ", ".join(names)), required, text
