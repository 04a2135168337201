"""
Rows of buildings: contacts joined at opposite sides of buildings, and chains of them.

Each contact has two ends, numbered ``2 * pair`` (at building 1) and ``2 * pair + 1``. A joint joins
two ends at one building whose directions are opposite within an angle. An end has one joint at
most: where several are possible, which is a fork, the narrowest gap goes first, then the longest
facing walls, the straightest axis and the names of the pairs.

Chains are cut where they close, bend, or are too long. Every pair is in exactly one row. A row that
is cut at a gap leaves the pair of that gap as a separate row, so that no contact is missing; one
that is cut at a bend has the building there in both parts.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

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

if TYPE_CHECKING:
    from scipy.sparse import csr_array

#: Contacts of a building beyond which its identifier is taken for a mistake.
MOST_CONTACTS = 50

#: Relative difference up to which two pairs agree about a building: tables are rounded.
AGREEMENT = 0.01


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


class Joints(NamedTuple):
    """Joined ends of contacts."""

    #: The end to which each end is joined, -1 if to none. Shape (2 * n_pairs,).
    joined: IntArray
    #: Numbers of buildings with more contacts on a side than a row has; whose pairs contradict each
    #: other, so that they are not joined there; with too many contacts to be one building. Shape
    #: (n,).
    forks: IntArray
    contradictory: IntArray
    crowded: IntArray
    #: One for each crowded building and each contradiction.
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


class Chains(NamedTuple):
    """Rows of contacts."""

    #: Pairs in the order of the rows, and within each along its axis. Shape (n_contacts,).
    pair: IntArray
    #: Whether building 2 of the pair comes before building 1 along the axis. Shape (n_contacts,).
    turned: BoolArray
    #: Place of the first contact of each row, and the end. Shape (n_rows + 1,).
    first: IntArray
    #: Of the axis from the first building to the last, from 0 to below 180 degrees; NaN if unknown.
    #: Shape (n_rows,).
    azimuth: FloatArray
    #: By the names of ``ROW_FLAGS``. Shape (n_rows,).
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
