"""All sources of a configuration under one contract: the stations, their files, and how these are read."""

import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

from obspy import Inventory, Stream

from per_obspy import config
from per_obspy.errors import Rejection
from per_obspy.progress import Progress, silent
from per_obspy.records.asdf import find_asdf_stations, has_event, read_asdf_station
from per_obspy.records.events import read_event
from per_obspy.records.fdsn.cache import Fetched, fetch, fetched_stations
from per_obspy.records.fdsn.request import window
from per_obspy.records.folder import FolderContents, find_stations, read_station
from per_obspy.records.sds import find_sds_stations, read_sds_station
from per_obspy.records.text_table import read_columns

#: reads a station from its files, metadata and name, as ``records.folder.read_station`` does
Reader = partial[tuple[Stream, tuple[Rejection, ...]]]


class Source(NamedTuple):
    """
    Where one station comes from.

    Attributes
    ----------
    files : tuple of Path
        Everything that is read.
    inventory : Inventory or None
        What StationXML says of the station.
    reader : partial
        How they are read; its function's name and keywords tell all that matters.
    """

    files: tuple[Path, ...]
    inventory: Inventory | None
    reader: Reader


class Sources(NamedTuple):
    """
    What all sources of a configuration have.

    Attributes
    ----------
    stations : dict
        ``"NET.STA"`` -> :class:`Source`.
    event : Path or None
        QuakeML file or ASDF workspace with the event.
    rejected : tuple of Rejection
        What cannot be used, with every reason.
    """

    stations: dict[str, Source]
    event: Path | None
    rejected: tuple[Rejection, ...]


def fetched_records(records: config.Records | None, progress: Progress = silent) -> Fetched | None:
    """Bring the configured FDSN records into their cache; None if there are none. See ``records.fdsn.fetch``."""
    return fetch(records.fdsn, records.event, progress) if records and records.fdsn else None


def find_sources(records: config.Records, fetched: Fetched | None) -> Sources:
    """
    Find the stations of all configured sources; one that several sources have is taken from the first.

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
    event = _event(records, fetched)
    if event:
        read_event(event)  # a wrong file stops the run here, not every station
    stations: dict[str, Source] = {}
    rejected: list[Rejection] = []
    for found, reader in _contents(records, fetched, event):
        rejected += found.rejected
        for name, paths in found.stations.items():
            if name in stations:
                reason = f"is also in {os.path.commonpath(stations[name].files)}, which comes first"
                rejected.append(
                    Rejection("station", name, os.path.commonpath(paths), None, (reason,))
                )
                continue
            stations[name] = Source(paths, _known(found.inventory, name), reader)
    return Sources(stations, event, tuple(rejected))


def input_files(records: config.Records | None, fetched: Fetched | None) -> list[Path]:
    """Return every file that the result may depend on; of an SDS archive the day files of the window."""
    if records is None:
        return []
    given = [
        records.folder,
        records.stationxml,
        records.event,
        *(table.file for table in records.columns),
    ]
    given += [fetched.folder, fetched.event] if fetched else []
    given += [records.asdf.file] if records.asdf else []
    given += [records.shakemap, records.shakemap_uncertainty]
    files = [
        path for one in given if one for path in (sorted(one.rglob("*")) if one.is_dir() else [one])
    ]
    if records.sds:
        found, _ = _sds(records, records.sds, records.event)
        files += [path for paths in found.stations.values() for path in paths]
    return [path for path in files if path.is_file()]


def _event(records: config.Records, fetched: Fetched | None) -> Path | None:
    in_workspace = records.asdf.file if records.asdf and has_event(records.asdf.file) else None
    return records.event or (fetched and fetched.event) or in_workspace


def _known(inventory: Inventory | None, name: str) -> Inventory | None:
    network, station = name.split(".", 1)
    return inventory and inventory.select(network=network, station=station)


def _contents(
    records: config.Records, fetched: Fetched | None, event: Path | None
) -> Iterator[tuple[FolderContents, Reader]]:
    """Give what each source has, and how it is read."""
    for table in records.columns:
        name = f"{table.network}.{table.station}"
        yield FolderContents({name: (table.file,)}, None, ()), partial(read_table, table=table)
    if records.folder:
        yield find_stations(records.folder, records.stationxml), partial(read_station)
    if records.sds:
        yield _sds(records, records.sds, event)
    if records.asdf:
        found = find_asdf_stations(records.asdf.file, records.asdf.tag)
        yield found, partial(read_asdf_station, tag=records.asdf.tag)
    if fetched:
        yield fetched_stations(fetched), partial(read_station)


def _sds(
    records: config.Records, sds: config.Sds, event: Path | None
) -> tuple[FolderContents, Reader]:
    start, end = window(sds, read_event(event) if event else None)
    found = find_sds_stations(sds.folder, start, end, records.stationxml)
    return found, partial(read_sds_station, start=start, end=end)


def read_table(*_: object, table: config.Columns) -> tuple[Stream, tuple[Rejection, ...]]:
    """Read a plain table of samples; files, metadata and name, which other readers need, are in its description."""
    described = table.model_dump()
    return read_columns(described.pop("file"), **described), ()
