"""
A folder of records: every file that ObsPy and its plugins understand.

StationXML may be in the same folder or elsewhere.
"""

import os
import stat
from collections.abc import Iterable, Mapping
from functools import reduce
from itertools import chain
from operator import add
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import obspy
from obspy import Inventory, Stream, Trace, UTCDateTime

from per_obspy.config import Archives
from per_obspy.errors import CatalogError, NothingUsable, RecordRejected, Rejection, reason_of
from per_obspy.files import bytes_hash, is_part
from per_obspy.formats.text.station_table import (
    StationRow,
    is_station_table,
    located_stations,
    marked_open_starts,
    read_station_table,
    with_open_starts,
)
from per_obspy.machine import raise_machine_fault
from per_obspy.processing.notes import taken
from per_obspy.records.archives import IRREGULAR, LIMITS, archive_files, is_archive, read_file
from per_obspy.records.earthquakes.groups import RecordSpan, record_span, station_files
from per_obspy.records.metadata import with_metadata
from per_obspy.records.obspy_readers import read_bytes_with_obspy, read_content
from per_obspy.records.processed_files import described

#: words at the beginning of StationXML, FDSN station text, QuakeML and descriptions of processed
#: records -> kind of file
_MARKS = {
    b"<FDSNStationXML": "inventory",
    b"#Network": "station text",
    b"quakeml": "event",
    b'"shard": ': "description",
}

#: Kinds of files that describe stations.
_METADATA = ("inventory", "station text", "station table")

#: unit of a series -> its quantity, for the integrals of acceleration
_INTEGRALS = {"m/s": "velocity", "m": "displacement"}


class SourceContents(NamedTuple):
    """
    Stations, metadata and unusable files of a source of records.

    Attributes
    ----------
    stations : dict
        ``"NET.STA"`` -> the files that hold records of the station, sorted; files in an archive as
        if it were a folder.
    inventory : Inventory or None
        All StationXML, merged; None if there is none.
    rejected : tuple of Rejection
        Files that are neither records nor metadata, each with its reason.
    hashes : mapping of Path to str
        Hash of every file that was read on the way.
    records : tuple of RecordSpan
        Times of the records, where their headers were read.
    """

    stations: dict[str, tuple[Path, ...]]
    inventory: Inventory | None
    rejected: tuple[Rejection, ...]
    hashes: Mapping[Path, str] = MappingProxyType({})
    records: tuple[RecordSpan, ...] = ()


def find_stations(
    folder: str | Path, stationxml: str | Path | None = None, limits: Archives = LIMITS
) -> SourceContents:
    """
    Find the stations that have records in a folder and its subfolders, from headers only.

    Parameters
    ----------
    folder : str or Path
        Any mixture of waveform files, in archives too, or a single file; StationXML among them is
        used, QuakeML is passed over.
    stationxml : str or Path, optional
        A StationXML file, or a folder of them, in addition. FDSN station text or a table of
        stations (CSV) does where only coordinates are missing.
    limits : Archives
        What archives may unpack to.

    Raises
    ------
    CatalogError
        If the folder or file is missing, a file is no record, or the named StationXML cannot be
        read.
    NothingUsable
        If the folder is empty or without any record.
    """
    files, rejected = _files(Path(folder), limits)
    found = [_read_file(path, limits) for path in files]
    records = tuple(chain.from_iterable(file.records for file in found))
    # Metadata that is named comes before that of the folder
    inventories, rows = _named_metadata(None if stationxml is None else Path(stationxml))
    inventories += [file.inventory for file in found if file.inventory is not None]
    rows += chain.from_iterable(file.rows for file in found)
    # Unusable records come before unusable metadata
    for kind in ("record", *_METADATA):
        rejected += [file.rejection for file in found if file.kind == kind and file.rejection]
    if not records:
        # A folder without records may fill up; a file that was named should have been one
        nothing = NothingUsable if Path(folder).is_dir() else CatalogError
        raise nothing(str(folder), _nothing_found(files, rejected))
    stations = station_files(records)
    # Tables of coordinates serve the stations that have records
    if rows:
        inventories.append(located_stations(rows, stations))
    return SourceContents(
        stations,
        merged_inventory(inventories),
        tuple(rejected),
        {file.path: file.hash for file in found if file.hash},
        records,
    )


class _File(NamedTuple):
    """A file of a folder: hash, kind, and its records, its metadata or the reason for neither."""

    path: Path
    hash: str = ""
    kind: str = "record"
    records: tuple[RecordSpan, ...] = ()
    inventory: Inventory | None = None
    rows: tuple[StationRow, ...] = ()
    rejection: Rejection | None = None


def _read_file(path: Path, limits: Archives) -> _File:
    """Read a file of a folder once: its hash, and the headers of its records or its metadata."""
    # Bytes are read once and serve the hash as well
    file = _File(path)
    try:
        content = read_file(path, limits)
        # Hash, headers and metadata come from the same bytes
        file = file._replace(hash=bytes_hash(content), kind=_kind(path, content))
        if file.kind == "record":
            stream = _traces(path, content, headonly=True)
            return file._replace(records=tuple(record_span(trace, path) for trace in stream))
        if file.kind == "inventory":
            inventory = read_content(obspy.read_inventory, content, path)
            return file._replace(inventory=inventory)
        if file.kind == "station text":
            return file._replace(inventory=_read_station_text(path, content))
        if file.kind == "station table":
            return file._replace(rows=read_station_table(str(path), content))
    except RecordRejected as rejection:
        return file._replace(rejection=_rejected_file(path, rejection))
    return file


def _named_metadata(path: Path | None) -> tuple[list[Inventory], list[StationRow]]:
    """Return the descriptions of stations, or the rows of a table of them, that a user named."""
    if path is None:
        return [], []
    # A table that the user named must be right
    try:
        if path.is_file() and _kind(path, content := read_file(path)) == "station table":
            return [], [*read_station_table(str(path), content)]
    except RecordRejected as rejection:
        raise CatalogError(str(path), "; ".join(rejection.reasons)) from rejection
    return read_inventories(path), []


def _kind(path: Path, content: bytes) -> str:
    """Return the kind of a file: a kind of metadata, event, description, or else record."""
    start = content[:1000]
    if path.suffix.lower() == ".csv" and is_station_table(start):
        return "station table"
    return next((kind for mark, kind in _MARKS.items() if mark in start), "record")


def _traces(path: Path, content: bytes, **options: Any) -> Stream:
    """Return the traces of a file that has been opened already."""
    if not content:
        raise RecordRejected(str(path), "the file is empty")
    return described(read_content(obspy.read, content, path, **options), path, content)


def station_name(trace: Trace) -> str:
    """Return ``"NET.STA"`` of a trace."""
    return f"{trace.stats.network}.{trace.stats.station}"


def read_station(
    paths: Iterable[Path],
    inventory: Inventory | None,
    station: str | None = None,
    start: UTCDateTime | None = None,
    end: UTCDateTime | None = None,
    limits: Archives = LIMITS,
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Read the files of one station, with coordinates, orientation and response attached.

    Parameters
    ----------
    paths : iterable of Path
        From ``SourceContents.stations``.
    inventory : Inventory or None
        From ``SourceContents.inventory``.
    station : str, optional
        ``"NET.STA"``: keep only its traces, for files that hold several stations.
    start, end : UTCDateTime, optional
        Read only this window, for files that hold a day.
    limits : Archives
        What archives may unpack to.

    Returns
    -------
    stream : Stream
        Traces in the words of ``formats/text/vocabulary.py``; the path of each one's file is in
        ``stats.source``.
    rejected : tuple of Rejection
        Files that cannot be read, traces whose metadata is insufficient, and velocity and
        displacement of a channel whose acceleration is read; the rest goes on.
    """
    stream, rejected = Stream(), []
    for path in paths:
        try:
            content = read_file(path, limits)
            traces = _traces(path, content, headonly=False, starttime=start, endtime=end)
        except RecordRejected as rejection:
            raise_machine_fault(rejection)
            rejected.append(_rejected_file(path, rejection))
            continue
        # A trace that is refused does not stop the others of its file
        for trace in taken(traces):
            if station not in (None, station_name(trace)):
                continue
            try:
                stream += with_metadata(trace, inventory)
                stream[-1].stats.source = str(path)
            except RecordRejected as rejection:
                rejected.append(Rejection("record", trace.id, str(path), None, rejection.reasons))
    stream, integrals = _without_integrals(stream)
    return stream, (*rejected, *integrals)


def _without_integrals(stream: Stream) -> tuple[Stream, list[Rejection]]:
    """
    Return a stream without series of velocity and displacement whose acceleration it holds too.

    Agencies write the integrals of a record beside it, under the same codes.
    """
    accelerations = {trace.id for trace in stream if trace.stats.get("units") == "m/s2"}
    # Integrals without their acceleration stay
    kept, rejected = Stream(), []
    for trace in stream:
        quantity = _INTEGRALS.get(trace.stats.get("units"))
        if quantity is None or trace.id not in accelerations:
            kept += trace
            continue
        reason = f"{quantity} series, acceleration is read instead"
        rejected.append(Rejection("record", trace.id, trace.stats.source, None, (reason,)))
    return kept, rejected


def _files(folder: Path, limits: Archives) -> tuple[list[Path], list[Rejection]]:
    """Return all files, those in archives included, and the archives that cannot be read."""
    if not folder.exists():
        raise CatalogError(str(folder), "no such folder or file")
    # A file counts as the only one of its folder
    paths, rejected = ([folder], list[Rejection]()) if folder.is_file() else files_below(folder)
    files = []
    for path in paths:
        try:
            inside, unread = archive_files(path, limits) if is_archive(path) else ([path], [])
            files += inside
            rejected += unread
        except RecordRejected as rejection:
            rejected.append(_rejected_file(path, rejection))
    if not files and not rejected:
        raise NothingUsable(str(folder), "the folder is empty")
    return files, rejected


def files_below(folder: Path) -> tuple[list[Path], list[Rejection]]:
    """
    Return the files below a folder, sorted, and whatever else is there that cannot be read.

    Folders that cannot be listed, links that lead nowhere or to a folder, pipes, sockets and
    devices are rejections; the rest goes on. Part files of this package are passed over.

    Raises
    ------
    CatalogError
        If it is no folder.
    """
    if not folder.is_dir():
        raise CatalogError(str(folder), "is neither a folder nor a regular file")
    unlisted: list[OSError] = []
    paths, rejected = [], []
    # Links to folders are among the folders, and are not entered
    for parent, folders, names in os.walk(folder, onerror=unlisted.append):
        for path in (Path(parent, name) for name in (*folders, *names)):
            problem = _problem(path)
            if problem:
                rejected.append(Rejection("file", path.name, str(path), None, (problem,)))
            elif not path.is_dir() and not is_part(path):
                paths.append(path)
    # An error may come in the middle of a folder
    for error in unlisted:
        path = Path(error.filename or folder)
        reason = f"the folder cannot be listed: {reason_of(error)}"
        rejected.append(Rejection("file", path.name, str(path), None, (reason,)))
    return sorted(paths), sorted(rejected)


def _problem(path: Path) -> str:
    """Return why something in a folder is neither a file nor a folder; empty if it is one."""
    try:
        kind = path.stat().st_mode
    except OSError as error:
        if path.is_symlink():
            return f"is a link that leads nowhere: {reason_of(error)}"
        return f"cannot be read: {reason_of(error)}"
    # Folders behind links could hold each other
    if stat.S_ISDIR(kind):
        is_link = path.is_symlink()
        return "is a link to a folder, which is not followed: name that folder" if is_link else ""
    return "" if stat.S_ISREG(kind) else IRREGULAR


def _read_inventory(path: Path) -> Inventory:
    """Read StationXML or FDSN station text."""
    content = read_file(path)
    if _kind(path, content) == "station text":
        return _read_station_text(path, content)
    return read_content(obspy.read_inventory, content, path)


def _read_station_text(path: Path, content: bytes) -> Inventory:
    """Read FDSN station text, whose empty start means an open one."""
    marked = marked_open_starts(content)
    try:
        inventory = read_bytes_with_obspy(
            obspy.read_inventory, marked, str(path), format="STATIONTXT"
        )
    except RecordRejected as rejection:
        reason = f"is no FDSN station text: {rejection.reasons[0]}"
        raise RecordRejected(str(path), reason) from rejection
    return with_open_starts(inventory)


def merged_inventory(inventories: list[Inventory]) -> Inventory | None:
    """Return one inventory of all; None of none."""
    return reduce(add, inventories) if inventories else None


def read_inventories(stationxml: Path) -> list[Inventory]:
    """
    Read a StationXML file, or all of a folder.

    Raises
    ------
    CatalogError
        If there is none, or one cannot be read.
    """
    paths = [stationxml]
    # What cannot be read is tried again below, for its reason
    if stationxml.is_dir():
        files, unread = files_below(stationxml)
        paths = [path for path in files if path.suffix == ".xml"]
        paths += [Path(rejection.source) for rejection in unread if _is_needed(rejection)]
    if not paths:
        raise CatalogError(str(stationxml), "the folder holds no StationXML (*.xml)")
    try:
        return [_read_inventory(path) for path in paths]
    except RecordRejected as rejection:
        raise CatalogError(
            rejection.record, f"is no StationXML: {'; '.join(rejection.reasons)}"
        ) from rejection


def _is_needed(rejection: Rejection) -> bool:
    """Return whether something that cannot be read may hold StationXML."""
    return rejection.source.endswith(".xml") or "cannot be listed" in rejection.reasons[0]


def _rejected_file(path: Path, rejection: RecordRejected) -> Rejection:
    """Return the row of an unusable file."""
    return Rejection("file", path.name, str(path), None, rejection.reasons)


def _nothing_found(files: list[Path], rejected: list[Rejection]) -> str:
    """Return the reason why a folder has no station, with the first fault as an example."""
    problem = f"none of its {len(files)} files is a record"
    if not rejected:
        return f"{problem}: there is only metadata"
    return f"{problem}; {rejected[0].name}: {'; '.join(rejected[0].reasons)}"
