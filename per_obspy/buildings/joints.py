"""
Joints of a row: the two contacts of a building that lie on opposite sides of it.

Each contact has two ends, numbered ``2 * pair`` (at building 1) and ``2 * pair + 1``. A joint joins
two ends at one building whose directions are opposite within an angle. An end has one joint at
most: where several are possible, which is a fork, the narrowest gap goes first, then the longest
facing walls, the straightest axis and the names of the pairs.
"""

from typing import NamedTuple

import numpy as np
import pyarrow as pa

from per_obspy.buildings.contacts import (
    PROPERTIES,
    BoolArray,
    Contacts,
    IntArray,
    OrderedRejection,
    given_values,
)
from per_obspy.checks import FloatArray
from per_obspy.errors import Rejection

#: Contacts of a building beyond which its identifier is taken for a mistake.
MOST_CONTACTS = 50

#: Relative difference up to which two pairs agree about a building: tables are rounded.
AGREEMENT = 0.01


class Joints(NamedTuple):
    """
    Joined ends of contacts.

    Attributes
    ----------
    joined : (2 * n_pairs,) ndarray of int
        The end to which each end is joined, -1 if to none.
    forks, contradictory, crowded : (n,) ndarray of int
        Numbers of buildings with more contacts on a side than a row has; whose pairs contradict
        each other, so that they are not joined there; with too many contacts to be one building.
    rejected : list of OrderedRejection
        One for each crowded building and each contradiction.
    """

    joined: IntArray
    forks: IntArray
    contradictory: IntArray
    crowded: IntArray
    rejected: list[OrderedRejection]


class _Candidates(NamedTuple):
    """Two ends at one building that lie on opposite sides."""

    # Ends, and the distance between them in the order of the ends of their building
    first: IntArray
    second: IntArray
    step: IntArray
    # How far from straight, degrees
    bend: FloatArray

    def select(self, rows: BoolArray) -> "_Candidates":
        """Return some of them."""
        first, second, step = (column[rows] for column in self[:3])
        return _Candidates(first, second, step, self.bend[rows])


def joints_of(contacts: Contacts, pairs: pa.Table, angle: float) -> Joints:
    """
    Join the contacts of each building that lie on opposite sides of it, within an angle, degrees.

    Two pairs that differ by more than 1 % in a given property of their building contradict each
    other.
    """
    candidates, crowded = _candidates(contacts, angle)
    agrees, rejected = _agreement(contacts, candidates, pairs)
    # The best candidates, each end once; the others are forks
    possible = candidates.select(agrees)
    joined = _joined(contacts, possible)
    others = possible.first[joined[possible.first] != possible.second]
    building = contacts.buildings.ravel()
    return Joints(
        joined,
        np.unique(building[others]),
        np.unique(building[candidates.first[~agrees]]),
        crowded,
        [*(_crowd(contacts, number) for number in crowded.tolist()), *rejected],
    )


def _candidates(contacts: Contacts, angle: float) -> tuple[_Candidates, IntArray]:
    """Return all ends that could be joined, and the buildings that have too many."""
    directions = np.stack([contacts.azimuth, contacts.azimuth + 180.0], axis=1).ravel()
    building = contacts.buildings.ravel()
    joinable = np.repeat(np.isfinite(contacts.gap) & ~contacts.repeated, 2)
    ends = np.flatnonzero(joinable & np.isfinite(directions))
    crowds = np.bincount(building[ends]) > MOST_CONTACTS
    # Sort ends by building, so that those of one building are adjacent
    ends = ends[~crowds[building[ends]]]
    ends = ends[np.lexsort([contacts.order[ends // 2], building[ends]])]
    first, second, step = _at_one_building(ends, building[ends])
    # Opposite directions differ by 180 degrees
    bend = np.abs((directions[first] - directions[second]) % 360.0 - 180.0)
    return _Candidates(first, second, step, bend).select(bend <= angle), np.flatnonzero(crowds)


def _at_one_building(ends: IntArray, building: IntArray) -> IntArray:
    """Return two ends and their distance in the order of the ends of one building, (3, n)."""
    columns = [np.empty((3, 0), dtype=np.int64)]
    # Neighbours in that order, then those one further apart, as long as there are any
    for step in range(1, MOST_CONTACTS):
        first = np.flatnonzero(building[step:] == building[:-step])
        if not first.size:
            break
        columns.append(np.stack([ends[first], ends[first + step], np.full(first.size, step)]))
    return np.concatenate(columns, axis=1)


def _agreement(
    contacts: Contacts, candidates: _Candidates, pairs: pa.Table
) -> tuple[BoolArray, list[OrderedRejection]]:
    """Return which candidates agree about their building, and the contradictions."""
    agrees, rejected = np.ones(candidates.first.size, dtype=bool), list[OrderedRejection]()
    for place, name in enumerate(PROPERTIES):
        values = given_values(pairs, contacts.derived, name).ravel()
        first, second = values[candidates.first], values[candidates.second]
        # NaN means unknown and contradicts no value
        differs = np.abs(first - second) > AGREEMENT * np.maximum(np.abs(first), np.abs(second))
        agrees &= ~differs
        # Each contradiction with the numbers of its property, step and building
        for row in np.flatnonzero(differs).tolist():
            ends = int(candidates.first[row]), int(candidates.second[row])
            number, rejection = _contradiction(contacts, ends, name, values)
            rejected.append(((5, place, int(candidates.step[row]), number), rejection))
    return agrees, rejected


def _joined(contacts: Contacts, possible: _Candidates) -> IntArray:
    """Return the end to which each end is joined: the best candidates first, each end once."""
    pairs = np.stack([possible.first, possible.second]) // 2
    # The last key counts first
    keys = [
        *np.sort(contacts.order[pairs], axis=0),
        possible.bend,
        -contacts.facing_length[pairs].min(axis=0),
        contacts.gap[pairs].max(axis=0),
    ]
    best = np.lexsort(keys)
    joined = [-1] * contacts.buildings.size
    for first, second in zip(
        possible.first[best].tolist(), possible.second[best].tolist(), strict=True
    ):
        if joined[first] < 0 and joined[second] < 0:
            joined[first], joined[second] = second, first
    return np.array(joined, dtype=np.int64)


def _crowd(contacts: Contacts, number: int) -> OrderedRejection:
    """Return the rejection of a building with too many contacts."""
    pair, side = np.argwhere(contacts.buildings == number)[0].tolist()
    name = str(contacts.names[side][pair])
    reason = (
        f"building_id = {name!r} occurs in more than {MOST_CONTACTS} pairs, which no building "
        "does: its pairs are not joined to rows there"
    )
    place = 3, int(contacts.codes[pair, side])
    return place, Rejection("building", name, "", None, (reason,))


def _contradiction(
    contacts: Contacts, ends: tuple[int, int], name: str, values: FloatArray
) -> tuple[int, Rejection]:
    """Return the code of a building whose pairs contradict each other, and its rejection."""
    # Both ends are at the same building
    pair, side = divmod(ends[0], 2)
    texts = [f"{values[end]:.6g} in pair {str(contacts.pair_id[end // 2])!r}" for end in ends]
    reason = f"{name} = {' and '.join(texts)}: the row is cut at this building"
    rejection = Rejection("row", str(contacts.names[side][pair]), "", None, (reason,))
    return int(contacts.codes[pair, side]), rejection
