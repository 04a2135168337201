"""Addresses of SeedLink servers, and a window of one station from one on loopback."""

import struct
import time
from collections.abc import Iterator
from io import BytesIO

import numpy as np
import pytest
from obspy import Stream, Trace, UTCDateTime, read
from obspy.clients.seedlink.basic_client import Client
from seedlink_server import GREETINGS, SeedlinkServer, seedlink

from per_obspy.errors import CatalogError, MissingExtra, ServiceError
from per_obspy.records.fdsn.web import WebPool
from per_obspy.records.seedlink import seedlink_window, server_address

START = UTCDateTime(2020, 1, 2, 3, 4, 5)
CODES = (("", "HNN"), ("", "HNE"), ("00", "HNZ"))


def stream() -> Stream:
    random = np.random.default_rng(1)
    traces = Stream()
    for station in ("CLC", "CCC"):
        for location, channel in (*CODES, ("", "LOG")):
            header = {"network": "CI", "station": station, "location": location}
            header |= {"channel": channel, "starttime": START, "delta": 0.01}
            samples = random.integers(-2000, 2000, 6000).astype(np.int32)
            traces += Trace(samples, header)
    return traces


@pytest.fixture(params=GREETINGS)
def server(request: pytest.FixtureRequest) -> Iterator[SeedlinkServer]:
    """Speak each version of the protocol."""
    with seedlink(stream()) as running:
        running.greeting = GREETINGS[request.param]
        yield running


def asked(
    server: SeedlinkServer,
    station: str = "CI.CLC",
    window: tuple[float, float] = (0.0, 59.0),
    **limits: float,
) -> bytes:
    given = {"timeout": 5.0, "retries": 0, "wait": 0.01} | limits
    pool = WebPool(**given)  # type: ignore[arg-type]
    times = (START + window[0], START + window[1])
    return seedlink_window(pool, server_address(server.address), station, CODES, times)


def test_the_records_of_one_station_arrive_whole(server: SeedlinkServer):
    found = read(BytesIO(asked(server))).merge()
    wanted = stream().select(station="CLC", channel="HN?")
    assert sorted(trace.id for trace in found) == sorted(trace.id for trace in wanted)
    for trace in wanted:
        (same,) = found.select(id=trace.id)
        np.testing.assert_array_equal(same.data, trace.data)
    version_3, version_4 = ({"--HNN.D", "00HNZ.D"}, {"_H_N_N.D", "00_H_N_Z.D"})
    selected = {line.split()[1] for line in server.said if line.startswith("SELECT")}
    assert version_3 <= selected or version_4 <= selected


def test_only_records_of_the_window_arrive(server: SeedlinkServer):
    part = read(BytesIO(asked(server, window=(20.0, 25.0)))).merge()
    assert len(part) == len(CODES)
    # records of 512 bytes hold a few seconds each
    assert all(START + 10 < trace.stats.starttime <= START + 20 for trace in part)
    assert all(START + 25 <= trace.stats.endtime < START + 35 for trace in part)


def test_the_client_of_obspy_gets_the_same(server: SeedlinkServer):
    # The server speaks the protocol, if another client understands it
    host, port = server.address.split(":")
    client = Client(host, int(port), timeout=5)
    theirs = client.get_waveforms("CI", "CLC", "", "HNN", START, START + 59)
    ours = read(BytesIO(asked(server))).merge().select(channel="HNN")
    np.testing.assert_array_equal(theirs.merge()[0].data, ours[0].slice(endtime=START + 59).data)


def test_an_unknown_station_has_no_records(server: SeedlinkServer):
    assert asked(server, "CI.NONE") == b""


def test_a_busy_server_is_no_answer_of_no_data(server: SeedlinkServer):
    server.greeting, server.answer = GREETINGS[4], b"ERROR LIMIT too many clients\r\n"
    with pytest.raises(ServiceError, match="too many clients"):
        asked(server)


def test_a_server_that_passes_over_the_window_is_left(server: SeedlinkServer):
    now = stream().select(station="CLC", channel="HNN")
    now[0].stats.starttime = UTCDateTime() + 30
    with seedlink(now) as live:
        packets = live.packets

    def endless(handler):
        while True:
            handler.wfile.write(handler.packet(1, *packets[0][:2]))

    server.instead = endless
    with pytest.raises(ServiceError, match="records of now"):
        asked(server)


def test_a_window_without_records_is_empty(server: SeedlinkServer):
    assert asked(server, window=(3600.0, 3700.0)) == b""


def test_a_server_that_is_not_there():
    with seedlink(Stream()) as server:
        address = server.address
    pool = WebPool(timeout=1.0, retries=0, wait=0.01)
    with pytest.raises(ServiceError, match="no answer"):
        seedlink_window(pool, server_address(address), "CI.CLC", CODES, (START, START + 1))


@pytest.mark.parametrize(
    ("sent", "reason"),
    [
        (b"<html>you are lost</html>", "answers without SeedLink: .*'<h'"),
        (b"SL000001" + b"cut", "hangs up before the end"),
        (b"SLxxxxxx" + bytes(512), "answers without SeedLink"),
        (b"SL000001" + bytes(512), "answers without SeedLink"),
        (b"", "hangs up before the end"),
        (b"ERROR\r\n", "answers without SeedLink"),
        (b"SE2D" + b"\xff" * 600, "answers without SeedLink"),
    ],
)
def test_anything_else_is_refused(server: SeedlinkServer, sent: bytes, reason: str):
    server.instead = lambda handler: handler.wfile.write(sent)
    with pytest.raises(ServiceError, match=reason):
        asked(server)


def test_information_is_passed_over(server: SeedlinkServer):
    content = BytesIO()
    text = np.frombuffer(b'<?xml version="1.0"?><seedlink/>', dtype="|S1")
    Trace(text, {"station": "INFO"}).write(content, format="MSEED", encoding="ASCII", reclen=512)
    old, new = b"SLINFO *" + content.getvalue(), b"SEJI" + struct.pack("<IQB", 2, 0, 0) + b"{}"
    server.instead = lambda handler: handler.wfile.write((new if handler.is_4 else old) + b"END")
    assert asked(server) == b""


@pytest.mark.parametrize("greeting", [b"SSH-2.0\r\n\r\n", b"x" * 4000, b""])
def test_another_kind_of_server_is_refused(server: SeedlinkServer, greeting: bytes):
    server.greeting = greeting
    with pytest.raises(ServiceError, match=r"not a SeedLink server|no answer"):
        asked(server, timeout=0.3)


def test_an_endless_answer_ends_at_the_limit(server: SeedlinkServer):
    def endless(handler):
        while True:
            handler.wfile.write(handler.packet(1, *server.packets[0][:2]))

    server.instead = endless
    with pytest.raises(ServiceError, match="sends more than 100000 bytes"):
        asked(server, largest=100_000)


@pytest.mark.parametrize("part", [8, 30, 600])
def test_a_server_that_drips_ends_at_the_time_limit(server: SeedlinkServer, part: int):
    def dripping(handler):
        packet = handler.packet(1, *server.packets[0][:2])
        handler.wfile.write(packet[:part])
        for letter in packet[part:] + 40 * packet:
            handler.wfile.write(bytes([letter]))
            time.sleep(0.05)

    server.instead = dripping
    began = time.monotonic()
    with pytest.raises(ServiceError, match=r"within 0\.5 s"):
        asked(server, longest=0.5)
    # the limit, and the start of the program's loop of events
    assert time.monotonic() - began < 2.0


def test_a_silent_server_ends_at_the_time_out(server: SeedlinkServer):
    server.instead = lambda _: time.sleep(4.0)
    with pytest.raises(ServiceError, match="no answer"):
        asked(server, timeout=0.2)


def test_a_hang_up_without_the_end_may_have_cut_records(server: SeedlinkServer):
    def hanging_up(handler):
        handler.wfile.write(handler.packet(1, *server.packets[0][:2]))
        # the library asks its clocks each second, and must not take this for the end
        time.sleep(0.99)

    server.instead = hanging_up
    with pytest.raises(ServiceError, match="hangs up before the end"):
        asked(server)


def test_a_missing_library_is_one_line(server: SeedlinkServer, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("per_obspy.errors.find_spec", lambda _: None)
    with pytest.raises(MissingExtra, match=r"seedlink_client not installed: .*per_obspy\[seedlink"):
        asked(server)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("rtserve.example", "rtserve.example:18000"),
        ("seedlink://rtserve.example/", "rtserve.example:18000"),
        ("127.0.0.1:18001", "127.0.0.1:18001"),
    ],
)
def test_an_address(text: str, shown: str):
    assert str(server_address(text)) == shown


@pytest.mark.parametrize(
    "text", ["", "http://host", "host:0", "host:65536", "host:port", "a b", "host/../x", "ho\nst"]
)
def test_anything_else_is_no_address(text: str):
    with pytest.raises(CatalogError, match=r"expected host or host:port"):
        server_address(text)
