"""
Row-by-row checks of a pair table against the schema: whole columns at a time, every reason of a row kept.

A row with a fault becomes a :class:`~per_obspy.errors.Rejection`; the others go on.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from per_obspy.checks import FloatArray
from per_obspy.constants import METRES_PER_DEGREE
from per_obspy.errors import CatalogError, Rejection, did_you_mean
from per_obspy.inventory.cells import numbers_in
from per_obspy.inventory.schema import COLUMNS, EMPTY, ONE_OF, Column

#: Height of one storey, m: a hall may have 12 m, but a floor of 28 m is a mistake in height or
#: storeys.
STOREY_HEIGHTS = (2.0, 12.0)

#: Largest distance between the two positions of a pair, m; neighbours' centres lie closer.
LARGEST_SEPARATION = 1000.0


#: Position of a row in the table, and what is wrong with it.
Fault = tuple[int, str]


class Rejections(tuple[Rejection, ...]):
    """
    Rejected rows as ``attrs`` of a table carry them.

    pandas deep-copies ``attrs`` in every operation: half a second each for 1e5 rejections. Nothing
    in here can change, so that copies may share it.
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
        Whether the row's ``pair_id`` stands in an earlier row of the inventory; if not given, the
        table is all of it.

    Returns
    -------
    pairs : DataFrame
        Accepted rows; ``pairs.attrs["rejected"]`` is a tuple of
        :class:`~per_obspy.errors.Rejection`.

    Raises
    ------
    CatalogError
        If a required column is missing, a column stands twice, or there is no row.
    """
    check_columns([str(name) for name in table.columns], source)
    if table.empty and lines is None:
        raise CatalogError(source, "the table has no rows")
    if lines is None:
        lines = np.arange(2, len(table) + 2)
    pairs, faults = _converted(table)
    faults += _duplicates(
        pairs["pair_id"], pairs["pair_id"].duplicated() if repeated is None else repeated
    )
    faults += [fault for check in _CHECKS for fault in check(pairs)]
    rejected = _rejections(pairs["pair_id"], faults, source, lines)
    bad = np.zeros(len(pairs), dtype=bool)
    bad[[position for position, _ in faults]] = True
    accepted = pairs[~bad].reset_index(drop=True)
    accepted.attrs["rejected"] = Rejections(rejected)
    return accepted


def check_columns(names: Sequence[str], source: str) -> None:
    """
    Check that a table has the columns it needs, each once.

    Raises
    ------
    CatalogError
        If a required column is missing or a column stands twice.
    """
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise CatalogError(source, f"column {twice[0]} stands more than once")
    missing = [
        column.name for column in COLUMNS.values() if column.required and column.name not in names
    ]
    missing += [" or ".join(group) for group in ONE_OF if not set(group) & set(names)]
    if missing:
        found = ", ".join(names)
        asked = "".join(did_you_mean(name, set(names) - set(COLUMNS)) for name in missing[:1])
        raise CatalogError(
            source, f"missing column {', '.join(missing)} (columns found: {found:.200}){asked}"
        )


def _converted(table: pd.DataFrame) -> tuple[pd.DataFrame, list[Fault]]:
    """Return the table in schema order with numbers as float64 and text stripped, and what could not be read."""
    known = [name for name in COLUMNS if name in table.columns]
    data: dict[str, pd.Series | FloatArray] = {}
    faults: list[Fault] = []
    for name in known:
        read = _texts if COLUMNS[name].dtype == "str" else _numbers
        data[name], found = read(COLUMNS[name], table[name])
        faults += found
    for name in table.columns.difference(known, sort=False):
        data[name] = table[name].reset_index(drop=True)
    return pd.DataFrame(data), faults


def _rows(mask: ArrayLike) -> list[int]:
    rows: list[int] = np.flatnonzero(mask).tolist()
    return rows


def _is_empty(values: pd.Series) -> NDArray[np.bool_]:
    return np.asarray(
        values.isna() | values.astype(str).str.strip().str.lower().isin(EMPTY), dtype=bool
    )


def _texts(column: Column, values: pd.Series) -> tuple[pd.Series, list[Fault]]:
    empty = _is_empty(values)
    text = values.astype(str).str.strip().mask(empty, "").reset_index(drop=True)
    faults = _missing(column, empty)
    if column.choices:
        wrong = _rows(~text.isin([*column.choices, ""]))
        allowed = ", ".join(column.choices)
        faults += [
            (i, f"{column.name} = {text.iloc[i]!r} is unknown, expected {allowed}") for i in wrong
        ]
    return text, faults


def _numbers(column: Column, values: pd.Series) -> tuple[FloatArray, list[Fault]]:
    if pd.api.types.is_numeric_dtype(values.dtype):
        number = values.to_numpy(dtype=np.float64, na_value=np.nan)
        return number, _missing(column, np.isnan(number)) + _out_of_range(column, number)
    empty = _is_empty(values)
    number = pd.to_numeric(values.astype(str).mask(empty), errors="coerce").to_numpy(
        dtype=np.float64, na_value=np.nan
    )
    wrong = _rows(np.isnan(number) & ~empty)
    faults = [(i, f"{column.name} = {str(values.iloc[i])!r:.40} is not a number") for i in wrong]
    return number, faults + _missing(column, empty) + _out_of_range(column, number)


def _missing(column: Column, empty: NDArray[np.bool_]) -> list[Fault]:
    return [(i, f"{column.name} is empty") for i in _rows(empty)] if column.required else []


def _out_of_range(column: Column, number: FloatArray) -> list[Fault]:
    unit = "" if column.unit == "1" else f" {column.unit}"
    allowed = (
        f"{column.low:.6g} to {column.high:.6g}{unit}"
        if column.high < np.inf
        else f"{column.low:g}{unit} or more"
    )
    faults = []
    for i in _rows((number < column.low) | (number > column.high)):
        hint = f" ({column.hint})" if column.hint and abs(number[i]) > column.high else ""
        faults.append((i, f"{column.name} = {number[i]:.9g}{unit} is outside {allowed}{hint}"))
    return faults


def _duplicates(identifiers: pd.Series, repeated: ArrayLike) -> Iterator[Fault]:
    for i in _rows(np.asarray(repeated) & (identifiers != "").to_numpy()):
        yield i, f"pair_id = {identifiers.iloc[i]!r} stands in an earlier row already"


def _sizes(pairs: pd.DataFrame) -> Iterator[Fault]:
    """Yield rows in which a building has neither height nor storeys nor period."""
    for group in ONE_OF:
        known = [~np.isnan(numbers_in(pairs, name)) for name in group]
        for i in _rows(~np.any(known, axis=0)):
            yield i, f"none of {', '.join(group)} is a number, one is needed"


def _storey_heights(pairs: pd.DataFrame) -> Iterator[Fault]:
    low, high = STOREY_HEIGHTS
    for index in (1, 2):
        height, storeys = (
            numbers_in(pairs, f"height_{index}"),
            numbers_in(pairs, f"storeys_{index}"),
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            storey = height / storeys
        for i in _rows((height > 0) & (storeys > 0) & ((storey < low) | (storey > high))):
            yield (
                i,
                f"height_{index} = {height[i]:g} m with storeys_{index} = {storeys[i]:g} makes floors of "
                f"{storey[i]:.3g} m, outside {low:g} to {high:g} m",
            )


def _contact_heights(pairs: pd.DataFrame) -> Iterator[Fault]:
    contact = numbers_in(pairs, "contact_height")
    lower = np.fmin(numbers_in(pairs, "height_1"), numbers_in(pairs, "height_2"))
    # heights are often rounded, contact heights computed: a millimetre does not matter
    for i in _rows(contact > lower + 1e-3):
        yield i, f"contact_height = {contact[i]:g} m is above the lower building, {lower[i]:g} m"


def _positions(pairs: pd.DataFrame) -> Iterator[Fault]:
    """Yield rows whose buildings are no neighbours, or stand where a missing position is written as 0, 0."""
    place = {
        name: numbers_in(pairs, name)
        for name in ("longitude_1", "latitude_1", "longitude_2", "latitude_2")
    }
    for index in (1, 2):
        nowhere = (place[f"longitude_{index}"] == 0.0) & (place[f"latitude_{index}"] == 0.0)
        for i in _rows(nowhere):
            yield i, f"longitude_{index} = latitude_{index} = 0 is a placeholder, not a position"
    north = place["latitude_2"] - place["latitude_1"]
    east = (place["longitude_2"] - place["longitude_1"] + 180.0) % 360.0 - 180.0
    distance = METRES_PER_DEGREE * np.hypot(north, east * np.cos(np.deg2rad(place["latitude_1"])))
    on_earth = np.all([np.abs(place[name]) <= COLUMNS[name].high for name in place], axis=0)
    for i in _rows(on_earth & (distance > LARGEST_SEPARATION)):
        yield (
            i,
            f"the positions (longitude_1 = {place['longitude_1'][i]:g}, latitude_1 = {place['latitude_1'][i]:g}) and "
            f"(longitude_2 = {place['longitude_2'][i]:g}, latitude_2 = {place['latitude_2'][i]:g}) are "
            f"{distance[i] / 1000:.3g} km apart",
        )


def _same_building(pairs: pd.DataFrame) -> Iterator[Fault]:
    if {"building_id_1", "building_id_2"} <= set(pairs.columns):
        same = (pairs["building_id_1"] == pairs["building_id_2"]) & (pairs["building_id_1"] != "")
        for i in _rows(same):
            yield (
                i,
                f"building_id_1 = building_id_2 = {pairs['building_id_1'].iloc[i]!r}: a building has no gap to itself",
            )


def _observations(pairs: pd.DataFrame) -> Iterator[Fault]:
    observed = numbers_in(pairs, "observed")
    for i in _rows((observed > 0.0) & (observed < 1.0)):
        yield i, f"observed = {observed[i]:g} is neither 0 nor 1"


_CHECKS = (_sizes, _storey_heights, _contact_heights, _positions, _same_building, _observations)


def _rejections(
    names: pd.Series, faults: list[Fault], source: str, lines: NDArray[np.int64]
) -> tuple[Rejection, ...]:
    reasons: dict[int, list[str]] = defaultdict(list)
    for position, reason in faults:
        reasons[int(position)].append(reason)
    return tuple(
        Rejection(
            "pair", names.iloc[position], source, int(lines[position]), tuple(reasons[position])
        )
        for position in sorted(reasons)
    )
