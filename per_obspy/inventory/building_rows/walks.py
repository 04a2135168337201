"""Chains of joined contacts, which are followed side by side."""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.inventory.building_rows.contacts import BoolArray, Contacts, IntArray

#: Contacts of a chain beyond which it is halved before anything else: the other cuts take one part
#: at a time, and a damaged table may make one chain of all its pairs.
HALVED = 1000


class Walks(NamedTuple):
    """
    Chains that are followed side by side, one contact of each at a time.

    Attributes
    ----------
    ends : (n_contacts,) ndarray of int
        End at which each contact is entered, chain after chain.
    sizes : (n_chains,) ndarray of int
        Contacts of each chain.
    turning : (n_chains,) ndarray
        Range of the azimuths along each chain, degrees.
    """

    ends: IntArray
    sizes: IntArray
    turning: FloatArray


def walks_of(contacts: Contacts, joined: IntArray) -> Walks:
    """
    Follow all chains of limited length that have a free end, from the first of both by name.

    Parameters
    ----------
    contacts : Contacts
        Of numbered buildings.
    joined : (2 * n_pairs,) ndarray of int
        The end to which each end is joined, -1 if to none.
    """
    starts = np.flatnonzero((joined < 0) & ~np.repeat(contacts.repeated, 2))
    found = _Followed(starts.size)
    chains, ends = np.arange(starts.size), starts
    while ends.size and len(found.steps) < HALVED:
        found.steps.append((chains, ends))
        behind = joined[ends ^ 1]
        goes_on = behind >= 0
        # Chains that end here, and the next contact of the others
        found.last[chains[~goes_on]] = ends[~goes_on] ^ 1
        before, chains, ends = ends[goes_on], chains[goes_on], behind[goes_on]
        found.turn(chains, _directions(contacts, ends) - _directions(contacts, before))
    # A chain has two free ends, and is followed once from each
    names = (2 * contacts.order[ends // 2] + ends % 2 for ends in (starts, found.last))
    chosen = (found.last >= 0) & np.less_equal(*names)
    return _chosen_walks(found.steps, chosen, found.high - found.low)


def _directions(contacts: Contacts, ends: IntArray) -> FloatArray:
    """Return the azimuths of contacts that are entered at these ends, degrees."""
    # At its end 1 a contact is entered at building 2
    return contacts.azimuth[ends // 2] + 180.0 * (ends % 2)


class _Followed:
    """Chains on their way: contacts of each step, last ends, and azimuths since the first."""

    def __init__(self, count: int) -> None:
        self.steps = list[tuple[IntArray, IntArray]]()
        self.last = np.full(count, -1, dtype=np.int64)
        self.along, self.low, self.high = (np.zeros(count) for _ in range(3))

    def turn(self, chains: IntArray, turns: FloatArray) -> None:
        """Add the turns of some chains, degrees."""
        along = self.along[chains] + ((turns + 180.0) % 360.0 - 180.0)
        self.along[chains] = along
        self.low[chains] = np.minimum(self.low[chains], along)
        self.high[chains] = np.maximum(self.high[chains], along)


def _chosen_walks(
    steps: list[tuple[IntArray, IntArray]], chosen: BoolArray, turning: FloatArray
) -> Walks:
    """Return some chains, contact after contact, from the contacts of all at each step."""
    none = np.empty(0, dtype=np.int64)
    number = np.concatenate([none, *(chains for chains, _ in steps)])
    ends = np.concatenate([none, *(ends for _, ends in steps)])
    # The order of the steps within each chain stays
    kept = chosen[number]
    number, ends = number[kept], ends[kept]
    sizes = np.bincount(number, minlength=chosen.size)[chosen]
    return Walks(ends[np.argsort(number, kind="stable")], sizes, turning[chosen])


def stays_whole(contacts: Contacts, walks: Walks, angle: float, longest: int) -> BoolArray:
    """
    Return which chains are rows as they are: straight, not too long, no building twice.

    Parameters
    ----------
    contacts, walks : Contacts, Walks
        Contacts and their chains.
    angle : float
        Largest angle between the axes of two contacts of a row, degrees.
    longest : int
        Largest number of buildings of a row.
    """
    # Rounding alone cuts no row
    stays = (walks.turning <= angle + 1e-9) & (walks.sizes < longest)
    number = np.repeat(np.arange(walks.sizes.size), walks.sizes)
    buildings = contacts.buildings.ravel()
    first = np.cumsum(walks.sizes) - walks.sizes
    # The first building of each chain, then the one behind each contact
    visited = np.concatenate([buildings[walks.ends[first]], buildings[walks.ends ^ 1]])
    number = np.concatenate([np.arange(first.size), number])
    visits = np.sort(number * (contacts.names.size + 1) + visited)
    again = visits[1:][visits[1:] == visits[:-1]] // (contacts.names.size + 1)
    stays[again] = False
    return np.asarray(stays | (walks.sizes == 1))
