"""
Words and units of tables: every word of headings and cells, and the units of every column.

``words.csv`` is the one table of words of all languages; the units have factors to those of the
schema and are checked against the dimension of their column.
"""

import csv
import math
from collections import defaultdict
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import NamedTuple
from unicodedata import combining, normalize

from per_obspy.errors import did_you_mean
from per_obspy.inventory.schema import COLUMNS

#: Standard acceleration of gravity, m/s² (3rd CGPM, 1901): a weight in kN is the mass it belongs
#: to.
GRAVITY = 9.80665

#: Unit of the schema -> units -> factor as a fraction. Foot, inch and pound are those of the
#: international agreement of 1959: 0.3048 m, 25.4 mm, 0.45359237 kg.
_UNITS: dict[str, dict[str, tuple[float, float]]] = {
    "m": {
        "m": (1, 1), "mm": (1, 1000), "cm": (1, 100), "dm": (1, 10), "km": (1000, 1),
        "ft": (3048, 10_000), "in": (254, 10_000), "yd": (9144, 10_000),
    },
    "m2": {"m2": (1, 1), "cm2": (1, 10_000), "ft2": (9_290_304, 100_000_000), "ha": (10_000, 1)},
    "kg": {
        "kg": (1, 1), "g": (1, 1000), "t": (1000, 1), "lb": (45_359_237, 100_000_000),
        "kN": (1000, GRAVITY), "MN": (1_000_000, GRAVITY), "kip": (453_592_370, 1_000_000),
    },
    "s": {"s": (1, 1), "ms": (1, 1000)},
    "degrees": {"deg": (1, 1), "rad": (180, math.pi)},
    "m/s": {"m/s": (1, 1), "km/s": (1000, 1), "cm/s": (1, 100), "ft/s": (3048, 10_000)},
    "1": {"1": (1, 1), "%": (1, 100)},
}  # fmt: skip


def plain_word(text: str) -> str:
    """
    Return a text in lower case, without accents and surrounding blanks, as words are compared.

    Examples
    --------
    >>> plain_word(" SEPARACIÓN "), plain_word("kat sayısı"), plain_word("BİTİŞİK")
    ('separacion', 'kat sayisi', 'bitisik')
    """
    decomposed = normalize("NFKD", normalize("NFKC", text).casefold())
    letters = "".join(letter for letter in decomposed if not combining(letter))
    return " ".join(letters.replace("ı", "i").split())


@cache
def word_rows() -> tuple[dict[str, str], ...]:
    """Return a row for each word of the table: ``meaning``, ``language``, ``sure``, ``word``."""
    text = files(__package__).joinpath("words.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return tuple({**row, "word": word} for row in rows for word in row.pop("words").split("|"))


@cache
def words(meaning: str) -> Mapping[str, frozenset[str]]:
    """
    Return the plain words of one meaning, longest first, each with its languages.

    Examples
    --------
    >>> "bitisik" in words("touching"), sorted(words("basement")["b"])
    (True, ['en', 'tr'])
    """
    languages = defaultdict[str, set[str]](set)
    for row in word_rows():
        if row["meaning"] == meaning:
            languages[plain_word(row["word"])].add(row["language"])
    return {word: frozenset(languages[word]) for word in sorted(languages, key=len, reverse=True)}


@cache
def named(kind: str) -> Mapping[str, str]:
    """
    Return plain word -> NAME, for all meanings ``kind.NAME``.

    Examples
    --------
    >>> named("system")["betonarme"], named("unit")["santimetre"]
    ('concrete_mrf', 'cm')
    """
    rows = [row for row in word_rows() if row["meaning"].startswith(f"{kind}.")]
    return {plain_word(row["word"]): row["meaning"].partition(".")[2] for row in rows}


class Unit(NamedTuple):
    """A unit as numerator and denominator of its factor, so that 7 cm are exactly 0.07 m."""

    #: As it is written.
    name: str
    #: ``value * numerator / denominator`` is in the unit of the schema.
    numerator: float
    denominator: float


def unit_of_schema(name: str) -> str:
    """Return the unit of a column of pairs or buildings; sides and storeys' heights are in m."""
    column = COLUMNS.get(name) or COLUMNS.get(f"{name}_1")
    return column.unit if column else "m"


def unit_of(text: str, column: str) -> Unit | None:
    """
    Return a unit in which a column may be given; None if the text is none for that column.

    Parameters
    ----------
    text : str
        As it is written, in any case and language of ``words.csv``.
    column : str
        Name of the schema, with or without the number of the building.

    Examples
    --------
    >>> unit_of("CM", "gap"), unit_of("cm", "mass_1"), unit_of("m", "system_1")
    (Unit(name='cm', numerator=1, denominator=100), None, None)
    """
    units = _UNITS.get(unit_of_schema(column), {})
    word = plain_word(text)
    name = next((name for name in units if name.lower() == word), named("unit").get(word, ""))
    return Unit(name, *units[name]) if name in units else None


def unit_problem(text: str, column: str) -> str:
    """Return why a text is no unit of a column, with those that are."""
    if column not in COLUMNS:
        return f"a pair table has no column {column!r}{did_you_mean(column, COLUMNS)}"
    units = _UNITS.get(COLUMNS[column].unit)
    if units is None:
        return f"{column} is text and has no unit"
    return f"{text!r:.40} is no unit of {column}, expected one of {', '.join(units)}"


def is_unit(text: str) -> bool:
    """
    Return whether a text is a unit of any column; a 1 is rather the number of a building.

    Examples
    --------
    >>> is_unit("mm"), is_unit("storeys")
    (True, False)
    """
    names = {name.lower() for units in _UNITS.values() for name in units} - {"1"}
    return plain_word(text) in names | set(named("unit"))
