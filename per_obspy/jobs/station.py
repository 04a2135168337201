"""
The work of one station, from its files to its shard; stations do not know of each other.

A shard is a netCDF file beside a small JSON file that tells what it was made from and what was left
out on the way. Where that still holds, nothing is done again.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from per_obspy.config import Processing, Spectra
from per_obspy.errors import CatalogError, PerError, Rejection
from per_obspy.files import file_hash, written_whole
from per_obspy.jobs.parallel import results
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


def spectra_shard(
    job: "Job", stream: "Stream", event: "Event | None"
) -> tuple[tuple[Rejection, ...], Facts]:
    """Write the spectra of a station as its shard if any record is usable; return what was left out."""
    clean, unfit = process_station(stream, job.processing, event)
    if clean:
        grid = job.spectra
        periods = np.geomspace(grid.shortest, grid.longest, grid.count)
        dataset = station_spectra(clean, periods, grid.dampings, grid.azimuth_step)
        dataset.attrs["simulated"] = str(job.simulated).lower()
        dataset.attrs |= _hypocentre(event)
        write_spectra(dataset, job.shard)
    return unfit, {}


def _hypocentre(event: "Event | None") -> dict[str, float]:
    """Return where the earthquake started, degrees and m, if that is known."""
    origin = event and (event.preferred_origin() or next(iter(event.origins), None))
    if not origin or None in (origin.longitude, origin.latitude, origin.depth):
        return {}
    return {
        f"hypocentre_{name}": float(origin[name]) for name in ("longitude", "latitude", "depth")
    }


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
    product: "Callable[[Job, Stream, Event | None], tuple[tuple[Rejection, ...], Facts]]" = (
        spectra_shard
    )


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
    parts = [
        version("per_obspy"),
        job.processing.model_dump_json(),
        job.spectra.model_dump_json(),
        job.simulated,
    ]
    parts += [
        f"{path.name} {_content_hash(path)}"
        for path in (*job.source, *([job.event] if job.event else []))
    ]
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
        rejected = tuple(Rejection.stored(one) for one in note["rejected"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return Done(job.station, job.shard if shard else None, rejected, resumed=True)


def earlier_done(note: Path) -> Done:
    """
    Return a station as an earlier run left it, given its note; whether its source has changed is not asked.

    Raises
    ------
    CatalogError
        If the note cannot be read or its shard is not as it was left.
    """
    try:
        known = json.loads(note.read_text(encoding="utf-8"))
        rejected = tuple(Rejection.stored(one) for one in known["rejected"])
        shard = note.with_suffix(".nc") if known["shard"] else None
        intact = shard is None or file_hash(shard) == known["shard"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CatalogError(str(note), f"not the note of a station: {error}") from error
    if not intact:
        raise CatalogError(str(shard), "damaged: not as the run left it")
    return Done(note.stem, shard, rejected, resumed=True)


def do_stations(
    jobs: Sequence[Job], workers: int, executor: Executor | None = None
) -> Iterator[Done]:
    """
    Give every station as it is finished, in parallel; what an earlier run did is not done again.

    Parameters
    ----------
    jobs : sequence of Job
        What to do.
    workers : int
        Number of processes; one, or a single job, needs none but this.
    executor : Executor, optional
        Where to work instead, a cluster for example.
    """
    earlier = [_earlier(job) for job in jobs]
    yield from filter(None, earlier)
    new = [job for job, done in zip(jobs, earlier, strict=True) if not done]
    yield from results(new, do_station, _lost, workers, executor)


def _lost(job: Job, reason: str) -> Done:
    source = ", ".join(path.name for path in job.source)
    return Done(
        job.station,
        None,
        (Rejection("station", job.station, source, None, (reason,)),),
        resumed=False,
    )
