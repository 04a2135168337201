"""First stage: one station file with spectra per station, from found or simulated records."""

import shutil
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from per_obspy.config import Processing, Records, Run, Scenario, Simulation, Spectra, load
from per_obspy.errors import CatalogError, Rejection, WriteError
from per_obspy.files import content_hash, is_part, remove_file
from per_obspy.names import inside
from per_obspy.processing.account import USED_ANYWAY, trusting
from per_obspy.progress import Progress
from per_obspy.records.earthquakes.quakeml import EventFile
from per_obspy.records.fdsn.cache import Fetched
from per_obspy.records.shakemap import is_scenario
from per_obspy.records.sources import StationSource, find_sources
from per_obspy.resume import earlier_status, write_status
from per_obspy.runs.provenance import RunContext
from per_obspy.runs.record import KnownStations
from per_obspy.runs.run_facts import with_event
from per_obspy.runs.tasks.parallel import Workers, finish
from per_obspy.runs.tasks.station import FinishedStation, StationTask, earlier_station
from per_obspy.screening.amplitudes import Earthquake
from per_obspy.screening.site_motion import hypocentre_of
from per_obspy.screening.station_comparison import Comparison, compare_stations
from per_obspy.simulation.earthquake import simulate, write_simulation

#: Stations that a message names.
NAMED = 10


class FoundStations(NamedTuple):
    """Stations of the configured sources, not done yet."""

    #: One per station.
    tasks: list[StationTask]
    #: Files and records of the sources that cannot be used.
    rejected: list[Rejection]
    #: Hash of every file that was read on the way.
    hashes: dict[Path, str]
    #: Facts of every earthquake in the folder of records.
    earthquakes: list[dict[str, object]]
    #: Stations that are expected, and those of which records came.
    known: KnownStations = KnownStations()


def find_station_tasks(context: RunContext, fetched: Fetched | None) -> FoundStations:
    """
    Find the stations of a run; simulated records are written into the output folder first.

    Raises
    ------
    CatalogError
        If a source of records is wrong as a whole.
    """
    settings, folder, progress = context.settings, context.folder, context.progress
    scenario = load(settings.simulation, Simulation).scenario if settings.simulation else None
    if scenario:
        _write_simulated_records(scenario, folder, progress)
        target = folder / "simulated"
        records = Records(folder=target, event=target / "event.xml")
    else:
        assert settings.records is not None  # Run demands records or a simulation
        records = settings.records
    progress("finding records", 0, 1)
    found = find_sources(records, fetched)
    if scenario:
        _note_simulation(scenario, folder, found.hashes)
    progress("finding records", 1, 1)

    # One task per station
    trust = settings.records.trust if settings.records else ()
    tasks = station_tasks(
        found.stations, _shards(folder), settings.processing, settings.spectra, found.event, trust
    )
    earthquakes = with_event(found.earthquakes, found.event and found.event.event)
    known = KnownStations.of(found.expected, found.stations, found.waiting)
    return FoundStations(tasks, list(found.rejected), found.hashes, earthquakes, known)


def station_tasks(
    stations: Mapping[str, StationSource],
    shards: Path,
    processing: Processing,
    spectra: Spectra,
    event: EventFile | None = None,
    trust: Sequence[str] = (),
) -> list[StationTask]:
    """
    Return one task per station, sorted by name, which writes a station file.

    Parameters
    ----------
    stations : mapping
        ``"NET.STA"`` -> files, metadata and reader.
    shards : Path
        Folder of the station files.
    processing, spectra : Processing, Spectra
        Settings.
    event : EventFile, optional
        The earthquake.
    trust : sequence of str
        Stations whose records are used although checks of plausibility reject them.

    Raises
    ------
    CatalogError
        If a station file would be outside of that folder, because a link leads out of it.
    """
    trusted = processing.model_copy(update={"checks": trusting(processing.checks)})
    return [
        StationTask(
            station=name,
            source=source.files,
            inventory=source.inventory,
            event=event,
            processing=trusted if name in trust else processing,
            spectra=spectra,
            shard=inside(shards, f"{file_stem(name)}.nc"),
            hashes=source.hashes,
            reader=source.reader,
        )
        for name, source in sorted(stations.items())
    ]


def file_stem(station: str) -> str:
    """
    Return the stem of a station's file names; a missing network leaves no leading dot.

    Examples
    --------
    >>> file_stem("CI.CLC"), file_stem(".TAFT"), file_stem(".")
    ('CI.CLC', 'TAFT', 'unnamed')
    """
    return station.removeprefix(".") or "unnamed"


def finished_stations(tasks: Sequence[StationTask], workers: Workers) -> list[FinishedStation]:
    """
    Do the tasks and return every station, sorted by name.

    Raises
    ------
    WriteError
        If a station cannot be written; it names the stations that wait for another run.
    """
    finished = []
    # A failure to write is no property of the stations that wait
    try:
        for station in finish(tasks, workers):
            finished.append(station)
            workers.progress("stations", len(finished), len(tasks))
    except WriteError as error:
        done = {station.station for station in finished}
        waiting = {task.station for task in tasks} - done
        reason = f"{error.reason}; {_waiting_stations(sorted(waiting))}"
        raise WriteError(error.path, reason) from error
    return sorted(finished, key=lambda station: station.station)


class ComparedStations(NamedTuple):
    """Stations after the comparison with each other."""

    #: All of them: with the flags and warnings of the comparison, or rejected by it.
    stations: list[FinishedStation]
    #: ``kept``: trusted stations that a check would have rejected; ``plausible``: those that it
    #: would not; ``unknown``: trusted names of which there is no record.
    trusted: dict[str, list[str]]


def compared_stations(
    stations: Sequence[FinishedStation],
    earthquakes: Sequence[Mapping[str, Any]],
    records: Records | None,
) -> ComparedStations:
    """
    Compare all finished stations with each other and the earthquake; their files stay as they are.

    Parameters
    ----------
    stations : sequence of FinishedStation
        Those of the run, usable or not.
    earthquakes : sequence of mapping
        Facts of the earthquakes of the records, see ``with_event``; the screened one counts.
    records : Records or None
        Settings, with the names of trusted stations.
    """
    # Peaks, places and shapes of the motion
    trust = records.trust if records else ()
    spectra = [station.spectra for station in stations if station.spectra is not None]
    said = compare_stations(spectra, _source(earthquakes, spectra))
    compared, kept = list[FinishedStation](), list[str]()
    for station in stations:
        comparison = said.get(_name_of(station), Comparison())
        if comparison.rejected and _name_of(station) not in trust:
            compared.append(_rejected(station, comparison.rejected))
            continue
        kept += [_name_of(station)] if comparison.rejected or _is_used_anyway(station) else []
        compared.append(_flagged(station, comparison))
    # Trusted names, by what trust has changed
    names = {_name_of(station) for station in stations}
    return ComparedStations(
        compared,
        {
            "kept": sorted(kept),
            "plausible": sorted({*trust} & names - {*kept}),
            "unknown": sorted({*trust} - names),
        },
    )


def _name_of(station: FinishedStation) -> str:
    """Return the name of a station; that of a file stem lacks the dot of a missing network."""
    if station.spectra is not None:
        return str(station.spectra["station"].item())
    return station.station if "." in station.station else f".{station.station}"


def _is_used_anyway(station: FinishedStation) -> bool:
    """Return whether the records of a station are used only because it is trusted."""
    return station.spectra is not None and USED_ANYWAY in str(station.spectra["warnings"].item())


def _source(earthquakes: Sequence[Mapping[str, Any]], spectra: Sequence[xr.Dataset]) -> Earthquake:
    """Return the screened earthquake by event or headers, with its place by the stations."""
    screened = next((one for one in earthquakes if one.get("screened")), {})
    facts = screened.get("event") or screened.get("headers") or {}
    place = hypocentre_of([station.attrs for station in spectra])
    values = {} if place is None else place._asdict()
    # A fact that is missing or None is unknown
    for name in Earthquake._fields:
        values[name] = facts.get(name) if facts.get(name) is not None else values.get(name, np.nan)
    source = Earthquake(**{name: float(value) for name, value in values.items()})
    # A simulated earthquake owes nothing to a model of real ones
    if any(station.attrs.get("simulated") == "true" for station in spectra):
        source = source._replace(magnitude=np.nan)
    return source if np.isfinite(source.latitude) else source._replace(longitude=np.nan)


def _rejected(station: FinishedStation, reasons: Sequence[str]) -> FinishedStation:
    """Return a station that the comparison with the others rejects, with the way to keep it."""
    assert station.spectra is not None  # nothing is said of others
    name = _name_of(station)
    source = str(station.spectra["source_files"].item())
    lift = f'if it is right: records.trust = ["{name}"]'
    row = Rejection("station", name, source, None, (*reasons, lift))
    rejected = (*station.rejected, row)
    return station._replace(shard=None, hash="", spectra=None, rejected=rejected)


def _flagged(station: FinishedStation, comparison: Comparison) -> FinishedStation:
    """Return a station with the flags and warnings of the comparison with the others."""
    if station.spectra is None or not comparison.flags:
        return station
    # Beside those of the processing
    changed = station.spectra.copy()
    flags = {*str(changed["record_flags"].item()).split(), *comparison.flags}
    earlier = str(changed["warnings"].item())
    texts = [earlier, *comparison.warnings] if earlier else comparison.warnings
    for name, text in (("record_flags", " ".join(sorted(flags))), ("warnings", "; ".join(texts))):
        changed[name] = changed[name].copy(data=text)
    return station._replace(spectra=changed)


def simulated_stations(stations: Sequence[FinishedStation]) -> int:
    """Return the number of stations whose spectra are marked as simulated."""
    spectra = [station.spectra for station in stations if station.spectra is not None]
    return sum(dataset.attrs.get("simulated") == "true" for dataset in spectra)


def simulated_motion(settings: Run, stations: Sequence[FinishedStation]) -> bool:
    """Return whether any motion of a run is simulated: that of a station or of the ShakeMap."""
    shakemap = settings.records.shakemap if settings.records else None
    return simulated_stations(stations) > 0 or (shakemap is not None and is_scenario(shakemap))


def _waiting_stations(names: Sequence[str]) -> str:
    """Return a message with the number and first names of stations to be tried again."""
    others = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    count = "1 station waits" if len(names) == 1 else f"{len(names)} stations wait"
    return f"{count} for another run: {', '.join(names[:NAMED])}{others}"


def all_rejections(
    found: Sequence[Rejection], stations: Sequence[FinishedStation]
) -> list[Rejection]:
    """Return the rejections of the sources and then of every station."""
    rejected = list(found)
    for station in stations:
        rejected += station.rejected
    return rejected


def stations_of_earlier_run(folder: Path) -> list[FinishedStation]:
    """
    Return the finished stations of the latest run in an output folder.

    Raises
    ------
    CatalogError
        If there is none, or one is damaged.
    """
    statuses = sorted(path for path in _shards(folder).glob("*.json") if not is_part(path))
    found = [earlier_station(status) for status in statuses]
    if not found:
        raise CatalogError(str(_shards(folder)), "no stations here: run `per-obspy run` first")
    return found


def _shards(folder: Path) -> Path:
    """Return the folder of the station files of a run."""
    return folder / "stations"


def _write_simulated_records(scenario: Scenario, folder: Path, progress: Progress) -> None:
    """Write the records of a scenario unless those of an earlier run are complete."""
    if earlier_status(_simulation_status(folder), _simulation_key(scenario)) is not None:
        return
    progress("simulating records", 0, 1)
    # Files of another scenario, or of a killed run, would be taken for records of this one
    remove_file(_simulation_status(folder))
    shutil.rmtree(folder / "simulated", ignore_errors=True)
    write_simulation(simulate(scenario), folder / "simulated")
    progress("simulating records", 1, 1)


def _note_simulation(scenario: Scenario, folder: Path, hashes: Mapping[Path, str]) -> None:
    """Write the status of the simulated records with the hashes of the files as they were read."""
    outputs = {path.relative_to(folder).as_posix(): digest for path, digest in hashes.items()}
    write_status(_simulation_status(folder), _simulation_key(scenario), outputs, {})


def _simulation_status(folder: Path) -> Path:
    """Return the status file of the simulated records of a run."""
    return folder / "simulated.json"


def _simulation_key(scenario: Scenario) -> str:
    """Return the hash of the scenario of an earthquake and of the program."""
    content = {"version": version("per_obspy"), "scenario": scenario.model_dump(mode="json")}
    return content_hash(content)
