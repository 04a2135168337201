"""Earthquakes: from QuakeML files, FDSN event services, GeoJSON feeds of the USGS, and ASDF workspaces."""

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import obspy
from obspy import UTCDateTime
from obspy.core.event import Event

from per_obspy.errors import CatalogError, PerError, RecordRejected, ServiceError
from per_obspy.files import written_whole
from per_obspy.records import folder
from per_obspy.records.asdf import is_asdf, read_asdf_event
from per_obspy.records.fdsn.providers import base_url
from per_obspy.records.fdsn.web import NotFound, answer, web_pool
from per_obspy.records.obspy_readers import read_with_obspy

#: how patiently a list of events is asked for: s, retries, s
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


#: What files of events are called; other sources that are no file are services.
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
        Parameters of the FDSN event service, such as ``starttime`` and ``minmagnitude``; files and
        feeds, which are not asked, are listed whole.

    Raises
    ------
    CatalogError
        If the file is no list of events, or the source is unknown.
    ServiceError
        If the service does not answer, or with something else.
    """
    if Path(source).is_file():
        rows = _rows_of_file(Path(source))
    elif source.startswith(("http://", "https://")) and ".geojson" in source:
        rows = _rows_of_answer(source, _feed_rows, answer(web_pool(*_PATIENCE), source, {}))
    elif Path(source).suffix.lower() in FILES and "://" not in source:
        raise CatalogError(source, "no such file")
    else:
        url = f"{base_url(source)}/fdsnws/event/1/query"
        rows = _rows_of_answer(
            url, _text_rows, answer(web_pool(*_PATIENCE), url, {**query, "format": "text"})
        )
    return sorted(rows, key=lambda row: row.time, reverse=True)


def read_event(path: Path) -> Event:
    """
    Read the one event of a QuakeML file or of an ASDF workspace.

    Raises
    ------
    CatalogError
        If the file cannot be read or does not hold exactly one event with an origin.
    """
    return read_asdf_event(path) if path.is_file() and is_asdf(path) else folder.read_event(path)


def fetched_event(pool: Any, provider: str, event_id: str, cache: Path) -> Path:
    """
    Return the QuakeML file of an event in the cache; it is fetched if it is not there.

    Parameters
    ----------
    pool : urllib3.PoolManager
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
        If the service does not answer, or with something else.
    """
    path = (
        cache / f"event-{''.join(letter if letter.isalnum() else '-' for letter in event_id)}.xml"
    )
    if path.is_file():
        return path
    url = f"{base_url(provider)}/fdsnws/event/1/query"
    try:
        said = answer(pool, url, {"eventid": event_id, "format": "quakeml"})
    except NotFound:
        said = b""
    if not said:
        raise CatalogError(url, f"has no event {event_id}")
    with written_whole(path) as part:
        part.write_bytes(said)
        try:
            folder.read_event(part)
        except CatalogError as error:
            raise ServiceError(
                f"{url}: answers with something else than the event: {error.problem}"
            ) from error
    return path


def _rows_of_file(path: Path) -> list[EventRow]:
    content = path.read_bytes()
    try:
        if content.lstrip()[:1] == b"{":
            return _feed_rows(content)
        return [_quakeml_row(event) for event in read_with_obspy(obspy.read_events, path)]
    except (RecordRejected, ValueError, KeyError, TypeError, IndexError) as error:
        raise CatalogError(str(path), f"is no list of events: {_said(error)}") from error


def _rows_of_answer(url: str, rows: Any, content: bytes) -> list[EventRow]:
    try:
        found: list[EventRow] = rows(content)
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise ServiceError(
            f"{url}: answers with something else than a list of events: {_said(error)}"
        ) from error
    return found


def _said(error: Exception) -> str:
    return str(error) if isinstance(error, PerError) else f"{type(error).__name__}: {error}"


def _feed_rows(content: bytes) -> list[EventRow]:
    """Return the rows of a GeoJSON feed: time in ms, depth in km."""
    rows = []
    for feature in json.loads(content)["features"]:
        known, (longitude, latitude, *depth) = (
            feature["properties"],
            feature["geometry"]["coordinates"],
        )
        row = EventRow(
            event_id=feature["id"],
            time=_iso(UTCDateTime(known["time"] / 1000)),
            latitude=float(latitude),
            longitude=float(longitude),
            depth=1000 * depth[0] if depth and depth[0] is not None else None,
            magnitude=known.get("mag"),
            magnitude_type=known.get("magType") or "",
            place=known.get("place") or "",
        )
        rows.append(row)
    return rows


def _text_rows(content: bytes) -> list[EventRow]:
    """Return the rows of the text format of fdsnws-event 1.2: depth in km, 13 columns and perhaps more."""
    if not content:
        return []
    header, *lines = csv.reader(
        content.decode("utf-8").splitlines(), delimiter="|", quoting=csv.QUOTE_NONE
    )
    if not header[0].lstrip("# ").startswith("EventID"):
        raise ValueError(f"the first line is {'|'.join(header):.80}")
    return [_text_row([cell.strip() for cell in line]) for line in lines if line]


def _text_row(cells: list[str]) -> EventRow:
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


def _quakeml_row(event: Event) -> EventRow:
    if not event.origins:
        raise RecordRejected(str(event.resource_id), "has no origin")
    origin = event.preferred_origin() or event.origins[0]
    if None in (origin.time, origin.latitude, origin.longitude):
        raise RecordRejected(
            str(event.resource_id), "has an origin without time, latitude or longitude"
        )
    size = event.preferred_magnitude() or next(iter(event.magnitudes), None)
    return EventRow(
        str(event.resource_id).rpartition("/")[2],
        _iso(origin.time),
        float(origin.latitude),
        float(origin.longitude),
        origin.depth,
        float(size.mag) if size else None,
        (size.magnitude_type or "") if size else "",
        event.event_descriptions[0].text if event.event_descriptions else "",
    )


def _iso(time: UTCDateTime) -> str:
    return str(time.datetime.isoformat(timespec="milliseconds"))
