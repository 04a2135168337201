"""
One run, from records to report.

Stations are jobs of their own (``jobs.py``): a killed run goes on where it stopped. ``run.json`` is removed first and
written last: where it stands, the results beside it are complete, and a run of the same inputs does nothing.
"""

import hashlib
import json
import os
import platform
import shutil
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from threading import Thread
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from filelock import FileLock, Timeout

from per_obspy.config import Records, Run, Simulation, load
from per_obspy.errors import CatalogError, Rejection, require_extra
from per_obspy.files import file_hash, written_whole
from per_obspy.inventory.reading import read_pairs
from per_obspy.inventory.simulated import simulated_pairs
from per_obspy.jobs import Done, Job, do_stations, do_stations_on
from per_obspy.progress import Progress, silent
from per_obspy.records.fdsn import Fetched
from per_obspy.records.simulated import simulate, write_simulation
from per_obspy.records.sources import fetched_records, find_sources, input_files
from per_obspy.report.figures import draw_overview, draw_walk
from per_obspy.report.tables import write_rejected, write_risk, write_totals
from per_obspy.screening.risk import risk_table
from per_obspy.screening.warmup import compile_screening
from per_obspy.spectra.storage import read_spectra, region, write_spectra

#: Written last.
RECORD = "run.json"

#: Libraries whose versions a result may depend on.
LIBRARIES = ("per_obspy", "numpy", "scipy", "numba", "obspy", "pandas", "xarray", "netCDF4", "pyarrow")


class Result(NamedTuple):
    """
    What a run has done.

    Attributes
    ----------
    folder : Path
        Where everything is.
    record : dict
        The content of ``run.json``.
    did_nothing : bool
        Whether the same had been done before.
    """

    folder: Path
    record: dict[str, Any]
    did_nothing: bool


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
        If the configuration, the folder of records or the pair table is wrong as a whole, or another run holds the
        output folder.
    ServiceError
        If services fail and no record is at hand.
    """
    configuration = configuration.resolve()
    settings = load(configuration, Run)
    folder = (output or settings.output).resolve()
    with _held(folder):
        fetched = fetched_records(settings.records, progress)
        inputs = _input_hashes(settings, fetched, configuration)
        said = json.loads(settings.model_dump_json(context={"folder": configuration.parent}))
        key = _hash({"version": version("per_obspy"), "configuration": {**said, "workers": 0}, "inputs": inputs})
        if earlier := _earlier(folder, key):
            return Result(folder, earlier, did_nothing=True)
        (folder / RECORD).unlink(missing_ok=True)
        head = {"key": key, "configuration": said, "inputs": inputs}
        record = _work(settings, folder, fetched, head, executor, progress)
        with written_whole(folder / RECORD) as part:
            part.write_text(json.dumps(record, indent=1), encoding="utf-8")
        return Result(folder, record, did_nothing=False)


def _work(
    settings: Run,
    folder: Path,
    fetched: Fetched | None,
    head: dict[str, Any],
    executor: Executor | None,
    progress: Progress,
) -> dict[str, Any]:
    """Do the stages in their order and return what ``run.json`` will say."""
    started, seconds = datetime.now(UTC), dict[str, float]()
    with _timed(seconds, "records"):
        pairs = read_pairs(settings.pairs.file) if settings.pairs and settings.pairs.file else None
        jobs, rejected = _jobs(settings, folder, fetched, progress)
    with _timed(seconds, "stations"), _compiling(progress):
        done = _stations(jobs, settings.workers or os.cpu_count() or 1, executor, progress)
    rejected += [one for station in done for one in station.rejected]
    stations = [read_spectra(station.shard) for station in done if station.shard]
    table = None
    with _timed(seconds, "screening"):
        progress("screening", 0, 1)
        if stations:
            pairs = _simulated_pairs(settings, folder, stations) if pairs is None else pairs
            table = risk_table(stations, pairs, settings.building, settings.screening)
            rejected += table.attrs["rejected"]
        progress("screening", 1, 1)
    with _timed(seconds, "report"):
        outputs = _write(settings, folder, stations, table, rejected)
    return {
        "name": settings.name,
        "state": "complete" if table is not None and len(table) else "nothing_usable",
        "partial": bool(rejected),
        "simulated": settings.simulation is not None,
        "counts": _counts(done, table, rejected),
        "started": started.isoformat(timespec="seconds"),
        "seconds": seconds,
        "outputs": {str(path.relative_to(folder)): file_hash(path) for path in outputs},
        "versions": {name: version(name) for name in LIBRARIES} | {"python": platform.python_version()},
        **head,
    }


def _jobs(
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
            shard=folder / "stations" / f"{name.strip('.')}.nc",
            simulated=settings.simulation is not None,
            reader=source.reader,
        )
        for name, source in sorted(found.stations.items())
    ]
    return jobs, list(found.rejected)


def _simulated_records(settings: Run, folder: Path, progress: Progress) -> Records:
    """Write the records of the scenario, unless they stand there, and return where they are."""
    assert settings.simulation is not None  # Run demands records or a simulation
    target = folder / "simulated"
    scenario = load(settings.simulation, Simulation).scenario
    key = _hash({"version": version("per_obspy"), "scenario": scenario.model_dump(mode="json")})
    mark = folder / "simulated.json"
    if not mark.is_file() or json.loads(mark.read_text(encoding="utf-8"))["key"] != key:
        progress("simulating records", 0, 1)
        shutil.rmtree(target, ignore_errors=True)
        write_simulation(simulate(scenario), target)
        with written_whole(mark) as part:
            part.write_text(json.dumps({"key": key}), encoding="utf-8")
        progress("simulating records", 1, 1)
    return Records(folder=target, event=target / "event.xml")


def _stations(jobs: Sequence[Job], workers: int, executor: Executor | None, progress: Progress) -> list[Done]:
    """Return every station as it was finished, sorted by name."""
    progress("stations", 0, len(jobs))
    finished = []
    for done in do_stations_on(executor, jobs) if executor else do_stations(jobs, workers):
        finished.append(done)
        progress("stations", len(finished), len(jobs))
    return sorted(finished, key=lambda one: one.station)


def _simulated_pairs(settings: Run, folder: Path, stations: Sequence[xr.Dataset]) -> pd.DataFrame:
    """Return a simulated pair table, written beside the results first and read back like any other."""
    wanted = settings.pairs and settings.pairs.simulated
    if wanted is None:
        assert settings.simulation is not None  # Run demands pairs or a simulation
        wanted = load(settings.simulation, Simulation).pairs
    longitudes = np.array([station["longitude"].item() for station in stations])
    latitudes = np.array([station["latitude"].item() for station in stations])
    with written_whole(folder / "pairs.csv") as part:
        simulated_pairs(longitudes, latitudes, **wanted.model_dump()).to_csv(part, index=False)
    return read_pairs(folder / "pairs.csv")


def _write(
    settings: Run,
    folder: Path,
    stations: Sequence[xr.Dataset],
    table: pd.DataFrame | None,
    rejected: Sequence[Rejection],
) -> list[Path]:
    """Write the results and return their paths."""
    write_rejected(rejected, folder / "rejected.csv")
    outputs = [folder / "rejected.csv"]
    if not stations or table is None:
        return outputs
    spectra = region(stations)
    write_spectra(spectra, folder / "spectra.nc")
    facts = {"name": settings.name, "simulated": str(settings.simulation is not None).lower()}
    write_risk(table, folder, facts)
    outputs += [folder / name for name in ("spectra.nc", "risk.csv", "risk.parquet", "risk.columns.csv")]
    if len(table):
        worst = table.iloc[0]
        (station,) = (one for one in stations if one["station"].item() == worst["station"])
        draw_walk(station, worst, folder / "figures" / "worst_pair.png")
        draw_overview(table, spectra, settings.name, folder / "figures" / "overview.png")
        outputs += [folder / "figures" / name for name in ("worst_pair.png", "overview.png")]
        outputs += write_totals(table, settings.totals.cell, settings.totals.area, folder)
        if settings.geopackage:
            outputs.append(_write_geopackage(table, settings, folder / "risk.gpkg", facts))
    return outputs


def _write_geopackage(table: pd.DataFrame, settings: Run, path: Path, facts: dict[str, str]) -> Path:
    """Write the layer for QGIS with the optional libraries."""
    require_extra("gis", "pyogrio", "shapely")
    from per_obspy.report.gis import write_pairs_layer

    write_pairs_layer([table], list(settings.screening.classes), path, facts)
    return path


def _counts(done: Sequence[Done], table: pd.DataFrame | None, rejected: Sequence[Rejection]) -> dict[str, int]:
    states = [] if table is None else table["state"].tolist()
    return {
        "stations": sum(one.shard is not None for one in done),
        "stations_resumed": sum(one.resumed for one in done),
        "pairs": len(states),
        **{state: states.count(state) for state in ("yes", "possible", "no")},
        **{
            f"rejected_{kind}": sum(one.kind == kind for one in rejected)
            for kind in ("file", "record", "station", "service", "pair")
        },
    }


def _input_hashes(settings: Run, fetched: Fetched | None, configuration: Path) -> dict[str, str]:
    """Return the hash of every input file by its path relative to the configuration."""
    given = [settings.simulation, settings.pairs and settings.pairs.file]
    files = [*input_files(settings.records, fetched), *(path for path in given if path and path.is_file())]
    return {os.path.relpath(path, configuration.parent): file_hash(path) for path in files}


def _hash(content: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _earlier(folder: Path, key: str) -> dict[str, Any] | None:
    """Return the record of an earlier run, if it did the same and its outputs are as it left them."""
    try:
        record: dict[str, Any] = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        intact = all(file_hash(folder / name) == known for name, known in record["outputs"].items())
    except (OSError, ValueError, KeyError):
        return None
    return record if intact and record["key"] == key else None


@contextmanager
def _held(folder: Path) -> Iterator[None]:
    """Hold the output folder; a second run is told who has it."""
    holder = folder / ".holder.json"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(str(folder / ".lock"), timeout=0)
        lock.acquire()
    except Timeout as error:
        raise CatalogError(str(folder), f"another run holds this folder: {_holder(holder)}") from error
    except OSError as error:
        raise CatalogError(str(folder), f"cannot be used as output folder: {error.strerror}") from error
    try:
        said = {
            "process": os.getpid(),
            "host": platform.node(),
            "since": datetime.now(UTC).isoformat(timespec="seconds"),
        }
        holder.write_text(json.dumps(said), encoding="utf-8")
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()


def _holder(path: Path) -> str:
    try:
        said = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return "it does not say which"
    return f"process {said['process']} on {said['host']} since {said['since']}"


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
