"""
Pairs and buildings of a table that an earlier row has, in memory that grows by 16 bytes for each.

Names and positions are remembered as hashes of 64 bits: of 1e7 pairs two different ones share one
by chance with a probability of 3e-6.
"""

from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.schema import EMPTY, SYSTEMS

_Hashes = NDArray[np.uint64]


class Numbers(Protocol):
    """Columns of numbers of some rows, NaN where a cell is none or the table has no such column."""

    def has(self, *names: str) -> bool:
        """Return whether the table has all these columns."""

    def __getitem__(self, name: str) -> FloatArray:
        """Return a column."""


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


class EarlierRows:
    """Buildings and pairs of the rows so far."""

    def __init__(self) -> None:
        self._pairs, self._buildings = _HashTable(), _HashTable()

    def compare(
        self,
        table: pa.Table,
        numbers: Numbers,
        comparable: NDArray[np.bool_],
        lines: NDArray[np.int64],
    ) -> tuple[NDArray[np.bool_], NDArray[np.int64], dict[str, NDArray[np.bool_]]]:
        """
        Compare rows with the earlier ones, and remember them.

        Parameters
        ----------
        table : Table
            Raw rows.
        numbers : Numbers
            Their columns of numbers.
        comparable : (n_rows,) ndarray of bool
            Rows to compare; the others are neither compared nor remembered.
        lines : (n_rows,) ndarray of int
            Of the rows in their file.

        Returns
        -------
        is_repeated : (n_rows,) ndarray of bool
            Pairs of earlier rows: by both ``building_id``, else by both positions, heights, storeys
            and periods.
        earlier_line : (n_rows,) ndarray of int
            Lines of those earlier rows, 0 for other rows.
        contradictions : dict of str to (n_rows, 2) ndarray of bool
            By what differs (``height`` and the like), buildings of a ``building_id`` that an
            earlier row describes otherwise.
        """
        rows = np.flatnonzero(comparable)
        names = [_name_hashes(table, i, rows) for i in (1, 2)]
        keys, is_clear = _pair_hashes(numbers, rows, names)
        again, first = self._pairs.first_values(keys, lines[rows[is_clear]].astype(np.uint64))
        # Back to the places in the table
        is_repeated, earlier_line = np.zeros(len(table), bool), np.zeros(len(table), np.int64)
        repeated = rows[is_clear][again]
        is_repeated[repeated], earlier_line[repeated] = True, first[again].astype(np.int64)
        return is_repeated, earlier_line, self._contradictions(table, numbers, rows, names)

    def _contradictions(
        self, table: pa.Table, numbers: Numbers, rows: NDArray[np.intp], names: list[_Hashes]
    ) -> dict[str, NDArray[np.bool_]]:
        """Return buildings that an earlier row describes otherwise, by what differs."""
        keys = np.stack(names, axis=1).ravel()
        named = keys != 0
        differs: dict[str, NDArray[np.bool_]] = {}
        if not named.any():
            return differs
        # Buildings 1 and 2 of each row one after the other
        signatures = np.stack([_signature(table, numbers, i, rows) for i in (1, 2)], axis=1).ravel()
        for quantity, is_other in self._buildings.compare(keys[named], signatures[named]):
            other = np.zeros(keys.size, dtype=bool)
            other[named] = is_other
            odd = differs.setdefault(quantity.name, np.zeros((len(table), 2), dtype=bool))
            odd[rows] |= other.reshape(-1, 2)
        return differs


class _Stored(NamedTuple):
    """Whether keys are stored, with which values, in which run and where in it."""

    is_stored: NDArray[np.bool_]
    values: _Hashes
    run: NDArray[np.int64]
    place: NDArray[np.intp]


class _HashTable:
    """Values by hashes, in sorted runs that grow by merging, as a sorted array has no gaps."""

    def __init__(self) -> None:
        self._keys: list[_Hashes] = []
        self._values: list[_Hashes] = []

    def first_values(self, keys: _Hashes, values: _Hashes) -> tuple[NDArray[np.bool_], _Hashes]:
        """
        Return which keys occurred before, and the value of each key's first occurrence.

        New keys are added with their values.
        """
        distinct, first, group = _groups(keys)
        found = self._look_up(distinct)
        # Earlier values come before those of this block
        start = values[first]
        start[found.is_stored] = found.values[found.is_stored]
        self._add(distinct[~found.is_stored], start[~found.is_stored])
        again = found.is_stored[group] | (first[group] != np.arange(keys.size))
        return again, start[group]

    def compare(
        self, keys: _Hashes, signatures: _Hashes
    ) -> Iterator[tuple[_Quantity, NDArray[np.bool_]]]:
        """Yield where a quantity differs from the first value of its key, and remember those."""
        distinct, first, group = _groups(keys)
        found = self._look_up(distinct)
        # New keys that occur once have nothing to be compared with
        merged = np.where(found.is_stored, found.values, 0)
        if distinct.size == keys.size and not found.is_stored.any():
            merged = signatures[first]
        else:
            for quantity in _QUANTITIES:
                value, first_value = quantity.of(signatures), quantity.of(merged)
                _fill(first_value, value, group)
                merged |= first_value.astype(np.uint64) << np.uint64(quantity.first_bit)
                yield quantity, quantity.differs(value, first_value[group])
        # What the first rows do not give stays for later ones to compare with
        for run, values in enumerate(self._values):
            values[found.place[found.run == run]] = merged[found.run == run]
        self._add(distinct[~found.is_stored], merged[~found.is_stored])

    def _look_up(self, keys: _Hashes) -> _Stored:
        """Return where sorted keys are stored, and their values."""
        run, place = np.full(keys.size, -1), np.zeros(keys.size, dtype=np.intp)
        values = np.zeros(keys.size, dtype=np.uint64)
        # Each key is in one run at most
        for number, stored in enumerate(self._keys):
            at = np.minimum(np.searchsorted(stored, keys), stored.size - 1)
            here = np.flatnonzero(stored[at] == keys)
            run[here], place[here] = number, at[here]
            values[here] = self._values[number][at[here]]
        return _Stored(run >= 0, values, run, place)

    def _add(self, keys: _Hashes, values: _Hashes) -> None:
        """Add sorted keys that are not stored; runs of similar size become one."""
        while self._keys and self._keys[-1].size < 2 * keys.size:
            keys = np.concatenate([self._keys.pop(), keys])
            values = np.concatenate([self._values.pop(), values])
            # A stable sort merges two sorted halves
            order = np.argsort(keys, kind="stable")
            keys, values = keys[order], values[order]
        if keys.size:
            self._keys.append(keys)
            self._values.append(values)


def _fill(
    first_value: NDArray[np.int64], value: NDArray[np.int64], group: NDArray[np.intp]
) -> None:
    """Fill up missing (0) first values of groups by the first one of these that is not missing."""
    place = np.full(first_value.size, value.size)
    # Backwards, so that the first place stays
    given = np.flatnonzero(value > 0)[::-1]
    place[group[given]] = given
    is_new = (first_value == 0) & (place < value.size)
    first_value[is_new] = value[place[is_new]]


def _groups(keys: _Hashes) -> tuple[_Hashes, NDArray[np.intp], NDArray[np.intp]]:
    """Return sorted distinct keys, the first place of each, and the group of every key."""
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
    group = np.empty(keys.size, dtype=np.intp)
    group[order] = np.cumsum(is_first) - 1
    return ordered[is_first], order[is_first], group


def _mixed(hashes: _Hashes) -> _Hashes:
    """Return hashes whose bits are mixed (finaliser of SplitMix64, Steele and others, 2014)."""
    with np.errstate(over="ignore"):
        mixed = (hashes ^ (hashes >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return mixed ^ (mixed >> np.uint64(31))


def _pair_hashes(
    numbers: Numbers, rows: NDArray[np.intp], names: list[_Hashes]
) -> tuple[_Hashes, NDArray[np.bool_]]:
    """Return a hash of each pair that can be told from others, and which pairs those are."""
    # Either both buildings have names or neither counts
    is_clear = (names[0] != 0) & (names[1] != 0)
    ends = names
    if not is_clear.all():
        places = [_place_hashes(numbers, i, rows) for i in (1, 2)]
        bodies = [_body_hashes(numbers, i, rows, places[i - 1]) for i in (1, 2)]
        ends = [np.where(is_clear, *both) for both in zip(names, bodies, strict=True)]
        # Pairs at one position without names are like others there
        is_clear = is_clear | (places[0] != places[1])
    # The same whichever building is the first
    return _mixed(np.minimum(*ends) ^ _mixed(np.maximum(*ends)))[is_clear], is_clear


def _whole(values: FloatArray, scale: float) -> _Hashes:
    """Return numbers times a scale as whole numbers; missing ones and large ones are alike."""
    scaled = np.rint(values * scale)
    return np.where(np.abs(scaled) < 1e15, scaled, -1e15).astype(np.int64).view(np.uint64)


def _place_hashes(numbers: Numbers, i: int, rows: NDArray[np.intp]) -> _Hashes:
    """Return a hash of the position of building i to 1e-6 degrees, 0.1 m."""
    east = _whole(numbers[f"longitude_{i}"][rows], 1e6)
    north = _whole(numbers[f"latitude_{i}"][rows], 1e6)
    return _mixed(east * np.uint64(400_000_001) + north)


def _body_hashes(numbers: Numbers, i: int, rows: NDArray[np.intp], hashes: _Hashes) -> _Hashes:
    """Return a hash of position, height, storeys and period of building i."""
    for name in (f"height_{i}", f"storeys_{i}", f"period_{i}"):
        if numbers.has(name):
            hashes = _mixed(hashes ^ _whole(numbers[name][rows], 1e3))
    return hashes


def _name_hashes(table: pa.Table, i: int, rows: NDArray[np.intp]) -> _Hashes:
    """Return a hash of the identifiers of building i, 0 where a building has none."""
    name = f"building_id_{i}"
    if name not in table.column_names or not rows.size:
        return np.zeros(rows.size, dtype=np.uint64)
    texts = pc.utf8_trim_whitespace(pc.cast(table[name], pa.string()))
    # Words for an empty cell are no names
    texts = pc.fill_null(texts if rows.size == len(table) else pc.take(texts, pa.array(rows)), "")
    empty = pc.is_in(pc.utf8_lower(texts), value_set=pa.array(sorted(EMPTY)))
    return np.where(empty.to_numpy(), np.uint64(0), _text_hashes(texts))


def _text_hashes(texts: pa.ChunkedArray) -> _Hashes:
    """Return a hash of the last 64 letters of each text, none of which is 0."""
    texts = pc.utf8_slice_codeunits(texts, start=-64)
    length = -(-(pc.max(pc.binary_length(texts)).as_py() or 1) // 8) * 8
    # All of equal length, so that they are a table of words of 8 bytes
    padded = pc.utf8_rpad(texts, length, " ").combine_chunks()
    content = bytes(padded.buffers()[2] or b"")
    offset = padded.offset
    if len(content) != (offset + len(padded)) * length:
        content = b"".join(text.encode().ljust(length) for text in texts.to_pylist())
        offset = 0
    words = np.frombuffer(content, dtype="<u8").reshape(-1, length // 8)[offset:]
    hashes = np.zeros(len(words), dtype=np.uint64)
    # Words of blanks only belong to no text, whatever the length of the others
    for word in words.T:
        hashes = np.where(word == _BLANKS, hashes, _mixed(hashes + word))
    return hashes | np.uint64(1)


_BLANKS = np.frombuffer(b" " * 8, dtype="<u8")[0]


def _signature(table: pa.Table, numbers: Numbers, i: int, rows: NDArray[np.intp]) -> _Hashes:
    """Return the quantities of building i as one whole number each row."""
    with np.errstate(divide="ignore", invalid="ignore"):
        height = 1000.0 * np.log(numbers[f"height_{i}"][rows])
        period = 50.0 * np.log(numbers[f"period_{i}"][rows]) + 256.0
    # In the order of the quantities; places run in a circle
    codes = [height, numbers[f"storeys_{i}"][rows], period, _system(table, i, rows)]
    for name in ("longitude", "latitude"):
        steps = numbers[f"{name}_{i}"][rows] / 2e-4
        codes.append(steps - 4095.0 * np.floor(steps / 4095.0) + 1.0)
    # Out of range is missing
    signature = np.zeros(rows.size, dtype=np.uint64)
    for quantity, code in zip(_QUANTITIES, codes, strict=True):
        inside = (code >= 1.0) & (code < 1 << quantity.bits)
        whole = np.where(inside, code, 0.0).astype(np.uint64)
        signature |= whole << np.uint64(quantity.first_bit)
    return signature


def _system(table: pa.Table, i: int, rows: NDArray[np.intp]) -> FloatArray:
    """Return the number of the structural system of building i, 0 where it has none."""
    name = f"system_{i}"
    if name not in table.column_names:
        return np.zeros(rows.size)
    texts = pc.utf8_trim_whitespace(pc.cast(table[name], pa.string()))
    places = pc.fill_null(pc.index_in(texts, value_set=pa.array(SYSTEMS)), -1)
    return np.asarray(places.to_numpy()[rows] + 1.0)
