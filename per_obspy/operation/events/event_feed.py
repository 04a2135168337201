"""Earthquakes as an FDSN event service or a folder of QuakeML files lists them."""

import logging
import time
from collections.abc import Mapping
from datetime import datetime, timedelta
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import obspy
from obspy.core.event import Catalog, Event, Magnitude, Origin, ResourceIdentifier

from per_obspy.config import Watch
from per_obspy.errors import CatalogError, PerError, RecordRejected, ServiceError, shortened
from per_obspy.files import is_part
from per_obspy.names import public_url
from per_obspy.operation.events.relevance import Circle
from per_obspy.operation.events.state import WatchState, iso, moment
from per_obspy.records.fdsn.event_list import (
    EventRow,
    event_content,
    file_name,
    listed_events,
    quakeml_row,
)
from per_obspy.records.fdsn.web import WebPool, web_pool
from per_obspy.records.obspy_readers import read_bytes_with_obspy

log = logging.getLogger(__name__)

#: Patience with an event service: s, retries, s, s and bytes of an answer.
_PATIENCE = (30.0, 2, 1.0, 120.0, 64 * 2**20)

#: Longest pause that a service may demand before it is left for the next poll, s.
_LONGEST_PAUSE = 5.0

#: Changes are asked for from this long before the latest poll, s: clocks differ.
OVERLAP = 600.0

#: Suffixes of QuakeML files.
SUFFIXES = (".xml", ".quakeml")

#: Bytes of the largest QuakeML file that is read.
LARGEST_FILE = 64 * 2**20

#: Age of a file that cannot be read before it counts as wrong, s: it may be half written.
SETTLED = 10.0


class Feed(NamedTuple):
    """
    Earthquakes that are new or may have changed.

    Attributes
    ----------
    rows : dict
        Identifier -> facts.
    files : dict
        Identifier -> name of its QuakeML file; empty if a service lists them.
    problems : tuple of str
        Lines and files that cannot be read.
    seen : dict
        Of a folder: name of a file -> size and time of change, as they were read.
    """

    rows: dict[str, EventRow]
    files: dict[str, str]
    problems: tuple[str, ...]
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
        If the service does not answer, or with something else than a list.
    """
    if watch.folder is not None:
        return _folder_feed(watch.folder, state.seen)
    assert watch.service is not None  # Watch demands a service or a folder
    query = _query(watch, circle, now)
    since = _since(watch, state, now)
    pool = _pool()
    if since is None:
        rows, problems = _listed(pool, watch, query)
    else:
        rows, problems = _listed_since(pool, watch, query, since)
    usable, unusable = _usable_rows(rows)
    return Feed(usable, {}, (*problems, *unusable), {})


def _pool() -> WebPool:
    """Return connections to an event service."""
    return web_pool(*_PATIENCE)._replace(longest_pause=_LONGEST_PAUSE)


def _query(watch: Watch, circle: Circle, now: datetime) -> dict[str, str]:
    """Return the parameters of the event service."""
    start = now - timedelta(seconds=watch.oldest)
    query = {
        "starttime": f"{start:%Y-%m-%dT%H:%M:%S}",
        "orderby": "time",
        "limit": f"{watch.most_events}",
    }
    # A circle of the whole Earth excludes nothing
    if circle.radius < 180.0:
        place = {"latitude": circle.latitude, "longitude": circle.longitude}
        query |= {name: f"{value:.4f}" for name, value in place.items()}
        query["maxradius"] = f"{circle.radius:.4f}"
    return query


def _since(watch: Watch, state: WatchState, now: datetime) -> str | None:
    """Return the time from which on changes are asked for, None for everything."""
    # A time that is still to come was noted before the clock was put back
    if not watch.updatedafter or state.since is None or moment(state.since) > now:
        return None
    return f"{moment(state.since) - timedelta(seconds=OVERLAP):%Y-%m-%dT%H:%M:%S}"


def _listed_since(
    pool: WebPool, watch: Watch, query: Mapping[str, str], since: str
) -> tuple[list[EventRow], list[str]]:
    """Return what changed since a time; everything if the service does not know the parameter."""
    try:
        return _listed(pool, watch, {**query, "updatedafter": since})
    except ServiceError as error:
        if "HTTP 400" not in str(error):
            raise
        log.info("%s: no updatedafter, everything is asked for", public_url(watch.service or ""))
        return _listed(pool, watch, query)


def _listed(
    pool: WebPool, watch: Watch, query: Mapping[str, str]
) -> tuple[list[EventRow], list[str]]:
    """Return the listed earthquakes; of more than the limit also all that are strong enough."""
    service = watch.service or ""
    rows, problems = listed_events(pool, service, query)
    if len(rows) < watch.most_events:
        return rows, problems
    # Weak ones must not crowd out strong ones
    smallest = min(reach.magnitude for reach in watch.magnitudes)
    log.warning(
        "%s: lists %d earthquakes or more: asked again from magnitude %g",
        *(public_url(service), watch.most_events, smallest),
    )
    strong, others = listed_events(pool, service, {**query, "minmagnitude": f"{smallest:g}"})
    return [*rows, *strong], [*problems, *others]


def _usable_rows(rows: list[EventRow]) -> tuple[dict[str, EventRow], list[str]]:
    """Return the rows by identifier, and one problem per row whose values cannot be true."""
    usable, problems = dict[str, EventRow](), list[str]()
    for row in rows:
        if problem := row_problem(row):
            problems.append(f"{shortened(row.event_id, 80)}: {problem}")
        else:
            usable[row.event_id] = row
    return usable, problems


def row_problem(row: EventRow) -> str:
    """
    Return what is wrong with the facts of an earthquake; empty if they can be true.

    Examples
    --------
    >>> row = EventRow("x1", "2026-11-23T01:00:00", 14.6, -90.5, None, None, "", "")
    >>> row_problem(row), row_problem(row._replace(latitude=float("nan")))
    ('', 'latitude nan: expected -90 to 90')
    """
    limits = {"latitude": (-90.0, 90.0), "longitude": (-180.0, 180.0), "magnitude": (-5.0, 11.0)}
    for name, (lowest, highest) in limits.items():
        value = getattr(row, name)
        if value is not None and not lowest <= value <= highest:
            return f"{name} {value:g}: expected {lowest:g} to {highest:g}"
    # A depth that cannot be true is unknown to whoever uses it
    if row.depth is not None and not -10_000.0 <= row.depth <= 1_000_000.0:
        return f"depth {row.depth:g} m: expected -10000 to 1000000"
    return "" if row.event_id.strip() else "has no identifier"


def _folder_feed(folder: Path, seen: Mapping[str, tuple[int, int]]) -> Feed:
    """Return the earthquakes of the files of a folder that are new or have changed."""
    rows, files, problems = dict[str, EventRow](), dict[str, str](), list[str]()
    found = dict[str, tuple[int, int]]()
    try:
        paths = sorted(folder.iterdir())
    except OSError as error:
        raise CatalogError(str(folder), f"cannot be read: {error.strerror}") from error
    for path in paths:
        if path.suffix.lower() not in SUFFIXES or is_part(path):
            continue
        # A file that vanishes in between is that of a deleted earthquake
        try:
            facts = path.stat()
            mark = (facts.st_size, facts.st_mtime_ns)
            if seen.get(path.name) != mark:
                found_rows = {row.event_id: row for row in map(quakeml_row, read_events(path))}
                rows |= found_rows
                files |= dict.fromkeys(found_rows, path.name)
            found[path.name] = mark
        except FileNotFoundError:
            continue
        except (PerError, OSError, ValueError) as error:
            if time.time() - facts.st_mtime >= SETTLED:
                problems.append(str(error))
    usable, unusable = _usable_rows(list(rows.values()))
    return Feed(usable, files, (*problems, *unusable), found)


def read_events(path: Path) -> list[Event]:
    """
    Read the earthquakes of a QuakeML file.

    Raises
    ------
    CatalogError
        If it cannot be read, is too large, or no QuakeML.
    """
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise CatalogError(str(path), f"is larger than {LARGEST_FILE} bytes")
        return _events(path.read_bytes(), str(path))
    except RecordRejected as error:
        raise CatalogError(str(path), f"is no QuakeML: {'; '.join(error.reasons)}") from error
    except OSError as error:
        raise CatalogError(str(path), f"cannot be read: {error.strerror}") from error


def _events(content: bytes, source: str) -> list[Event]:
    """Return the earthquakes of QuakeML; raise ``RecordRejected`` if it is none."""
    return list(read_bytes_with_obspy(obspy.read_events, content, source, format="QUAKEML"))


def current_event(watch: Watch, event_id: str, file: str) -> Event | None:
    """
    Return an earthquake as its service or file has it now, None if it has been deleted.

    Parameters
    ----------
    watch : Watch
        Where earthquakes are listed.
    event_id : str
        As the list has it.
    file : str
        Its QuakeML file in the folder, if there is one.

    Raises
    ------
    CatalogError
        If the file is no QuakeML.
    ServiceError
        If the service does not answer, or with something else than the earthquake.
    """
    if watch.folder is not None:
        path = watch.folder / file
        events = read_events(path) if path.is_file() else []
        return next((event for event in events if quakeml_row(event).event_id == event_id), None)
    assert watch.service is not None
    content = event_content(_pool(), watch.service, event_id)
    if not content:
        return None
    source = public_url(watch.service)
    try:
        (event,) = _events(content, source)
        quakeml_row(event)
    except (RecordRejected, ValueError) as error:
        reason = f"{source}: answers with something else than the earthquake {event_id}: {error}"
        raise ServiceError(reason) from error
    return event


def plain_quakeml(event: Event, event_id: str) -> bytes:
    """
    Return the preferred origin and magnitude of an earthquake as QuakeML.

    The bytes depend on time, place and magnitude alone, so that nothing is computed again when a
    service changes other facts.

    Parameters
    ----------
    event : Event
        With an origin.
    event_id : str
        For its resource identifier.
    """
    name = f"smi:local/{file_name(event_id)}"
    found = event.preferred_origin() or event.origins[0]
    origin = Origin(
        resource_id=ResourceIdentifier(f"{name}/origin"),
        time=found.time,
        latitude=found.latitude,
        longitude=found.longitude,
        depth=found.depth,
    )
    size = event.preferred_magnitude() or next(iter(event.magnitudes), None)
    magnitudes = [] if size is None else [_plain_magnitude(size, name)]
    plain = Event(
        resource_id=ResourceIdentifier(f"{name}/event"), origins=[origin], magnitudes=magnitudes
    )
    # One file per earthquake, written in memory as ObsPy's writers ignore errors of the disk
    catalog = Catalog([plain], resource_id=ResourceIdentifier(f"{name}/catalog"))
    content = BytesIO()
    catalog.write(content, format="QUAKEML")
    return content.getvalue()


def _plain_magnitude(size: Magnitude, name: str) -> Magnitude:
    """Return value and type of a magnitude."""
    identifier = ResourceIdentifier(f"{name}/magnitude")
    return Magnitude(resource_id=identifier, mag=size.mag, magnitude_type=size.magnitude_type)


def noted_poll(state: WatchState, feed: Feed, now: datetime) -> WatchState:
    """Return the state of a watched folder after a poll that succeeded."""
    update = {
        "last_poll": iso(now),
        "since": iso(now),
        "failures": 0,
        "not_before": None,
        "seen": feed.seen,
    }
    return state.model_copy(update=update)
