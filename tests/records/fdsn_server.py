"""An FDSN web service on loopback (station, dataselect, event) that answers from memory and fails on demand."""

import copy
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BytesIO, StringIO
from typing import NamedTuple
from urllib.parse import parse_qsl, urlsplit

import numpy as np
from obspy import Inventory, Stream, UTCDateTime
from obspy.core.event import Catalog

from per_obspy.records.simulation.earthquake import Simulation

Fault = Callable[["_Handler", bytes], None]


class Request(NamedTuple):
    """One request as it arrived."""

    service: str
    parameters: dict[str, str]

    @property
    def subject(self) -> str:
        """What it asked for: a station's name, or what the service lists."""
        return self.parameters.get("station", "*")


class FdsnServer(ThreadingHTTPServer):
    """Serves a simulation; ``faults`` are used up one a matching request."""

    daemon_threads = True

    def __init__(self, simulation: Simulation) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.stream, self.inventory, self.event = (
            simulation.stream,
            _begun(simulation.inventory),
            simulation.event,
        )
        self.requests: list[Request] = []
        self.times: list[float] = []
        self.faults: list[tuple[str, str, Fault]] = []
        self.extra: dict[str, bytes] = {}
        self.lock = threading.Lock()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"

    def fail(self, service: str, subject: str, *faults: Fault) -> None:
        """Let the next requests to a service about a station (``*`` is the list) fail, once each fault."""
        self.faults += [(service, subject, fault) for fault in faults]

    def asked(self, service: str, subject: str | None = None) -> int:
        """Return the number of requests to a service."""
        return sum(
            one.service == service and subject in (None, one.subject) for one in self.requests
        )

    def handle_error(self, request: object, client_address: object) -> None:
        """Say nothing of clients that hung up, as the tests make them do; everything else is still an error."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)

    def next_fault(self, request: Request) -> Fault | None:
        with self.lock:
            self.requests.append(request)
            self.times.append(time.monotonic())
            for number, (service, subject, fault) in enumerate(self.faults):
                if (service, subject) == (request.service, request.subject):
                    del self.faults[number]
                    return fault
        return None


@contextmanager
def serving(simulation: Simulation) -> Iterator[FdsnServer]:
    """Give a running server."""
    with FdsnServer(simulation) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: FdsnServer

    def do_GET(self) -> None:
        parts = urlsplit(self.path)
        words = parts.path.strip("/").split("/")
        service = words[1] if words[0] == "fdsnws" else parts.path
        request = Request(service, dict(parse_qsl(parts.query, keep_blank_values=True)))
        fault = self.server.next_fault(request)
        body = self._body(request)
        (fault or whole)(self, body)

    def _body(self, request: Request) -> bytes:
        if request.service in self.server.extra:
            return self.server.extra[request.service]
        return {"station": self._station, "dataselect": self._dataselect, "event": self._event}[
            request.service
        ](request.parameters)

    def _station(self, wanted: dict[str, str]) -> bytes:
        found = Inventory()
        for network, station, location, channel in _combinations(wanted):
            circle = {
                name: float(wanted[name])
                for name in ("latitude", "longitude", "maxradius")
                if name in wanted
            }
            found += self.server.inventory.select(network, station, location, channel, **circle)
        if not found.get_contents()["channels"]:
            return b""
        if wanted.get("format") == "text":
            text = StringIO()
            found.write(text, format="STATIONTXT", level=wanted["level"])
            return text.getvalue().encode()
        xml = BytesIO()
        found.write(xml, format="STATIONXML")
        return xml.getvalue()

    def _dataselect(self, wanted: dict[str, str]) -> bytes:
        found = Stream()
        for network, station, location, channel in _combinations(wanted):
            found += self.server.stream.select(network, station, location, channel)
        found = found.slice(UTCDateTime(wanted["starttime"]), UTCDateTime(wanted["endtime"])).copy()
        return mseed(found)

    def _event(self, wanted: dict[str, str]) -> bytes:
        event = self.server.event
        if wanted.get("format") == "text":
            origin, magnitude = event.origins[0], event.magnitudes[0]
            return (
                "#EventID|Time|Latitude|Longitude|Depth/km|Author|Catalog|Contributor|ContributorID|MagType|Magnitude|"
                "MagAuthor|EventLocationName\n"
                f"xx1|{origin.time}|{origin.latitude}|{origin.longitude}|{origin.depth / 1000}|A|B|C|xx1|Mw|"
                f"{magnitude.mag}|A|Nowhere\n"
            ).encode()
        if wanted["eventid"] != "xx1":
            return b""
        content = BytesIO()
        Catalog([event]).write(content, format="QUAKEML")
        return content.getvalue()

    def reply(
        self,
        code: int,
        body: bytes,
        length: int | None = None,
        headers: dict[str, str] | None = None,
    ) -> None:
        self.send_response(code)
        self.send_header("Content-Length", str(len(body) if length is None else length))
        for name, value in (headers or {}).items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *arguments: object) -> None:
        """Stay quiet."""


def _begun(inventory: Inventory) -> Inventory:
    """Return the metadata with the start dates that the text format demands."""
    result = copy.deepcopy(inventory)
    for station in result[0]:
        for epoch in (result[0], station, *station):
            epoch.start_date = UTCDateTime(1990, 1, 1)
    return result


def _combinations(wanted: dict[str, str]) -> list[tuple[str, str, str, str]]:
    lists = [
        wanted.get(name, "*").split(",") for name in ("network", "station", "location", "channel")
    ]
    return [
        (n, s, "" if x == "--" else x, c)
        for n in lists[0]
        for s in lists[1]
        for x in lists[2]
        for c in lists[3]
    ]


def mseed(stream: Stream) -> bytes:
    """Return MiniSEED as a service sends it."""
    if not stream:
        return b""
    for trace in stream:
        trace.data = np.asarray(trace.data).astype(np.int32)
    content = BytesIO()
    stream.write(content, format="MSEED", encoding="STEIM2", reclen=512)
    return content.getvalue()


def whole(handler: _Handler, body: bytes) -> None:
    """Answer as it should be: 200, or 204 if there is nothing."""
    handler.reply(200 if body else 204, body)


def status(code: int, **headers: str) -> Fault:
    """Answer with a status and a page of text; ``_`` in the name of a header stands for ``-``."""
    sent = {name.replace("_", "-"): value for name, value in headers.items()}
    said = b"" if code == 204 else b"the service\nis unwell"
    return lambda handler, _: handler.reply(code, said, headers=sent)


def late(seconds: float) -> Fault:
    """Answer after a while."""

    def answer(handler: _Handler, body: bytes) -> None:
        time.sleep(seconds)
        whole(handler, body)

    return answer


def dripping(seconds: float, parts: int) -> Fault:
    """Send the body in parts with a pause after each."""

    def answer(handler: _Handler, body: bytes) -> None:
        step = -(-len(body) // parts)
        handler.reply(200, body[:step], length=len(body))
        for start in range(step, len(body), step):
            time.sleep(seconds)
            handler.wfile.write(body[start : start + step])

    return answer


def stalled(seconds: float) -> Fault:
    """Send half of the body and then nothing for a while."""

    def answer(handler: _Handler, body: bytes) -> None:
        handler.reply(200, body[: len(body) // 2], length=len(body))
        handler.wfile.flush()
        time.sleep(seconds)
        handler.close_connection = True

    return answer


def cut(handler: _Handler, body: bytes) -> None:
    """Promise the whole body, send half of it and hang up."""
    handler.reply(200, body[: len(body) // 2], length=len(body))
    handler.close_connection = True


def shortened(handler: _Handler, body: bytes) -> None:
    """Send a body that the service itself has cut, with the length of what is left."""
    handler.reply(200, body[:-100])


def content(wrong: bytes) -> Fault:
    """Answer 200 with something else."""
    return lambda handler, _: handler.reply(200, wrong)
