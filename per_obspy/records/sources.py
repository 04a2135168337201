"""All sources of a configuration under one contract: stations, their files, and their readers."""

import logging
import os
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from obspy import Inventory, Stream
from obspy.core.event import Event

from per_obspy import config
from per_obspy.errors import Rejection, shortened
from per_obspy.names import SHOWN, code_problem
from per_obspy.progress import Progress, silent
from per_obspy.records.archive import hash_if_readable
from per_obspy.records.asdf import find_asdf_stations, has_event, read_asdf_station
from per_obspy.records.earthquakes.choice import (
    OneEarthquake,
    Reader,
    group_event,
    one_earthquake,
    reader_of_event,
)
from per_obspy.records.earthquakes.groups import event_groups
from per_obspy.records.earthquakes.quakeml import EventFile, read_event_file
from per_obspy.records.fdsn.cache import FDSN, Fetched, fetch, fetched_stations
from per_obspy.records.fdsn.request import window
from per_obspy.records.folder import SourceContents, find_stations, read_station
from per_obspy.records.metadata import merged_inventory
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
    earthquake = event and event.event
    folder = None
    # Of several earthquakes in the folder one is screened
    if records.folder:
        limits = records.archives
        found = find_stations(records.folder, records.stationxml, limits, records.settle)
        folder = one_earthquake(found, records, earthquake)
    sources = _served(_contents(records, fetched, earthquake, folder), event)
    if folder is None:
        return sources
    waiting = folder.contents[0][0].waiting
    return sources._replace(earthquakes=folder.earthquakes, waiting=waiting)


def find_path_sources(paths: Sequence[Path]) -> Sources:
    """
    Find the stations of some files and folders; files of a station in several of them are joined.

    Raises
    ------
    CatalogError
        If a path is missing or holds no record.
    """
    found = [find_stations(path) for path in paths]
    groups = event_groups([record for contents in found for record in contents.records])
    if len(groups) > 1:
        log.warning(
            "records of %d earthquakes are used together, they start %s: "
            "name the files of one of them",
            len(groups),
            ", ".join(group.label for group in groups),
        )
    # Records of one earthquake have that of most headers
    agreed = group_event(groups[0]) if len(groups) == 1 else None
    reader = reader_of_event(partial(read_station), agreed)
    # Metadata in one of the paths serves stations of all
    files = defaultdict[str, tuple[Path, ...]](tuple)
    hashes: dict[Path, str] = {}
    for contents in found:
        hashes |= contents.hashes
        for name, station_files in contents.stations.items():
            files[name] += station_files
    inventory = merged_inventory([contents.inventory for contents in found if contents.inventory])
    rejected = tuple(row for contents in found for row in contents.rejected)
    return _served([(SourceContents(files, inventory, rejected, hashes), reader)], None)


def _served(contents: Iterable[tuple[SourceContents, Reader]], event: EventFile | None) -> Sources:
    """Return each station of the first source that has it, with what all sources reject."""
    sources = Sources({}, event, (), {event.path: event.hash} if event else {}, [])
    rejected, expected = list[Rejection](), set[str]()
    for found, reader in contents:
        rejected += found.rejected
        expected |= _expected(found)
        sources.hashes.update(found.hashes)
        # The first source that has a station serves it
        for name, paths in found.stations.items():
            reason = _unusable(name, paths, sources.stations.get(name))
            if reason is not None:
                rejected.append(reason)
                continue
            sources.stations[name] = _station(name, paths, found.inventory, reader, sources.hashes)
    return sources._replace(rejected=tuple(rejected), expected=frozenset(expected))


def _unusable(
    name: str, paths: tuple[Path, ...], earlier: StationSource | None
) -> Rejection | None:
    """Return the row of a station that another source serves, or whose codes name no file."""
    # Codes become names of station files, records and figures
    if problem := code_problem(*name.split(".", 1)):
        files = ", ".join(sorted({str(path) for path in paths}))
        return Rejection("station", shortened(name, SHOWN), files, None, (problem,))
    if earlier is None:
        return None
    reason = f"is also in {os.path.commonpath(earlier.files)}, which comes first"
    return Rejection("station", name, os.path.commonpath(paths), None, (reason,))


def _expected(found: SourceContents) -> set[str]:
    """Return the stations of the metadata and list of a source, with records or without."""
    listed = (row for row in found.rejected if row.kind == "station" and row.source == FDSN)
    networks = found.inventory or ()
    codes = {f"{network.code}.{place.code}" for network in networks for place in network}
    # Names that can be those of files
    usable = (name for name in found.stations if not code_problem(*name.split(".", 1)))
    return codes.union(usable, (row.name for row in listed))


def _station(
    name: str,
    paths: tuple[Path, ...],
    inventory: Inventory | None,
    reader: Reader,
    hashes: dict[Path, str],
) -> StationSource:
    """Return a station with its metadata; each file is hashed once, for all of its stations."""
    for path in paths:
        if path not in hashes:
            hashes[path] = hash_if_readable(path)
    network, station = name.split(".", 1)
    metadata = inventory and inventory.select(network=network, station=station)
    return StationSource(paths, tuple(hashes[path] for path in paths), metadata, reader)


def _event(records: config.Records, fetched: Fetched | None) -> EventFile | None:
    """Return the event: that of the configuration, else the fetched one, else the workspace's."""
    if fetched and fetched.event:  # which is that of the configuration if there is one
        return fetched.event
    if records.event:
        return read_event_file(records.event)
    workspace = records.asdf.file if records.asdf else None
    return read_event_file(workspace) if workspace and has_event(workspace) else None


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
        start, end = window(records.sds, event)
        days = find_sds_stations(records.sds.folder, start, end, records.stationxml)
        yield days, partial(read_sds_station, start=start, end=end)
    # Records processed by others and by services come last
    if records.asdf:
        workspace = find_asdf_stations(records.asdf.file, records.asdf.tag)
        yield workspace, partial(read_asdf_station, tag=records.asdf.tag)
    if fetched:
        yield fetched_stations(fetched), partial(read_station)


def read_table(*_: object, table: config.Columns) -> tuple[Stream, tuple[Rejection, ...]]:
    """Read a plain table of samples; file, metadata and name are in its description."""
    description = table.model_dump()
    return read_columns(description.pop("file"), **description), ()
