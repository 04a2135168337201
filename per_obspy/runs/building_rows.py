"""Rows of buildings: from the risk table to the tables of rows and of buildings."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import pyarrow.parquet as pq

from per_obspy.buildings.search import (
    BY_STATION,
    GROUP,
    IDENTIFIERS,
    WITHOUT_HISTORIES,
    AllRows,
    PieceRows,
    chunks_of,
    connected_pieces,
    find_rows,
    numbered_contacts,
    one_thread_database,
    totals_of,
)
from per_obspy.buildings.tables import (
    BY_SEVERITY,
    RANKED,
    buildings_of,
    rows_of_parts,
    write_buildings,
    write_rows,
)
from per_obspy.errors import Rejection
from per_obspy.files import temporary_folder
from per_obspy.results.parts import joined_rows, joined_schema
from per_obspy.results.ranked_table import RankedTable, ranked_table, table_files
from per_obspy.results.totals import PLACE
from per_obspy.runs.provenance import RunContext
from per_obspy.runs.tasks.building_piece import PIECES, PieceTask, piece_task
from per_obspy.runs.tasks.building_rows import RowsTask
from per_obspy.runs.tasks.ground_files import GroundFiles
from per_obspy.runs.tasks.parallel import Workers, finish, results
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
        # By default if pairs name their buildings, and as pairs are followed
        are_named = set(IDENTIFIERS) <= set(pairs.schema.names)
        if not (are_named if settings.rows.enabled is None else settings.rows.enabled):
            return NO_ROWS
        exact = settings.screening.exact if settings.rows.exact is None else settings.rows.exact
        if not exact:
            return _without_histories(context, pairs, room, facts)
        return _with_histories(context, pairs, room, ground, facts)


def _with_histories(
    context: RunContext,
    pairs: RankedTable,
    room: Path,
    ground: GroundFiles,
    facts: Mapping[str, str],
) -> BuildingRowsDone:
    """Write both tables from chunks of rows, which are followed."""
    settings, folder = context.settings, context.folder
    found = find_rows(pairs, settings.rows, settings.totals.area or PLACE, room)
    parts = _parts(_tasks(folder, ground, found), context.workers, found.contacts)
    # Parts of an earlier table would be taken for parts of this one
    remove_other_parts(folder / "rows", parts)
    files = [part.path for part in parts if part.path]
    outputs = write_rows(rows_of_parts(files), folder, facts)
    outputs += write_buildings(buildings_of(folder, found.file, settings), folder, settings, facts)
    # And what is found besides
    rejected = (*found.rejected, *rejections(parts))
    failed = any(part.failed for part in parts)
    counts = _counts(found.rows, folder, parts)
    return BuildingRowsDone(outputs, counts, rejected, failed, found.served)


def _without_histories(
    context: RunContext, pairs: RankedTable, room: Path, facts: Mapping[str, str]
) -> BuildingRowsDone:
    """Write both tables from parts of pieces of connected pairs, each in its order."""
    settings, folder = context.settings, context.folder
    remove_other_parts(folder / "rows", ())
    named, done = _pieces(context, pairs, room)
    rows, buildings = zip(*(task.files for task, _ in done), strict=True)
    found = [piece for _, piece in done]
    # The next row of the whole is the next one of a part
    interfaces = joined_rows(rows, joined_schema(rows), GROUP, BY_STATION)
    outputs = write_rows(numbered_contacts(interfaces, named, found), folder, facts)
    ranked = joined_rows(buildings, joined_schema(buildings), RANKED, BY_SEVERITY)
    outputs += write_buildings(ranked, folder, settings, facts)
    count, rejected, served = totals_of(found)
    return BuildingRowsDone(outputs, _counts(count, folder, ()), rejected, served=served)


def _pieces(
    context: RunContext, pairs: RankedTable, room: Path
) -> tuple[int, list[tuple[PieceTask, PieceRows]]]:
    """Do all pieces; return the number of named buildings, and the pieces in their order."""
    settings = context.settings
    with one_thread_database(room) as database:
        area = settings.totals.area or PLACE
        named, pieces = connected_pieces(pairs, WITHOUT_HISTORIES, area, database)
        # Made as they are asked for, a few ahead of the workers
        tasks = (piece_task(number, piece, settings, room) for number, piece in enumerate(pieces))
        done = list(results(tasks, PIECES, context.workers))
    return named, sorted(done, key=lambda one: one[0].number)


def _counts(rows: int, folder: Path, parts: Sequence[Part]) -> dict[str, int]:
    """Return the numbers of rows, buildings and chunks."""
    buildings = pq.read_metadata((folder / "buildings.parquet").absolute())
    return {
        "rows": rows,
        "buildings": int(buildings.num_rows),
        "row_chunks": len(parts),
        "row_chunks_resumed": sum(part.resumed for part in parts),
    }


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
