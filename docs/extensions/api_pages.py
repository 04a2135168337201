"""The reference of the public names, grouped by the room of the package they come from."""

import re
from itertools import groupby
from pathlib import Path

from tables import write_page

import per_obspy

#: Room or page of the package -> heading; pages of one heading are one section.
ROOMS = {
    "spectra": "Spectra",
    "pounding": "Gaps, impacts and correlation",
    "pounding.correlation": "Correlation of two responses",
    "pounding.stationary_ground": "Correlation of two responses",
    "pounding.row_history": "Exact histories",
    "pounding.pair_histories": "Exact histories",
    "pounding.relative": "Exact histories",
    "pounding.contact_elements": "Exact histories",
    "pounding.bumpers": "Prevention",
    "pounding.supplemental_damping": "Prevention",
    "pounding.linearization": "Yielding buildings",
    "pounding.equivalent_linear": "Yielding buildings",
    "processing": "Processing of records",
    "records": "Records",
    "inventory": "Buildings and pairs",
    "screening": "Screening",
    "runs": "Whole runs",
    "report": "Figures",
}


def public_names() -> list[tuple[str, str]]:
    """Return heading and name of every public name, in the order of the headings."""
    stub = (Path(per_obspy.__file__).parent / "__init__.pyi").read_text(encoding="utf-8")
    found = re.findall(r"^from \.([\w.]+) import (\w+) as \w+$", stub, re.MULTILINE)
    headings = list(dict.fromkeys(ROOMS.values()))
    names = [(_heading(module), name) for module, name in found]
    return sorted(names, key=lambda one: (headings.index(one[0]), one[1]))


def write(folder: Path) -> None:
    """Write ``api.rst`` to the folder."""
    parts = [
        "Python interface\n================",
        "Every public name. ``import per_obspy`` is enough: each is imported when it is first "
        "used. Units are SI; the examples run as tests.",
        ".. currentmodule:: per_obspy",
    ]
    for heading, group in groupby(public_names(), key=lambda one: one[0]):
        listed = "\n".join(f"   {name}" for _, name in group)
        parts.append(f"{heading}\n{'-' * len(heading)}")
        parts.append(f".. autosummary::\n   :toctree: api\n\n{listed}")
    write_page(folder / "api.rst", *parts)


def _heading(module: str) -> str:
    """Return the heading of a module, by the longest of the rooms that it is in."""
    rooms = [room for room in ROOMS if f"{module}.".startswith(f"{room}.")]
    if not rooms:
        raise KeyError(f"docs/extensions/api_pages.py has no heading for {module}")
    return ROOMS[max(rooms, key=len)]
