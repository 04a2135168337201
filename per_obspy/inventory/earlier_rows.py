"""
Pairs and buildings of a table that an earlier row has, in memory that grows by 16 bytes for each.

Names and positions are remembered as hashes of 64 bits: of 1e7 pairs two different ones share one
by chance with a probability of 3e-6.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, Self

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.quantities import BuildingRows, PairRows
from per_obspy.inventory.schema import EMPTY, SYSTEMS

_Hashes = NDArray[np.uint64]


class _Quantity(NamedTuple):
    """
    A value of a building as a whole number of some bits, 0 where it is missing.

    Two values contradict each other if their numbers differ by more than ``tolerance``; the numbers
    of places run in a circle.
    """

    name: str
    first_bit: int
    bits: int
    tolerance: int
    is_circular: bool = False

    def of(self, signature: _Hashes) -> NDArray[np.int64]:
        """Return the whole numbers of signatures."""
        mask = np.uint64((1 << self.bits) - 1)
        return ((signature >> np.uint64(self.first_bit)) & mask).astype(np.int64)

    def differs(self, value: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return where two whole numbers contradict each other; missing ones do not."""
        difference = np.abs(value - other)
        if self.is_circular:
            difference = np.minimum(difference, (1 << self.bits) - 1 - difference)
        return np.asarray((value > 0) & (other > 0) & (difference > self.tolerance))


#: A height by 1 % steps of logarithm / 10, storeys whole, a period by 2 % steps (it may differ
#: between the axes of a building, by less than 1.45), a place by steps of 2e-4 degrees (22 m; up
#: to three, as positions may be those of walls).
_QUANTITIES = (
    _Quantity("height", 0, 13, 10),
    _Quantity("number of storeys", 13, 8, 0),
    _Quantity("period", 21, 9, 18),
    _Quantity("system", 30, 3, 0),
    _Quantity("place", 33, 12, 3, is_circular=True),
    _Quantity("place", 45, 12, 3, is_circular=True),
)


class Identities(NamedTuple):
    """
    What tells pairs and buildings of some rows from others.

    Attributes
    ----------
    pairs : (n_pairs,) ndarray of uint64
        Hash of each pair that can be told from others, the same whichever building is the first.
    pair_rows : (n_pairs,) ndarray of int
        Row of each in the table.
    names : (n_buildings,) ndarray of uint64
        Hash of the identifier of each building that has one.
    signatures : (n_buildings,) ndarray of uint64
        Quantities of each.
    places : (n_buildings,) ndarray of int
        Twice the row of each in the table, and 1 more for building 2.
    """

    pairs: _Hashes
    pair_rows: NDArray[np.intp]
    names: _Hashes
    signatures: _Hashes
    places: NDArray[np.intp]

    @classmethod
    def joined(cls, blocks: Sequence[Self]) -> Self:
        """Return the identities of several blocks of rows."""
        return cls(*map(np.concatenate, zip(*blocks, strict=True)))


def identities(pair: PairRows, comparable: NDArray[np.bool_], start: int) -> Identities:
    """
    Return what tells pairs and buildings from others: both ``building_id``, else the bodies.

    Parameters
    ----------
    pair : PairRows
        Raw rows.
    comparable : (n_rows,) ndarray of bool
        Rows that are compared.
    start : int
        Row of the first one in the whole table.
    """
    names = [_name_hashes(one) for one in pair.buildings]
    pairs, is_clear = _pair_hashes(pair, names)
    rows = np.flatnonzero(is_clear & comparable)
    # Buildings 1 and 2 of each row one after the other
    keys = np.stack(names, axis=1).ravel()
    named = np.flatnonzero(keys * np.repeat(comparable, 2))
    signatures = np.empty(0, dtype=np.uint64)
    if named.size:
        signatures = np.stack([_signature(one) for one in pair.buildings], axis=1).ravel()[named]
    return Identities(pairs[rows], rows + start, keys[named], signatures, named + 2 * start)


def _pair_hashes(pair: PairRows, names: list[_Hashes]) -> tuple[_Hashes, NDArray[np.bool_]]:
    """Return a hash of each pair, and which pairs can be told from others."""
    # Either both buildings have names or neither counts
    is_named = (names[0] != 0) & (names[1] != 0)
    if is_named.all():
        return names[0] + names[1], is_named
    places = [_place_hashes(one) for one in pair.buildings]
    bodies = map(_body_hashes, pair.buildings, places)
    first, second = (np.where(is_named, *both) for both in zip(names, bodies, strict=True))
    # Pairs at one position without names are like others there
    return first + second, is_named | (places[0] != places[1])


class EarlierRows:
    """Buildings and pairs of the rows so far."""

    def __init__(self) -> None:
        self._pairs, self._buildings = FirstValues(), FirstValues()

    def repeated_pairs(
        self, found: Identities, lines: NDArray[np.int64]
    ) -> tuple[NDArray[np.intp], NDArray[np.int64]]:
        """
        Return the rows with a pair of an earlier row, and the lines of those; remember the others.

        Parameters
        ----------
        found : Identities
            Of the rows.
        lines : (n_rows,) ndarray of int
            Of all rows in their file.
        """
        keys, line = found.pairs, lines[found.pair_rows].astype(np.uint64)
        groups = _Groups(keys)
        is_stored, earlier = self._pairs.look_up(groups.keys)
        # Earlier lines come before those of this block
        first = np.where(is_stored, earlier, line[groups.first])
        self._pairs.add(groups.keys[~is_stored], first[~is_stored])
        is_later = groups.first[groups.group] != np.arange(keys.size)
        again = np.flatnonzero(is_stored[groups.group] | is_later)
        return found.pair_rows[again], first[groups.group[again]].astype(np.int64)

    def contradictions(self, found: Identities) -> dict[str, NDArray[np.intp]]:
        """Return the places of buildings that an earlier row describes otherwise, by quantity."""
        # The first signature of each building
        groups = _Groups(found.names)
        is_stored, earlier = self._buildings.look_up(groups.keys)
        first = np.where(is_stored, earlier, found.signatures[groups.first])
        # Most tables describe a building always in the same way
        is_other = found.signatures != first[groups.group]
        differs = np.zeros(groups.keys.size, dtype=bool)
        differs[groups.group[is_other]] = True
        rows = np.flatnonzero(differs[groups.group])
        group = (np.cumsum(differs) - 1)[groups.group[rows]]
        first[differs], odd = _compare(found.signatures[rows], first[differs], group)
        # What the first rows do not give stays for later ones to be compared with
        self._buildings.replace(groups.keys[differs], first[differs])
        self._buildings.add(groups.keys[~is_stored], first[~is_stored])
        return {name: found.places[rows[other]] for name, other in odd.items()}


def _compare(
    signatures: _Hashes, first: _Hashes, group: NDArray[np.intp]
) -> tuple[_Hashes, dict[str, NDArray[np.bool_]]]:
    """Return first signatures of groups, filled up by later ones, and what differs from them."""
    odd = dict[str, NDArray[np.bool_]]()
    for quantity in _QUANTITIES if group.size else ():
        value, one = quantity.of(signatures), quantity.of(first)
        # Missing (0) first values; backwards, so that the first one of a group stays
        given = np.flatnonzero((value > 0) & (one[group] == 0))[::-1]
        one[group[given]] = value[given]
        first = first | (one.astype(np.uint64) << np.uint64(quantity.first_bit))
        other = quantity.differs(value, one[group])
        if other.any():
            odd[quantity.name] = odd.get(quantity.name, False) | other
    return first, odd


class FirstValues:
    """Values by hashes, in sorted runs that grow by merging, as a sorted array has no gaps."""

    def __init__(self) -> None:
        self._runs: list[tuple[_Hashes, _Hashes]] = []

    def look_up(self, keys: _Hashes) -> tuple[NDArray[np.bool_], _Hashes]:
        """Return which sorted keys are stored, and their values."""
        is_stored, values = np.zeros(keys.size, dtype=bool), np.zeros(keys.size, dtype=np.uint64)
        for stored, at, here in self._places(keys):
            is_stored[here], values[here] = True, stored[at]
        return is_stored, values

    def replace(self, keys: _Hashes, values: _Hashes) -> None:
        """Replace the values of those sorted keys that are stored."""
        for stored, at, here in self._places(keys):
            stored[at] = values[here]

    def _places(
        self, keys: _Hashes
    ) -> Iterator[tuple[_Hashes, NDArray[np.intp], NDArray[np.intp]]]:
        """Yield the values of each run, the places of keys in it, and which keys those are."""
        for run, values in self._runs if keys.size else ():
            at = np.minimum(np.searchsorted(run, keys), run.size - 1)
            here = np.flatnonzero(run[at] == keys)
            yield values, at[here], here

    def add(self, keys: _Hashes, values: _Hashes) -> None:
        """Add sorted keys that are not stored; runs of similar size become one."""
        while self._runs and self._runs[-1][0].size < 2 * keys.size:
            run, stored = self._runs.pop()
            keys, values = np.concatenate([run, keys]), np.concatenate([stored, values])
            # A stable sort merges two sorted halves
            order = np.argsort(keys, kind="stable")
            keys, values = keys[order], values[order]
        if keys.size:
            self._runs.append((keys, values))


class _Groups:
    """Equal keys: the sorted distinct ones, the first place of each, and the group of every key."""

    def __init__(self, keys: _Hashes) -> None:
        # Keys whose last bits are replaced by their places sort faster than places by keys
        bits = np.uint64((1 << max(keys.size, 1).bit_length()) - 1)
        places = np.arange(keys.size, dtype=np.uint64)
        order = (np.sort((keys & ~bits) | places) & bits).astype(np.intp)
        if np.any(keys[order[1:]] < keys[order[:-1]]):
            order = np.argsort(keys, kind="stable")
        ordered = keys[order]
        # Equal neighbours are one group
        is_first = np.ones(keys.size, dtype=bool)
        is_first[1:] = ordered[1:] != ordered[:-1]
        self.keys, self.first = ordered[is_first], order[is_first]
        self.group = np.empty(keys.size, dtype=np.intp)
        self.group[order] = np.cumsum(is_first) - 1


def _mixed(hashes: _Hashes) -> _Hashes:
    """Return hashes whose bits are mixed (finaliser of SplitMix64, Steele and others, 2014)."""
    mixed = (hashes ^ (hashes >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return mixed ^ (mixed >> np.uint64(31))


#: Odd numbers that spread whole numbers over 64 bits (digits of pi).
_SPREAD = (
    0x243F6A8885A308D3,
    0x13198A2E03707345,
    0xA4093822299F31D1,
    0x082EFA98EC4E6C89,
    0x452821E638D01377,
)


def _whole(values: FloatArray, scale: float, spread: int) -> _Hashes:
    """Return numbers times a scale as whole numbers, spread; missing and large ones are alike."""
    scaled = np.rint(values * scale)
    scaled[~(np.abs(scaled) < 1e15)] = -1e15
    return scaled.astype(np.int64).view(np.uint64) * np.uint64(spread)


def _place_hashes(one: BuildingRows) -> _Hashes:
    """Return the positions of buildings to 1e-6 degrees, 0.1 m, as one number."""
    return _whole(one.longitude, 1e6, _SPREAD[0]) + _whole(one.latitude, 1e6, _SPREAD[1])


def _body_hashes(one: BuildingRows, place: _Hashes) -> _Hashes:
    """Return a hash of position, height, storeys and period of buildings."""
    body = place
    for values, spread in zip((one.height, one.storeys, one.period), _SPREAD[2:], strict=True):
        body = body + _whole(values, 1e3, spread)
    return _mixed(body)


def _texts(one: BuildingRows, name: str) -> pa.StringArray:
    """Return a column as texts without the blanks around them."""
    cells = pc.fill_null(pc.cast(one.table[f"{name}{one.suffix}"], pa.string()), "")
    return pc.utf8_trim_whitespace(pa.concat_arrays(cells.chunks))


def _name_hashes(one: BuildingRows) -> _Hashes:
    """Return a hash of the identifiers of buildings, 0 where one has none."""
    if not one.has("building_id"):
        return np.zeros(len(one.table), dtype=np.uint64)
    texts = _texts(one, "building_id")
    hashes = _text_hashes(texts)
    # Words for an empty cell are no names
    if pc.min(pc.binary_length(texts)).as_py() <= max(map(len, EMPTY)):
        empty = pc.is_in(pc.utf8_lower(texts), value_set=pa.array(sorted(EMPTY)))
        hashes[empty.to_numpy(zero_copy_only=False)] = 0
    return hashes


def _text_hashes(texts: pa.StringArray) -> _Hashes:
    """Return a hash of the last 256 bytes of each text, none of which is 0."""
    _, offsets, content = texts.buffers()
    edges = np.frombuffer(offsets, np.int32, len(texts) + 1, 4 * texts.offset)
    length = np.minimum(np.diff(edges), 256)
    start = edges[1:] - length
    # Words of 8 bytes from any byte on
    padded = bytes(content or b"") + bytes(8)
    words = np.ndarray(len(padded) - 7, dtype="<u8", buffer=padded, strides=(1,))
    hashes = length.astype(np.uint64)
    for first in range(0, int(length.max()), 8):
        rows = np.flatnonzero(length > first)
        # Bytes beyond the end of a text belong to the next one
        beyond = np.maximum(first + 8 - length[rows], 0).astype(np.uint64)
        word = words[start[rows] + first] << (np.uint64(8) * beyond)
        hashes[rows] = _mixed(hashes[rows] + word)
    return hashes | np.uint64(1)


def _signature(one: BuildingRows) -> _Hashes:
    """Return the quantities of buildings as one whole number each row."""
    system = np.zeros(len(one.table))
    if one.has("system"):
        places = pc.index_in(_texts(one, "system"), value_set=pa.array(SYSTEMS))
        system = pc.fill_null(places, -1).to_numpy() + 1.0
    # In the order of the quantities; places run in a circle
    codes = [1000.0 * np.log(one.height), one.storeys, 50.0 * np.log(one.period) + 256.0, system]
    for degrees in (one.longitude, one.latitude):
        steps = degrees / 2e-4
        codes.append(steps - 4095.0 * np.floor(steps / 4095.0) + 1.0)
    # Out of range is missing
    signature = np.zeros(system.size, dtype=np.uint64)
    for quantity, code in zip(_QUANTITIES, codes, strict=True):
        inside = (code >= 1.0) & (code < 1 << quantity.bits)
        whole = np.where(inside, code, 0.0).astype(np.uint64)
        signature |= whole << np.uint64(quantity.first_bit)
    return signature
