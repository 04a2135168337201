"""Answers of web services, by a server on loopback that fails on demand."""

from collections.abc import Iterator

import pytest
import urllib3
from fdsn_server import FdsnServer, cut, serving, status

from per_obspy.config import Scenario
from per_obspy.errors import ServiceError
from per_obspy.records.fdsn.web import NotFound, RequestTooLarge, answer, web_pool
from per_obspy.records.simulation.earthquake import simulate

LIST = {"format": "text", "level": "station"}


@pytest.fixture(scope="module")
def server() -> Iterator[FdsnServer]:
    with serving(simulate(Scenario(stations=1, dt=0.02, magnitude=5.0))) as running:
        yield running


@pytest.fixture
def pool() -> urllib3.PoolManager:
    return web_pool(timeout=10.0, retries=1, wait=0.01)


def stations(server: FdsnServer, pool: urllib3.PoolManager, **parameters: str) -> bytes:
    return answer(pool, f"{server.url}/fdsnws/station/1/query", LIST | parameters)


def test_a_whole_answer_comes_back(server: FdsnServer, pool: urllib3.PoolManager):
    assert b"|S001|" in stations(server, pool)


def test_no_data_is_an_empty_answer(server: FdsnServer, pool: urllib3.PoolManager):
    assert stations(server, pool, network="YY") == b""


@pytest.mark.parametrize("fault", [status(503), status(429), cut])
def test_faults_that_pass_are_tried_again(server: FdsnServer, pool: urllib3.PoolManager, fault):
    before = server.asked("station")
    server.fail("station", "*", fault)
    assert b"|S001|" in stations(server, pool)
    assert server.asked("station") == before + 2


@pytest.mark.parametrize(
    ("code", "error", "message"),
    [
        (404, NotFound, r"not found \(HTTP 404\)"),
        (413, RequestTooLarge, r"refuses to answer so much at once \(HTTP 413\)"),
        (414, RequestTooLarge, r"refuses to answer so much at once \(HTTP 414\)"),
        (400, ServiceError, "HTTP 400: the service is unwell"),
    ],
)
def test_faults_that_stay_are_not(server, pool, code: int, error: type, message: str):
    before = server.asked("station")
    server.fail("station", "*", status(code))
    with pytest.raises(error, match=message):
        stations(server, pool)
    assert server.asked("station") == before + 1


def test_a_service_that_does_not_answer_is_named(pool: urllib3.PoolManager):
    with pytest.raises(ServiceError, match=r"http://127\.0\.0\.1:1/query: no answer: "):
        answer(pool, "http://127.0.0.1:1/query", {})
