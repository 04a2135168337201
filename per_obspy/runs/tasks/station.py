"""
Work on one station, from its records to its station file, independent of other stations.

A station file is a netCDF file; its status file (:mod:`per_obspy.resume`) of the same name also
holds the rejections and the decisions that depend on the earthquake. A station for which both are
complete is not done again; one that another earthquake leaves as it is gets the new hypocentre.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from per_obspy.config import Processing, Spectra
from per_obspy.errors import CatalogError, PerError, Rejection, TryLater, WrongOutput
from per_obspy.files import bytes_hash, file_hash, remove_file
from per_obspy.machine import raise_machine_fault
from per_obspy.processing.account import taken
from per_obspy.processing.chain import process_station
from per_obspy.processing.earthquake import Source, same_decisions, source_of
from per_obspy.records.earthquakes.quakeml import EventFile, portable
from per_obspy.records.folder import read_station
from per_obspy.records.metadata import metadata_text
from per_obspy.resume import Status, StatusError, changed_outputs, read_status, write_status
from per_obspy.runs.tasks.parallel import Resumable
from per_obspy.spectra.station import station_spectra
from per_obspy.spectra.storage import read_spectra, without_motion, write_spectra

if TYPE_CHECKING:
    from obspy import Inventory, Stream


def hypocentre_attributes(file: EventFile | None) -> dict[str, float]:
    """Return the hypocentre as attributes of a station file, degrees and m; empty if unknown."""
    if file is None:
        return {}
    origin = file.event.preferred_origin() or next(iter(file.event.origins), None)
    if not origin or None in (origin.longitude, origin.latitude, origin.depth):
        return {}
    return {
        f"hypocentre_{name}": float(origin[name]) for name in ("longitude", "latitude", "depth")
    }


def source_of_job(event: EventFile | None, decisions: list[dict[str, Any]]) -> Source | None:
    """Return the earthquake for the processing, which collects its decisions; None without one."""
    if event is None or not event.event.origins:
        return None
    return source_of(event.event, decisions)


def source_facts(event: EventFile | None) -> dict[str, object] | None:
    """Return everything of an earthquake that can change a station, as plain values."""
    if event is None:
        return None
    source = source_of(event.event)
    return {
        "time": source.time.ns,
        "place": [source.latitude, source.longitude, source.depth],
        "magnitude": source.magnitude,
        "hypocentre": hypocentre_attributes(event),
    }


def is_of_event(status: Mapping[str, Any], event: EventFile, processing: Processing) -> bool:
    """Return whether the motion of a station is that which an earthquake gives."""
    decisions = status.get("decisions")
    if not isinstance(decisions, list) or not isinstance(status.get("source"), dict):
        return False
    return same_decisions(decisions, source_of(event.event), processing)


def moved_shard(shard: Path, before: Mapping[str, Any], event: EventFile) -> bool:
    """
    Write the hypocentre of an earthquake into a station file unless it is there.

    Parameters
    ----------
    shard : Path
        Whole station file.
    before : mapping
        From :func:`source_facts`, of the earthquake for which it was written.
    event : EventFile
        The earthquake now.

    Returns
    -------
    is_possible : bool
        False if one of both hypocentres is unknown: that of the headers is in its place.
    """
    known, new = before.get("hypocentre"), hypocentre_attributes(event)
    if known == new:
        return True
    if not known or not new:
        return False
    dataset = read_spectra(shard, shard.read_bytes()).drop_encoding()
    dataset.attrs |= new
    write_spectra(dataset, shard)
    return True


#: Suffix of a station file with spectra.
SPECTRA = ".nc"


class Products(NamedTuple):
    """Files made of the records of a station."""

    #: Rejected inputs, each with its reasons.
    rejected: tuple[Rejection, ...]
    #: The station file and all files written with it; empty without a usable record.
    files: tuple[Path, ...] = ()
    #: Plain values that the status file holds besides.
    facts: Mapping[str, object] = MappingProxyType({})
    #: Content of a station file with spectra, without the motion.
    spectra: xr.Dataset | None = None


def spectra_shard(task: "StationTask", stream: "Stream", source: "Source | None") -> Products:
    """Write the spectra of a station as its station file if any record is usable."""
    clean, unfit = process_station(taken(stream), task.processing, source)
    if not clean:
        return Products(unfit)
    # Spectra at periods in equal steps of their logarithm
    grid = task.spectra
    periods = np.geomspace(grid.shortest, grid.longest, grid.count)
    dataset = station_spectra(clean, periods, grid.dampings, grid.azimuth_step)
    dataset.attrs |= hypocentre_attributes(task.event)
    write_spectra(dataset, task.shard)
    return Products(unfit, (task.shard,), spectra=without_motion(dataset))


class FinishedStation(NamedTuple):
    """Result of a station."""

    #: ``NETWORK.STATION``.
    station: str
    #: Its Dataset; None if no usable record was left.
    shard: Path | None
    #: Rejected inputs, each with its reasons.
    rejected: tuple[Rejection, ...]
    #: Whether an earlier run had processed it.
    resumed: bool
    #: Of the station file; empty if there is none.
    hash: str = ""
    #: Content of a station file without the motion, so that no later stage reads it again.
    spectra: xr.Dataset | None = None
    #: Whether its work failed unexpectedly, so that the next run does it again.
    failed: bool = False


#: Reader of plain files.
READ = partial(read_station)


@dataclass(frozen=True, kw_only=True)
class StationTask(Resumable[FinishedStation]):
    """One station, from its records to its station file."""

    #: ``NETWORK.STATION``.
    station: str
    #: Its waveform files.
    source: tuple[Path, ...]
    #: Its metadata.
    inventory: "Inventory | None"
    #: The earthquake.
    event: EventFile | None
    #: Settings.
    processing: Processing
    spectra: Spectra
    #: Where its Dataset goes.
    shard: Path
    #: Of the waveform files.
    hashes: tuple[str, ...] = ()
    #: How its files are read: ``(files, inventory, station) -> (Stream, rejections)``.
    reader: "partial[tuple[Stream, tuple[Rejection, ...]]]" = READ
    #: Function that makes the files from the records: see :func:`spectra_shard`.
    product: "Callable[[StationTask, Stream, Source | None], Products]" = spectra_shard
    #: Hash of all inputs of the station file but the earthquake; empty until it is computed.
    key: str = ""

    @property
    def name(self) -> str:
        """Network and station."""
        return f"station {self.station}"

    @property
    def status(self) -> Path:
        """Status file of the station."""
        return self.shard.with_suffix(".json")

    def with_key(self) -> "StationTask":
        """Return the task with its key, and with an event that can be sent to other processes."""
        return replace(self, key=_key(self), event=self.event and portable(self.event))

    def earlier(self) -> FinishedStation | None:
        """Return the station of an earlier run if its inputs are the same and its files whole."""
        status = _known_status(self)
        if status is None or status.get("source") != source_facts(self.event):
            return None
        return _whole_station(self.station, self.shard, status)

    def do(self) -> FinishedStation:
        """Write the station file and its status file, and return the finished station."""
        if known := _unchanged_by_event(self):
            return known
        # Whatever an earlier run has left is of other inputs
        remove_file(self.shard)
        decisions = list[dict[str, Any]]()
        products = _products(self, decisions)
        has_shard = self.shard in products.files
        digest = file_hash(self.shard) if has_shard else ""
        # The status comes last: it is valid for whole files only
        others = [file for file in products.files if file != self.shard]
        outputs = {_from_status(self.shard, file): file_hash(file) for file in others}
        outputs |= {self.shard.name: digest} if has_shard else {}
        facts = {"shard": digest or None, "rejected": products.rejected, **products.facts}
        facts |= {"source": source_facts(self.event), "decisions": decisions}
        write_status(self.status, self.key, outputs, facts)
        shard = self.shard if has_shard else None
        return FinishedStation(
            self.station, shard, products.rejected, False, digest, products.spectra
        )

    def failed(self, reason: str) -> FinishedStation:
        """Return the station after a failure; the next run repeats it."""
        rejection = Rejection("station", self.station, self.file_names, None, (reason,))
        return FinishedStation(self.station, None, (rejection,), resumed=False, failed=True)

    @property
    def file_names(self) -> str:
        """Names of the station's files, as rejections give them."""
        return ", ".join(path.name for path in self.source)


def _unchanged_by_event(task: StationTask) -> FinishedStation | None:
    """
    Return the station of an earlier run for whose processing the earthquake is the same, else None.

    Its files get the facts of the earthquake now.
    """
    status = _known_status(task)
    if status is None or task.event is None:
        return None
    is_same = is_of_event(status, task.event, task.processing)
    if not is_same or _whole_station(task.station, task.shard, status) is None:
        return None
    # The hypocentre is part of a station file with spectra
    shard = status["shard"]
    if shard and task.shard.suffix == SPECTRA:
        if not moved_shard(task.shard, status["source"], task.event):
            return None
        shard = file_hash(task.shard)
    # As if the station had been done with this earthquake at first
    outputs = {**status["outputs"], **({task.shard.name: shard} if shard else {})}
    rest = {name: fact for name, fact in status.items() if name not in ("key", "outputs")}
    facts = {**rest, "shard": shard, "source": source_facts(task.event)}
    status = write_status(task.status, task.key, outputs, facts)
    return _whole_station(task.station, task.shard, status)


def _products(task: StationTask, decisions: list[dict[str, Any]]) -> Products:
    """Read the records of a station and make its products; an unusable station is a rejection."""
    try:
        stream, unread = task.reader(task.source, task.inventory, task.station)
        products = task.product(task, stream, source_of_job(task.event, decisions))
    except (TryLater, WrongOutput):
        raise  # no property of the station
    except PerError as error:
        raise_machine_fault(error)
        reasons = getattr(error, "reasons", None) or (str(error),)
        rejection = Rejection("station", task.station, task.file_names, None, tuple(reasons))
        return Products((rejection,))
    # Records that name no file came from all files of the station
    unfit = [
        row if row.source else row._replace(source=task.file_names) for row in products.rejected
    ]
    return products._replace(rejected=(*unread, *unfit))


def _read_shard(shard: Path, expected: str) -> tuple[str, xr.Dataset | None]:
    """Return hash and spectra of a station file, opened once; no spectra if its hash differs."""
    if shard.suffix != SPECTRA:
        return file_hash(shard), None
    content = shard.read_bytes()
    digest = bytes_hash(content)
    if digest != expected:
        return digest, None
    return digest, without_motion(read_spectra(shard, content))


def _from_status(shard: Path, file: Path) -> str:
    """Return the path of an output relative to the folder of the status file."""
    return Path(os.path.relpath(file, shard.parent)).as_posix()


def _key(task: StationTask) -> str:
    """Return the hash of all inputs of the products of a station but the earthquake."""
    settings = [task.processing.model_dump_json(), task.spectra.model_dump_json()]
    files = [f"{path.name} {digest}" for path, digest in zip(task.source, task.hashes, strict=True)]
    files += ["with an earthquake"] if task.event else []
    # Reader and product are known by name, so that other processes find the same
    steps = [task.reader.func.__name__, task.reader.keywords, task.product.__name__]
    metadata = [metadata_text(task.inventory)] if task.inventory else []
    parts = [version("per_obspy"), *settings, *files, *steps, *metadata]
    return bytes_hash("\n".join(map(str, parts)).encode())


def _known_status(task: StationTask) -> Status | None:
    """Return the status of a station if its key is the same; None if it is not or is damaged."""
    try:
        status = read_status(task.status)
        _stored_rejections(status)
    except StatusError:
        return None
    return status if status["key"] == task.key else None


def _whole_station(name: str, shard: Path, status: Status) -> FinishedStation | None:
    """Return a resumed station with hash and spectra of its file; None if an output has changed."""
    station = FinishedStation(name, shard, _stored_rejections(status), True)
    outputs = dict(status["outputs"])
    known = outputs.pop(shard.name, "")
    if changed_outputs(shard.with_suffix(".json"), {**status, "outputs": outputs}):
        return None
    if not known:
        return station._replace(shard=None)
    # The station file is opened once: for its hash, and for its spectra if it has not changed
    try:
        digest, spectra = _read_shard(shard, known)
    except OSError:
        return None
    return station._replace(hash=digest, spectra=spectra) if digest == known else None


def _stored_rejections(status: Status) -> tuple[Rejection, ...]:
    """Return the rejections that a status holds; raise ``StatusError`` if it is no station's."""
    try:
        return tuple(map(Rejection.stored, status["rejected"]))
    except (KeyError, TypeError, ValueError) as error:
        raise StatusError(f"{type(error).__name__}: {error}") from error


def earlier_station(status_file: Path) -> FinishedStation:
    """
    Return the station of an earlier run, even if its source has changed since.

    Raises
    ------
    CatalogError
        If the status file cannot be read, or the station file has changed.
    """
    shard = status_file.with_suffix(SPECTRA)
    try:
        status = read_status(status_file)
        station = _whole_station(status_file.stem, shard, status)
    except StatusError as error:
        raise CatalogError(str(status_file), f"not the note of a station: {error}") from error
    if station is None:
        raise CatalogError(str(shard), "damaged: changed since the run wrote it")
    return station
