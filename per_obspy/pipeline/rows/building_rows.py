"""Rows of buildings: from the risk table to the tables of rows and of buildings."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.config import Run
from per_obspy.config.pairs import Rows
from per_obspy.errors import Rejection
from per_obspy.files import remove_file, temporary_folder
from per_obspy.jobs.building_rows import RowsJob, RowsPart, do_row_chunks, rows_rejections
from per_obspy.jobs.ground_files import GroundFiles
from per_obspy.pipeline.rows.all_rows import OF_CHUNKS, OF_ROWS, AllRows, all_rows
from per_obspy.pipeline.rows.numbering import IDENTIFIERS
from per_obspy.pipeline.rows.pair_columns import PairColumns, pair_columns
from per_obspy.progress import Progress
from per_obspy.tables.building_rows import write_rows
from per_obspy.tables.buildings import BuildingWays, write_buildings
from per_obspy.tables.ranked_table import table_files
from per_obspy.threads import usable_processors


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
    with pair_columns(table_files(folder)) as pairs, temporary_folder(folder) as room:
        if not _enabled(settings.rows, pairs):
            return NO_ROWS
        found = all_rows(pairs, settings.rows, settings.totals.area, room)
        parts = _parts(settings, folder, ground, found, executor, progress)
        outputs = _written(settings, folder, found, parts, facts)
    # Parts and rejections
    rejected = (*found.rejected, *rows_rejections(parts))
    counts = _counts(found, folder, parts)
    failed = any(part.failed for part in parts)
    return BuildingRowsDone(outputs, counts, rejected, failed, found.served)


def _parts(
    settings: Run,
    folder: Path,
    ground: GroundFiles,
    found: AllRows,
    executor: Executor | None,
    progress: Progress,
) -> list[RowsPart]:
    """Compute the chunks, remove other parts, and return the parts in order."""
    progress("rows", 0, found.contacts)
    jobs = _jobs(settings, folder, ground, found)
    workers, parts, done = settings.workers or usable_processors(), list[RowsPart](), 0
    for part in do_row_chunks(jobs, workers, executor):
        parts.append(part)
        done += part.rows
        progress("rows", done, found.contacts)
    # Parts of an earlier table would be taken for parts of this one
    _remove_others(folder / "rows", parts)
    return sorted(parts, key=lambda part: part.number)


def _counts(found: AllRows, folder: Path, parts: Sequence[RowsPart]) -> dict[str, int]:
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
    found: AllRows,
    parts: Sequence[RowsPart],
    facts: Mapping[str, str],
) -> list[Path]:
    """Write the tables of rows and of buildings, and return their files."""
    rows = write_rows([part.path for part in parts], folder, facts)
    # Buildings are made of the rows
    ways = BuildingWays(settings.screening.classes, settings.totals, settings.rows.angle)
    return [*rows, *write_buildings(folder, found.file, ways, facts, settings.csv_rows)]


def _enabled(rows: Rows, pairs: PairColumns) -> bool:
    """Return whether rows are computed: as configured, by default if pairs name their buildings."""
    if rows.enabled is not None:
        return rows.enabled
    return set(IDENTIFIERS) <= set(pairs.names)


def _jobs(settings: Run, folder: Path, ground: GroundFiles, found: AllRows) -> Iterator[RowsJob]:
    """Yield one job per chunk of rows."""
    exact = settings.screening.exact if settings.rows.exact is None else settings.rows.exact
    stations = {station.name: station for station in ground.stations}
    for number, table in _chunks(found.file):
        # Pairs that a map serves have no record
        station = stations.get(table["station"][0].as_py()) if exact else None
        part = folder / "rows" / f"{number:06}.parquet"
        yield RowsJob(number, table, station, part)


def _chunks(file: Path) -> Iterator[tuple[int, pa.Table]]:
    """Yield the contacts of each chunk in order, with the columns for their histories."""
    with pq.ParquetFile(file, pre_buffer=False) as contacts:
        names = [name for name in (*OF_ROWS, *OF_CHUNKS) if name in contacts.schema_arrow.names]
        waiting = contacts.schema_arrow.empty_table().select(["chunk", *names])
        # Some thousands at a time
        for group in range(contacts.num_row_groups):
            rows = contacts.read_row_group(group, columns=["chunk", *names], use_threads=False)
            waiting = pa.concat_tables([waiting, rows.select(waiting.column_names)])
            # The last chunk may go on in the next group
            numbers = waiting["chunk"].to_numpy()
            ends = np.flatnonzero(np.diff(numbers)) + 1
            for start, end in pairwise([0, *ends.tolist()]):
                yield int(numbers[start]), waiting.slice(start, end - start).select(names)
            waiting = waiting.slice(ends[-1] if ends.size else 0)
        yield waiting["chunk"][0].as_py(), waiting.select(names)


def _remove_others(folder: Path, parts: list[RowsPart]) -> None:
    """Remove parts of an earlier table, and partly written ones."""
    known = {path for part in parts for path in (part.path, part.status)}
    for path in folder.iterdir() if folder.is_dir() else ():
        if path not in known and path.is_file():
            remove_file(path)
