"""
Records from FDSN web services, kept in a folder that any later run reads without the network.

A cache holds ``event-ID.xml`` and one folder for each window and choice of channels, with
``NET.STA.mseed`` and ``NET.STA.xml`` of every station. Files appear whole or not at all and are
never asked for again, so that a killed fetch goes on where it stopped; what it left half written
(``.….part.…``) is passed over. ``complete-….json`` says that a request has nothing left to ask for.
"""

import json
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import NamedTuple

import obspy
import urllib3
from obspy import Inventory, UTCDateTime

from per_obspy import config
from per_obspy.errors import RecordRejected, Rejection, ServiceError
from per_obspy.files import written_whole
from per_obspy.progress import Progress, silent
from per_obspy.records.events import fetched_event, read_event
from per_obspy.records.fdsn.download import Offer, Outcome, fetch_station
from per_obspy.records.fdsn.providers import base_urls
from per_obspy.records.fdsn.request import (
    Wanted,
    digest,
    folder_name,
    station_parameters,
    stations_inside,
    wanted_around,
)
from per_obspy.records.fdsn.web import answer, host, web_pool
from per_obspy.records.folder import FolderContents, find_stations
from per_obspy.records.obspy_readers import read_bytes_with_obspy


class Fetched(NamedTuple):
    """
    What a cache holds of a request.

    Attributes
    ----------
    folder : Path
        With MiniSEED and StationXML of every station.
    event : Path or None
        QuakeML file.
    wanted : Wanted
        What was asked for.
    rejected : tuple of Rejection
        Stations and services that failed, with every reason.
    """

    folder: Path
    event: Path | None
    wanted: Wanted
    rejected: tuple[Rejection, ...]


def fetch(
    request: config.Fdsn,
    event: Path | None = None,
    progress: Progress = silent,
    again: bool = False,
) -> Fetched:
    """
    Bring into the cache what it lacks of a request; nothing is asked for if it lacks nothing.

    Parameters
    ----------
    request : config.Fdsn
        Services, circle, window and codes.
    event : Path, optional
        QuakeML file, instead of the event that the request names.
    progress : callable
        Told of every station: stage, done, total.
    again : bool
        Whether to ask again for stations of which every service had no data.

    Raises
    ------
    CatalogError
        If a provider or the event is unknown.
    ServiceError
        If services fail and the cache has no station at all, or the window is not over yet.
    """
    pool = web_pool(request.timeout, request.retries, request.wait)
    if event is None and request.event_id:
        event = fetched_event(pool, request.event_provider, request.event_id, request.cache)
    wanted = wanted_around(request, read_event(event) if event else None)
    folder = request.cache / folder_name(wanted)
    mark = request.cache / f"complete-{digest((wanted, request.providers))}.json"
    if mark.is_file() and not again:
        return Fetched(folder, event, wanted, _noted(mark))
    if wanted.end > UTCDateTime():
        raise ServiceError(
            f"the wanted window lasts until {wanted.end}, which is still to come: fetch after it"
        )
    bases, rejected = base_urls(pool, request.providers, station_parameters(wanted))
    offers, unlisted = _offers(pool, bases, wanted)
    rejected += unlisted
    outcomes = _stations(pool, wanted, folder, offers, request.connections, progress)
    complete = not rejected and all(outcome.lasting for outcome in outcomes)
    rejected += [
        Rejection("station", one.station, "FDSN", None, one.reasons)
        for one in outcomes
        if one.reasons
    ]
    if complete:
        rejected += [] if offers else _nobody(bases, wanted)
        with written_whole(mark) as part:
            part.write_text(json.dumps(rejected), encoding="utf-8")
    fetched = Fetched(folder, event, wanted, tuple(rejected))
    if not complete and not fetched_stations(fetched).stations:
        raise ServiceError(f"nothing could be fetched; {'; '.join(rejected[0].reasons)}")
    return fetched


def fetched_stations(fetched: Fetched) -> FolderContents:
    """Return what the cache holds of a request, in the words of ``records.folder.find_stations``."""
    if not any(fetched.folder.glob("*.mseed")):
        return FolderContents({}, None, fetched.rejected)
    found = find_stations(fetched.folder)
    inside = stations_inside(found.inventory or Inventory(), fetched.wanted)
    whole = {
        name: tuple(path for path in paths if path.stem == name)
        for name, paths in found.stations.items()
    }
    stations = {name: paths for name, paths in whole.items() if paths and name in inside}
    return FolderContents(stations, found.inventory, fetched.rejected)


def _offers(
    pool: urllib3.PoolManager, bases: list[str], wanted: Wanted
) -> tuple[dict[str, list[Offer]], list[Rejection]]:
    """Ask every service which stations it has, and return who offers what."""
    offers: dict[str, list[Offer]] = defaultdict(list)
    rejected = []
    for base in bases:
        url = f"{base}/fdsnws/station/1/query"
        try:
            listed = _listed(pool, url, wanted)
        except (ServiceError, RecordRejected) as fault:
            rejected.append(Rejection("service", host(url), url, None, (str(fault),)))
            continue
        for station in sorted(stations_inside(listed, wanted)):
            offers[station].append(Offer(base, _channels(listed, station)))
    return offers, rejected


def _listed(pool: urllib3.PoolManager, url: str, wanted: Wanted) -> Inventory:
    content = answer(pool, url, station_parameters(wanted) | {"level": "channel", "format": "text"})
    if not content:
        return Inventory()
    inventory: Inventory = read_bytes_with_obspy(
        obspy.read_inventory, content, url, format="STATIONTXT"
    )
    return inventory


def _channels(inventory: Inventory, station: str) -> tuple[tuple[str, str], ...]:
    network, code = station.split(".", 1)
    selected = inventory.select(network=network, station=code)
    return tuple(
        sorted(
            {
                (channel.location_code, channel.code)
                for network in selected
                for place in network
                for channel in place
            }
        )
    )


def _stations(
    pool: urllib3.PoolManager,
    wanted: Wanted,
    folder: Path,
    offers: dict[str, list[Offer]],
    connections: int,
    progress: Progress,
) -> list[Outcome]:
    """Fetch several stations at the same time; when interrupted, leave the rest for the next time."""
    threads = ThreadPoolExecutor(connections)
    outcomes = []
    try:
        futures = [
            threads.submit(fetch_station, pool, wanted, folder, name, each)
            for name, each in offers.items()
        ]
        for future in as_completed(futures):
            outcomes.append(future.result())
            progress("fetching", len(outcomes), len(offers))
    finally:
        threads.shutdown(cancel_futures=True)
    return sorted(outcomes)


def _nobody(bases: list[str], wanted: Wanted) -> list[Rejection]:
    said = f"no station within {wanted.radius:.3g} degrees of {wanted.latitude:g}, {wanted.longitude:g}"
    reason = f"{said} has channels {','.join(wanted.channels)} from {wanted.start} to {wanted.end}"
    return [Rejection("service", host(base), base, None, (reason,)) for base in bases]


def _noted(mark: Path) -> tuple[Rejection, ...]:
    """Return the rejections that a complete fetch has noted."""
    return tuple(
        Rejection(kind, name, source, row, tuple(reasons))
        for kind, name, source, row, reasons in json.loads(mark.read_text(encoding="utf-8"))
    )
