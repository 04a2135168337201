"""
The work of one station, from its files to its shard; stations do not know of each other.

A shard is a netCDF file beside a small JSON file that tells what it was made from and what was left out on the way.
Where that still holds, nothing is done again.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from functools import partial
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from per_obspy.config import Processing, Spectra
from per_obspy.errors import PerError, Rejection
from per_obspy.files import file_hash, written_whole
from per_obspy.processing.chain import process_station
from per_obspy.records.archives import open_file
from per_obspy.records.events import read_event
from per_obspy.records.folder import read_station
from per_obspy.records.metadata import metadata_text
from per_obspy.spectra.station import station_spectra
from per_obspy.spectra.storage import write_spectra

if TYPE_CHECKING:
    from obspy import Inventory, Stream
    from obspy.core.event import Event

#: What the note of a shard tells of it beside its origin.
Facts = dict[str, object]


def spectra_shard(job: "Job", stream: "Stream", event: "Event | None") -> tuple[tuple[Rejection, ...], Facts]:
    """Write the spectra of a station as its shard if any record is usable; return what was left out."""
    clean, unfit = process_station(stream, job.processing, event)
    if clean:
        grid = job.spectra
        periods = np.geomspace(grid.shortest, grid.longest, grid.count)
        dataset = station_spectra(clean, periods, grid.dampings, grid.azimuth_step)
        dataset.attrs["simulated"] = str(job.simulated).lower()
        write_spectra(dataset, job.shard)
    return unfit, {}


class Job(NamedTuple):
    """
    One station to do.

    Attributes
    ----------
    station : str
        ``NETWORK.STATION``.
    source : tuple of Path
        Its waveform files.
    inventory : Inventory or None
        Its metadata.
    event : Path or None
        QuakeML file or ASDF workspace.
    processing, spectra : Processing, Spectra
        Settings.
    shard : Path
        Where its Dataset goes.
    simulated : bool
        Whether the motion was made by a scenario.
    reader : partial
        How its files are read: ``(files, inventory, station) -> (Stream, rejections)``.
    product : callable
        What is made of the records that were read: see :func:`spectra_shard`.
    """

    station: str
    source: tuple[Path, ...]
    inventory: "Inventory | None"
    event: Path | None
    processing: Processing
    spectra: Spectra
    shard: Path
    simulated: bool
    reader: "partial[tuple[Stream, tuple[Rejection, ...]]]" = partial(read_station)
    product: "Callable[[Job, Stream, Event | None], tuple[tuple[Rejection, ...], Facts]]" = spectra_shard


class Done(NamedTuple):
    """
    What became of a station.

    Attributes
    ----------
    station : str
        ``NETWORK.STATION``.
    shard : Path or None
        Its Dataset; None if nothing usable was left.
    rejected : tuple of Rejection
        What was left out, with every reason.
    resumed : bool
        Whether an earlier run had done it.
    """

    station: str
    shard: Path | None
    rejected: tuple[Rejection, ...]
    resumed: bool


def do_station(job: Job) -> Done:
    """Return the finished station, its shard and the note that tells what it was made from on disk."""
    job.shard.unlink(missing_ok=True)
    rejected, facts = _make_shard(job)
    shard = job.shard if job.shard.exists() else None
    note = {"key": _key(job), "shard": shard and file_hash(shard), "rejected": rejected, **facts}
    with written_whole(job.shard.with_suffix(".json")) as part:
        part.write_text(json.dumps(note), encoding="utf-8")
    return Done(job.station, shard, rejected, resumed=False)


def _make_shard(job: Job) -> tuple[tuple[Rejection, ...], Facts]:
    """Write the shard if anything usable is left; return what was left out, and what its note is to tell."""
    source = ", ".join(path.name for path in job.source)
    try:
        stream, unread = job.reader(job.source, job.inventory, job.station)
        event = read_event(job.event) if job.event else None
        unfit, facts = job.product(job, stream, event)
    except PerError as error:
        reasons = getattr(error, "reasons", None) or (str(error),)
        return (Rejection("station", job.station, source, None, tuple(reasons)),), {}
    return (*unread, *(one._replace(source=one.source or source) for one in unfit)), facts


def _key(job: Job) -> str:
    """Return the hash of everything the shard depends on."""
    parts = [version("per_obspy"), job.processing.model_dump_json(), job.spectra.model_dump_json(), job.simulated]
    parts += [f"{path.name} {_content_hash(path)}" for path in (*job.source, *([job.event] if job.event else []))]
    parts += [job.reader.func.__name__, job.reader.keywords, job.product.__name__]
    parts += [metadata_text(job.inventory)] if job.inventory else []
    return hashlib.sha256("\n".join(map(str, parts)).encode()).hexdigest()


def _content_hash(path: Path) -> str:
    """Return the hash of a file, or of a member of an archive."""
    with open_file(path) as file:
        return hashlib.sha256(file.read()).hexdigest()


def _earlier(job: Job) -> Done | None:
    """Return the station as an earlier run left it, if it was made from the same and is undamaged."""
    try:
        note = json.loads(job.shard.with_suffix(".json").read_text(encoding="utf-8"))
        shard = file_hash(job.shard) if job.shard.exists() else None
        if note["key"] != _key(job) or note["shard"] != shard:
            return None
        rejected = tuple(
            Rejection(kind, name, source, row, tuple(reasons)) for kind, name, source, row, reasons in note["rejected"]
        )
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return Done(job.station, job.shard if shard else None, rejected, resumed=True)


def do_stations(jobs: Sequence[Job], workers: int) -> Iterator[Done]:
    """
    Give every station as it is finished, in parallel processes; what an earlier run did is not done again.

    The first is waited for, so that one worker compiles and the others load. A worker that dies takes the whole pool
    with it. What was not finished then is done again, each station in a process of its own, so that only the guilty
    one is lost, and its loss is a rejection.

    Parameters
    ----------
    jobs : sequence of Job
        What to do.
    workers : int
        Number of processes; one, or a single job, needs none but this.
    """
    unfinished = {job.station: job for job in jobs}
    if min(workers, len(jobs)) <= 1:
        yield from (_earlier(job) or _caught(job, partial(do_station, job)) for job in jobs)
        return
    with _pool(workers) as pool, suppress(BrokenProcessPool):
        for some in (jobs[:1], jobs[1:]):
            for done in do_stations_on(pool, some):
                del unfinished[done.station]
                yield done
    for job in unfinished.values():
        try:
            with _pool(1) as pool:
                yield from do_stations_on(pool, [job])
        except BrokenProcessPool:
            yield _lost(job, "its worker process died")


def do_stations_on(executor: Executor, jobs: Sequence[Job]) -> Iterator[Done]:
    """Give every station as it is finished, on any executor (a cluster's, for example)."""
    earlier = [_earlier(job) for job in jobs]
    yield from filter(None, earlier)
    futures = {executor.submit(do_station, job): job for job, done in zip(jobs, earlier, strict=True) if not done}
    for future in as_completed(futures):
        yield _caught(futures[future], future.result)


def _pool(workers: int) -> ProcessPoolExecutor:
    """Return fresh processes: a fork of a process that has threads can hang."""
    return ProcessPoolExecutor(workers, mp_context=get_context("spawn"))


def _caught(job: Job, work: Callable[[], Done]) -> Done:
    """Return what the work returns; whatever it raises becomes a reason, so that no station stops the others."""
    try:
        return work()
    except BrokenProcessPool:
        raise
    except Exception as error:  # noqa: BLE001 - where a worker returns, nothing may be lost
        return _lost(job, f"{type(error).__name__}: {error}")


def _lost(job: Job, reason: str) -> Done:
    source = ", ".join(path.name for path in job.source)
    return Done(job.station, None, (Rejection("station", job.station, source, None, (reason,)),), resumed=False)
