"""
Rows of buildings: chains of joined contacts, cut where they close, bend, or are too long.

Every pair is in exactly one row. A row that is cut at a gap leaves the pair of that gap as a
separate row, so that no contact is missing; one that is cut at a bend has the building there in
both parts.
"""

from array import array
from collections.abc import Iterable, Iterator
from itertools import chain
from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.inventory.building_rows.contacts import BoolArray, Contacts, IntArray
from per_obspy.inventory.building_rows.joints import Joints
from per_obspy.inventory.building_rows.walks import HALVED, Walks, stays_whole, walks_of

#: One contact of a chain: its pair, and whether building 1 of the pair is the later one.
Link = tuple[int, bool]

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

#: One bit per flag.
_CODES = {name: 1 << bit for bit, name in enumerate(ROW_FLAGS)}


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


class _Piece(NamedTuple):
    """A part of a chain, the names of its flags, and whether its ends are joined."""

    links: list[Link]
    flags: frozenset[str]
    closed: bool = False

    def flagged(self, name: str) -> "_Piece":
        """Return the part with one flag more."""
        return self._replace(flags=self.flags | {name})


def chains_of(contacts: Contacts, joints: Joints, angle: float, longest: int) -> Chains:
    """
    Follow the joints from contact to contact, and cut the chains into rows.

    Parameters
    ----------
    contacts, joints : Contacts, Joints
        Contacts and how they are joined.
    angle : float
        Largest angle between the axes of two contacts of a row, degrees.
    longest : int
        Largest number of buildings of a row.

    Returns
    -------
    Chains
        In the order of the smallest name of a pair of each row; every pair that repeats no other
        is in one of them.
    """
    rows = _rows(contacts, joints.joined, angle, longest)
    pair, turned, first, codes = _by_name(*rows, contacts.order)
    # Along the axis, whose azimuth is below 180 degrees
    azimuth, backwards = _axes(contacts.azimuth[pair] + 180.0 * turned, first)
    pair, turned = _reversed(pair, turned, first, backwards)
    flags = {}
    for name, code in _CODES.items():
        flags[name] = (codes & code) > 0
    # And those that follow from their buildings and pairs
    for name, raised in _flags_of_buildings(contacts, joints, pair).items():
        if raised.size:
            flags[name] |= np.logical_or.reduceat(raised, first[:-1])
    return Chains(pair, turned, first, azimuth, flags)


def _rows(
    contacts: Contacts, joined: IntArray, angle: float, longest: int
) -> tuple[IntArray, IntArray, IntArray]:
    """Return the end at which each contact is entered, and sizes and flags of the rows."""
    walks = walks_of(contacts, joined)
    whole = stays_whole(contacts, walks, angle, longest)
    # Few chains are cut, one by one
    cutter = _Cutter(contacts, angle, longest)
    others = chain(_pieces_of(walks, ~whole), _others(contacts, joined, walks.ends // 2))
    cut = _flat(chain.from_iterable(map(cutter.pieces, others)))
    # Rows of both kinds; those that are not cut have no flag
    ends = np.concatenate([walks.ends[np.repeat(whole, walks.sizes)], cut[0]])
    sizes = np.concatenate([walks.sizes[whole], cut[1]])
    codes = np.concatenate([np.zeros(int(whole.sum()), dtype=np.int64), cut[2]])
    return ends, sizes, codes


def _pieces_of(walks: Walks, some: BoolArray) -> Iterator[_Piece]:
    """Yield some of the chains."""
    starts = np.cumsum(walks.sizes) - walks.sizes
    for start, size in zip(starts[some].tolist(), walks.sizes[some].tolist(), strict=True):
        ends = walks.ends[start : start + size].tolist()
        yield _Piece([(end // 2, end % 2 == 1) for end in ends], frozenset())


def _flat(rows: Iterable[_Piece]) -> tuple[IntArray, IntArray, IntArray]:
    """Return the end at which each contact is entered, and sizes and flags of the rows."""
    # Arrays grow in place
    ends, sizes, codes = array("q"), array("q"), array("q")
    for row in rows:
        ends.extend(2 * pair + turned for pair, turned in row.links)
        sizes.append(len(row.links))
        codes.append(sum(_CODES[name] for name in row.flags))
    return np.array(ends, np.int64), np.array(sizes, np.int64), np.array(codes, np.int64)


def _by_name(
    ends: IntArray, sizes: IntArray, codes: IntArray, names: IntArray
) -> tuple[IntArray, BoolArray, IntArray, IntArray]:
    """Return pairs, which are turned, first contacts and flags, in the order of the rows' names."""
    starts = np.cumsum(sizes) - sizes
    smallest = np.minimum.reduceat(names[ends // 2], starts) if sizes.size else starts
    order = np.argsort(smallest)
    # Contacts of a row stay together
    first = np.concatenate([[0], np.cumsum(sizes[order])])
    source = np.repeat(starts[order] - first[:-1], sizes[order]) + np.arange(ends.size)
    found = ends[source]
    return found // 2, found % 2 == 1, first, codes[order]


def _others(contacts: Contacts, joined: IntArray, followed: IntArray) -> Iterator[_Piece]:
    """Yield the chains that are not followed yet; those that close are flagged as rings."""
    done = contacts.repeated.copy()
    done[followed] = True
    by_name = np.argsort(contacts.order, kind="stable")
    left = by_name[~done[by_name]].tolist()
    # Chains begin at a free end; the contacts that remain afterwards are rings
    for pair in left:
        for end in (2 * pair, 2 * pair + 1):
            if not done[pair] and joined[end] < 0:
                yield _Piece(_walked(end, joined.data, done.data), frozenset())
    for pair in left:
        if not done[pair]:
            links = _walked(2 * pair, joined.data, done.data)
            yield _Piece(links, frozenset({"ring"}), closed=True)


def _walked(end: int, joined: memoryview, done: memoryview) -> list[Link]:
    """Return the contacts from one end on, and mark them as done."""
    links = []
    while end >= 0 and not done[end // 2]:
        done[end // 2] = True
        # At its end 1 a contact is entered at building 2
        links.append((end // 2, end % 2 == 1))
        end = joined[end ^ 1]
    return links


class _Cutter:
    """Cuts chains into rows."""

    def __init__(self, contacts: Contacts, angle: float, longest: int) -> None:
        # Views give plain numbers without a copy
        self._buildings = contacts.buildings.ravel().data
        self._azimuth = contacts.azimuth.data
        self._gap = contacts.gap.data
        self._angle = angle
        self._longest = longest

    def pieces(self, whole: _Piece) -> Iterator[_Piece]:
        """Yield the rows of a chain."""
        waiting = [whole]
        while waiting:
            row = waiting.pop()
            parts = self._cut(row)
            if parts is None:
                yield row
            else:
                waiting.extend(part for part in parts if part.links)

    def _cut(self, row: _Piece) -> list[_Piece] | None:
        """Return the parts of a row that cannot stay one; None if it can."""
        length = len(row.links)
        if length == 1:
            return None
        if length > HALVED:
            return self._at_gap(row.flagged("cut"), length // 3, 2 * length // 3)
        # A row that comes back to a building is a ring, whether its axes show it or not
        repetition = self._repetition(row.links)
        if repetition is not None:
            return self._at_gap(row.flagged("ring"), *repetition)
        bend = self._bend(row.links)
        if bend is not None:
            bent = row.flagged("bent")
            return [bent._replace(links=part) for part in (row.links[:bend], row.links[bend:])]
        if length + 1 > self._longest:
            return self._at_gap(row.flagged("cut"), 0, length)
        return None

    def _repetition(self, links: list[Link]) -> tuple[int, int] | None:
        """Return the first contacts between two visits of one building, as a range."""
        seen = {self._buildings[2 * links[0][0] + links[0][1]]: 0}
        for place, (pair, turned) in enumerate(links, start=1):
            building = self._buildings[2 * pair + (not turned)]
            if building in seen:
                return seen[building], place
            seen[building] = place
        return None

    def _bend(self, links: list[Link]) -> int | None:
        """Return the place of the sharpest bend of contacts whose axes turn too far."""
        azimuth = [self._azimuth[pair] + 180.0 * turned for pair, turned in links]
        turns = np.diff(azimuth)
        turns = (turns + 180.0) % 360.0 - 180.0
        along = np.concatenate([[0.0], np.cumsum(turns)])
        # Rounding alone cuts no row
        if np.ptp(along) <= self._angle + 1e-9:
            return None
        return int(np.argmax(np.abs(turns))) + 1

    def _at_gap(self, row: _Piece, first: int, last: int) -> list[_Piece]:
        """Return a row cut at the widest gap of a range of contacts, nearest to its middle."""
        # Of equal gaps the one nearest to the middle
        middle = (first + last - 1) / 2.0
        links = row.links
        place = max(range(first, last), key=lambda k: (self._gap[links[k][0]], -abs(k - middle)))
        before, cut, behind = links[:place], links[place : place + 1], links[place + 1 :]
        # The rest of a ring is one row
        parts = [behind + before, cut] if row.closed else [before, cut, behind]
        return [row._replace(links=part, closed=False) for part in parts]


def _axes(azimuth: FloatArray, first: IntArray) -> tuple[FloatArray, BoolArray]:
    """Return the mean azimuth of each row, from 0 to below 180, and which have to be turned."""
    if not azimuth.size:
        return np.empty(0), np.empty(0, dtype=bool)
    angle = np.radians(azimuth)
    north, east = (np.add.reduceat(part(angle), first[:-1]) for part in (np.cos, np.sin))
    mean = np.degrees(np.arctan2(east, north))
    # A single contact keeps the azimuth of its pair, to the last digit
    single = np.diff(first) == 1
    mean = np.where(single, azimuth[first[:-1]], mean) % 360.0
    backwards = mean >= 180.0
    return np.where(backwards, mean - 180.0, mean), backwards


def _reversed(
    pair: IntArray, turned: BoolArray, first: IntArray, backwards: BoolArray
) -> tuple[IntArray, BoolArray]:
    """Return the contacts with some rows in the opposite order."""
    # Where the row of each contact begins and ends
    sizes = np.diff(first)
    starts, ends = np.repeat(first[:-1], sizes), np.repeat(first[1:], sizes)
    back = np.repeat(backwards, sizes)
    place = np.arange(pair.size)
    source = np.where(back, starts + ends - 1 - place, place)
    return pair[source], turned[source] ^ back


def _flags_of_buildings(contacts: Contacts, joints: Joints, pair: IntArray) -> dict[str, BoolArray]:
    """Return which contacts raise each flag that follows from their buildings."""
    buildings = contacts.buildings[pair]
    # A building raises the flags of all its rows
    return {
        "fork": np.asarray(joints.forks[buildings].any(axis=1)),
        "contradictory": np.asarray(joints.contradictory[buildings].any(axis=1)),
        "ambiguous_id": contacts.ambiguous[pair] | joints.crowded[buildings].any(axis=1),
        "no_building_id": ~contacts.named[buildings].all(axis=1) & ~contacts.ambiguous[pair],
        "unknown_gap": ~contacts.gap_given[pair],
        "unknown_azimuth": np.isnan(contacts.azimuth[pair]),
    }
