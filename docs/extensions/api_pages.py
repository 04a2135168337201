"""The reference of the public names, grouped by the room of the package they come from."""

import re
from itertools import groupby
from pathlib import Path

from tables import write_page

import per_obspy

#: Room of the package -> heading.
ROOMS = {
    "spectra": "Spectra",
    "pounding": "Gaps, impacts and correlation",
    "pounding.correlation": "Correlation of two responses",
    "pounding.history": "Exact histories",
    "pounding.mitigation": "Prevention",
    "pounding.yielding": "Yielding buildings",
    "processing": "Processing of records",
    "inventory": "Buildings and pairs",
    "screening": "Screening",
    "pipeline": "Whole runs",
}


def public_names() -> list[tuple[str, str]]:
    """Return room and name of every public name, in the order of the rooms."""
    stub = (Path(per_obspy.__file__).parent / "__init__.pyi").read_text(encoding="utf-8")
    found = re.findall(r"^from \.([\w.]+) import (\w+) as \w+$", stub, re.MULTILINE)
    rooms = list(ROOMS)
    names = [(_room(module), name) for module, name in found]
    return sorted(names, key=lambda one: (rooms.index(one[0]), one[1]))


def write(folder: Path) -> None:
    """Write ``api.rst`` to the folder."""
    parts = [
        "Python interface\n================",
        "Every public name. ``import per_obspy`` is enough: each is imported when it is first "
        "used. Units are SI; the examples run as tests.",
        ".. currentmodule:: per_obspy",
    ]
    for room, group in groupby(public_names(), key=lambda one: one[0]):
        listed = "\n".join(f"   {name}" for _, name in group)
        heading = ROOMS[room]
        parts.append(f"{heading}\n{'-' * len(heading)}")
        parts.append(f".. autosummary::\n   :toctree: api\n\n{listed}")
    write_page(folder / "api.rst", *parts)


def _room(module: str) -> str:
    """Return the longest room of a module that has a heading."""
    rooms = [room for room in ROOMS if f"{module}.".startswith(f"{room}.")]
    if not rooms:
        raise KeyError(f"docs/extensions/api_pages.py has no heading for {module}")
    return max(rooms, key=len)
