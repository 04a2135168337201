"""
Row-by-row checks of a pair table against the schema, with every reason of a rejected row.

Each check works on whole columns. A row with a fault becomes a
:class:`~per_obspy.errors.Rejection`; the other rows are accepted.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Self
from unicodedata import category

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import CatalogError, Rejection, did_you_mean
from per_obspy.inventory.cells import NOTES, read_columns, read_texts
from per_obspy.inventory.schema import COLUMNS, ONE_OF, Column
from per_obspy.inventory.table_columns import metres_between, numbers_in

#: Height of one storey, m: a hall may have 12 m, but 28 m is a mistake in height or storeys.
STOREY_HEIGHTS = (2.0, 12.0)

#: Largest distance between the two positions of a pair, m; neighbours' centres lie closer.
LARGEST_SEPARATION = 1000.0

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
    # Convert every cell and collect every fault of every row
    pairs, faults = _converted(table.assign(pair_id=row_names(table, lines)))
    identifiers = pairs["pair_id"]
    faults += _duplicates(identifiers, identifiers.duplicated() if repeated is None else repeated)
    for check in _CHECKS:
        faults += check(pairs)
    # Separate the rows without a fault from the rejected ones
    rejected = _rejections(identifiers, faults, source, lines)
    is_faulty = np.zeros(len(pairs), dtype=bool)
    is_faulty[[position for position, _ in faults]] = True
    accepted = pairs[~is_faulty].reset_index(drop=True)
    accepted.attrs["rejected"] = Rejections(rejected)
    return accepted


def row_names(table: pd.DataFrame, lines: NDArray[np.int64], prefix: str = "") -> pd.Series:
    """
    Return the identifiers of pairs, the number of its row where a pair has none.

    Parameters
    ----------
    table : DataFrame
        With or without the column ``pair_id``.
    lines : (n_rows,) ndarray of int
        Line of each row in its file.
    prefix : str, optional
        What names the file, where an inventory has several.
    """
    # Names as they are given, and numbers for the others
    empty = pd.Series("", index=range(len(table)), dtype=object)
    names = read_texts("pair_id", table["pair_id"])[0] if "pair_id" in table else empty
    missing = np.flatnonzero(names == "")
    if missing.size:
        names = names.astype(object)
        numbers = [f"{prefix}row {lines[row]}" for row in missing.tolist()]
        names.iloc[missing.tolist()] = pd.Index(numbers)
    return names.set_axis(table.index)


def check_columns(names: Sequence[str], source: str) -> None:
    """
    Check that a table has the columns it needs, each once.

    Raises
    ------
    CatalogError
        If a required column is missing or a column occurs twice.
    """
    _check_names(names, source)
    # Required columns, and groups of which one column is enough
    required = [column.name for column in COLUMNS.values() if column.required]
    missing = [name for name in required if name not in names]
    missing += [" or ".join(group) for group in ONE_OF if not set(group) & set(names)]
    if missing:
        found = ", ".join(names) or "none"
        suggestion = did_you_mean(missing[0], set(names) - set(COLUMNS))
        absent = ", ".join(missing)
        raise CatalogError(
            source, f"missing column {absent} (columns found: {found:.200}){suggestion}"
        )


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


def _duplicates(identifiers: pd.Series, repeated: ArrayLike) -> Iterator[Fault]:
    """Yield rows whose ``pair_id`` an earlier row has."""
    for i in _rows(np.asarray(repeated) & (identifiers != "").to_numpy()):
        yield i, f"pair_id = {identifiers.iloc[i]!r} occurs in an earlier row already"


def _sizes(pairs: pd.DataFrame) -> Iterator[Fault]:
    """Yield rows in which a building has neither height nor storeys nor period."""
    for group in ONE_OF:
        known = [~np.isnan(numbers_in(pairs, name)) for name in group]
        for i in _rows(~np.any(known, axis=0)):
            reason = f"none of {', '.join(group)} is a number, one is needed"
            notes = _noted(pairs, i, group)
            yield i, f"{reason}: {notes}" if notes else reason


def _storey_heights(pairs: pd.DataFrame) -> Iterator[Fault]:
    """Yield rows in which height over number of storeys is no height of a storey."""
    low, high = STOREY_HEIGHTS
    for index in (1, 2):
        height = numbers_in(pairs, f"height_{index}")
        storeys = numbers_in(pairs, f"storeys_{index}")
        # Mean height of a storey where both are known
        with np.errstate(divide="ignore", invalid="ignore"):
            storey = height / storeys
        is_outside = (storey < low) | (storey > high)
        for i in _rows((height > 0) & (storeys > 0) & is_outside):
            yield (
                i,
                f"height_{index} = {height[i]:g} m with storeys_{index} = {storeys[i]:g} "
                f"makes floors of {storey[i]:.3g} m, outside {low:g} to {high:g} m",
            )


def _contact_heights(pairs: pd.DataFrame) -> Iterator[Fault]:
    """Yield rows whose contact height is above the lower building."""
    contact = numbers_in(pairs, "contact_height")
    # Of a building without height the highest that its storeys may make
    roofs = []
    for i in (1, 2):
        height = numbers_in(pairs, f"height_{i}")
        highest = STOREY_HEIGHTS[1] * numbers_in(pairs, f"storeys_{i}")
        roofs.append(np.where(np.isnan(height), highest, height))
    lower = np.fmin(*roofs)
    for i in _rows(contact > lower + CONTACT_TOLERANCE):
        yield i, f"contact_height = {contact[i]:g} m is above the lower building, {lower[i]:g} m"


def _floor_offsets(pairs: pd.DataFrame) -> Iterator[Fault]:
    """Yield rows whose nearest floor would be further away than a storey."""
    offset = np.abs(numbers_in(pairs, "floor_offset"))
    # Of the building with the higher storeys
    with np.errstate(divide="ignore", invalid="ignore"):
        storey = np.fmax(
            *(numbers_in(pairs, f"height_{i}") / numbers_in(pairs, f"storeys_{i}") for i in (1, 2))
        )
    for i in _rows(offset > storey):
        yield i, f"floor_offset = {offset[i]:g} m is larger than a storey, {storey[i]:.3g} m"


def _placeholders(pairs: pd.DataFrame) -> Iterator[Fault]:
    """Yield rows with a building at 0, 0, which many programs write for a missing position."""
    for index in (1, 2):
        longitude = numbers_in(pairs, f"longitude_{index}")
        latitude = numbers_in(pairs, f"latitude_{index}")
        for i in _rows((longitude == 0.0) & (latitude == 0.0)):
            yield i, f"longitude_{index} = latitude_{index} = 0 is a placeholder, not a position"


def _separations(pairs: pd.DataFrame) -> Iterator[Fault]:
    """Yield rows whose buildings lie too far from each other for neighbours."""
    names = ("longitude_1", "latitude_1", "longitude_2", "latitude_2")
    # Far from each other, whatever the reason
    corners = [numbers_in(pairs, name) for name in names]
    distance = np.hypot(*metres_between(*corners))
    # Positions outside the range of the schema are a separate fault
    in_range = [np.abs(numbers_in(pairs, name)) <= COLUMNS[name].high for name in names]
    is_far = np.all(in_range, axis=0) & (distance > LARGEST_SEPARATION)
    for i in _rows(is_far):
        longitude_1, latitude_1, longitude_2, latitude_2 = (float(values[i]) for values in corners)
        first = f"(longitude_1 = {longitude_1:g}, latitude_1 = {latitude_1:g})"
        second = f"(longitude_2 = {longitude_2:g}, latitude_2 = {latitude_2:g})"
        apart = f"the positions {first} and {second} are {distance[i] / 1000:.3g} km apart"
        yield i, apart + _usual_mistake(longitude_1, latitude_1, longitude_2, latitude_2)


def _usual_mistake(
    longitude_1: float, latitude_1: float, longitude_2: float, latitude_2: float
) -> str:
    """Return the mistake without which two positions would be neighbours, empty if none is."""
    other_ways = {
        "a longitude without its sign": (-longitude_2, latitude_2),
        "a latitude without its sign": (longitude_2, -latitude_2),
        "both without their sign": (-longitude_2, -latitude_2),
        "longitude and latitude exchanged in one of them": (latitude_2, longitude_2),
    }
    # Positions of the second building as they may be meant
    for way, meant in other_ways.items():
        if np.hypot(*metres_between(longitude_1, latitude_1, *meant)) <= LARGEST_SEPARATION:
            return f": {way}?"
    return ""


def _same_building(pairs: pd.DataFrame) -> Iterator[Fault]:
    """Yield rows that name the same building twice."""
    if {"building_id_1", "building_id_2"} <= set(pairs.columns):
        first, second = pairs["building_id_1"], pairs["building_id_2"]
        for i in _rows((first == second) & (first != "")):
            yield (
                i,
                f"building_id_1 = building_id_2 = {first.iloc[i]!r}: "
                "a building has no gap to itself",
            )


def _observations(pairs: pd.DataFrame) -> Iterator[Fault]:
    """Yield rows whose observation is between 0 and 1."""
    observed = numbers_in(pairs, "observed")
    for i in _rows((observed > 0.0) & (observed < 1.0)):
        yield i, f"observed = {observed[i]:g} is neither 0 nor 1"


_CHECKS = (
    _sizes,
    _storey_heights,
    _contact_heights,
    _floor_offsets,
    _placeholders,
    _separations,
    _same_building,
    _observations,
)


def _rejections(
    identifiers: pd.Series, faults: list[Fault], source: str, lines: NDArray[np.int64]
) -> tuple[Rejection, ...]:
    """Return one rejection per faulty row, with its reasons in the order of the checks."""
    reasons: dict[int, list[str]] = defaultdict(list)
    for position, reason in faults:
        reasons[int(position)].append(reason)
    # Rows in the order of the table
    rejected = []
    for i in sorted(reasons):
        line = int(lines[i])
        rejected.append(Rejection("pair", identifiers.iloc[i], source, line, tuple(reasons[i])))
    return tuple(rejected)
