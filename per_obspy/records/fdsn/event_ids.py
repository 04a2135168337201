"""
Identifiers of earthquakes: which service knows them, by their form or by a name before them.

Each service accepts its identifiers as parameter ``eventid`` of the FDSN event service:
the USGS (https://earthquake.usgs.gov/fdsnws/event/1), GeoNet (``publicID``,
https://service.geonet.org.nz/fdsnws/event/1), EMSC (https://www.seismicportal.eu/fdsnws/event/1)
and INGV (https://webservices.ingv.it/fdsnws/event/1).
"""

import re
from pathlib import Path

from per_obspy.errors import CatalogError, shortened
from per_obspy.names import LONGEST_CODE
from per_obspy.records.fdsn.providers import base_url

#: form of an identifier -> provider that writes it so
_FORMS = {
    # Code of a network and its number: us7000abcd, ci38457511, official20110311054624120_30
    r"[a-z]{2}\d[a-z0-9]{5,12}|us[a-z]000[a-z0-9]{4}|(iscgem|official)\d[a-z0-9_]{3,30}": "USGS",
    # Year, letter p and part of the year: 2016p858000
    r"\d{4}p\d{6}": "GEONET",
    # Date and number of the day: 20161113_0000040
    r"\d{8}_\d{7}": "EMSC",
}

#: Letters that identifiers of services have.
_IDENTIFIER = re.compile(rf"[A-Za-z0-9._:/=-]{{1,{LONGEST_CODE}}}")

#: event service -> providers of records that are asked by default
RECORDS_OF = {
    "USGS": ("earthscope-federator", "eida-routing"),
    "EMSC": ("eida-routing", "earthscope-federator"),
    "GEONET": ("GEONET",),
    "INGV": ("INGV", "eida-routing"),
}

#: Providers of records of all other event services.
OTHERS = ("earthscope-federator", "eida-routing")

EXPECTED = "us7000abcd, geonet:2016p858000, emsc:20161113_0000040 or ingv:8863681"


def event_of(identifier: str) -> tuple[str, str]:
    """
    Return the event service of an identifier and the identifier as that service names it.

    Parameters
    ----------
    identifier : str
        ``PROVIDER:ID``, where the provider is a name of ObsPy in any case; or an ID alone of the
        USGS, GeoNet or EMSC, whose forms differ. No request is made.

    Raises
    ------
    CatalogError
        If the provider is unknown, or an ID without a provider has no known form.

    Examples
    --------
    >>> event_of("us7000abcd"), event_of("2016p858000"), event_of("INGV:8863681")
    (('USGS', 'us7000abcd'), ('GEONET', '2016p858000'), ('INGV', '8863681'))
    """
    provider, mark, name = identifier.strip().partition(":")
    if mark and not name.startswith("//"):
        _require_known(provider, identifier)
        return provider.upper(), _usable(name, identifier)
    # Forms of the services differ
    for form, known in _FORMS.items():
        if re.fullmatch(form, identifier.strip()):
            return known, _usable(identifier.strip(), identifier)
    problem = f"its form is not that of an earthquake of one service: expected {EXPECTED}"
    raise CatalogError(shortened(identifier), problem)


def is_event_id(text: str) -> bool:
    """
    Return whether a text is an identifier of an earthquake and no file or folder.

    >>> is_event_id("us7000abcd"), is_event_id("records"), is_event_id("run.toml")
    (True, False, False)
    """
    if Path(text).exists():
        return False
    try:
        event_of(text)
    except CatalogError:
        return False
    return any(letter.isdigit() for letter in text)


def _require_known(provider: str, identifier: str) -> None:
    """Raise ``CatalogError`` unless ObsPy knows a provider."""
    try:
        base_url(provider)
    except CatalogError as error:
        problem = f"{provider!r} before the colon is no event service: expected {EXPECTED}"
        raise CatalogError(shortened(identifier), problem) from error


def _usable(name: str, identifier: str) -> str:
    """Return an identifier whose letters are those of identifiers."""
    if not _IDENTIFIER.fullmatch(name):
        problem = f"{name[:40]!r} is no identifier of an earthquake: expected {EXPECTED}"
        raise CatalogError(shortened(identifier), problem)
    return name
