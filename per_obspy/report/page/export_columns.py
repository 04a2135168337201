"""Columns of pairs that the page holds for its export and its search only."""

import zlib
from collections.abc import Collection, Iterable

import numpy as np
import pandas as pd
from pandas.api.types import is_bool_dtype, is_numeric_dtype

from per_obspy.report.page.packing import (
    FRACTION_BITS,
    LONGEST_TEXT,
    MOST_CHOICES,
    PackedTable,
    pack_table,
)

#: Bytes of all columns for the export, deflated; the columns after them are left out.
MOST_BYTES = 1_500_000

#: Columns for the export: wide tables would make large pages.
MOST_COLUMNS = 300

#: Names of columns that hold names of places, without _1 and _2 and the prefix of OpenStreetMap.
PLACE_NAMES = frozenset(
    (
        *("address", "street", "housenumber", "place", "city", "town", "village", "hamlet"),
        *("district", "suburb", "neighbourhood", "neighborhood", "quarter", "municipality"),
        *("county", "province", "region", "postcode", "calle", "ciudad", "barrio", "colonia"),
        *("municipio", "distrito", "canton", "provincia", "localidad", "direccion"),
    )
)


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
    names = [name for name in pairs if _is_place(str(name))]
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


def _is_place(name: str) -> bool:
    """Return whether a column contains names of places, by its name."""
    stem = name.lower().removesuffix("_1").removesuffix("_2").rsplit(":", 1)[-1]
    return stem in PLACE_NAMES
