"""Which stations and which time window are wanted of a service."""

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
    A circle on the earth, a time window, and SEED codes with ``*`` and ``?``.

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
    """Return what a configuration wants; what it leaves open, which needs an event, is seen from the origin."""
    start, end = window(request, event)
    return Wanted(
        float(_origin(event).latitude if request.latitude is None else request.latitude),
        float(_origin(event).longitude if request.longitude is None else request.longitude),
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
    Return the time window; where its start or end is not given, it is seen from the event's origin time.

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
    assert event is not None  # config.Records demands an event where place or time is not given
    return event.preferred_origin() or event.origins[0]


def station_parameters(wanted: Wanted) -> dict[str, str]:
    """Return the parameters of an FDSN station service that select what is wanted."""
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
    """Return the parameters that select channels and window, the same for every station."""
    return {
        "location": ",".join(wanted.locations),
        "channel": ",".join(wanted.channels),
        "starttime": wanted.start.strftime("%Y-%m-%dT%H:%M:%S.%f"),
        "endtime": wanted.end.strftime("%Y-%m-%dT%H:%M:%S.%f"),
    }


def folder_name(wanted: Wanted) -> str:
    """Return the name of the folder for everything of the same window and channels, wherever the stations are."""
    times = "-".join(time.strftime("%Y%m%dT%H%M%S") for time in (wanted.start, wanted.end))
    return f"{times}-{digest(channel_parameters(wanted))}"


def digest(said: object) -> str:
    """Return eight characters that stand for what was said."""
    return hashlib.sha256(repr(said).encode()).hexdigest()[:8]


def stations_inside(inventory: Inventory, wanted: Wanted) -> set[str]:
    """Return the stations of an inventory, ``"NET.STA"``, that are wanted."""
    return {
        f"{network.code}.{station.code}"
        for network in inventory
        if _matches(network.code, wanted.networks)
        for station in network
        if _matches(station.code, wanted.stations) and _distance(wanted, station) <= wanted.radius
    }


def _matches(code: str, patterns: Iterable[str]) -> bool:
    return any(fnmatchcase(code, pattern) for pattern in patterns)


def _distance(wanted: Wanted, station: Station) -> float:
    """Return the distance from the centre, degrees."""
    return float(
        locations2degrees(wanted.latitude, wanted.longitude, station.latitude, station.longitude)
    )
