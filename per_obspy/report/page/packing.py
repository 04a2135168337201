"""Columns of a table as compact bytes for a browser: what the page shows, and what it exports."""

import json
import zlib
from base64 import b64encode
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pandas.api.types import is_bool_dtype, is_numeric_dtype

from per_obspy.errors import shortened
from per_obspy.inventory.places import place_columns

#: Bits of the fraction of a number that are stored: four digits, which is more than any is known.
FRACTION_BITS = 13

#: Coordinates are whole millionths of a degree, 0.1 m; the smallest whole number means unknown.
PLACES_PER_DEGREE = 1e6
UNKNOWN_PLACE = np.iinfo(np.int32).min

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
        Column -> ``number`` (four digits), ``whole`` (all digits), ``place`` (degrees), ``choice``
        (few different texts), ``names`` (words of the package, of which none may be cut) or
        ``text``.
    """
    # Data follow each other in the order of the descriptions
    columns, pieces = list[dict[str, Any]](), list[bytes]()
    for name, kind in kinds.items():
        if name not in table:
            continue
        described, data = _PACKERS[kind](table[name])
        columns.append({"name": name, "kind": kind, **described})
        pieces.append(data)
    return PackedTable({"count": len(table), "columns": columns}, b"".join(pieces))


def _numbers(column: pd.Series) -> tuple[dict[str, Any], bytes]:
    """Return numbers in single precision, their fractions rounded."""
    numbers = column.to_numpy(dtype=np.float32, na_value=np.nan)
    return {}, _planes(rounded(numbers))


def rounded(numbers: NDArray[np.float32]) -> NDArray[np.float32]:
    """
    Round the fractions of numbers to ``FRACTION_BITS``, so that they take few bytes deflated.

    Examples
    --------
    >>> rounded(np.array([0.1, np.inf], dtype=np.float32)).tolist()
    [0.09999847412109375, inf]
    """
    with np.errstate(invalid="ignore"):
        fraction, exponent = np.frexp(numbers)
        scale = np.float32(2.0 ** (FRACTION_BITS + 1))
        return np.ldexp(np.rint(fraction * scale) / scale, exponent).astype(np.float32)


def _wholes(column: pd.Series) -> tuple[dict[str, Any], bytes]:
    """Return whole numbers of up to nine digits."""
    numbers = column.to_numpy(dtype=np.float64, na_value=np.nan)
    known = np.isfinite(numbers)
    whole = np.where(known, numbers, 0.0).astype(np.int32)
    return {}, _planes(np.where(known, whole, np.int32(UNKNOWN_PLACE)))


def _places(column: pd.Series) -> tuple[dict[str, Any], bytes]:
    """Return degrees as whole numbers."""
    degrees = column.to_numpy(dtype=np.float64, na_value=np.nan)
    known = np.isfinite(degrees)
    whole = np.rint(np.where(known, degrees, 0.0) * PLACES_PER_DEGREE).astype(np.int32)
    return {}, _planes(np.where(known, whole, np.int32(UNKNOWN_PLACE)))


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
    "whole": _wholes,
    "place": _places,
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


#: Bytes of all columns for the export, deflated; the columns after them are left out.
MOST_BYTES = 1_500_000

#: Columns for the export: wide tables would make large pages.
MOST_COLUMNS = 300


def pack_export(pairs: pd.DataFrame, known: Collection[str]) -> PackedTable:
    """
    Pack the columns of pairs that the page does not show, in order, up to its size limit.

    Parameters
    ----------
    pairs : DataFrame
        The pairs of the page.
    known : collection of str
        Columns that the page holds already.

    Returns
    -------
    PackedTable
        Its description has ``left_out``, the names of columns for which there is no room.
    """
    # Columns of the package come first, those of the inventory after them
    names = [str(name) for name in pairs if str(name) not in known]
    packed, room, left_out = list[PackedTable](), MOST_BYTES, list[str]()
    for number, name in enumerate(names):
        column = pack_table(pairs, {name: _kind(pairs, name)})
        texts = "".join(column.description["columns"][0].get("texts", ()))
        size = len(zlib.compress(column.data + texts.encode("utf-8", "replace"), 1))
        # A column without room leaves it to smaller ones
        if number >= MOST_COLUMNS or size > room:
            left_out.append(name[:LONGEST_TEXT])
            continue
        room -= size
        packed.append(column)
    columns = [column.description["columns"][0] for column in packed]
    described = {"count": len(pairs), "columns": columns, "left_out": left_out}
    return PackedTable(described, b"".join(column.data for column in packed))


def _kind(pairs: pd.DataFrame, name: str) -> str:
    """Return the packing of a column: four digits for numbers, all digits for whole numbers."""
    column = pairs[name]
    if is_bool_dtype(column) or not is_numeric_dtype(column):
        return text_kind(pairs, name)
    numbers = column.to_numpy(dtype=np.float64, na_value=np.nan)
    numbers = numbers[np.isfinite(numbers)]
    is_whole = numbers.size and bool((numbers == np.rint(numbers)).all())
    largest = float(np.abs(numbers).max(initial=0.0))
    # Identifiers may be numbers, of which no digit may be lost
    if is_whole and 2.0**FRACTION_BITS < largest < 2.0**31:
        return "whole"
    return "number"


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
    found = place_columns(map(str, pairs))
    names = [name for name in pairs if str(name) == "place" or str(name) in found]
    if not names:
        return None
    # What is missing is empty
    columns = [pairs[name].astype(object).where(pairs[name].notna(), "") for name in names]
    joined = [_joined(row) for row in zip(*columns, strict=True)]
    return pd.Series(joined, index=pairs.index, dtype=str)


def _joined(names: Iterable[object]) -> str:
    """Join names in their order, without repetition."""
    texts = dict.fromkeys(str(name).strip() for name in names)
    return ", ".join(text for text in texts if text)
