"""
Row-by-row checks of a pair table against the schema, with every reason of a rejected row.

Each check works on whole columns. A row with a fault becomes a
:class:`~per_obspy.errors.Rejection`; the other rows are accepted.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Self
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
    BuildingRows,
    PairRows,
)
from per_obspy.inventory.schema import COLUMNS, ONE_OF, Column
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
    # Convert every cell and collect every fault of every row
    pairs, faults = _converted(table.assign(pair_id=row_names(table, lines)))
    identifiers = pairs["pair_id"]
    faults += _duplicates(identifiers, identifiers.duplicated() if repeated is None else repeated)
    with np.errstate(all="ignore"):
        faults += _impossible(PairRows(pairs))
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


class _Check(NamedTuple):
    """
    Rows that are impossible, and why.

    A reason is text with numbers of the row in braces and # for the building, or makes the text.
    """

    is_wrong: Callable[[Any], NDArray[np.bool_]]
    reason: str | Callable[[Any, int], str]
    of_buildings: bool = False


class _Numbers(dict[str, float]):
    """Numbers of a row by name."""

    def __init__(self, rows: PairRows | BuildingRows, row: int) -> None:
        super().__init__()
        self._rows, self._row = rows, row

    def __missing__(self, name: str) -> float:
        return float(getattr(self._rows, name)[self._row])


def _impossible(pair: PairRows) -> Iterator[Fault]:
    """Yield rows with values that contradict each other or the world."""
    for check in _CHECKS:
        for rows in pair.buildings if check.of_buildings else (pair,):
            for i in _rows(check.is_wrong(rows)):
                if isinstance(check.reason, str):
                    reason = check.reason.replace("_#", rows.suffix)
                    yield i, reason.format_map(_Numbers(rows, i))
                else:
                    yield i, check.reason(rows, i)


def _without_size(one: BuildingRows, i: int) -> str:
    """Return that a row has a building without size, with the notes on its cells."""
    group = [f"{name}{one.suffix}" for name in ("height", "storeys", "period")]
    notes = _noted(one.table, i, group)
    reason = f"none of {', '.join(group)} is a number, one is needed"
    return f"{reason}: {notes}" if notes else reason


def _too_far(pair: PairRows, i: int) -> str:
    """Return why positions lie too far from each other, with the usual mistake that explains it."""
    first, second = ((float(one.longitude[i]), float(one.latitude[i])) for one in pair.buildings)
    places = [
        f"(longitude_{k} = {place[0]:g}, latitude_{k} = {place[1]:g})"
        for k, place in enumerate((first, second), 1)
    ]
    apart = f"{pair.separation[i] / 1000:.3g} km apart"
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
    return f"the positions {' and '.join(places)} are {apart}{next(near, '')}"


def _is_same_building(pair: PairRows) -> NDArray[np.bool_]:
    """Return rows that name the same building twice."""
    if not (pair.has("building_id_1") and pair.has("building_id_2")):
        return np.zeros(len(pair.table), dtype=bool)
    first = pair.table["building_id_1"]
    return ((first == pair.table["building_id_2"]) & (first != "")).to_numpy(dtype=bool)


_CHECKS = (
    _Check(
        lambda one: np.isnan(one.height) & np.isnan(one.storeys) & np.isnan(one.period),
        _without_size,
        of_buildings=True,
    ),
    _Check(
        lambda one: (
            (one.height > 0.0) & (one.storeys > 0.0)
            & ((one.storey < STOREY_HEIGHTS[0]) | (one.storey > STOREY_HEIGHTS[1]))
        ),
        "height_# = {height:g} m with storeys_# = {storeys:g} makes floors of {storey:.3g} m, "
        f"outside {STOREY_HEIGHTS[0]:g} to {STOREY_HEIGHTS[1]:g} m",
        of_buildings=True,
    ),
    _Check(
        lambda pair: pair.contact_height > pair.lower_roof + CONTACT_TOLERANCE,
        "contact_height = {contact_height:g} m is above the lower building, {lower_roof:g} m",
    ),
    _Check(
        lambda pair: np.abs(pair.floor_offset) > pair.storey,
        lambda pair, i: (
            f"floor_offset = {abs(pair.floor_offset[i]):g} m is larger than a storey, "
            f"{pair.storey[i]:.3g} m"
        ),
    ),
    # Many programs write 0 for a missing position
    _Check(
        lambda one: (one.longitude == 0.0) & (one.latitude == 0.0),
        "longitude_# = latitude_# = 0 is a placeholder, not a position",
        of_buildings=True,
    ),
    _Check(lambda pair: pair.separation > LARGEST_SEPARATION, _too_far),
    _Check(
        _is_same_building,
        lambda pair, i: (
            f"building_id_1 = building_id_2 = {pair.table['building_id_1'].iloc[i]!r}: "
            "a building has no gap to itself"
        ),
    ),
    _Check(
        lambda pair: (pair.observed > 0.0) & (pair.observed < 1.0),
        "observed = {observed:g} is neither 0 nor 1",
    ),
)  # fmt: skip


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
