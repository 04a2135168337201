"""Section ``[records.fdsn]`` of a configuration for the identifier of an earthquake."""

from pathlib import Path

from per_obspy.records.fdsn.providers import ROUTERS


def event_section(identifier: str, cache: Path) -> dict[str, object]:
    """
    Return the section ``[records.fdsn]`` for the identifier of an earthquake.

    Parameters
    ----------
    identifier : str
        Of the event service of the USGS, or ``PROVIDER:IDENTIFIER``.
    cache : Path
        Folder that keeps what is fetched.

    Examples
    --------
    >>> event_section("GEONET:2016p858000", Path("fetched"))["event_provider"]
    'GEONET'
    """
    provider, colon, event = identifier.rpartition(":")
    section = {"event_id": event, "cache": str(cache), "providers": list(ROUTERS)}
    return {**section, **({"event_provider": provider} if colon else {})}
