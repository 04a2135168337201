"""Download of one station from several services on loopback."""

import copy
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path

import pytest
from fdsn_server import (
    FdsnServer,
    changed,
    content,
    empty,
    moved,
    serving,
    shortened,
    status,
    unframed,
)
from obspy import Stream, UTCDateTime, read
from obspy.core.inventory import Station
from seedlink_server import seedlink

from per_obspy.config import Fdsn, Scenario
from per_obspy.records.fdsn.download import Offer, fetch_station
from per_obspy.records.fdsn.request import Wanted, wanted_around
from per_obspy.records.fdsn.web import WebPool
from per_obspy.records.seedlink import server_address
from per_obspy.resume import read_status
from per_obspy.simulation.earthquake import Simulation, simulate

YEAR = 365 * 86400.0

CHANNELS = (("", "HNN"), ("", "HNE"), ("", "HNZ"))


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    return simulate(Scenario(stations=2, dt=0.02, magnitude=5.0))


@pytest.fixture
def server(simulation: Simulation) -> Iterator[FdsnServer]:
    with serving(simulation) as running:
        yield running


@pytest.fixture
def wanted(simulation: Simulation) -> Wanted:
    given = {"providers": ("http://a.example",), "event_id": "xx1", "event_provider": "USGS"}
    return wanted_around(Fdsn(cache=Path("cache"), **given), simulation.event)


def download(wanted: Wanted, folder: Path, *services: str):
    offers = [Offer(service, CHANNELS) for service in services]
    pool = WebPool(timeout=10.0, retries=0, wait=0.01)
    return fetch_station(pool, wanted, folder, "XX.S001", offers)


@pytest.mark.parametrize(
    ("fault", "reason", "lasting"),
    [
        (status(204), "has no data of the window", True),
        (status(500), "HTTP 500: the service is unwell", False),
        # EIDA and older SeisComP send it where an archive is away (EIDA/userfeedback issue 27)
        (empty, 'an empty answer (HTTP 200), which is not "no data" (HTTP 204)', False),
        (content(b"\n"), 'an empty answer (HTTP 200), which is not "no data" (HTTP 204)', False),
        (content(b"<html>login</html>"), "ObsPy cannot read it", False),
        (status(404), "not found (HTTP 404)", False),
        (changed(moved(-YEAR)), "of another time, ", False),
        (changed(moved(YEAR)), "of another time, ", False),
        (changed(moved(9 * 3600.0)), "of another time, ", False),
        (changed(lambda stream: renamed(stream, "BHZ")), "of another channel, .BHZ", False),
        (shortened, "the answer is cut: its last MiniSEED record has 412 bytes", False),
    ],
)
def test_a_station_without_records_has_a_reason(server, wanted, tmp_path, fault, reason, lasting):
    server.fail("dataselect", "S001", fault)
    outcome = download(wanted, tmp_path, server.url)
    assert reason in outcome.reasons[0]
    assert outcome.lasting == lasting
    assert not list(tmp_path.iterdir())


def renamed(stream: Stream, channel: str) -> Stream:
    for trace in stream:
        trace.stats.channel = channel
    return stream[:1]


def test_the_next_service_is_tried_after_records_of_another_time(server, wanted, tmp_path: Path):
    server.fail("dataselect", "S001", changed(moved(-YEAR)))
    assert download(wanted, tmp_path, server.url, server.url) == ("XX.S001", (), True)
    for trace in read(str(tmp_path / "XX.S001.mseed")):
        assert wanted.start - 60 <= trace.stats.starttime <= wanted.end


def test_stray_records_are_left_out_and_the_rest_is_kept(server, wanted, tmp_path: Path):
    # SeisComP sends one record hours before the window where that begins in a gap (issue 266 of
    # seiscomp3); a service that does not know the parameter "channel" sends all of them
    def with_strays(stream: Stream) -> Stream:
        other, stray = stream[0].copy(), stream.select(channel="HNZ")[0].copy()
        other.stats.channel = "BHN"
        stray.stats.starttime -= 5 * 3600
        stray.data = stray.data[:100]
        return Stream([other, stray, *stream])

    server.fail("dataselect", "S001", changed(with_strays))
    assert download(wanted, tmp_path, server.url) == ("XX.S001", (), True)
    expected = server.stream.select(station="S001").slice(wanted.start, wanted.end)
    records = read(str(tmp_path / "XX.S001.mseed"))
    assert sorted(trace.id for trace in records) == sorted(trace.id for trace in expected)
    for trace in records:
        (sent,) = expected.select(id=trace.id)
        assert (trace.data == sent.data.astype("int32")).all()
    status = read_status(tmp_path / "XX.S001.json")
    left_out = {row[1]: row[4][0] for row in status["left_out"]}
    assert left_out.keys() == {"XX.S001..BHN", "XX.S001..HNZ"}
    assert "of another time" in left_out["XX.S001..HNZ"]
    assert "of another channel" in left_out["XX.S001..BHN"]


def test_a_channel_of_which_only_another_time_comes_costs_no_other(server, wanted, tmp_path):
    server.fail("dataselect", "S001", *[changed(moved(-YEAR, "HNZ"))] * 2)
    assert download(wanted, tmp_path, server.url) == ("XX.S001", (), True)
    assert {trace.stats.channel for trace in read(str(tmp_path / "XX.S001.mseed"))} == {
        "HNE",
        "HNN",
    }


def test_a_channel_that_is_empty_costs_no_other(server, wanted, tmp_path: Path):
    only = changed(lambda stream: stream.select(channel="HN[EN]"))
    server.fail("dataselect", "S001", only, empty)
    assert download(wanted, tmp_path, server.url) == ("XX.S001", (), True)
    assert len(read(str(tmp_path / "XX.S001.mseed"))) == 2


def test_records_that_begin_before_the_window_are_no_other_time(server, wanted, tmp_path: Path):
    # A service cuts at whole records: 512 bytes are some seconds
    server.fail("dataselect", "S001", changed(moved(-20.0)))
    assert download(wanted, tmp_path, server.url) == ("XX.S001", (), True)
    assert read_status(tmp_path / "XX.S001.json")["left_out"] == []


def xml(server: FdsnServer, change: Callable[[Station], object]) -> bytes:
    """Return metadata of the station that a service has confused in some way."""
    inventory = copy.deepcopy(server.inventory.select(station="S001"))
    change(inventory[0][0])
    content = BytesIO()
    inventory.write(content, format="STATIONXML")
    return content.getvalue()


def changed_channels(**values: object) -> Callable[[Station], object]:
    return lambda station: [
        setattr(channel, *value) for channel in station for value in values.items()
    ]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (
            changed_channels(end_date=UTCDateTime(1995, 1, 1)),
            "metadata of another time, 1990-01-01",
        ),
        (
            changed_channels(start_date=UTCDateTime(2010, 1, 1)),
            "metadata of another time, 2010-01-",
        ),
        (changed_channels(code="BHZ"), "metadata of another channel, .BHZ"),
        (lambda station: station.channels.clear(), "metadata without a channel"),
        (lambda station: setattr(station, "longitude", 100.0), ", 100, outside the circle"),
        (
            lambda station: setattr(station, "code", "S002"),
            "answers with XX.S002 instead of XX.S001",
        ),
    ],
)
def test_metadata_other_than_asked_for_are_refused(server, wanted, tmp_path, change, reason):
    server.fail("station", "S001", content(xml(server, change)))
    outcome = download(wanted, tmp_path, server.url)
    assert reason in outcome.reasons[0]
    assert not outcome.lasting
    # asked again, the right answer serves
    assert download(wanted, tmp_path, server.url) == ("XX.S001", (), True)


def test_real_time_records_of_another_time_are_refused(server, wanted, tmp_path: Path):
    stream = moved(-YEAR)(server.stream.select(station="S001").copy())
    server.fail("dataselect", "S001", status(204))
    with seedlink(stream) as live:
        packets = [packet[0] for packet in live.packets]
        live.instead = lambda handler: handler.wfile.write(
            b"".join(b"SL%06X" % number + packet for number, packet in enumerate(packets)) + b"END"
        )
        pool = WebPool(timeout=10.0, retries=0, wait=0.01)
        outcome = fetch_station(
            pool,
            wanted,
            tmp_path,
            "XX.S001",
            [Offer(server.url, CHANNELS)],
            [server_address(live.address)],
        )
    assert "of another time" in outcome.reasons[1]
    assert not outcome.lasting
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("parts", [(0.4, 1.0, 1.0), (0.4, 0.4)])
def test_a_cut_at_a_record_without_a_length_loses_no_channel(server, wanted, tmp_path, parts):
    # the first is cut, then two whole answers agree; or two cut ones do and channels are missing
    server.fail("dataselect", "S001", *map(unframed, parts))
    assert download(wanted, tmp_path, server.url).reasons == ()
    found = read(str(tmp_path / "XX.S001.mseed"))
    sent = server.stream.select(station="S001")
    assert sorted(trace.id for trace in found) == sorted(trace.id for trace in sent)


def test_answers_that_are_cut_at_different_places_wait(server, wanted, tmp_path: Path):
    server.fail("dataselect", "S001", *[unframed(part) for part in (0.4, 0.5, 0.6, 0.7)])
    outcome = download(wanted, tmp_path, server.url)
    assert "cut at different places" in outcome.reasons[0]
    assert not outcome.lasting
    assert not list(tmp_path.iterdir())
