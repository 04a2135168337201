"""Headers of ``name: value`` lines."""

import re
from collections.abc import Mapping
from typing import NamedTuple

from per_obspy.formats.text.lines import Text, count, interval, number, refuse


class Field(NamedTuple):
    """A value and the line it stands on."""

    line: int
    value: str


Fields = Mapping[str, Field]


def read_fields(text: Text, stop: int, separator: str = ":") -> dict[str, Field]:
    """Return the named values of the lines before ``stop``; of repeated names the first."""
    fields: dict[str, Field] = {}
    for line, content in enumerate(text.lines[:stop]):
        name, found, value = content.partition(separator)
        if found:
            fields.setdefault(re.sub(r"\s+", " ", name.strip(" #")), Field(line, value.strip()))
    return fields


def field(text: Text, fields: Fields, name: str) -> Field:
    """Return a field that must be there and not be empty."""
    if name not in fields:
        refuse(text, 0, name, "the header has no such field")
    if not fields[name].value:
        refuse(text, fields[name].line, name, "empty")
    return fields[name]


def count_field(text: Text, fields: Fields, name: str) -> int:
    """Return a positive whole number that must be there."""
    found = field(text, fields, name)
    return count(text, found.line, name, found.value)


def interval_field(text: Text, fields: Fields, name: str) -> float:
    """Return a positive number that must be there."""
    found = field(text, fields, name)
    return interval(text, found.line, name, found.value)


def number_field(text: Text, fields: Fields, name: str) -> float | None:
    """Return a number, or None where the field is missing, empty or says that it is unknown."""
    found = fields.get(name)
    if found is None or found.value.lower() in ("", "none", "unknown", "-", "n/a"):
        return None
    return number(text, found.line, name, found.value)


def word_field(fields: Fields, name: str) -> str | None:
    """Return text, or None where the field is missing or empty."""
    return fields[name].value or None if name in fields else None
