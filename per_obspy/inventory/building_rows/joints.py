"""
Joints of a row: the two contacts of a building that lie on opposite sides of it.

Each contact has two ends, numbered ``2 * pair`` (at building 1) and ``2 * pair + 1``. A joint joins
two ends at one building whose directions are opposite within an angle. An end has one joint at
most: where several are possible, which is a fork, the narrowest gap goes first, then the longest
facing walls, the straightest axis and the names of the pairs.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import Rejection
from per_obspy.inventory.building_rows.contacts import BoolArray, Contacts, IntArray

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
    forks, contradictory, crowded : (n_buildings,) ndarray of bool
        Buildings with more contacts on a side than a row has; whose pairs contradict each other, so
        that they are not joined there; with too many contacts to be one building.
    rejected : tuple of Rejection
        One for each contradiction and each crowded building.
    places : tuple of tuple of int
        Numbers by which rejections are ordered, the last of which is that of the building: alone
        for a crowded building, after those of the property and of the step in the order of the
        contacts of its building for a contradiction.
    """

    joined: IntArray
    forks: BoolArray
    contradictory: BoolArray
    crowded: BoolArray
    rejected: tuple[Rejection, ...]
    places: tuple[tuple[int, ...], ...]


class _Candidates(NamedTuple):
    """Two ends at one building that lie on opposite sides, and how far from straight, degrees."""

    first: IntArray
    second: IntArray
    step: IntArray
    bend: FloatArray

    def chosen(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> "_Candidates":
        """Return some of them."""
        ends = self.first[rows], self.second[rows]
        return _Candidates(*ends, self.step[rows], self.bend[rows])


def joints_of(contacts: Contacts, given: Mapping[str, FloatArray], angle: float) -> Joints:
    """
    Join the contacts of each building that lie on opposite sides of it.

    Parameters
    ----------
    contacts : Contacts
        Of numbered buildings.
    given : mapping of str to (n_pairs, 2) ndarray
        Values of buildings 1 and 2 in the table, in any unit; NaN where missing. Two pairs
        that differ by more than 1 % about their building contradict each other.
    angle : float
        Largest angle between the axes of two joined contacts, degrees.

    Returns
    -------
    Joints
    """
    # Ends that face each other, without those whose pairs contradict each other
    count = contacts.names.size
    found, crowded = _candidates(contacts, angle)
    agrees, reasons, differing = _agreement(contacts, given, found)
    contradictory = _at_buildings(contacts, found.chosen(~agrees), count)
    # The best candidates, each end once; the others are forks
    possible = found.chosen(agrees)
    taken = _best(contacts, possible)
    joined = np.full(contacts.buildings.size, -1, dtype=np.int64)
    joined[possible.first[taken]] = possible.second[taken]
    joined[possible.second[taken]] = possible.first[taken]
    forks = _at_buildings(contacts, possible.chosen(~taken), count)
    crowds = np.flatnonzero(crowded).tolist()
    rejected = (*(_crowd(contacts.names[number]) for number in crowds), *reasons)
    places = (*((number,) for number in crowds), *differing)
    return Joints(joined, forks, contradictory, crowded, rejected, places)


def _candidates(contacts: Contacts, angle: float) -> tuple[_Candidates, BoolArray]:
    """Return all ends that could be joined, and the buildings that have too many."""
    directions = np.stack([contacts.azimuth, contacts.azimuth + 180.0], axis=1).ravel()
    building = contacts.buildings.ravel()
    joinable = np.isfinite(contacts.gap) & ~contacts.repeated
    usable = np.isfinite(directions) & np.repeat(joinable, 2)
    number = np.bincount(building[usable], minlength=contacts.names.size)
    crowded = number > MOST_CONTACTS
    # Sort ends by building, so that those of one building are adjacent
    ends = np.flatnonzero(usable & ~crowded[building])
    ends = ends[np.lexsort([np.repeat(contacts.order, 2)[ends], building[ends]])]
    first, second, step = _at_one_building(ends, building)
    # Opposite directions differ by 180 degrees
    bend = np.abs((directions[first] - directions[second]) % 360.0 - 180.0)
    opposite = bend <= angle
    return _Candidates(first, second, step, bend).chosen(opposite), crowded


def _at_one_building(ends: IntArray, building: IntArray) -> IntArray:
    """Return two ends and their distance in the order of the ends of one building, (3, n)."""
    found = [np.empty((3, 0), dtype=np.int64)]
    # Neighbours in that order, then those one further apart, as long as there are any
    for step in range(1, MOST_CONTACTS):
        first, second = ends[:-step], ends[step:]
        together = building[first] == building[second]
        if not together.any():
            break
        steps = np.full(int(together.sum()), step)
        found.append(np.stack([first[together], second[together], steps]))
    return np.concatenate(found, axis=1)


def _agreement(
    contacts: Contacts, given: Mapping[str, FloatArray], found: _Candidates
) -> tuple[BoolArray, list[Rejection], list[tuple[int, ...]]]:
    """Return which candidates agree about their building, and contradictions with their places."""
    agrees = np.ones(found.first.size, dtype=bool)
    building = contacts.buildings.ravel()[found.first]
    rejected, places = list[Rejection](), list[tuple[int, ...]]()
    for number, (name, values) in enumerate(given.items()):
        first, second = values.ravel()[found.first], values.ravel()[found.second]
        # NaN means unknown and contradicts no value
        limit = AGREEMENT * np.maximum(np.abs(first), np.abs(second))
        differs = np.abs(first - second) > limit
        # Each contradiction with the numbers of its property, step and building
        for row in np.flatnonzero(differs).tolist():
            numbers = float(first[row]), float(second[row])
            rejected.append(_contradiction(contacts, found, row, name, numbers))
            places.append((number, int(found.step[row]), int(building[row])))
        agrees &= ~differs
    return agrees, rejected, places


def _contradiction(
    contacts: Contacts, found: _Candidates, row: int, name: str, numbers: tuple[float, float]
) -> Rejection:
    """Return the rejection of a joint whose pairs contradict each other."""
    # Both ends are at the same building
    ends = int(found.first[row]), int(found.second[row])
    building = contacts.names[contacts.buildings.ravel()[ends[0]]]
    first, second = (contacts.pair_id[end // 2] for end in ends)
    reason = (
        f"{name} = {numbers[0]:.6g} in pair {first!r} and {numbers[1]:.6g} in pair {second!r}: "
        "the row is cut at this building"
    )
    return Rejection("row", building, "", None, (reason,))


def _best(contacts: Contacts, found: _Candidates) -> BoolArray:
    """Return which candidates are taken: the best first, each end once."""
    rank, count = _ranks(contacts, found), contacts.buildings.size
    taken = np.zeros(rank.size, dtype=bool)
    waiting = np.arange(rank.size)
    while waiting.size:
        first, second = found.first[waiting], found.second[waiting]
        # A candidate is taken if it is the best one at both of its ends
        lowest = np.full(count, rank.size, dtype=np.int64)
        for ends in (first, second):
            np.minimum.at(lowest, ends, rank[waiting])
        now = (lowest[first] == rank[waiting]) & (lowest[second] == rank[waiting])
        taken[waiting[now]] = True
        # Its ends are out
        used = np.zeros(count, dtype=bool)
        used[first[now]] = used[second[now]] = True
        waiting = waiting[~used[first] & ~used[second]]
    return taken


def _ranks(contacts: Contacts, found: _Candidates) -> IntArray:
    """Return the rank of each candidate, from 0 for the best."""
    pairs = np.stack([found.first, found.second]) // 2
    rank = np.empty(found.first.size, dtype=np.int64)
    # The last key counts first
    keys = [
        *np.sort(contacts.order[pairs], axis=0),
        found.bend,
        -contacts.facing_length[pairs].min(axis=0),
        contacts.gap[pairs].max(axis=0),
    ]
    rank[np.lexsort(keys)] = np.arange(rank.size)
    return rank


def _at_buildings(contacts: Contacts, found: _Candidates, count: int) -> BoolArray:
    """Return the buildings at which candidates are."""
    buildings = np.zeros(count, dtype=bool)
    buildings[contacts.buildings.ravel()[found.first]] = True
    return buildings


def _crowd(name: str) -> Rejection:
    """Return the rejection of a building with too many contacts."""
    reason = (
        f"building_id = {name!r} occurs in more than {MOST_CONTACTS} pairs, which no building "
        "does: its pairs are not joined to rows there"
    )
    return Rejection("building", name, "", None, (reason,))
