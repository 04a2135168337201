"""Headers of ``name: value`` lines."""

import re
from collections.abc import Mapping
from typing import NamedTuple

from per_obspy.formats.text.lines import Text, count, finite_number, interval, refuse


class HeaderField(NamedTuple):
    """The value of a header field and its line."""

    line: int
    value: str


Fields = Mapping[str, HeaderField]

#: values that mark an unknown number
_UNKNOWN = ("", "none", "unknown", "-", "n/a")


def read_fields(text: Text, stop: int, separator: str = ":") -> dict[str, HeaderField]:
    """Read the named values of the lines before ``stop``; of repeated names the first counts."""
    fields: dict[str, HeaderField] = {}
    for line, content in enumerate(text.lines[:stop]):
        name, found, value = content.partition(separator)
        if found:
            single_spaced = re.sub(r"\s+", " ", name.strip(" #"))
            fields.setdefault(single_spaced, HeaderField(line, value.strip()))
    return fields


def required_field(text: Text, fields: Fields, name: str) -> HeaderField:
    """Return a field that must be there and not be empty."""
    if name not in fields:
        refuse(text, 0, name, "the header has no such field")
    if not fields[name].value:
        refuse(text, fields[name].line, name, "empty")
    return fields[name]


def count_field(text: Text, fields: Fields, name: str) -> int:
    """Return a positive whole number that must be there."""
    line, value = required_field(text, fields, name)
    return count(text, line, name, value)


def interval_field(text: Text, fields: Fields, name: str) -> float:
    """Return a positive number that must be there."""
    line, value = required_field(text, fields, name)
    return interval(text, line, name, value)


def number_field(text: Text, fields: Fields, name: str) -> float | None:
    """Return a number, or None where the field is missing, empty or marked as unknown."""
    field = fields.get(name)
    if field is None or field.value.lower() in _UNKNOWN:
        return None
    return finite_number(text, field.line, name, field.value)


def text_field(fields: Fields, name: str) -> str | None:
    """Return text, or None where the field is missing or empty."""
    return fields[name].value or None if name in fields else None
