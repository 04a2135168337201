"""Lengths and counts as people write them: ``6 m``, ``20 ft``, ``7'4"``, ``6,5``."""

import re

import numpy as np
import pandas as pd

from per_obspy.inventory.checking import is_number
from per_obspy.inventory.schema import EMPTY

#: Metres per unit; the foot is the international one.
METRES = {
    **dict.fromkeys(("", "m", "metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("ft", "foot", "feet", "'", "′", "’"), 0.3048),
    **dict.fromkeys(("in", "inch", "inches", '"', "″", "”"), 0.0254),
    "cm": 0.01,
    "mm": 0.001,
}

#: A number with a decimal point or comma. Three digits after a comma may be thousands, and are none
#: of both.
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+|\d+,\d{1,2}|\d+,\d{4,})(?:[eE][+-]?\d+)?"
_LENGTH = re.compile(rf"({_NUMBER})\s*([^\W\d_]*|['′’\"″”])\.?", re.ASCII | re.IGNORECASE)
_FEET_AND_INCHES = re.compile(rf"(\d+)\s*(?:ft|['′’])\s*({_NUMBER})\s*(?:in|[\"″”])?", re.ASCII)
_COUNT = re.compile(_NUMBER, re.ASCII)

#: Longest text that is read as a number, characters.
LONGEST = 40


def metres(text: str) -> float:
    """
    Return a length in metres; NaN if it is none, or may be two.

    Parameters
    ----------
    text : str
        A number, and a unit of ``METRES`` or none. A single comma is a decimal one unless three
        digits follow, which may be thousands.

    Examples
    --------
    >>> metres("6,5 m"), round(metres("20 ft"), 4), round(metres("7'4"), 4), metres("12,500")
    (6.5, 6.096, 2.2352, nan)
    """
    plain = text.strip()[: LONGEST + 1]
    if len(plain) > LONGEST:
        return np.nan
    # Feet and inches together
    if both := _FEET_AND_INCHES.fullmatch(plain):
        return float(both[1]) * METRES["ft"] + _number(both[2]) * METRES["in"]
    found = _LENGTH.fullmatch(plain)
    if found is None or found[2].lower() not in METRES:
        return np.nan
    return _number(found[1]) * METRES[found[2].lower()]


def count(text: str) -> float:
    """
    Return a number without a unit; NaN if it is none, or may be two.

    Examples
    --------
    >>> count("3"), count("2,5"), count("2;3")
    (3.0, 2.5, nan)
    """
    plain = text.strip()[: LONGEST + 1]
    return _number(plain) if _COUNT.fullmatch(plain) else np.nan


def _number(text: str) -> float:
    """Return a number with a decimal point or comma."""
    return float(text.replace(",", "."))


def read_numbers(cells: pd.Series, is_length: bool) -> tuple[pd.Series, pd.Series]:
    """
    Return cells as numbers, lengths in metres, and which cells are text that is none.

    Parameters
    ----------
    cells : Series
        Numbers or text; truth values and dates are no numbers.
    is_length : bool
        Whether a unit may follow.

    Returns
    -------
    numbers : Series of float
        NaN in empty cells and in those that are no number.
    wrong : Series of bool
        Cells that are neither empty nor a number.
    """
    if is_number(cells):
        return cells.astype("float64"), pd.Series(False, index=cells.index)
    text = cells.astype(str).str.strip()
    empty = cells.isna() | text.str.lower().isin(EMPTY)
    # Each text once: a city has few heights
    convert = metres if is_length else count
    known = {value: convert(value) for value in text[~empty].unique()}
    numbers = text.map(known).astype("float64")
    return numbers, numbers.isna() & ~empty
