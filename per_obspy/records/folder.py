"""
A folder of records: every file that ObsPy and its plugins understand.

StationXML may be in the same folder or elsewhere.
"""

from collections.abc import Iterable, Mapping
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import obspy
from obspy import Inventory, Stream, Trace, UTCDateTime

from per_obspy.config import Archives
from per_obspy.errors import CatalogError, NothingUsable, RecordRejected, Rejection, TryLater
from per_obspy.files import bytes_hash
from per_obspy.formats.text.itaca_metadata import read_itaca_metadata
from per_obspy.formats.text.station_table import (
    StationRow,
    bare_name,
    located_stations,
    read_station_table,
)
from per_obspy.machine import raise_machine_fault
from per_obspy.processing.notes import taken
from per_obspy.records.archives.archive_files import LIMITS, archive_files, read_file
from per_obspy.records.archives.walked import is_archive
from per_obspy.records.contents.file_list import files_below, is_document
from per_obspy.records.contents.growing import (
    FileState,
    changed_files,
    file_states,
    growing_files,
)
from per_obspy.records.contents.metadata_files import (
    METADATA,
    kind_of,
    merged_inventory,
    named_metadata,
    read_station_text,
)
from per_obspy.records.contents.one_series import without_doubles, without_integrals
from per_obspy.records.earthquakes.earthquake import Earthquake, header_event
from per_obspy.records.earthquakes.groups import RecordSpan, record_span, station_files
from per_obspy.records.metadata import with_metadata
from per_obspy.records.obspy_readers import UNKNOWN_FORMAT, read_content
from per_obspy.records.processed_files import described


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
    waiting : tuple of Path
        Files that are still being written, which are not read.
    """

    stations: dict[str, tuple[Path, ...]]
    inventory: Inventory | None
    rejected: tuple[Rejection, ...]
    hashes: Mapping[Path, str] = MappingProxyType({})
    records: tuple[RecordSpan, ...] = ()
    waiting: tuple[Path, ...] = ()


def find_stations(
    folder: str | Path,
    stationxml: str | Path | None = None,
    limits: Archives = LIMITS,
    settle: float = 0.0,
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
        Limits of unpacking.
    settle : float
        Age, s, from which a file is read if it does not change; 0: every file is.

    Raises
    ------
    CatalogError
        If the folder or file is missing, a file is no record, or the named StationXML cannot be
        read.
    NothingUsable
        If the folder is empty or without any record.
    TryLater
        If every file is still being written.
    """
    found, rejected, waiting = _read_files(Path(folder), limits, settle)
    records = _records(found)
    # Metadata that is named comes before that of the folder
    inventories, rows = named_metadata(None if stationxml is None else Path(stationxml))
    inventories += [file.inventory for file in found if file.inventory is not None]
    rows += chain.from_iterable(file.rows for file in found)
    # Unusable records come before unusable metadata
    for kind in ("record", *METADATA):
        rejected += [file.rejection for file in found if file.kind == kind and file.rejection]
    if not records:
        # A folder without records may fill up; a file that was named should have been one
        nothing = NothingUsable if Path(folder).is_dir() else CatalogError
        raise nothing(str(folder), _nothing_found(len(found), rejected))
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
        waiting,
    )


def _read_files(
    folder: Path, limits: Archives, settle: float
) -> "tuple[list[_File], list[Rejection], tuple[Path, ...]]":
    """Read the files of a folder; return unreadable ones, and those that are still written."""
    paths, rejected = _paths(folder)
    states, waiting = _settled(folder, paths, settle)
    files = _files([path for path in paths if path not in waiting], rejected, limits)
    if not files and not rejected:
        raise NothingUsable(str(folder), "the folder is empty")
    found = [_read_file(path, limits) for path in files]
    # A file that has changed since is half of one
    waiting |= changed_files(states)
    found = [file for file in found if not waiting.intersection((file.path, *file.path.parents))]
    return found, rejected, tuple(sorted(waiting))


def _settled(
    folder: Path, paths: list[Path], settle: float
) -> tuple[dict[Path, FileState], set[Path]]:
    """Return the state of the files that can be read, and the files that are still written."""
    if settle <= 0:
        return {}, set()
    # A folder without a finished file is read later
    states = file_states(paths)
    waiting = growing_files(states, settle)
    if waiting and waiting == set(states):
        reason = f"its {len(waiting)} files are still being written, try again in {settle:g} s"
        raise TryLater(f"{folder}: {reason}")
    return {path: state for path, state in states.items() if path not in waiting}, waiting


class _File(NamedTuple):
    """A file of a folder: hash, kind, and its records, its metadata or the reason for neither."""

    path: Path
    hash: str = ""
    kind: str = "record"
    records: tuple[RecordSpan, ...] = ()
    inventory: Inventory | None = None
    rows: tuple[StationRow, ...] = ()
    events: Mapping[str, Earthquake] = MappingProxyType({})
    rejection: Rejection | None = None


def _read_file(path: Path, limits: Archives) -> _File:
    """Read a file of a folder once: its hash, and the headers of its records or its metadata."""
    # Bytes are read once and serve the hash as well
    file = _File(path)
    try:
        content = read_file(path, limits)
        # Hash, headers and metadata come from the same bytes
        file = file._replace(hash=bytes_hash(content), kind=kind_of(path, content))
        if file.kind == "record":
            stream = _traces(path, content, headonly=True)
            return file._replace(records=tuple(record_span(trace, path) for trace in stream))
        if file.kind == "inventory":
            inventory = read_content(obspy.read_inventory, content, path)
            return file._replace(inventory=inventory)
        if file.kind == "station text":
            return _with_station_text(file, content)
        if file.kind == "station table":
            return file._replace(rows=read_station_table(str(path), content))
        if file.kind == "ITACA metadata":
            return _with_itaca_metadata(file, content)
    except RecordRejected as rejection:
        # Documents that agencies pack with records are no records
        if is_document(path) and UNKNOWN_FORMAT in rejection.reasons[0]:
            return file._replace(kind="document")
        return file._replace(rejection=_rejected_file(path, rejection))
    return file


def _with_station_text(file: _File, content: bytes) -> _File:
    """Return a file with the stations of its lines, and the lines that cannot be read."""
    inventory, faults = read_station_text(file.path, content)
    rejection = RecordRejected(str(file.path), *faults) if faults else None
    row = _rejected_file(file.path, rejection) if rejection else None
    return file._replace(inventory=inventory, rejection=row)


def _with_itaca_metadata(file: _File, content: bytes) -> _File:
    """Return a file with the station and the earthquake of a metadata file of ITACA."""
    found = read_itaca_metadata(str(file.path), content)
    event = header_event(found.event)
    events = dict.fromkeys(found.row.names, event) if event else {}
    return file._replace(rows=(found.row,), events=events)


def _records(found: list[_File]) -> tuple[RecordSpan, ...]:
    """Return the records of all files, with the earthquake that metadata of their station name."""
    events = dict(chain.from_iterable(file.events.items() for file in found))
    records = chain.from_iterable(file.records for file in found)
    return tuple(_with_event(record, events) for record in records)


def _with_event(record: RecordSpan, events: Mapping[str, Earthquake]) -> RecordSpan:
    """Return a record with the event of its station's metadata if that has more facts."""
    event = events.get(bare_name(record.station.split(".", 1)[1]))
    known = record.event.known if record.event else 0
    return record._replace(event=event) if event and event.known > known else record


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
        Limits of unpacking.

    Returns
    -------
    stream : Stream
        Traces in the words of ``formats/text/vocabulary.py``; the path of each one's file is in
        ``stats.source``.
    rejected : tuple of Rejection
        Files that cannot be read, traces whose metadata is insufficient, velocity and
        displacement of a channel whose acceleration is read, and doubles of a record in another
        format; the rest goes on.
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
    stream, integrals = without_integrals(stream)
    stream, doubles = without_doubles(stream)
    return stream, (*rejected, *integrals, *doubles)


def _paths(folder: Path) -> tuple[list[Path], list[Rejection]]:
    """Return the files of a folder, archives unopened, and whatever else is there."""
    if not folder.exists():
        raise CatalogError(str(folder), "no such folder or file")
    # A file counts as the only one of its folder
    return ([folder], list[Rejection]()) if folder.is_file() else files_below(folder)


def _files(paths: list[Path], rejected: list[Rejection], limits: Archives) -> list[Path]:
    """Return all files, those in archives included; note the archives that cannot be read."""
    files = []
    for path in paths:
        try:
            inside, unread = archive_files(path, limits) if is_archive(path) else ([path], [])
            files += inside
            rejected += unread
        except RecordRejected as rejection:
            rejected.append(_rejected_file(path, rejection))
    return files


def _rejected_file(path: Path, rejection: RecordRejected) -> Rejection:
    """Return the row of an unusable file."""
    return Rejection("file", path.name, str(path), None, rejection.reasons)


def _nothing_found(files: int, rejected: list[Rejection]) -> str:
    """Return the reason why a folder has no station, with the first fault as an example."""
    problem = f"none of its {files} files is a record"
    if not rejected:
        return f"{problem}: there is only metadata"
    return f"{problem}; {rejected[0].name}: {'; '.join(rejected[0].reasons)}"
