"""Section ``[records.fdsn]`` of a configuration for the identifier of an earthquake."""

from pathlib import Path

from per_obspy.pipeline.fetch import CHANNELS
from per_obspy.records.earthquakes.services import OTHERS, RECORDS_OF, event_of


def event_section(identifier: str, cache: Path) -> dict[str, object]:
    """
    Return the section ``[records.fdsn]`` for the identifier of an earthquake.

    Parameters
    ----------
    identifier : str
        As :func:`per_obspy.records.earthquakes.services.event_of` takes it.
    cache : Path
        Cache of the fetched files.

    Examples
    --------
    >>> event_section("GEONET:2016p858000", Path("fetched"))["event_provider"]
    'GEONET'
    """
    provider, event = event_of(identifier)
    return {
        "event_id": event,
        "event_provider": provider,
        "providers": list(RECORDS_OF.get(provider, OTHERS)),
        "channels": list(CHANNELS),
        "cache": str(cache),
    }
