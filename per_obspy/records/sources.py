"""All sources of a configuration under one contract: stations, their files, and their readers."""

import logging
import os
from collections import defaultdict
from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import NamedTuple

from obspy import Inventory, Stream

from per_obspy import config
from per_obspy.errors import RecordRejected, Rejection, shortened
from per_obspy.names import SHOWN, code_problem
from per_obspy.processing.account import rejection, taken
from per_obspy.records.archive import hash_if_readable
from per_obspy.records.asdf import find_asdf_stations, has_event
from per_obspy.records.earthquakes.groups import (
    event_groups,
    group_event,
    one_earthquake,
    reader_of_event,
)
from per_obspy.records.earthquakes.quakeml import EventFile, read_event_file
from per_obspy.records.fdsn.cache import FDSN, Fetched, fetched_stations
from per_obspy.records.fdsn.request import window
from per_obspy.records.folder import Files, Reader, RecordSource, find_stations
from per_obspy.records.metadata import merged_inventory
from per_obspy.records.sds import find_sds_stations
from per_obspy.records.text_table import read_described

log = logging.getLogger(__name__)

#: Reason of stations and channels that the configuration leaves out.
LEFT_OUT = "left out by records.without"


class StationSource(NamedTuple):
    """
    Files and reader of one station.

    Attributes
    ----------
    files : tuple of Path
        Everything that is read.
    hashes : tuple of str
        Of the files; empty for one that cannot be read.
    inventory : Inventory or None
        StationXML of the station.
    reader : partial
        Reads the files; its function's name and keywords identify it.
    """

    files: tuple[Path, ...]
    hashes: tuple[str, ...]
    inventory: Inventory | None
    reader: Reader


class Sources(NamedTuple):
    """
    Stations and event of all sources of a configuration.

    Attributes
    ----------
    stations : dict
        ``"NET.STA"`` -> :class:`StationSource`.
    event : EventFile or None
        QuakeML file or ASDF workspace with the event.
    rejected : tuple of Rejection
        Rejected records, with every reason.
    hashes : dict
        Hash of every file that was read on the way.
    earthquakes : list of dict
        Facts of every earthquake in the folder, see ``earthquakes.groups.one_earthquake``.
    expected : frozenset of str
        Names of all stations of metadata and of lists of services, with records or without.
    waiting : tuple of Path
        Files of the folder that are still being written, which are not read.
    """

    stations: dict[str, StationSource]
    event: EventFile | None
    rejected: tuple[Rejection, ...]
    hashes: dict[Path, str]
    earthquakes: list[dict[str, object]]
    expected: frozenset[str] = frozenset()
    waiting: tuple[Path, ...] = ()


def find_sources(records: config.Records, fetched: Fetched | None) -> Sources:
    """
    Find the stations of all configured sources; the first source that has a station serves it.

    Parameters
    ----------
    records : config.Records
        Tables of columns, folder, SDS archive, ASDF workspace, FDSN services: in this order.
    fetched : Fetched or None
        Of the FDSN services.

    Raises
    ------
    CatalogError
        If a source is missing or empty, or the event cannot be read.
    """
    # A wrong event stops the run here, not every station
    file = _event_file(records, fetched)
    event = file and file.event
    opened, earthquakes = list[RecordSource](), list[dict[str, object]]()
    for table in records.columns:
        files: Files = {f"{table.network}.{table.station}": (table.file,)}
        opened.append(RecordSource(files, reader=partial(read_table, table=table)))
    # Of several earthquakes in the folder one is screened
    if records.folder:
        limits = records.archives
        folder = find_stations(records.folder, records.stationxml, limits, records.settle)
        parts, earthquakes = one_earthquake(folder, records, event)
        opened += parts
    if records.sds:
        times = window(records.sds, event)
        opened.append(find_sds_stations(records.sds.folder, *times, records.stationxml))
    # Records processed by others and by services come last
    if records.asdf:
        opened.append(find_asdf_stations(records.asdf.file, records.asdf.tag))
    if fetched:
        opened.append(fetched_stations(fetched))
    return _served(opened, file, earthquakes, records.without)


def find_path_sources(paths: Sequence[Path]) -> Sources:
    """
    Find the stations of some files and folders; files of a station in several of them are joined.

    Raises
    ------
    CatalogError
        If a path is missing or holds no record.
    """
    opened = [find_stations(path) for path in paths]
    groups = event_groups([record for source in opened for record in source.records])
    if len(groups) > 1:
        log.warning(
            "records of %d earthquakes are used together, they start %s: "
            "name the files of one of them",
            len(groups),
            ", ".join(group.label for group in groups),
        )
    # Records of one earthquake have that of most headers
    headers = group_event(groups[0]) if len(groups) == 1 else None
    # Metadata in one of the paths serves stations of all
    files, hashes = defaultdict[str, tuple[Path, ...]](tuple), dict[Path, str]()
    for source in opened:
        hashes |= source.hashes
        for name, station_files in source.stations.items():
            files[name] += station_files
    inventory = merged_inventory([one.inventory for one in opened if one.inventory])
    rejected = tuple(row for source in opened for row in source.rejected)
    joined = RecordSource(files, inventory, rejected, hashes)
    return _served([joined._replace(reader=reader_of_event(joined.reader, headers))], None, [])


def read_records(*paths: str | Path) -> Stream:
    """
    Read strong-motion records of files and folders, ready for :func:`per_obspy.process`.

    Every format of ObsPy and of this package is read, and archives of them; StationXML in a folder
    serves its stations.

    Parameters
    ----------
    *paths : str or Path
        Files and folders, at least one.

    Returns
    -------
    obspy Stream
        Traces with coordinates, orientation, and unit or response.

    Raises
    ------
    CatalogError
        If a path is missing or holds no record.
    RecordRejected
        If no record can be read, with every reason. Single records that cannot are logged.
    """
    sources = find_path_sources([Path(path) for path in paths])
    stream, rejected = Stream(), [*sources.rejected]
    # Station by station, as a run reads them
    for name, station in sources.stations.items():
        traces, unread = station.reader(station.files, station.inventory, name)
        stream += traces
        rejected += unread
    reasons = [f"{row.name}: {reason}" for row in rejected for reason in row.reasons]
    if not stream:
        raise RecordRejected(", ".join(map(str, paths)), *(reasons or ["no records"]))
    for reason in reasons:
        log.warning("left out: %s", reason)
    return stream


def _served(
    opened: Iterable[RecordSource],
    event: EventFile | None,
    earthquakes: list[dict[str, object]],
    without: Sequence[str] = (),
) -> Sources:
    """Return each station of the first source that has it, with what all sources reject."""
    sources = Sources({}, event, (), {event.path: event.hash} if event else {}, earthquakes)
    rejected, expected = list[Rejection](), set[str]()
    for source in opened:
        sources = sources._replace(waiting=sources.waiting or source.waiting)
        sources.hashes.update(source.hashes)
        rejected += source.rejected
        expected |= _expected(source)
        # The first source that has a station serves it
        for name, paths in source.stations.items():
            reason = _unusable(name, paths, sources.stations.get(name), without)
            if reason is not None:
                rejected.append(reason)
            else:
                reader = reader_without(source.reader, name, without)
                part = source._replace(reader=reader)
                sources.stations[name] = _station(name, paths, part, sources.hashes)
    # Every name of the configuration should be of a station
    _warn_of_absent(without, {*sources.stations, *(row.name for row in rejected)})
    expected |= set(sources.stations)
    return sources._replace(rejected=tuple(rejected), expected=frozenset(expected))


def _expected(source: RecordSource) -> set[str]:
    """Return the stations of the metadata and list of a source, with records or without."""
    networks = source.inventory or ()
    codes = {f"{network.code}.{place.code}" for network in networks for place in network}
    listed = (row for row in source.rejected if row.kind == "station" and row.source == FDSN)
    return codes.union(row.name for row in listed)


def _unusable(
    name: str, paths: tuple[Path, ...], earlier: StationSource | None, without: Sequence[str]
) -> Rejection | None:
    """Return the row of a station that is left out, or served by another source, or misnamed."""
    # Codes become names of station files, records and figures
    if problem := code_problem(*name.split(".", 1)):
        files = ", ".join(sorted({str(path) for path in paths}))
        return Rejection("station", shortened(name, SHOWN), files, None, (problem,))
    if name in without:
        return Rejection("station", name, os.path.commonpath(paths), None, (LEFT_OUT,))
    if earlier is None:
        return None
    reason = f"is also in {os.path.commonpath(earlier.files)}, which comes first"
    return Rejection("station", name, os.path.commonpath(paths), None, (reason,))


def _station(
    name: str, paths: tuple[Path, ...], source: RecordSource, hashes: dict[Path, str]
) -> StationSource:
    """Return a station with its metadata; each file is hashed once, for all of its stations."""
    hashes |= {path: hash_if_readable(path) for path in paths if path not in hashes}
    network, station = name.split(".", 1)
    metadata = source.inventory and source.inventory.select(network=network, station=station)
    return StationSource(paths, tuple(hashes[path] for path in paths), metadata, source.reader)


def _warn_of_absent(without: Sequence[str], stations: set[str]) -> None:
    """Log names that are of no station: one that is written wrongly would stay in use."""
    for name in without:
        if ".".join(name.split(".")[:2]) not in stations:
            log.warning("records.without: no records of %s", name)


class _NamedReader(Reader):
    """A reader that other processes know by name, as a part of another one."""

    def __repr__(self) -> str:
        return f"{self.func.__name__} {self.keywords}"


def reader_without(reader: Reader, station: str, without: Sequence[str]) -> Reader:
    """
    Return a reader of a station that leaves out channels.

    Parameters
    ----------
    reader : partial
        Of all channels.
    station : str
        ``"NET.STA"``.
    without : sequence of str
        Channels of this and other stations, ``"NET.STA.LOC.CHA"`` with wildcards.
    """
    channels = tuple(name for name in without if name.startswith(f"{station}."))
    if not channels:
        return reader
    inner = _NamedReader(reader.func, **reader.keywords)
    return partial(read_without, reader=inner, channels=channels)


def read_without(
    paths: Iterable[Path],
    inventory: Inventory | None,
    station: str | None = None,
    *,
    reader: Reader,
    channels: Sequence[str],
) -> tuple[Stream, tuple[Rejection, ...]]:
    """Read a station without some channels; each trace, and each name of none, is a row."""
    stream, rejected = reader(paths, inventory, station)
    out, rows, names = Stream(), list(rejected), set(channels)
    for trace in taken(stream):
        matching = [name for name in channels if fnmatchcase(trace.id, name)]
        names -= set(matching)
        # A trace that stays has one owner
        if matching:
            rows.append(rejection(trace, LEFT_OUT))
        else:
            out += trace
    files = ", ".join(path.name for path in paths)
    absent = ("records.without: no such channel",)
    rows += [Rejection("record", name, files, None, absent) for name in sorted(names)]
    return out, tuple(rows)


def _event_file(records: config.Records, fetched: Fetched | None) -> EventFile | None:
    """Return the event: that of the configuration, else the fetched one, else the workspace's."""
    if fetched and fetched.event:  # which is that of the configuration if there is one
        return fetched.event
    if records.event:
        return read_event_file(records.event)
    workspace = records.asdf.file if records.asdf else None
    return read_event_file(workspace) if workspace and has_event(workspace) else None


def read_table(*_: object, table: config.Columns) -> tuple[Stream, tuple[Rejection, ...]]:
    """Read a plain table of samples; file, metadata and name are in its description."""
    return read_described(table), ()
