"""Facts of earthquakes, and the one earthquake of a QuakeML file or of an ASDF workspace."""

from pathlib import Path
from typing import NamedTuple

import obspy
from obspy import UTCDateTime
from obspy.core.event import Event, Magnitude

from per_obspy.errors import CatalogError, RecordRejected, reason_of
from per_obspy.files import bytes_hash, file_hash
from per_obspy.records.archive import open_file
from per_obspy.records.asdf import ASDF_MARK, read_asdf_events
from per_obspy.records.obspy_readers import read_content


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


class EventFile(NamedTuple):
    """
    An earthquake and the file that describes it.

    Attributes
    ----------
    path : Path
        QuakeML file or ASDF workspace.
    hash : str
        SHA-256 of the file.
    event : Event
        With at least one origin that has time and place.
    """

    path: Path
    hash: str
    event: Event


def read_event(path: Path) -> Event:
    """
    Read the one event of a QuakeML file or of an ASDF workspace.

    Raises
    ------
    CatalogError
        If the file cannot be read or does not hold exactly one event with an origin.
    """
    return read_event_file(path).event


def read_event_file(path: Path) -> EventFile:
    """Read the one event of a file with the file's hash; parameters and errors of `read_event`."""
    # A workspace, which may be large, is never in memory as a whole
    try:
        with open_file(path) as file:
            head = file.read(len(ASDF_MARK))
            content = b"" if head == ASDF_MARK else head + file.read()
        if head == ASDF_MARK:
            return EventFile(path, file_hash(path), _only_event(read_asdf_events(path), str(path)))
        events = read_content(obspy.read_events, content, path)
    except RecordRejected as rejection:
        raise CatalogError(str(path), "; ".join(rejection.reasons)) from rejection
    except OSError as error:
        raise CatalogError(str(path), f"cannot be read: {reason_of(error)}") from error
    return EventFile(path, bytes_hash(content), _only_event(events, str(path)))


def portable(file: EventFile) -> EventFile:
    """
    Return an event file whose event can be sent to other processes.

    Its event holds one origin and at most one magnitude, the preferred ones: ObsPy keeps which are
    preferred in a table of the process, so that a pickled event may lack them.
    """
    event = file.event
    origin = event.preferred_origin() or event.origins[0]
    magnitude = magnitude_of(event)
    magnitudes = [] if magnitude is None else [magnitude]
    return file._replace(event=Event(origins=[origin], magnitudes=magnitudes))


def _only_event(events: list[Event], source: str) -> Event:
    """Return the one event of a list; raise ``CatalogError`` if a fact of it cannot be true."""
    if len(events) != 1:
        raise CatalogError(source, f"must hold one event, holds {len(events)}")
    # Place and time of the earthquake are needed everywhere, its magnitude may be unknown
    event = events[0]
    try:
        problem = row_problem(quakeml_row(event))
    except RecordRejected as rejection:
        problem = "; ".join(rejection.reasons)
    if problem:
        raise CatalogError(source, f"the event {event.resource_id}: {problem}")
    if magnitude_of(event) is not event.preferred_magnitude():
        event.preferred_magnitude_id = None
    event.magnitudes = [size for size in event.magnitudes if size.mag is not None]
    origin = event.preferred_origin() or event.origins[0]
    origin.longitude = quakeml_row(event).longitude
    return event


def magnitude_of(event: Event) -> Magnitude | None:
    """Return the preferred magnitude of an event, else its first; None if none has a value."""
    sizes = [event.preferred_magnitude(), *event.magnitudes]
    return next((size for size in sizes if size and size.mag is not None), None)


def quakeml_row(event: Event) -> EventRow:
    """
    Return one earthquake of a QuakeML file, from its preferred origin and magnitude.

    Raises
    ------
    RecordRejected
        If it has no origin with time, latitude and longitude.
    """
    name = str(event.resource_id)
    if not event.origins:
        raise RecordRejected(name, "has no origin")
    origin = event.preferred_origin() or event.origins[0]
    missing = [name for name in ("time", "latitude", "longitude") if origin[name] is None]
    if missing:
        raise RecordRejected(name, f"has an origin without {' and '.join(missing)}")
    # Magnitude and place may be unknown
    size, descriptions = magnitude_of(event), event.event_descriptions
    longitude = float(origin.longitude)
    return EventRow(
        name.rpartition("/")[2],
        iso_time(origin.time),
        float(origin.latitude),
        # Some agencies count to 360 degrees east
        longitude - 360.0 if 180.0 < longitude <= 360.0 else longitude,
        origin.depth,
        float(size.mag) if size else None,
        (size.magnitude_type or "") if size else "",
        (descriptions[0].text or "") if descriptions else "",
    )


def row_problem(row: EventRow) -> str:
    """
    Return the fault in the facts of an earthquake; empty if they are plausible.

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


def iso_time(time: UTCDateTime) -> str:
    """Return a time in ISO 8601 to the millisecond."""
    return str(time.datetime.isoformat(timespec="milliseconds"))
