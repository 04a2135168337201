"""Requests to FDSN services: stations, channels and time window."""

import hashlib
from collections.abc import Iterable
from fnmatch import fnmatchcase
from typing import NamedTuple

from obspy import Inventory, UTCDateTime
from obspy.core.event import Event, Origin
from obspy.core.inventory import Station
from obspy.geodetics import kilometers2degrees, locations2degrees

from per_obspy import config
from per_obspy.errors import CatalogError


class Wanted(NamedTuple):
    """
    A request: a circle on the earth, a time window, and SEED codes with ``*`` and ``?``.

    Attributes
    ----------
    latitude, longitude : float
        Centre, degrees.
    radius : float
        Great-circle degrees.
    start, end : UTCDateTime
        Window.
    networks, stations, locations, channels : tuple of str
        Codes; an empty location is ``--``.
    """

    latitude: float
    longitude: float
    radius: float
    start: UTCDateTime
    end: UTCDateTime
    networks: tuple[str, ...]
    stations: tuple[str, ...]
    locations: tuple[str, ...]
    channels: tuple[str, ...]


def wanted_around(request: config.Fdsn, event: Event | None) -> Wanted:
    """
    Build the request of a configuration.

    Parameters
    ----------
    request : config.Fdsn
        A missing centre or window is that of the event's origin.
    event : Event or None
        Needed where the centre or the window is missing.
    """
    start, end = window(request, event)
    latitude = _origin(event).latitude if request.latitude is None else request.latitude
    longitude = _origin(event).longitude if request.longitude is None else request.longitude
    return Wanted(
        float(latitude),
        float(longitude),
        kilometers2degrees(request.radius / 1000),
        start,
        end,
        request.networks,
        request.stations,
        request.locations,
        request.channels,
    )


def window(request: config.Window, event: Event | None) -> tuple[UTCDateTime, UTCDateTime]:
    """
    Return the time window; a missing start or end is counted from the event's origin time.

    Raises
    ------
    CatalogError
        If it ends before it starts.
    """
    start = UTCDateTime(request.start) if request.start else _origin(event).time - request.before
    end = UTCDateTime(request.end) if request.end else _origin(event).time + request.after
    if end <= start:
        raise CatalogError("window", f"must end after its start, got {start} to {end}")
    return start, end


def _origin(event: Event | None) -> Origin:
    """Return the preferred origin of an event, or its first."""
    assert event is not None  # config.Records demands an event where place or time is not given
    return event.preferred_origin() or event.origins[0]


def station_parameters(wanted: Wanted) -> dict[str, str]:
    """Return the parameters of a request for an FDSN station service."""
    circle = {
        "latitude": wanted.latitude,
        "longitude": wanted.longitude,
        "maxradius": wanted.radius,
    }
    codes = {"network": wanted.networks, "station": wanted.stations}
    return (
        {name: f"{value:.6g}" for name, value in circle.items()}
        | {name: ",".join(values) for name, values in codes.items()}
        | channel_parameters(wanted)
    )


def channel_parameters(wanted: Wanted) -> dict[str, str]:
    """Return the parameters of channels and window, which all stations share."""
    return {
        "location": ",".join(wanted.locations),
        "channel": ",".join(wanted.channels),
        "starttime": wanted.start.strftime("%Y-%m-%dT%H:%M:%S.%f"),
        "endtime": wanted.end.strftime("%Y-%m-%dT%H:%M:%S.%f"),
    }


def folder_name(wanted: Wanted) -> str:
    """Return the name of the folder of all requests with the same window and channels."""
    times = "-".join(time.strftime("%Y%m%dT%H%M%S") for time in (wanted.start, wanted.end))
    return f"{times}-{digest(channel_parameters(wanted))}"


def digest(content: object) -> str:
    """Return the first eight characters of a hash of the content."""
    return hashlib.sha256(repr(content).encode()).hexdigest()[:8]


def stations_inside(inventory: Inventory, wanted: Wanted) -> set[str]:
    """Return the stations of an inventory, ``"NET.STA"``, that a request covers."""
    inside = set()
    for network in inventory:
        if not _matches(network.code, wanted.networks):
            continue
        for station in network:
            matches = _matches(station.code, wanted.stations)
            if matches and _distance(wanted, station) <= wanted.radius:
                inside.add(f"{network.code}.{station.code}")
    return inside


def _matches(code: str, patterns: Iterable[str]) -> bool:
    """Check whether a code fits one of the patterns."""
    return any(fnmatchcase(code, pattern) for pattern in patterns)


def _distance(wanted: Wanted, station: Station) -> float:
    """Return the distance from the centre, degrees."""
    return float(
        locations2degrees(wanted.latitude, wanted.longitude, station.latitude, station.longitude)
    )
