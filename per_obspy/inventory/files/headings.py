"""
Columns of the schema in the header of a table: by configured names, or by its headings.

A heading may be in any case and language of ``words.csv``, with the number of the building
anywhere (``altura 1``, ``edificio 2 altura``, ``height_A``) and a unit behind its words
(``gap (cm)``, ``height_1_ft``).
"""

import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from functools import cache
from typing import NamedTuple
from unicodedata import normalize

from per_obspy.config import TableForm
from per_obspy.errors import CatalogError, did_you_mean
from per_obspy.inventory.files.words import (
    Unit,
    is_unit,
    plain_word,
    unit_of,
    unit_problem,
    word_rows,
    words,
)
from per_obspy.inventory.schema import COLUMNS, missing_columns

#: Column with the name of the pair.
IDENTIFIER = "pair_id"

#: Most headings, and longest one, in which words are sought.
MOST_HEADINGS, LONGEST_HEADING = 1000, 200

_INDICES = {"1": 1, "2": 2}
_LETTERS = {"a": 1, "b": 2}


class Heading(NamedTuple):
    """Meaning of a heading."""

    #: Name of the schema.
    column: str
    #: That of the heading, if it has one.
    unit: Unit | None = None
    #: Of the word: ``"en"``, ``"es"``, ...; empty for names of the schema and words of several
    #: languages.
    language: str = ""
    #: Whether the word has no other meaning in a pair table.
    is_sure: bool = True


class Meanings(NamedTuple):
    """Columns of the schema in a table."""

    #: The header.
    cells: tuple[str, ...]
    #: Position in the header -> meaning of the column.
    columns: dict[int, Heading]
    #: Column of the schema -> its unit, where it is configured or in the heading.
    units: dict[str, Unit]

    @property
    def names(self) -> list[str]:
        """Names of the columns: those of the schema where they are recognised."""
        names = list(self.cells)
        for place, means in self.columns.items():
            names[place] = means.column
        return names

    @property
    def renamed(self) -> dict[str, str]:
        """Column of the schema -> heading that is written otherwise."""
        headings = {means.column: self.cells[place] for place, means in self.columns.items()}
        return {name: heading for name, heading in headings.items() if name != heading}

    @property
    def other_units(self) -> dict[str, str]:
        """Column of the schema -> name of its unit, where that is not the schema's."""
        units = self.units.items()
        return {name: unit.name for name, unit in units if unit.numerator != unit.denominator}

    @property
    def language(self) -> str:
        """Language of most headings, empty if they are English or of none."""
        languages = Counter(heading.language for heading in self.columns.values())
        del languages[""], languages["en"]
        return languages.most_common(1)[0][0] if languages else ""

    def sentence(self) -> str:
        """Return the columns that are renamed or in other units as one text, empty if none is."""
        texts = []
        # In the order of the schema
        for name in COLUMNS:
            heading, unit = self.renamed.get(name), self.other_units.get(name)
            if heading or unit:
                text = f"{name} = {heading!r}" if heading else name
                texts.append(f"{text} in {unit}" if unit else text)
        if IDENTIFIER not in self.names and not missing_columns(self.names):
            texts.append(f"no {IDENTIFIER}: each pair is named by its row, as 'row 2'")
        return ", ".join(texts)

    def as_form(self, form: TableForm) -> TableForm:
        """Return a form with the names and units that were recognised."""
        columns, units = {**self.renamed, **form.columns}, {**self.other_units, **form.units}
        return form.model_copy(update={"columns": columns, "units": units})

    def proposals(self) -> dict[str, list[str]]:
        """Return columns that are not found -> headings that may be meant."""
        return {
            name: [self.cells[place] for place in claims]
            for name, claims in _claims(self.cells, self.columns).items()
        }

    def asked(self) -> str:
        """Return the mend of missing columns, as the end of a message; empty if none is known."""
        if is_building_list(self.cells):
            return (
                "; it is a list of buildings: a pair table has the gap and both buildings in each "
                "row, per-obspy pairs makes one of outlines"
            )
        texts = [
            f'{name} = "{heading}"'
            for name, headings in self.proposals().items()
            for heading in headings
        ]
        mend = "; in [pairs.columns] give those that are meant: "
        return mend + ", ".join(texts) if texts else ""


def meanings_of(
    cells: Sequence[str], given: TableForm, source: str, must_have: bool = True
) -> Meanings:
    """
    Return the columns of the schema in a table.

    Parameters
    ----------
    cells : sequence of str
        Its header.
    given : TableForm
        Names and units of the user, which come before those of the header.
    source : str
        The file, for messages.
    must_have : bool
        Whether every configured column and unit must be in the table.

    Raises
    ------
    CatalogError
        If one is not, or a unit is none of its column.
    """
    columns = recognised(cells, _configured(cells, given, source, must_have))
    # Units from the headings, and configured ones
    units = {means.column: means.unit for means in columns.values() if means.unit is not None}
    for name, text in given.units.items():
        unit = unit_of(text, name) if name in COLUMNS else None
        if unit is None:
            raise CatalogError(source, f"[pairs.units] {name}: {unit_problem(text, name)}")
        units[name] = unit
    absent = set(given.units) - {means.column for means in columns.values()}
    if absent and must_have:
        raise CatalogError(source, f"[pairs.units] {min(absent)}: the table has no such column")
    return Meanings(tuple(cells), columns, units)


def _configured(
    cells: Sequence[str], given: TableForm, source: str, must_have: bool
) -> dict[int, str]:
    """Return place in the header -> column, for the names of the user that are there."""
    places = dict[int, str]()
    plain = [plain_word(cell) for cell in cells]
    for name, heading in given.columns.items():
        if name not in COLUMNS:
            problem = f"[pairs.columns] {name}: a pair table has no such column"
            raise CatalogError(source, f"{problem}{did_you_mean(name, COLUMNS)}")
        # As it is written, else without regard to case and accents
        same = [place for place, cell in enumerate(cells) if cell == heading.strip()]
        same = same or [place for place, cell in enumerate(plain) if cell == plain_word(heading)]
        if len(same) == 1 and same[0] not in places:
            places[same[0]] = name
        elif must_have:
            # None of it, or several
            how = "more than one of it" if same else "no such heading"
            meant = "" if same else did_you_mean(heading, cells)
            problem = f"[pairs.columns] {name} = {heading!r:.60}: the table has {how}{meant}"
            raise CatalogError(source, problem)
    return places


def recognised(headings: Sequence[str], known: Mapping[int, str]) -> dict[int, Heading]:
    """
    Return the meaning of headings by their place.

    Parameters
    ----------
    headings : sequence of str
        The header of a table.
    known : mapping
        Place -> column of the schema, where the user has configured it.

    Returns
    -------
    meanings : dict
        Place -> meaning. If the names of the schema and those known make a whole table, other
        headings are left as they are; if two headings mean the same, neither is taken.
    """
    # Configured names, and those of the schema
    meanings = {place: Heading(column) for place, column in known.items()}
    for place, heading in enumerate(headings):
        if heading in COLUMNS and heading not in known.values():
            meanings.setdefault(place, Heading(heading))
    if not missing_columns([means.column for means in meanings.values()]):
        return meanings
    # Words that are sure, each for one column
    for claims in _claims(headings, meanings).values():
        sure = [(place, means) for place, means in claims.items() if means.is_sure]
        if len(sure) == 1:
            meanings.update(sure)
    return meanings


def _claims(
    headings: Sequence[str], meanings: Mapping[int, Heading]
) -> dict[str, dict[int, Heading]]:
    """Return the other columns -> places whose headings may mean them, with the meanings."""
    # Sure or not: one is taken if it is sure, else the user decides
    taken = {means.column for means in meanings.values()}
    claims: dict[str, dict[int, Heading]] = defaultdict(dict)
    for place, heading in enumerate(headings[:MOST_HEADINGS]):
        means = meaning(heading) if place not in meanings else None
        if means and means.column not in taken:
            claims[means.column][place] = means
    return dict(claims)


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
    text, unit_text = _split_unit(heading)
    means = _column_of(_tokens(text))
    if means is None or not unit_text:
        return means
    # A unit in the heading must be one of its column
    unit = unit_of(unit_text, means.column)
    return unit and means._replace(unit=unit)


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
    # A letter only at the end, as it may be a word
    if not indices and len(tokens) > 1 and tokens[-1] in _LETTERS:
        indices, rest = [_LETTERS[tokens[-1]]], tokens[:-1]
    if len(indices) > 1:
        return None
    # With and without the word for a building
    without = [token for token in rest if token not in words("building")]
    for tokens in (rest, without):
        word = _vocabulary().get(" ".join(tokens))
        name = "" if word is None else f"{word.column}_{indices[0]}" if indices else word.column
        if word and name in COLUMNS:
            return word._replace(column=name)
    return None


@cache
def _vocabulary() -> dict[str, Heading]:
    """
    Return plain words -> column without the number of the building.

    Words of two columns are left out; names of the schema come before the words of a language.
    """
    # Rows of the table by the words of a heading
    bare = dict.fromkeys(re.sub(r"_[12]$", "", name) for name in COLUMNS)
    rows: dict[str, list[dict[str, str]]] = defaultdict(list)
    for row in word_rows():
        if row["meaning"] in bare:
            rows[" ".join(_tokens(row["word"]))].append(row)
    vocabulary = {}
    for text, same in rows.items():
        columns = {row["meaning"] for row in same}
        languages = {row["language"] for row in same}
        if len(columns) == 1:
            # No particular language if several have the word
            language = languages.pop() if len(languages) == 1 else ""
            is_sure = all(row["sure"] == "yes" for row in same)
            vocabulary[text] = Heading(columns.pop(), None, language, is_sure)
    return vocabulary | {" ".join(_tokens(name)): Heading(name) for name in bare}


def _tokens(text: str) -> list[str]:
    """Return the words and numbers of a heading, without those that have no meaning."""
    tokens = re.findall(r"[^\W\d_]+|\d+", plain_word(text))
    return [token for token in tokens if token not in words("filler")] or tokens[:1]


def is_building_list(headings: Sequence[str]) -> bool:
    """
    Return whether headings have one position only, as lists of single buildings do.

    Examples
    --------
    >>> is_building_list(["id", "Longitude", "Latitude"]), is_building_list(["lon 1", "lat 1"])
    (True, False)
    """
    words = [_vocabulary().get(" ".join(_tokens(heading))) for heading in headings[:MOST_HEADINGS]]
    return {"longitude", "latitude"} <= {word.column for word in words if word and word.is_sure}
