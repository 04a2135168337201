"""
Earthquakes of event services: their identifiers, their lists, and the QuakeML of one of them.

Lists also come from QuakeML files and from GeoJSON feeds of the USGS. The services accept their
identifiers as parameter ``eventid``: the USGS (https://earthquake.usgs.gov/fdsnws/event/1), GeoNet
(``publicID``, https://service.geonet.org.nz/fdsnws/event/1), EMSC
(https://www.seismicportal.eu/fdsnws/event/1) and INGV (https://webservices.ingv.it/fdsnws/event/1).
"""

import json
import logging
import math
import re
from collections.abc import Callable, Iterable, Mapping
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

import obspy
from obspy import UTCDateTime
from obspy.geodetics import locations2degrees

from per_obspy.errors import CatalogError, PerError, RecordRejected, ServiceError, shortened
from per_obspy.files import bytes_hash, written_whole
from per_obspy.names import LONGEST_CODE, inside, public_url
from per_obspy.records.earthquakes.earthquake import Earthquake
from per_obspy.records.earthquakes.quakeml import earthquake_of, file_name, iso_time, read_event
from per_obspy.records.fdsn.providers import base_url
from per_obspy.records.fdsn.request import digest
from per_obspy.records.fdsn.web import NotFound, WebPool, answer
from per_obspy.records.obspy_readers import read_content
from per_obspy.resume import earlier_status, write_status

log = logging.getLogger(__name__)

#: Form of an identifier -> provider that writes it so.
_FORMS = {
    # Code of a network and its number: us7000abcd, ci38457511, official20110311054624120_30
    r"[a-z]{2}\d[a-z0-9]{5,12}|us[a-z]000[a-z0-9]{4}|(iscgem|official)\d[a-z0-9_]{3,30}": "USGS",
    # Year, letter p and part of the year: 2016p858000
    r"\d{4}p\d{6}": "GEONET",
    # Date and number of the day: 20161113_0000040
    r"\d{8}_\d{7}": "EMSC",
}

#: Letters that identifiers of services have.
_IDENTIFIER = re.compile(rf"[A-Za-z0-9._:/=-]{{1,{LONGEST_CODE}}}")

#: Event service -> providers of records that are asked by default.
RECORDS_OF = {
    "USGS": ("earthscope-federator", "eida-routing"),
    "EMSC": ("eida-routing", "earthscope-federator"),
    "GEONET": ("GEONET",),
    "INGV": ("INGV", "eida-routing"),
}

#: Providers of records of all other event services.
OTHERS = ("earthscope-federator", "eida-routing")

EXPECTED = "us7000abcd, geonet:2016p858000, emsc:20161113_0000040 or ingv:8863681"

#: Patience with a service that lists events: s, retries, s.
PATIENCE = (60.0, 3, 1.0)

#: Columns of the text format of fdsnws-event 1.2.
_TEXT_COLUMNS = 13

#: Parameters of the circle in which epicentres are wanted.
_CIRCLE = ("latitude", "longitude", "maxradius")

#: Suffixes of files of events; other sources that are no file are services.
FILES = (".xml", ".quakeml", ".json", ".geojson")

#: Earthquakes of a list, and one problem per line or entry of it that cannot be read.
Listed = tuple[list[Earthquake], list[str]]

#: Faults of an entry of a list, or of a list as a whole.
_FAULTS = (ValueError, KeyError, TypeError, IndexError, AttributeError, OverflowError)


def event_of(identifier: str) -> tuple[str, str]:
    """
    Return the event service of an identifier and the identifier as that service names it.

    Parameters
    ----------
    identifier : str
        ``PROVIDER:ID``, where the provider is a name of ObsPy in any case; or an ID alone of the
        USGS, GeoNet or EMSC, whose forms differ. No request is made.

    Raises
    ------
    CatalogError
        If the provider is unknown, or an ID without a provider has no known form.

    Examples
    --------
    >>> event_of("us7000abcd"), event_of("2016p858000"), event_of("INGV:8863681")
    (('USGS', 'us7000abcd'), ('GEONET', '2016p858000'), ('INGV', '8863681'))
    """
    name = identifier.strip()
    provider, mark, rest = name.partition(":")
    if mark and not rest.startswith("//"):
        try:
            base_url(provider)
        except CatalogError as error:
            problem = f"{provider!r} before the colon is no event service: expected {EXPECTED}"
            raise CatalogError(shortened(identifier), problem) from error
        service, name = provider.upper(), rest
    else:
        # Forms of the services differ
        service = next((known for form, known in _FORMS.items() if re.fullmatch(form, name)), "")
    if not service:
        problem = f"its form is not that of an earthquake of one service: expected {EXPECTED}"
        raise CatalogError(shortened(identifier), problem)
    if not _IDENTIFIER.fullmatch(name):
        problem = f"{name[:40]!r} is no identifier of an earthquake: expected {EXPECTED}"
        raise CatalogError(shortened(identifier), problem)
    return service, name


def is_event_id(text: str) -> bool:
    """
    Return whether a text is an identifier of an earthquake and no file or folder.

    >>> is_event_id("us7000abcd"), is_event_id("records"), is_event_id("run.toml")
    (True, False, False)
    """
    if Path(text).exists():
        return False
    try:
        event_of(text)
    except CatalogError:
        return False
    return any(letter.isdigit() for letter in text)


def find_events(source: str, query: Mapping[str, str]) -> list[Earthquake]:
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
    path = Path(source)
    if path.is_file():
        select = _selection(source, query)
        rows = _usable(source, partial(_file_rows, path), partial(CatalogError, source))
    elif re.match(r"https?://.*\.geojson", source):
        select = _selection(public_url(source), query)
        rows = _answered(source, _feed_rows, {})
    elif path.suffix.lower() in FILES and "://" not in source:
        raise CatalogError(source, "no such file")
    # Everything else is the base URL or the name of an event service, which selects itself
    else:
        times = {name: query[name] for name in query.keys() & {"starttime", "endtime"}}
        select, url = _selection(public_url(source), times), event_url(source)
        rows = _answered(url, _text_rows, {**query, "format": "text"})
        # A service may pass over a parameter that it does not know
        if others := sum(not select(row) for row in rows):
            log.warning("%s: %d earthquakes of another time left out", public_url(url), others)
    return sorted(filter(select, rows), key=lambda row: row.time, reverse=True)


def _answered(
    url: str, read: Callable[[bytes], Listed], query: Mapping[str, str]
) -> list[Earthquake]:
    """Return the earthquakes in the answer of a service or feed."""
    return _usable(url, lambda: read(answer(WebPool(*PATIENCE), url, query)))


def listed_events(pool: WebPool, provider: str, query: Mapping[str, str]) -> Listed:
    """
    List earthquakes of an FDSN event service; a line that cannot be read costs no other line.

    Parameters
    ----------
    pool : WebPool
        Connections and patience.
    provider : str
        FDSN event service: base URL or ObsPy's name.
    query : mapping
        Its parameters.

    Returns
    -------
    rows : list of Earthquake
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
    url = event_url(provider)
    try:
        rows, problems = _text_rows(answer(pool, url, {**query, "format": "text"}))
    except NotFound:
        return [], []
    except ValueError as error:
        reason = f"answer is no list of events: {_reason(error)}"
        raise ServiceError(f"{public_url(url)}: {reason}") from error
    return rows, [f"{public_url(url)}: {problem}" for problem in problems]


def event_url(provider: str) -> str:
    """Return the address of an event service."""
    return f"{base_url(provider)}/fdsnws/event/1/query"


def _selection(source: str, query: Mapping[str, str]) -> Callable[[Earthquake], bool]:
    """
    Return a function that selects the earthquakes of a query, as an FDSN event service does.

    Raises ``CatalogError`` about a source if a time is no time, a circle is incomplete, or a
    parameter needs a service.
    """
    # Everything else that a service can select by is unknown of a file
    if unknown := query.keys() - {"starttime", "endtime", "minmagnitude", *_CIRCLE}:
        raise CatalogError(source, f"{', '.join(sorted(unknown))}: only a service can select by it")
    circle = [float(query[name]) for name in _CIRCLE if name in query]
    if circle and len(circle) < len(_CIRCLE):
        raise CatalogError(source, "latitude, longitude and radius: give all three or none")
    # Limits that are not given leave all in
    start, end = _time(source, "starttime", query), _time(source, "endtime", query)
    smallest = float(query.get("minmagnitude", -math.inf))

    def select(row: Earthquake) -> bool:
        # An unknown magnitude is none that is large enough
        time, size = UTCDateTime(row.time), row.magnitude
        if (start and time < start) or (end and time > end):
            return False
        if (-math.inf if size is None else size) < smallest:
            return False
        return not circle or bool(locations2degrees(*row[2:4], *circle[:2]) <= circle[2])

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


def fetched_event(pool: WebPool, provider: str, event_id: str, cache: Path) -> Path:
    """
    Return the QuakeML file of an event in the cache; it is fetched if it is not there.

    Parameters
    ----------
    pool : WebPool
        Connections and patience.
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
    shown = public_url(event_url(provider))
    content = event_content(pool, provider, event_id)
    if not content:
        raise CatalogError(shown, f"has no event {event_id}")
    # Only an answer that can be read as one event stays in the cache
    with written_whole(path) as part:
        part.write_bytes(content)
        try:
            read_event(part)
        except CatalogError as error:
            reason = f"answers with data other than the event: {error.problem}"
            raise ServiceError(f"{shown}: {reason}") from error
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
    try:
        return answer(pool, event_url(provider), {"eventid": event_id, "format": "xml"})
    except NotFound:
        return b""


def _file_rows(path: Path) -> Listed:
    """Return the earthquakes of a GeoJSON or QuakeML file, which the first letter tells apart."""
    content = path.read_bytes()
    if content.lstrip()[:1] == b"{":
        return _feed_rows(content)
    events = read_content(obspy.read_events, content, path)
    return _each(earthquake_of, events, lambda event: str(event.resource_id))


def _usable(
    source: str, read: Callable[[], Listed], fault: Callable[[str], PerError] | None = None
) -> list[Earthquake]:
    """Return the earthquakes of a list; its problems are warnings, a fault if nothing else is."""
    shown = public_url(source)
    try:
        rows, problems = read()
        if problems and not rows:
            raise ValueError(problems[0])
    except (ValueError, KeyError, TypeError) as error:
        if fault:
            raise fault(f"is no list of events: {_reason(error)}") from error
        problem = "answers with data other than a list of events"
        raise ServiceError(f"{shown}: {problem}: {_reason(error)}") from error
    # One line that is wrong costs no other
    for warning in problems:
        log.warning("%s: left out: %s", shown, warning)
    return rows


def _each(
    read: Callable[[Any], Earthquake], entries: Iterable[Any], name: Callable[[Any], str] = str
) -> Listed:
    """Read every entry of a list alone; a fact that cannot be true is a problem of its entry."""
    rows, problems = [], []
    for entry in entries:
        try:
            row = read(entry)
            problem = row.fault
        except _FAULTS as error:
            problem = _reason(error)
        if problem:
            problems.append(f"{shortened(name(entry), 80)}: {problem}")
        else:
            rows.append(row)
    return rows, problems


def _reason(error: Exception) -> str:
    """Return the message of an error, with its class if it is one of Python."""
    if isinstance(error, RecordRejected):
        return "; ".join(error.reasons)
    return str(error) if isinstance(error, PerError) else f"{type(error).__name__}: {error}"


def _feed_rows(content: bytes) -> Listed:
    """Return the earthquakes of a GeoJSON feed: time in ms, depth in km."""
    return _each(_feed_row, json.loads(content)["features"])


def _feed_row(feature: dict[str, Any]) -> Earthquake:
    """Return one earthquake of a GeoJSON feed, depth in m."""
    properties = feature["properties"]
    longitude, latitude, *depth = feature["geometry"]["coordinates"]
    # A feed leaves out or nulls values that its network does not know
    return Earthquake(
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
    return _each(_text_row, lines[1:])


def _text_row(line: str) -> Earthquake:
    """Return one earthquake of the text format, depth from km to m."""
    cells = [cell.strip() for cell in line.split("|")]
    if len(cells) < _TEXT_COLUMNS:
        raise RecordRejected(line, f"has {len(cells)} columns, expected {_TEXT_COLUMNS}")
    # Between them are author, catalogue and contributor
    event_id, time, latitude, longitude, depth = cells[:5]
    magnitude_type, magnitude = cells[9:11]
    return Earthquake(
        event_id,
        iso_time(UTCDateTime(time)),
        float(latitude),
        float(longitude),
        1000 * float(depth) if depth else None,
        float(magnitude) if magnitude else None,
        magnitude_type,
        cells[12],
    )
