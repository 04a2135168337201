"""
A folder of records: every file that ObsPy and its plugins understand.

StationXML may be in the same folder or elsewhere.
"""

from collections import defaultdict
from collections.abc import Iterable
from functools import reduce
from operator import add
from pathlib import Path
from typing import Any, NamedTuple

import obspy
from obspy import Inventory, Stream, Trace, UTCDateTime
from obspy.core.event import Event

from per_obspy.errors import CatalogError, RecordRejected, Rejection
from per_obspy.formats.text.station_table import (
    StationRow,
    is_station_table,
    located_stations,
    read_station_table,
    read_station_text,
)
from per_obspy.records.archives import is_archive, members, open_file
from per_obspy.records.metadata import with_metadata
from per_obspy.records.obspy_readers import read_with_obspy
from per_obspy.records.processed_files import described

#: words at the beginning of StationXML, FDSN station text, QuakeML and descriptions of processed
#: records -> kind of file
_MARKS = {
    b"<FDSNStationXML": "inventory",
    b"#Network": "station text",
    b"quakeml": "event",
    b'"shard": ': "description",
}

#: kinds of files that describe stations
_METADATA = ("inventory", "station text", "station table")

#: unit of a series -> its quantity, for the integrals of acceleration
_INTEGRALS = {"m/s": "velocity", "m": "displacement"}


class FolderContents(NamedTuple):
    """
    Contents of a folder.

    Attributes
    ----------
    stations : dict
        ``"NET.STA"`` -> the files that hold records of the station, sorted; files in an archive as
        if it were a folder.
    inventory : Inventory or None
        All StationXML, merged; None if there is none.
    rejected : tuple of Rejection
        Files that are neither records nor metadata, each with its reason.
    """

    stations: dict[str, tuple[Path, ...]]
    inventory: Inventory | None
    rejected: tuple[Rejection, ...]


def find_stations(folder: str | Path, stationxml: str | Path | None = None) -> FolderContents:
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

    Raises
    ------
    CatalogError
        If the folder is missing, empty or without any record, or the named StationXML cannot be
        read.
    """
    files, rejected = _files(Path(folder))
    kinds = {path: _kind(path) for path in files}
    # Headers of the records
    stations: dict[str, list[Path]] = defaultdict(list)
    for path in (path for path in files if kinds[path] == "record"):
        try:
            for station in _station_names(path):
                stations[station].append(path)
        except RecordRejected as rejection:
            rejected.append(_rejected_file(path, rejection))
    # Metadata from elsewhere, then from the folder
    inventories, rows = _named_metadata(None if stationxml is None else Path(stationxml))
    metadata = {path: kind for path, kind in kinds.items() if kind in _METADATA}
    rejected += _read_metadata(metadata, inventories, rows)
    if rows:
        inventories.append(located_stations(rows, stations))
    if not stations:
        raise CatalogError(str(folder), _nothing_found(files, rejected))
    return FolderContents(_sorted(stations), merged_inventory(inventories), tuple(rejected))


def _read_metadata(
    kinds: dict[Path, str], inventories: list[Inventory], rows: list[StationRow]
) -> list[Rejection]:
    """Add the content of files to descriptions and rows, and return those that cannot be read."""
    rejected = []
    for path, kind in kinds.items():
        try:
            if kind == "station table":
                rows += read_station_table(str(path), _content(path))
            else:
                inventories.append(_read_inventory(path))
        except RecordRejected as rejection:
            rejected.append(_rejected_file(path, rejection))
    return rejected


def _named_metadata(path: Path | None) -> tuple[list[Inventory], list[StationRow]]:
    """Return the descriptions of stations, or the rows of a table of them, that a user named."""
    if path is None:
        return [], []
    if not path.is_file() or _kind(path) != "station table":
        return read_inventories(path), []
    # A table that the user named must be right
    try:
        return [], [*read_station_table(str(path), _content(path))]
    except RecordRejected as rejection:
        raise CatalogError(str(path), "; ".join(rejection.reasons)) from rejection


def _content(path: Path) -> bytes:
    """Return the content of a file, which may be in an archive."""
    with open_file(path) as file:
        return bytes(file.read())


def _station_names(path: Path) -> list[str]:
    """Return the stations of a file, sorted."""
    return sorted({station_name(trace) for trace in _read(path, headonly=True)})


def station_name(trace: Trace) -> str:
    """Return ``"NET.STA"`` of a trace."""
    return f"{trace.stats.network}.{trace.stats.station}"


def _sorted(stations: dict[str, list[Path]]) -> dict[str, tuple[Path, ...]]:
    return {station: tuple(paths) for station, paths in sorted(stations.items())}


def read_station(
    paths: Iterable[Path],
    inventory: Inventory | None,
    station: str | None = None,
    start: UTCDateTime | None = None,
    end: UTCDateTime | None = None,
) -> tuple[Stream, tuple[Rejection, ...]]:
    """
    Read the files of one station, with coordinates, orientation and response attached.

    Parameters
    ----------
    paths : iterable of Path
        From ``FolderContents.stations``.
    inventory : Inventory or None
        From ``FolderContents.inventory``.
    station : str, optional
        ``"NET.STA"``: keep only its traces, for files that hold several stations.
    start, end : UTCDateTime, optional
        Read only this window, for files that hold a day.

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
            traces = _read(path, headonly=False, starttime=start, endtime=end)
        except RecordRejected as rejection:
            rejected.append(_rejected_file(path, rejection))
            continue
        # A trace that is refused does not stop the others of its file
        for trace in traces:
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


def read_event(path: str | Path) -> Event:
    """
    Read the one event of a QuakeML file.

    Raises
    ------
    CatalogError
        If the file cannot be read or does not hold exactly one event with an origin.
    """
    try:
        events = read_with_obspy(obspy.read_events, Path(path))
    except RecordRejected as rejection:
        raise CatalogError(str(path), "; ".join(rejection.reasons)) from rejection
    if len(events) != 1:
        raise CatalogError(str(path), f"must hold one event, holds {len(events)}")
    # Windows and distances need an origin with its time
    event = events[0]
    if not event.origins:
        raise CatalogError(str(path), f"the event {event.resource_id} has no origin")
    if (event.preferred_origin() or event.origins[0]).time is None:
        problem = f"the event {event.resource_id} has an origin without time"
        raise CatalogError(str(path), problem)
    return event


def _files(folder: Path) -> tuple[list[Path], list[Rejection]]:
    """Return all files, those in archives included, and the archives that cannot be read."""
    if not folder.exists():
        raise CatalogError(str(folder), "no such folder or file")
    # A file counts as the only one of its folder
    if folder.is_file():
        paths = [folder]
    else:
        paths = sorted(path for path in folder.rglob("*") if path.is_file())
    files, rejected = [], []
    for path in paths:
        try:
            files += members(path) if is_archive(path) else [path]
        except RecordRejected as rejection:
            rejected.append(_rejected_file(path, rejection))
    if not files and not rejected:
        raise CatalogError(str(folder), "the folder is empty")
    return files, rejected


def _kind(path: Path) -> str:
    """Return the kind of a file: a kind of metadata, event, description, or else record."""
    try:
        with open_file(path) as file:
            start = file.read(1000)
    except RecordRejected:
        return "record"  # reading it gives the reason why it cannot be read
    if path.suffix.lower() == ".csv" and is_station_table(start):
        return "station table"
    return next((kind for mark, kind in _MARKS.items() if mark in start), "record")


def _read(path: Path, **options: Any) -> Stream:
    """Read a file of records; one that this package processed gets its description."""
    with open_file(path) as file:
        if not file.read(1):
            raise RecordRejected(str(path), "the file is empty")
    return described(read_with_obspy(obspy.read, path, **options), path)


def _read_inventory(path: Path) -> Inventory:
    """Read StationXML or FDSN station text."""
    if _kind(path) == "station text":
        return read_station_text(str(path), _content(path))
    return read_with_obspy(obspy.read_inventory, path)


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
    paths = sorted(stationxml.rglob("*.xml")) if stationxml.is_dir() else [stationxml]
    if not paths:
        raise CatalogError(str(stationxml), "the folder holds no StationXML (*.xml)")
    try:
        return [_read_inventory(path) for path in paths]
    except RecordRejected as rejection:
        raise CatalogError(
            rejection.record, f"is no StationXML: {'; '.join(rejection.reasons)}"
        ) from rejection


def _rejected_file(path: Path, rejection: RecordRejected) -> Rejection:
    return Rejection("file", path.name, str(path), None, rejection.reasons)


def _nothing_found(files: list[Path], rejected: list[Rejection]) -> str:
    """Return the reason why a folder has no station, with the first fault as an example."""
    problem = f"none of its {len(files)} files is a record"
    if not rejected:
        return f"{problem}: there is only metadata"
    return f"{problem}; {rejected[0].name}: {'; '.join(rejected[0].reasons)}"
