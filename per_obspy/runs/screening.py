"""Second stage: pairs and the stations become the risk table, chunk by chunk."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, groupby
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow.parquet as pq

from per_obspy.config import Records, Run
from per_obspy.errors import CatalogError, Rejection
from per_obspy.inventory.files.raw_rows import RawRows
from per_obspy.inventory.files.reading import PairChunk, PairInventory
from per_obspy.inventory.schema import AFTER_DAMAGE
from per_obspy.records.earthquakes.quakeml import read_event_file
from per_obspy.records.shakemap import map_event
from per_obspy.records.station_list import StationAmplitudes
from per_obspy.results.coverage import Coverage, CoverageTally
from per_obspy.results.risk import NO_RISK, RiskFiles, write_risk
from per_obspy.results.table_files import write_rejected
from per_obspy.runs.building_rows import NO_ROWS, BuildingRowsDone, building_rows
from per_obspy.runs.losses import areas_left_out, search_of_tables
from per_obspy.runs.pairs import pair_files
from per_obspy.runs.provenance import RunContext
from per_obspy.runs.record import Served
from per_obspy.runs.stations import simulated_motion
from per_obspy.runs.tasks.chunk import CHUNK, ChunkTask
from per_obspy.runs.tasks.earlier_result import earlier_result
from per_obspy.runs.tasks.ground_files import GroundFiles, ground_files
from per_obspy.runs.tasks.parallel import finish
from per_obspy.runs.tasks.parts import Part, rejections, remove_other_parts
from per_obspy.runs.tasks.station import FinishedStation, hypocentre_attributes
from per_obspy.screening.assignment import nearest_station
from per_obspy.screening.ranking import EVERY_STATE
from per_obspy.screening.site_motion import Hypocentre, hypocentre_of

#: Chunks per worker, where the inventory is large enough, so that no worker waits for another one.
CHUNKS_PER_WORKER = 4

#: Rows of a chunk at least: preparing the records of 24 stations anew takes as long as 3 000 rows
#: with estimates.
SMALLEST_CHUNK = 10_000

#: Rows of a share of a chunk with exact histories at least, each of which takes a millisecond.
SMALLEST_SHARE = 250

KINDS = ("file", "record", "station", "service", "pair", "building", "row")


class PairNotes(NamedTuple):
    """Sentences about the pair tables of a run."""

    #: How each table that is not plain is read.
    recognised: tuple[str, ...] = ()
    #: Sentences on what is possible but odd: rows, columns, pairs and buildings given twice.
    suspicions: tuple[str, ...] = ()

    def as_record(self) -> dict[str, list[str]]:
        """Return the sentences for ``run.json``."""
        return {name: list(texts) for name, texts in self._asdict().items()}


class Screened(NamedTuple):
    """Result of the screening."""

    #: The files.
    outputs: list[Path]
    #: Pairs and their states, rejections of each kind, and chunks that an earlier run had done.
    counts: dict[str, int]
    #: Numbers of pairs and buildings for which the record of each station is used.
    served: Served
    #: Stations that serve no pair because their place is unknown.
    unplaced: tuple[Rejection, ...]
    #: Whether the work of a chunk failed unexpectedly.
    failed: bool
    #: Sentences on the recognised form of the pair tables, and on what is odd in them.
    pair_tables: PairNotes
    #: Rows of the pair tables, and those that are left out.
    coverage: Coverage
    #: The ground motion.
    ground: GroundFiles
    #: Rejections of the stages before.
    earlier: tuple[Rejection, ...]

    @property
    def left_out(self) -> list[Rejection]:
        """Rejections of the stages before, and of stations that serve no pair."""
        return [*self.earlier, *self.unplaced]

    @property
    def alone(self) -> tuple[StationAmplitudes, ...]:
        """Stations of which only amplitudes are used."""
        return self.ground.amplitudes.stations if self.ground.amplitudes else ()


def screened(
    context: RunContext, stations: Sequence[FinishedStation], rejected: Iterable[Rejection]
) -> Screened:
    """
    Write the risk table and the rejections of an inventory of any size.

    Parameters
    ----------
    context : RunContext
        The run.
    stations : sequence of FinishedStation
        With station files; if there is none and no ShakeMap, only ``rejected.csv`` is written.
    rejected : iterable of Rejection
        Rejections of the earlier stages.

    Raises
    ------
    CatalogError
        If the inventory is wrong as a whole.
    """
    settings, folder = context.settings, context.folder
    ground, unplaced = ground_of_run(settings, stations)
    # Pairs need a station, amplitudes of one, or a map
    screens = _parts if stations or ground.amplitudes or ground.shakemap else _no_parts
    parts, notes, tally = screens(context, ground)
    risk, rows, outputs = NO_RISK, NO_ROWS, [folder / "rejected.csv"]
    # The parts of the chunks become one table, worst pair first
    if any(part.path for part in parts):
        facts = _facts(settings, stations)
        risk = _ranked(context, parts, facts)
        # Rows of buildings are read from it
        rows = building_rows(context, ground, facts)
        outputs += risk.files + rows.outputs
    left_out = chain(rejected, unplaced, _in_order(parts, _shares(context)), rows.rejected)
    counts = _counts(risk.states, write_rejected(left_out, outputs[0]), parts, rows)
    counts |= _damage_counts(settings, risk)
    return Screened(
        outputs,
        counts,
        Served(risk.stations, rows.served),
        unplaced,
        rows.failed or _any_failed(parts),
        notes,
        tally.coverage(counts),
        ground,
        tuple(rejected),
    )


def _ranked(context: RunContext, parts: Sequence[Part], facts: dict[str, str]) -> RiskFiles:
    """Write the risk table of all parts, in one file or one per cell."""
    settings, folder = context.settings, context.folder
    tables = [part.path for part in parts if part.path]
    pairs = sum(pq.read_metadata(table.absolute()).num_rows for table in tables)
    # One file, or one per cell of very many pairs
    cell = settings.dataset_cell if pairs >= settings.dataset_from else None
    context.progress("ranking", 0, 1)
    risk = write_risk(tables, folder, facts, settings.csv_rows, cell)
    context.progress("ranking", 1, 1)
    return risk


def _any_failed(parts: Sequence[Part]) -> bool:
    """Return whether the work of a chunk failed unexpectedly."""
    return any(part.failed for part in parts)


def _facts(settings: Run, stations: Sequence[FinishedStation]) -> dict[str, str]:
    """Return name and origin of the motion as texts of a table."""
    is_simulated = simulated_motion(settings, stations)
    return {"name": settings.name, "simulated": str(is_simulated).lower()}


def _damage_counts(settings: Run, risk: RiskFiles) -> dict[str, int]:
    """Return the numbers of pairs by what an earlier earthquake did, if it is asked for."""
    words = AFTER_DAMAGE if settings.after else ()
    return {f"after_damage_{word}": risk.damage[word] for word in words}


def _counts(
    states: Counter[str], kinds: Counter[str], parts: Sequence[Part], rows: BuildingRowsDone
) -> dict[str, int]:
    """Return the numbers of pairs, of rejections of each kind, of chunks, and those of rows."""
    counts = {"pairs": states.total()}
    counts |= {state: states[state] for state in EVERY_STATE}
    counts |= {f"rejected_{kind}": kinds[kind] for kind in KINDS}
    counts |= {"chunks": len(parts), "chunks_resumed": sum(part.resumed for part in parts)}
    return counts | rows.counts


def ground_of_run(
    settings: Run, stations: Sequence[FinishedStation]
) -> tuple[GroundFiles, tuple[Rejection, ...]]:
    """Return the ground motion of a run, and the stations of which nothing is used."""
    records = settings.records
    listed = records.stationlist if records else None
    return ground_files(
        stations,
        shakemap_files(settings),
        settings.screening.interpolation,
        listed,
        _described_hypocentre(records) if records and listed else None,
    )


def _described_hypocentre(records: Records) -> Hypocentre | None:
    """Return the hypocentre by the event or the map of a configuration, for want of records."""
    event = read_event_file(records.event) if records.event else None
    if found := hypocentre_of([hypocentre_attributes(event)]):
        return found
    # The head of a map
    facts = map_event(records.shakemap) if records.shakemap else {}
    place = [value for name in Hypocentre._fields if isinstance(value := facts.get(name), float)]
    return Hypocentre(*place) if len(place) == len(Hypocentre._fields) else None


def shakemap_files(settings: Run) -> tuple[Path, ...]:
    """Return the files of the ShakeMap, none if there is no map."""
    records = settings.records
    maps = (records.shakemap, records.shakemap_uncertainty) if records else ()
    return tuple(path for path in maps if path)


def _parts(context: RunContext, ground: GroundFiles) -> tuple[list[Part], PairNotes, CoverageTally]:
    """Compute the chunks, and return the parts in order, sentences and what is left out."""
    settings, folder, progress = context.settings, context.folder, context.progress
    inventory = _inventory(settings, folder, ground)
    progress("screening", 0, inventory.count)
    # Rows are counted as chunks are finished, in whichever order
    parts, rows, raw = list[Part](), 0, dict[int, RawRows]()
    tally = CoverageTally(search_of_tables(inventory.rows))
    pieces = _pieces(inventory, ground, context)
    tasks = _tasks(settings, folder, ground, pieces, raw)
    for part in finish(tasks, context.workers):
        parts.append(part)
        rows += part.rows
        # What is left out is read back chunk by chunk, never as a whole
        lost, block = list(rejections([part])), raw.pop(part.number)
        tally.add(lost, areas_left_out(settings.totals, lost, block))
        progress("screening", min(rows, inventory.count), inventory.count)
    remove_other_parts(_chunk_folder(folder), parts)
    # Findings about the tables, after all their rows were read
    return sorted(parts, key=lambda part: part.number), _notes(inventory), tally


def _no_parts(*_: object) -> tuple[list[Part], PairNotes, CoverageTally]:
    """Return what is screened without any ground motion."""
    return [], PairNotes(), CoverageTally()


def _notes(inventory: PairInventory) -> PairNotes:
    """Return the sentences on pair tables whose rows were read."""
    return PairNotes(tuple(inventory.recognised()), tuple(inventory.suspicions.sentences()))


def _inventory(settings: Run, folder: Path, ground: GroundFiles) -> PairInventory:
    """Open the pair tables of a run."""
    form = settings.pairs.form if settings.pairs else None
    inventory = PairInventory(pair_files(settings, folder, ground.stations), form)
    area = settings.totals.area
    if area and area not in inventory.names:
        raise CatalogError("totals", f"area: the pair table has no column {area!r}")
    return inventory


def _chunk_rows(count: int, workers: int) -> int:
    """
    Return the rows of a chunk of an inventory of so many rows.

    They are the smallest number times a power of two, so that finished chunks stay what they are
    when an inventory grows a little.
    """
    share = max(count / (CHUNKS_PER_WORKER * workers), SMALLEST_CHUNK)
    return min(SMALLEST_CHUNK << round(math.log2(share / SMALLEST_CHUNK)), CHUNK)


def _shares(context: RunContext) -> int:
    """Return the number of shares of a chunk: exact histories keep every worker busy with one."""
    return context.workers.count if context.settings.screening.exact else 1


def _pieces(
    inventory: PairInventory, ground: GroundFiles, context: RunContext
) -> Iterator[tuple[int, PairChunk]]:
    """Yield the shares of all chunks with their numbers."""
    size, shares = _chunk_rows(inventory.count, context.workers.count), _shares(context)
    for number, chunk in enumerate(inventory.chunks(size)):
        for place, share in enumerate(_shared(chunk, ground, shares)):
            yield shares * number + place, share


def _shared(chunk: PairChunk, ground: GroundFiles, most: int) -> list[PairChunk]:
    """Return a chunk in shares of about as many rows, of which each has most stations alone."""
    count = min(most, len(chunk.repeated) // SMALLEST_SHARE)
    if count < 2 or not ground.stations:
        return [chunk]
    # Rows without a place go with the others of one station
    place = [chunk.rows.table[f"{name}_1"].to_numpy() for name in ("longitude", "latitude")]
    stations = np.array([(one.longitude, one.latitude) for one in ground.stations]).T
    nearest, _ = nearest_station(*np.nan_to_num(place), *stations)
    shares = []
    for number, rows in enumerate(np.array_split(np.argsort(nearest, kind="stable"), count)):
        # In the order of the file, whose broken lines belong to the first share
        rows.sort()
        raw = chunk.rows
        raw = raw._replace(
            table=raw.table.take(rows), lines=raw.lines[rows], broken=() if number else raw.broken
        )
        shares.append(PairChunk(raw, chunk.repeated[rows], chunk.odd[rows]))
    return shares


def _in_order(parts: Sequence[Part], shares: int) -> Iterator[Rejection]:
    """Yield the rejections of parts, those of the shares of one chunk in the order of its lines."""
    for _, group in groupby(parts, lambda part: part.number // shares):
        yield from sorted(rejections(group), key=lambda one: one.row or math.inf)


def _tasks(
    settings: Run,
    folder: Path,
    ground: GroundFiles,
    chunks: Iterable[tuple[int, PairChunk]],
    raw: dict[int, RawRows],
) -> Iterator[ChunkTask]:
    """Yield one task per numbered chunk of the inventory, and keep its rows until it is done."""
    after = earlier_result(settings)
    for number, chunk in chunks:
        raw[number] = chunk.rows
        part = _chunk_folder(folder) / f"{number:06}.parquet"
        yield ChunkTask(
            number=number,
            part=part,
            chunk=chunk,
            ground=ground,
            building=settings.building,
            screening=settings.screening,
            after=after,
        )


def _chunk_folder(folder: Path) -> Path:
    """Return the folder of the parts."""
    return folder / "chunks"
