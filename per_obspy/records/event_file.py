"""The one earthquake of a QuakeML file or of an ASDF workspace, read and hashed together."""

from pathlib import Path
from typing import NamedTuple

import obspy
from obspy.core.event import Event

from per_obspy.errors import CatalogError, RecordRejected, reason_of
from per_obspy.files import bytes_hash, file_hash
from per_obspy.records.archives.archive_files import open_file
from per_obspy.records.asdf import ASDF_MARK, read_asdf_event
from per_obspy.records.obspy_readers import read_content


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
        With at least one origin that has a time.
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
            return EventFile(path, file_hash(path), read_asdf_event(path))
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
    magnitude = event.preferred_magnitude() or next(iter(event.magnitudes), None)
    magnitudes = [] if magnitude is None else [magnitude]
    return file._replace(event=Event(origins=[origin], magnitudes=magnitudes))


def _only_event(events: list[Event], source: str) -> Event:
    """Return the one event of a list; raise ``CatalogError`` if its origin or time is missing."""
    if len(events) != 1:
        raise CatalogError(source, f"must hold one event, holds {len(events)}")
    # Place and time of the earthquake are needed everywhere
    event = events[0]
    if not event.origins:
        raise CatalogError(source, f"the event {event.resource_id} has no origin")
    origin = event.preferred_origin() or event.origins[0]
    if origin.time is None:
        raise CatalogError(source, f"the event {event.resource_id} has an origin without time")
    return event
