"""
Contacts between numbered buildings, from the pairs of a table.

A building is known by its identifier. Pairs without identifiers have two separate buildings,
and so have pairs whose identifier belongs to buildings at different places.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.dtypes import StringDType
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.constants import EARTH_RADIUS
from per_obspy.errors import Rejection
from per_obspy.inventory.building_rows.given import is_derived
from per_obspy.inventory.table_columns import numbers_in

#: Names that are converted together.
TOGETHER = 50_000

#: Largest distance between the positions that the pairs of a building give for it, m: a survey may
#: give the middle of each wall, and blocks are that long.
SAME_PLACE = 100.0

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


class Contacts(NamedTuple):
    """
    Pairs as contacts between numbered buildings.

    Attributes
    ----------
    buildings : (n_pairs, 2) ndarray of int
        Numbers of buildings 1 and 2.
    names : (n_buildings,) ndarray of str
        Identifier of each building; ``PAIR#1`` and ``PAIR#2`` are those of a pair without.
    named : (n_buildings,) ndarray of bool
        Whether the identifier is in the table.
    azimuth : (n_pairs,) ndarray
        From building 1 to 2, degrees; NaN if unknown.
    gap, facing_length : (n_pairs,) ndarray
        m; NaN where the gap is unknown, 0 where the facing length is.
    gap_given : (n_pairs,) ndarray of bool
        Whether the table gives the gap.
    pair_id : (n_pairs,) ndarray of str
        Identifiers of the pairs.
    order : (n_pairs,) ndarray of int
        Place of each identifier in their alphabetical order, by which ties are broken.
    repeated : (n_pairs,) ndarray of bool
        Whether another pair describes the same contact.
    ambiguous : (n_pairs,) ndarray of bool
        Whether an identifier of the pair belongs to buildings at different places.
    rejected : tuple of Rejection
        One for each repeated contact and each ambiguous identifier.
    places : tuple of tuple of int
        Buildings of each rejection, by whose numbers rejections are ordered: one for an ambiguous
        identifier, both for a repeated contact.
    """

    buildings: IntArray
    names: NDArray[np.object_]
    named: BoolArray
    azimuth: FloatArray
    gap: FloatArray
    facing_length: FloatArray
    gap_given: BoolArray
    pair_id: NDArray[np.object_]
    order: IntArray
    repeated: BoolArray
    ambiguous: BoolArray
    rejected: tuple[Rejection, ...]
    places: tuple[tuple[int, ...], ...]


def contacts_of(pairs: pd.DataFrame, angle: float) -> Contacts:
    """
    Return the contacts of a pair table with numbered buildings, without repeated descriptions.

    Parameters
    ----------
    pairs : DataFrame
        With ``pair_id, gap, derived, longitude_i, latitude_i``, and ``building_id_i, azimuth,
        facing_length`` where they are known.
    angle : float
        Pairs of the same two buildings are one contact if their axes differ by no more, degrees.

    Returns
    -------
    Contacts
    """
    # Buildings by their identifiers
    order, found_names = _sorted_codes(pairs["pair_id"])
    pair_id = found_names[order]
    codes, identifiers = _identified(pairs)
    is_ambiguous, rejected = _ambiguous(pairs, codes, identifiers)
    buildings, names = _numbered(pair_id, codes, identifiers, is_ambiguous)
    # Contacts that are described twice
    azimuth, gap = numbers_in(pairs, "azimuth"), numbers_in(pairs, "gap")
    by_ends = np.lexsort([order, gap, buildings.max(axis=1), buildings.min(axis=1)])
    repeated, found = _repeated(pair_id, buildings, azimuth, gap, by_ends, angle)
    return Contacts(
        buildings=buildings,
        names=names,
        named=np.arange(names.size) < identifiers.size,
        azimuth=azimuth,
        gap=gap,
        facing_length=_facing(pairs),
        gap_given=_given(pairs, gap),
        pair_id=pair_id,
        order=order,
        repeated=repeated,
        ambiguous=np.logical_or(*is_ambiguous[codes].T),
        rejected=(*rejected, *found),
        places=_places(is_ambiguous, buildings[by_ends[repeated[by_ends]]]),
    )


def _places(is_ambiguous: BoolArray, again: IntArray) -> tuple[tuple[int, ...], ...]:
    """Return the buildings of each rejection: ambiguous ones, then those of repeated contacts."""
    both = [tuple(row) for row in np.sort(again, axis=1).tolist()]
    return (*((code,) for code in np.flatnonzero(is_ambiguous).tolist()), *both)


def _facing(pairs: pd.DataFrame) -> FloatArray:
    """Return lengths over which walls face each other, m; 0 where they are unknown."""
    return np.asarray(np.nan_to_num(numbers_in(pairs, "facing_length")))


def _given(pairs: pd.DataFrame, gap: FloatArray) -> BoolArray:
    """Return which gaps are neither unknown nor assumed."""
    return np.isfinite(gap) & ~is_derived(pairs["derived"], "gap")


def _numbered(
    pair_id: NDArray[np.object_],
    codes: IntArray,
    identifiers: NDArray[np.object_],
    is_ambiguous: BoolArray,
) -> tuple[IntArray, NDArray[np.object_]]:
    """Return the numbers of the buildings of each pair, and the names of all buildings."""
    own = (codes < 0) | is_ambiguous[codes]
    # Separate buildings are numbered after those with an identifier
    buildings = codes.copy()
    buildings[own] = len(identifiers) + np.arange(int(own.sum()))
    return buildings, np.concatenate([identifiers, _own_names(pair_id, own)])


def _identified(pairs: pd.DataFrame) -> tuple[IntArray, NDArray[np.object_]]:
    """Return a code per pair and side, -1 without an identifier, and the identifiers, sorted."""
    sides = [identifiers_of(pairs, name) for name in ("building_id_1", "building_id_2")]
    # Sorted, so that numbers do not depend on the order of the table
    codes, names = _sorted_codes(pd.concat(sides, ignore_index=True))
    # No identifier is the first of all texts
    missing = int(names.size > 0 and names[0] == "")
    numbers = np.stack(np.split(codes - missing, 2), axis=1)
    return numbers, names[missing:]


def identifiers_of(pairs: pd.DataFrame, name: str) -> pd.Series:
    """Return a column of identifiers of buildings as texts, empty where there is none."""
    given = pairs[name] if name in pairs else pd.Series("", index=pairs.index)
    return given.fillna("").astype(str)


def _sorted_codes(texts: pd.Series) -> tuple[IntArray, NDArray[np.object_]]:
    """Return the place of each text among those that occur, and these in alphabetical order."""
    column = pa.Table.from_pandas(texts.to_frame("text"), preserve_index=False)["text"]
    encoded = column.cast(pa.large_string()).combine_chunks().dictionary_encode()
    order = pc.sort_indices(encoded.dictionary).to_numpy()
    place = np.empty(order.size, dtype=np.int64)
    place[order] = np.arange(order.size)
    # Sixteen bytes per short text, a quarter of those of an object; some thousands at a time
    names = np.empty(order.size, dtype=StringDType())
    for first in range(0, order.size, TOGETHER):
        some = encoded.dictionary.take(pa.array(order[first : first + TOGETHER]))
        names[first : first + TOGETHER] = some.to_numpy(zero_copy_only=False)
    return place[encoded.indices.to_numpy()], names


def _ambiguous(
    pairs: pd.DataFrame, codes: IntArray, identifiers: NDArray[np.object_]
) -> tuple[BoolArray, tuple[Rejection, ...]]:
    """Return the identifiers of several places, with one entry more, and the reasons."""
    # One entry more, which is that of the code -1
    spread = np.zeros(len(identifiers) + 1)
    if len(identifiers):
        spread[:-1] = _spread(pairs, codes)
    ambiguous = spread > SAME_PLACE
    reasons = []
    for code in np.flatnonzero(ambiguous).tolist():
        reason = (
            f"building_id = {identifiers[code]!r}: its pairs place it up to {spread[code]:.0f} m "
            f"apart, at most {SAME_PLACE:g} m are taken for one building: each pair has a "
            "separate building"
        )
        reasons.append(Rejection("building", identifiers[code], "", None, (reason,)))
    return ambiguous, tuple(reasons)


def _spread(pairs: pd.DataFrame, codes: IntArray) -> FloatArray:
    """Return the diagonal of the box around the positions of each identifier, m."""
    # Ends in the order of their buildings, those without an identifier first
    order = np.argsort(codes.ravel(), kind="stable")[np.count_nonzero(codes < 0) :]
    first = np.flatnonzero(np.diff(codes.ravel()[order], prepend=-1))
    squares = np.zeros(first.size)
    # Boxes in space hold across the date line too; unknown positions count for none
    for axis in range(3):
        place = np.stack([_on_sphere(pairs, i, axis) for i in (1, 2)], axis=1).ravel()[order]
        squares += np.square(np.fmax.reduceat(place, first) - np.fmin.reduceat(place, first))
    return np.asarray(EARTH_RADIUS * np.sqrt(squares))


def _on_sphere(pairs: pd.DataFrame, i: int, axis: int) -> FloatArray:
    """Return one of the three coordinates of building i on the unit sphere, (n_pairs,)."""
    north = np.radians(numbers_in(pairs, f"latitude_{i}"))
    if axis == 2:
        return np.asarray(np.sin(north))
    east = np.radians(numbers_in(pairs, f"longitude_{i}"))
    return np.asarray(np.cos(north) * (np.sin(east) if axis else np.cos(east)))


def _own_names(pair_id: NDArray[np.object_], own: BoolArray) -> NDArray[np.object_]:
    """Return the names of the buildings that belong to one pair only."""
    rows, sides = np.nonzero(own)
    names = [f"{pair_id[row]}#{side + 1}" for row, side in zip(rows, sides, strict=True)]
    return np.array(names, dtype=StringDType())


def _repeated(
    pair_id: NDArray[np.object_],
    buildings: IntArray,
    azimuth: FloatArray,
    gap: FloatArray,
    order: NDArray[np.intp],
    angle: float,
) -> tuple[BoolArray, tuple[Rejection, ...]]:
    """Return which pairs repeat the contact of another one with at most their gap, and why."""
    ends = np.sort(buildings, axis=1)[order]
    same = (ends[1:] == ends[:-1]).all(axis=1)
    repeated = np.zeros(gap.size, dtype=bool)
    reasons, kept = [], list[int]()
    # The narrowest gap comes first; only few pairs have the buildings of another
    for place in np.flatnonzero(same).tolist():
        # A new group of pairs of the same buildings, or one more of it
        before, row = int(order[place]), int(order[place + 1])
        if not (place and same[place - 1]):
            kept = [before]
        twin = [other for other in kept if _one_axis(azimuth[other], azimuth[row], angle)]
        if not twin:
            kept.append(row)
            continue
        repeated[row] = True
        reasons.append(_repetition(pair_id, gap, row, twin[0]))
    return repeated, tuple(reasons)


def _one_axis(first: float, second: float, angle: float) -> bool:
    """Return whether two axes agree, in either direction; an unknown one agrees with all."""
    if np.isnan(first) or np.isnan(second):
        return True
    between = abs((first - second + 90.0) % 180.0 - 90.0)
    return bool(between <= angle)


def _repetition(pair_id: NDArray[np.object_], gap: FloatArray, row: int, kept: int) -> Rejection:
    """Return the rejection of a pair whose contact another one describes."""
    reason = (
        f"it repeats the contact of pair {pair_id[kept]!r} between the same buildings: "
        f"rows take the gap of {_metres(gap[kept])} instead of {_metres(gap[row])}"
    )
    return Rejection("row", pair_id[row], "", None, (reason,))


def _metres(gap: float) -> str:
    """Return a gap as a text."""
    return f"{gap:g} m" if np.isfinite(gap) else "unknown width"
