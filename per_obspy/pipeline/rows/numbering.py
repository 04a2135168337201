"""
Numbers of the buildings of all pairs, and pieces of pairs that share no building with others.

Only whole numbers of all pairs are in memory: identifiers are sorted and looked up by a database of
bounded memory.
"""

from collections.abc import Iterator
from typing import NamedTuple

import duckdb
import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from per_obspy.inventory.building_rows.contacts import IntArray, identifiers_of
from per_obspy.pipeline.rows.pair_columns import TOGETHER, PairColumns
from per_obspy.tables.parts import batches

#: Columns of the pair table without which no pair names its buildings.
IDENTIFIERS = ("building_id_1", "building_id_2")

_TEXTS = pa.schema([("place", pa.int64()), *((name, pa.string()) for name in IDENTIFIERS)])

#: Identifiers with their place in alphabetical order; cells without one are empty texts.
_NAMES = (
    "CREATE TABLE names AS SELECT name, row_number() OVER (ORDER BY name) - 1 AS number FROM ("
    "SELECT building_id_1 AS name FROM ends UNION SELECT building_id_2 FROM ends) WHERE name <> ''"
)
_NUMBERS = (
    "SELECT coalesce(first.number, -1), coalesce(second.number, -1) FROM ends "
    "LEFT JOIN names AS first ON building_id_1 = first.name "
    "LEFT JOIN names AS second ON building_id_2 = second.name ORDER BY place"
)


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
    # Identifiers are sorted once, and looked up for both sides
    texts = pa.RecordBatchReader.from_batches(_TEXTS, _texts(pairs))
    database.register("texts", texts)
    database.execute("CREATE TABLE ends AS SELECT * FROM texts")
    database.unregister("texts")
    database.execute(_NAMES)
    # In the order of the pairs
    before = 0
    for batch in batches(database, _NUMBERS, TOGETHER):
        place = slice(before, before + batch.num_rows)
        codes[place, 0], codes[place, 1] = batch[0], batch[1]
        before += batch.num_rows
    (counted,) = database.sql("SELECT count(*) FROM names").fetchall()
    for name in ("names", "ends"):
        database.execute(f"DROP TABLE {name}")
    return BuildingNumbers(codes, int(counted[0]))


def _texts(pairs: PairColumns) -> Iterator[pa.RecordBatch]:
    """Yield the place of each pair and its two identifiers, empty texts without one."""
    before = 0
    for batch in pairs.batches(IDENTIFIERS):
        frame = batch.to_pandas()
        sides = [pa.array(identifiers_of(frame, name), pa.string()) for name in IDENTIFIERS]
        place = pa.array(np.arange(before, before + batch.num_rows))
        yield pa.RecordBatch.from_arrays([place, *sides], schema=_TEXTS)
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
