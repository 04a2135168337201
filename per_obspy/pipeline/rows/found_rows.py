"""
Search for rows of buildings a piece at a time, so that memory does not grow with the pairs.

Pairs that share a building with others of a piece are in that piece: every row, and everything
that is known of a building, is found in one piece. Only connected pairs are never divided.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import duckdb
import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from per_obspy.config.pairs import Rows
from per_obspy.errors import Rejection
from per_obspy.inventory.building_rows.chains import Chains, chains_of
from per_obspy.inventory.building_rows.contacts import BoolArray, Contacts, IntArray, contacts_of
from per_obspy.inventory.building_rows.given import PROPERTIES, GivenColumns
from per_obspy.inventory.building_rows.joints import Joints, joints_of
from per_obspy.inventory.table_columns import joined_names
from per_obspy.pipeline.rows.numbering import IDENTIFIERS, BuildingNumbers
from per_obspy.pipeline.rows.pair_columns import PairColumns
from per_obspy.screening.building_rows.placed import PlacedRows, placed_rows
from per_obspy.tables.parts import batches

#: Columns of the risk table by which rows are found, and by which they are placed; some may be
#: absent.
FINDING = (
    "pair_id",
    *IDENTIFIERS,
    *(f"{name}_{i}" for name in ("longitude", "latitude") for i in (1, 2)),
    "gap",
    "azimuth",
    "facing_length",
    "derived",
    *(f"{name}_{i}" for name in PROPERTIES for i in (1, 2)),
)
PLACING = ("rank", "station", "distance", "azimuth_used")

#: Rows that are taken from the database together.
TOGETHER = 20_000


class FoundRows(NamedTuple):
    """
    Rows of buildings of a piece of the risk table.

    Attributes
    ----------
    contacts : Table
        One row per contact in the order of the rows: the columns that are carried, those of the
        row, and number and identifier of the buildings on both sides; -1 for a building that
        belongs to its pair only.
    rows : int
        Number of rows.
    own : (n,) ndarray of int
        Ends of pairs (2 · (rank − 1), + 1 at building 2) whose building belongs to the pair only.
    served : mapping of str to int
        Number of buildings in whose pairs the record of each station is used.
    rejected : list of (tuple, Rejection)
        Contradictions and repeated contacts, with the place of each in the order of all.
    """

    contacts: pa.Table
    rows: int
    own: IntArray
    served: Mapping[str, int]
    rejected: list[tuple[tuple[int, ...], Rejection]]


def pieces_of(
    pairs: PairColumns,
    numbers: BuildingNumbers,
    piece: NDArray[np.int32],
    columns: Mapping[str, str],
    database: duckdb.DuckDBPyConnection,
) -> Iterator[pa.Table]:
    """
    Yield the pairs of each piece in the order of their ranks.

    Parameters
    ----------
    pairs : PairColumns
        The risk table.
    numbers : BuildingNumbers
        Of the buildings, which become the columns ``code_1`` and ``code_2``.
    piece : (n_pairs,) ndarray of int
        Number of the piece of each pair.
    columns : mapping of str to str
        New name and name of columns of the risk table, with ``rank``; some may be absent.
    database : DuckDBPyConnection
        Of bounded memory.
    """
    # The first batch has the columns of all
    source = _numbered(pairs, numbers, piece, columns)
    first = next(source)
    numbered = pa.RecordBatchReader.from_batches(first.schema, _chained(first, source))
    database.register("numbered", numbered)
    waiting = list[pa.Table]()
    # The last piece of a batch may go on in the next
    for batch in batches(database, 'SELECT * FROM numbered ORDER BY "piece", "rank"', TOGETHER):
        table = pa.Table.from_batches([batch])
        found = table["piece"].to_numpy()
        starts = np.flatnonzero(np.diff(found)) + 1
        for start, end in zip([0, *starts], [*starts, table.num_rows], strict=True):
            part = table.slice(start, end - start)
            if waiting and waiting[-1]["piece"][0] != part["piece"][0]:
                yield pa.concat_tables(waiting).combine_chunks()
                waiting = []
            waiting.append(part)
    yield pa.concat_tables(waiting).combine_chunks()


def _chained(first: pa.RecordBatch, others: Iterator[pa.RecordBatch]) -> Iterator[pa.RecordBatch]:
    """Yield a batch, then the others."""
    yield first
    yield from others


def _numbered(
    pairs: PairColumns,
    numbers: BuildingNumbers,
    piece: NDArray[np.int32],
    columns: Mapping[str, str],
) -> Iterator[pa.RecordBatch]:
    """Yield the columns of all pairs, with numbers of their buildings and of their piece."""
    before = 0
    known = {name: column for name, column in columns.items() if column in pairs.names}
    for batch in pairs.batches(list(dict.fromkeys(known.values()))):
        place = slice(before, before + batch.num_rows)
        before += batch.num_rows
        # Numbers of the buildings and of the piece are columns too
        added = {"code_1": numbers.codes[place, 0], "code_2": numbers.codes[place, 1]}
        arrays = [pa.array(np.ascontiguousarray(column)) for column in added.values()]
        yield pa.RecordBatch.from_arrays(
            [*(batch[column] for column in known.values()), *arrays, pa.array(piece[place])],
            names=[*known, *added, "piece"],
        )


def found_rows(pairs: pa.Table, rows: Rows, carried: Sequence[str]) -> FoundRows:
    """
    Find the rows of a piece of the risk table.

    Parameters
    ----------
    pairs : Table
        From :func:`pieces_of`.
    rows : Rows
        Settings.
    carried : sequence of str
        Columns of the pairs that the contacts keep.
    """
    read = partial(_frame, pairs)
    contacts = contacts_of(read(FINDING), rows.angle)
    joints = joints_of(contacts, GivenColumns(read), rows.angle)
    chains = chains_of(contacts, joints, rows.angle, rows.longest)
    placing = read(PLACING)
    placed = placed_rows(chains, placing)
    # Numbers of identifiers among those of all pieces
    codes = _codes(pairs)
    is_own = ~contacts.named[contacts.buildings]
    # All columns of the contacts
    table = _of_pairs(pairs, placed, carried)
    columns = _of_rows(placed, chains, contacts)
    columns |= _of_sides(placed, contacts, np.where(is_own, -1, codes))
    for name, column in columns.items():
        table = table.append_column(name, column)
    ends = _ends(placing["rank"])[is_own]
    served = served_buildings(placing["station"], contacts.buildings)
    rejected = _rejections(contacts, joints, np.unique(codes[codes >= 0]))
    return FoundRows(table, placed.order.size, ends, served, rejected)


def _codes(pairs: pa.Table) -> IntArray:
    """Return the numbers of both buildings of pairs, (n, 2); -1 without an identifier."""
    codes: IntArray = np.stack([pairs[f"code_{i}"].to_numpy() for i in (1, 2)], axis=1)
    return codes


def _ends(rank: pd.Series) -> IntArray:
    """Return the numbers of both ends of pairs, (n, 2)."""
    return 2 * (rank.to_numpy(np.int64)[:, None] - 1) + np.arange(2)


def _frame(pairs: pa.Table, names: Sequence[str]) -> pd.DataFrame:
    """Return columns of pairs, as far as they exist."""
    known = [name for name in names if name in pairs.column_names]
    found: pd.DataFrame = pairs.select(known).to_pandas()
    return found


def _of_pairs(pairs: pa.Table, placed: PlacedRows, carried: Sequence[str]) -> pa.Table:
    """Return the columns of the pairs that the contacts keep."""
    kept = pairs.select([name for name in carried if name in pairs.column_names])
    return kept.take(pa.array(placed.contacts["pair"].to_numpy()))


def _of_rows(placed: PlacedRows, chains: Chains, contacts: Contacts) -> dict[str, pa.Array]:
    """Return the columns of the rows at each of their contacts."""
    # Whole numbers of stations, of which there are few
    names = ("turned", "interface", "buildings", "azimuth")
    columns = {name: pa.array(placed.contacts[name].to_numpy()) for name in names}
    station = placed.contacts["station"].cat
    texts = pa.DictionaryArray.from_arrays(station.codes.to_numpy(), list(station.categories))
    # Name and flags of each row at every contact of it
    row = placed.contacts["row"].to_numpy()
    first = np.flatnonzero(np.diff(row, prepend=-1))
    flags = pa.array(joined_names(_raised(chains, placed, first)), pa.string())
    row_id = pa.array(_row_names(placed, contacts, first), pa.string())
    columns |= {"row_id": row_id.take(pa.array(row)), "flags": flags.take(pa.array(row))}
    return columns | {"station": texts.cast(pa.string())}


def _of_sides(placed: PlacedRows, contacts: Contacts, codes: IntArray) -> dict[str, pa.Array]:
    """Return number and identifier of the buildings on both sides of each contact."""
    pair = placed.contacts["pair"].to_numpy()
    turned = placed.contacts["turned"].to_numpy().astype(np.int64)
    columns = dict[str, pa.Array]()
    # The left building of a turned pair is its building 2
    for side, number in (("left", turned), ("right", 1 - turned)):
        names = contacts.names[contacts.buildings[pair, number]].astype(object)
        columns[f"building_number_{side}"] = pa.array(codes[pair, number])
        columns[f"building_id_{side}"] = pa.array(names, pa.string())
    return columns


def _rejections(
    contacts: Contacts, joints: Joints, known: IntArray
) -> list[tuple[tuple[int, ...], Rejection]]:
    """Return rejections and their places: by kind, then the numbers of all pieces."""
    found = []
    for place, rejection in zip(contacts.places, contacts.rejected, strict=True):
        found.append(((len(place), *known[list(place)].tolist()), rejection))
    for place, rejection in zip(joints.places, joints.rejected, strict=True):
        # After those of the contacts; the last number is that of the building
        found.append(((2 + len(place), *place[:-1], int(known[place[-1]])), rejection))
    return found


def served_buildings(station: pd.Series, buildings: IntArray) -> dict[str, int]:
    """
    Return the number of buildings in whose pairs the record of each station is used.

    Parameters
    ----------
    station : (n_pairs,) Series of str
        Name of the station of each pair, empty for none.
    buildings : (n_pairs, 2) ndarray of int
        Numbers of the buildings of each pair.

    Examples
    --------
    >>> served_buildings(pd.Series(["A", "A", "B", ""]), np.array([[0, 1], [1, 2], [2, 3], [3, 4]]))
    {'A': 3, 'B': 2}
    """
    codes, names = pd.factorize(station)
    size = int(buildings.max(initial=0)) + 1
    # Station and building as one number, each once
    both = np.unique(codes[:, None] * size + buildings)
    counts = np.bincount(both // size, minlength=len(names))
    return {str(name): int(n) for name, n in zip(names, counts, strict=True) if name}


def _raised(chains: Chains, placed: PlacedRows, first: IntArray) -> dict[str, BoolArray]:
    """Return the flags of the rows in their order of computation."""
    raised = {name: flag[placed.order] for name, flag in chains.flags.items()}
    station = placed.contacts["station"].iloc[first]
    return raised | {
        "several_stations": placed.several_stations,
        "no_record": np.asarray(station == ""),
    }


def _row_names(placed: PlacedRows, contacts: Contacts, first: IntArray) -> NDArray[np.object_]:
    """Return the name of each row: that of its first pair in alphabetical order."""
    order = contacts.order[placed.contacts["pair"]]
    smallest = np.minimum.reduceat(order, first)
    by_name = contacts.pair_id[np.argsort(contacts.order, kind="stable")]
    return np.array([f"R-{name}" for name in by_name[smallest]], dtype=object)
