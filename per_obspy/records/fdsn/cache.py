"""
Records from FDSN web services, kept in a folder that any later run reads without the network.

A cache holds ``event-ID.xml`` and one folder for each window and choice of channels, with
``NET.STA.mseed`` and ``NET.STA.xml`` of every station, and ``NET.STA.json`` with their hashes and
the channels asked for. Files appear whole or not at all and are asked for again only if they have
changed, so that a killed fetch resumes; half-written files (``.….part.…``)
are passed over and removed. ``complete-….json``, a status file of :mod:`per_obspy.resume`, is
written when a request is complete.
"""

import math
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from obspy import Inventory, UTCDateTime

from per_obspy import config
from per_obspy.errors import Rejection, ServiceError, require_extra, shortened
from per_obspy.files import is_part, remove_dead_parts, remove_file
from per_obspy.names import public_url
from per_obspy.progress import Progress, silent
from per_obspy.records.earthquakes.quakeml import EventFile, read_event_file
from per_obspy.records.earthquakes.services import event_url, fetched_event
from per_obspy.records.earthquakes.shakemap_product import (
    STATUS,
    ShakeMapFiles,
    cached_shakemap,
    fetch_shakemap,
)
from per_obspy.records.fdsn.download import (
    RECORDS,
    Outcome,
    ends_early,
    fetch_station,
    station_status,
)
from per_obspy.records.fdsn.providers import Offer, list_stations
from per_obspy.records.fdsn.request import (
    Wanted,
    asked_for,
    digest,
    folder_name,
    other_than_asked,
    stations_inside,
    wanted_around,
)
from per_obspy.records.fdsn.web import WebPool
from per_obspy.records.folder import RecordSource, find_stations
from per_obspy.records.seedlink import server_address
from per_obspy.resume import StatusError, changed_outputs, earlier_status, read_status, write_status

#: Source of rejections of stations that a service lists but has no records of.
FDSN = "FDSN"

#: Longest pause that a service may demand before a watcher leaves it for its next look, s.
LONGEST_PAUSE = 5.0


class Fetched(NamedTuple):
    """
    Content of a cache for a request.

    Attributes
    ----------
    folder : Path
        With MiniSEED and StationXML of every station.
    event : EventFile or None
        QuakeML file and its event.
    wanted : Wanted
        Circle, window and channels of the request.
    rejected : tuple of Rejection
        Stations and services that failed, with every reason.
    is_complete : bool
        Whether every service and station answered, with records or that there are none.
    shakemap : ShakeMapFiles or None
        ShakeMap, if the request wants one and there is one.
    """

    folder: Path
    event: EventFile | None
    wanted: Wanted
    rejected: tuple[Rejection, ...]
    is_complete: bool = True
    shakemap: ShakeMapFiles | None = None


def fetch(
    request: config.Fdsn,
    event: Path | None = None,
    progress: Progress = silent,
    again: bool = False,
    pauses: dict[str, float] | None = None,
    cut: bool = False,
) -> Fetched:
    """
    Download the missing parts of a request into the cache; ask for none if it is complete.

    Parameters
    ----------
    request : config.Fdsn
        Services, circle, window and codes.
    event : Path, optional
        QuakeML file, instead of the event that the request names.
    progress : callable
        Called for every station: stage, done, total.
    again : bool
        Whether to ask again for stations without data at every service.
    pauses : dict, optional
        Host -> s for which it is not asked; gets the pauses that services demand.
    cut : bool
        Whether to ask again for records that end before the window, as those of a service minutes
        after an earthquake; where that fails they stay.

    Raises
    ------
    CatalogError
        If a provider or the event is unknown.
    MissingExtra
        If SeedLink servers are named and their client is not installed.
    ServiceError
        If services fail and the cache has neither a station nor a ShakeMap, or the window is not
        over yet and there is no ShakeMap.
    """
    pool = _pool(request, pauses)
    if event is None and request.event_id:
        event = fetched_event(pool, request.event_provider, request.event_id, request.cache)
    file = read_event_file(event) if event else None
    wanted = wanted_around(request, file.event if file else None)
    fetched = Fetched(request.cache / folder_name(wanted), file, wanted, ())
    # Minutes after an earthquake there may be a map, and no record yet
    if request.shakemap and request.event_id:
        fetched = _with_shakemap(pool, request, request.event_id, fetched, again)
    records = _fetch_records(pool, request, fetched, progress, again, cut)
    return records._replace(
        rejected=(*fetched.rejected, *records.rejected),
        is_complete=fetched.is_complete and records.is_complete,
    )


def _with_shakemap(
    pool: WebPool, request: config.Fdsn, event_id: str, fetched: Fetched, again: bool
) -> Fetched:
    """Add the ShakeMap; one that is not there yet, or a service that fails, is a row."""
    known, version = known_shakemap(request), _version(request)
    if known and not again:
        return fetched._replace(shakemap=known)
    # An earlier map stays in use where the service fails
    reason = f"no ShakeMap of {event_id} yet: the next run and `per-obspy watch` ask again"
    try:
        found = fetch_shakemap(pool, request.event_provider, event_id, request.cache, version)
        is_complete = True
    except ServiceError as error:
        found, is_complete, reason = known, False, str(error)
    if found and is_complete:
        return fetched._replace(shakemap=found)
    # A map that was withdrawn serves no run
    if found is None:
        remove_file(request.cache / STATUS)
    url = public_url(event_url(request.event_provider))
    rows = (Rejection("service", "ShakeMap", url, None, (reason,)),)
    return fetched._replace(rejected=rows, is_complete=is_complete, shakemap=found)


def known_shakemap(request: config.Fdsn) -> ShakeMapFiles | None:
    """Return the ShakeMap of a request that is in its cache."""
    if not (request.shakemap and request.event_id):
        return None
    return cached_shakemap(request.cache, request.event_id, _version(request))


def _version(request: config.Fdsn) -> str | None:
    """Return the wanted version of a ShakeMap, None for the preferred one."""
    return None if request.shakemap_version is None else str(request.shakemap_version)


def _fetch_records(
    pool: WebPool,
    request: config.Fdsn,
    fetched: Fetched,
    progress: Progress,
    again: bool,
    cut: bool,
) -> Fetched:
    """Return the content with the records, and only their rejections."""
    wanted = fetched.wanted
    # A complete request is answered from the cache
    key = digest((wanted, request.providers, *request.seedlink))
    status = request.cache / f"complete-{key}.json"
    rejected = None if again else _complete_rejections(status, key)
    if rejected is not None:
        return fetched._replace(rejected=rejected)
    # Everything else needs the services
    try:
        fetched = _ask_services(pool, request, fetched, progress, cut)
    except ServiceError as error:
        if fetched.shakemap is None:
            raise
        providers = ", ".join(map(public_url, request.providers))
        row = Rejection("service", FDSN, providers, None, (str(error),))
        return fetched._replace(rejected=(row,), is_complete=False)
    if fetched.is_complete:
        facts = {"rejected": fetched.rejected}
        write_status(status, key, cached_hashes(fetched.folder), facts)
    elif fetched.shakemap is None and not fetched_stations(fetched).stations:
        reasons = "; ".join(fetched.rejected[0].reasons)
        raise ServiceError(f"no station could be fetched; {reasons}")
    return fetched


def _ask_services(
    pool: WebPool, request: config.Fdsn, fetched: Fetched, progress: Progress, cut: bool
) -> Fetched:
    """Fetch missing parts; return the content with the services and stations that failed."""
    wanted = fetched.wanted
    if wanted.end > UTCDateTime():
        reason = "which is still to come: fetch after it"
        raise ServiceError(f"the wanted window lasts until {wanted.end}, {reason}")
    if request.seedlink:
        require_extra("seedlink", "seedlink_client")
    remove_dead_parts(request.cache)
    listed = list_stations(pool, request.providers, wanted)
    outcomes = _outcomes(pool, fetched, listed.offers, request, progress, cut)
    # Stations without a reason are in the cache
    rows = [
        Rejection("station", outcome.station, FDSN, None, outcome.reasons)
        for outcome in outcomes
        if outcome.reasons
    ]
    is_complete = not listed.failed and all(outcome.lasting for outcome in outcomes)
    rejected = (*listed.failed, *listed.unusable, *rows)
    return fetched._replace(rejected=rejected, is_complete=is_complete)


def _pool(request: config.Fdsn, pauses: dict[str, float] | None) -> WebPool:
    """Return connections with the patience of a request, and the pauses that services demand."""
    return WebPool(
        request.timeout,
        request.retries,
        request.wait,
        # Who keeps the pauses asks again later; others wait for the service
        longest_pause=math.inf if pauses is None else LONGEST_PAUSE,
        # A pause counts from the next fetch on: requests under way are not called off
        resting=dict(pauses or {}),
        demanded=pauses,
    )


def _complete_rejections(path: Path, key: str) -> tuple[Rejection, ...] | None:
    """Return the rejections of a complete request; None if it is none or its status is damaged."""
    status = earlier_status(path, key)
    try:
        return None if status is None else tuple(map(Rejection.stored, status["rejected"]))
    except (KeyError, TypeError, ValueError):
        return None


def _outcomes(
    pool: WebPool,
    fetched: Fetched,
    offers: dict[str, list[Offer]],
    request: config.Fdsn,
    progress: Progress,
    cut: bool,
) -> list[Outcome]:
    """Fetch several stations at the same time; when interrupted, leave the rest for later."""
    # Files are whole one by one: an interruption loses only those under way
    threads = ThreadPoolExecutor(request.connections)
    live = [server_address(server) for server in request.seedlink]
    place = (pool, fetched.wanted, fetched.folder)
    outcomes = []
    try:
        futures = [
            threads.submit(fetch_station, *place, name, services, live, cut)
            for name, services in offers.items()
        ]
        for future in as_completed(futures):
            outcomes.append(future.result())
            progress("fetching", len(outcomes), len(offers))
    finally:
        threads.shutdown(cancel_futures=True)
    return sorted(outcomes)


def cached_hashes(folder: Path) -> dict[str, str]:
    """Return the hashes of all files of stations in a folder of a cache, seen from the cache."""
    hashes = dict[str, str]()
    for path in sorted(folder.glob("*.json")):
        with suppress(StatusError):
            outputs = read_status(path)["outputs"]
            hashes |= {f"{folder.name}/{name}": known for name, known in outputs.items()}
    return hashes


def has_cut_records(fetched: Fetched) -> bool:
    """Return whether the cache has records that end before the window of a request."""
    files = fetched.folder.glob(f"*{RECORDS}")
    return any(ends_early(file, fetched.wanted.end) for file in files if not is_part(file))


def fetched_stations(fetched: Fetched) -> RecordSource:
    """
    Return the cached stations of a request, as ``records.folder.find_stations`` does.

    A station whose files are not as they were fetched is a rejection.
    """
    # A station has records, or a status whose records are gone
    with_records, with_status = (_stems(fetched.folder, suffix) for suffix in (RECORDS, ".json"))
    damaged, left_out = list[Rejection](), list[Rejection]()
    for name in sorted(with_records | with_status):
        damaged += _damage(fetched.folder / f"{name}{RECORDS}", left_out)
    broken = {row.name for row in damaged}
    rejected = (*fetched.rejected, *damaged, *left_out)
    # Metadata alone are no station
    if with_records <= broken:
        return RecordSource({}, None, rejected)
    contents = find_stations(fetched.folder)
    others = _others(contents, fetched.wanted)
    usable = stations_inside(contents.inventory or Inventory(), fetched.wanted)
    usable -= broken | {row.name for row in others}
    files = {name: _whole_files(contents, name) for name in sorted(usable)}
    stations = {name: paths for name, paths in files.items() if paths}
    return RecordSource(stations, contents.inventory, (*rejected, *others), contents.hashes)


def _whole_files(contents: RecordSource, station: str) -> tuple[Path, ...]:
    """Return the files of a station; half a file of a killed fetch has another stem."""
    return tuple(path for path in contents.stations.get(station, ()) if path.stem == station)


def _stems(folder: Path, suffix: str) -> set[str]:
    """Return the names of stations that have a whole file of a kind in a folder."""
    return {path.stem for path in folder.glob(f"*{suffix}") if not is_part(path)}


def _damage(records: Path, left_out: list[Rejection]) -> list[Rejection]:
    """Return a row if the files of a station are not as they were fetched; add its stored rows."""
    path = station_status(records)
    # Files without a status may be cut
    try:
        status = read_status(path)
        changed = changed_outputs(path, status)
        reason = f"{changed[0].name} is not as it was fetched" if changed else ""
        # Records that were left out of the answers of services
        with suppress(TypeError, ValueError):
            left_out.extend(map(Rejection.stored, status.get("left_out", [])))
    except StatusError as error:
        reason = f"{path.name} cannot be read: {shortened(str(error))}"
    if not reason:
        return []
    reason = f"{reason}; it is fetched again when the services answer"
    return [Rejection("station", records.stem, str(records), None, (reason,))]


def _others(contents: RecordSource, wanted: Wanted) -> list[Rejection]:
    """Return a row per cached station whose file holds records of another request."""
    rows = dict[str, Rejection]()
    for record in contents.records:
        if is_part(record.path):
            continue
        # The name of a file is that of its station
        station = record.path.stem
        codes = record.record.split(".")[2:]
        problem = other_than_asked(wanted, (codes[0], codes[1]), record.start, record.end)
        if record.station != station and record.path.suffix == RECORDS:
            problem = f"of another station, {record.station}"
        if problem:
            reason = f"its file in the cache holds records {problem}: asked for {asked_for(wanted)}"
            reason = f"{reason}; remove the file, and it is fetched again"
            rows.setdefault(
                station, Rejection("station", station, str(record.path), None, (reason,))
            )
    return list(rows.values())
