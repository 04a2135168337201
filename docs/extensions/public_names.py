"""
List the public names with their first lines in the docstring of the package.

``help(per_obspy)`` and ``per_obspy?`` print it. ``python docs/extensions/public_names.py`` writes
it again after a name or its first line has changed.
"""

import inspect
import sys
from itertools import groupby
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from api_pages import public_names

import per_obspy

MODULE = Path(per_obspy.__file__)

#: First and last line around the list.
BEGIN, END = "Public names\n------------\n", '"""\n\nimport lazy_loader'


def listing() -> str:
    """Return the public names by heading, each with the first line of its docstring."""
    parts = []
    for heading, group in groupby(public_names(), key=lambda one: one[0]):
        lines = (f"{name}\n    {first_line(name)}" for _, name in group)
        parts.append(f"**{heading}**\n\n" + "\n".join(lines))
    return "\n\n".join(parts) + "\n"


def first_line(name: str) -> str:
    """Return the first line of the docstring of a public name."""
    return (inspect.getdoc(getattr(per_obspy, name)) or "").partition("\n")[0]


def main() -> None:
    """Write the list into the package's docstring."""
    text = MODULE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    after = rest[rest.index(END) :]
    MODULE.write_text(f"{before}{BEGIN}{listing()}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
