"""
Providers of FDSN web services: names, base URLs, routers, and the stations that services list.

Every line of a list is compared with the request; one wrong line costs no other.
"""

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from obspy.clients.fdsn.header import URL_MAPPINGS

from per_obspy.errors import CatalogError, Rejection, ServiceError, shortened
from per_obspy.formats.text.station_text import StationLine, station_lines
from per_obspy.names import SHOWN, code_problem, public_url
from per_obspy.records.fdsn.request import (
    Wanted,
    asked_for,
    is_inside,
    other_than_asked,
    station_parameters,
)
from per_obspy.records.fdsn.web import WebPool, answer, host

#: Routers -> query URL, fixed parameters (of an answer with base URLs) and parameters that they
#: understand
ROUTERS = {
    "eida-routing": (
        "https://www.orfeus-eu.org/eidaws/routing/1/query",
        {"service": "station", "format": "post"},
        ("network", "station", "location", "channel", "starttime", "endtime"),
    ),
    "earthscope-federator": (
        "https://service.earthscope.org/irisws/fedcatalog/1/query",
        {"format": "request", "level": "channel"},
        (
            "network",
            "station",
            "location",
            "channel",
            "starttime",
            "endtime",
            "latitude",
            "longitude",
            "maxradius",
        ),
    ),
}

_STATION_SERVICE = re.compile(r"(https?://\S+?)/fdsnws/station/\d")


def base_url(provider: str) -> str:
    """
    Return the base URL of a provider.

    >>> base_url("http://localhost:8080/"), base_url("GEONET")
    ('http://localhost:8080', 'https://service.geonet.org.nz')

    Raises
    ------
    CatalogError
        If it is neither a URL nor a name that ObsPy knows.
    """
    if provider.startswith(("http://", "https://")):
        return provider.rstrip("/")
    if provider.upper() not in URL_MAPPINGS:
        names = ", ".join(sorted(URL_MAPPINGS))
        raise CatalogError(
            public_url(provider),
            f"is neither a base URL, nor a router ({', '.join(ROUTERS)}) nor one of {names}",
        )
    return str(URL_MAPPINGS[provider.upper()])


def base_urls(
    pool: WebPool, providers: Iterable[str], selection: Mapping[str, str]
) -> tuple[list[str], list[Rejection]]:
    """
    Return the base URLs of providers in their order, each once.

    A router gives the base URLs in its answer.

    Parameters
    ----------
    pool : WebPool
        Connections and patience.
    providers : iterable of str
        ObsPy's names, base URLs, or the names of ``ROUTERS``.
    selection : mapping
        Parameters of the FDSN station service.

    Returns
    -------
    urls : list of str
    rejected : list of Rejection
        Routers that do not answer.
    """
    # A dictionary without values is a set that keeps its order
    urls, rejected = dict[str, None](), []
    for provider in providers:
        if provider not in ROUTERS:
            urls[base_url(provider)] = None
            continue
        url, fixed, understood = ROUTERS[provider]
        parameters = fixed | {name: selection[name] for name in understood if name in selection}
        try:
            page = answer(pool, url, parameters).decode("utf-8", "replace")
            urls |= dict.fromkeys(_STATION_SERVICE.findall(page))
        except ServiceError as error:
            rejected.append(Rejection("service", provider, url, None, (str(error),)))
    return list(urls), rejected


class Offer(NamedTuple):
    """
    The channels of a station that a service lists.

    Attributes
    ----------
    base : str
        Base URL of the service.
    channels : tuple of (str, str)
        Location and channel codes.
    """

    base: str
    channels: tuple[tuple[str, str], ...]


class StationList(NamedTuple):
    """
    Stations that services list of a request.

    Attributes
    ----------
    offers : dict
        ``"NET.STA"`` -> offers in the order of the services.
    failed : list of Rejection
        Routers and services that do not answer as they should.
    unusable : list of Rejection
        Lines and stations that cannot be used, and services without any station.
    """

    offers: dict[str, list[Offer]]
    failed: list[Rejection]
    unusable: list[Rejection]


def list_stations(pool: WebPool, providers: Iterable[str], wanted: Wanted) -> StationList:
    """
    Ask every service which stations of a request it has.

    Parameters
    ----------
    pool : WebPool
        Connections and patience.
    providers : iterable of str
        ObsPy's names, base URLs, or the names of ``ROUTERS``.
    wanted : Wanted
        The request.

    Raises
    ------
    CatalogError
        If a provider is unknown.
    """
    bases, failed = base_urls(pool, providers, station_parameters(wanted))
    offers: dict[str, list[Offer]] = defaultdict(list)
    unusable = list[Rejection]()
    for base in bases:
        url = f"{base}/fdsnws/station/1/query"
        # A service that fails affects only its stations
        try:
            lines = _listed(pool, url, wanted, unusable)
        except ServiceError as fault:
            failed.append(Rejection("service", host(url), public_url(url), None, (str(fault),)))
            continue
        # Several lines of a station are one offer
        channels: dict[str, set[tuple[str, str]]] = defaultdict(set)
        for line in lines:
            channels[f"{line.network}.{line.station}"].add((line.location, line.channel))
        for station in sorted(channels):
            offers[station].append(Offer(base, tuple(sorted(channels[station]))))
    # Services that answer without any station
    if not offers and not failed and not unusable:
        unusable = _no_station(bases, wanted)
    return StationList(offers, failed, unusable)


def _no_station(bases: list[str], wanted: Wanted) -> list[Rejection]:
    """Return one row per service that has no station inside the circle."""
    # Circle, channels and window of the request
    place = f"{wanted.radius:.3g} degrees of {wanted.latitude:g}, {wanted.longitude:g}"
    channels = f"channels {','.join(wanted.channels)} from {wanted.start} to {wanted.end}"
    reason = f"no station within {place} has {channels}"
    return [Rejection("service", host(base), public_url(base), None, (reason,)) for base in bases]


def _listed(
    pool: WebPool, url: str, wanted: Wanted, unusable: list[Rejection]
) -> list[StationLine]:
    """
    Return the channels that a service lists of a request; add a row per line that is of no use.

    Raises ``ServiceError`` if its answer is no list, or one of nothing that was asked for.
    """
    # Text is smaller than StationXML by far
    shown = public_url(url)
    content = answer(pool, url, station_parameters(wanted) | {"level": "channel", "format": "text"})
    if not content:
        return []
    try:
        lines, faults = station_lines(content)
    except ValueError as error:
        reason = f"answers with data other than a station list: {error}"
        raise ServiceError(f"{shown}: {reason}") from error
    asked = [line for line in lines if not _other_line(wanted, line)]
    # Nothing that was asked for is a fault of the service, not the absence of stations
    if lines and not asked:
        others = "; ".join(dict.fromkeys(_other_line(wanted, line) for line in lines))
        reason = f"{shown}: lists only stations that were not asked for: {shortened(others, 300)}"
        raise ServiceError(f"{reason}: asked for {asked_for(wanted)}")
    unusable += [Rejection("station", name, shown, row, (reason,)) for row, name, reason in faults]
    unnamed = _unnamed(asked, shown)
    unusable += unnamed.values()
    return [line for line in asked if f"{line.network}.{line.station}" not in unnamed]


def _unnamed(lines: list[StationLine], url: str) -> dict[str, Rejection]:
    """Return a row per station whose codes cannot name a file; its first wrong code is given."""
    rows = dict[str, Rejection]()
    for line in lines:
        name = f"{line.network}.{line.station}"
        if problem := code_problem(line.network, line.station, line.location, line.channel):
            row = Rejection("station", shortened(name, SHOWN), url, None, (problem,))
            rows.setdefault(name, row)
    return rows


def _other_line(wanted: Wanted, line: StationLine) -> str:
    """Return what distinguishes a line of a list from a request; empty if nothing does."""
    # The place decides before the channel
    place = (line.latitude, line.longitude)
    problem = other_than_asked(wanted, (line.location, line.channel), line.start, line.end)
    if not is_inside(wanted, line.network, line.station, place):
        problem = f"at {line.latitude:g}, {line.longitude:g}, which the request does not cover"
    return f"{shortened(f'{line.network}.{line.station}', SHOWN)} {problem}" if problem else ""
