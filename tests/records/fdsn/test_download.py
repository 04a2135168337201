"""Download of one station from several services on loopback."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from fdsn_server import FdsnServer, serving, shortened, status, unframed
from obspy import read, read_inventory

from per_obspy.config import Fdsn, Scenario
from per_obspy.records.fdsn.download import Offer, fetch_station
from per_obspy.records.fdsn.request import Wanted, wanted_around
from per_obspy.records.fdsn.web import web_pool
from per_obspy.records.simulation.earthquake import Simulation, simulate

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
    pool = web_pool(timeout=10.0, retries=0, wait=0.01)
    return fetch_station(pool, wanted, folder, "XX.S001", offers)


def test_records_and_metadata_are_written(server: FdsnServer, wanted: Wanted, tmp_path: Path):
    assert download(wanted, tmp_path, server.url) == ("XX.S001", (), True)
    assert len(read(str(tmp_path / "XX.S001.mseed"))) == 3
    assert read_inventory(str(tmp_path / "XX.S001.xml"))[0][0].code == "S001"


def test_existing_files_are_not_requested_again(server, wanted: Wanted, tmp_path: Path):
    for _ in range(2):
        download(wanted, tmp_path, server.url)
    assert (server.asked("dataselect"), server.asked("station")) == (1, 1)


def test_a_request_that_is_too_large_is_divided_by_channel(server, wanted, tmp_path: Path):
    server.fail("dataselect", "S001", status(413))
    assert download(wanted, tmp_path, server.url).reasons == ()
    assert server.asked("dataselect") == 1 + len(CHANNELS)
    assert len(read(str(tmp_path / "XX.S001.mseed"))) == 3


@pytest.mark.parametrize(
    ("fault", "reason", "lasting"),
    [
        (status(204), "has no data of the window", True),
        (status(500), "HTTP 500: the service is unwell", False),
        (shortened, "the answer is cut: its last MiniSEED record has 412 bytes", False),
    ],
)
def test_a_station_without_records_has_a_reason(server, wanted, tmp_path, fault, reason, lasting):
    server.fail("dataselect", "S001", fault)
    outcome = download(wanted, tmp_path, server.url)
    assert reason in outcome.reasons[0]
    assert outcome.lasting == lasting
    assert not list(tmp_path.iterdir())


def test_the_next_service_is_tried(server: FdsnServer, wanted: Wanted, tmp_path: Path):
    server.fail("dataselect", "S001", status(500))
    assert download(wanted, tmp_path, server.url, server.url) == ("XX.S001", (), True)


def test_another_station_is_refused(server: FdsnServer, wanted: Wanted, tmp_path: Path):
    (tmp_path / "other").mkdir()
    download(wanted, tmp_path / "other", server.url)
    records = (tmp_path / "other" / "XX.S001.mseed").read_bytes()
    server.extra["dataselect"] = records.replace(b"S001", b"S002")
    outcome = download(wanted, tmp_path, server.url)
    assert "answers with XX.S002 instead of XX.S001" in outcome.reasons[0]


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
