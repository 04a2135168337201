"""
Row-by-row checks of a pair table against the schema, with every reason of a rejected row.

Each check works on whole columns. A row with a fault becomes a
:class:`~per_obspy.errors.Rejection`; the other rows are accepted.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Self
from unicodedata import category

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, Rejection, did_you_mean
from per_obspy.inventory.cells import NOTES, read_columns, read_texts
from per_obspy.inventory.quantities import (
    LARGEST_SEPARATION,
    STOREY_HEIGHTS,
    PairRows,
)
from per_obspy.inventory.schema import COLUMNS, ONE_OF, Column, missing_columns
from per_obspy.inventory.table_columns import metres_between

#: A contact height may exceed the lower building by this much, m: heights are often rounded,
#: contact heights computed.
CONTACT_TOLERANCE = 1e-3

#: Longest name of a column, characters.
LONGEST_NAME = 200

#: Position of a row in the table, and the reason for its rejection.
Fault = tuple[int, str]


class Rejections(tuple[Rejection, ...]):
    """
    Rejected rows in the ``attrs`` of a table.

    pandas deep-copies ``attrs`` in every operation: half a second each for 1e5 rejections. The
    rows are immutable, so that copies may share them.
    """

    __slots__ = ()

    def __deepcopy__(self, memo: dict[int, object]) -> Self:
        return self


def checked_pairs(
    table: pd.DataFrame,
    source: str,
    lines: NDArray[np.int64] | None = None,
    repeated: NDArray[np.bool_] | None = None,
) -> pd.DataFrame:
    """
    Return the good rows of a pair table in the types and order of the schema.

    Parameters
    ----------
    table : DataFrame
        Numbers may still be text; columns that the schema does not know are carried through.
    source : str
        The file, for messages.
    lines : (n_rows,) ndarray of int, optional
        Line of each row in its file; if not given, rows follow a header in line 1.
    repeated : (n_rows,) ndarray of bool, optional
        Whether an earlier row of the inventory has the row's ``pair_id``; if not given, the table
        is the whole inventory.

    Returns
    -------
    pairs : DataFrame
        Accepted rows; ``pairs.attrs["rejected"]`` is a tuple of
        :class:`~per_obspy.errors.Rejection`.

    Raises
    ------
    CatalogError
        If a required column is missing, a column occurs twice, or there is no row.
    """
    check_columns([str(name) for name in table.columns], source)
    if table.empty and lines is None:
        raise CatalogError(source, "the table has no rows")
    if lines is None:
        lines = np.arange(2, len(table) + 2)
    # Every fault of every row: of cells, of names, and of values beside others
    pairs, faults = _converted(table.assign(pair_id=row_names(table.get("pair_id"), lines)))
    # Names of earlier rows, and values that contradict each other or the world
    names, rows = pairs["pair_id"], PairRows(pairs)
    again = (names.duplicated() if repeated is None else repeated) & (names != "")
    faults += [
        (i, f"pair_id = {names.iloc[i]!r} occurs in an earlier row already") for i in _rows(again)
    ]
    with np.errstate(all="ignore"):
        for check in (_impossible_sizes, _impossible_contacts, _impossible_places):
            faults += check(rows)
    return _accepted(pairs, faults, source, lines)


def _accepted(
    pairs: pd.DataFrame, faults: Iterable[Fault], source: str, lines: NDArray[np.int64]
) -> pd.DataFrame:
    """Return the rows without a fault, with a rejection of each other row and all its reasons."""
    reasons: dict[int, list[str]] = defaultdict(list)
    for position, reason in faults:
        reasons[position].append(reason)
    bad, names = sorted(reasons), pairs["pair_id"]
    is_good = np.ones(len(pairs), dtype=bool)
    is_good[bad] = False
    # Both in the order of the table
    accepted = pairs[is_good].reset_index(drop=True)
    accepted.attrs["rejected"] = Rejections(
        Rejection("pair", names.iloc[i], source, int(lines[i]), tuple(reasons[i])) for i in bad
    )
    return accepted


def row_names(given: pd.Series | None, lines: NDArray[np.int64], prefix: str = "") -> pd.Series:
    """Return the identifiers of pairs; where one has none the line of its row, with a prefix."""
    # Names as they are given, and lines for the others
    empty = pd.Series("", index=range(len(lines)), dtype=object)
    names = empty if given is None else read_texts("pair_id", given)[0]
    missing = np.flatnonzero(names == "").tolist()
    if missing:
        names = names.astype(object)
        names.iloc[missing] = pd.Index([f"{prefix}row {lines[row]}" for row in missing])
    return names if given is None else names.set_axis(given.index)


def check_columns(names: Sequence[str], source: str) -> None:
    """
    Check that a table has the columns it needs, each once.

    Raises
    ------
    CatalogError
        If a required column is missing or a column occurs twice.
    """
    _check_names(names, source)
    # Of groups one column is enough
    if missing := [" or ".join(group) for group in missing_columns(names)]:
        found = ", ".join(names) or "none"
        suggestion = did_you_mean(missing[0], set(names) - set(COLUMNS))
        absent = f"missing column {', '.join(missing)}"
        raise CatalogError(source, f"{absent} (columns found: {found:.200}){suggestion}")


def _check_names(names: Sequence[str], source: str) -> None:
    """Raise CatalogError if a name is too long, has a control character, or occurs twice."""
    counts = Counter(names)
    for name in names:
        if len(name) > LONGEST_NAME:
            problem = f"column {name[:20]}... has a name of {len(name)} characters"
            raise CatalogError(source, f"{problem}, at most {LONGEST_NAME} are allowed")
        # Line breaks, tabulators and the like
        if any(category(letter) in ("Cc", "Cs") for letter in name):
            raise CatalogError(source, f"column {name!r} has a control character in its name")
        if counts[name] > 1:
            raise CatalogError(source, f"column {name} occurs more than once")


def _converted(table: pd.DataFrame) -> tuple[pd.DataFrame, list[Fault]]:
    """
    Convert the cells of a table and collect the faults of those that cannot be converted.

    Columns come in the order of the schema, numbers as float64 and text stripped; unknown columns
    follow unchanged.
    """
    read = read_columns({name: table[name] for name in COLUMNS if name in table.columns})
    known = [name for name in COLUMNS if name in read]
    faults: list[Fault] = []
    for name in known:
        faults += _missing(COLUMNS[name], read)
        if COLUMNS[name].dtype != "str":
            faults += _out_of_range(COLUMNS[name], read[name].to_numpy())
    # Unknown columns as they are
    data = {name: read[name] for name in known}
    for name in table.columns.difference(known, sort=False):
        data[name] = table[name].reset_index(drop=True)
    return pd.DataFrame(data), faults


def _rows(mask: ArrayLike) -> list[int]:
    """Return the positions of the rows in which a mask is true."""
    rows: list[int] = np.flatnonzero(mask).tolist()
    return rows


def _missing(column: Column, read: Mapping[str, pd.Series]) -> list[Fault]:
    """Return a fault for each cell without a value in a column that every row needs."""
    if not column.required or column.may_be_empty:
        return []
    values = read[column.name]
    rows = _rows(values.isna() | (values == ""))
    return [(i, _noted(read, i, (column.name,)) or f"{column.name} is empty") for i in rows]


def _noted(columns: pd.DataFrame | Mapping[str, pd.Series], row: int, names: Sequence[str]) -> str:
    """Return the notes on some cells of a row, empty if there are none."""
    notes = columns[NOTES].iloc[row].split("; ") if NOTES in columns else []
    return "; ".join(note for note in notes if note.partition(" = ")[0] in names)


def _out_of_range(column: Column, number: FloatArray) -> list[Fault]:
    """Return a fault for each number outside the closed range of the schema."""
    # Range and unit as the message gives them
    unit = "" if column.unit == "1" else f" {column.unit}"
    if column.high < np.inf:
        allowed = f"{column.low:.6g} to {column.high:.6g}{unit}"
    else:
        allowed = f"{column.low:g}{unit} or more"
    faults = []
    for i in _rows((number < column.low) | (number > column.high)):
        hint = column.hint if abs(number[i]) > column.high else column.hint_below
        hint = f" ({hint})" if hint else ""
        faults.append((i, f"{column.name} = {number[i]:.9g}{unit} is outside {allowed}{hint}"))
    return faults


def _impossible_sizes(pair: PairRows) -> Iterator[Fault]:
    """Yield rows whose sizes are missing, or contradict each other."""
    # Of each building one size is needed
    for one, names in zip(pair.buildings, ONE_OF, strict=True):
        for i in _rows(np.isnan([one.height, one.storeys, one.period]).all(0)):
            reason = f"none of {', '.join(names)} is a number, one is needed"
            yield i, f"{reason}: {_noted(pair.table, i, names)}".removesuffix(": ")
    # Floors are neither lower than doors nor higher than halls
    low, high = STOREY_HEIGHTS
    for one in pair.buildings:
        height, storeys = one.height, one.storeys
        is_wrong = (one.storey < low) | (one.storey > high)
        for i in _rows((height > 0.0) & (storeys > 0.0) & is_wrong):
            sizes = (
                f"height{one.suffix} = {height[i]:g} m with storeys{one.suffix} = {storeys[i]:g} "
                "makes floors"
            )
            yield i, f"{sizes} of {one.storey[i]:.3g} m, outside {low:g} to {high:g} m"


def _impossible_contacts(pair: PairRows) -> Iterator[Fault]:
    """Yield rows whose contact or floors contradict the buildings."""
    contact, roof, storey = pair.contact_height, pair.lower_roof, pair.storey
    for i in _rows(contact > roof + CONTACT_TOLERANCE):
        where = f"above the lower building, {roof[i]:g} m"
        yield i, f"contact_height = {contact[i]:g} m is {where}"
    # The nearest floor
    offset = np.abs(pair.floor_offset)
    for i in _rows(offset > storey):
        yield i, f"floor_offset = {offset[i]:g} m is larger than a storey, {storey[i]:.3g} m"


def _impossible_places(pair: PairRows) -> Iterator[Fault]:
    """Yield rows of no two neighbours, and those in which pounding is seen in part."""
    # Many programs write 0 for a missing position
    for one in pair.buildings:
        for i in _rows((one.longitude == 0.0) & (one.latitude == 0.0)):
            names = f"longitude{one.suffix} = latitude{one.suffix}"
            yield i, f"{names} = 0 is a placeholder, not a position"
    for i in _rows(pair.separation > LARGEST_SEPARATION):
        yield i, _too_far(pair, i)
    # A building beside itself
    if pair.has("building_id_1") and pair.has("building_id_2"):
        name = pair.table["building_id_1"]
        for i in _rows((name == pair.table["building_id_2"]) & (name != "")):
            names = f"building_id_1 = building_id_2 = {name.iloc[i]!r}"
            yield i, f"{names}: a building has no gap to itself"
    for i in _rows((pair.observed > 0.0) & (pair.observed < 1.0)):
        yield i, f"observed = {pair.observed[i]:g} is neither 0 nor 1"


def _too_far(pair: PairRows, i: int) -> str:
    """Return why positions lie too far from each other, with the usual mistake that explains it."""
    first, second = ((float(one.longitude[i]), float(one.latitude[i])) for one in pair.buildings)
    places = " and ".join(
        f"(longitude_{k} = {place[0]:g}, latitude_{k} = {place[1]:g})"
        for k, place in enumerate((first, second), 1)
    )
    # Positions of the second building as they may be meant
    east, north = second
    other_ways = {
        "a longitude without its sign": (-east, north),
        "a latitude without its sign": (east, -north),
        "both without their sign": (-east, -north),
        "longitude and latitude exchanged in one of them": (north, east),
    }
    # The first way in which they would be neighbours
    near = (
        f": {way}?"
        for way, meant in other_ways.items()
        if np.hypot(*metres_between(*first, *meant)) <= LARGEST_SEPARATION
    )
    apart = f"{pair.separation[i] / 1000:.3g} km apart"
    return f"the positions {places} are {apart}{next(near, '')}"
