"""Answers of web services, by a server on loopback that fails on demand."""

import gzip
from collections.abc import Iterator
from datetime import UTC, datetime
from email.utils import format_datetime

import pytest
from fdsn_server import FdsnServer, content, cut, endless, serving, status

from per_obspy.config import Scenario
from per_obspy.errors import ServiceError
from per_obspy.records.fdsn.web import NotFound, RequestTooLarge, WebPool, answer
from per_obspy.simulation.earthquake import simulate

LIST = {"format": "text", "level": "station"}


@pytest.fixture(scope="module")
def server() -> Iterator[FdsnServer]:
    with serving(simulate(Scenario(stations=1, dt=0.02, magnitude=5.0))) as running:
        yield running


@pytest.fixture
def pool() -> WebPool:
    return WebPool(timeout=10.0, retries=1, wait=0.01)


def stations(server: FdsnServer, pool: WebPool, **parameters: str) -> bytes:
    return answer(pool, f"{server.url}/fdsnws/station/1/query", LIST | parameters)


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


def test_a_service_that_does_not_answer_is_named(pool: WebPool):
    with pytest.raises(ServiceError, match=r"http://127\.0\.0\.1:1/query: no answer: "):
        answer(pool, "http://127.0.0.1:1/query", {})


@pytest.mark.parametrize(
    "fault", [endless(b"x", 0.05), endless(b"x" * 10, 0.05, Content_Length="1000000")]
)
def test_a_drip_ends_at_the_limit_of_time(server: FdsnServer, fault):
    server.fail("station", "*", fault)
    # a byte comes long before the time-out, the last one never
    pool = WebPool(timeout=10.0, retries=3, wait=0.01, longest=0.5)
    before = server.asked("station")
    with pytest.raises(ServiceError, match=r"no whole answer within 0\.5 s"):
        stations(server, pool)
    assert server.asked("station") == before + 1


def test_an_endless_answer_ends_at_the_limit_of_size(server: FdsnServer):
    server.fail("station", "*", endless(b"x" * 2**16, 0.0))
    pool = WebPool(timeout=10.0, retries=0, wait=0.01, largest=2**20)
    with pytest.raises(ServiceError, match="larger than 1048576 bytes"):
        stations(server, pool)


def test_a_packed_bomb_ends_at_the_limit_of_size(server: FdsnServer):
    bomb = gzip.compress(bytes(2**26))
    headers = {"Content-Encoding": "gzip"}
    server.fail("station", "*", lambda handler, _: handler.reply(200, bomb, headers=headers))
    pool = WebPool(timeout=10.0, retries=0, wait=0.01, largest=2**20)
    with pytest.raises(ServiceError, match="larger than 1048576 bytes"):
        stations(server, pool)


def test_a_packed_answer_is_unpacked(server: FdsnServer, pool: WebPool):
    headers = {"Content-Encoding": "gzip"}
    packed = gzip.compress(b"words" * 100_000)
    server.fail("station", "*", lambda handler, _: handler.reply(200, packed, headers=headers))
    assert stations(server, pool) == b"words" * 100_000


PAST = format_datetime(datetime(2020, 1, 1, tzinfo=UTC), usegmt=True)


@pytest.mark.parametrize("pause", ["soon", "", "-1", "1e9", "nan", "0", PAST, "9" * 400])
def test_a_strange_retry_after_still_retries(server: FdsnServer, pool: WebPool, pause: str):
    before = server.asked("station")
    server.fail("station", "*", status(503, Retry_After=pause))
    assert b"|S001|" in stations(server, pool)
    assert server.asked("station") == before + 2


def moved(place: str):
    return status(302, Location=place)


def test_redirections_work_without_retries(server: FdsnServer):
    pool = WebPool(timeout=10.0, retries=0, wait=0.01)
    server.extra["/moved"] = b"words"
    server.fail("station", "*", moved("/moved"))
    assert stations(server, pool) == b"words"


@pytest.mark.parametrize("place", ["https://127.0.0.1/", "file:///etc/passwd", "ftp://127.0.0.1/a"])
def test_redirections_keep_their_scheme(server: FdsnServer, pool: WebPool, place: str):
    server.fail("station", "*", moved(place))
    with pytest.raises(ServiceError, match="redirects to another scheme"):
        stations(server, pool)


def test_redirections_are_counted(server: FdsnServer, pool: WebPool):
    server.extra["/round"] = b"never sent"
    server.fail("/round", "*", *[moved("/round")] * 10)
    server.fail("station", "*", moved("/round"))
    with pytest.raises(ServiceError, match="redirects more than 5 times"):
        stations(server, pool)
    server.faults.clear()


@pytest.mark.parametrize(
    "fault", [status(500), status(400), cut, status(404), moved("ftp://u:secret@a/")]
)
def test_passwords_and_queries_are_in_no_error(server: FdsnServer, fault):
    pool = WebPool(timeout=10.0, retries=0, wait=0.01)
    server.fail("station", "*", fault)
    address = server.url.replace("://", "://user:secret@")
    with pytest.raises(ServiceError) as caught:
        answer(pool, f"{address}/fdsnws/station/1/query?token=secret", LIST)
    shown, known = "", caught.value
    # with all its causes, as a log would have it
    while known is not None:
        shown, known = f"{shown}\n{known!r}", known.__cause__
    assert "secret" not in shown


def test_a_password_goes_to_the_host_that_it_is_for(server: FdsnServer, pool: WebPool):
    sent = []

    def asked(handler, body):
        sent.append(handler.headers.get("Authorization"))
        content(b"words")(handler, body)

    server.fail("station", "*", asked, asked)
    address = server.url.replace("://", "://user:se%40cret@")
    for url in (address, server.url):
        answer(pool, f"{url}/fdsnws/station/1/query", LIST)
    # RFC 7617: base64 of user:se@cret
    assert sent == ["Basic dXNlcjpzZUBjcmV0", None]


def test_a_whole_answer_comes_back(server: FdsnServer, pool: WebPool):
    assert b"|S001|" in stations(server, pool)


def test_no_data_is_an_empty_answer(server: FdsnServer, pool: WebPool):
    assert stations(server, pool, network="YY") == b""


@pytest.mark.parametrize("fault", [status(503), status(429), cut])
def test_faults_that_pass_are_tried_again(server: FdsnServer, pool: WebPool, fault):
    before = server.asked("station")
    server.fail("station", "*", fault)
    assert b"|S001|" in stations(server, pool)
    assert server.asked("station") == before + 2
