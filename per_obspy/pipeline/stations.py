"""The first stage: records, found or simulated, become one shard of spectra a station."""

import hashlib
import json
import shutil
from collections.abc import Sequence
from concurrent.futures import Executor
from importlib.metadata import version
from pathlib import Path
from typing import Any

from per_obspy.config import Records, Run, Simulation, load
from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import written_whole
from per_obspy.jobs.station import Done, Job, do_stations, earlier_done
from per_obspy.progress import Progress
from per_obspy.records.fdsn.cache import Fetched
from per_obspy.records.simulation.earthquake import simulate, write_simulation
from per_obspy.records.sources import find_sources
from per_obspy.threads import usable_processors


def content_hash(content: dict[str, Any]) -> str:
    """Return the hash of plain values."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def station_jobs(
    settings: Run, folder: Path, fetched: Fetched | None, progress: Progress
) -> tuple[list[Job], list[Rejection]]:
    """Return one job a station, and what cannot be used of the sources."""
    records = settings.records or _simulated_records(settings, folder, progress)
    progress("finding records", 0, 1)
    found = find_sources(records, fetched)
    progress("finding records", 1, 1)
    jobs = [
        Job(
            station=name,
            source=source.files,
            inventory=source.inventory,
            event=found.event,
            processing=settings.processing,
            spectra=settings.spectra,
            shard=_shards(folder) / f"{name.strip('.')}.nc",
            simulated=settings.simulation is not None,
            reader=source.reader,
        )
        for name, source in sorted(found.stations.items())
    ]
    return jobs, list(found.rejected)


def finished_stations(
    jobs: Sequence[Job], workers: int, executor: Executor | None, progress: Progress
) -> list[Done]:
    """Do the jobs and return every station, sorted by name."""
    progress("stations", 0, len(jobs))
    finished = []
    for done in do_stations(jobs, workers or usable_processors(), executor):
        finished.append(done)
        progress("stations", len(finished), len(jobs))
    return sorted(finished, key=lambda one: one.station)


def stations_of_earlier_run(folder: Path) -> list[Done]:
    """
    Return the stations as the latest run left them in its output folder.

    Raises
    ------
    CatalogError
        If there is none, or one is damaged.
    """
    found = [earlier_done(note) for note in sorted(_shards(folder).glob("*.json"))]
    if not found:
        raise CatalogError(str(_shards(folder)), "no stations here: a whole run comes first")
    return found


def _shards(folder: Path) -> Path:
    return folder / "stations"


def _simulated_records(settings: Run, folder: Path, progress: Progress) -> Records:
    """Write the records of the scenario, unless they stand there, and return where they are."""
    assert settings.simulation is not None  # Run demands records or a simulation
    target = folder / "simulated"
    scenario = load(settings.simulation, Simulation).scenario
    key = content_hash(
        {"version": version("per_obspy"), "scenario": scenario.model_dump(mode="json")}
    )
    mark = folder / "simulated.json"
    if not mark.is_file() or json.loads(mark.read_text(encoding="utf-8"))["key"] != key:
        progress("simulating records", 0, 1)
        shutil.rmtree(target, ignore_errors=True)
        write_simulation(simulate(scenario), target)
        with written_whole(mark) as part:
            part.write_text(json.dumps({"key": key}), encoding="utf-8")
        progress("simulating records", 1, 1)
    return Records(folder=target, event=target / "event.xml")
