"""Earthquakes as an FDSN event service or a folder of QuakeML files lists them."""

import logging
import time
from collections.abc import Mapping
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

from per_obspy.config import Watch
from per_obspy.errors import CatalogError, RecordRejected, ServiceError, shortened
from per_obspy.files import is_part, reading
from per_obspy.names import public_url
from per_obspy.records.earthquakes.earthquake import Earthquake
from per_obspy.records.earthquakes.quakeml import (
    earthquake_of,
    events_of,
    plain_quakeml,
    read_quakeml,
)
from per_obspy.records.earthquakes.services import event_content, listed_events
from per_obspy.records.fdsn.web import WebPool
from per_obspy.watch.relevance import Circle
from per_obspy.watch.state import WatchState, moment

log = logging.getLogger(__name__)

#: Patience with an event service: s, retries, s, s and bytes of an answer.
_PATIENCE = (30.0, 2, 1.0, 120.0, 64 * 2**20)

#: Longest pause that a service may demand before it is left for the next poll, s.
_LONGEST_PAUSE = 5.0

#: Changes are asked for from this long before the latest poll, s: clocks differ.
OVERLAP = 600.0

#: Difference of origin times from which an answer is another earthquake, s (reasoned: revisions
#: move an origin by less than a minute, aftershocks that are listed come minutes later).
OTHER_EVENT = 600.0

#: Largest number of earthquakes in one request.
MOST_EVENTS = 20_000

#: Suffixes of QuakeML files.
SUFFIXES = (".xml", ".quakeml")

#: Age of a file that cannot be read before it counts as wrong, s: it may be half written.
SETTLED = 10.0


class Feed(NamedTuple):
    """Earthquakes that are new or may have changed."""

    #: Identifier -> facts.
    rows: dict[str, Earthquake]
    #: Identifier -> name of its QuakeML file; empty if a service lists them.
    files: dict[str, str]
    #: Lines and files that cannot be read.
    problems: tuple[str, ...]
    #: Of a folder: name of a file -> size and time of change, as they were read.
    seen: dict[str, tuple[int, int]]


def read_feed(watch: Watch, state: WatchState, circle: Circle, now: datetime) -> Feed:
    """
    Return the earthquakes that a service or folder lists as new or changed.

    Parameters
    ----------
    watch : Watch
        Where they are listed.
    state : WatchState
        Since when, and which files were read before.
    circle : Circle
        Holds every epicentre that may matter.
    now : datetime
        With its zone.

    Raises
    ------
    CatalogError
        If the service is unknown or the folder cannot be read.
    ServiceError
        If the service does not answer, or its answer is no list.
    """
    if watch.folder is not None:
        return _folder_feed(watch.folder, state.seen)
    query, pool = _query(watch, circle, now), _pool()
    # A time that is still to come was noted before the clock was put back
    if not watch.updatedafter or state.since is None or moment(state.since) > now:
        rows, problems = _listed(pool, watch, query)
    else:
        since = moment(state.since) - timedelta(seconds=OVERLAP)
        rows, problems = _listed_since(pool, watch, query, f"{since:%Y-%m-%dT%H:%M:%S}")
    return Feed({row.event_id: row for row in rows}, {}, tuple(problems), {})


def _pool() -> WebPool:
    """Return the connection pool for an event service."""
    return WebPool(*_PATIENCE, longest_pause=_LONGEST_PAUSE)


def _query(watch: Watch, circle: Circle, now: datetime) -> dict[str, str]:
    """Return the parameters of the event service."""
    start = now - timedelta(seconds=watch.oldest)
    query = {
        "starttime": f"{start:%Y-%m-%dT%H:%M:%S}",
        "orderby": "time",
        "limit": f"{MOST_EVENTS}",
    }
    # A circle of the whole Earth excludes no event
    if circle.radius < 180.0:
        place = {"latitude": circle.latitude, "longitude": circle.longitude}
        query |= {name: f"{value:.4f}" for name, value in place.items()}
        query["maxradius"] = f"{circle.radius:.4f}"
    return query


def _listed_since(
    pool: WebPool, watch: Watch, query: Mapping[str, str], since: str
) -> tuple[list[Earthquake], list[str]]:
    """Return the earthquakes changed since a time; all if the service lacks that parameter."""
    try:
        return _listed(pool, watch, {**query, "updatedafter": since})
    except ServiceError as error:
        if "HTTP 400" not in str(error):
            raise
        log.info("%s: no updatedafter, everything is asked for", public_url(watch.service or ""))
        return _listed(pool, watch, query)


def _listed(
    pool: WebPool, watch: Watch, query: Mapping[str, str]
) -> tuple[list[Earthquake], list[str]]:
    """Return the listed earthquakes; beyond the limit of a list also all strong enough ones."""
    service = watch.service or ""
    rows, problems = listed_events(pool, service, query)
    if len(rows) < MOST_EVENTS:
        return rows, problems
    # Weak ones must not crowd out strong ones
    smallest = min(reach.magnitude for reach in watch.magnitudes)
    log.warning(
        "%s: lists %d earthquakes or more: asked again from magnitude %g",
        *(public_url(service), MOST_EVENTS, smallest),
    )
    strong, others = listed_events(pool, service, {**query, "minmagnitude": f"{smallest:g}"})
    return [*rows, *strong], [*problems, *others]


def _folder_feed(folder: Path, seen: Mapping[str, tuple[int, int]]) -> Feed:
    """Return the earthquakes of the files of a folder that are new or have changed."""
    feed = Feed({}, {}, (), {})
    problems = list[str]()
    for path in _quakeml_files(folder):
        # A file that vanishes in between is that of a deleted earthquake
        try:
            facts = path.stat()
        except OSError:
            continue
        mark = (facts.st_size, facts.st_mtime_ns)
        try:
            events, faults = read_quakeml(path) if seen.get(path.name) != mark else ({}, [])
        except CatalogError as error:
            # One that is being written is read at the next poll
            if time.time() - facts.st_mtime >= SETTLED:
                problems.append(f"{path.name}: {error.problem}")
            continue
        problems += faults
        feed.rows.update({name: earthquake_of(event) for name, event in events.items()})
        feed.files.update(dict.fromkeys(events, path.name))
        feed.seen[path.name] = mark
    return feed._replace(problems=tuple(problems))


def _quakeml_files(folder: Path) -> list[Path]:
    """Return the QuakeML files of a folder, sorted; raise ``CatalogError`` if it cannot be read."""
    with reading(folder):
        paths = sorted(folder.iterdir())
    return [path for path in paths if path.suffix.lower() in SUFFIXES and not is_part(path)]


def present_event(
    watch: Watch, event_id: str, file: str, time: str
) -> tuple[Earthquake, bytes] | None:
    """
    Return current facts of an earthquake and QuakeML of them; None if it has been deleted.

    Parameters
    ----------
    watch : Watch
        Where earthquakes are listed.
    event_id : str
        As the list has it.
    file : str
        Its QuakeML file in the folder, if there is one.
    time : str
        Its origin time as it was listed: an answer of another time is another earthquake.

    Raises
    ------
    CatalogError
        If the file is no QuakeML, or the facts cannot be true.
    ServiceError
        If the service does not answer, or its answer is not the earthquake.
    """
    # A service is asked by the identifier, a file may hold several
    if watch.folder is None:
        event = _event_of_service(watch.service or "", event_id)
    else:
        path = watch.folder / file
        event = read_quakeml(path)[0].get(event_id) if path.is_file() else None
    if event is None:
        return None
    row = earthquake_of(event)._replace(event_id=event_id)
    if problem := row.fault:
        raise CatalogError(shortened(event_id, 80), problem)
    # An update moves an origin by seconds
    if abs((moment(row.time) - moment(time)).total_seconds()) > OTHER_EVENT:
        source = public_url(watch.service or str(watch.folder))
        reason = f"answers for {shortened(event_id, 80)} with an earthquake of {row.time[:19]}"
        raise ServiceError(f"{source}: {reason}, listed was {time[:19]}")
    return row, plain_quakeml(event, event_id)


def _event_of_service(service: str, event_id: str) -> Any:
    """Return an earthquake from its service, None if the service has no such earthquake."""
    content = event_content(_pool(), service, event_id)
    if not content:
        return None
    source = public_url(service)
    try:
        (event,) = events_of(content, source)
        earthquake_of(event)
    except (RecordRejected, ValueError) as error:
        reason = f"{source}: answer is not the earthquake {event_id}: {error}"
        raise ServiceError(reason) from error
    return event
