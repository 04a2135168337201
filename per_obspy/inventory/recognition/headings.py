"""
Headings of a table taken for columns of the schema: other cases, languages, units and numbering.

``words.csv`` holds the words of each language and the sources of the terms. A heading may have
the number of the building anywhere (``altura 1``, ``edificio 2 altura``, ``height_A``) and a unit
behind its words (``gap (cm)``, ``height_1_ft``).
"""

import re
from collections import defaultdict
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple
from unicodedata import normalize

from per_obspy.inventory.recognition.units import Unit, is_unit, unit_of
from per_obspy.inventory.recognition.words import plain_word, word_rows, words
from per_obspy.inventory.schema import COLUMNS, ONE_OF

#: Most headings, and longest one, in which words are sought.
MOST_HEADINGS, LONGEST_HEADING = 1000, 200

_INDICES = {"1": 1, "2": 2}
_LETTERS = {"a": 1, "b": 2}


class Heading(NamedTuple):
    """
    Meaning of a heading.

    Attributes
    ----------
    column : str
        Name of the schema.
    unit : Unit or None
        That of the heading, if it has one.
    language : str
        Of the word: ``"en"``, ``"es"``, ...; empty for names of the schema and words of several
        languages.
    is_sure : bool
        Whether the word has no other meaning in a pair table.
    """

    column: str
    unit: Unit | None = None
    language: str = ""
    is_sure: bool = True


class _Word(NamedTuple):
    """
    A heading of ``words.csv``.

    Attributes
    ----------
    column : str
        Without the number of the building.
    language : str
        Empty if the word is one of several languages.
    is_sure : bool
        Whether it has no other meaning in a pair table.
    """

    column: str
    language: str
    is_sure: bool


@cache
def _words() -> dict[str, _Word]:
    """Return the headings by their plain form; those of two columns are left out."""
    columns_of_pairs = {re.sub(r"_[12]$", "", name) for name in COLUMNS}
    found: dict[str, list[dict[str, str]]] = defaultdict(list)
    for row in word_rows():
        if row["meaning"] in columns_of_pairs:
            found[_joined(_tokens(row["word"]))].append(row)
    # Words of one column, which may be words of several languages
    words = {}
    for text, same in found.items():
        columns = {row["meaning"] for row in same}
        if len(columns) == 1:
            # No particular language if several have the word
            languages = {row["language"] for row in same}
            language = languages.pop() if len(languages) == 1 else ""
            is_sure = all(row["sure"] == "yes" for row in same)
            words[text] = _Word(columns.pop(), language, is_sure)
    return words


@cache
def _bare_names() -> dict[str, str]:
    """Return the names of the schema without the number of the building, by their plain form."""
    names = {name: re.sub(r"_[12]$", "", name) for name in COLUMNS}
    return {_joined(_tokens(bare)): bare for bare in names.values()}


def _tokens(text: str) -> list[str]:
    """Return the words and numbers of a heading, without those that have no meaning."""
    found = re.findall(r"[^\W\d_]+|\d+", plain_word(text))
    return [token for token in found if token not in words("filler")] or found[:1]


def _joined(tokens: Sequence[str]) -> str:
    """Return words as one text."""
    return " ".join(tokens)


def meaning(heading: str) -> Heading | None:
    """
    Return the meaning of a single heading; None if it has none in the schema.

    Examples
    --------
    >>> meaning("Derz Genişliği (cm)").column, meaning("ALTURA 2").column, meaning("ward")
    ('gap', 'height_2', None)
    """
    if heading in COLUMNS:
        return Heading(heading)
    if not heading or len(heading) > LONGEST_HEADING:
        return None
    words, unit_text = _split_unit(heading)
    found = _column_of(_tokens(words))
    if found is None:
        return None
    # A unit in the heading must be one of its column
    unit = unit_of(unit_text, found.column) if unit_text else None
    return None if unit_text and unit is None else found._replace(unit=unit)


def _split_unit(heading: str) -> tuple[str, str]:
    """Return the words of a heading, and its unit: in brackets, or the last word behind a line."""
    inside = re.search(r"[(\[]([^()\[\]]*)[)\]]", normalize("NFKC", heading))
    if inside:
        text = inside[1].strip()
        rest = heading.replace(heading[inside.start() : inside.end()], " ")
        # Brackets may hold the number of the building, or its letter
        is_index = plain_word(text) in (*_INDICES, *_LETTERS)
        return (f"{rest} {text}", "") if is_index else (rest, text)
    # height_ft_1, height_1_ft, gap cm
    parts = re.split(r"[\s_,]+", heading.strip())
    number = parts.pop() if len(parts) > 2 and parts[-1] in _INDICES else ""
    if len(parts) > 1 and is_unit(parts[-1]):
        return " ".join([*parts[:-1], number]), parts[-1]
    return heading, ""


def _column_of(tokens: list[str]) -> Heading | None:
    """Return the column of the words of a heading, with the number of the building among them."""
    indices = [_INDICES[token] for token in tokens if token in _INDICES]
    rest = [token for token in tokens if token not in _INDICES]
    if not indices and len(tokens) > 1 and tokens[-1] in _LETTERS:
        indices, rest = [_LETTERS[tokens[-1]]], tokens[:-1]
    if len(indices) > 1:
        return None
    # With and without the word for a building
    without = [token for token in rest if token not in words("building")]
    for tokens in (rest, without):
        text = _joined(tokens)
        # Names of the schema come before the words of a language
        bare = _bare_names().get(text)
        word = _Word(bare, "", True) if bare else _words().get(text)
        name = "" if word is None else f"{word.column}_{indices[0]}" if indices else word.column
        if word and name in COLUMNS:
            return Heading(name, None, word.language, word.is_sure)
    return None


def missing_columns(names: set[str]) -> list[str]:
    """Return required columns that are not among these; of a group the first, if none of it is."""
    missing = [name for name, column in COLUMNS.items() if column.required and name not in names]
    return missing + [group[0] for group in ONE_OF if not names & set(group)]


def is_complete(names: set[str]) -> bool:
    """Return whether these columns of the schema are all that a pair table needs."""
    return not missing_columns(names)


def is_building_list(headings: Sequence[str]) -> bool:
    """
    Return whether headings have one position only, as lists of single buildings do.

    Examples
    --------
    >>> is_building_list(["id", "Longitude", "Latitude"]), is_building_list(["lon 1", "lat 1"])
    (True, False)
    """
    bare = {text: word for text, word in _bare_names().items() if word in ("longitude", "latitude")}
    words = {text: word.column for text, word in _words().items() if word.is_sure}
    found = {(bare | words).get(_joined(_tokens(heading))) for heading in headings[:MOST_HEADINGS]}
    return {"longitude", "latitude"} <= found


def recognised(headings: Sequence[str], known: dict[int, str]) -> dict[int, Heading]:
    """
    Return the meaning of headings by their place.

    Parameters
    ----------
    headings : sequence of str
        The header of a table.
    known : dict
        Place -> column of the schema, where the user has configured it.

    Returns
    -------
    found : dict
        Place -> meaning. If the names of the schema and those known make a whole table, other
        headings are left as they are; if two headings mean the same, neither is taken.
    """
    # Configured names, and those of the schema
    found = {place: Heading(column) for place, column in known.items()}
    for place, heading in enumerate(headings):
        if heading in COLUMNS and heading not in known.values():
            found.setdefault(place, Heading(heading))
    taken = {heading.column for heading in found.values()}
    if is_complete(taken):
        return found
    # Words that are sure, each for one column
    claims: dict[str, list[tuple[int, Heading]]] = defaultdict(list)
    for place, heading in enumerate(headings[:MOST_HEADINGS]):
        means = meaning(heading) if place not in found else None
        if means and means.is_sure and means.column not in taken:
            claims[means.column].append((place, means))
    return found | dict(claim[0] for claim in claims.values() if len(claim) == 1)


def proposals(headings: Sequence[str], found: dict[int, Heading]) -> dict[str, list[int]]:
    """Return columns that are not found -> places of the headings that may be meant."""
    # Sure or not, the user decides
    taken = {heading.column for heading in found.values()}
    possible: dict[str, list[int]] = defaultdict(list)
    for place, heading in enumerate(headings[:MOST_HEADINGS]):
        means = meaning(heading) if place not in found else None
        if means and means.column not in taken:
            possible[means.column].append(place)
    return dict(possible)
