"""Earthquakes of QuakeML files and answers, and QuakeML with the facts for their screening."""

from io import BytesIO
from pathlib import Path

import obspy
from obspy.core.event import Catalog, Event, Magnitude, Origin, ResourceIdentifier

from per_obspy.errors import CatalogError, RecordRejected, reason_of, shortened
from per_obspy.records.event_file import EventRow, magnitude_of, quakeml_row, row_problem
from per_obspy.records.fdsn.event_list import file_name
from per_obspy.records.obspy_readers import read_bytes_with_obspy

#: Bytes of the largest QuakeML file that is read.
LARGEST_FILE = 64 * 2**20


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
        if path.stat().st_size > LARGEST_FILE:
            raise CatalogError(str(path), f"is larger than {LARGEST_FILE} bytes")
        found = events_of(path.read_bytes(), str(path))
    except RecordRejected as error:
        raise CatalogError(str(path), f"is no QuakeML: {'; '.join(error.reasons)}") from error
    except OSError as error:
        raise CatalogError(str(path), f"cannot be read: {reason_of(error)}") from error
    # One earthquake without a place costs no other
    events, problems = dict[str, Event](), list[str]()
    for event in found:
        try:
            row = quakeml_row(event)
            problem = row_problem(row)
        except RecordRejected as error:
            problem = "; ".join(error.reasons)
        if problem:
            problems.append(f"{path.name}: {shortened(str(event.resource_id), 80)}: {problem}")
        else:
            events[row.event_id] = event
    return events, problems


def quakeml_rows(path: Path) -> tuple[dict[str, EventRow], list[str]]:
    """Return the facts of the earthquakes of a QuakeML file, as :func:`read_quakeml` does."""
    events, problems = read_quakeml(path)
    return {name: quakeml_row(event) for name, event in events.items()}, problems


def events_of(content: bytes, source: str) -> list[Event]:
    """Return the earthquakes of QuakeML; raise ``RecordRejected`` if it is none."""
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
    name = f"smi:local/{file_name(event_id)}"
    found = event.preferred_origin() or event.origins[0]
    origin = Origin(
        resource_id=ResourceIdentifier(f"{name}/origin"),
        time=found.time,
        latitude=found.latitude,
        longitude=found.longitude,
        depth=found.depth,
    )
    size = magnitude_of(event)
    magnitudes = [] if size is None else [_plain_magnitude(size, name)]
    # ObsPy's own identifiers would be random
    identifier = ResourceIdentifier(f"{name}/event")
    plain = Event(resource_id=identifier, origins=[origin], magnitudes=magnitudes)
    catalog = Catalog([plain], resource_id=ResourceIdentifier(f"{name}/catalog"))
    content = BytesIO()
    catalog.write(content, format="QUAKEML")
    return content.getvalue()


def _plain_magnitude(size: Magnitude, name: str) -> Magnitude:
    """Return value and type of a magnitude."""
    identifier = ResourceIdentifier(f"{name}/magnitude")
    return Magnitude(resource_id=identifier, mag=size.mag, magnitude_type=size.magnitude_type)
