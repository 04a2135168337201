"""
A folder of records: every file that ObsPy and its plugins understand, and one station of it.

StationXML may be in the same folder or elsewhere. Of the several forms in which agencies write a
record one is read: acceleration rather than its integrals, physical units rather than counts.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, product
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import obspy
from obspy import Inventory, Stream, Trace, UTCDateTime
from obspy.core import AttribDict

from per_obspy.config import Archives
from per_obspy.errors import CatalogError, NothingUsable, RecordRejected, Rejection, TryLater
from per_obspy.files import bytes_hash
from per_obspy.formats.text.station_table import bare_name, located_stations
from per_obspy.machine import raise_machine_fault
from per_obspy.processing.account import rejection as trace_row
from per_obspy.processing.account import taken
from per_obspy.records.archive import LIMITS, archive_files, is_archive, read_file
from per_obspy.records.earthquakes.earthquake import Earthquake
from per_obspy.records.earthquakes.groups import RecordSpan, record_span, station_files
from per_obspy.records.file_list import (
    FileState,
    changed_files,
    file_row,
    file_states,
    files_below,
    growing_files,
    is_document,
)
from per_obspy.records.metadata import (
    METADATA,
    Metadata,
    kind_of,
    merged_inventory,
    named_metadata,
    read_metadata,
    with_metadata,
)
from per_obspy.records.obspy_readers import UNKNOWN_FORMAT, read_content
from per_obspy.records.processed_files import described

#: Kinds of files, in the order of the rows of unusable ones.
_KINDS = ("record", *METADATA)

#: Difference of durations that decides between two forms of a record, s.
_STEP = 10.0

#: unit of a series -> its quantity, for the integrals of acceleration
_INTEGRALS = {"m/s": "velocity", "m": "displacement"}


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
    event: Earthquake | None = None,
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Read the files of one station, with coordinates, orientation and response attached.

    Parameters
    ----------
    paths : iterable of Path
        From ``RecordSource.stations``.
    inventory : Inventory or None
        From ``RecordSource.inventory``.
    station : str, optional
        ``"NET.STA"``: keep only its traces, for files that hold several stations.
    start, end : UTCDateTime, optional
        Read only this window, for files that hold a day.
    limits : Archives
        Limits of unpacking.
    event : Earthquake, optional
        The earthquake of most headers, which becomes that of every trace.

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
            rejected.append(file_row(path, *rejection.reasons))
            continue
        # A trace that is refused does not stop the others of its file
        for trace in taken(traces):
            if station not in (None, station_name(trace)):
                continue
            trace.stats.source = str(path)
            try:
                stream += with_metadata(trace, inventory)
            except RecordRejected as rejection:
                rejected.append(trace_row(trace, *rejection.reasons))
    stream, others = one_series(stream)
    for trace in stream:
        if event is not None:
            trace.stats.event = AttribDict(event.words)
    return stream, (*rejected, *others)


def _traces(path: Path, content: bytes, **options: Any) -> Stream:
    """Return the traces of a file that has been opened already."""
    if not content:
        raise RecordRejected(str(path), "the file is empty")
    return described(read_content(obspy.read, content, path, **options), path, content)


#: Reads a station from its files, metadata and name, as :func:`read_station` does.
Reader = partial[tuple[Stream, tuple[Rejection, ...]]]


#: ``"NET.STA"`` -> files that hold records of the station
Files = dict[str, tuple[Path, ...]]


class RecordSource(NamedTuple):
    """
    A source of records that has been opened: a folder, an archive, a workspace, a cache.

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
        Times of the records and earthquakes of their headers, where these were read.
    waiting : tuple of Path
        Files that are still being written, which are not read.
    reader : partial
        Reads a station of this source.
    """

    stations: Files
    inventory: Inventory | None = None
    rejected: tuple[Rejection, ...] = ()
    hashes: Mapping[Path, str] = MappingProxyType({})
    records: tuple[RecordSpan, ...] = ()
    waiting: tuple[Path, ...] = ()
    reader: Reader = partial(read_station)


def find_stations(
    folder: str | Path,
    stationxml: str | Path | None = None,
    limits: Archives = LIMITS,
    settle: float = 0.0,
) -> RecordSource:
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
    if not Path(folder).exists():
        raise CatalogError(str(folder), "no such folder or file")
    files, rejected, waiting = _read_files(Path(folder), limits, settle)
    records = _records(files)
    # Metadata that is named comes before that of the folder
    metadata = named_metadata(None if stationxml is None else Path(stationxml))
    metadata += [file.metadata for file in files]
    if not records:
        raise _nothing_usable(Path(folder), len(files), rejected)
    stations = station_files(records)
    inventories = [one.inventory for one in metadata if one.inventory is not None]
    # Tables of coordinates serve the stations that have records
    if rows := [row for one in metadata for row in one.rows]:
        inventories.append(located_stations(rows, stations))
    hashes = {file.path: file.hash for file in files if file.hash}
    inventory = merged_inventory(inventories)
    reader = partial(read_station) if limits == LIMITS else partial(read_station, limits=limits)
    return RecordSource(stations, inventory, tuple(rejected), hashes, records, waiting, reader)


def _nothing_usable(folder: Path, files: int, rejected: list[Rejection]) -> CatalogError:
    """Return the error of a folder without a station, with the first fault as an example."""
    example = ": there is only metadata"
    if rejected:
        example = f"; {rejected[0].name}: {'; '.join(rejected[0].reasons)}"
    # A folder without records may fill up; a file that was named should have been one
    nothing = NothingUsable if folder.is_dir() else CatalogError
    return nothing(str(folder), f"none of its {files} files is a record{example}")


@dataclass
class _File:
    """A file of a folder: its records, its metadata or the reason for neither."""

    path: Path
    hash: str = ""
    kind: str = "record"
    records: tuple[RecordSpan, ...] = ()
    metadata: Metadata = field(default_factory=Metadata)
    faults: tuple[str, ...] = ()


def _read_files(
    folder: Path, limits: Archives, settle: float
) -> tuple[list[_File], list[Rejection], tuple[Path, ...]]:
    """Read the files of a folder; return unreadable ones, and those that are still written."""
    # A file counts as the only one of its folder
    paths, rejected = ([folder], []) if folder.is_file() else files_below(folder)
    states, waiting = _settled(folder, paths, settle)
    files = []
    for path in sorted({*paths} - waiting):
        members, unread = _members(path, limits)
        files += [_read_file(member, limits) for member in members]
        rejected += unread
    if not files and not rejected:
        raise NothingUsable(str(folder), "the folder is empty")
    # A file that has changed since is half of one
    waiting |= changed_files(states)
    files = [file for file in files if not waiting.intersection((file.path, *file.path.parents))]
    # Unusable records come before unusable metadata
    faulty = [file for file in files if file.faults and file.kind in _KINDS]
    faulty.sort(key=lambda file: _KINDS.index(file.kind))
    rejected += [file_row(file.path, *file.faults) for file in faulty]
    return files, rejected, tuple(sorted(waiting))


def _settled(
    folder: Path, paths: list[Path], settle: float
) -> tuple[dict[Path, FileState], set[Path]]:
    """Return the state of the files that can be read, and the files that are still written."""
    states = file_states(paths) if settle > 0 else {}
    waiting = growing_files(states, settle)
    # A folder without a finished file is read later
    if waiting and waiting == set(states):
        reason = f"its {len(waiting)} files are still being written, try again in {settle:g} s"
        raise TryLater(f"{folder}: {reason}")
    return {path: state for path, state in states.items() if path not in waiting}, waiting


def _members(path: Path, limits: Archives) -> tuple[list[Path], list[Rejection]]:
    """Return the files in an archive, or a file itself; an archive may be unreadable."""
    try:
        return archive_files(path, limits) if is_archive(path) else ([path], [])
    except RecordRejected as rejection:
        return [], [file_row(path, *rejection.reasons)]


def _read_file(path: Path, limits: Archives) -> _File:
    """Read a file of a folder once: its hash, and the headers of its records or its metadata."""
    file = _File(path)
    try:
        content = read_file(path, limits)
        # Hash, headers and metadata come from the same bytes
        file.hash, file.kind = bytes_hash(content), kind_of(path, content)
        if file.kind == "record":
            traces = _traces(path, content, headonly=True)
            file.records = tuple(record_span(trace, path) for trace in traces)
        elif file.kind in METADATA:
            file.metadata = read_metadata(file.kind, path, content)
            file.faults = file.metadata.faults
    except RecordRejected as rejection:
        file.faults = rejection.reasons
        # Documents that agencies pack with records are no records
        if is_document(path) and UNKNOWN_FORMAT in rejection.reasons[0]:
            file.kind = "document"
    return file


def _records(files: Iterable[_File]) -> tuple[RecordSpan, ...]:
    """Return the records of all files, with the earthquake that metadata of their station name."""
    metadata = [file.metadata for file in files if file.metadata.event]
    events = {name: one.event for one in metadata for row in one.rows for name in row.names}
    records = [record for file in files for record in file.records]
    # The one that has more facts counts
    for place, record in enumerate(records if events else ()):
        event = events.get(bare_name(record.station.split(".", 1)[1]))
        if event and event.known > (record.event.known if record.event else 0):
            records[place] = record._replace(event=event)
    return tuple(records)


def one_series(stream: Stream) -> tuple[Stream, list[Rejection]]:
    """
    Return a stream with one form of every record that agencies give in several.

    Agencies write the integrals of a record to the same folder, under the same codes: velocity and
    displacement are left out where their acceleration is there too. A folder may also hold a
    record as counts and as acceleration (V0 and V1), or in two formats (SMC and RAW). Of the forms
    of one channel and state (raw or processed) that overlap in time, the longest stays (in steps
    of 10 s), of several one in physical units, of these the first by format and file. A form that
    does not overlap, in time or by its channel code, is another record.
    """
    accelerations = {trace.id for trace in stream if _form(trace)[2] == "m/s2"}
    left_out = {}
    # Channel and state, format and unit -> series
    forms: dict[tuple[str, str], dict[tuple[str, str], list[Trace]]] = defaultdict(dict)
    for trace in stream:
        level, form, units = _form(trace)
        if trace.id in accelerations and units in _INTEGRALS:
            kind = _INTEGRALS[units]
            reason = f"{kind} series, acceleration is read instead"
            left_out[id(trace)] = trace_row(trace, reason)
        else:
            forms[trace.id, level].setdefault((form, units), []).append(trace)
    for channel in forms.values():
        left_out |= _doubles(*sorted(channel.values(), key=_rank))
    # The order of the files stays
    stays = (trace for trace in stream if id(trace) not in left_out)
    return Stream([*stays]), [*left_out.values()]


def _doubles(best: list[Trace], *others: list[Trace]) -> dict[int, Rejection]:
    """Return the rows of series that the best form of their channel has too, by their object."""
    rows = {}
    for trace, same in product(chain(*others), best):
        # Only where both have samples of the same time
        start = max(trace.stats.starttime, same.stats.starttime)
        if id(trace) not in rows and min(trace.stats.endtime, same.stats.endtime) > start:
            words = " in ".join(_form(same)[1:]).strip()
            reason = f"the same record as {same.stats.source} ({words}), which is read instead"
            rows[id(trace)] = trace_row(trace, reason)
    return rows


def _form(trace: Trace) -> tuple[str, str, str]:
    """Return the state of a record, raw or processed, its format and its unit."""
    level, form, units = map(trace.stats.get, ("processing_level", "_format", "units"))
    return str(level or ""), str(form or ""), str(units or "")


def _rank(traces: list[Trace]) -> tuple[int, bool, str, str]:
    """Return the sorting key of a form: duration, physical units, format and file."""
    seconds = sum(float(trace.stats.npts * trace.stats.delta) for trace in traces)
    _, form, units = _form(traces[0])
    first = min(str(trace.stats.source) for trace in traces)
    return -round(seconds / _STEP), units == "counts", form, first
