"""
The stages of a run in their order, and those that are done alone.

Stations and chunks of the inventory are separate jobs: a killed run continues where it stopped.
The state in ``run.json`` is ``unfinished`` from the beginning to the end, when it is written again:
only then the other results are complete, and a run of the same inputs is up to date.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from per_obspy.config import Run
from per_obspy.errors import Rejection
from per_obspy.files import file_hash, is_part, remove_file
from per_obspy.progress import timed
from per_obspy.records.fdsn.cache import Fetched
from per_obspy.results.coverage import Coverage
from per_obspy.results.ranked_table import remove_table
from per_obspy.results.station_summary import StationSummary, write_stations
from per_obspy.resume import write_status
from per_obspy.runs.inputs.drawn_pairs import BUILDINGS, PAIRS, REJECTED, write_drawn_pairs
from per_obspy.runs.inputs.preflight import check_inputs
from per_obspy.runs.losses import losses, number_of_rows
from per_obspy.runs.provenance import RunContext, RunSettings
from per_obspy.runs.report import reported
from per_obspy.runs.results.served_stations import (
    KnownStations,
    earlier_facts,
    station_facts,
)
from per_obspy.runs.screening import Screened, screened
from per_obspy.runs.stations import (
    FoundStations,
    all_rejections,
    compared_stations,
    find_station_jobs,
    finished_stations,
    simulated_motion,
    simulated_stations,
    stations_of_earlier_run,
)
from per_obspy.runs.tasks.executor import engine_facts, noted_engine, opened_executor
from per_obspy.runs.tasks.output_folder import (
    RECORD,
    SCREENING,
    STATIONS,
    UNFINISHED,
    Result,
    file_hashes,
    now,
    recorded,
    software_versions,
)
from per_obspy.runs.tasks.station import FinishedStation
from per_obspy.screening.warmup import compiling


def new_run(
    asked: RunSettings,
    context: RunContext,
    fetched: Fetched | None,
    head: dict[str, Any] | None,
    facts: dict[str, Any],
) -> Result:
    """
    Do a run that was not done before, whose output folder is locked.

    Parameters
    ----------
    asked : RunSettings
        What to do, and where.
    context : RunContext
        The same for the stages.
    fetched : Fetched or None
        Records of FDSN services.
    head : dict or None
        Key, configuration and inputs; inputs are hashed as they are read if not given.
    facts : dict
        Further plain values for ``run.json``.
    """
    settings, folder = context.settings, context.folder
    drawn = write_drawn_pairs(settings, folder, context.progress)
    check_inputs(settings, folder)
    # The page shows when its results were made
    facts, seconds = facts | {"started": now()}, dict[str, float]()
    earlier_rows = _begun(folder, settings, STATIONS, facts=facts)
    with timed(seconds, "records"):
        found = find_station_jobs(context, fetched)
        head = head or asked.head(fetched, found.hashes)
    # From here on the folder describes an unfinished run
    record = facts | _all_stages(context, found, facts)
    record |= {"seconds": seconds | record["seconds"], "drawn": drawn}
    return _finished_record(settings, folder, record, head, earlier_rows)


def new_screening(asked: RunSettings, context: RunContext) -> Result:
    """Screen the pairs with the stations of the latest run, whose output folder is locked."""
    settings, folder = context.settings, context.folder
    found = _earlier_stations(settings, folder)
    drawn = write_drawn_pairs(settings, folder, context.progress)
    check_inputs(settings, folder)
    earthquakes, known = earlier_facts(folder / RECORD)
    stations, trusted = compared_stations(found, earthquakes, settings.records)
    started = now()
    earlier_rows = _begun(folder, settings, SCREENING, earthquakes, {"started": started})
    # A later run does everything that has changed since, whatever is recorded here
    head = asked.head(None, {})
    head["key"] = f"screening of stations as they were at {started}"
    rejected = all_rejections([], stations)
    # On a cluster the folder is shared until the report is written
    with (
        opened_executor(settings.engine, context.workers, folder) as used,
        compiling(context.progress),
    ):
        record = _later_stages(replace(context, workers=used), stations, rejected)
    record |= {"started": started, "earthquakes": earthquakes, "drawn": drawn}
    record["trusted"] = trusted
    _add_stations(record, known)
    return _finished_record(settings, folder, record, head, earlier_rows)


def new_report(context: RunContext, record: dict[str, Any]) -> Result:
    """Write the report of a finished run with this record again; its output folder is locked."""
    settings, folder = context.settings, context.folder
    earlier = _earlier_stations(settings, folder)
    stations, _ = compared_stations(earlier, record.get("earthquakes", ()), settings.records)
    coverage = Coverage.of_record(record)
    made = reported(context, _usable(stations), coverage)
    outputs = record["outputs"] | file_hashes(folder, made.outputs)
    # A picture or layer that failed is made by the next run
    key = "" if made.faults else record["key"]
    found = {"outputs": outputs, "faults": made.faults, "alert": made.alert, "key": key}
    return recorded(folder / RECORD, {**record, **found})


def _earlier_stations(settings: Run, folder: Path) -> list[FinishedStation]:
    """Return the stations of the latest run; empty if only a ShakeMap served its pairs."""
    records = settings.records
    has_map = records is not None and records.shakemap is not None
    if has_map and (folder / RECORD).is_file() and not any((folder / "stations").glob("*.json")):
        return []
    return stations_of_earlier_run(folder)


def _usable(stations: Sequence[FinishedStation]) -> list[FinishedStation]:
    """Return the stations with usable records."""
    return [station for station in stations if station.shard is not None]


def _all_stages(
    context: RunContext, found: FoundStations, facts: Mapping[str, object]
) -> dict[str, Any]:
    """Do the stations and the stages after them, and return their part of ``run.json``."""
    settings, folder = context.settings, context.folder
    seconds = dict[str, float]()
    with opened_executor(settings.engine, context.workers, folder) as used:
        noted = noted_engine(folder / RECORD, used.executor)
        with timed(seconds, "stations"), compiling(used.progress), noted:
            used.progress("stations", 0, len(found.jobs))
            done = finished_stations(found.jobs, used)
        # Only now every station has its neighbours
        stations, trusted = compared_stations(done, found.earthquakes, settings.records)
        _begun(folder, settings, SCREENING, found.earthquakes, facts)
        # From here on no record is needed
        rejected = all_rejections(found.rejected, stations)
        record = _later_stages(replace(context, workers=used), stations, rejected)
    record |= {"earthquakes": found.earthquakes, "trusted": trusted}
    _add_stations(record, found.known)
    record["intermediate"] = _intermediate_hashes(folder, done, found.hashes)
    return {**record, "seconds": seconds | record["seconds"]}


def _add_stations(record: dict[str, Any], known: KnownStations) -> None:
    """Add expected, received, late and rejected stations, with their pairs, to ``run.json``."""
    used, served = record.pop("used"), record.pop("served")
    record["stations"] = station_facts(known, used, served, record["counts"])


def _begun(
    folder: Path,
    settings: Run,
    stage: str,
    earthquakes: Sequence[Any] = (),
    facts: Mapping[str, object] | None = None,
) -> int | None:
    """Record a run as unfinished, and return the number of rows of the pair tables before it."""
    rows = number_of_rows(folder / RECORD)
    begun: dict[str, Any] = {
        **(facts or {}),
        "name": settings.name,
        "state": UNFINISHED,
        "stage": stage,
        "earlier_rows": rows,
    }
    # The summary states the earthquake before the run is finished
    begun["earthquakes"] = list(earthquakes)
    write_status(folder / RECORD, "", {}, begun, indent=1)
    # A table of an earlier run would be taken for one of this run
    remove_table(folder)
    for name in ("risk", "rows", "buildings"):
        for end in (".parquet", ".csv", ".columns.csv"):
            remove_file(folder / f"{name}{end}")
    return rows


def _finished_record(
    settings: Run,
    folder: Path,
    record: dict[str, Any],
    head: dict[str, Any],
    earlier_rows: int | None,
) -> Result:
    """Write ``run.json``, with sentences on losses of rows."""
    lost = losses(settings, record["counts"], earlier_rows)
    # What failed unexpectedly is done again by the next run, and files that waited are taken
    waited = record["stations"]["waiting"]
    key = "" if record["failed"] or waited else head["key"]
    return recorded(folder / RECORD, {**record, "losses": lost, **head, "key": key})


def _later_stages(
    context: RunContext, stations: Sequence[FinishedStation], rejected: Sequence[Rejection]
) -> dict[str, Any]:
    """Do the stages after the stations and return their part of ``run.json``."""
    settings, folder, executor = context.settings, context.folder, context.workers.executor
    seconds, usable = dict[str, float](), _usable(stations)
    # The risk table, then everything that is read from it
    with timed(seconds, "screening"), noted_engine(folder / RECORD, executor):
        found = screened(context, usable, rejected)
        table = _write_stations(usable, rejected, found, folder)
    with timed(seconds, "report"):
        made = reported(context, usable, found.coverage)
        outputs = [*found.outputs, *table.files, *made.outputs]
    outcome = _outcome(found, stations)

    return {
        "name": settings.name,
        **outcome,
        # A picture or layer that failed is made by the next run
        "failed": outcome["failed"] or bool(made.faults),
        "faults": made.faults,
        "alert": made.alert,
        "used": _names_of(usable, found),
        "served": found.served,
        **engine_facts(executor),
        "simulated": simulated_motion(settings, usable),
        "warnings": table.warnings,
        "pair_tables": found.pair_tables.as_record(),
        "coverage": found.coverage.as_record(),
        "outputs": file_hashes(folder, outputs),
        "versions": software_versions(),
        "seconds": seconds,
    }


def _names_of(usable: Sequence[FinishedStation], found: Screened) -> list[str]:
    """Return the names of the stations with known coordinates, which can serve pairs."""
    unplaced = {rejection.name for rejection in found.unplaced}
    return [station.station for station in usable if station.station not in unplaced]


def _outcome(found: Screened, stations: Sequence[FinishedStation]) -> dict[str, Any]:
    """Return state and counts of a run; rejections make its result partial."""
    counts = found.counts
    rejections = [count for name, count in counts.items() if name.startswith("rejected_")]
    usable = _usable(stations)
    # Stations that were done before, and those of simulated motion, are counted apart
    of_stations = {
        "stations": len(usable),
        "stations_resumed": sum(station.resumed for station in stations),
        "stations_simulated": simulated_stations(usable),
    }
    return {
        "state": "complete" if counts["pairs"] else "nothing_usable",
        "partial": any(rejections),
        "failed": found.failed or any(station.failed for station in stations),
        "counts": {**of_stations, **counts},
    }


def _write_stations(
    usable: Sequence[FinishedStation],
    rejected: Sequence[Rejection],
    found: Screened,
    folder: Path,
) -> StationSummary:
    """Write the table of the stations with the pairs that each serves."""
    spectra = [station.spectra for station in usable if station.spectra is not None]
    return write_stations(spectra, [*rejected, *found.unplaced], found.served.pairs, folder)


def _intermediate_hashes(
    folder: Path, stations: Sequence[FinishedStation], known: Mapping[Path, str]
) -> dict[str, str]:
    """Return the hashes of the files of the first stage, which are results too."""
    folders = [folder / name for name in ("simulated", "stations")]
    files = [path for parent in folders for path in parent.rglob("*")]
    made = ("simulated.json", "pairs.csv", PAIRS, REJECTED, BUILDINGS)
    files += [folder / name for name in made]
    # What was hashed on the way is not opened again
    hashes = dict(known)
    hashes |= {station.shard: station.hash for station in stations if station.shard}
    return {
        str(path.relative_to(folder)): hashes.get(path) or file_hash(path)
        for path in sorted(files)
        if path.is_file() and not is_part(path)
    }
