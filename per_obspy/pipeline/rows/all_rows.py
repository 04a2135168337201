"""
All rows of buildings in their order of computation, as a file.

Rows are ordered by a database of bounded memory: by station, then by name. Buildings that belong to
one pair only are numbered after those with an identifier, in the order of the pairs.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.config.pairs import Rows
from per_obspy.errors import Rejection
from per_obspy.inventory.building_rows.contacts import IntArray
from per_obspy.jobs.building_rows import CHUNK
from per_obspy.pipeline.rows.found_rows import FINDING, PLACING, FoundRows, found_rows, pieces_of
from per_obspy.pipeline.rows.numbering import building_numbers, piece_numbers
from per_obspy.pipeline.rows.pair_columns import PairColumns
from per_obspy.screening.building_rows.members import NEEDED
from per_obspy.screening.building_rows.placed import ChunkNumbers
from per_obspy.screening.building_rows.sides import OF_PAIRS
from per_obspy.tables.building_rows import TOGETHER as GROUP
from per_obspy.tables.buildings import AREA, one_thread_database, stored_rows
from per_obspy.tables.parts import batches
from per_obspy.tables.table_files import regrouped

#: Pairs of a piece, about.
PIECE = 20_000

#: Columns of contacts that describe their rows.
OF_ROWS = (
    "row", "row_id", "flags", "turned", "interface", "buildings", "azimuth", "station",
    *(f"building_{name}_{side}" for side in ("left", "right") for name in ("number", "id")),
)  # fmt: skip

#: Columns of pairs that chunks of rows need besides those of their rows.
OF_CHUNKS = ("pair_id", "longitude", "latitude", *NEEDED)

#: Columns of few texts, which many contacts share.
SHARED = ("station", "state", "derived", "flags")

#: Columns of pairs that are not needed any more when rows are found.
FOR_FINDING = {*FINDING, *PLACING} - {"rank", *OF_CHUNKS, *OF_PAIRS}

_ORDER = "SELECT * FROM found ORDER BY station, row_id, interface"


class AllRows(NamedTuple):
    """
    Result of the search for rows.

    Attributes
    ----------
    file : Path
        Parquet file of the contacts in their order of computation: columns of the pairs and of the
        rows, ``row`` (number from 0) and ``chunk``.
    contacts, rows : int
        Numbers of contacts and of rows.
    rejected : tuple of Rejection
        Contradictions and repeated contacts.
    served : mapping of str to int
        Number of buildings in whose pairs the record of each station is used.
    """

    file: Path
    contacts: int
    rows: int
    rejected: tuple[Rejection, ...]
    served: Mapping[str, int]


def all_rows(pairs: PairColumns, rows: Rows, area: str | None, room: Path) -> AllRows:
    """
    Find the rows of all pairs, and write their contacts in their order of computation.

    Parameters
    ----------
    pairs : PairColumns
        The risk table.
    rows : Rows
        Settings.
    area : str or None
        Column of the area of each pair, if areas have names.
    room : Path
        Folder for the file.
    """
    # Both passes over the pairs: numbers of buildings, then pieces of connected pairs
    noted = _Noted([], [], [], Counter())
    found, ordered = room / "found.parquet", room / "contacts.parquet"
    with one_thread_database(room) as database:
        numbers = building_numbers(pairs, database)
        piece = piece_numbers(numbers, PIECE)
        columns = _columns(area)
        pieces = pieces_of(pairs, numbers, piece, columns, database)
        carried = [name for name in columns if name not in FOR_FINDING]
        parts = (found_rows(some, rows, carried) for some in pieces)
        _write((noted.add(part) for part in parts), found)
    contacts = _write_ordered(found, numbers.named, np.sort(np.concatenate(noted.own)), ordered)
    # Rejections as if there was one piece
    rejected = sorted(noted.rejected, key=lambda one: one[0])
    reasons = tuple(rejection for _, rejection in rejected)
    return AllRows(ordered, contacts, sum(noted.rows), reasons, noted.served)


def _write_ordered(found: Path, named: int, ends: IntArray, path: Path) -> int:
    """Write contacts in their order of computation, and return their number."""
    with one_thread_database(path.parent) as database, stored_rows(found) as stored:
        database.register("found", stored)
        count = _write(_completed(batches(database, _ORDER, PIECE), named, ends), path)
    found.unlink()
    return count


def _columns(area: str | None) -> dict[str, str]:
    """Return new name and name of the columns of pairs that are read."""
    names = dict.fromkeys((*FINDING, *PLACING, *OF_CHUNKS, *OF_PAIRS))
    return {name: name for name in names} | ({AREA: area} if area else {})


class _Noted(NamedTuple):
    """Facts of all pieces."""

    rows: list[int]
    own: list[IntArray]
    rejected: list[tuple[tuple[int, ...], Rejection]]
    served: Counter[str]

    def add(self, part: FoundRows) -> pa.Table:
        """Note the facts of a piece, and return its contacts."""
        self.rows.append(part.rows)
        self.own.append(part.own)
        self.rejected.extend(part.rejected)
        self.served.update(part.served)
        return part.contacts


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


def _completed(found: Iterable[pa.RecordBatch], named: int, ends: IntArray) -> Iterator[pa.Table]:
    """Yield contacts with the numbers of all buildings, of the rows and of the chunks."""
    chunks, row, chunk = ChunkNumbers(CHUNK), -1, 0
    for batch in found:
        table = pa.Table.from_batches([batch])
        begins = table["interface"].to_numpy() == 1
        # Rows that begin in this piece; the first contacts may be of the row before
        some = table.filter(pa.array(begins)).select(["buildings", "station"])
        sizes = some["buildings"].to_numpy() - 1
        numbers = chunks.add(sizes.tolist(), some["station"].to_pylist())
        # Place of each contact among the rows that begin here, 0 for the row before
        place = np.cumsum(begins)
        columns = {
            "row": place + row,
            "chunk": np.concatenate([[chunk], numbers])[place],
        }
        row, chunk = row + int(place[-1]), int(columns["chunk"][-1])
        for name, column in columns.items():
            table = table.append_column(name, pa.array(column))
        yield _numbered(table, named, ends)


def _numbered(table: pa.Table, named: int, ends: IntArray) -> pa.Table:
    """Return contacts with numbers of the buildings that belong to one pair only."""
    turned = table["turned"].to_numpy().astype(np.int64)
    # The left building of a turned pair is its building 2
    first = 2 * (table["rank"].to_numpy() - 1)
    for side, end in (("left", first + turned), ("right", first + 1 - turned)):
        name = f"building_number_{side}"
        number = table[name].to_numpy().astype(np.int64)
        number = np.where(number < 0, named + np.searchsorted(ends, end), number)
        table = table.set_column(table.column_names.index(name), name, pa.array(number))
    return table
