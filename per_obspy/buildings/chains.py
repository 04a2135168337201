"""
Rows of buildings: chains of joined contacts, cut where they close, bend, or are too long.

Every pair is in exactly one row. A row that is cut at a gap leaves the pair of that gap as a
separate row, so that no contact is missing; one that is cut at a bend has the building there in
both parts.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from per_obspy.buildings.contacts import BoolArray, Contacts, IntArray
from per_obspy.buildings.joints import Joints
from per_obspy.checks import FloatArray

if TYPE_CHECKING:
    from scipy.sparse import csr_array

#: Contacts of a chain beyond which it is halved before anything else: the other cuts take one part
#: at a time, and a damaged table may make one chain of all its pairs.
HALVED = 1000

#: Rounding of azimuths that cuts no row, degrees, and more than that of many together.
ROUNDING, MUCH_ROUNDING = 1e-9, 1e-6

#: Flags of a row of buildings, and the meaning of each.
ROW_FLAGS: dict[str, str] = {
    "ring": "the buildings close a ring, which is cut at its widest gap",
    "cut": "longer than the configured number of buildings, or next to such a cut: the pair of the "
    "widest gap is a separate row, and hits do not travel across it",
    "bent": "the axes of a longer chain turn by more than the configured angle: cut at the bend",
    "fork": "a building has more neighbours on a side than a row can have: the row follows the "
    "narrowest gaps, the others are separate rows",
    "contradictory": "pairs contradict each other about a building: cut there, see rejected.csv",
    "no_building_id": "the pair has no building identifiers: a separate row of two buildings",
    "ambiguous_id": "an identifier belongs to buildings at different places, or to too many: each "
    "pair is a separate row there",
    "unknown_gap": "the pair table gives no gap: a row of two without a history, or with the gap "
    "that the configuration assumes",
    "unknown_azimuth": "the axis is not given: a row of two along the worst azimuth",
}

#: One bit for each flag of a cut.
RING, CUT, BENT = 1, 2, 4


class Chains(NamedTuple):
    """
    Rows of contacts.

    Attributes
    ----------
    pair : (n_contacts,) ndarray of int
        Pairs in the order of the rows, and within each along its axis.
    turned : (n_contacts,) ndarray of bool
        Whether building 2 of the pair comes before building 1 along the axis.
    first : (n_rows + 1,) ndarray of int
        Place of the first contact of each row, and the end.
    azimuth : (n_rows,) ndarray
        Of the axis from the first building to the last, from 0 to below 180 degrees; NaN if
        unknown.
    flags : dict of str to (n_rows,) ndarray of bool
        By the names of ``ROW_FLAGS``.
    """

    pair: IntArray
    turned: BoolArray
    first: IntArray
    azimuth: FloatArray
    flags: dict[str, BoolArray]


class _Chain(NamedTuple):
    """Ends at which contacts are entered one after the other, and bits of flags."""

    ends: IntArray
    flags: int
    # Whether both ends of the chain are joined
    closed: bool


def chains_of(contacts: Contacts, joints: Joints, angle: float, longest: int) -> Chains:
    """
    Follow the joints from contact to contact, and cut the chains into rows, in any order.

    The axes of two contacts of a row differ by at most an angle, degrees; ``longest`` is the
    largest number of its buildings. Every pair that repeats no other is in one row.
    """
    ends, sizes, bits = _rows(contacts, joints.joined, angle, longest)
    # Along the axis, whose azimuth is below 180 degrees
    azimuth, backwards = _axes(_directions(contacts, ends), sizes)
    row, place = np.repeat(np.arange(sizes.size), sizes), np.arange(ends.size)
    back = backwards[row]
    ends = ends[np.lexsort([np.where(back, -place, place), row])]
    pair, turned, first = ends // 2, (ends % 2 == 1) ^ back, np.append(0, np.cumsum(sizes))
    # Flags of cuts, then those that follow from the pairs of a row
    flags = {name: (bits & bit) > 0 for name, bit in (("ring", RING), ("cut", CUT), ("bent", BENT))}
    for name, raised in _flags_of_pairs(contacts, joints).items():
        flags[name] = np.logical_or.reduceat(raised[pair], first[:-1])
    return Chains(pair, turned, first, azimuth, flags)


def _rows(
    contacts: Contacts, joined: IntArray, angle: float, longest: int
) -> tuple[IntArray, IntArray, IntArray]:
    """Return the end at which each contact is entered, and sizes and bits of flags of the rows."""
    ends, sizes, closed = _follow(contacts, joined)
    whole = _stay_whole(contacts, ends, sizes, angle, longest) & ~closed
    # Few chains are cut, one by one
    rows, starts = list[_Chain](), np.cumsum(sizes) - sizes
    for start, size, ring in zip(starts[~whole], sizes[~whole], closed[~whole], strict=True):
        chain = _Chain(ends[start : start + size], RING * int(ring), bool(ring))
        rows.extend(_cut_rows(contacts, chain, angle, longest))
    # Rows of both kinds; those that are not cut have no flag
    ends = np.concatenate([ends[np.repeat(whole, sizes)], *(row.ends for row in rows)])
    uncut = [(size, 0) for size in sizes[whole].tolist()]
    sizes, bits = np.array([*uncut, *((row.ends.size, row.flags) for row in rows)]).T
    return ends, sizes, bits


def _follow(contacts: Contacts, joined: IntArray) -> tuple[IntArray, IntArray, BoolArray]:
    """
    Follow all chains from the end with the smaller name, rings from their first contact.

    Return the end at which each contact is entered, chain after chain, the number of contacts of
    each chain, and whether it is a ring.
    """
    from scipy.sparse.csgraph import connected_components

    # Contacts are connected by their joints
    joints = np.flatnonzero(joined >= 0)
    graph = _graph(joints // 2, joined[joints] // 2, contacts.order.size)
    label = connected_components(graph, directed=False)[1].astype(np.int64)
    joined, rings = _open_rings(contacts, joined, label)
    # Both free ends of each chain, the smaller name first
    free = np.flatnonzero(np.repeat(~contacts.repeated, 2) & (joined < 0))
    name = 2 * contacts.order[free // 2] + free % 2
    begin, end = free[np.lexsort([name, label[free // 2]])].reshape(-1, 2).T
    ends = _walk(joined, begin, end)
    numbers, sizes = np.unique(label[ends // 2], return_counts=True)
    return ends, sizes, np.isin(numbers, rings)


def _walk(joined: IntArray, begin: IntArray, end: IntArray) -> IntArray:
    """Return the ends at which contacts are entered, from begin to end of one chain after other."""
    from scipy.sparse.csgraph import breadth_first_order

    # A contact is left at its other end; the last one of a chain leads to the next chain
    behind = joined[np.arange(joined.size) ^ 1]
    behind[end[:-1] ^ 1] = begin[1:]
    steps = np.flatnonzero(behind >= 0)
    path = _graph(steps, behind[steps], joined.size)
    ends = breadth_first_order(path, begin[0], return_predecessors=False)
    return np.asarray(ends, dtype=np.int64)


def _graph(begin: IntArray, end: IntArray, count: int) -> "csr_array":
    """Return a graph of some nodes from the ends of its edges."""
    from scipy.sparse import csr_array

    return csr_array((np.ones(begin.size), (begin, end)), shape=(count, count))


def _open_rings(contacts: Contacts, joined: IntArray, label: IntArray) -> tuple[IntArray, IntArray]:
    """Return joined ends without the joint before the first contact of each ring, and the rings."""
    # A ring has no free end
    is_open = np.zeros(label.size, dtype=bool)
    is_open[label[np.flatnonzero(joined < 0) // 2]] = True
    pairs = np.flatnonzero(~is_open[label])
    pairs = pairs[np.argsort(contacts.order[pairs], kind="stable")]
    rings, first = np.unique(label[pairs], return_index=True)
    begins, opened = 2 * pairs[first], joined.copy()
    opened[joined[begins]] = opened[begins] = -1
    return opened, rings


def _directions(contacts: Contacts, ends: IntArray) -> FloatArray:
    """Return the azimuths of contacts that are entered at these ends, degrees."""
    # At its end 1 a contact is entered at building 2
    return contacts.azimuth[ends // 2] + 180.0 * (ends % 2)


def _turns(directions: FloatArray) -> FloatArray:
    """Return the angles between successive directions, from -180 to below 180 degrees."""
    return (np.diff(directions) + 180.0) % 360.0 - 180.0


def _stay_whole(
    contacts: Contacts, ends: IntArray, sizes: IntArray, angle: float, longest: int
) -> BoolArray:
    """Return chains that are surely rows as they are: straight, not long, no building twice."""
    number, first = np.repeat(np.arange(sizes.size), sizes), np.cumsum(sizes) - sizes
    turns = np.append(0.0, _turns(_directions(contacts, ends)))
    turns[first] = 0.0
    along = np.cumsum(turns)
    turning = np.maximum.reduceat(along, first) - np.minimum.reduceat(along, first)
    stays = (turning <= angle - MUCH_ROUNDING) & (sizes < longest)
    # The first building of each chain, then the one behind each contact
    buildings, count = contacts.buildings.ravel(), contacts.buildings.max() + 1
    visited = np.append(buildings[ends[first]], buildings[ends ^ 1])
    visits = np.sort(np.append(np.arange(sizes.size), number) * count + visited)
    # A chain that comes back to a building
    stays[visits[1:][np.diff(visits) == 0] // count] = False
    return np.asarray(stays | (sizes == 1))


def _cut_rows(contacts: Contacts, whole: _Chain, angle: float, longest: int) -> Iterator[_Chain]:
    """Yield the rows of a chain."""
    waiting = [whole]
    while waiting:
        row = waiting.pop()
        length = row.ends.size
        if length <= 1:
            yield from [row] * length
        elif length > HALVED:
            waiting += _cut(contacts, row, CUT, (length // 3, 2 * length // 3))
        # A row that comes back to a building is a ring, whether its axes show it or not
        elif circle := _circle(contacts, row.ends):
            waiting += _cut(contacts, row, RING, circle)
        elif bend := _bend(contacts, row.ends, angle):
            parts = np.split(row.ends, [bend])
            waiting += [row._replace(ends=part, flags=row.flags | BENT) for part in parts]
        elif length + 1 > longest:
            waiting += _cut(contacts, row, CUT, (0, length))
        else:
            yield row


def _circle(contacts: Contacts, ends: IntArray) -> tuple[int, int] | None:
    """Return the first contacts between two visits of one building, as a range."""
    buildings = contacts.buildings.ravel()
    visited = np.append(buildings[ends[:1]], buildings[ends ^ 1])
    _, begin, number = np.unique(visited, return_index=True, return_inverse=True)
    # Places of buildings that were visited before
    again = np.flatnonzero(begin[number] < np.arange(visited.size))
    return (int(begin[number[again[0]]]), int(again[0])) if again.size else None


def _bend(contacts: Contacts, ends: IntArray, angle: float) -> int:
    """Return the place of the sharpest bend of contacts whose axes turn too far, else 0."""
    turns = _turns(_directions(contacts, ends))
    along = np.append(0.0, np.cumsum(turns))
    return int(np.argmax(np.abs(turns))) + 1 if np.ptp(along) > angle + ROUNDING else 0


def _cut(contacts: Contacts, row: _Chain, flag: int, between: tuple[int, int]) -> list[_Chain]:
    """Return a chain cut at the widest gap of a range of contacts, nearest to its middle."""
    first, last = between
    gap = contacts.gap[row.ends[first:last] // 2]
    widest = np.flatnonzero(gap == gap.max()) + first
    place = widest[np.argmin(np.abs(widest - (first + last - 1) / 2.0))]
    before, cut, behind = np.split(row.ends, [place, place + 1])
    # The rest of a ring is one row
    parts = [np.append(behind, before)] if row.closed else [before, behind]
    return [_Chain(part, row.flags | flag, closed=False) for part in (*parts, cut)]


def _axes(directions: FloatArray, sizes: IntArray) -> tuple[FloatArray, BoolArray]:
    """Return the mean azimuth of each row, from 0 to below 180, and which have to be turned."""
    first, angle = np.cumsum(sizes) - sizes, np.radians(directions)
    north, east = (np.add.reduceat(part(angle), first) for part in (np.cos, np.sin))
    # A single contact keeps the azimuth of its pair, to the last digit
    mean = np.where(sizes == 1, directions[first], np.degrees(np.arctan2(east, north))) % 360.0
    backwards = mean >= 180.0
    return np.where(backwards, mean - 180.0, mean), backwards


def _flags_of_pairs(contacts: Contacts, joints: Joints) -> dict[str, BoolArray]:
    """Return which pairs raise each flag that follows from them and their buildings."""
    forks, contradictory, crowded = (
        np.logical_or(*np.isin(contacts.buildings, numbers).T)
        for numbers in (joints.forks, joints.contradictory, joints.crowded)
    )
    # A building raises the flags of all its rows
    return {
        "fork": forks,
        "contradictory": contradictory,
        "no_building_id": (contacts.codes.min(axis=1) < 0) & ~contacts.ambiguous,
        "ambiguous_id": contacts.ambiguous | crowded,
        "unknown_gap": ~np.isfinite(contacts.gap) | contacts.derived.has("gap"),
        "unknown_azimuth": np.isnan(contacts.azimuth),
    }
