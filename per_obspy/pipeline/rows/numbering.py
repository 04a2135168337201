"""
Numbers of the buildings of all pairs, and pieces of pairs that share no building with others.

Only whole numbers of all pairs are in memory: identifiers are sorted by a database of bounded
memory.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import duckdb
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from per_obspy.inventory.building_rows.contacts import IntArray, identifiers_of
from per_obspy.pipeline.rows.pair_columns import PairColumns
from per_obspy.tables.parts import batches

#: Columns of the pair table without which no pair names its buildings.
IDENTIFIERS = ("building_id_1", "building_id_2")

#: Sorted identifiers that are numbered together.
SORTED = 100_000

#: Identifier of one building of a pair, and its place: 2 · pair, + 1 at building 2.
_ENDS = pa.schema([("place", pa.int64()), ("name", pa.string())])

_SORTED = "SELECT place, name FROM ends ORDER BY name"


class BuildingNumbers(NamedTuple):
    """
    Numbers of buildings with an identifier.

    Attributes
    ----------
    codes : (n_pairs, 2) ndarray of int
        Place of the identifiers of each pair in their alphabetical order; -1 without one.
    named : int
        Number of identifiers.
    """

    codes: NDArray[np.int32]
    named: int


def building_numbers(pairs: PairColumns, database: duckdb.DuckDBPyConnection) -> BuildingNumbers:
    """
    Return numbers of the buildings of all pairs, by their identifiers.

    Parameters
    ----------
    pairs : PairColumns
        The risk table; ``building_id_1`` and ``building_id_2`` may be absent.
    database : DuckDBPyConnection
        Of bounded memory.
    """
    codes = np.full((pairs.pairs, 2), -1, dtype=np.int32)
    if not set(IDENTIFIERS) & set(pairs.names):
        return BuildingNumbers(codes, 0)
    # In the order of the names
    ends, named = codes.reshape(-1), 0
    database.register("ends", pa.RecordBatchReader.from_batches(_ENDS, _ends(pairs)))
    for place, number in _numbered(batches(database, _SORTED, SORTED)):
        ends[place] = number
        named = int(number[-1]) + 1
    database.unregister("ends")
    return BuildingNumbers(codes, named)


def _numbered(ends: Iterable[pa.RecordBatch]) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield places and numbers of sorted identifiers: every new one has the next number."""
    number, last = -1, ""
    for batch in ends:
        names = batch["name"]
        is_new = np.empty(batch.num_rows, dtype=bool)
        # The first may be the last of the batch before
        is_new[0] = names[0].as_py() != last
        is_new[1:] = pc.not_equal(names[1:], names[:-1]).to_numpy(zero_copy_only=False)
        numbers = number + np.cumsum(is_new)
        yield batch["place"].to_numpy(), numbers
        number, last = int(numbers[-1]), names[-1].as_py()


def _ends(pairs: PairColumns) -> Iterator[pa.RecordBatch]:
    """Yield place and identifier of the buildings that have one."""
    before = 0
    for batch in pairs.batches(IDENTIFIERS):
        frame = batch.to_pandas()
        # Both buildings of a pair
        for side, name in enumerate(IDENTIFIERS):
            texts = pa.array(identifiers_of(frame, name), pa.string())
            place = pa.array(2 * np.arange(before, before + batch.num_rows) + side)
            ends = pa.RecordBatch.from_arrays([place, texts], schema=_ENDS)
            yield ends.filter(pc.not_equal(texts, ""))
        before += batch.num_rows


def piece_numbers(numbers: BuildingNumbers, size: int) -> NDArray[np.int32]:
    """
    Return the number of the piece of each pair: pairs that share a building are in one piece.

    Parameters
    ----------
    numbers : BuildingNumbers
        From :func:`building_numbers`.
    size : int
        Pairs of a piece, about; connected pairs are in one piece however many they are.

    Examples
    --------
    >>> codes = np.array([[0, 1], [2, 3], [1, 4], [-1, -1]], dtype=np.int32)
    >>> piece_numbers(BuildingNumbers(codes, 5), 2).tolist()
    [0, 1, 0, 1]
    """
    label, labels = _connected(numbers)
    # Whole groups of connected pairs one after the other
    sizes = np.bincount(label, minlength=labels)
    before = np.cumsum(sizes) - sizes
    piece: IntArray = np.floor_divide(before, size)
    return piece.astype(np.int32)[label]


def _connected(numbers: BuildingNumbers) -> tuple[NDArray[np.int32], int]:
    """Return the number of the group of connected pairs of each pair, and the number of groups."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    codes, count = numbers
    # Buildings are joined by the pairs that have two of them
    first, second = codes[:, 0], codes[:, 1]
    both = (first >= 0) & (second >= 0)
    edges = first[both], second[both]
    graph = coo_array((np.ones(edges[0].size, dtype=np.int8), edges), shape=(count, count))
    labels, of_building = connected_components(graph, directed=False)
    # A pair of one identifier belongs to its building, one without any is a group of its own
    named = np.maximum(first, second)
    own = np.flatnonzero(named < 0)
    label = np.empty(named.size, dtype=np.int32)
    label[named >= 0] = of_building[named[named >= 0]]
    label[own] = labels + np.arange(own.size, dtype=np.int32)
    return label, labels + own.size
