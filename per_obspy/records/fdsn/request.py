"""Requests to FDSN services (stations, channels, time window), and whether an answer is of one."""

import hashlib
from collections.abc import Iterable
from fnmatch import fnmatchcase
from typing import NamedTuple

from obspy import Inventory, UTCDateTime
from obspy.core.event import Event, Origin
from obspy.geodetics import kilometers2degrees, locations2degrees

from per_obspy import config
from per_obspy.errors import CatalogError
from per_obspy.records.earthquakes.earthquake import origin_of

#: Time of an answer before and after the window that is no fault, s: services cut at whole MiniSEED
#: records (reasoned: those of strong motion are shorter).
MARGIN = 60.0


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
    """Return the origin of an event."""
    assert event is not None  # config.Records demands an event where place or time is not given
    return origin_of(event)


def station_parameters(wanted: Wanted) -> dict[str, str]:
    """Return the parameters of a request for an FDSN station service."""
    return {
        "latitude": f"{wanted.latitude:.6g}",
        "longitude": f"{wanted.longitude:.6g}",
        "maxradius": f"{wanted.radius:.6g}",
        "network": ",".join(wanted.networks),
        "station": ",".join(wanted.stations),
        **channel_parameters(wanted),
    }


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
    return {
        f"{network.code}.{station.code}"
        for network in inventory
        for station in network
        if is_inside(wanted, network.code, station.code, (station.latitude, station.longitude))
    }


def is_inside(wanted: Wanted, network: str, station: str, place: tuple[float, float]) -> bool:
    """Return whether a request covers a station at a latitude and longitude, degrees."""
    if not _matches(network, wanted.networks) or not _matches(station, wanted.stations):
        return False
    return bool(locations2degrees(wanted.latitude, wanted.longitude, *place) <= wanted.radius)


def other_than_asked(
    wanted: Wanted,
    codes: tuple[str, str],
    start: UTCDateTime | None,
    end: UTCDateTime | None,
) -> str:
    """
    Return what distinguishes records or metadata of a channel from a request; empty if nothing.

    Parameters
    ----------
    wanted : Wanted
        Channels and window.
    codes : (str, str)
        Location and channel code of the answer.
    start, end : UTCDateTime or None
        Of the answer; None is open.

    Examples
    --------
    >>> start, end = UTCDateTime(2023, 2, 6, 1, 17), UTCDateTime(2023, 2, 6, 1, 22)
    >>> wanted = Wanted(37.2, 37.0, 1.0, start, end, ("*",), ("*",), ("*",), ("HN?",))
    >>> other_than_asked(wanted, ("", "HNZ"), start + 30, end + 900)
    ''
    >>> other_than_asked(wanted, ("", "HNZ"), UTCDateTime(2022, 2, 6), UTCDateTime(2022, 2, 7))
    'of another time, 2022-02-06T00:00:00 to 2022-02-07T00:00:00'
    >>> other_than_asked(wanted, ("00", "BHZ"), start, end)
    'of another channel, 00.BHZ'
    """
    location, channel = codes
    # An empty location is asked for by dashes
    is_channel = _matches(channel, wanted.channels)
    if not is_channel or not _matches(location or "--", wanted.locations):
        return f"of another channel, {location}.{channel}"
    if (start and start > wanted.end + MARGIN) or (end and end < wanted.start - MARGIN):
        first, last = (str(time)[:19] if time else "open" for time in (start, end))
        return f"of another time, {first} to {last}"
    return ""


def asked_for(wanted: Wanted) -> str:
    """Return window and channels of a request in words, for messages."""
    times = " to ".join(str(time)[:19] for time in (wanted.start, wanted.end))
    return f"{','.join(wanted.channels)} from {times}"


def _matches(code: str, patterns: Iterable[str]) -> bool:
    """Check whether a code fits one of the patterns."""
    return any(fnmatchcase(code, pattern) for pattern in patterns)
