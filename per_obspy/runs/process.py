"""Processed records as files: MiniSEED, the table of filter corners, one page per record."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from obspy import Stream

from per_obspy.config import Engine, Processing, Spectra
from per_obspy.errors import Rejection
from per_obspy.files import remove_dead_parts, remove_file
from per_obspy.processing.account import taken
from per_obspy.processing.chain import before_processing, process_instruments, process_station
from per_obspy.processing.components import split_structures
from per_obspy.processing.earthquake import Source
from per_obspy.records.earthquakes.quakeml import read_event_file
from per_obspy.records.processed_files import read_descriptions, write_description, write_processed
from per_obspy.records.sources import find_path_sources
from per_obspy.report.records import draw_records
from per_obspy.report.spectra import draw_spectra, draw_state_space
from per_obspy.results.station_summary import write_processed_table
from per_obspy.results.table_files import write_rejected
from per_obspy.runs.stations import all_rejections, finished_stations, station_tasks
from per_obspy.runs.tasks.executor import opened_executor
from per_obspy.runs.tasks.parallel import Workers
from per_obspy.runs.tasks.station import FinishedStation, Products, StationTask
from per_obspy.spectra.storage import read_spectra, region, write_spectra

STATIONS, STRUCTURES = "stations", "structures"


class Processed(NamedTuple):
    """Result of processing the records of some sources."""

    #: Every station, sorted by name.
    done: list[FinishedStation]
    #: Rejected inputs, each with its reasons.
    rejected: tuple[Rejection, ...]
    #: Every file for the user to read.
    files: tuple[Path, ...]


def process_records(
    sources: Sequence[Path],
    folder: Path,
    settings: Processing,
    event: Path | None,
    report: bool,
    workers: Workers,
) -> Processed:
    """
    Write the processed records of every station in some files and folders.

    Parameters
    ----------
    sources : sequence of Path
        Waveform files, archives, or folders of them with StationXML.
    folder : Path
        Gets ``stations/NET.STA.mseed`` and ``.json``, ``structures/`` with the same for sensors
        in structures, ``processed.csv``, ``processed.columns.csv`` and ``rejected.csv``.
        Files that are still valid are not written again.
    settings : Processing
        Every number of the chain.
    event : Path or None
        QuakeML file.
    report : bool
        Whether to draw ``stations/NET.STA.pdf`` as well, one page per record.
    workers : Workers
        Where to work.

    Raises
    ------
    CatalogError
        If a source is missing or holds no record, or the event cannot be read.
    """
    # A wrong event stops everything here, not every station
    earthquake = read_event_file(event) if event else None
    remove_dead_parts(folder)
    found = find_path_sources(sources)
    product = drawn_records_shard if report else records_shard
    tasks = [
        replace(task, shard=task.shard.with_suffix(".mseed"), product=product)
        for task in station_tasks(
            found.stations, folder / STATIONS, settings, Spectra(), event=earthquake
        )
    ]
    with opened_executor(Engine(), workers, folder) as used:
        done = finished_stations(tasks, used)

    # Tables of all records
    rejected = all_rejections(found.rejected, done)
    records = _records(tasks)
    descriptions = {
        path.relative_to(folder).as_posix(): read_descriptions(path) or [] for path in records
    }
    write_processed_table(descriptions, folder)
    write_rejected(rejected, folder / "rejected.csv")
    tables = [folder / name for name in ("processed.csv", "processed.columns.csv", "rejected.csv")]
    return Processed(done, tuple(rejected), (*tables, *records))


def _records(tasks: Sequence[StationTask]) -> list[Path]:
    """Return the MiniSEED files of finished tasks, those of structures last."""
    shards = [task.shard for task in tasks]
    structures = [_structure(task) for task in tasks]
    return [path for path in (*shards, *structures) if path.exists()]


def _structure(task: StationTask) -> Path:
    """Return the path for the records of a station's sensors in structures."""
    return task.shard.parent.with_name(STRUCTURES) / task.shard.name


def records_shard(task: StationTask, stream: Stream, source: Source | None) -> Products:
    """Write the processed records of a station as its station file, structures in another file."""
    ground, structure = split_structures(taken(stream))
    clean, unfit = process_station(chain(taken(ground), structure), task.processing, source)
    return _write_records(task, clean, unfit, _write_structure(task, structure, source))


def drawn_records_shard(task: StationTask, stream: Stream, source: Source | None) -> Products:
    """Write the station file as :func:`records_shard` does, and draw one page per record."""
    clean, unfit = process_station(stream, task.processing, source)
    # Each page shows a record before and after
    pages = task.shard.with_suffix(".pdf")
    if clean:
        traces = ((trace, before_processing(stream, trace, task.processing)) for trace in clean)
        draw_records(traces, pages)
    _, structure = split_structures(stream)
    products = _write_records(task, clean, unfit, _write_structure(task, structure, source))
    return products._replace(files=(*products.files, pages)) if clean else products


def _write_records(
    task: StationTask, clean: Stream, unfit: Sequence[Rejection], structure: Products
) -> Products:
    """Write the usable records of a station as its station file; return all its products."""
    rejected = (*unfit, *structure.rejected)
    if not clean:
        return Products(rejected, structure.files)
    facts = write_processed(clean, task.shard)
    return Products(rejected, (task.shard, *structure.files), facts)


def _write_structure(task: StationTask, structure: Stream, source: Source | None) -> Products:
    """Write the records of all sensors in structures, and empty the stream."""
    path = _structure(task)
    remove_file(path)
    instruments, rejected = process_instruments(taken(structure), task.processing, source)
    # All instruments in one file
    built = Stream([trace for traces in instruments for trace in traces])
    if not built:
        return Products(rejected)
    write_description(path, write_processed(built, path))
    return Products(rejected, (path, path.with_suffix(".json")))


def spectra_of(
    sources: Sequence[Path],
    output: Path,
    processing: Processing,
    grid: Spectra,
    workers: Workers,
) -> tuple[list[FinishedStation], tuple[Rejection, ...]]:
    """
    Write the spectra of every station in some files and folders into one netCDF file.

    Parameters
    ----------
    sources : sequence of Path
        Waveform files, archives, or folders of them with StationXML.
    output : Path
        netCDF file. The folder of the same name with ``.stations`` keeps the station files; valid
        ones are not computed again. Rejections are written to ``.rejected.csv``.
    processing, grid : Processing, Spectra
        Settings.
    workers : Workers
        Where to work.

    Raises
    ------
    CatalogError
        If a source is missing or holds no record.
    """
    shards = output.with_suffix(".stations")
    remove_dead_parts(shards)
    found = find_path_sources(sources)
    tasks = station_tasks(found.stations, shards, processing, grid)
    with opened_executor(Engine(), workers, output.absolute().parent) as used:
        done = finished_stations(tasks, used)
    rejected = all_rejections(found.rejected, done)
    write_rejected(rejected, output.with_suffix(".rejected.csv"))
    # The file of the region needs a station with usable records
    spectra = [station.spectra for station in done if station.spectra is not None]
    if spectra:
        write_spectra(region(spectra), output)
    return done, tuple(rejected)


def plot_station(shard: Path, damping: float, period: float, folder: Path) -> tuple[Path, Path]:
    """
    Draw the spectra of a station, and the state space of one oscillator along the stronger motion.

    Parameters
    ----------
    shard : Path
        From :func:`spectra_of`.
    damping, period : float
        Of the oscillator, fraction of critical; s.
    folder : Path
        Where the two PNG files go.
    """
    station = read_spectra(shard)
    # The name of the station file lacks the dot of a missing network, which would hide it
    name = shard.stem
    spectra, state_space = folder / f"{name}.spectra.png", folder / f"{name}.state_space.png"
    draw_spectra(station, damping, spectra)
    draw_state_space(station, period, damping, state_space)
    return spectra, state_space
