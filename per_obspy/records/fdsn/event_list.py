"""Lists of earthquakes from QuakeML files, FDSN event services and GeoJSON feeds of the USGS."""

import json
import logging
import re
from collections.abc import Callable, Iterable, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import obspy
from obspy import UTCDateTime
from obspy.core.event import Event
from obspy.geodetics import locations2degrees

from per_obspy.errors import CatalogError, PerError, RecordRejected, ServiceError, shortened
from per_obspy.files import bytes_hash, written_whole
from per_obspy.names import LONGEST_CODE, code_problem, inside, public_url
from per_obspy.records.event_file import (
    EventRow,
    iso_time,
    quakeml_row,
    read_event,
    row_problem,
)
from per_obspy.records.fdsn.providers import base_url
from per_obspy.records.fdsn.request import digest
from per_obspy.records.fdsn.web import NotFound, WebPool, answer, web_pool
from per_obspy.records.obspy_readers import read_with_obspy
from per_obspy.resume import earlier_status, write_status

#: Patience with a service that lists events: s, retries, s.
_PATIENCE = (60.0, 3, 1.0)


log = logging.getLogger(__name__)

#: Columns of the text format of fdsnws-event 1.2.
_TEXT_COLUMNS = 13

#: Parameters of the circle in which epicentres are wanted.
_CIRCLE = ("latitude", "longitude", "maxradius")

#: Suffixes of files of events; other sources that are no file are services.
FILES = (".xml", ".quakeml", ".json", ".geojson")


def find_events(source: str, query: Mapping[str, str]) -> list[EventRow]:
    """
    List earthquakes, the latest first.

    Parameters
    ----------
    source : str
        A file (QuakeML or GeoJSON), the URL of a GeoJSON feed, or an FDSN event service (base URL
        or ObsPy's name).
    query : mapping
        Parameters of the FDSN event service. Of files and feeds, which cannot be asked, events are
        selected by ``starttime``, ``endtime``, ``minmagnitude``, and ``latitude``, ``longitude``
        and ``maxradius`` (degrees); an event of unknown magnitude has none that is large enough.

    Raises
    ------
    CatalogError
        If the file is no list of events, the source is unknown, or a parameter is wrong.
    ServiceError
        If the service does not answer, or its answer is not an event list.
    """
    if Path(source).is_file():
        select = selection(source, query)
        rows = list(filter(select, _rows_of_file(Path(source))))
    elif source.startswith(("http://", "https://")) and ".geojson" in source:
        select = selection(public_url(source), query)
        rows = list(filter(select, _rows_of_answer(source, _feed_rows, {})))
    elif Path(source).suffix.lower() in FILES and "://" not in source:
        raise CatalogError(source, "no such file")
    else:
        # Everything else is the base URL or the name of an event service, which selects itself
        rows = _rows_of_service(source, query)
    return sorted(rows, key=lambda row: row.time, reverse=True)


def _rows_of_service(source: str, query: Mapping[str, str]) -> list[EventRow]:
    """Return the earthquakes that an event service lists of a query."""
    start, end = (_time(public_url(source), name, query) for name in ("starttime", "endtime"))
    url = f"{base_url(source)}/fdsnws/event/1/query"
    listed = _rows_of_answer(url, _text_rows, {**query, "format": "text"})
    rows = [row for row in listed if _is_between(row, start, end)]
    # A service may pass over a parameter that it does not know
    if len(rows) < len(listed):
        count = len(listed) - len(rows)
        log.warning("%s: %d earthquakes of another time left out", public_url(url), count)
    return rows


def listed_events(
    pool: WebPool, provider: str, query: Mapping[str, str]
) -> tuple[list[EventRow], list[str]]:
    """
    List earthquakes of an FDSN event service; a line that cannot be read costs no other line.

    Parameters
    ----------
    pool : WebPool
        From :func:`per_obspy.records.fdsn.web.web_pool`.
    provider : str
        FDSN event service: base URL or ObsPy's name.
    query : mapping
        Its parameters.

    Returns
    -------
    rows : list of EventRow
        In the order of the service.
    problems : list of str
        One per line that cannot be read.

    Raises
    ------
    CatalogError
        If the service is unknown.
    ServiceError
        If the service does not answer, or its answer is no list.
    """
    # "Not found" is the answer of some services to an empty list
    url = f"{base_url(provider)}/fdsnws/event/1/query"
    try:
        rows, problems = _text_rows(answer(pool, url, {**query, "format": "text"}))
    except NotFound:
        return [], []
    except ValueError as error:
        reason = f"answer is no list of events: {_reason(error)}"
        raise ServiceError(f"{public_url(url)}: {reason}") from error
    return rows, [f"{public_url(url)}: {problem}" for problem in problems]


def selection(source: str, query: Mapping[str, str]) -> Callable[[EventRow], bool]:
    """
    Return a function that selects the earthquakes of a query, as an FDSN event service does.

    Parameters
    ----------
    source : str
        File or feed, for messages.
    query : mapping
        As for :func:`find_events`.

    Raises
    ------
    CatalogError
        If a time is no time, a circle is incomplete, or a parameter needs a service.
    """
    # Everything else that a service can select by is unknown of a file
    unknown = query.keys() - {"starttime", "endtime", "minmagnitude", *_CIRCLE}
    if unknown:
        raise CatalogError(source, f"{', '.join(sorted(unknown))}: only a service can select by it")
    # A circle needs its centre and its radius
    circle = [float(query[name]) for name in _CIRCLE if name in query]
    if circle and len(circle) < len(_CIRCLE):
        raise CatalogError(source, "latitude, longitude and radius: give all three or none")
    # Limits that are not given leave all in
    start, end = (_time(source, name, query) for name in ("starttime", "endtime"))
    smallest = float(query.get("minmagnitude", "-inf"))

    def select(row: EventRow) -> bool:
        if not _is_between(row, start, end):
            return False
        if "minmagnitude" in query and (row.magnitude is None or row.magnitude < smallest):
            return False
        return not circle or _distance(row, *circle[:2]) <= circle[2]

    return select


def _is_between(row: EventRow, start: UTCDateTime | None, end: UTCDateTime | None) -> bool:
    """Return whether the origin time of an earthquake is in a window; None is open."""
    time = UTCDateTime(row.time)
    return (start is None or time >= start) and (end is None or time <= end)


def _time(source: str, name: str, query: Mapping[str, str]) -> UTCDateTime | None:
    """Return a time of a query, None if it is not given."""
    if name not in query:
        return None
    try:
        return UTCDateTime(datetime.fromisoformat(query[name]))
    except ValueError as error:
        problem = f"{name}: {query[name]!r} is no time, expected ISO 8601 such as 2019-07-06T03:19"
        raise CatalogError(source, problem) from error


def _distance(row: EventRow, latitude: float, longitude: float) -> float:
    """Return the distance of an epicentre from a place along a great circle, degrees."""
    return float(locations2degrees(row.latitude, row.longitude, latitude, longitude))


def fetched_event(pool: WebPool, provider: str, event_id: str, cache: Path) -> Path:
    """
    Return the QuakeML file of an event in the cache; it is fetched if it is not there.

    Parameters
    ----------
    pool : WebPool
        From :func:`per_obspy.records.fdsn.web.web_pool`.
    provider : str
        FDSN event service.
    event_id : str
        As the service names it.
    cache : Path
        Folder.

    Raises
    ------
    CatalogError
        If the service has no such event.
    ServiceError
        If the service does not answer, or its answer is not the event.
    """
    path = inside(cache, f"event-{file_name(event_id)}.xml")
    status_file = path.with_suffix(".json")
    if path.is_file() and earlier_status(status_file, digest(event_id)) is not None:
        return path
    # Anything but a whole file is fetched
    url = f"{base_url(provider)}/fdsnws/event/1/query"
    content = event_content(pool, provider, event_id)
    if not content:
        raise CatalogError(public_url(url), f"has no event {event_id}")
    # Only an answer that can be read as one event stays in the cache
    with written_whole(path) as part:
        part.write_bytes(content)
        try:
            read_event(part)
        except CatalogError as error:
            reason = f"answers with data other than the event: {error.problem}"
            raise ServiceError(f"{public_url(url)}: {reason}") from error
    write_status(status_file, digest(event_id), {path.name: bytes_hash(content)}, {})
    return path


def event_content(pool: WebPool, provider: str, event_id: str) -> bytes:
    """
    Return the QuakeML of an event as its service sends it; empty if it has no such event.

    Raises
    ------
    CatalogError
        If the service is unknown.
    ServiceError
        If the service does not answer.
    """
    url = f"{base_url(provider)}/fdsnws/event/1/query"
    try:
        return answer(pool, url, {"eventid": event_id, "format": "xml"})
    except NotFound:
        return b""


def file_name(event_id: str) -> str:
    """
    Return a name of a file for an identifier, whatever letters that has.

    Examples
    --------
    >>> file_name("us7000abcd"), file_name("../x")
    ('us7000abcd', '---x-551622b6')
    """
    if not code_problem("", event_id):
        return event_id
    # Identifiers that differ in other letters only must not share a file
    name = "".join(letter if letter.isascii() and letter.isalnum() else "-" for letter in event_id)
    return f"{name[:LONGEST_CODE]}-{digest(event_id)}"


#: Earthquakes of a list, and one problem per line or entry of it that cannot be read.
Listed = tuple[list[EventRow], list[str]]


def _rows_of_file(path: Path) -> list[EventRow]:
    """Return the earthquakes of a GeoJSON or QuakeML file."""
    content = path.read_bytes()
    try:
        if content.lstrip()[:1] == b"{":
            listed = _feed_rows(content)
        else:
            listed = _each(quakeml_row, read_with_obspy(obspy.read_events, path), _event_name)
        return _rows_with_warnings(str(path), listed)
    except (RecordRejected, ValueError, KeyError, TypeError) as error:
        raise CatalogError(str(path), f"is no list of events: {_reason(error)}") from error


def _rows_of_answer(
    url: str, rows: Callable[[bytes], Listed], query: Mapping[str, str]
) -> list[EventRow]:
    """Return the earthquakes in the answer of a service or feed."""
    content = answer(web_pool(*_PATIENCE), url, query)
    try:
        return _rows_with_warnings(public_url(url), rows(content))
    except (ValueError, KeyError, TypeError) as error:
        reason = f"answers with data other than a list of events: {_reason(error)}"
        raise ServiceError(f"{public_url(url)}: {reason}") from error


def _rows_with_warnings(source: str, listed: Listed) -> list[EventRow]:
    """Return the earthquakes of a list; its problems are warnings, an error if nothing else is."""
    rows, problems = listed
    if problems and not rows:
        raise ValueError(problems[0])
    for problem in problems:
        log.warning("%s: left out: %s", source, problem)
    return rows


def _each(
    read: Callable[[Any], EventRow], entries: Iterable[Any], name: Callable[[Any], str]
) -> Listed:
    """Read every entry of a list alone; a fact that cannot be true is a problem of its entry."""
    rows, problems = list[EventRow](), list[str]()
    for entry in entries:
        try:
            row = read(entry)
        except (
            RecordRejected,
            ValueError,
            KeyError,
            TypeError,
            IndexError,
            OverflowError,
        ) as error:
            problems.append(f"{shortened(name(entry), 80)}: {_reason(error)}")
            continue
        # A number that can be read may still be no place
        if problem := row_problem(row):
            problems.append(f"{shortened(name(entry), 80)}: {problem}")
        else:
            rows.append(row)
    return rows, problems


def _event_name(event: Event) -> str:
    """Return the identifier of an earthquake in QuakeML."""
    return str(event.resource_id)


def _reason(error: Exception) -> str:
    """Return the message of an error, with its class if it is one of Python."""
    if isinstance(error, RecordRejected):
        return "; ".join(error.reasons)
    return str(error) if isinstance(error, PerError) else f"{type(error).__name__}: {error}"


def _feed_rows(content: bytes) -> Listed:
    """Return the earthquakes of a GeoJSON feed: time in ms, depth in km."""
    return _each(_feed_row, json.loads(content)["features"], str)


def _feed_row(feature: dict[str, Any]) -> EventRow:
    """Return one earthquake of a GeoJSON feed, depth in m."""
    properties = feature["properties"]
    longitude, latitude, *depth = feature["geometry"]["coordinates"]
    # A feed leaves out or nulls values that its network does not know
    return EventRow(
        event_id=feature["id"],
        time=iso_time(UTCDateTime(properties["time"] / 1000)),
        latitude=float(latitude),
        longitude=float(longitude),
        depth=1000 * depth[0] if depth and depth[0] is not None else None,
        magnitude=properties.get("mag"),
        magnitude_type=properties.get("magType") or "",
        place=properties.get("place") or "",
    )


def _text_rows(content: bytes) -> Listed:
    """Return the earthquakes in the text format of fdsnws-event 1.2: 13 columns or more."""
    # Names of places may hold line ends of other alphabets, which divide no lines
    text = content.decode("utf-8", "replace")
    lines = [line for line in re.split("\r\n|\r|\n", text) if line.strip()]
    # A web page or an error text of the service has another first line
    if lines and not lines[0].lstrip("\ufeff# ").startswith("EventID"):
        raise ValueError(f"the first line is {lines[0]:.80}")
    return _each(_text_row, lines[1:], str)


def _text_row(line: str) -> EventRow:
    """Return one earthquake of the text format, depth from km to m."""
    cells = [cell.strip() for cell in line.split("|")]
    if len(cells) < _TEXT_COLUMNS:
        raise RecordRejected(line, f"has {len(cells)} columns, expected {_TEXT_COLUMNS}")
    # Between them are author, catalogue and contributor
    event_id, time, latitude, longitude, depth = cells[:5]
    magnitude_type, magnitude = cells[9:11]
    return EventRow(
        event_id,
        iso_time(UTCDateTime(time)),
        float(latitude),
        float(longitude),
        1000 * float(depth) if depth else None,
        float(magnitude) if magnitude else None,
        magnitude_type,
        cells[12],
    )
