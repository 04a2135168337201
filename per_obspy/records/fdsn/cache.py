"""
Records from FDSN web services, kept in a folder that any later run reads without the network.

A cache holds ``event-ID.xml`` and one folder for each window and choice of channels, with
``NET.STA.mseed`` and ``NET.STA.xml`` of every station, and ``NET.STA.json`` with their hashes and
the channels asked for. Files appear whole or not at all and are asked for again only if they have
changed, so that a killed fetch resumes; half-written files (``.….part.…``)
is passed over and removed. ``complete-….json``, a status file of :mod:`per_obspy.resume`, is
written when a request is complete.
"""

from collections import defaultdict
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from obspy import Inventory, UTCDateTime

from per_obspy import config
from per_obspy.errors import Rejection, ServiceError, shortened
from per_obspy.files import is_part, remove_dead_parts
from per_obspy.formats.text.station_text import StationLine, station_lines
from per_obspy.names import SHOWN, code_problem, public_url
from per_obspy.progress import Progress, silent
from per_obspy.records.event_file import EventFile, read_event_file
from per_obspy.records.fdsn.download import Offer, Outcome, fetch_station, station_status
from per_obspy.records.fdsn.event_list import fetched_event
from per_obspy.records.fdsn.providers import base_urls
from per_obspy.records.fdsn.request import (
    Wanted,
    asked_for,
    digest,
    folder_name,
    is_inside,
    other_than_asked,
    station_parameters,
    stations_inside,
    wanted_around,
)
from per_obspy.records.fdsn.web import WebPool, answer, host, web_pool
from per_obspy.records.folder import SourceContents, find_stations
from per_obspy.records.seedlink.server_address import server_address
from per_obspy.resume import (
    Status,
    StatusError,
    changed_outputs,
    earlier_status,
    read_status,
    write_status,
)

#: Source of rejections of stations that a service lists but has no records of.
FDSN = "FDSN"


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
    """

    folder: Path
    event: EventFile | None
    wanted: Wanted
    rejected: tuple[Rejection, ...]
    is_complete: bool = True


def fetch(
    request: config.Fdsn,
    event: Path | None = None,
    progress: Progress = silent,
    again: bool = False,
    pauses: dict[str, float] | None = None,
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

    Raises
    ------
    CatalogError
        If a provider or the event is unknown.
    ServiceError
        If services fail and the cache has no station at all, or the window is not over yet.
    """
    pool = _pool(request, pauses)
    fetched = _requested(pool, request, event)

    # A complete request is answered from the cache
    key = digest((fetched.wanted, request.providers, *request.seedlink))
    status_file = request.cache / f"complete-{key}.json"
    known = None if again else _known_rejections(earlier_status(status_file, key))
    if known is not None:
        return fetched._replace(rejected=known)

    # Everything else needs the services
    end = fetched.wanted.end
    if end > UTCDateTime():
        raise ServiceError(
            f"the wanted window lasts until {end}, which is still to come: fetch after it"
        )
    remove_dead_parts(request.cache)
    rejected, complete = _fetch_missing(pool, request, fetched, progress)
    if complete:
        write_status(status_file, key, cached_hashes(fetched.folder), {"rejected": rejected})
    fetched = fetched._replace(rejected=tuple(rejected), is_complete=complete)
    if not complete and not fetched_stations(fetched).stations:
        raise ServiceError(f"no station could be fetched; {'; '.join(rejected[0].reasons)}")
    return fetched


def _pool(request: config.Fdsn, pauses: dict[str, float] | None) -> WebPool:
    """Return connections with the patience of a request, and the pauses that services demand."""
    limits = (request.longest_answer, request.largest_answer)
    pool = web_pool(request.timeout, request.retries, request.wait, *limits)
    # A pause counts from the next fetch on: requests under way are not called off
    if pauses is not None:
        pool = pool._replace(resting=dict(pauses), demanded=pauses)
    pause = request.longest_pause
    return pool if pause is None else pool._replace(longest_pause=pause)


def _requested(pool: WebPool, request: config.Fdsn, event: Path | None) -> Fetched:
    """Return the place of a request in the cache, with its event and without rejections."""
    if event is None and request.event_id:
        event = fetched_event(pool, request.event_provider, request.event_id, request.cache)
    file = read_event_file(event) if event else None
    wanted = wanted_around(request, file.event if file else None)
    return Fetched(request.cache / folder_name(wanted), file, wanted, ())


def _fetch_missing(
    pool: WebPool, request: config.Fdsn, fetched: Fetched, progress: Progress
) -> tuple[list[Rejection], bool]:
    """Fetch missing parts; return the failures, and whether the request is complete."""
    wanted = fetched.wanted
    bases, rejected = base_urls(pool, request.providers, station_parameters(wanted))
    offers, unlisted, unusable = _offers(pool, bases, wanted)
    rejected += unlisted
    outcomes = _stations(pool, fetched, offers, request, progress)
    complete = not rejected and all(outcome.lasting for outcome in outcomes)
    rejected += unusable
    # Stations without a reason are in the cache
    rejected += [
        Rejection("station", outcome.station, FDSN, None, outcome.reasons)
        for outcome in outcomes
        if outcome.reasons
    ]
    if complete and not offers and not unusable:
        rejected += _no_station(bases, wanted)
    return rejected, complete


def _known_rejections(status: Status | None) -> tuple[Rejection, ...] | None:
    """Return the rejections of a complete request; None if it is none or its status is damaged."""
    try:
        return None if status is None else tuple(map(Rejection.stored, status["rejected"]))
    except (KeyError, TypeError, ValueError):
        return None


def cached_hashes(folder: Path) -> dict[str, str]:
    """Return the hashes of all files of stations in a folder of a cache, seen from the cache."""
    hashes = dict[str, str]()
    for path in sorted(folder.glob("*.json")):
        with suppress(StatusError):
            outputs = read_status(path)["outputs"]
            hashes |= {f"{folder.name}/{name}": known for name, known in outputs.items()}
    return hashes


def fetched_stations(fetched: Fetched) -> SourceContents:
    """
    Return the cached stations of a request, as ``records.folder.find_stations`` does.

    A station whose files are not as they were fetched is a rejection.
    """
    # A station has records, or a status whose records are gone
    names_with_records = _stems(fetched.folder, "*.mseed")
    names = names_with_records | _stems(fetched.folder, "*.json")
    damaged = [row for name in sorted(names) if (row := _damage(fetched.folder, name))]
    left_out = _left_out(fetched.folder, sorted(names))
    broken = {row.name for row in damaged}
    # Metadata alone are no station
    if names_with_records <= broken:
        return SourceContents({}, None, (*fetched.rejected, *damaged, *left_out))
    found = find_stations(fetched.folder)
    others = _others(found, fetched.wanted)
    usable = stations_inside(found.inventory or Inventory(), fetched.wanted) - broken
    usable -= {row.name for row in others}
    # Half a file of a killed fetch has another stem
    stations = _whole_stations(found, usable)
    rejected = (*fetched.rejected, *damaged, *left_out, *others)
    return SourceContents(stations, found.inventory, rejected, found.hashes)


def _whole_stations(found: SourceContents, usable: set[str]) -> dict[str, tuple[Path, ...]]:
    """Return the usable stations of a cache with their files, without half-written ones."""
    files = {
        name: tuple(path for path in paths if path.stem == name)
        for name, paths in found.stations.items()
        if name in usable
    }
    return {name: whole for name, whole in files.items() if whole}


def _others(found: SourceContents, wanted: Wanted) -> list[Rejection]:
    """Return a row per cached station whose file holds records of another request."""
    rows = dict[str, Rejection]()
    for record in found.records:
        if is_part(record.path):
            continue
        # The name of a file is that of its station
        station = record.path.stem
        codes = record.record.split(".")[2:]
        problem = other_than_asked(wanted, (codes[0], codes[1]), record.start, record.end)
        if record.station != station and record.path.suffix == ".mseed":
            problem = f"of another station, {record.station}"
        if problem:
            reason = f"its file in the cache holds records {problem}: asked for {asked_for(wanted)}"
            reason = f"{reason}; remove the file, and it is fetched again"
            rows.setdefault(
                station, Rejection("station", station, str(record.path), None, (reason,))
            )
    return list(rows.values())


def _left_out(folder: Path, names: Iterable[str]) -> list[Rejection]:
    """Return the rows of records that were left out of the answers of services."""
    rows = list[Rejection]()
    for name in names:
        with suppress(StatusError, TypeError, ValueError):
            status = read_status(station_status(folder / f"{name}.mseed"))
            rows += map(Rejection.stored, status.get("left_out", []))
    return rows


def _stems(folder: Path, pattern: str) -> set[str]:
    """Return the names of stations that have a whole file of a kind in a folder."""
    return {path.stem for path in folder.glob(pattern) if not is_part(path)}


def _damage(folder: Path, name: str) -> Rejection | None:
    """Return the row of a cached station whose files are not as they were fetched, else None."""
    path = station_status(folder / f"{name}.mseed")
    # Files without a status may be cut
    try:
        changed = changed_outputs(path, read_status(path))
        reason = f"{changed[0].name} is not as it was fetched" if changed else ""
    except StatusError as error:
        reason = f"{path.name} cannot be read: {shortened(str(error))}"
    if not reason:
        return None
    reason = f"{reason}; it is fetched again when the services answer"
    return Rejection("station", name, str(folder / f"{name}.mseed"), None, (reason,))


def _offers(
    pool: WebPool, bases: list[str], wanted: Wanted
) -> tuple[dict[str, list[Offer]], list[Rejection], list[Rejection]]:
    """Ask every service which stations it has; return offers, failed services, wrong lines."""
    offers: dict[str, list[Offer]] = defaultdict(list)
    rejected, unusable = [], []
    for base in bases:
        url = f"{base}/fdsnws/station/1/query"
        # A service that fails affects only its stations
        try:
            lines, faults = _listed(pool, url, wanted)
        except ServiceError as fault:
            rejected.append(Rejection("service", host(url), public_url(url), None, (str(fault),)))
            continue
        # Several lines of a station are one offer
        unusable += faults
        channels: dict[str, set[tuple[str, str]]] = defaultdict(set)
        for line in lines:
            channels[f"{line.network}.{line.station}"].add((line.location, line.channel))
        for station in sorted(channels):
            offers[station].append(Offer(base, tuple(sorted(channels[station]))))
    return offers, rejected, unusable


def _listed(pool: WebPool, url: str, wanted: Wanted) -> tuple[list[StationLine], list[Rejection]]:
    """
    Return the channels that a service lists of a request, and its lines that cannot be used.

    Raises ``ServiceError`` if its answer is no list, or one of nothing that was asked for.
    """
    # Text is smaller than StationXML by far
    shown = public_url(url)
    content = answer(pool, url, station_parameters(wanted) | {"level": "channel", "format": "text"})
    if not content:
        return [], []
    try:
        lines, faults = station_lines(content)
    except ValueError as error:
        reason = f"answers with data other than a station list: {error}"
        raise ServiceError(f"{shown}: {reason}") from error
    asked = [line for line in lines if not _other_line(wanted, line)]
    # Nothing that was asked for is a fault of the service, not the absence of stations
    if lines and not asked:
        others = "; ".join(dict.fromkeys(_other_line(wanted, line) for line in lines))
        reason = f"lists only stations that were not asked for: {shortened(others, 300)}"
        raise ServiceError(f"{shown}: {reason}: asked for {asked_for(wanted)}")
    named, unnamed = _named(asked, shown)
    rows = [Rejection("station", name, shown, line, (reason,)) for line, name, reason in faults]
    return named, [*rows, *unnamed]


def _other_line(wanted: Wanted, line: StationLine) -> str:
    """Return what distinguishes a line of a list from a request; empty if nothing does."""
    # The place decides before the channel
    place = (line.latitude, line.longitude)
    problem = other_than_asked(wanted, (line.location, line.channel), line.start, line.end)
    if not is_inside(wanted, line.network, line.station, place):
        problem = f"at {line.latitude:g}, {line.longitude:g}, which the request does not cover"
    return f"{shortened(f'{line.network}.{line.station}', SHOWN)} {problem}" if problem else ""


def _named(lines: list[StationLine], url: str) -> tuple[list[StationLine], list[Rejection]]:
    """Return the lines of stations whose codes can name a file, and a row per other station."""
    rows = dict[str, Rejection]()
    for line in lines:
        name = f"{line.network}.{line.station}"
        # The first wrong code of a station is its reason
        if problem := code_problem(line.network, line.station, line.location, line.channel):
            row = Rejection("station", shortened(name, SHOWN), url, None, (problem,))
            rows.setdefault(name, row)
    named = [line for line in lines if f"{line.network}.{line.station}" not in rows]
    return named, list(rows.values())


def _stations(
    pool: WebPool,
    fetched: Fetched,
    offers: dict[str, list[Offer]],
    request: config.Fdsn,
    progress: Progress,
) -> list[Outcome]:
    """Fetch several stations at the same time; when interrupted, leave the rest for later."""
    # Files are whole one by one: an interruption loses only those under way
    threads = ThreadPoolExecutor(request.connections)
    live = [server_address(server) for server in request.seedlink]
    outcomes = []
    try:
        futures = [
            threads.submit(
                fetch_station, pool, fetched.wanted, fetched.folder, name, services, live
            )
            for name, services in offers.items()
        ]
        for future in as_completed(futures):
            outcomes.append(future.result())
            progress("fetching", len(outcomes), len(offers))
    finally:
        threads.shutdown(cancel_futures=True)
    return sorted(outcomes)


def _no_station(bases: list[str], wanted: Wanted) -> list[Rejection]:
    """Return one row per service that has no station inside the circle."""
    # Circle, channels and window of the request
    place = f"{wanted.radius:.3g} degrees of {wanted.latitude:g}, {wanted.longitude:g}"
    channels = f"channels {','.join(wanted.channels)} from {wanted.start} to {wanted.end}"
    reason = f"no station within {place} has {channels}"
    return [Rejection("service", host(base), public_url(base), None, (reason,)) for base in bases]
