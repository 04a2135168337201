"""
The stages of a run in their order, and those that are done alone.

Stations and chunks of the inventory are separate tasks: a killed run continues where it stopped.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from per_obspy.config import Run
from per_obspy.errors import Rejection
from per_obspy.files import file_hash, is_part
from per_obspy.progress import timed
from per_obspy.records.fdsn.cache import Fetched
from per_obspy.results.coverage import Coverage
from per_obspy.results.station_summary import write_stations
from per_obspy.runs.inputs.drawn_pairs import BUILDINGS, PAIRS, REJECTED, write_drawn_pairs
from per_obspy.runs.losses import losses
from per_obspy.runs.output_folder import (
    RECORD,
    SCREENING,
    STATIONS,
    Result,
    file_hashes,
    recorded,
    software_versions,
)
from per_obspy.runs.pairs import check_inputs
from per_obspy.runs.provenance import RunContext, RunSettings
from per_obspy.runs.record import KnownStations, RunRecord, earlier_facts, station_facts
from per_obspy.runs.report import explaining, reported
from per_obspy.runs.screening import Screened, screened
from per_obspy.runs.stations import (
    all_rejections,
    compared_stations,
    find_station_tasks,
    finished_stations,
    simulated_motion,
    simulated_stations,
    stations_of_earlier_run,
)
from per_obspy.runs.tasks.executor import engine_facts, opened_executor
from per_obspy.runs.tasks.station import FinishedStation, StationTask
from per_obspy.screening.warmup import compiling


def new_run(
    asked: RunSettings,
    context: RunContext,
    fetched: Fetched | None,
    head: dict[str, Any] | None,
    facts: Mapping[str, object],
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
    facts : mapping
        Further plain values for ``run.json``.
    """
    settings, folder = context.settings, context.folder
    # Pairs from footprints, and everything that would stop a later stage
    drawn = write_drawn_pairs(settings, folder, context.progress)
    check_inputs(settings, folder)
    # A refused configuration leaves that of the results in its place
    asked.write()
    record = RunRecord(name=settings.name, facts=facts, drawn=drawn).begin(folder, STATIONS)
    with timed(record.seconds, "records"):
        found = find_station_tasks(context, fetched)
        head = head or asked.head(fetched, found.hashes)
    with opened_executor(settings.engine, context.workers, folder) as used:
        context = replace(context, workers=used)
        done = _done_stations(context, record, found.tasks)
        # Only now every station has its neighbours
        stations, trusted = compared_stations(done, found.earthquakes, settings.records)
        record = replace(record, earthquakes=found.earthquakes).begin(folder, SCREENING)
        # From here on no record is needed
        rejected = all_rejections(found.rejected, stations)
        record = _later_stages(context, record, stations, rejected, found.known)
    hashes = _intermediate_hashes(folder, done, found.hashes)
    return _finished(replace(record, trusted=trusted, intermediate=hashes), folder, head)


def new_screening(asked: RunSettings, context: RunContext) -> Result:
    """Screen the pairs with the stations of the latest run, whose output folder is locked."""
    settings, folder = context.settings, context.folder
    found = _earlier_stations(settings, folder)
    drawn = write_drawn_pairs(settings, folder, context.progress)
    check_inputs(settings, folder)
    earthquakes, known = earlier_facts(folder / RECORD)
    stations, trusted = compared_stations(found, earthquakes, settings.records)
    record = RunRecord(
        name=settings.name, drawn=drawn, earthquakes=earthquakes, trusted=trusted
    ).begin(folder, SCREENING)
    rejected = all_rejections([], stations)
    # On a cluster the folder is shared until the report is written
    with (
        opened_executor(settings.engine, context.workers, folder) as used,
        compiling(context.progress),
    ):
        record = _later_stages(replace(context, workers=used), record, stations, rejected, known)
    # A later run does everything that has changed since, whatever is recorded here
    key = f"screening of stations as they were at {record.started}"
    return _finished(record, folder, {**asked.head(None, {}), "key": key})


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
    """Return the stations of the latest run; empty if no record served its pairs."""
    records = settings.records
    has_map = records is not None and (records.shakemap or records.stationlist) is not None
    if has_map and (folder / RECORD).is_file() and not any((folder / "stations").glob("*.json")):
        return []
    return stations_of_earlier_run(folder)


def _usable(stations: Sequence[FinishedStation]) -> list[FinishedStation]:
    """Return the stations with usable records."""
    return [station for station in stations if station.shard is not None]


def _spectra(stations: Sequence[FinishedStation]) -> list[Any]:
    """Return the spectra of stations that have any."""
    return [station.spectra for station in stations if station.spectra is not None]


def _done_stations(
    context: RunContext, record: RunRecord, tasks: Sequence[StationTask]
) -> list[FinishedStation]:
    """Do the stations that are not done yet, while the kernels of later stages are compiled."""
    workers = context.workers
    with (
        timed(record.seconds, "stations"),
        compiling(workers.progress),
        record.with_engine(context.folder, workers.executor),
    ):
        workers.progress("stations", 0, len(tasks))
        return finished_stations(tasks, workers)


def _later_stages(
    context: RunContext,
    record: RunRecord,
    stations: Sequence[FinishedStation],
    rejected: Sequence[Rejection],
    known: KnownStations,
) -> RunRecord:
    """Do the stages after the stations, and return the record with their facts."""
    settings, folder, executor = context.settings, context.folder, context.workers.executor
    usable = _usable(stations)
    # The risk table and the rows of buildings
    with timed(record.seconds, "screening"), record.with_engine(folder, executor):
        found = screened(context, usable, rejected)
        spectra = _spectra(usable)
        table = write_stations(spectra, found.left_out, found.served.pairs, folder, found.alone)
    # Everything that is read from them
    with (
        timed(record.seconds, "report"),
        explaining(context, usable, found.ground) as explained,
    ):
        report = reported(context, usable, found.coverage, explained)
    record = _with_counts(record, settings, found, stations, known)
    return replace(
        record,
        # A picture or layer that failed is made by the next run
        failed=record.failed or bool(report.faults),
        faults=report.faults,
        alert=report.alert,
        engine=engine_facts(executor),
        simulated=simulated_motion(settings, usable),
        warnings=table.warnings,
        pair_tables=found.pair_tables.as_record(),
        coverage=found.coverage.as_record(),
        versions=software_versions(),
        outputs=file_hashes(folder, [*found.outputs, *table.files, *report.outputs]),
    )


def _with_counts(
    record: RunRecord,
    settings: Run,
    found: Screened,
    stations: Sequence[FinishedStation],
    known: KnownStations,
) -> RunRecord:
    """Return the record with state, counts, served stations and lost rows of a screening."""
    usable = _usable(stations)
    # Stations that were done before, and those of simulated motion, are counted apart
    counts = {
        "stations": len(usable),
        "stations_resumed": sum(station.resumed for station in stations),
        "stations_simulated": simulated_stations(usable),
        **found.counts,
    }
    if amplitudes := found.ground.amplitudes:
        counts["stations_amplitudes_only"] = len(amplitudes.stations)
        counts["intensities_left_out"] = amplitudes.intensities
    unplaced = {rejection.name for rejection in found.unplaced if rejection.kind == "station"}
    serving = [station.station for station in usable if station.station not in unplaced]
    # Rejections make a result partial
    return replace(
        record,
        state="complete" if counts["pairs"] else "nothing_usable",
        partial=any(count for name, count in counts.items() if name.startswith("rejected_")),
        failed=found.failed or any(station.failed for station in stations),
        counts=counts,
        stations=station_facts(known, serving, found.served, counts),
        losses=losses(settings, counts, record.earlier_rows),
    )


def _finished(record: RunRecord, folder: Path, head: Mapping[str, Any]) -> Result:
    """Write the record of a finished run with its key, configuration and inputs."""
    assert record.stations is not None  # of the last stage
    # What failed unexpectedly is done again by the next run, and files that waited are taken
    key = "" if record.failed or record.stations["waiting"] else head["key"]
    finished = replace(
        record,
        stage=None,
        earlier_rows=None,
        configuration=head["configuration"],
        inputs=head["inputs"],
    )
    return finished.write(folder, key)


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
