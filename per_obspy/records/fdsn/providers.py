"""Providers of FDSN web services: names, base URLs, and routers that list them."""

import re
from collections.abc import Iterable, Mapping

from obspy.clients.fdsn.header import URL_MAPPINGS

from per_obspy.errors import CatalogError, Rejection, ServiceError
from per_obspy.names import public_url
from per_obspy.records.fdsn.web import WebPool, answer

#: routers -> query URL, fixed parameters (of an answer with base URLs) and parameters that they
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
        From :func:`per_obspy.records.fdsn.web.web_pool`.
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
        try:
            urls |= dict.fromkeys(_routed(pool, provider, selection))
        except ServiceError as error:
            url = ROUTERS[provider][0]
            rejected.append(Rejection("service", provider, url, None, (str(error),)))
    return list(urls), rejected


def _routed(pool: WebPool, router: str, selection: Mapping[str, str]) -> list[str]:
    """Return the base URLs in the answer of a router."""
    url, fixed, understood = ROUTERS[router]
    parameters = {name: selection[name] for name in understood if name in selection}
    page = answer(pool, url, fixed | parameters)
    return _STATION_SERVICE.findall(page.decode("utf-8", "replace"))
