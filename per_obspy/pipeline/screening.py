"""Second stage: pairs and the stations become the risk table, chunk by chunk."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from per_obspy.config import Run
from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import remove_file
from per_obspy.inventory.files.reading import PairInventory
from per_obspy.inventory.gap_units import gap_suspicions
from per_obspy.jobs.chunk import CHUNK, ChunkJob, Part, do_chunks, rejections
from per_obspy.jobs.ground_files import GroundFiles, ground_files
from per_obspy.jobs.station import FinishedStation
from per_obspy.pipeline.pairs import pair_files
from per_obspy.pipeline.stations import simulated_motion
from per_obspy.progress import Progress
from per_obspy.screening.ranking import EVERY_STATE
from per_obspy.tables.risk import write_risk
from per_obspy.tables.table_files import write_rejected
from per_obspy.threads import usable_processors

KINDS = ("file", "record", "station", "service", "pair")


class PairNotes(NamedTuple):
    """
    Sentences about the pair tables of a run.

    Attributes
    ----------
    recognised : tuple of str
        How each table that is not plain is read.
    suspicions : tuple of str
        What is possible row by row but odd of all gaps.
    """

    recognised: tuple[str, ...] = ()
    suspicions: tuple[str, ...] = ()


class Screened(NamedTuple):
    """
    Result of the screening.

    Attributes
    ----------
    outputs : list of Path
        The files.
    counts : dict
        Pairs and their states, rejections of each kind, and chunks that an earlier run had done.
    served : Counter
        Number of pairs for which the record of each station is used.
    unplaced : tuple of Rejection
        Stations that serve no pair because their place is unknown.
    failed : bool
        Whether the work of a chunk failed unexpectedly.
    pair_tables : PairNotes
        How the pair tables are read, and what is odd of their gaps.
    """

    outputs: list[Path]
    counts: dict[str, int]
    served: Counter[str]
    unplaced: tuple[Rejection, ...]
    failed: bool
    pair_tables: PairNotes


def screened(
    settings: Run,
    folder: Path,
    stations: Sequence[FinishedStation],
    rejected: Iterable[Rejection],
    executor: Executor | None,
    progress: Progress,
) -> Screened:
    """
    Write the risk table and what was left out, for an inventory of any size.

    Parameters
    ----------
    settings : Run
        What to do.
    folder : Path
        Of the results.
    stations : sequence of FinishedStation
        With shards; if there is none and no ShakeMap, only ``rejected.csv`` is written.
    rejected : iterable of Rejection
        What was left out before.
    executor : Executor, optional
        Where to work instead of processes of this machine.
    progress : callable
        Called for every chunk.

    Raises
    ------
    CatalogError
        If the inventory is wrong as a whole.
    """
    maps = _maps(settings)
    ground, unplaced = ground_files(stations, maps, settings.screening.interpolation)
    # Pairs need a station or a map
    parts, notes = list[Part](), PairNotes()
    if stations or maps:
        parts, notes = _parts(settings, folder, ground, executor, progress)
    outputs, states, served = [folder / "rejected.csv"], Counter[str](), Counter[str]()
    kinds = write_rejected(chain(rejected, unplaced, rejections(parts)), outputs[0])
    # The parts of the chunks become one table, worst pair first
    if tables := [part.path for part in parts if part.path]:
        progress("ranking", 0, 1)
        risk = write_risk(tables, folder, _facts(settings, stations), settings.csv_rows)
        outputs, states, served = [*outputs, *risk.files], risk.states, risk.stations
        progress("ranking", 1, 1)
    failed = any(part.failed for part in parts)
    return Screened(outputs, _counts(states, kinds, parts), served, unplaced, failed, notes)


def _facts(settings: Run, stations: Sequence[FinishedStation]) -> dict[str, str]:
    """Return name and origin of the motion as texts of a table."""
    is_simulated = simulated_motion(settings, stations)
    return {"name": settings.name, "simulated": str(is_simulated).lower()}


def _counts(states: Counter[str], kinds: Counter[str], parts: Sequence[Part]) -> dict[str, int]:
    """Return the numbers of pairs, of rejections of each kind and of chunks."""
    counts = {"pairs": states.total()}
    counts |= {state: states[state] for state in EVERY_STATE}
    counts |= {f"rejected_{kind}": kinds[kind] for kind in KINDS}
    return counts | {"chunks": len(parts), "chunks_resumed": sum(part.resumed for part in parts)}


def _maps(settings: Run) -> tuple[Path, ...]:
    """Return the files of the ShakeMap, none if there is no map."""
    records = settings.records
    maps = (records.shakemap, records.shakemap_uncertainty) if records else ()
    return tuple(path for path in maps if path)


def _parts(
    settings: Run, folder: Path, ground: GroundFiles, executor: Executor | None, progress: Progress
) -> tuple[list[Part], PairNotes]:
    """Do the chunks and return their parts in the order of the inventory; remove other parts."""
    form = settings.pairs.form if settings.pairs else None
    inventory = PairInventory(pair_files(settings, folder, ground.stations), form)
    area = settings.totals.area
    if area and area not in inventory.names:
        raise CatalogError("totals", f"area: the pair table has no column {area!r}")
    progress("screening", 0, inventory.count)
    # Rows are counted as chunks are finished, in whichever order
    parts, rows = list[Part](), 0
    jobs = _jobs(settings, folder, ground, inventory)
    for part in do_chunks(jobs, settings.workers or usable_processors(), executor):
        parts.append(part)
        rows += part.rows
        progress("screening", min(rows, inventory.count), inventory.count)
    _remove_others(_chunk_folder(folder), parts)
    # What is said about the tables, after all their rows were read
    notes = PairNotes(tuple(inventory.recognised()), tuple(gap_suspicions(inventory.gaps)))
    return sorted(parts, key=lambda part: part.number), notes


def _remove_others(folder: Path, parts: Sequence[Part]) -> None:
    """Remove everything but these parts: those of a longer inventory, and half written ones."""
    known = {part.status for part in parts}
    known |= {part.path for part in parts if part.path}
    for path in folder.iterdir() if folder.is_dir() else ():
        if path not in known and path.is_file():
            remove_file(path)


def _jobs(
    settings: Run, folder: Path, ground: GroundFiles, inventory: PairInventory
) -> Iterator[ChunkJob]:
    """Yield one job per chunk of the inventory."""
    for number, chunk in enumerate(inventory.chunks(CHUNK)):
        part = _chunk_folder(folder) / f"{number:06}.parquet"
        yield ChunkJob(number, chunk, ground, settings.building, settings.screening, part)


def _chunk_folder(folder: Path) -> Path:
    """Return the folder of the parts."""
    return folder / "chunks"
