"""Fetching of records without a run: by a configuration, or around one earthquake."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from per_obspy.config import Fdsn, Records, Run, checked, load
from per_obspy.errors import CatalogError, Rejection
from per_obspy.names import public_url
from per_obspy.progress import Progress, silent
from per_obspy.records.earthquakes.services import OTHERS, RECORDS_OF, event_of
from per_obspy.records.earthquakes.shakemap_product import ShakeMapFiles
from per_obspy.records.fdsn.cache import fetch, fetched_stations

#: Radius around the epicentre in which stations of a named earthquake are wanted, m.
RADIUS = 100_000.0

#: Channels of a named earthquake: accelerometers in the codes of all networks.
CHANNELS = ("HN?", "HL?", "BN?", "BL?", "CN?", "EN?")


class FetchResult(NamedTuple):
    """Result of fetching the records of a configuration."""

    #: Where the records are.
    folder: Path
    #: ``"NET.STA"`` of those with records.
    stations: list[str]
    #: Records that could not be fetched or read, each with its reasons.
    rejected: tuple[Rejection, ...]


def fetch_configured(
    configuration: Path, again: bool = False, progress: Progress = silent
) -> FetchResult:
    """
    Fill the cache of a configuration.

    Parameters
    ----------
    configuration : Path
        TOML file of a run.
    again : bool
        Whether to ask again for stations of which every service had no data.
    progress : callable
        Called for every station: stage, done, total.

    Raises
    ------
    CatalogError
        If the configuration is wrong or has no section ``[records.fdsn]``.
    ServiceError
        If services fail and the cache has no station at all.
    """
    records = load(configuration, Run).records
    if records is None or records.fdsn is None:
        raise CatalogError(str(configuration), "has no section [records.fdsn]")
    fetched = fetch(records.fdsn, records.event, progress, again)
    found = fetched_stations(fetched)
    return FetchResult(fetched.folder, list(found.stations), found.rejected)


class FetchedEvent(NamedTuple):
    """Records of a named earthquake."""

    #: Event service, and the earthquake as it names it.
    provider: str
    event_id: str
    #: QuakeML file.
    event: Path
    #: With MiniSEED and StationXML of every station.
    folder: Path
    #: ``"NET.STA"`` of those with records.
    stations: list[str]
    #: Records that could not be fetched or read, each with its reasons.
    rejected: tuple[Rejection, ...]
    #: Section ``[records]`` of a configuration that reads all of this without the network.
    records: Records
    #: ShakeMap, if it was asked for and there is one.
    shakemap: ShakeMapFiles | None


def fetch_event(
    identifier: str,
    folder: Path,
    settings: Mapping[str, Any] | None = None,
    again: bool = False,
    progress: Progress = silent,
) -> FetchedEvent:
    """
    Fetch the records around an earthquake that an event service knows by an identifier.

    Parameters
    ----------
    identifier : str
        As :func:`per_obspy.records.earthquakes.services.event_of` takes it; of the event service in
        ``settings`` if there is one.
    folder : Path
        Cache of the fetched files; complete requests are answered from it.
    settings : mapping, optional
        Keys of the section ``[records.fdsn]`` with other values than the defaults:
        ``event_provider``, ``radius`` (m, 100 000), ``channels``, ``providers``, ``before``,
        ``after``, ``shakemap`` and so on.
    again : bool
        Whether to ask again for stations of which every service had no data.
    progress : callable
        Called for every station: stage, done, total.

    Raises
    ------
    CatalogError
        If the identifier or a setting is wrong, or the service has no such event.
    ServiceError
        If services fail and there is neither a station nor a ShakeMap.
    """
    given = dict(settings or {})
    # An event service that is named takes any identifier
    if "event_provider" in given:
        provider, event_id = str(given["event_provider"]), identifier
    else:
        provider, event_id = event_of(identifier)
    defaults = {
        "providers": RECORDS_OF.get(provider, OTHERS),
        "radius": RADIUS,
        "channels": CHANNELS,
    }
    named = {"cache": folder, "event_id": event_id, "event_provider": provider}
    request = checked(Fdsn, defaults | given | named, identifier)
    fetched = fetch(request, None, progress, again)
    assert fetched.event is not None  # which the identifier named
    found = fetched_stations(fetched)
    return FetchedEvent(
        public_url(provider),
        event_id,
        fetched.event.path,
        fetched.folder,
        list(found.stations),
        found.rejected,
        Records(fdsn=request),
        fetched.shakemap,
    )
