"""
Pairs and buildings of a table that an earlier row has, in memory that grows by 16 bytes for each.

Names and positions are remembered as hashes of 64 bits: of 1e7 pairs two different ones share one
by chance with a probability of 3e-6.
"""

from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np
import pandas as pd
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


class Repeated(NamedTuple):
    """Rows with the two buildings of an earlier row, and the line of that row (0 for others)."""

    rows: NDArray[np.bool_]
    earlier_line: NDArray[np.int64]


class _Quantity(NamedTuple):
    """
    A value of a building as a whole number of some bits, 0 where it is missing.

    Two values contradict each other if their numbers differ by more than ``tolerance``; the numbers
    of places run in a circle.
    """

    name: str
    columns: tuple[str, ...]
    first_bit: int
    bits: int
    tolerance: int
    is_circular: bool = False

    def of(self, signature: _Hashes) -> NDArray[np.int64]:
        """Return the whole numbers of signatures."""
        mask = np.uint64((1 << self.bits) - 1)
        return ((signature >> np.uint64(self.first_bit)) & mask).astype(np.int64)


#: A height by 1 % steps of logarithm / 10, storeys whole, a period by 2 % steps (it may differ
#: between the axes of a building, by less than 1.45), a place by steps of 2e-4 degrees (22 m; up
#: to three, as positions may be those of walls).
_QUANTITIES = (
    _Quantity("height", ("height",), 0, 13, 10),
    _Quantity("number of storeys", ("storeys",), 13, 8, 0),
    _Quantity("period", ("period",), 21, 9, 18),
    _Quantity("system", ("system",), 30, 3, 0),
    _Quantity("place", ("longitude",), 33, 12, 3, is_circular=True),
    _Quantity("place", ("latitude",), 45, 12, 3, is_circular=True),
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
    ) -> tuple[Repeated, list[tuple[int, str, NDArray[np.bool_], tuple[str, ...]]]]:
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
        repeated : Repeated
            Pairs of earlier rows: by both ``building_id``, else by both positions, heights, storeys
            and periods.
        contradictions : list of tuple
            Building (1 or 2), what differs, rows, and the columns that have it.
        """
        rows = np.flatnonzero(comparable)
        repeated = Repeated(np.zeros(len(table), bool), np.zeros(len(table), np.int64))
        if not rows.size:
            return repeated, []
        names = [_name_hashes(table, i, rows) for i in (1, 2)]
        bodies = [_body_hashes(numbers, i, rows) for i in (1, 2)]
        # Either both have names or neither counts
        has_names = (names[0] != 0) & (names[1] != 0)
        ends = [np.where(has_names, *both) for both in zip(names, bodies, strict=True)]
        # Two buildings at one position without names cannot be told from others there
        apart = has_names | (_place_hash(numbers, 1, rows) != _place_hash(numbers, 2, rows))
        keys = _mixed(np.minimum(*ends) ^ _mixed(np.maximum(*ends)))
        found = self._pairs.first_values(keys[apart], lines[rows[apart]].astype(np.uint64))
        again = rows[apart][found.is_known]
        repeated.rows[again] = True
        repeated.earlier_line[again] = found.values[found.is_known].astype(np.int64)
        return repeated, [*self._contradictions(table, numbers, rows, names)]

    def _contradictions(
        self, table: pa.Table, numbers: Numbers, rows: NDArray[np.intp], names: list[_Hashes]
    ) -> Iterator[tuple[int, str, NDArray[np.bool_], tuple[str, ...]]]:
        """Yield rows with a building that an earlier row describes otherwise."""
        keys = np.stack(names, axis=1).ravel()
        named = keys != 0
        if not named.any():
            return
        # Buildings 1 and 2 of each row one after the other
        signatures = np.stack([_signature(table, numbers, i, rows) for i in (1, 2)], axis=1).ravel()
        differs = {}
        for quantity, is_other in self._buildings.compare(keys[named], signatures[named]):
            other = np.zeros(keys.size, dtype=bool)
            other[named] = is_other
            differs[quantity.name] = differs.get(quantity.name, False) | other
        columns = {one.name: one.columns for one in _QUANTITIES} | {
            "place": ("longitude", "latitude")
        }
        for name, other in differs.items():
            for i in (1, 2):
                odd = np.zeros(len(table), dtype=bool)
                odd[rows[other[i - 1 :: 2]]] = True
                yield i, name, odd, tuple(f"{column}_{i}" for column in columns[name])


class _Found(NamedTuple):
    """Which keys an earlier row has, and the value of the first of them."""

    is_known: NDArray[np.bool_]
    values: _Hashes


class _HashTable:
    """Values by hashes, in sorted runs that grow by merging, as a sorted array has no gaps."""

    def __init__(self) -> None:
        self._keys: list[_Hashes] = []
        self._values: list[_Hashes] = []

    def first_values(self, keys: _Hashes, values: _Hashes) -> _Found:
        """Return the value of each key's first occurrence, and add those that are new."""
        distinct, first, inverse = _groups(keys)
        stored, run, place = self._look_up(distinct)
        known = stored[inverse]
        known |= first[inverse] != np.arange(keys.size)
        start = values[first]
        for number, run_values in enumerate(self._values):
            of_run = run == number
            start[of_run] = run_values[place[of_run]]
        self._add(distinct[~stored], start[~stored])
        return _Found(known, start[inverse])

    def compare(
        self, keys: _Hashes, signatures: _Hashes
    ) -> Iterator[tuple[_Quantity, NDArray[np.bool_]]]:
        """Yield where a quantity differs from the first value of its key, and remember those."""
        distinct, first, inverse = _groups(keys)
        stored, run, place = self._look_up(distinct)
        # Keys that occur once and are new have nothing to be compared with
        start = np.zeros(distinct.size, dtype=np.uint64)
        for number, run_values in enumerate(self._values):
            of_run = run == number
            start[of_run] = run_values[place[of_run]]
        merged = start.copy()
        order = np.arange(keys.size)
        alone = distinct.size == keys.size and not stored.any()
        for quantity in () if alone else _QUANTITIES:
            value, known = quantity.of(signatures), quantity.of(start)
            # The first value that is not missing, in this block where no earlier one has it
            place_of_first = np.full(distinct.size, keys.size)
            given = np.flatnonzero(value > 0)[::-1]
            place_of_first[inverse[given]] = order[given]
            is_new = (known == 0) & (place_of_first < keys.size)
            known[is_new] = value[place_of_first[is_new]]
            merged[is_new] |= known[is_new].astype(np.uint64) << np.uint64(quantity.first_bit)
            difference = np.abs(value - known[inverse])
            if quantity.is_circular:
                difference = np.minimum(difference, (1 << quantity.bits) - 1 - difference)
            yield quantity, (value > 0) & (difference > quantity.tolerance)
        if alone:
            merged = signatures[first]
        for number, run_values in enumerate(self._values):
            of_run = run == number
            run_values[place[of_run]] = merged[of_run]
        self._add(distinct[~stored], merged[~stored])

    def _look_up(
        self, keys: _Hashes
    ) -> tuple[NDArray[np.bool_], NDArray[np.int64], NDArray[np.intp]]:
        """Return which sorted keys are stored, in which run, and where in it."""
        run = np.full(keys.size, -1)
        place = np.zeros(keys.size, dtype=np.intp)
        for number, stored in enumerate(self._keys):
            at = np.minimum(np.searchsorted(stored, keys), stored.size - 1)
            here = stored[at] == keys
            run[here], place[here] = number, at[here]
        return run >= 0, run, place

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


def _groups(keys: _Hashes) -> tuple[_Hashes, NDArray[np.intp], NDArray[np.intp]]:
    """Return sorted distinct keys, the first place of each, and the group of every key."""
    return np.unique(keys, return_index=True, return_inverse=True)


def _mixed(hashes: _Hashes) -> _Hashes:
    """Return hashes whose bits are mixed (finaliser of SplitMix64, Steele and others, 2014)."""
    with np.errstate(over="ignore"):
        mixed = (hashes ^ (hashes >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return mixed ^ (mixed >> np.uint64(31))


def _whole(values: FloatArray, scale: float) -> _Hashes:
    """Return numbers over a scale as whole numbers; NaN and what is out of range are alike."""
    scaled = np.nan_to_num(np.rint(values * scale), nan=-1e15, posinf=-1e15, neginf=-1e15)
    return np.clip(scaled, -1e15, 1e15).astype(np.int64).view(np.uint64)


def _place_hash(numbers: Numbers, i: int, rows: NDArray[np.intp]) -> _Hashes:
    """Return a hash of the position of building i to 1e-6 degrees, 0.1 m."""
    east = _whole(numbers[f"longitude_{i}"][rows], 1e6)
    north = _whole(numbers[f"latitude_{i}"][rows], 1e6)
    return _mixed(east + np.uint64(1)) ^ north


def _body_hashes(numbers: Numbers, i: int, rows: NDArray[np.intp]) -> _Hashes:
    """Return a hash of position, height, storeys and period of building i."""
    hashes = _mixed(_place_hash(numbers, i, rows))
    for name in (f"height_{i}", f"storeys_{i}", f"period_{i}"):
        if numbers.has(name):
            hashes = _mixed(hashes ^ _whole(numbers[name][rows], 1e3))
    return hashes


def _name_hashes(table: pa.Table, i: int, rows: NDArray[np.intp]) -> _Hashes:
    """Return a hash of the identifiers of building i, 0 where a building has none."""
    name = f"building_id_{i}"
    if name not in table.column_names:
        return np.zeros(rows.size, dtype=np.uint64)
    texts = pc.utf8_trim_whitespace(pc.cast(table[name], pa.string()))
    if rows.size < len(table):
        texts = pc.take(texts, pa.array(rows))
    hashes = _text_hashes(pc.fill_null(texts, "").to_numpy())
    hashes[np.isin(hashes, _NO_NAME)] = 0
    return hashes


def _text_hashes(texts: NDArray[np.object_]) -> _Hashes:
    """Return a hash of each text."""
    hashes: _Hashes = pd.util.hash_array(np.asarray(texts, dtype=object), categorize=False)
    return hashes


_NO_NAME = _text_hashes(
    np.array([word for empty in sorted(EMPTY) for word in {empty, empty.upper()}], dtype=object)
)


def _signature(table: pa.Table, numbers: Numbers, i: int, rows: NDArray[np.intp]) -> _Hashes:
    """Return the quantities of building i as one whole number each row."""
    with np.errstate(divide="ignore", invalid="ignore"):
        height = 1000.0 * np.log(numbers[f"height_{i}"][rows])
        period = 50.0 * np.log(numbers[f"period_{i}"][rows]) + 256.0
    codes = [height, numbers[f"storeys_{i}"][rows], period, _system(table, i, rows)]
    codes += [
        numbers[f"{name}_{i}"][rows] / 2e-4 % 4095.0 + 1.0 for name in ("longitude", "latitude")
    ]
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
