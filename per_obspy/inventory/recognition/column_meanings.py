"""Find the columns of the schema in a table, by configured names or by its headings."""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from per_obspy.config import TableForm
from per_obspy.errors import CatalogError, did_you_mean
from per_obspy.inventory.recognition.headings import (
    Heading,
    is_building_list,
    is_complete,
    proposals,
    recognised,
)
from per_obspy.inventory.recognition.units import Unit, unit_of, unit_problem
from per_obspy.inventory.recognition.words import plain_word
from per_obspy.inventory.schema import COLUMNS

#: Column with the name of the pair.
IDENTIFIER = "pair_id"


class Meanings(NamedTuple):
    """
    Columns of the schema in a table.

    Attributes
    ----------
    cells : tuple of str
        The header.
    columns : dict
        Position in the header -> meaning of the column.
    units : dict
        Column of the schema -> its unit, where that is not the schema's.
    """

    cells: tuple[str, ...]
    columns: dict[int, Heading]
    units: dict[str, Unit]

    @property
    def names(self) -> list[str]:
        """Names of the columns: those of the schema where they are recognised."""
        found = self.columns
        return [
            found[place].column if place in found else cell for place, cell in enumerate(self.cells)
        ]

    @property
    def renamed(self) -> dict[str, str]:
        """Column of the schema -> heading that is written otherwise."""
        named = {means.column: self.cells[place] for place, means in self.columns.items()}
        return {name: heading for name, heading in named.items() if name != heading}

    @property
    def language(self) -> str:
        """Language of most headings, empty if they are English or of none."""
        languages = Counter(heading.language for heading in self.columns.values())
        del languages[""], languages["en"]
        return languages.most_common(1)[0][0] if languages else ""

    def has_language(self, language: str) -> bool:
        """Return whether a heading is in a language."""
        return any(means.language == language for means in self.columns.values())

    def sentence(self) -> str:
        """Return the columns that are renamed or in other units as one text, empty if none is."""
        texts = []
        # In the order of the schema
        for name in COLUMNS:
            heading, unit = self.renamed.get(name), self.units.get(name)
            if heading or unit:
                named = f"{name} = {heading!r}" if heading else name
                texts.append(f"{named} in {unit.name}" if unit else named)
        if IDENTIFIER not in self.names and is_complete(set(self.names)):
            texts.append(f"no {IDENTIFIER}: each pair is named by its row, as 'row 2'")
        return ", ".join(texts)

    def as_form(self, form: TableForm) -> TableForm:
        """Return a form with the names and units that were recognised."""
        units = {name: unit.name for name, unit in self.units.items()}
        names = {**self.renamed, **form.columns}
        return form.model_copy(update={"columns": names, "units": {**units, **form.units}})

    def proposals(self) -> dict[str, list[str]]:
        """Return columns that are not found -> headings that may be meant."""
        possible = proposals(self.cells, self.columns)
        headings = {}
        for name, places in possible.items():
            headings[name] = [self.cells[place] for place in places]
        return headings

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
        known = ", ".join(texts)
        return f"; in [pairs.columns] give those that are meant: {known}" if texts else ""


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
    known = _given_places(cells, given, source, must_have)
    found = recognised(cells, known)
    # Units from the headings, and configured ones
    units = {means.column: means.unit for means in found.values() if means.unit is not None}
    for name, text in given.units.items():
        unit = unit_of(text, name) if name in COLUMNS else None
        if unit is None:
            raise CatalogError(source, f"[pairs.units] {name}: {unit_problem(text, name)}")
        units[name] = unit
    absent = set(given.units) - {means.column for means in found.values()}
    if absent and must_have:
        raise CatalogError(source, f"[pairs.units] {min(absent)}: the table has no such column")
    # The unit of the schema needs no conversion
    others = {name: unit for name, unit in units.items() if unit.numerator != unit.denominator}
    return Meanings(tuple(cells), found, others)


def _given_places(
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
            how = "no such heading" if not same else "more than one of it"
            meant = did_you_mean(heading, cells) if not same else ""
            problem = f"[pairs.columns] {name} = {heading!r:.60}: the table has {how}{meant}"
            raise CatalogError(source, problem)
    return places
