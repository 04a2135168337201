"""Download of one station: records and metadata from the first of several FDSN services."""

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

import obspy

from per_obspy.errors import RecordRejected, ServiceError
from per_obspy.files import bytes_hash, written_whole
from per_obspy.names import inside, public_url
from per_obspy.records.fdsn.request import Wanted, channel_parameters, digest
from per_obspy.records.fdsn.web import RequestTooLarge, WebPool, answer, host, whole_answer
from per_obspy.records.folder import station_name
from per_obspy.records.obspy_readers import read_bytes_with_obspy
from per_obspy.records.seedlink.seedlink_window import seedlink_window
from per_obspy.records.seedlink.server_address import ServerAddress
from per_obspy.resume import StatusError, hash_if_readable, read_status, write_status

#: Times that an answer without an announced end is compared with the next.
_COMPARISONS = 3


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


class Outcome(NamedTuple):
    """
    Outcome of the download of a station.

    Attributes
    ----------
    station : str
        ``"NET.STA"``.
    reasons : tuple of str
        Why it is not in the cache, one per service; empty if it is.
    lasting : bool
        Whether another attempt would be useless: every service answered that it has no data.
    """

    station: str
    reasons: tuple[str, ...]
    lasting: bool


def fetch_station(
    pool: WebPool,
    wanted: Wanted,
    folder: Path,
    station: str,
    offers: list[Offer],
    live: Sequence[ServerAddress] = (),
) -> Outcome:
    """
    Download a station into a folder as ``NET.STA.mseed`` and ``NET.STA.xml``.

    A file that is as it was fetched is not requested again; ``NET.STA.json`` has the hashes of both
    and the channels that were asked for.

    Parameters
    ----------
    pool : WebPool
        From :func:`per_obspy.records.fdsn.web.web_pool`.
    wanted : Wanted
        Window and codes.
    folder : Path
        Of the cache.
    station : str
        ``"NET.STA"``.
    offers : list of Offer
        In order of preference.
    live : sequence of ServerAddress
        SeedLink servers, which are asked for records that no service has.
    """
    reasons, lasting = [], True
    # The next service is tried only where one fails
    for offer in offers:
        try:
            _fetch_records(pool, wanted, inside(folder, f"{station}.mseed"), offer)
            _fetch_metadata(pool, wanted, inside(folder, f"{station}.xml"), offer)
        except _NoData as refusal:
            reasons.append(str(refusal))
        except (ServiceError, RecordRejected) as fault:
            reasons.append(str(fault))
            lasting = False
        else:
            return Outcome(station, (), lasting=True)
    # Minutes after an earthquake archives may lack data that servers of real-time data have
    for server, offer in product(live, offers):
        try:
            _fetch_live(pool, wanted, inside(folder, f"{station}.mseed"), offer, server)
            _fetch_metadata(pool, wanted, inside(folder, f"{station}.xml"), offer)
        except _NoData as refusal:
            reasons.append(str(refusal))
        except (ServiceError, RecordRejected) as fault:
            reasons.append(str(fault))
            lasting = False
        else:
            return Outcome(station, (), lasting=True)
    return Outcome(station, tuple(dict.fromkeys(reasons)), lasting)


class _NoData(ServiceError):
    """A service answered that it has no data (204)."""


def _fetch_records(pool: WebPool, wanted: Wanted, path: Path, offer: Offer) -> None:
    """Download the records of a station unless they are there."""
    if _is_whole(path, wanted):
        return
    url = f"{offer.base}/fdsnws/dataselect/1/query"
    parameters = _parameters(wanted, path.stem)
    content = _records(pool, url, parameters, offer)
    if not content:
        raise _NoData(f"{host(url)} has no data of the window")
    found = _channels(content, url, path.stem)
    # A cut at a MiniSEED record loses whole channels: those that are missing are asked for alone
    for codes in offer.channels:
        if codes not in found:
            alone = _framed(pool, url, parameters | _selected(codes))
            if alone and codes not in _channels(alone, url, path.stem):
                problem = f"answers with data other than channel {'.'.join(codes)}"
                raise RecordRejected(public_url(url), problem)
            content += alone
    _write(path, content, wanted, offer)


def _fetch_live(
    pool: WebPool, wanted: Wanted, path: Path, offer: Offer, server: ServerAddress
) -> None:
    """Download the records of a station from a SeedLink server unless they are there."""
    if _is_whole(path, wanted):
        return
    window = (wanted.start, wanted.end)
    content = seedlink_window(pool, server, path.stem, offer.channels, window)
    if not content:
        raise _NoData(f"{server} has no data of the window")
    # Records of another station must not enter the cache under this name
    _channels(content, f"seedlink://{server}", path.stem)
    _write(path, content, wanted, offer)


def _channels(content: bytes, url: str, station: str) -> set[tuple[str, str]]:
    """Return location and channel codes in whole MiniSEED of a station."""
    shown = public_url(url)
    traces = read_bytes_with_obspy(obspy.read, content, shown, format="MSEED")
    # A cut answer ends within a MiniSEED record
    record_length = min(trace.stats.mseed.record_length for trace in traces)
    if surplus := len(content) % record_length:
        problem = f"the answer is cut: its last MiniSEED record has {surplus} bytes"
        raise RecordRejected(shown, problem)
    _check(shown, station, {station_name(trace) for trace in traces})
    return {(trace.stats.location, trace.stats.channel) for trace in traces}


def _records(pool: WebPool, url: str, parameters: dict[str, str], offer: Offer) -> bytes:
    """Return the records of a station, channel by channel if all at once are too many."""
    try:
        return _framed(pool, url, parameters)
    except RequestTooLarge:
        each = map(_selected, offer.channels)
        return b"".join(_framed(pool, url, parameters | codes) for codes in each)


def _selected(codes: tuple[str, str]) -> dict[str, str]:
    """Return the parameters that select one channel."""
    return {"location": codes[0] or "--", "channel": codes[1]}


def _framed(pool: WebPool, url: str, parameters: dict[str, str]) -> bytes:
    """Return an answer whose end the service announced, or that is the same a second time."""
    first = whole_answer(pool, url, parameters)
    # Where no length is announced, a connection that breaks looks like the end
    for _ in range(_COMPARISONS):
        if first.is_framed:
            return first.content
        second = whole_answer(pool, url, parameters)
        if second.content == first.content:
            return first.content
        first = second
    raise ServiceError(f"{public_url(url)}: its answers are cut at different places")


def _fetch_metadata(pool: WebPool, wanted: Wanted, path: Path, offer: Offer) -> None:
    """Download the metadata of a station unless they are there."""
    if _is_whole(path, wanted):
        return
    url = f"{offer.base}/fdsnws/station/1/query"
    content = answer(pool, url, _parameters(wanted, path.stem) | {"level": "response"})
    if not content:
        raise _NoData(f"{host(url)} has no metadata of the window")
    shown = public_url(url)
    inventory = read_bytes_with_obspy(obspy.read_inventory, content, shown, format="STATIONXML")
    # An answer for another station must not enter the cache under this name
    found = {f"{network.code}.{station.code}" for network in inventory for station in network}
    _check(shown, path.stem, found)
    _write(path, content, wanted, offer)


def _parameters(wanted: Wanted, station: str) -> dict[str, str]:
    """Return the parameters of a request for one station."""
    network, code = station.split(".", 1)
    return {"network": network, "station": code} | channel_parameters(wanted)


def _check(url: str, station: str, found: set[str]) -> None:
    """Refuse an answer that does not hold exactly the station of the request."""
    if found != {station}:
        raise RecordRejected(
            url, f"answers with {', '.join(sorted(found)) or 'no data'} instead of {station}"
        )


def _write(path: Path, content: bytes, wanted: Wanted, offer: Offer) -> None:
    """Write a file of a station, and then its hash into the status of the station."""
    outputs = {name: known for name, known in _outputs(path, wanted).items() if name != path.name}
    with written_whole(path) as part:
        part.write_bytes(content)
    outputs[path.name] = bytes_hash(content)
    # The word shard makes the status a description, which a folder of records passes over
    facts = {"shard": outputs.get(f"{path.stem}.mseed"), "channels": offer.channels}
    write_status(station_status(path), _key(path, wanted), outputs, facts)


def station_status(path: Path) -> Path:
    """Return the status file of a station, with hashes and channels, by one of its files."""
    return path.with_suffix(".json")


def _is_whole(path: Path, wanted: Wanted) -> bool:
    """Return whether a file is as it was fetched by the same request."""
    known = _outputs(path, wanted).get(path.name)
    return bool(known) and hash_if_readable(path) == known


def _outputs(path: Path, wanted: Wanted) -> dict[str, str]:
    """Return the hashes in the status of a station; empty if it is missing or of other work."""
    try:
        status = read_status(station_status(path))
    except StatusError:
        return {}
    return dict(status["outputs"]) if status["key"] == _key(path, wanted) else {}


def _key(path: Path, wanted: Wanted) -> str:
    """Return the hash of the request for a station."""
    return digest(_parameters(wanted, path.stem))
