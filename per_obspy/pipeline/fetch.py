"""Fetching alone: fill the cache of a run's FDSN section without computing anything."""

from pathlib import Path
from typing import NamedTuple

from per_obspy.config import Run, load
from per_obspy.errors import CatalogError, Rejection
from per_obspy.progress import Progress, silent
from per_obspy.records.fdsn.cache import fetch, fetched_stations


class FetchResult(NamedTuple):
    """
    Records at hand after fetching.

    Attributes
    ----------
    folder : Path
        Where the records are.
    stations : list of str
        ``"NET.STA"`` of those with records.
    rejected : tuple of Rejection
        What could not be fetched or read, with every reason.
    """

    folder: Path
    stations: list[str]
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
