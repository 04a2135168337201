"""
An FDSN web service on loopback: station, dataselect and event.

It answers from memory and fails on demand.
"""

import copy
import itertools
import json
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
from obspy import Inventory, Stream, UTCDateTime, read
from obspy.core.event import Catalog, Event, Origin
from obspy.geodetics import locations2degrees

from per_obspy.simulation.earthquake import Simulation

Fault = Callable[["_Handler", bytes], None]


class Request(NamedTuple):
    """One request as it arrived."""

    service: str
    parameters: dict[str, str]

    @property
    def subject(self) -> str:
        """Return the station of the request, or ``*`` for a list."""
        return self.parameters.get("station", "*")


class FdsnServer(ThreadingHTTPServer):
    """A service of a simulation; every fault spoils one matching request."""

    daemon_threads = True

    def __init__(self, simulation: Simulation) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.stream = simulation.stream
        self.inventory = _begun(simulation.inventory)
        self.event = simulation.event
        # Further earthquakes by identifier, those that were deleted, and when each changed
        self.events: dict[str, Event] = {"xx1": simulation.event}
        self.deleted: set[str] = set()
        self.updated: dict[str, UTCDateTime] = {}
        # Stations without records yet, and the time at which all records end for now
        self.silent: set[str] = set()
        self.records_until: UTCDateTime | None = None
        # Requests in the order of arrival, and faults in the order of their use
        self.requests: list[Request] = []
        self.times: list[float] = []
        self.faults: list[tuple[str, str, Fault]] = []
        self.extra: dict[str, bytes] = {}
        # ShakeMaps of every event, as the service of the USGS lists them
        self.maps: list[dict[str, object]] = []
        self.lock = threading.Lock()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"

    def fail(self, service: str, subject: str, *faults: Fault) -> None:
        """Spoil the next requests to a service for a station (``*`` is the list), one per fault."""
        self.faults += [(service, subject, fault) for fault in faults]

    def fdsn_list(self) -> bytes:
        """Return the list of all channels as the service sends it."""
        text = StringIO()
        self.inventory.write(text, format="STATIONTXT", level="channel")
        return text.getvalue().encode()

    def add_map(self, version: str, **files: bytes) -> None:
        """Add a version of the ShakeMap; names of files have ``_`` for their dot."""
        contents = {}
        for name, body in files.items():
            path = f"/archive/product/shakemap/xx1/{len(self.maps)}/{name.replace('_', '.')}"
            self.extra[path] = body
            contents[f"download/{name.replace('_', '.')}"] = {"url": f"{self.url}{path}"}
        product = {"status": "UPDATE", "preferredWeight": 100, "updateTime": len(self.maps)}
        self.maps.append(product | {"properties": {"version": version}, "contents": contents})

    def asked(self, service: str, subject: str | None = None) -> int:
        """Return the number of requests to a service."""
        requests = [request for request in self.requests if request.service == service]
        return sum(subject in (None, request.subject) for request in requests)

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignore clients that hung up, as the tests make them do; all else is still an error."""
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
    """Yield a running server."""
    with FdsnServer(simulation) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        # Also after an error, so that no thread keeps the program
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: FdsnServer

    def do_GET(self) -> None:
        parts = urlsplit(self.path)
        words = parts.path.strip("/").split("/")
        # Another path is a router or a feed
        service = words[1] if words[0] == "fdsnws" else parts.path
        request = Request(service, dict(parse_qsl(parts.query, keep_blank_values=True)))
        fault = self.server.next_fault(request)
        body = self._body(request)
        (fault or whole)(self, body)

    def _body(self, request: Request) -> bytes:
        if request.service in self.server.extra:
            return self.server.extra[request.service]
        services = {"station": self._station, "dataselect": self._dataselect, "event": self._event}
        return services[request.service](request.parameters)

    def _station(self, parameters: dict[str, str]) -> bytes:
        names = ("latitude", "longitude", "maxradius")
        circle = {name: float(parameters[name]) for name in names if name in parameters}
        selected = Inventory()
        for network, station, location, channel in _combinations(parameters):
            selected += self.server.inventory.select(network, station, location, channel, **circle)
        if not selected.get_contents()["channels"]:
            return b""
        # A list is text, metadata are StationXML
        if parameters.get("format") == "text":
            text = StringIO()
            selected.write(text, format="STATIONTXT", level=parameters["level"])
            return text.getvalue().encode()
        xml = BytesIO()
        selected.write(xml, format="STATIONXML")
        return xml.getvalue()

    def _dataselect(self, parameters: dict[str, str]) -> bytes:
        selected = Stream()
        for network, station, location, channel in _combinations(parameters):
            selected += self.server.stream.select(network, station, location, channel)
        for trace in selected.copy():
            if trace.stats.station in self.server.silent:
                selected.remove(next(t for t in selected if t.id == trace.id))
        start, end = UTCDateTime(parameters["starttime"]), UTCDateTime(parameters["endtime"])
        end = min(end, self.server.records_until or end)
        return mseed(selected.slice(start, end).copy())

    def _event(self, parameters: dict[str, str]) -> bytes:
        events = self.server.events
        events = {name: event for name, event in events.items() if name not in self.server.deleted}
        if "eventid" not in parameters:
            listed = {
                name: event
                for name, event in events.items()
                if _is_listed(event, parameters, self.server.updated.get(name))
            }
            limit = int(parameters.get("limit", len(listed)))
            return event_text(dict(list(listed.items())[:limit])).encode()
        if parameters["eventid"] not in events:
            return b""
        if parameters.get("format") == "geojson":
            return self._products("includesuperseded" in parameters)
        content = BytesIO()
        Catalog([events[parameters["eventid"]]]).write(content, format="QUAKEML")
        return content.getvalue()

    def _products(self, with_superseded: bool) -> bytes:
        maps = self.server.maps if with_superseded else self.server.maps[-1:]
        products = {"shakemap": maps} if maps else {"origin": [{"status": "UPDATE"}]}
        return json.dumps({"type": "Feature", "properties": {"products": products}}).encode()

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


def _is_listed(event: Event, parameters: dict[str, str], updated: UTCDateTime | None) -> bool:
    """Return whether an earthquake is in the answer to a query, by the FDSN specification."""
    origin, magnitudes = event.origins[0], event.magnitudes
    if "minmagnitude" in parameters and not magnitudes:
        return False
    conditions = {
        "starttime": lambda value: origin.time >= UTCDateTime(value),
        "minmagnitude": lambda value: magnitudes[0].mag >= float(value),
        "updatedafter": lambda value: updated is None or updated >= UTCDateTime(value),
        "maxradius": lambda value: _degrees(origin, parameters) <= float(value),
    }
    return all(conditions[name](parameters[name]) for name in conditions.keys() & parameters.keys())


def _degrees(origin: Origin, parameters: dict[str, str]) -> float:
    """Return the distance of an epicentre from the centre of a query."""
    centre = float(parameters["latitude"]), float(parameters["longitude"])
    return float(locations2degrees(origin.latitude, origin.longitude, *centre))


def event_text(events: dict[str, Event]) -> str:
    """Return a list of events, as the text format has it."""
    head = "#EventID|Time|Latitude|Longitude|Depth/km|Author|Catalog|Contributor|ContributorID"
    rows = [f"{head}|MagType|Magnitude|MagAuthor|EventLocationName"]
    for name, event in events.items():
        origin = event.origins[0]
        size = event.magnitudes[0].mag if event.magnitudes else ""
        place = f"{origin.latitude}|{origin.longitude}|{origin.depth / 1000}"
        rows.append(f"{name}|{origin.time}|{place}|A|B|C|{name}|Mw|{size}|A|Nowhere")
    return "\n".join([*rows, ""]) if events else ""


def _begun(inventory: Inventory) -> Inventory:
    """Return the metadata with the start dates that the text format demands."""
    result = copy.deepcopy(inventory)
    for station in result[0]:
        for epoch in (result[0], station, *station):
            epoch.start_date = UTCDateTime(1990, 1, 1)
    return result


def _combinations(parameters: dict[str, str]) -> Iterator[tuple[str, ...]]:
    """Yield every combination of the codes of a request; an empty location is ``--``."""
    lists = []
    for name in ("network", "station", "location", "channel"):
        codes = parameters.get(name, "*").split(",")
        lists.append(["" if code == "--" else code for code in codes])
    return itertools.product(*lists)


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
    """Answer as it should be: 200, or 204 without data."""
    handler.reply(200 if body else 204, body)


def status(code: int, **headers: str) -> Fault:
    """Answer with a status and a page of text; ``_`` in the name of a header becomes ``-``."""
    sent = {name.replace("_", "-"): value for name, value in headers.items()}
    page = b"" if code == 204 else b"the service\nis unwell"
    return lambda handler, _: handler.reply(code, page, headers=sent)


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
    """Send half of the body, then pause."""

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
    """Send a body that the service itself has cut, with the length of the rest."""
    handler.reply(200, body[:-100])


def content(wrong: bytes) -> Fault:
    """Answer 200 with a web page."""
    return lambda handler, _: handler.reply(200, wrong)


def changed(change: Callable[[Stream], Stream]) -> Fault:
    """Send records that a service has confused in some way."""

    def answer(handler: _Handler, body: bytes) -> None:
        whole(handler, mseed(change(read(BytesIO(body)))) if body else body)

    return answer


def moved(seconds: float, channels: str = "*") -> Callable[[Stream], Stream]:
    """Return a change that moves the records of some channels in time, s."""

    def move(stream: Stream) -> Stream:
        for trace in stream.select(channel=channels):
            trace.stats.starttime += seconds
        return stream

    return move


def empty(handler: _Handler, _: bytes) -> None:
    """Answer 200 without content, as a service whose archive is away does."""
    handler.reply(200, b"")


def unframed(part: float) -> Fault:
    """Send part of the records without any length and hang up, as HTTP 1.0 does at the end."""

    def answer(handler: _Handler, body: bytes) -> None:
        handler.send_response(200)
        handler.send_header("Connection", "close")
        handler.end_headers()
        handler.wfile.write(body[: int(part * len(body)) // 512 * 512])
        handler.close_connection = True

    return answer


def endless(piece: bytes, seconds: float, **headers: str) -> Fault:
    """Send a piece again and again with a pause after each, until the client hangs up."""

    def answer(handler: _Handler, _: bytes) -> None:
        handler.send_response(200)
        for name, value in headers.items():
            handler.send_header(name.replace("_", "-"), value)
        handler.send_header("Connection", "close")
        handler.end_headers()
        handler.close_connection = True
        while True:
            handler.wfile.write(piece)
            time.sleep(seconds)

    return answer
