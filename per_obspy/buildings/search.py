"""
Search for the rows of all pairs a piece at a time, so that memory does not grow with the pairs.

Pairs that share a building with others of a piece are in that piece: every row, and everything
that is known of a building, is found in one piece. Only connected pairs are never divided, and only
whole numbers of all pairs are in memory: texts are sorted by a database of bounded memory.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain, pairwise
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

import duckdb
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from per_obspy.buildings.chains import Chains, chains_of, joints_of
from per_obspy.buildings.columns import ROWS
from per_obspy.buildings.contacts import (
    PROPERTIES,
    BoolArray,
    Contacts,
    IntArray,
    OrderedRejection,
    contacts_of,
    numbers_in,
)
from per_obspy.buildings.histories import ALONE, NEEDED
from per_obspy.buildings.sides import OF_PAIRS
from per_obspy.checks import FloatArray
from per_obspy.config.pairs import Rows
from per_obspy.errors import Rejection
from per_obspy.inventory.table_columns import joined_names
from per_obspy.results.parts import Order, batches, bounded_database
from per_obspy.results.ranked_table import RankedTable
from per_obspy.results.table_files import regrouped

#: Columns of the pair table without which no pair names its buildings.
IDENTIFIERS = ("building_id_1", "building_id_2")

#: Columns of the risk table by which rows are found and placed; some may be absent.
FINDING = (
    "pair_id", *IDENTIFIERS, "gap", "azimuth", "facing_length", "derived",
    *(f"{name}_{i}" for name in ("longitude", "latitude", *PROPERTIES) for i in (1, 2)),
    "rank", "station", "distance", "azimuth_used",
)  # fmt: skip

#: Name of the column of areas in the file of contacts: that of the pair table may be any.
AREA = "area_of_totals"

#: Columns of pairs that contacts keep besides those of their rows; some may be absent. Those that
#: only a history needs are most of them.
CARRIED = tuple(
    dict.fromkeys(("pair_id", "rank", "longitude", "latitude", *NEEDED, *ALONE, *OF_PAIRS, AREA))
)
WITHOUT_HISTORIES = tuple(
    name
    for name in CARRIED
    if name not in (*NEEDED, *ALONE) or name in OF_PAIRS or name in {column.name for column in ROWS}
)

#: Columns of a contact that its history and its row of ``rows.parquet`` need.
OF_CHUNKS = (
    "row_id", "flags", "turned", "interface", "buildings", "azimuth", "station",
    *(f"building_{name}_{side}" for side in ("left", "right") for name in ("number", "id")),
    "pair_id", "longitude", "latitude", *NEEDED, *ALONE,
)  # fmt: skip

#: Columns of few texts, which many contacts share.
SHARED = ("station", "state", "derived", "flags")

#: Pairs of a piece, and contacts of a chunk, of which a worker needs 1 kB for each; about.
PIECE, CHUNK = 50_000, 10_000

#: Rows of a table, and sorted identifiers, that are read together.
BATCH, SORTED = 20_000, 100_000

#: Rows of a group of a Parquet file.
GROUP = 10_000

#: Threads of the database: one needs a quarter less processor time than two.
THREADS = 1


#: Numbers from here on are those of buildings that belong to one pair only, until all are found.
OWN = 1 << 62

#: Numbers of the buildings of a pair, and of its piece.
NUMBERS = [(name, pa.int32()) for name in ("code_1", "code_2", "piece")]

#: Order of computation.
BY_STATION = Order("station, row_id, interface", ("station", "row_id", "interface"))

#: Identifier of one building of a pair, and its end: 2 · pair, + 1 at building 2.
_ENDS = pa.schema([("end", pa.int64()), ("name", pa.string())])


class AllRows(NamedTuple):
    """Result of the search for rows."""

    #: Parquet file of the contacts in their order of computation, by station and name of the row:
    #: columns of the pairs, of the rows, and of the buildings on both sides.
    file: Path
    #: Numbers of contacts and of rows.
    contacts: int
    rows: int
    #: Contradictions and repeated contacts.
    rejected: tuple[Rejection, ...]
    #: Number of buildings in whose pairs the record of each station is used.
    served: Mapping[str, int]


def find_rows(pairs: RankedTable, rows: Rows, area: str | None, room: Path) -> AllRows:
    """
    Find the rows of all pairs of a risk table, and write their contacts into a file in a folder.

    They are in their order of computation. ``area`` is the column of the area of each pair, if
    areas have names.
    """
    found = list[PieceRows]()
    ordered = room / "contacts.parquet"
    with one_thread_database(room) as database, database.cursor() as inner:
        named, pieces = connected_pieces(pairs, CARRIED, area, inner)
        register_tables(database, "contacts", _contacts(pieces, rows, found))
        query = f"SELECT * FROM contacts ORDER BY {BY_STATION.by}"
        tables = tables_of(database, query, PIECE)
        # Once the first contacts are ordered, all are found
        count = _write(numbered_contacts(tables, named, found), ordered)
    return AllRows(ordered, count, *totals_of(found))


def connected_pieces(
    pairs: RankedTable,
    carried: Sequence[str],
    area: str | None,
    database: duckdb.DuckDBPyConnection,
) -> tuple[int, Iterator[pa.Table]]:
    """
    Return the number of buildings with an identifier, and the pairs of each piece by their ranks.

    Pieces, made as they are asked for, have the columns that :func:`find_in_piece` needs.
    """
    columns = {name: ALONE.get(name, name) for name in (*FINDING, *carried)}
    columns |= {AREA: area} if area else {}
    # Both passes over the pairs: numbers of buildings, then pieces of connected pairs
    codes = number_buildings(pairs, database)
    database.register("pairs", _numbered(pairs, columns, codes))
    return int(codes.max()) + 1, _pieces(database)


def totals_of(found: Sequence["PieceRows"]) -> tuple[int, tuple[Rejection, ...], Counter[str]]:
    """Return the number of rows, rejections and buildings by station of all pieces."""
    served = sum((piece.served for piece in found), Counter[str]())
    # Rejections as if there was one piece
    rejected = sorted(chain.from_iterable(piece.rejected for piece in found), key=itemgetter(0))
    reasons = tuple(rejection for _, rejection in rejected)
    return sum(piece.rows for piece in found), reasons, served


def _contacts(
    pieces: Iterable[pa.Table], rows: Rows, found: list["PieceRows"]
) -> Iterator[pa.Table]:
    """Yield the contacts of each piece, and keep what else is found in it."""
    for pairs in pieces:
        contacts, piece = find_in_piece(pairs, rows, CARRIED)
        found.append(piece)
        yield contacts


def number_buildings(pairs: RankedTable, database: duckdb.DuckDBPyConnection) -> NDArray[np.int32]:
    """
    Return the place of the identifiers of each pair in their alphabetical order, (n_pairs, 2).

    It is -1 for a building without an identifier.
    """
    codes = np.full((pairs.pairs, 2), -1, dtype=np.int32)
    database.register("ends", pa.RecordBatchReader.from_batches(_ENDS, _ends(pairs)))
    number, last = -1, ""
    # In the order of the names: every new one has the next number
    for batch in batches(database, "SELECT * FROM ends ORDER BY name", SORTED):
        names = batch["name"]
        is_new = np.empty(batch.num_rows, dtype=bool)
        # The first may be the last of the batch before
        is_new[0] = names[0].as_py() != last
        is_new[1:] = pc.not_equal(names[1:], names[:-1]).to_numpy(zero_copy_only=False)
        numbers = number + np.cumsum(is_new)
        codes.reshape(-1)[batch["end"].to_numpy()] = numbers
        number, last = int(numbers[-1]), names[-1].as_py()
    return codes


def _ends(pairs: RankedTable) -> Iterator[pa.RecordBatch]:
    """Yield number and identifier of the ends of pairs that have one."""
    first = 0
    for batch in pairs.batches(BATCH, IDENTIFIERS):
        for side, name in enumerate(IDENTIFIERS):
            if name in batch.schema.names:
                ends = pa.array(2 * np.arange(first, first + batch.num_rows) + side)
                columns = [ends, batch[name].cast(pa.string())]
                # A comparison with a missing identifier is none
                named = pc.not_equal(columns[1], "")
                yield pa.RecordBatch.from_arrays(columns, schema=_ENDS).filter(named)
        first += batch.num_rows


def piece_numbers(codes: NDArray[np.int32], size: int) -> NDArray[np.int32]:
    """
    Return the number of the piece of each pair: pairs that share a building are in one piece.

    Codes are those of :func:`number_buildings`. A piece has about ``size`` pairs, but connected
    pairs are in one however many they are.

    Examples
    --------
    >>> codes = np.array([[0, 1], [2, 3], [1, 4], [-1, -1]], dtype=np.int32)
    >>> piece_numbers(codes, 2).tolist()
    [0, 1, 0, 1]
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    # Buildings are joined by the pairs that have two of them
    count, named = int(codes.max()) + 1, codes.max(axis=1)
    first, second = codes[(codes >= 0).all(axis=1)].T
    graph = coo_array((np.ones(first.size, np.int8), (first, second)), shape=(count, count))
    groups, group = connected_components(graph, directed=False)
    # A pair of one identifier belongs to its building, one without any is a group of its own
    label: IntArray = np.append(group, 0)[named]
    without = np.flatnonzero(named < 0)
    label[without] = groups + np.arange(without.size)
    # Whole groups of connected pairs one after the other
    sizes = np.bincount(label)
    piece: NDArray[np.int32] = ((np.cumsum(sizes) - sizes) // size).astype(np.int32)
    return piece[label]


def _numbered(
    pairs: RankedTable, columns: Mapping[str, str], codes: NDArray[np.int32]
) -> pa.RecordBatchReader:
    """Return columns of all pairs by new names, with numbers of their buildings and their piece."""
    # Some columns may be absent
    names = {name: column for name, column in columns.items() if column in pairs.schema.names}
    fields = [pairs.schema.field(column).with_name(name) for name, column in names.items()]
    numbers = [*np.ascontiguousarray(codes.T), piece_numbers(codes, PIECE)]
    schema = pa.schema([*fields, *NUMBERS])

    def numbered() -> Iterator[pa.RecordBatch]:
        """Yield the rows one after the other, as they are asked for."""
        first = 0
        for batch in pairs.batches(BATCH, list(dict.fromkeys(names.values()))):
            some = slice(first, first + batch.num_rows)
            added = [pa.array(column[some]) for column in numbers]
            # Numbers of the buildings and of the piece are columns too
            columns_of_pairs = batch.select(list(names.values())).columns
            yield pa.RecordBatch.from_arrays([*columns_of_pairs, *added], schema=schema)
            first = some.stop

    return pa.RecordBatchReader.from_batches(schema, numbered())


def _pieces(database: duckdb.DuckDBPyConnection) -> Iterator[pa.Table]:
    """Yield the pairs of each piece by their ranks."""
    tables = tables_of(database, "SELECT * FROM pairs ORDER BY piece, rank", BATCH)
    # Several pieces may be in one table
    for table in whole_groups(tables, "piece"):
        starts = np.flatnonzero(np.diff(table["piece"].to_numpy())) + 1
        for start, end in pairwise([0, *starts.tolist(), table.num_rows]):
            yield table.slice(start, end - start)


def _under_one_record(contacts: pa.Table, station: pa.ChunkedArray) -> pa.Table:
    """Return contacts without the histories of pairs of another station than that of the row."""
    is_same = pc.equal(station, contacts["station"])
    for place, name in enumerate(contacts.column_names):
        if name in ALONE:
            known = pc.if_else(is_same, contacts[name], None)
            contacts = contacts.set_column(place, name, known)
    return contacts


class PieceRows(NamedTuple):
    """Rows of buildings of a piece of the risk table."""

    #: Number of rows.
    rows: int
    #: Numbers of the buildings that belong to one pair only. Shape (n,).
    own: IntArray
    #: Number of buildings in whose pairs the record of each station is used.
    served: Counter[str]
    #: Contradictions and repeated contacts.
    rejected: list[OrderedRejection]


def find_in_piece(
    pairs: pa.Table, rows: Rows, carried: Sequence[str]
) -> tuple[pa.Table, PieceRows]:
    """
    Find the rows of connected pairs: their contacts, and what else is found.

    Pairs have the columns ``FINDING`` and those that are carried, as far as they are known,
    ``code_1`` and ``code_2``; contacts, along each row, have the carried ones and the columns of
    the row. The number of a building of one pair only is ``OWN`` + its end: 2 · (rank - 1), + 1 at
    building 2.
    """
    contacts = contacts_of(pairs, rows.angle)
    joints = joints_of(contacts, pairs, rows.angle)
    chains = chains_of(contacts, joints, rows.angle, rows.longest)
    # Ends by the ranks of their pairs
    ends = 2 * (pairs["rank"].to_numpy()[:, None] - 1) + np.arange(2)
    columns = _columns_of_rows(chains, contacts, pairs) | _sides(chains, contacts, ends)
    kept = pairs.select([name for name in carried if name in pairs.column_names])
    table = kept.take(pa.array(chains.pair))
    for name, column in columns.items():
        table = table.append_column(name, column)
    table = _under_one_record(table, pairs["station"].take(pa.array(chains.pair)))
    # And what is found besides
    served = served_buildings(pairs["station"].to_pandas(), contacts.buildings)
    rejected = [*contacts.rejected, *joints.rejected]
    return table, PieceRows(chains.azimuth.size, OWN + ends[contacts.codes < 0], served, rejected)


def served_buildings(station: pd.Series, buildings: IntArray) -> Counter[str]:
    """
    Return the number of buildings in whose pairs the record of each station is used.

    Of each pair: the name of its station, empty for none, and the numbers of its two buildings.

    Examples
    --------
    >>> served_buildings(pd.Series(["A", "A", "B", ""]), np.array([[0, 1], [1, 2], [2, 3], [3, 4]]))
    Counter({'A': 3, 'B': 2})
    """
    used = pd.Series(buildings.ravel()).groupby(np.repeat(station.to_numpy(object), 2)).nunique()
    return Counter({str(name): int(number) for name, number in used.items() if name})


def _sides(
    chains: Chains, contacts: Contacts, ends: IntArray
) -> dict[str, pa.Array | pa.ChunkedArray]:
    """Return whether contacts are turned, and number and name of the buildings beside them."""
    pair = chains.pair
    columns: dict[str, pa.Array | pa.ChunkedArray] = {"turned": pa.array(chains.turned)}
    numbers = np.where(contacts.codes < 0, OWN + ends, contacts.codes)
    # The left building of a turned pair is its building 2
    for side, second in (("left", chains.turned), ("right", ~chains.turned)):
        names = [name.take(pa.array(pair)) for name in contacts.names]
        columns[f"building_number_{side}"] = pa.array(numbers[pair, second.astype(np.int64)])
        columns[f"building_id_{side}"] = pc.if_else(pa.array(second), names[1], names[0])
    return columns


def _columns_of_rows(
    chains: Chains, contacts: Contacts, pairs: pa.Table
) -> dict[str, pa.Array | pa.ChunkedArray]:
    """Return the columns of the rows at each of their contacts."""
    # Number of the row of each contact
    sizes, first, pair = np.diff(chains.first), chains.first[:-1], chains.pair
    row = np.repeat(np.arange(sizes.size), sizes)
    names = pairs["station"].to_pandas().to_numpy(object)[pair]
    station, several = serving_stations(row, names, numbers_in(pairs, "distance")[pair])
    flags = chains.flags | {"several_stations": several, "no_record": station == ""}
    of_rows = {
        "row_id": _row_names(contacts, pair, first),
        "flags": pa.array(joined_names(flags), pa.string()),
        "station": pa.array(station, pa.string()),
        "azimuth": pa.array(_azimuths(chains, pairs)),
        "buildings": pa.array(sizes + 1),
    }
    # Each row at every contact of it
    columns = {name: column.take(pa.array(row)) for name, column in of_rows.items()}
    columns["interface"] = pa.array(np.arange(row.size) - first[row] + 1)
    return columns


def _azimuths(chains: Chains, pairs: pa.Table) -> FloatArray:
    """Return the azimuth of each row, degrees; the worst one of a pair without an azimuth."""
    first = chains.first[:-1]
    used = numbers_in(pairs, "azimuth_used")[chains.pair[first]] + 180.0 * chains.turned[first]
    return np.where(np.isnan(chains.azimuth), used % 360.0, chains.azimuth)


def _row_names(contacts: Contacts, pair: IntArray, first: IntArray) -> pa.ChunkedArray:
    """Return the name of each row: that of its first pair in alphabetical order."""
    by_name = np.argsort(contacts.order, kind="stable")
    names = by_name[np.minimum.reduceat(contacts.order[pair], first)]
    pair_id = contacts.pair_id.take(pa.array(names)).cast(pa.string())
    return pc.binary_join_element_wise("R-", pair_id, "")


def serving_stations(
    row: IntArray, station: NDArray[np.object_], distance: FloatArray
) -> tuple[NDArray[np.object_], BoolArray]:
    """
    Return the station of each row: that which serves most of its pairs.

    Of several that serve equally many it is the one nearer to its pairs, then the first by name. It
    is empty where most pairs have none. Also return whether different stations serve the row. Of
    each pair: number of its row from 0, name of its station, and the distance to it, m.
    """
    pairs = pd.DataFrame({"row": row, "station": station, "distance": distance})
    groups = pairs.groupby(["row", "station"])["distance"].agg(["size", "sum"]).reset_index()
    # Most pairs first, then the nearest, then the name
    ordered = groups.sort_values(
        ["row", "size", "sum", "station"], ascending=[True, False, True, True]
    )
    serving = ordered.drop_duplicates("row")["station"].to_numpy(object)
    return serving, groups.groupby("row").size().to_numpy() > 1


def _write(tables: Iterator[pa.Table], path: Path) -> int:
    """Write rows to a file that is read few times and removed, and return their number."""
    # The first rows have the columns of all
    first = next(tables)
    texts = [name for name in SHARED if name in first.column_names]
    fast = {"compression": "lz4", "use_dictionary": texts, "write_statistics": False}
    count = 0
    with pq.ParquetWriter(path, first.schema, **fast) as writer:
        for table in regrouped(chain([first], tables), first.schema, GROUP):
            writer.write_table(table)
            count += table.num_rows
    return count


def numbered_contacts(
    tables: Iterable[pa.Table], named: int, found: Sequence[PieceRows]
) -> Iterator[pa.Table]:
    """Yield contacts whose buildings that belong to one pair only follow the named ones."""
    own: IntArray | None = None
    for table in tables:
        # After those with an identifier, in the order of the pairs
        if own is None:
            own = np.sort(np.concatenate([piece.own for piece in found]))
        columns = dict(zip(table.column_names, table.columns, strict=True))
        for name in ("building_number_left", "building_number_right"):
            number = table[name].to_numpy()
            number = np.where(number < OWN, number, named + np.searchsorted(own, number))
            columns[name] = pa.array(number)
        yield pa.table(columns)


def chunks_of(file: Path) -> Iterator[pa.Table]:
    """
    Yield the contacts of each chunk, with the columns ``OF_CHUNKS``.

    A chunk has whole rows of one station, and ``CHUNK`` contacts at most if these are several rows.
    """
    waiting, contacts, last = list[pa.Table](), 0, ""
    for table in groups_of(file):
        begins, cut = np.flatnonzero(table["interface"].to_numpy() == 1), 0
        sizes = (table["buildings"].to_numpy()[begins] - 1).tolist()
        stations = table["station"].take(pa.array(begins)).to_pylist()
        # Rows of one station, as long as there is room
        for begin, size, station in zip(begins.tolist(), sizes, stations, strict=True):
            if contacts and (station != last or contacts + size > CHUNK):
                yield pa.concat_tables([*waiting, table.slice(cut, begin - cut)])
                waiting, contacts, cut = [], 0, begin
            contacts, last = contacts + size, station
        # The last row may go on in the next table
        waiting.append(table.slice(cut))
    yield pa.concat_tables(waiting)


def groups_of(file: Path) -> Iterator[pa.Table]:
    """Yield the contacts of each group of a file, with the columns of chunks."""
    with pq.ParquetFile(file, pre_buffer=False) as stored:
        names = [name for name in OF_CHUNKS if name in stored.schema_arrow.names]
        for group in range(stored.num_row_groups):
            yield stored.read_row_group(group, columns=names, use_threads=False).select(names)


@contextmanager
def one_thread_database(folder: Path) -> Iterator[duckdb.DuckDBPyConnection]:
    """Yield a database of one thread, which leaves what is too much to a folder inside."""
    with bounded_database(folder) as database:
        database.execute(f"SET threads = {THREADS}")
        yield database


def register_tables(
    database: duckdb.DuckDBPyConnection, name: str, tables: Iterator[pa.Table]
) -> list[str]:
    """
    Let a query of a database read tables once, as they are made, and return their columns.

    The first table has all columns.
    """
    first = next(tables)
    source = (batch for table in chain([first], tables) for batch in table.to_batches())
    database.register(name, pa.RecordBatchReader.from_batches(first.schema, source))
    return list(first.column_names)


def tables_of(database: duckdb.DuckDBPyConnection, query: str, size: int) -> Iterator[pa.Table]:
    """Yield the rows of a query as tables of some rows each."""
    for batch in batches(database, query, size):
        yield pa.Table.from_batches([batch])


def whole_groups(tables: Iterable[pa.Table], name: str) -> Iterator[pa.Table]:
    """Yield the rows of tables cut only where a number changes."""
    waiting = list[pa.Table]()
    for table in tables:
        number = table[name].to_numpy()
        last = waiting[-1][name][-1].as_py() if waiting else number[0]
        # The last group may go on in the next table
        whole = int(np.searchsorted(number, number[-1]))
        if whole or number[0] != last:
            yield pa.concat_tables([*waiting, table.slice(0, whole)]).combine_chunks()
            waiting = []
        waiting.append(table.slice(whole))
    yield pa.concat_tables(waiting).combine_chunks()
