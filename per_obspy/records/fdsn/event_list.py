"""Lists of earthquakes from QuakeML files, FDSN event services and GeoJSON feeds of the USGS."""

import csv
import json
from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

import obspy
from obspy import UTCDateTime
from obspy.core.event import Event
from obspy.geodetics import locations2degrees

from per_obspy.errors import CatalogError, PerError, RecordRejected, ServiceError, shortened
from per_obspy.files import bytes_hash, written_whole
from per_obspy.names import LONGEST_CODE, code_problem, inside, public_url
from per_obspy.records.event_file import read_event
from per_obspy.records.fdsn.providers import base_url
from per_obspy.records.fdsn.request import digest
from per_obspy.records.fdsn.web import NotFound, WebPool, answer, web_pool
from per_obspy.records.obspy_readers import read_with_obspy
from per_obspy.resume import earlier_status, write_status

#: Patience with a service that lists events: s, retries, s.
_PATIENCE = (60.0, 3, 1.0)


class EventRow(NamedTuple):
    """
    One earthquake of a list.

    Attributes
    ----------
    event_id : str
        As its service names it; ``records.fdsn.event_id`` takes it.
    time : str
        Origin time, ISO 8601, UTC.
    latitude, longitude : float
        Of the epicentre, degrees.
    depth : float or None
        m.
    magnitude : float or None
    magnitude_type : str
    place : str
    """

    event_id: str
    time: str
    latitude: float
    longitude: float
    depth: float | None
    magnitude: float | None
    magnitude_type: str
    place: str


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
        for name in ("starttime", "endtime"):
            _time(public_url(source), name, query)
        url = f"{base_url(source)}/fdsnws/event/1/query"
        rows = _rows_of_answer(url, _text_rows, {**query, "format": "text"})
    return sorted(rows, key=lambda row: row.time, reverse=True)


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
    url = f"{base_url(provider)}/fdsnws/event/1/query"
    try:
        cells = _text_cells(answer(pool, url, {**query, "format": "text"}))
    except NotFound:
        return [], []
    except (ValueError, csv.Error) as error:
        reason = f"answer is no list of events: {_reason(error)}"
        raise ServiceError(f"{public_url(url)}: {reason}") from error
    # Each line is read alone
    rows, problems = [], []
    for line in cells:
        try:
            rows.append(_text_row(line))
        except (ValueError, TypeError, IndexError) as error:
            problems.append(f"{public_url(url)}: {shortened('|'.join(line), 80)}: {_reason(error)}")
    return rows, problems


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
        time = UTCDateTime(row.time)
        if (start and time < start) or (end and time > end):
            return False
        if "minmagnitude" in query and (row.magnitude is None or row.magnitude < smallest):
            return False
        return not circle or _distance(row, *circle[:2]) <= circle[2]

    return select


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


def _rows_of_file(path: Path) -> list[EventRow]:
    """Return the earthquakes of a GeoJSON or QuakeML file."""
    content = path.read_bytes()
    try:
        if content.lstrip()[:1] == b"{":
            return _feed_rows(content)
        return [quakeml_row(event) for event in read_with_obspy(obspy.read_events, path)]
    except (RecordRejected, ValueError, KeyError, TypeError, IndexError) as error:
        raise CatalogError(str(path), f"is no list of events: {_reason(error)}") from error


def _rows_of_answer(
    url: str, rows: Callable[[bytes], list[EventRow]], query: Mapping[str, str]
) -> list[EventRow]:
    """Return the earthquakes in the answer of a service or feed."""
    content = answer(web_pool(*_PATIENCE), url, query)
    try:
        return rows(content)
    except (ValueError, KeyError, TypeError, IndexError) as error:
        reason = f"answers with data other than a list of events: {_reason(error)}"
        raise ServiceError(f"{public_url(url)}: {reason}") from error


def _reason(error: Exception) -> str:
    """Return the message of an error, with its class if it is one of Python."""
    return str(error) if isinstance(error, PerError) else f"{type(error).__name__}: {error}"


def _feed_rows(content: bytes) -> list[EventRow]:
    """Return the earthquakes of a GeoJSON feed: time in ms, depth in km."""
    return [_feed_row(feature) for feature in json.loads(content)["features"]]


def _feed_row(feature: dict[str, Any]) -> EventRow:
    """Return one earthquake of a GeoJSON feed, depth in m."""
    properties = feature["properties"]
    longitude, latitude, *depth = feature["geometry"]["coordinates"]
    # A feed leaves out or nulls values that its network does not know
    return EventRow(
        event_id=feature["id"],
        time=_iso(UTCDateTime(properties["time"] / 1000)),
        latitude=float(latitude),
        longitude=float(longitude),
        depth=1000 * depth[0] if depth and depth[0] is not None else None,
        magnitude=properties.get("mag"),
        magnitude_type=properties.get("magType") or "",
        place=properties.get("place") or "",
    )


def _text_rows(content: bytes) -> list[EventRow]:
    """Return the earthquakes in the text format of fdsnws-event 1.2: 13 columns or more."""
    return [_text_row(row) for row in _text_cells(content)]


def _text_cells(content: bytes) -> list[list[str]]:
    """Return the cells of every line of the text format below its header."""
    lines = content.decode("utf-8").splitlines()
    if not lines:
        return []
    header, *rows = csv.reader(lines, delimiter="|", quoting=csv.QUOTE_NONE)
    # A web page or an error text of the service has another first line
    if not header or not header[0].lstrip("# ").startswith("EventID"):
        raise ValueError(f"the first line is {'|'.join(header):.80}")
    return [row for row in rows if row]


def _text_row(row: list[str]) -> EventRow:
    """Return one earthquake of the text format, depth from km to m."""
    cells = [cell.strip() for cell in row]
    # Between them are author, catalogue and contributor
    event_id, time, latitude, longitude, depth = cells[:5]
    magnitude_type, magnitude = cells[9:11]
    return EventRow(
        event_id,
        _iso(UTCDateTime(time)),
        float(latitude),
        float(longitude),
        1000 * float(depth) if depth else None,
        float(magnitude) if magnitude else None,
        magnitude_type,
        cells[12],
    )


def quakeml_row(event: Event) -> EventRow:
    """Return one earthquake of a QuakeML file, from its preferred origin and magnitude."""
    name = str(event.resource_id)
    if not event.origins:
        raise RecordRejected(name, "has no origin")
    origin = event.preferred_origin() or event.origins[0]
    if None in (origin.time, origin.latitude, origin.longitude):
        raise RecordRejected(name, "has an origin without time, latitude or longitude")
    # Magnitude and place may be unknown
    size = event.preferred_magnitude() or next(iter(event.magnitudes), None)
    descriptions = event.event_descriptions
    return EventRow(
        name.rpartition("/")[2],
        _iso(origin.time),
        float(origin.latitude),
        float(origin.longitude),
        origin.depth,
        float(size.mag) if size else None,
        (size.magnitude_type or "") if size else "",
        descriptions[0].text if descriptions else "",
    )


def _iso(time: UTCDateTime) -> str:
    """Return a time in ISO 8601 to the millisecond."""
    return str(time.datetime.isoformat(timespec="milliseconds"))
