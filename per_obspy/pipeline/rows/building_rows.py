"""Rows of buildings: from the risk table to the tables of rows and of buildings."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from pyarrow.dataset import Dataset

from per_obspy.config import Run
from per_obspy.config.building_rows import Rows
from per_obspy.errors import Rejection
from per_obspy.files import remove_file
from per_obspy.inventory.building_rows.chains import Chains, chains_of
from per_obspy.inventory.building_rows.contacts import BoolArray, Contacts, IntArray, contacts_of
from per_obspy.inventory.building_rows.given import GivenColumns
from per_obspy.inventory.building_rows.joints import joints_of
from per_obspy.inventory.table_columns import joined_names
from per_obspy.jobs.building_rows import CHUNK, RowsJob, RowsPart, do_row_chunks, rows_rejections
from per_obspy.jobs.ground_files import GroundFiles
from per_obspy.progress import Progress
from per_obspy.screening.building_rows.members import NEEDED
from per_obspy.screening.building_rows.placed import PlacedRows, placed_rows
from per_obspy.tables.building_rows import write_rows
from per_obspy.tables.buildings import BuildingWays, write_buildings
from per_obspy.tables.parts import batches, bounded_database, parquet_rows, some_columns
from per_obspy.tables.ranked.ranked_files import table_files
from per_obspy.threads import usable_processors

#: Columns of the pair table without which no pair names its buildings.
IDENTIFIERS = ("building_id_1", "building_id_2")

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
)
PLACING = ("rank", "station", "distance", "azimuth_used")

#: Contacts that are read together.
TOGETHER = 50_000


class BuildingRowsDone(NamedTuple):
    """
    Result of the rows of buildings.

    Attributes
    ----------
    outputs : list of Path
        The files; none where rows are not enabled.
    counts : dict
        Rows, buildings, and chunks that an earlier run had done.
    rejected : tuple of Rejection
        Contradictions, repeated contacts and rows that could not be followed.
    failed : bool
        Whether the work of a chunk failed unexpectedly.
    served : mapping of str to int
        Number of buildings in whose pairs the record of each station is used.
    """

    outputs: list[Path]
    counts: dict[str, int]
    rejected: tuple[Rejection, ...] = ()
    failed: bool = False
    served: Mapping[str, int] = MappingProxyType({})


#: Result where there are no rows.
NO_ROWS = BuildingRowsDone([], {})


class _Found(NamedTuple):
    """Result of the search for rows: contacts in order, buildings, rejections, served buildings."""

    placed: pd.DataFrame
    contacts: Contacts
    rows: int
    rejected: tuple[Rejection, ...]
    served: Mapping[str, int]


def building_rows(
    settings: Run,
    folder: Path,
    ground: GroundFiles,
    facts: Mapping[str, str],
    executor: Executor | None,
    progress: Progress,
) -> BuildingRowsDone:
    """
    Write the tables of rows and of buildings from the risk table, if rows are enabled.

    Parameters
    ----------
    settings : Run
        Settings of the run.
    folder : Path
        Of the results, with the risk table.
    ground : GroundFiles
        The stations.
    facts : mapping of str to str
        Facts of the whole table that the Parquet files state.
    executor : Executor, optional
        Where to work instead of processes of this machine.
    progress : callable
        Called for every chunk.
    """
    # Opened for its columns, then once for every pass over it
    risk = parquet_rows(table_files(folder))
    if not _enabled(settings.rows, risk):
        return NO_ROWS
    found = _found(settings.rows, risk)
    progress("rows", 0, len(found.placed))
    jobs = _jobs(settings, folder, ground, risk, found)
    workers, parts, done = settings.workers or usable_processors(), list[RowsPart](), 0
    for part in do_row_chunks(jobs, workers, executor):
        parts.append(part)
        done += part.rows
        progress("rows", done, len(found.placed))
    _remove_others(folder / "rows", parts)
    # Both tables, from the parts in their order
    parts.sort(key=lambda part: part.number)
    outputs = _written(settings, folder, risk, parts, facts)
    # Parts and rejections
    rejected = (*found.rejected, *rows_rejections(parts))
    counts = _counts(found, folder, parts)
    failed = any(part.failed for part in parts)
    return BuildingRowsDone(outputs, counts, rejected, failed, found.served)


def _counts(found: _Found, folder: Path, parts: Sequence[RowsPart]) -> dict[str, int]:
    """Return the numbers of rows, buildings and chunks."""
    buildings = pq.read_metadata((folder / "buildings.parquet").absolute())
    return {
        "rows": found.rows,
        "buildings": int(buildings.num_rows),
        "row_chunks": len(parts),
        "row_chunks_resumed": sum(part.resumed for part in parts),
    }


def _written(
    settings: Run,
    folder: Path,
    risk: Dataset,
    parts: Sequence[RowsPart],
    facts: Mapping[str, str],
) -> list[Path]:
    """Write the tables of rows and of buildings, and return their files."""
    rows = write_rows([part.path for part in parts], folder, facts)
    # Buildings are made of the rows
    ways = BuildingWays(settings.screening.classes, settings.totals, settings.rows.angle)
    return [*rows, *write_buildings(folder, risk, ways, facts, settings.csv_rows)]


def _enabled(rows: Rows, risk: Dataset) -> bool:
    """Return whether rows are computed: as configured, by default if pairs name their buildings."""
    if rows.enabled is not None:
        return rows.enabled
    return set(IDENTIFIERS) <= set(risk.schema.names)


def _found(rows: Rows, risk: Dataset) -> _Found:
    """Find the rows of all pairs, and their order of computation."""
    read = partial(_columns, risk)
    # From pairs to chains of contacts; each column is in memory only while it is needed
    contacts = contacts_of(read(FINDING), rows.angle)
    joints = joints_of(contacts, GivenColumns(read), rows.angle)
    chains = chains_of(contacts, joints, rows.angle, rows.longest)
    pairs = read(PLACING)
    placed = placed_rows(chains, pairs, CHUNK)
    ranks = pairs["rank"].to_numpy(np.int64)[placed.contacts["pair"]]
    # Name and flags of each row at every contact of it
    row = placed.contacts["row"].to_numpy()
    first = np.flatnonzero(np.diff(row, prepend=-1))
    row_id = _row_names(placed, contacts, first)[row]
    flags = joined_names(_raised(chains, placed, first))[row]
    table = placed.contacts.assign(row_id=row_id, flags=flags, rank=ranks)
    rejected = (*contacts.rejected, *joints.rejected)
    served = served_buildings(pairs["station"], contacts.buildings)
    return _Found(table, contacts, first.size, rejected, served)


def _columns(risk: Dataset, names: Sequence[str]) -> pd.DataFrame:
    """Return columns of all pairs, as far as they exist; texts that repeat are kept once."""
    known = [name for name in names if name in risk.schema.names]
    shared = [name for name in ("derived", "station") if name in known]
    table = risk.to_table(columns=known, use_threads=False)
    found: pd.DataFrame = table.to_pandas(categories=shared, self_destruct=True)
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


def _jobs(
    settings: Run, folder: Path, ground: GroundFiles, risk: Dataset, found: _Found
) -> Iterator[RowsJob]:
    """Yield one job per chunk of rows."""
    exact = settings.screening.exact if settings.rows.exact is None else settings.rows.exact
    stations = {station.name: station for station in ground.stations}
    for number, table in _chunks(folder, risk, found):
        # Pairs that a map serves have no record
        station = stations.get(table["station"].iloc[0]) if exact else None
        part = folder / "rows" / f"{number:06}.parquet"
        yield RowsJob(number, pa.Table.from_pandas(table, preserve_index=False), station, part)


def _chunks(folder: Path, risk: Dataset, found: _Found) -> Iterator[tuple[int, pd.DataFrame]]:
    """Yield the contacts of each chunk in order, with the columns for their histories."""
    waiting = list[pd.DataFrame]()
    for piece in _pieces(folder, risk, found.placed):
        waiting.append(_with_buildings(piece, found.contacts))
        table = pd.concat(waiting, ignore_index=True)
        # The last chunk may go on in the next piece
        last = (table["chunk"] == table["chunk"].iloc[-1]).to_numpy()
        for number, chunk in table[~last].groupby("chunk"):
            yield int(str(number)), chunk.drop(columns="chunk").reset_index(drop=True)
        waiting = [table[last]]
    for table in waiting:
        yield int(table["chunk"].iloc[0]), table.drop(columns="chunk").reset_index(drop=True)


def _pieces(folder: Path, risk: Dataset, placed: pd.DataFrame) -> Iterator[pd.DataFrame]:
    """Yield the contacts with their pairs, some thousands at a time, in bounded memory."""
    names = ["pair_id", "longitude", "latitude", *NEEDED]
    mapping = pa.table({"rank": placed["rank"].to_numpy(), "place": np.arange(len(placed))})
    with bounded_database(folder) as database:
        # The rank of a pair identifies it
        database.register("risk", some_columns(risk, ["rank", *names]))
        database.register("mapping", mapping)
        columns = ", ".join(f"risk.{name}" for name in names)
        query = f"SELECT {columns} FROM risk JOIN mapping USING (rank) ORDER BY place"
        before = 0
        for batch in batches(database, query, TOGETHER):
            own = placed.iloc[before : before + batch.num_rows].reset_index(drop=True)
            before += batch.num_rows
            yield pd.concat([own, batch.to_pandas()], axis=1)


def _with_buildings(piece: pd.DataFrame, contacts: Contacts) -> pd.DataFrame:
    """Return contacts with numbers and names of the buildings on both sides."""
    turned = piece["turned"].to_numpy(dtype=np.int64)
    rows, columns = np.arange(len(piece)), {}
    # The left building of a turned pair is its building 2
    for side, number in (("left", turned), ("right", 1 - turned)):
        chosen = contacts.buildings[piece["pair"]][rows, number]
        columns[f"building_number_{side}"] = chosen
        columns[f"building_id_{side}"] = contacts.names[chosen].astype(object)
    station = piece["station"].astype(str)
    return piece.drop(columns=["pair", "rank"]).assign(**columns, station=station)


def _remove_others(folder: Path, parts: list[RowsPart]) -> None:
    """Remove parts of an earlier table, and partly written ones."""
    known = {path for part in parts for path in (part.path, part.status)}
    for path in folder.iterdir() if folder.is_dir() else ():
        if path not in known and path.is_file():
            remove_file(path)
