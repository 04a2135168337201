"""
Download of one station: records and metadata from the first of several services.

Time, station and channel of every answer are compared with the request.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO
from itertools import product
from pathlib import Path
from typing import NamedTuple

import obspy
from obspy import Inventory, Stream, UTCDateTime
from obspy.io.mseed.util import get_record_information

from per_obspy.errors import RecordRejected, Rejection, ServiceError
from per_obspy.files import bytes_hash, written_whole
from per_obspy.names import inside, public_url
from per_obspy.records.fdsn.providers import Offer
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
    NotFound,
    RequestTooLarge,
    WebPool,
    answer,
    host,
    steady_answer,
)
from per_obspy.records.folder import station_name
from per_obspy.records.obspy_readers import read_bytes_with_obspy
from per_obspy.records.seedlink import ServerAddress, seedlink_window
from per_obspy.resume import Status, StatusError, hash_if_readable, read_status, write_status

#: Suffixes of records and metadata of a station in the cache.
RECORDS, METADATA = ".mseed", ".xml"

#: Records that end this long before their window may be continued at their service, s.
CUT = 5.0


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

    content: bytes = b""
    channels: frozenset[tuple[str, str]] = frozenset()
    left_out: tuple[Rejection, ...] = ()


class NoData(ServiceError):
    """A service answered that it has no data (204)."""


@dataclass(frozen=True)
class StationFiles:
    """
    Files of a station in the cache: records, metadata and a status with the hashes of both.

    Attributes
    ----------
    folder : Path
        Of the cache.
    station : str
        ``"NET.STA"``.
    wanted : Wanted
        The request that they answer.
    """

    folder: Path
    station: str
    wanted: Wanted

    @property
    def parameters(self) -> dict[str, str]:
        """Parameters of a request for the station."""
        network, code = self.station.split(".", 1)
        return {"network": network, "station": code} | channel_parameters(self.wanted)

    def path(self, suffix: str) -> Path:
        """Return the path of a file."""
        return inside(self.folder, f"{self.station}{suffix}")

    def status(self) -> Status:
        """Return the status, one without outputs if it is missing or of another request."""
        with suppress(StatusError):
            status = read_status(station_status(self.path(RECORDS)))
            if status["key"] == digest(self.parameters):
                return status
        return {"outputs": {}}

    def is_whole(self, suffix: str) -> bool:
        """Return whether a file is as it was fetched by the same request."""
        path = self.path(suffix)
        known = self.status()["outputs"].get(path.name)
        return bool(known) and hash_if_readable(path) == known

    def write(
        self, suffix: str, content: bytes, offer: Offer, left_out: Sequence[Rejection] = ()
    ) -> None:
        """Write a file, and then its hash into the status; the same content leaves no trace."""
        path, new, before = self.path(suffix), bytes_hash(content), self.status()
        if before["outputs"].get(path.name) == new == hash_if_readable(path):
            return
        with written_whole(path) as part:
            part.write_bytes(content)
        outputs = before["outputs"] | {path.name: new}
        # The word shard makes the status a description, which a folder of records passes over
        facts = {
            "shard": outputs.get(f"{self.station}{RECORDS}"),
            "channels": offer.channels,
            # Metadata come after the records
            "left_out": [*left_out] if suffix == RECORDS else before.get("left_out", []),
        }
        write_status(station_status(path), digest(self.parameters), outputs, facts)


def station_status(path: Path) -> Path:
    """Return the status file of a station, with hashes and channels, by one of its files."""
    return path.with_suffix(".json")


def ends_early(file: Path, end: UTCDateTime) -> bool:
    """Return whether the shortest channel of a file ends before a window; of no file, it does."""
    ends: dict[str, UTCDateTime] = {}
    try:
        for trace in obspy.read(file, format="MSEED", headonly=True):
            ends[trace.id] = max(ends.get(trace.id, UTCDateTime(0)), trace.stats.endtime)
    except (OSError, ValueError, TypeError):
        return True
    return bool(min(ends.values(), default=UTCDateTime(0)) < end - CUT)


def fetch_station(
    pool: WebPool,
    wanted: Wanted,
    folder: Path,
    station: str,
    offers: list[Offer],
    live: Sequence[ServerAddress] = (),
    cut: bool = False,
) -> Outcome:
    """
    Download a station into a folder as ``NET.STA.mseed`` and ``NET.STA.xml``.

    A file that is as it was fetched is not requested again; ``NET.STA.json`` has the hashes of both
    and the channels that were asked for.

    Parameters
    ----------
    pool : WebPool
        Connections and patience.
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
    cut : bool
        Whether records that end before the window are requested again; they stay where that fails.
    """
    files, reasons, lasting = StationFiles(folder, station, wanted), list[str](), True
    # Minutes after an earthquake archives may lack data that servers of real-time data have
    sources: list[tuple[Offer, ServerAddress | None]] = [(offer, None) for offer in offers]
    sources += [(offer, server) for server, offer in product(live, offers)]
    is_cut = cut and ends_early(files.path(RECORDS), wanted.end)
    # The next source is tried only where one fails
    for offer, server in sources:
        try:
            if is_cut or not files.is_whole(RECORDS):
                records = _records(pool, files, offer, server)
                files.write(RECORDS, records.content, offer, records.left_out)
                is_cut = False
            if not files.is_whole(METADATA):
                files.write(METADATA, _metadata(pool, files, offer), offer)
        except (ServiceError, RecordRejected) as fault:
            reasons.append(str(fault))
            lasting = lasting and isinstance(fault, NoData)
        else:
            return Outcome(station, (), lasting=True)
    return Outcome(station, tuple(dict.fromkeys(reasons)), lasting)


def _records(
    pool: WebPool, files: StationFiles, offer: Offer, server: ServerAddress | None
) -> Records:
    """Return the records of a station, from a SeedLink server or the service of an offer."""
    if server is not None:
        window = (files.wanted.start, files.wanted.end)
        content = seedlink_window(pool, server, files.station, offer.channels, window)
        # Real-time servers confuse channels and times as archives do
        return _all_asked(content, f"seedlink://{server}", files, str(server))
    url = f"{offer.base}/fdsnws/dataselect/1/query"
    records, fault = Records(), ServiceError()
    try:
        content = steady_answer(pool, url, files.parameters)
        records = _all_asked(content, url, files, host(url))
    except NotFound as error:
        # As of networks that send their records in real time only
        problem = f"{error}: it lists stations, but their records are perhaps on SeedLink only"
        raise NotFound(f"{problem} (records.fdsn.seedlink)") from error
    except RequestTooLarge:
        pass
    # A cut at a MiniSEED record loses whole channels: those that are missing are asked for alone
    for codes in offer.channels:
        if codes not in records.channels:
            try:
                records = _with_channel(pool, url, files, records, codes)
            except EmptyAnswer as error:
                fault = error
    if not records.content:
        raise fault if fault.args else NoData(f"{host(url)} has no data of the window")
    return records


def _all_asked(content: bytes, url: str, files: StationFiles, source: str) -> Records:
    """Return the records of an answer; raise an error if nothing in it was asked for."""
    if not content:
        raise NoData(f"{source} has no data of the window")
    records = asked_records(content, url, files.wanted, files.station)
    if not records.content:
        raise _other(records, url, files.wanted)
    return records


def _with_channel(
    pool: WebPool, url: str, files: StationFiles, records: Records, codes: tuple[str, str]
) -> Records:
    """Return the records of a station with those of one more channel, if its service has any."""
    location, channel = codes[0] or "--", codes[1]
    selected = {"location": location, "channel": channel}
    alone = steady_answer(pool, url, files.parameters | selected)
    if not alone:
        return records
    only = files.wanted._replace(locations=(location,), channels=(channel,))
    more = asked_records(alone, url, only, files.station)
    # Records of another time are those of a gap: the channel has none of the window
    if not more.content and codes not in {tuple(row.name.split(".")[2:]) for row in more.left_out}:
        raise _other(more, url, only)
    left_out = dict.fromkeys((*records.left_out, *more.left_out))
    return Records(records.content + more.content, records.channels | more.channels, (*left_out,))


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
    _require_station(shown, station, {station_name(trace) for trace in traces})
    return _divided(content, traces, shown, wanted)


def _divided(content: bytes, traces: Stream, url: str, wanted: Wanted) -> Records:
    """Return the records that were asked for, and one row per channel with others."""
    others, channels = dict[str, Rejection](), set[tuple[str, str]]()
    for trace in traces:
        stats, codes = trace.stats, (trace.stats.location, trace.stats.channel)
        # One row per channel, and no record of another time or channel
        if problem := other_than_asked(wanted, codes, stats.starttime, stats.endtime):
            reason = f"records {problem}, are left out of the answer: asked for {asked_for(wanted)}"
            others.setdefault(trace.id, Rejection("record", trace.id, url, None, (reason,)))
        else:
            channels.add(codes)
    # Samples are not coded again
    content = _without_others(content, wanted) if others else content
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
    others = (f"{row.name} {row.reasons[0].partition(', are')[0]}" for row in records.left_out)
    problem = f"answers with {'; '.join(others)}: asked for {asked_for(wanted)}"
    return RecordRejected(public_url(url), problem)


def _metadata(pool: WebPool, files: StationFiles, offer: Offer) -> bytes:
    """Return the StationXML of a station; refuse that of another one, place, time or channel."""
    url = f"{offer.base}/fdsnws/station/1/query"
    content = answer(pool, url, files.parameters | {"level": "response"})
    if not content:
        raise NoData(f"{host(url)} has no metadata of the window")
    shown = public_url(url)
    inventory: Inventory = read_bytes_with_obspy(
        obspy.read_inventory, content, shown, format="STATIONXML"
    )
    # An answer for another station must not enter the cache under this name
    stations = {f"{network.code}.{station.code}" for network in inventory for station in network}
    _require_station(shown, files.station, stations)
    _require_metadata(shown, inventory, files.wanted)
    return content


def _require_metadata(url: str, inventory: Inventory, wanted: Wanted) -> None:
    """Refuse metadata of another place, or without a channel of the request in its window."""
    stations = [station for network in inventory for station in network]
    if not stations_inside(inventory, wanted):
        place = f"{stations[0].latitude:g}, {stations[0].longitude:g}"
        problem = f"answers with a station at {place}, outside the circle of the request"
        raise RecordRejected(url, problem)
    # Channels that were not asked for may be there as well
    problems = [
        other_than_asked(
            wanted,
            (channel.location_code, channel.code),
            channel.start_date,
            channel.end_date,
        )
        for station in stations
        for channel in station
    ]
    if all(problems):
        others = problems[0] if problems else "without a channel"
        problem = f"answers with metadata {others}: asked for {asked_for(wanted)}"
        raise RecordRejected(url, problem)


def _require_station(url: str, station: str, stations: set[str]) -> None:
    """Refuse an answer that does not hold exactly the station of the request."""
    if stations != {station}:
        others = ", ".join(sorted(stations)) or "no data"
        raise RecordRejected(url, f"answers with {others} instead of {station}")
