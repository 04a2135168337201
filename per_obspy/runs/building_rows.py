"""Rows of buildings: from the risk table to the tables of rows and of buildings."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.buildings.search import IDENTIFIERS, AllRows, chunks_of, find_rows
from per_obspy.buildings.tables import (
    rows_of_parts,
    rows_without_histories,
    write_buildings,
    write_rows,
)
from per_obspy.config import Run
from per_obspy.errors import Rejection
from per_obspy.files import temporary_folder
from per_obspy.results.ranked_table import ranked_table, table_files
from per_obspy.results.totals import PLACE
from per_obspy.runs.provenance import RunContext
from per_obspy.runs.tasks.building_rows import RowsTask
from per_obspy.runs.tasks.ground_files import GroundFiles
from per_obspy.runs.tasks.parallel import Workers, finish
from per_obspy.runs.tasks.parts import Part, rejections, remove_other_parts


class BuildingRowsDone(NamedTuple):
    """Result of the rows of buildings."""

    #: The files; none where rows are not enabled.
    outputs: list[Path]
    #: Rows, buildings, and chunks that an earlier run had done.
    counts: dict[str, int]
    #: Contradictions, repeated contacts and rows that could not be followed.
    rejected: tuple[Rejection, ...] = ()
    #: Whether the work of a chunk failed unexpectedly.
    failed: bool = False
    #: Number of buildings in whose pairs the record of each station is used.
    served: Mapping[str, int] = MappingProxyType({})


#: Result where there are no rows.
NO_ROWS = BuildingRowsDone([], {})


def building_rows(
    context: RunContext, ground: GroundFiles, facts: Mapping[str, str]
) -> BuildingRowsDone:
    """
    Write the tables of rows and of buildings from the risk table, if rows are enabled.

    Parameters
    ----------
    context : RunContext
        The run, whose folder has the risk table.
    ground : GroundFiles
        The stations.
    facts : mapping of str to str
        Facts of the whole table that the Parquet files state.
    """
    settings, folder = context.settings, context.folder
    with ranked_table(table_files(folder)) as pairs, temporary_folder(folder) as room:
        # By default if pairs name their buildings
        are_named = set(IDENTIFIERS) <= set(pairs.schema.names)
        if not (are_named if settings.rows.enabled is None else settings.rows.enabled):
            return NO_ROWS
        histories = _has_histories(settings)
        found = find_rows(pairs, settings.rows, settings.totals.area or PLACE, room, histories)
        # Without histories nothing is left to do
        tasks = _tasks(folder, ground, found) if histories else iter(())
        parts = _parts(tasks, context.workers, found.contacts)
        # Parts of an earlier table would be taken for parts of this one
        remove_other_parts(folder / "rows", parts)
        outputs = write_rows(_interfaces(found, parts), folder, facts)
        outputs += write_buildings(folder, found.file, settings, facts)
    rejected = (*found.rejected, *rejections(parts))
    failed = any(part.failed for part in parts)
    return BuildingRowsDone(outputs, _counts(found, folder, parts), rejected, failed, found.served)


def _interfaces(found: AllRows, parts: Sequence[Part]) -> Iterator[pa.Table]:
    """Return the interfaces of all parts; of all contacts where no part had to be made."""
    files = [part.path for part in parts if part.path]
    return rows_of_parts(files) if files else rows_without_histories(found.file)


def _counts(found: AllRows, folder: Path, parts: Sequence[Part]) -> dict[str, int]:
    """Return the numbers of rows, buildings and chunks."""
    buildings = pq.read_metadata((folder / "buildings.parquet").absolute())
    return {
        "rows": found.rows,
        "buildings": int(buildings.num_rows),
        "row_chunks": len(parts),
        "row_chunks_resumed": sum(part.resumed for part in parts),
    }


def _has_histories(settings: Run) -> bool:
    """Return whether rows are followed: as pairs are, unless the settings say otherwise."""
    exact = settings.rows.exact
    return settings.screening.exact if exact is None else exact


def _tasks(folder: Path, ground: GroundFiles, found: AllRows) -> Iterator[RowsTask]:
    """Yield one task per chunk of rows."""
    stations = {station.name: station for station in ground.stations}
    for number, table in enumerate(chunks_of(found.file)):
        # Pairs that a map serves have no record
        station = stations.get(table["station"][0].as_py())
        part = folder / "rows" / f"{number:06}.parquet"
        yield RowsTask(number=number, part=part, contacts=table, station=station)


def _parts(tasks: Iterable[RowsTask], workers: Workers, contacts: int) -> list[Part]:
    """Compute the chunks of a number of contacts, and return the parts in order."""
    workers.progress("rows", 0, contacts)
    parts, done = list[Part](), 0
    for part in finish(tasks, workers):
        parts.append(part)
        done += part.rows
        workers.progress("rows", done, contacts)
    return sorted(parts, key=lambda part: part.number)
