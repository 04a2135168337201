"""QuakeML: earthquakes of files and answers, and the one earthquake of a run."""

from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import obspy
from obspy import UTCDateTime
from obspy.core.event import Catalog, Event, Magnitude, Origin, ResourceIdentifier

from per_obspy.errors import CatalogError, RecordRejected, shortened
from per_obspy.files import bytes_hash, file_hash, reading
from per_obspy.names import LONGEST_CODE, code_problem
from per_obspy.records.archive import open_file
from per_obspy.records.asdf import ASDF_MARK, read_asdf_events
from per_obspy.records.earthquakes.earthquake import Earthquake, origin_of
from per_obspy.records.fdsn.request import digest
from per_obspy.records.obspy_readers import read_bytes_with_obspy, read_content

#: Bytes of the largest QuakeML file of several earthquakes that is read.
LARGEST_FILE = 64 * 2**20


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
        with reading(path):
            with open_file(path) as file:
                head = file.read(len(ASDF_MARK))
                content = b"" if head == ASDF_MARK else head + file.read()
            if head == ASDF_MARK:
                return EventFile(
                    path, file_hash(path), _only_event(read_asdf_events(path), str(path))
                )
            events = read_content(obspy.read_events, content, path)
    except RecordRejected as rejection:
        raise CatalogError(str(path), "; ".join(rejection.reasons)) from rejection
    return EventFile(path, bytes_hash(content), _only_event(events, str(path)))


def _only_event(events: list[Event], source: str) -> Event:
    """Return the one event of a list; raise ``CatalogError`` if a fact of it cannot be true."""
    if len(events) != 1:
        raise CatalogError(source, f"must hold one event, holds {len(events)}")
    # Place and time of the earthquake are needed everywhere, its magnitude may be unknown
    event = events[0]
    earthquake, problem = _plausible(event)
    if problem:
        raise CatalogError(source, f"the event {event.resource_id}: {problem}")
    if magnitude_of(event) is not event.preferred_magnitude():
        event.preferred_magnitude_id = None
    event.magnitudes = [size for size in event.magnitudes if size.mag is not None]
    origin_of(event).longitude = earthquake.longitude
    return event


def portable(file: EventFile) -> EventFile:
    """
    Return an event file whose event can be sent to other processes.

    Its event holds one origin and at most one magnitude, the preferred ones: ObsPy keeps which are
    preferred in a table of the process, so that a pickled event may lack them.
    """
    size = magnitude_of(file.event)
    magnitudes = [] if size is None else [size]
    return file._replace(event=Event(origins=[origin_of(file.event)], magnitudes=magnitudes))


def magnitude_of(event: Event) -> Magnitude | None:
    """Return the preferred magnitude of an event, else its first; None if none has a value."""
    sizes = [event.preferred_magnitude(), *event.magnitudes]
    return next((size for size in sizes if size and size.mag is not None), None)


def earthquake_of(event: Event) -> Earthquake:
    """
    Return the facts of an event, from its preferred origin and magnitude.

    Raises
    ------
    RecordRejected
        If it has no origin with time, latitude and longitude.
    """
    name = str(event.resource_id)
    if not event.origins:
        raise RecordRejected(name, "has no origin")
    origin = origin_of(event)
    missing = [name for name in ("time", "latitude", "longitude") if origin[name] is None]
    if missing:
        raise RecordRejected(name, f"has an origin without {' and '.join(missing)}")
    # Magnitude and place may be unknown
    size, descriptions = magnitude_of(event), event.event_descriptions
    longitude = float(origin.longitude)
    return Earthquake(
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


def _plausible(event: Event) -> tuple[Earthquake, str]:
    """Return the facts of an event, and what is wrong with them."""
    try:
        earthquake = earthquake_of(event)
    except RecordRejected as rejection:
        return Earthquake(), "; ".join(rejection.reasons)
    return earthquake, earthquake.fault


def iso_time(time: UTCDateTime) -> str:
    """Return a time in ISO 8601 to the millisecond."""
    return str(time.datetime.isoformat(timespec="milliseconds"))


def read_quakeml(path: Path) -> tuple[dict[str, Event], list[str]]:
    """
    Read the earthquakes of a QuakeML file, each alone.

    Returns
    -------
    events : dict
        Identifier -> event whose facts may be true.
    problems : list of str
        One per event that has no place or time, or one that cannot be true.

    Raises
    ------
    CatalogError
        If it cannot be read, is too large, or is no QuakeML.
    """
    # ObsPy needs many times the size of a file in memory
    try:
        with reading(path):
            if path.stat().st_size > LARGEST_FILE:
                raise CatalogError(str(path), f"is larger than {LARGEST_FILE} bytes")
            catalog = events_of(path.read_bytes(), str(path))
    except RecordRejected as error:
        raise CatalogError(str(path), f"is no QuakeML: {'; '.join(error.reasons)}") from error
    # One earthquake without a place costs no other
    events, problems = {}, []
    for event in catalog:
        earthquake, problem = _plausible(event)
        if problem:
            problems.append(f"{path.name}: {shortened(str(event.resource_id), 80)}: {problem}")
        else:
            events[earthquake.event_id] = event
    return events, problems


def events_of(content: bytes, source: str) -> list[Event]:
    """Return the events of QuakeML; raise ``RecordRejected`` if it is none."""
    return list(read_bytes_with_obspy(obspy.read_events, content, source, format="QUAKEML"))


def plain_quakeml(event: Event, event_id: str) -> bytes:
    """
    Return the preferred origin and magnitude of an earthquake as QuakeML.

    The bytes depend on time, place and magnitude alone, so that no station is computed again when
    a service changes other facts.

    Parameters
    ----------
    event : Event
        With an origin.
    event_id : str
        For its resource identifier.
    """
    # ObsPy's own identifiers would be random
    name = f"smi:local/{file_name(event_id)}"
    identifier = {
        kind: ResourceIdentifier(f"{name}/{kind}")
        for kind in ("origin", "magnitude", "event", "catalog")
    }
    known, size = origin_of(event), magnitude_of(event)
    places = {key: known[key] for key in ("time", "latitude", "longitude", "depth")}
    plain = Event(
        resource_id=identifier["event"],
        origins=[Origin(resource_id=identifier["origin"], **places)],
    )
    if size is not None:
        facts = {"mag": size.mag, "magnitude_type": size.magnitude_type}
        plain.magnitudes.append(Magnitude(resource_id=identifier["magnitude"], **facts))
    content = BytesIO()
    Catalog([plain], resource_id=identifier["catalog"]).write(content, format="QUAKEML")
    return content.getvalue()


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
