"""
One run, from records to report, or one of its stages alone.

Stations and chunks of the inventory are jobs of their own: a killed run goes on where it stopped.
``run.json`` is removed first and written last: where it stands, the results beside it are complete,
and a run of the same inputs does nothing.
"""

import json
import os
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from threading import Thread
from typing import Any, NamedTuple

from per_obspy.config import Run, load
from per_obspy.errors import CatalogError, Rejection
from per_obspy.files import file_hash
from per_obspy.inventory.catalogue import stored_inventories
from per_obspy.jobs.output_folder import (
    Result,
    earlier_record,
    file_hashes,
    held,
    now,
    recorded,
    software_versions,
)
from per_obspy.jobs.station import Done
from per_obspy.pipeline.preflight import check_inputs
from per_obspy.pipeline.report import reported, require_extras
from per_obspy.pipeline.screening import screened
from per_obspy.pipeline.stations import (
    content_hash,
    finished_stations,
    station_jobs,
    stations_of_earlier_run,
)
from per_obspy.progress import Progress, silent
from per_obspy.records.fdsn.cache import Fetched
from per_obspy.records.sources import fetched_records, input_files
from per_obspy.screening.warmup import compile_screening

#: Written last.
RECORD = "run.json"


def run(
    configuration: Path,
    output: Path | None = None,
    executor: Executor | None = None,
    progress: Progress = silent,
) -> Result:
    """
    Do a whole run: records to spectra to risk table to figures.

    Parameters
    ----------
    configuration : Path
        TOML file, see :class:`per_obspy.config.Run`.
    output : Path, optional
        Folder of the results, instead of the configured one.
    executor : Executor, optional
        Where stations are processed; processes of this machine if not given.
    progress : callable
        Told of every stage: name, done, total.

    Returns
    -------
    Result
        The folder and the content of its ``run.json``.

    Raises
    ------
    CatalogError
        If the configuration, the folder of records or the pair table is wrong as a whole, or
        another run holds the output folder.
    ServiceError
        If services fail and no record is at hand.
    """
    configuration = configuration.resolve()
    settings = _settings(configuration)
    folder = (output or settings.output).resolve()
    with held(folder):
        fetched = fetched_records(settings.records, progress)
        head = _head(settings, configuration, fetched)
        if known := earlier_record(folder / RECORD, head["key"]):
            return Result(folder, known, did_nothing=True)
        check_inputs(settings)
        (folder / RECORD).unlink(missing_ok=True)
        seconds, started = dict[str, float](), now()
        with _timed(seconds, "records"):
            jobs, rejected = station_jobs(settings, folder, fetched, progress)
        with _timed(seconds, "stations"), _compiling(progress):
            done = finished_stations(jobs, settings.workers, executor, progress)
        found = _screened_and_reported(
            settings, folder, _after_stations(done, rejected), executor, progress
        )
        found["seconds"] = seconds | found["seconds"]
        return recorded(folder / RECORD, {**found, "started": started, **head})


def screen(
    configuration: Path,
    output: Path | None = None,
    executor: Executor | None = None,
    progress: Progress = silent,
) -> Result:
    """
    Screen the inventory again with the stations that an earlier run has left, and report.

    Only chunks of the inventory that have changed are computed. Parameters and errors are those of
    :func:`run`; it is an error as well if there are no stations.
    """
    configuration = configuration.resolve()
    settings = _settings(configuration)
    folder = (output or settings.output).resolve()
    with held(folder):
        done = stations_of_earlier_run(folder)
        check_inputs(settings)
        (folder / RECORD).unlink(missing_ok=True)
        started = now()
        head = _head(settings, configuration, None) | {
            "key": f"screening of stations as they were at {started}"
        }
        with _compiling(progress):
            found = _screened_and_reported(
                settings, folder, _after_stations(done, []), executor, progress
            )
        return recorded(folder / RECORD, {**found, "started": started, **head})


def report(configuration: Path, output: Path | None = None, progress: Progress = silent) -> Result:
    """
    Write totals, figures and layers again from the risk table of a finished run.

    Raises
    ------
    CatalogError
        If there is no finished run, or what it left has changed.
    """
    settings = _settings(configuration.resolve())
    folder = (output or settings.output).resolve()
    with held(folder):
        record = _finished(folder)
        needed = [name for name in record["outputs"] if name in ("risk.parquet", "spectra.nc")]
        for name in needed:
            if not (folder / name).is_file() or file_hash(folder / name) != record["outputs"][name]:
                raise CatalogError(str(folder / name), "not as the run left it: run again")
        shards = [one.shard for one in stations_of_earlier_run(folder) if one.shard]
        outputs = reported(settings, folder, shards, progress)
        return recorded(
            folder / RECORD, {**record, "outputs": record["outputs"] | file_hashes(folder, outputs)}
        )


def _settings(configuration: Path) -> Run:
    """Return the settings of a run whose optional libraries are there."""
    settings = load(configuration, Run)
    require_extras(settings)
    return settings


def _head(settings: Run, configuration: Path, fetched: Fetched | None) -> dict[str, Any]:
    """Return what a run stands on, and the key that tells whether the same was done before."""
    inputs = _input_hashes(settings, fetched, configuration)
    said = json.loads(settings.model_dump_json(context={"folder": configuration.parent}))
    key = content_hash(
        {"version": version("per_obspy"), "configuration": {**said, "workers": 0}, "inputs": inputs}
    )
    return {"key": key, "configuration": said, "inputs": inputs}


class _Stations(NamedTuple):
    """What the first stage has left: shards, everything that was left out so far, stations that were done before."""

    shards: list[Path]
    rejected: list[Rejection]
    resumed: int


def _after_stations(done: Sequence[Done], rejected: Sequence[Rejection]) -> _Stations:
    left_out = [*rejected, *(row for one in done for row in one.rejected)]
    return _Stations(
        [one.shard for one in done if one.shard], left_out, sum(one.resumed for one in done)
    )


def _screened_and_reported(
    settings: Run, folder: Path, stations: _Stations, executor: Executor | None, progress: Progress
) -> dict[str, Any]:
    """Do the stages after the stations and return what ``run.json`` will say of them."""
    seconds = dict[str, float]()
    for name in ("risk.parquet", "risk.csv", "risk.columns.csv"):
        (folder / name).unlink(missing_ok=True)
    with _timed(seconds, "screening"):
        found = screened(settings, folder, stations.shards, stations.rejected, executor, progress)
    with _timed(seconds, "report"):
        outputs = [*found.outputs, *reported(settings, folder, stations.shards, progress)]
    return {
        "name": settings.name,
        "state": "complete" if found.counts["pairs"] else "nothing_usable",
        "partial": any(
            count for name, count in found.counts.items() if name.startswith("rejected_")
        ),
        "simulated": settings.simulation is not None,
        "counts": {
            "stations": len(stations.shards),
            "stations_resumed": stations.resumed,
            **found.counts,
        },
        "outputs": file_hashes(folder, outputs),
        "versions": software_versions(),
        "seconds": seconds,
    }


def _input_hashes(settings: Run, fetched: Fetched | None, configuration: Path) -> dict[str, str]:
    """Return the hash of every input file by its path relative to the configuration."""
    given = [settings.simulation, *_inventory_files(settings)]
    files = [
        *input_files(settings.records, fetched),
        *(path for path in given if path and path.is_file()),
    ]
    return {os.path.relpath(path, configuration.parent): file_hash(path) for path in files}


def _inventory_files(settings: Run) -> list[Path]:
    """Return every file from which pairs may be taken, and the index that names them."""
    pairs = settings.pairs
    if pairs is None or pairs.simulated is not None:
        return []
    if pairs.catalog is None:
        return [pairs.file] if pairs.file else []
    stored = [
        one
        for one in stored_inventories(pairs.catalog)
        if not pairs.names or one.name in pairs.names
    ]
    return [pairs.catalog, *(one.file for one in stored)]


def _finished(folder: Path) -> dict[str, Any]:
    """Return the record of the run that left its results here."""
    try:
        record: dict[str, Any] = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        return record | {"outputs": dict(record["outputs"])}
    except (OSError, ValueError, KeyError) as error:
        raise CatalogError(
            str(folder / RECORD), "no finished run here: a whole run comes first"
        ) from error


@contextmanager
def _compiling(progress: Progress) -> Iterator[None]:
    """Compile the kernels of screening beside the stations, which work in other processes; later runs load them."""
    thread = Thread(target=compile_screening)
    thread.start()
    yield
    progress("loading kernels (the first run compiles them for a minute)", 0, 1)
    thread.join()
    progress("loading kernels (the first run compiles them for a minute)", 1, 1)


@contextmanager
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    start = time.perf_counter()
    yield
    seconds[stage] = round(time.perf_counter() - start, 3)
