"""All sources of a configuration under one contract: stations, their files, and their readers."""

import logging
import os
from collections.abc import Iterable, Iterator, Sequence
from functools import partial, reduce
from operator import add
from pathlib import Path
from typing import NamedTuple

from obspy import Inventory, Stream
from obspy.core.event import Event

from per_obspy import config
from per_obspy.errors import Rejection, shortened
from per_obspy.names import SHOWN, code_problem
from per_obspy.progress import Progress, silent
from per_obspy.records.asdf import find_asdf_stations, has_event, read_asdf_station
from per_obspy.records.contents.input_files import hash_if_readable
from per_obspy.records.earthquakes.choice import (
    OneEarthquake,
    Reader,
    group_event,
    one_earthquake,
    reader_of_event,
)
from per_obspy.records.earthquakes.groups import EventGroup, event_groups
from per_obspy.records.earthquakes.quakeml import EventFile, read_event_file
from per_obspy.records.fdsn.cache import FDSN, Fetched, fetch, fetched_stations
from per_obspy.records.fdsn.request import window
from per_obspy.records.folder import SourceContents, find_stations, read_station
from per_obspy.records.sds import find_sds_stations, read_sds_station
from per_obspy.records.text_table import read_columns

log = logging.getLogger(__name__)


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
        Facts of every earthquake in the folder, see ``records.earthquakes.choice.OneEarthquake``.
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


def fetched_records(records: config.Records | None, progress: Progress = silent) -> Fetched | None:
    """Bring the configured FDSN records into their cache, None if there are none."""
    return fetch(records.fdsn, records.event, progress) if records and records.fdsn else None


def find_sources(records: config.Records, fetched: Fetched | None) -> Sources:
    """
    Find the stations of all configured sources; the first source that has a station serves it.

    Parameters
    ----------
    records : config.Records
        Tables of columns, folder, SDS archive, ASDF workspace, FDSN services: in this order.
    fetched : Fetched or None
        From :func:`fetched_records`.

    Raises
    ------
    CatalogError
        If a source is missing or empty, or the event cannot be read.
    """
    # A wrong event stops the run here, not every station
    event = _event(records, fetched)
    hashes = {event.path: event.hash} if event else {}
    stations: dict[str, StationSource] = {}
    rejected: list[Rejection] = []
    expected = set[str]()
    # Of several earthquakes in the folder one is screened
    folder = _folder(records, event and event.event)
    for contents, reader in _contents(records, fetched, event and event.event, folder):
        found = _with_usable_names(contents)
        rejected += found.rejected
        expected |= _expected(found)
        hashes |= found.hashes
        for name, paths in found.stations.items():
            if name in stations:
                rejected.append(_second_source(name, paths, stations[name].files))
                continue
            inventory = _selected(found.inventory, name)
            stations[name] = StationSource(paths, _hashes(paths, hashes), inventory, reader)
    earthquakes, waiting = _folder_facts(folder)
    return Sources(
        stations, event, tuple(rejected), hashes, earthquakes, frozenset(expected), waiting
    )


def _folder_facts(folder: OneEarthquake | None) -> tuple[list[dict[str, object]], tuple[Path, ...]]:
    """Return the earthquakes of a folder, and its files that are still being written."""
    return (folder.earthquakes, folder.contents[0][0].waiting) if folder else ([], ())


def _expected(found: SourceContents) -> set[str]:
    """Return the stations of the metadata and list of a source, with records or without."""
    codes = [(network.code, place.code) for network in found.inventory or () for place in network]
    listed = [
        rejection.name
        for rejection in found.rejected
        if rejection.kind == "station" and rejection.source == FDSN
    ]
    return {f"{network}.{station}" for network, station in codes} | {*listed, *found.stations}


def find_path_sources(paths: Sequence[Path]) -> Sources:
    """
    Find the stations of some files and folders; files of a station in several of them are joined.

    Raises
    ------
    CatalogError
        If a path is missing or holds no record.
    """
    # Files of each station in all paths
    found = [_with_usable_names(find_stations(path)) for path in paths]
    files: dict[str, tuple[Path, ...]] = {}
    hashes: dict[Path, str] = {}
    for contents in found:
        hashes |= contents.hashes
        for name, station_files in contents.stations.items():
            files[name] = (*files.get(name, ()), *station_files)

    groups = event_groups([record for contents in found for record in contents.records])
    _warn_of_several_earthquakes(groups)
    reader = _path_reader(groups)

    # Metadata in one of the paths serves stations of all
    inventories = [contents.inventory for contents in found if contents.inventory]
    inventory = reduce(add, inventories) if inventories else None
    stations = {
        name: StationSource(
            station_files,
            _hashes(station_files, hashes),
            _selected(inventory, name),
            reader,
        )
        for name, station_files in files.items()
    }
    rejected = [rejection for contents in found for rejection in contents.rejected]
    return Sources(stations, None, tuple(rejected), hashes, [])


def _with_usable_names(found: SourceContents) -> SourceContents:
    """Return a source without the stations whose codes cannot name a file; each is a rejection."""
    stations, rejected = {}, list(found.rejected)
    # Codes become names of station files, records and figures
    for name, paths in found.stations.items():
        if problem := code_problem(*name.split(".", 1)):
            source = ", ".join(sorted({str(path) for path in paths}))
            rejected.append(Rejection("station", shortened(name, SHOWN), source, None, (problem,)))
        else:
            stations[name] = paths
    return found._replace(stations=stations, rejected=tuple(rejected))


def _path_reader(groups: Sequence[EventGroup]) -> Reader:
    """Return the reader of stations; records of one earthquake have that of most headers."""
    found = group_event(groups[0]) if len(groups) == 1 else None
    return reader_of_event(partial(read_station), found)


def _warn_of_several_earthquakes(groups: Sequence[EventGroup]) -> None:
    """Log a warning where records of different earthquakes will be processed together."""
    if len(groups) > 1:
        starts = ", ".join(group.label for group in groups)
        log.warning(
            "records of %d earthquakes are used together, they start %s: "
            "name the files of one of them",
            len(groups),
            starts,
        )


def _event(records: config.Records, fetched: Fetched | None) -> EventFile | None:
    """Return the event: that of the configuration, else the fetched one, else the workspace's."""
    if fetched and fetched.event:  # which is that of the configuration if there is one
        return fetched.event
    if records.event:
        return read_event_file(records.event)
    workspace = records.asdf.file if records.asdf else None
    return read_event_file(workspace) if workspace and has_event(workspace) else None


def _selected(inventory: Inventory | None, name: str) -> Inventory | None:
    """Return the metadata of one station."""
    network, station = name.split(".", 1)
    return inventory and inventory.select(network=network, station=station)


def _second_source(name: str, paths: Iterable[Path], first: Iterable[Path]) -> Rejection:
    """Return the rejection of a station that an earlier source has already."""
    reason = f"is also in {os.path.commonpath(first)}, which comes first"
    return Rejection("station", name, os.path.commonpath(paths), None, (reason,))


def _hashes(paths: Iterable[Path], known: dict[Path, str]) -> tuple[str, ...]:
    """Return the hashes of files; each file is read once, and its hash added to the known ones."""
    for path in paths:
        if path not in known:
            known[path] = hash_if_readable(path)
    return tuple(known[path] for path in paths)


def _contents(
    records: config.Records,
    fetched: Fetched | None,
    event: Event | None,
    folder: OneEarthquake | None,
) -> Iterator[tuple[SourceContents, Reader]]:
    """Yield the contents of each source with the reader of its stations."""
    for table in records.columns:
        name = f"{table.network}.{table.station}"
        yield SourceContents({name: (table.file,)}, None, ()), partial(read_table, table=table)
    if folder:
        yield from folder.contents
    if records.sds:
        yield _sds(records, records.sds, event)
    # Records processed by others and by services come last
    if records.asdf:
        found = find_asdf_stations(records.asdf.file, records.asdf.tag)
        yield found, partial(read_asdf_station, tag=records.asdf.tag)
    if fetched:
        yield fetched_stations(fetched), partial(read_station)


def _folder(records: config.Records, event: Event | None) -> OneEarthquake | None:
    """Return the records of one earthquake in the folder, None if there is no folder."""
    if not records.folder:
        return None
    found = find_stations(records.folder, records.stationxml, records.archives, records.settle)
    return one_earthquake(found, records, event)


def _sds(
    records: config.Records, sds: config.Sds, event: Event | None
) -> tuple[SourceContents, Reader]:
    """Return the stations of an SDS archive in its window, and their reader."""
    start, end = window(sds, event)
    found = find_sds_stations(sds.folder, start, end, records.stationxml)
    return found, partial(read_sds_station, start=start, end=end)


def read_table(*_: object, table: config.Columns) -> tuple[Stream, tuple[Rejection, ...]]:
    """Read a plain table of samples; file, metadata and name are in its description."""
    described = table.model_dump()
    return read_columns(described.pop("file"), **described), ()
