"""
Download of one station: records and metadata from the first of several FDSN services.

Time, station and channel of every answer are compared with the request.
"""

from collections.abc import Sequence
from contextlib import suppress
from io import BytesIO
from itertools import product
from pathlib import Path
from typing import NamedTuple

import obspy
from obspy import Inventory, Stream
from obspy.io.mseed.util import get_record_information

from per_obspy.errors import RecordRejected, Rejection, ServiceError
from per_obspy.files import bytes_hash, written_whole
from per_obspy.names import inside, public_url
from per_obspy.records.fdsn.request import (
    Wanted,
    asked_for,
    channel_parameters,
    digest,
    other_than_asked,
    stations_inside,
)
from per_obspy.records.fdsn.web import (
    EmptyAnswer,
    RequestTooLarge,
    WebPool,
    answer,
    host,
    whole_answer,
)
from per_obspy.records.folder import station_name
from per_obspy.records.obspy_readers import read_bytes_with_obspy
from per_obspy.records.seedlink.seedlink_window import seedlink_window
from per_obspy.records.seedlink.server_address import ServerAddress
from per_obspy.resume import Status, StatusError, hash_if_readable, read_status, write_status

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


class Records(NamedTuple):
    """
    Records of an answer that were asked for.

    Attributes
    ----------
    content : bytes
        MiniSEED; empty if the answer holds nothing that was asked for.
    channels : frozenset of (str, str)
        Location and channel codes in it.
    left_out : tuple of Rejection
        Channels of which records are left out, and why.
    """

    content: bytes
    channels: frozenset[tuple[str, str]]
    left_out: tuple[Rejection, ...] = ()


def _fetch_records(pool: WebPool, wanted: Wanted, path: Path, offer: Offer) -> None:
    """Download the records of a station unless they are there."""
    if _is_whole(path, wanted):
        return
    url = f"{offer.base}/fdsnws/dataselect/1/query"
    parameters = _parameters(wanted, path.stem)
    content = _records(pool, url, parameters, offer)
    if not content:
        raise _NoData(f"{host(url)} has no data of the window")
    records = asked_records(content, url, wanted, path.stem)
    if not records.content:
        raise _other(records, url, wanted)
    # A cut at a MiniSEED record loses whole channels: those that are missing are asked for alone
    for codes in offer.channels:
        if codes not in records.channels:
            records = _with_channel(pool, url, wanted, path.stem, records, codes)
    _write(path, records.content, wanted, offer, records.left_out)


def _with_channel(
    pool: WebPool,
    url: str,
    wanted: Wanted,
    station: str,
    records: Records,
    codes: tuple[str, str],
) -> Records:
    """Return the records of a station with those of one more channel, if its service has any."""
    alone = b""
    # The other channels are there, so that the service has none of this one
    with suppress(EmptyAnswer):
        alone = _framed(pool, url, _parameters(wanted, station) | _selected(codes))
    if not alone:
        return records
    only = wanted._replace(locations=(codes[0] or "--",), channels=(codes[1],))
    more = asked_records(alone, url, only, station)
    # Records of another time are those of a gap: the channel has none of the window
    if not more.content and codes not in {tuple(row.name.split(".")[2:]) for row in more.left_out}:
        raise _other(more, url, only)
    left_out = dict.fromkeys((*records.left_out, *more.left_out))
    return Records(records.content + more.content, records.channels | more.channels, (*left_out,))


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
    # Real-time servers confuse channels and times as archives do
    url = f"seedlink://{server}"
    records = asked_records(content, url, wanted, path.stem)
    if not records.content:
        raise _other(records, url, wanted)
    _write(path, records.content, wanted, offer, records.left_out)


def asked_records(content: bytes, url: str, wanted: Wanted, station: str) -> Records:
    """
    Return the MiniSEED records of an answer that are of the channels and window of a request.

    Parameters
    ----------
    content : bytes
        Answer of a service.
    url : str
        Its address, for messages.
    wanted : Wanted
        The request.
    station : str
        ``"NET.STA"``; another one in the answer is an error, as nothing in it can be trusted.

    Raises
    ------
    RecordRejected
        If it is no MiniSEED, is cut, or is of another station.
    """
    shown = public_url(url)
    traces = read_bytes_with_obspy(obspy.read, content, shown, format="MSEED")
    if not traces:
        raise RecordRejected(shown, "answers without a record")
    # A cut answer ends within a MiniSEED record
    record_length = min(trace.stats.mseed.record_length for trace in traces)
    if surplus := len(content) % record_length:
        problem = f"the answer is cut: its last MiniSEED record has {surplus} bytes"
        raise RecordRejected(shown, problem)
    _check(shown, station, {station_name(trace) for trace in traces})
    return _divided(content, traces, shown, wanted)


def _divided(content: bytes, traces: Stream, url: str, wanted: Wanted) -> Records:
    """Return the records that were asked for, and one row per channel with others."""
    others, channels = dict[str, Rejection](), set[tuple[str, str]]()
    for trace in traces:
        stats = trace.stats
        codes = (stats.location, stats.channel)
        if problem := other_than_asked(wanted, codes, stats.starttime, stats.endtime):
            reason = f"records {problem}, are left out of the answer: asked for {asked_for(wanted)}"
            others.setdefault(trace.id, Rejection("record", trace.id, url, None, (reason,)))
        else:
            channels.add(codes)
    # Samples are not coded again
    if others:
        content = _without_others(content, wanted)
    return Records(content, frozenset(channels), tuple(others.values()))


def _without_others(content: bytes, wanted: Wanted) -> bytes:
    """Return the MiniSEED records that are of the channels and window of a request."""
    # Records of several lengths may follow each other
    asked, place, file = bytearray(), 0, BytesIO(content)
    while place < len(content):
        record = get_record_information(file, place)
        codes = (record["location"].strip(), record["channel"].strip())
        length = record["record_length"]
        if not other_than_asked(wanted, codes, record["starttime"], record["endtime"]):
            asked += content[place : place + length]
        place += length
    return bytes(asked)


def _other(records: Records, url: str, wanted: Wanted) -> RecordRejected:
    """Return the error of an answer that holds nothing that was asked for."""
    found = "; ".join(
        f"{row.name} {row.reasons[0].partition(', are')[0]}" for row in records.left_out
    )
    return RecordRejected(public_url(url), f"answers with {found}: asked for {asked_for(wanted)}")


def _records(pool: WebPool, url: str, parameters: dict[str, str], offer: Offer) -> bytes:
    """Return the records of a station, channel by channel if all at once are too many."""
    try:
        return _framed(pool, url, parameters)
    except RequestTooLarge:
        pass
    content, empty = b"", None
    for codes in offer.channels:
        try:
            content += _framed(pool, url, parameters | _selected(codes))
        except EmptyAnswer as error:
            empty = error
    if empty and not content:
        raise empty
    return content


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
    _check_metadata(shown, inventory, wanted)
    _write(path, content, wanted, offer)


def _check_metadata(url: str, inventory: Inventory, wanted: Wanted) -> None:
    """Refuse metadata of another place, or without a channel of the request in its window."""
    if not stations_inside(inventory, wanted):
        (station, *_) = (station for network in inventory for station in network)
        place = f"{station.latitude:g}, {station.longitude:g}"
        problem = f"answers with a station at {place}, outside the circle of the request"
        raise RecordRejected(url, problem)
    # Channels that were not asked for may be there as well
    channels = [channel for network in inventory for station in network for channel in station]
    problems = [
        other_than_asked(
            wanted,
            (channel.location_code, channel.code),
            channel.start_date,
            channel.end_date,
        )
        for channel in channels
    ]
    if all(problems):
        found = problems[0] if problems else "without a channel"
        problem = f"answers with metadata {found}: asked for {asked_for(wanted)}"
        raise RecordRejected(url, problem)


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


def _write(
    path: Path,
    content: bytes,
    wanted: Wanted,
    offer: Offer,
    left_out: Sequence[Rejection] = (),
) -> None:
    """Write a file of a station, and then its hash into the status of the station."""
    before = _status(path, wanted)
    outputs = {name: known for name, known in before["outputs"].items() if name != path.name}
    with written_whole(path) as part:
        part.write_bytes(content)
    outputs[path.name] = bytes_hash(content)
    # Metadata come after the records
    rows = [*left_out] if path.suffix == ".mseed" else before.get("left_out", [])
    # The word shard makes the status a description, which a folder of records passes over
    facts = {
        "shard": outputs.get(f"{path.stem}.mseed"),
        "channels": offer.channels,
        "left_out": rows,
    }
    write_status(station_status(path), _key(path, wanted), outputs, facts)


def station_status(path: Path) -> Path:
    """Return the status file of a station, with hashes and channels, by one of its files."""
    return path.with_suffix(".json")


def _is_whole(path: Path, wanted: Wanted) -> bool:
    """Return whether a file is as it was fetched by the same request."""
    known = _status(path, wanted)["outputs"].get(path.name)
    return bool(known) and hash_if_readable(path) == known


def _status(path: Path, wanted: Wanted) -> Status:
    """Return the status of a station, one without outputs if it is missing or of other work."""
    empty: Status = {"outputs": {}}
    try:
        status = read_status(station_status(path))
    except StatusError:
        return empty
    return status if status["key"] == _key(path, wanted) else empty


def _key(path: Path, wanted: Wanted) -> str:
    """Return the hash of the request for a station."""
    return digest(_parameters(wanted, path.stem))
