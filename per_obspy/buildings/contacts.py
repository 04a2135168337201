"""
Contacts between numbered buildings, from the pairs of a table.

A building is known by its identifier. Pairs without identifiers have two separate buildings,
and so have pairs whose identifier belongs to buildings at different places.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import ArrayLike, NDArray

from per_obspy.checks import FloatArray
from per_obspy.constants import EARTH_RADIUS
from per_obspy.errors import Rejection

#: Largest distance between the positions that the pairs of a building give for it, m: a survey may
#: give the middle of each wall, and blocks are that long.
SAME_PLACE = 100.0

#: Properties in which two pairs of a building must agree within its row. The period is that in the
#: direction of the axis, which is common to a row.
PROPERTIES = (
    "height",
    "storeys",
    "period",
    "damping",
    "mass",
    "yield_displacement",
    "hardening",
)

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

#: A rejection, after the numbers by which those of all pieces of a table are ordered.
OrderedRejection = tuple[tuple[int, ...], Rejection]


class Contacts(NamedTuple):
    """Pairs as contacts between numbered buildings."""

    #: Numbers of buildings 1 and 2 from 0, in the order of their identifiers; behind these the
    #: buildings that belong to one pair only. Shape (n_pairs, 2).
    buildings: IntArray
    #: Numbers of the identifiers in the whole table; -1 for a building of one pair only. Shape
    #: (n_pairs, 2).
    codes: IntArray
    #: Identifiers of buildings 1 and 2; ``PAIR#1`` and ``PAIR#2`` are those of a pair without.
    names: tuple[pa.ChunkedArray, pa.ChunkedArray]
    #: From building 1 to 2, degrees; NaN if unknown. Shape (n_pairs,).
    azimuth: FloatArray
    #: m; NaN where the gap is unknown, 0 where the facing length is. Shape (n_pairs,).
    gap: FloatArray
    facing_length: FloatArray
    #: Columns that the table does not give.
    derived: "Derived"
    #: Identifiers of the pairs.
    pair_id: pa.ChunkedArray
    #: Place of each identifier in their alphabetical order, by which ties are broken. Shape
    #: (n_pairs,).
    order: IntArray
    #: Whether another pair describes the same contact. Shape (n_pairs,).
    repeated: BoolArray
    #: Whether an identifier of the pair belongs to buildings at different places. Shape (n_pairs,).
    ambiguous: BoolArray
    #: One for each ambiguous identifier and each repeated contact.
    rejected: list[OrderedRejection]


def contacts_of(pairs: pa.Table, angle: float) -> Contacts:
    """
    Return the contacts of a pair table with numbered buildings, without repeated descriptions.

    The table has ``pair_id, gap, derived, longitude_i, latitude_i, code_i`` (number of the
    identifier of building i in alphabetical order, -1 without one), and ``building_id_i, azimuth,
    facing_length`` where they are known. Pairs of the same two buildings are one contact if their
    axes differ by no more than an angle, degrees.
    """
    # Buildings and their contacts
    buildings, own, ambiguous, rejected = _number(pairs)
    gap, derived = numbers_in(pairs, "gap"), Derived(pairs["derived"])
    contacts = Contacts(
        buildings=buildings,
        codes=np.where(own, -1, _codes(pairs)),
        names=(_names(pairs, 1, own[:, 0]), _names(pairs, 2, own[:, 1])),
        azimuth=numbers_in(pairs, "azimuth"),
        gap=gap,
        facing_length=np.nan_to_num(numbers_in(pairs, "facing_length")),
        derived=derived,
        pair_id=pairs["pair_id"],
        order=pc.rank(pairs["pair_id"], tiebreaker="dense").to_numpy().astype(np.int64) - 1,
        repeated=np.zeros(gap.size, dtype=bool),
        ambiguous=np.logical_or(*ambiguous.T),
        rejected=rejected,
    )
    # Contacts that are described twice
    for pair, other in _repetitions(contacts, angle):
        contacts.repeated[pair] = True
        rejected.append(_repetition(contacts, pair, other))
    return contacts


def _codes(pairs: pa.Table) -> IntArray:
    """Return the numbers of the identifiers of both buildings in the whole table, (n_pairs, 2)."""
    return np.stack([pairs[f"code_{i}"].to_numpy() for i in (1, 2)], axis=1).astype(np.int64)


def _number(
    pairs: pa.Table,
) -> tuple[IntArray, BoolArray, BoolArray, list[OrderedRejection]]:
    """
    Return numbers of buildings 1 and 2, (n_pairs, 2), first those with an identifier.

    Then whether each belongs to its pair only, whether because its identifier has several places,
    and one rejection for each such identifier.
    """
    codes = _codes(pairs)
    occurring = np.unique(codes[codes >= 0])
    buildings = np.where(codes < 0, -1, np.searchsorted(occurring, codes))
    spread = _spread(pairs, codes)
    rejected = _ambiguous(pairs, buildings, spread, occurring)
    # The last entry is that of the number -1
    ambiguous = np.append(spread > SAME_PLACE, False)[buildings]
    own = (codes < 0) | ambiguous
    buildings[own] = occurring.size + np.arange(int(own.sum()))
    return buildings, own, ambiguous, rejected


def numbers_in(pairs: pa.Table, name: str) -> FloatArray:
    """Return a column of numbers, NaN in every row if the table has no such column."""
    if name not in pairs.column_names:
        return np.full(pairs.num_rows, np.nan)
    return np.asarray(pairs[name].to_numpy(), dtype=np.float64)


class Derived:
    """Columns of each row of a table that were derived or assumed, from texts of their names."""

    def __init__(self, texts: ArrayLike) -> None:
        # Many rows share few texts
        objects = np.asarray(texts, dtype=object)
        self._codes, distinct = pd.factorize(objects, use_na_sentinel=False)
        self._columns = [str(text).split() for text in distinct]

    def has(self, column: str) -> BoolArray:
        """Return in which rows a column was derived."""
        return np.array([column in columns for columns in self._columns], dtype=bool)[self._codes]


def given_values(pairs: pa.Table, derived: Derived, name: str) -> FloatArray:
    """
    Return one of ``PROPERTIES`` of buildings 1 and 2 as far as the table gives it, (n_pairs, 2).

    NaN where a value is missing, derived, assumed, or infinite.
    """
    sides = []
    for i in (1, 2):
        values = numbers_in(pairs, f"{name}_{i}")
        is_given = np.isfinite(values) & ~derived.has(f"{name}_{i}")
        # Without a yield displacement a hardening of 0 is assumed
        if name == "hardening":
            is_given &= np.isfinite(numbers_in(pairs, f"yield_displacement_{i}"))
        sides.append(np.where(is_given, values, np.nan))
    return np.stack(sides, axis=1)


def _spread(pairs: pa.Table, codes: IntArray) -> FloatArray:
    """Return the diagonal of the box around the positions of each identifier, m."""
    # Ends in the order of their buildings, those without an identifier first
    ends = np.argsort(codes.ravel(), kind="stable")[np.count_nonzero(codes < 0) :]
    first = np.flatnonzero(np.diff(codes.ravel()[ends], prepend=-1))
    angles = {}
    for name in ("latitude", "longitude"):
        sides = [numbers_in(pairs, f"{name}_{i}") for i in (1, 2)]
        angles[name] = np.radians(np.stack(sides, axis=1).ravel()[ends])
    # Boxes in space hold across the date line too; unknown positions count for none
    north, east = angles["latitude"], angles["longitude"]
    squares = np.zeros(first.size)
    for place in (np.cos(north) * np.cos(east), np.cos(north) * np.sin(east), np.sin(north)):
        squares += np.square(np.fmax.reduceat(place, first) - np.fmin.reduceat(place, first))
    return np.asarray(EARTH_RADIUS * np.sqrt(squares))


def _names(pairs: pa.Table, i: int, own: BoolArray) -> pa.ChunkedArray:
    """Return the identifiers of building i; that of its pair for some."""
    names = pc.binary_join_element_wise(pairs["pair_id"].cast(pa.string()), f"#{i}", "")
    if f"building_id_{i}" not in pairs.column_names:
        return names
    return pc.if_else(pa.array(own), names, pairs[f"building_id_{i}"].cast(pa.string()))


def _ambiguous(
    pairs: pa.Table, buildings: IntArray, spread: FloatArray, occurring: IntArray
) -> list[OrderedRejection]:
    """Return the rejections of identifiers of several places."""
    rejected = list[OrderedRejection]()
    for number in np.flatnonzero(spread > SAME_PLACE).tolist():
        # Any pair of the building has its identifier
        pair, side = np.argwhere(buildings == number)[0].tolist()
        name = str(pairs[f"building_id_{side + 1}"][pair])
        reason = (
            f"building_id = {name!r}: its pairs place it up to {spread[number]:.0f} m "
            f"apart, at most {SAME_PLACE:g} m are taken for one building: each pair has a "
            "separate building"
        )
        rejection = Rejection("building", name, "", None, (reason,))
        rejected.append(((1, int(occurring[number])), rejection))
    return rejected


def _repetitions(contacts: Contacts, angle: float) -> Iterator[tuple[int, int]]:
    """Yield pairs that repeat the contact of another one with at most their gap, and that one."""
    azimuth, ends = contacts.azimuth, np.sort(contacts.buildings, axis=1)
    # The narrowest gap comes first; only few pairs have the buildings of another
    order = np.lexsort([contacts.order, contacts.gap, ends[:, 1], ends[:, 0]])
    same = (ends[order][1:] == ends[order][:-1]).all(axis=1)
    different: list[int] = []
    for place in np.flatnonzero(same).tolist():
        before, pair = order[place : place + 2].tolist()
        if not (place and same[place - 1]):
            different = [before]
        # Axes in either direction; an unknown one agrees with all
        between = np.abs((azimuth[different] - azimuth[pair] + 90.0) % 180.0 - 90.0)
        alike = np.flatnonzero(~(between > angle))
        if alike.size:
            yield pair, different[alike[0]]
        else:
            different.append(pair)


def _repetition(contacts: Contacts, pair: int, other: int) -> OrderedRejection:
    """Return the rejection of a pair whose contact another one describes."""
    # Of the pair and of the other one
    names = [str(contacts.pair_id[number]) for number in (pair, other)]
    gaps = [_metres(contacts.gap[number]) for number in (pair, other)]
    reason = (
        f"it repeats the contact of pair {names[1]!r} between the same buildings: "
        f"rows take the gap of {gaps[1]} instead of {gaps[0]}"
    )
    place = 2, *np.sort(contacts.codes[pair]).tolist()
    return place, Rejection("row", names[0], "", None, (reason,))


def _metres(gap: float) -> str:
    """Return a gap as a text."""
    return f"{gap:g} m" if np.isfinite(gap) else "unknown width"
