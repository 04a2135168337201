"""
Pairs and buildings of a table that an earlier row has, in memory that grows by 16 bytes for each.

Names and positions are remembered as hashes of 64 bits: of 1e7 pairs two different ones share one
by chance with a probability of 3e-6.
"""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.inventory.files.raw_rows import mixed, name_hashes, stripped
from per_obspy.inventory.quantities import PairRows, Rows
from per_obspy.inventory.schema import EMPTY, SYSTEMS

_Hashes = NDArray[np.uint64]
_Places = NDArray[np.intp]

#: Quantities of a building as whole numbers in 57 bits, its signature: name, first bit, bits and
#: tolerance of each. 0 is a missing value; two others contradict each other if they differ by more
#: than the tolerance. A height by 1 % steps of logarithm / 10, storeys whole, a period by 2 % steps
#: (it may differ between the axes of a building, by less than 1.45), a place by steps of 2e-4
#: degrees in a circle (22 m; up to three, as positions may be those of walls).
_QUANTITIES = (
    ("height", 0, 13, 10),
    ("number of storeys", 13, 8, 0),
    ("period", 21, 9, 18),
    ("system", 30, 4, 0),
    ("place", 34, 12, 3),
    ("place", 46, 12, 3),
)

#: Odd numbers that spread whole numbers over 64 bits (digits of pi).
_SPREAD = (
    *(0x243F6A8885A308D3, 0x13198A2E03707345, 0xA4093822299F31D1),
    *(0x082EFA98EC4E6C89, 0x452821E638D01377),
)


class EarlierRows:
    """Buildings and pairs of the rows so far: lines of pairs, signatures of buildings."""

    def __init__(self) -> None:
        self._pairs, self._buildings = FirstValues(), FirstValues()

    def compare(
        self, pair: PairRows, comparable: NDArray[np.bool_], lines: NDArray[np.int64]
    ) -> tuple[_Places, NDArray[np.int64], dict[str, _Places]]:
        """
        Compare rows with the earlier ones, and remember what is new.

        Parameters
        ----------
        pair : PairRows
            Raw rows.
        comparable : (n_rows,) ndarray of bool
            Rows that are compared.
        lines : (n_rows,) ndarray of int
            Of the rows in their file.

        Returns
        -------
        again, earlier : ndarray
            Rows with a pair of an earlier row, and the lines of those.
        otherwise : dict of str to ndarray
            Quantity -> buildings that an earlier row describes otherwise: twice the row, and 1 more
            for building 2.
        """
        # Pairs by both names, else by what their buildings are
        names = [_building_names(one) for one in pair.buildings]
        hashes, is_clear = _pair_hashes(pair, names)
        rows = np.flatnonzero(is_clear & comparable)
        line = lines[rows].astype(np.uint64)
        keys, is_stored, first, group, is_first = self._pairs.first(hashes[rows], line)
        self._pairs.add(keys[~is_stored], first[~is_stored])
        again = np.flatnonzero(is_stored[group] | ~is_first)
        # Buildings 1 and 2 of each row one after the other
        hashes = np.stack(names, axis=1).ravel()
        named = np.flatnonzero(hashes * np.repeat(comparable, 2))
        odd = self._contradictions(hashes[named], pair, named) if named.size else {}
        return rows[again], first[group[again]].astype(np.int64), odd

    def _contradictions(
        self, hashes: _Hashes, pair: PairRows, named: _Places
    ) -> dict[str, _Places]:
        """Return those of the named buildings that an earlier row describes otherwise."""
        signatures = np.stack([_signature(one) for one in pair.buildings], axis=1).ravel()[named]
        keys, is_stored, first, group, _ = self._buildings.first(hashes, signatures)
        # Most tables describe a building always in the same way
        differs = np.zeros(keys.size, dtype=bool)
        differs[group[signatures != first[group]]] = True
        rows = np.flatnonzero(differs[group])
        among = (np.cumsum(differs) - 1)[group[rows]]
        first[differs], odd = _compare(signatures[rows], first[differs], among)
        # What the first rows do not give stays for later ones to be compared with
        self._buildings.replace(keys[differs], first[differs])
        self._buildings.add(keys[~is_stored], first[~is_stored])
        return {name: named[rows[other]] for name, other in odd.items()}


def _compare(
    signatures: _Hashes, first: _Hashes, group: _Places
) -> tuple[_Hashes, dict[str, NDArray[np.bool_]]]:
    """Return first signatures of groups, filled up by later ones, and what differs from them."""
    odd = dict[str, NDArray[np.bool_]]()
    for name, bit, bits, tolerance in _QUANTITIES if group.size else ():
        shift, mask = np.uint64(bit), (1 << bits) - 1
        value, one = ((code >> shift).astype(np.int64) & mask for code in (signatures, first))
        # Missing (0) first values; backwards, so that the first one of a group stays
        given = np.flatnonzero((value > 0) & (one[group] == 0))[::-1]
        one[group[given]] = value[given]
        first = first | (one.astype(np.uint64) << shift)
        # The numbers of places run in a circle
        difference = np.abs(value - one[group])
        if name == "place":
            difference = np.minimum(difference, mask - difference)
        other = (value > 0) & (one[group] > 0) & (difference > tolerance)
        if other.any():
            odd[name] = odd.get(name, False) | other
    return first, odd


class FirstValues:
    """Values by hashes, in sorted runs that grow by merging, as a sorted array has no gaps."""

    def __init__(self) -> None:
        self._runs: list[tuple[_Hashes, _Hashes]] = []

    def first(
        self, hashes: _Hashes, values: _Hashes
    ) -> tuple[_Hashes, NDArray[np.bool_], _Hashes, _Places, NDArray[np.bool_]]:
        """
        Return the distinct hashes, sorted, which are stored, and the first value of each.

        Then come the place of every hash among them, and whether it is the first of its kind here.
        """
        codes, keys = pd.factorize(hashes)
        order = np.argsort(keys)
        place = np.empty_like(order)
        place[order] = np.arange(order.size)
        # Codes rise by one with every new hash
        is_first = np.diff(np.maximum.accumulate(codes), prepend=-1) > 0
        keys, first = keys[order], values[is_first][order]
        is_stored = np.zeros(keys.size, dtype=bool)
        for stored, at, here in self._places(keys):
            is_stored[here], first[here] = True, stored[at]
        return keys, is_stored, first, place[codes], is_first

    def replace(self, keys: _Hashes, values: _Hashes) -> None:
        """Replace the values of those sorted keys that are stored."""
        for stored, at, here in self._places(keys):
            stored[at] = values[here]

    def _places(self, keys: _Hashes) -> Iterator[tuple[_Hashes, _Places, _Places]]:
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


def _pair_hashes(pair: PairRows, names: list[_Hashes]) -> tuple[_Hashes, NDArray[np.bool_]]:
    """
    Return a hash of each pair, and which pairs can be told from others.

    It is the same whichever building is the first.
    """
    # Either both buildings have names or neither counts
    is_named = (names[0] != 0) & (names[1] != 0)
    if is_named.all():
        return names[0] + names[1], is_named
    # Positions to 1e-6 degrees, 0.1 m, with height, storeys and period
    places, bodies = list[_Hashes](), list[_Hashes]()
    for one in pair.buildings:
        place = _whole(one.longitude, 1e6, _SPREAD[0]) + _whole(one.latitude, 1e6, _SPREAD[1])
        body = place
        for values, spread in zip((one.height, one.storeys, one.period), _SPREAD[2:], strict=True):
            body = body + _whole(values, 1e3, spread)
        places.append(place)
        bodies.append(mixed(body))
    first, second = (np.where(is_named, *both) for both in zip(names, bodies, strict=True))
    # Pairs at one position without names are like others there
    return first + second, is_named | (places[0] != places[1])


def _whole(values: FloatArray, scale: float, spread: int) -> _Hashes:
    """Return numbers times a scale as whole numbers, spread; missing and large ones are alike."""
    scaled = np.rint(values * scale)
    scaled[~(np.abs(scaled) < 1e15)] = -1e15
    return scaled.astype(np.int64).view(np.uint64) * np.uint64(spread)


def _building_names(one: Rows) -> _Hashes:
    """Return a hash of the identifiers of buildings, 0 where one has none."""
    if not one.has("building_id"):
        return np.zeros(len(one.table), dtype=np.uint64)
    texts = stripped(one.table[f"building_id{one.suffix}"])
    hashes = name_hashes(texts)
    # Words for an empty cell are no names
    if pc.min(pc.binary_length(texts)).as_py() <= max(map(len, EMPTY)):
        empty = pc.is_in(pc.utf8_lower(texts), value_set=pa.array(sorted(EMPTY)))
        hashes[empty.to_numpy(zero_copy_only=False)] = 0
    return hashes


def _signature(one: Rows) -> _Hashes:
    """Return the quantities of buildings as one whole number each row."""
    systems = one.table[f"system{one.suffix}"] if one.has("system") else pa.nulls(len(one.table))
    system = pc.fill_null(pc.index_in(stripped(systems), pa.array(SYSTEMS)), -1).to_numpy() + 1.0
    sizes = (1000.0 * np.log(one.height), one.storeys, 50.0 * np.log(one.period) + 256.0)
    # Places run in a circle
    steps = np.stack([one.longitude, one.latitude]) / 2e-4
    places = steps - 4095.0 * np.floor(steps / 4095.0) + 1.0
    # Out of range is missing
    signature = np.zeros(system.size, dtype=np.uint64)
    for (_, bit, bits, _), code in zip(_QUANTITIES, (*sizes, system, *places), strict=True):
        inside = (code >= 1.0) & (code < 1 << bits)
        signature |= np.where(inside, code, 0.0).astype(np.uint64) << np.uint64(bit)
    return signature
