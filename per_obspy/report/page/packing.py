"""Columns of a table as compact bytes for a browser."""

import json
import zlib
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.errors import shortened
from per_obspy.inventory.places import place_columns
from per_obspy.results.table_files import CONTACT_DIGITS
from per_obspy.screening.columns import BY_CONTACT

#: Significant digits of numbers: more than any is known.
DIGITS = 4

#: Power of ten of the smallest number that is told from 0.
LOWEST = -300

#: Coordinates are whole millionths of a degree, 0.1 m.
PLACES_PER_DEGREE = 1e6

#: Whole numbers that mean unknown and infinite.
UNKNOWN, INFINITE = np.iinfo(np.int32).min, np.iinfo(np.int32).max

#: Longest name on the page, characters: an inventory may have identifiers of any length.
LONGEST_TEXT = 120

#: Longest text of flags or columns of the package separated by blanks, characters.
LONGEST_NAMES = 4_000

#: Of deflate: the highest, 9, takes seven times as long and makes a page 1.4 % smaller.
LEVEL = 6

#: Largest number of different texts that are stored once each, with a number per row.
MOST_CHOICES = 65_536


class PackedTable(NamedTuple):
    """
    Columns of a table as bytes.

    Attributes
    ----------
    description : dict
        Number of rows, and name, kind and texts of each column.
    data : bytes
        The columns one after the other.
    """

    description: dict[str, Any]
    data: bytes


def pack_table(table: pd.DataFrame, kinds: Mapping[str, str]) -> PackedTable:
    """
    Pack columns of a table; missing columns are left out.

    Parameters
    ----------
    table : DataFrame
        Its rows keep their order.
    kinds : mapping of str to str
        Column -> ``number`` (four digits, two by the contact law), ``chance`` (a probability),
        ``whole`` (all digits), ``place`` (degrees), ``choice`` (few different texts), ``names``
        (words of the package, of which none may be cut) or ``text``.
    """
    # Data follow each other in the order of the descriptions
    columns, pieces = list[dict[str, Any]](), list[bytes]()
    places = dict[str, NDArray[np.int32]]()
    for name, kind in kinds.items():
        if name not in table:
            continue
        if kind == "place":
            described, data = _places(table[name], places)
        else:
            described, data = _PACKERS[kind](table[name])
        columns.append({"name": name, "kind": kind, **described})
        pieces.append(data)
    return PackedTable({"count": len(table), "columns": columns}, b"".join(pieces))


def _numbers(column: pd.Series) -> tuple[dict[str, Any], bytes]:
    """Return numbers with the digits of their column."""
    digits = CONTACT_DIGITS if column.name in BY_CONTACT else DIGITS
    return {"digits": digits}, _planes(decimals(_values(column), digits))


def _chances(column: pd.Series) -> tuple[dict[str, Any], bytes]:
    """Return probabilities, of which none becomes 1 by rounding."""
    chance, nearest = _values(column), 1.0 - 10.0**-DIGITS
    chance = np.where(chance < 1.0, np.minimum(chance, nearest), chance)
    return {"digits": DIGITS}, _planes(decimals(chance, DIGITS))


def decimals(numbers: NDArray[np.float64], digits: int) -> NDArray[np.int32]:
    """
    Return the places of numbers among all decimal ones with some significant digits.

    The first is ``10**LOWEST``, each power of ten has nine tenths of the next one; 0 stays, and
    negative numbers have negative places.

    Examples
    --------
    >>> (decimals(np.array([1.0, 1.2, 9.96, 0.0]), 2) - decimals(np.array([1.0]), 2)).tolist()
    [0, 2, 90, -27001]
    """
    usable = np.isfinite(numbers) & (numbers != 0.0)
    safe = np.where(usable, np.maximum(np.abs(numbers), 10.0**LOWEST), 1.0)
    # A whole number of these digits and a power of ten; 9.96 has those of 10.0
    power = np.floor(np.log10(safe))
    first = 10 ** (digits - 1)
    whole = np.rint(safe / 10.0**power * first) - first
    place = np.where(usable, 1 + (power - LOWEST) * 9 * first + whole, 0.0)
    place = np.where(np.isinf(numbers), INFINITE, place)
    return np.where(np.isnan(numbers), UNKNOWN, np.copysign(place, numbers)).astype(np.int32)


def _values(column: pd.Series) -> NDArray[np.float64]:
    """Return the numbers of a column, NaN where there is none."""
    return column.to_numpy(dtype=np.float64, na_value=np.nan)


def _wholes(column: pd.Series) -> tuple[dict[str, Any], bytes]:
    """Return whole numbers of up to nine digits."""
    return {}, _planes(_whole(column))


def _whole(column: pd.Series, unit: float = 1.0) -> NDArray[np.int32]:
    """Return numbers in whole units, of which so many are 1."""
    numbers = _values(column)
    known = np.isfinite(numbers)
    whole = np.rint(np.where(known, numbers, 0.0) * unit).astype(np.int32)
    return np.where(known, whole, np.int32(UNKNOWN))


def _places(
    column: pd.Series, places: dict[str, NDArray[np.int32]]
) -> tuple[dict[str, Any], bytes]:
    """
    Return degrees as whole numbers: ends of a pair as steps from where they are expected.

    Building 1 is expected in the middle of the pair, building 2 as far from it on the other side.
    Numbers beyond 32 bits come round again here and in the browser.
    """
    axis = str(column.name).rpartition("_")[0]
    before = [name for name in (axis, f"{axis}_1") if name in places]
    whole = _whole(column, PLACES_PER_DEGREE)
    places[str(column.name)], others = whole, [places[name] for name in before]
    # Steps from there
    if len(others) == 2:
        whole = whole - (2 * others[0] - others[1])
    elif others:
        whole = whole - others[0]
    return {"before": before}, _planes(whole)


def _choices(column: pd.Series, longest: int = LONGEST_TEXT) -> tuple[dict[str, Any], bytes]:
    """Return the different texts, and the index of each row's text."""
    codes, texts = pd.factorize(column.fillna("").astype(str))
    if len(texts) > MOST_CHOICES:
        raise ValueError(f"{column.name}: {len(texts)} different texts are no choice")
    return {"texts": _short(texts, longest)}, codes.astype("<u2").tobytes()


def _names(column: pd.Series) -> tuple[dict[str, Any], bytes]:
    """Return choices that are long enough for many names."""
    return _choices(column, LONGEST_NAMES)


def _texts(column: pd.Series) -> tuple[dict[str, Any], bytes]:
    """Return the text of every row as part of the description."""
    return {"texts": _short(column.fillna("").astype(str))}, b""


def _short(texts: Any, longest: int = LONGEST_TEXT) -> list[str]:
    """Return texts without control characters, cut where they are long."""
    return [shortened(str(text), longest) for text in texts]


def _planes(values: NDArray[Any]) -> bytes:
    """Return four-byte numbers as four planes of bytes, which deflate better."""
    little = values.astype(values.dtype.newbyteorder("<"), copy=False)
    return little.view(np.uint8).reshape(-1, 4).T.tobytes()


_PACKERS = {
    "number": _numbers,
    "chance": _chances,
    "whole": _wholes,
    "choice": _choices,
    "names": _names,
    "text": _texts,
}


def encoded(content: Mapping[str, Any], tables: Sequence[PackedTable]) -> str:
    """
    Return content and tables as one deflated text of letters, digits, ``+``, ``/`` and ``=``.

    No part of it can be taken for markup. Its bytes are the length of a JSON text (four bytes,
    little endian), the JSON text, and the data of the tables.

    Parameters
    ----------
    content : mapping
        Whatever JSON can hold; without numbers that are not finite.
    tables : sequence of PackedTable
        Their descriptions are part of the content already, in this order.
    """
    text = json.dumps(content, ensure_ascii=False, allow_nan=False).encode("utf-8", "replace")
    data = b"".join([len(text).to_bytes(4, "little"), text, *(table.data for table in tables)])
    return b64encode(zlib.compress(data, LEVEL)).decode("ascii")


def text_kind(pairs: pd.DataFrame, name: str) -> str:
    """Return the packing of a column of texts; few different texts are stored once each."""
    if name not in pairs:
        return "text"
    return "choice" if pairs[name].nunique() < min(MOST_CHOICES, 0.5 * len(pairs) + 2) else "text"


def addresses(pairs: pd.DataFrame) -> "pd.Series[str] | None":
    """
    Return the place names of each pair as one text, None without such a column.

    Examples
    --------
    >>> addresses(pd.DataFrame({"street_1": ["Calle 5"], "addr:city_1": ["Lima"]})).tolist()
    ['Calle 5, Lima']
    """
    names = address_columns(pairs)
    if not names:
        return None
    # What is missing is empty
    columns = [pairs[name].astype(object).where(pairs[name].notna(), "") for name in names]
    # Each name once, in their order
    texts = (map(str.strip, map(str, row)) for row in zip(*columns, strict=True))
    joined = [", ".join(filter(None, dict.fromkeys(row))) for row in texts]
    return pd.Series(joined, index=pairs.index, dtype=str)


def address_columns(names: Iterable[Any]) -> list[Any]:
    """Return the columns of a table that say where a pair or building is."""
    known = list(names)
    places = place_columns(map(str, known))
    return [name for name in known if str(name) == "place" or str(name) in places]
