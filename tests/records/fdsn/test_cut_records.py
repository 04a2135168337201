"""Records that end early are asked for again; they stay where that fails, to the byte."""

import pytest
from fdsn_server import serving, status
from obspy import UTCDateTime, read

from per_obspy.config import Fdsn, Scenario
from per_obspy.files import file_hash
from per_obspy.records.fdsn.cache import fetch, fetched_stations, has_cut_records
from per_obspy.simulation.earthquake import simulate

ORIGIN = UTCDateTime(2000, 1, 1)


@pytest.fixture(scope="module")
def simulation():
    return simulate(Scenario(stations=1, dt=0.02, magnitude=5.0))


@pytest.fixture
def server(simulation):
    with serving(simulation) as running:
        yield running


@pytest.fixture
def request_(server, tmp_path):
    place = {"latitude": 0.0, "longitude": 0.0}
    window = {"start": str(ORIGIN - 20), "end": str(ORIGIN + 40)}
    url = {"providers": (server.url,), "retries": 0}
    return Fdsn(cache=tmp_path, **url, **place, **window)


def hashes(folder):
    return {path: file_hash(path) for path in folder.rglob("XX.*")}


def test_a_record_that_has_grown_is_fetched_whole(server, request_):
    server.records_until = ORIGIN + 15
    fetched = fetch(request_)
    assert has_cut_records(fetched)
    server.records_until = None
    fetch(request_, again=True, cut=True)
    ((file,),) = fetched_stations(fetched).stations.values()
    assert min(trace.stats.endtime for trace in read(file)) > ORIGIN + 20


def test_a_record_stays_where_its_service_fails(server, request_):
    server.records_until = ORIGIN + 15
    fetch(request_)
    before = hashes(request_.cache)
    server.fail("dataselect", "S001", status(503))
    fetched = fetch(request_, again=True, cut=True)
    assert "HTTP 503" in fetched.rejected[0].reasons[0]
    assert hashes(request_.cache) == before
    assert list(fetched_stations(fetched).stations) == ["XX.S001"]


def test_the_same_record_leaves_no_trace(server, request_):
    server.records_until = ORIGIN + 15
    fetch(request_)
    before = hashes(request_.cache)
    asked = server.asked("dataselect")
    fetch(request_, again=True, cut=True)
    assert server.asked("dataselect") == asked + 1
    assert hashes(request_.cache) == before


def test_whole_records_are_not_asked_for_again(server, request_):
    whole = request_.model_copy(update={"end": str(ORIGIN + 15)})
    fetch(whole)
    asked = server.asked("dataselect")
    fetch(whole, again=True, cut=True)
    assert server.asked("dataselect") == asked
