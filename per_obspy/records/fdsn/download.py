"""The records and the metadata of one station, from the first of several FDSN services that has them."""

from pathlib import Path
from typing import NamedTuple

import obspy
import urllib3

from per_obspy.errors import RecordRejected, ServiceError
from per_obspy.files import written_whole
from per_obspy.records.fdsn.request import Wanted, channel_parameters
from per_obspy.records.fdsn.web import RequestTooLarge, answer, host
from per_obspy.records.obspy_readers import foreign_bytes


class Offer(NamedTuple):
    """
    What a service says that it has of a station.

    Attributes
    ----------
    base : str
        Base URL of the service.
    channels : tuple of (str, str)
        Location and channel codes.
    """

    base: str
    channels: tuple[tuple[str, str], ...]


class Outcome(NamedTuple):
    """
    What became of a station.

    Attributes
    ----------
    station : str
        ``"NET.STA"``.
    reasons : tuple of str
        Why it is not in the cache, one of each service; empty if it is.
    lasting : bool
        Whether there is nothing to be gained by asking again: every service said that it has no
        data.
    """

    station: str
    reasons: tuple[str, ...]
    lasting: bool


def fetch_station(
    pool: urllib3.PoolManager, wanted: Wanted, folder: Path, station: str, offers: list[Offer]
) -> Outcome:
    """
    Bring a station into a folder as ``NET.STA.mseed`` and ``NET.STA.xml``; what is there is not asked for again.

    Parameters
    ----------
    pool : urllib3.PoolManager
        From :func:`per_obspy.records.fdsn.web.web_pool`.
    wanted : Wanted
        Window and codes.
    folder : Path
        Of the cache.
    station : str
        ``"NET.STA"``.
    offers : list of Offer
        In order of preference.
    """
    reasons, lasting = [], True
    for offer in offers:
        try:
            _fetch_records(pool, wanted, folder / f"{station}.mseed", offer)
            _fetch_metadata(pool, wanted, folder / f"{station}.xml", offer)
        except _NoData as refusal:
            reasons.append(str(refusal))
        except (ServiceError, RecordRejected) as fault:
            reasons.append(str(fault))
            lasting = False
        else:
            return Outcome(station, (), lasting=True)
    return Outcome(station, tuple(reasons), lasting)


class _NoData(ServiceError):
    """A service answered that it has nothing (204)."""


def _fetch_records(pool: urllib3.PoolManager, wanted: Wanted, path: Path, offer: Offer) -> None:
    if path.is_file():
        return
    url = f"{offer.base}/fdsnws/dataselect/1/query"
    parameters = _parameters(wanted, path.stem)
    try:
        content = answer(pool, url, parameters)
    except RequestTooLarge:
        each = [
            {"location": location or "--", "channel": channel}
            for location, channel in offer.channels
        ]
        content = b"".join(answer(pool, url, parameters | one) for one in each)
    if not content:
        raise _NoData(f"{host(url)} has no data of the window")
    traces = foreign_bytes(obspy.read, content, url, format="MSEED")
    if surplus := len(content) % min(trace.stats.mseed.record_length for trace in traces):
        raise RecordRejected(
            url, f"the answer is cut: its last MiniSEED record has {surplus} bytes"
        )
    _check(url, path.stem, {f"{trace.stats.network}.{trace.stats.station}" for trace in traces})
    _write(path, content)


def _fetch_metadata(pool: urllib3.PoolManager, wanted: Wanted, path: Path, offer: Offer) -> None:
    if path.is_file():
        return
    url = f"{offer.base}/fdsnws/station/1/query"
    content = answer(pool, url, _parameters(wanted, path.stem) | {"level": "response"})
    if not content:
        raise _NoData(f"{host(url)} has no metadata of the window")
    inventory = foreign_bytes(obspy.read_inventory, content, url, format="STATIONXML")
    _check(
        url,
        path.stem,
        {f"{network.code}.{station.code}" for network in inventory for station in network},
    )
    _write(path, content)


def _parameters(wanted: Wanted, station: str) -> dict[str, str]:
    network, code = station.split(".", 1)
    return {"network": network, "station": code} | channel_parameters(wanted)


def _check(url: str, station: str, found: set[str]) -> None:
    if found != {station}:
        raise RecordRejected(
            url, f"answers with {', '.join(sorted(found)) or 'nothing'} instead of {station}"
        )


def _write(path: Path, content: bytes) -> None:
    with written_whole(path) as part:
        part.write_bytes(content)
