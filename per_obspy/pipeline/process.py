"""The processed records of some sources as files: MiniSEED, the table of their corners, a page a record."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from obspy import Stream
from obspy.core.event import Event

from per_obspy.config import Processing, Spectra
from per_obspy.errors import Rejection
from per_obspy.jobs.station import Done, Facts, Job
from per_obspy.pipeline.spectra import all_done, jobs_of
from per_obspy.processing.chain import process_instruments, process_station
from per_obspy.processing.station.structures import kept_apart
from per_obspy.processing.unprocessed import before_processing
from per_obspy.progress import Progress
from per_obspy.records.events import read_event
from per_obspy.records.processed_files import read_descriptions, write_description, write_processed
from per_obspy.report.records import draw_records
from per_obspy.tables.processed import write_processed_table
from per_obspy.tables.writing import write_rejected

STATIONS, STRUCTURES = "stations", "structures"


class Processed(NamedTuple):
    """
    What became of the records.

    Attributes
    ----------
    done : list of Done
        Every station, sorted by name.
    rejected : tuple of Rejection
        What was left out.
    files : tuple of Path
        Every file for the user to read.
    """

    done: list[Done]
    rejected: tuple[Rejection, ...]
    files: tuple[Path, ...]


def process_records(
    sources: Sequence[Path],
    folder: Path,
    settings: Processing,
    event: Path | None,
    report: bool,
    run: tuple[int, Progress],
) -> Processed:
    """
    Write the processed records of every station in some files and folders.

    Parameters
    ----------
    sources : sequence of Path
        Waveform files, archives, or folders of them with StationXML beside.
    folder : Path
        Gets ``stations/NET.STA.mseed`` with ``.json`` beside, ``structures/`` with the same for
        sensors in structures, ``processed.csv``, ``processed.columns.csv`` and ``rejected.csv``.
        What is still true is not done again.
    settings : Processing
        Every number of the chain.
    event : Path or None
        QuakeML file.
    report : bool
        Whether to draw ``stations/NET.STA.pdf`` as well, one page a record.
    run : (int, callable)
        Number of processes, and what is told of every station.

    Returns
    -------
    Processed

    Raises
    ------
    CatalogError
        If a source is missing or holds no record, or the event cannot be read.
    """
    if event:
        read_event(event)  # a wrong file stops everything here, not every station
    jobs, unread = jobs_of(sources, folder / STATIONS, settings, Spectra())
    product = drawn_records_shard if report else records_shard
    jobs = [
        job._replace(event=event, shard=job.shard.with_suffix(".mseed"), product=product)
        for job in jobs
    ]
    for job in jobs:
        if report and not job.shard.with_suffix(".pdf").exists():
            job.shard.with_suffix(".json").unlink(missing_ok=True)  # its station is not whole
    done, rejected = all_done(jobs, unread, *run)
    records = _records(jobs)
    told = {path.relative_to(folder).as_posix(): read_descriptions(path) or [] for path in records}
    write_processed_table(told, folder)
    write_rejected(rejected, folder / "rejected.csv")
    tables = [folder / name for name in ("processed.csv", "processed.columns.csv", "rejected.csv")]
    return Processed(done, rejected, (*tables, *records))


def _records(jobs: Sequence[Job]) -> list[Path]:
    """Return the MiniSEED files that these jobs left, those of structures last."""
    places = [job.shard for job in jobs], [_structure(job) for job in jobs]
    return [path for paths in places for path in paths if path.exists()]


def _structure(job: Job) -> Path:
    """Return where the records of a station's sensors in structures go."""
    return job.shard.parent.with_name(STRUCTURES) / job.shard.name


def records_shard(
    job: Job, stream: Stream, event: Event | None
) -> tuple[tuple[Rejection, ...], Facts]:
    """Write the processed records of a station as its shard, and those of structures beside; see `spectra_shard`."""
    clean, unfit = process_station(stream, job.processing, event)
    return (*unfit, *_write_structure(job, stream, event)), _write_shard(job, clean)


def drawn_records_shard(
    job: Job, stream: Stream, event: Event | None
) -> tuple[tuple[Rejection, ...], Facts]:
    """Do as :func:`records_shard`, and draw a page a record."""
    clean, unfit = process_station(stream, job.processing, event)
    if clean:
        pages = ((trace, before_processing(stream, trace, job.processing)) for trace in clean)
        draw_records(pages, job.shard.with_suffix(".pdf"))
    return (*unfit, *_write_structure(job, stream, event)), _write_shard(job, clean)


def _write_shard(job: Job, clean: Stream) -> Facts:
    return write_processed(clean, job.shard) if clean else {}


def _write_structure(job: Job, stream: Stream, event: Event | None) -> tuple[Rejection, ...]:
    """Write what the sensors in structures recorded, every instrument; return what of it was left out."""
    path = _structure(job)
    path.unlink(missing_ok=True)
    apart, lost = process_instruments(kept_apart(stream)[1], job.processing, event)
    if built := Stream([trace for traces in apart for trace in traces]):
        write_description(path, write_processed(built, path))
    return lost
