"""
A SeedLink server on loopback, versions 3 and 4 of the protocol: one conversation per connection.

It answers from memory, and with anything else on demand.
"""

import socketserver
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fnmatch import fnmatchcase
from io import BytesIO

import numpy as np
from obspy import Stream, UTCDateTime, read

#: Version -> greeting.
GREETINGS = {
    3: b"SeedLink v3.1 (2020.075) :: SLPROTO:3.1\r\nA test\r\n",
    4: b"SeedLink v4.0 (test) :: SLPROTO:4.0 SLPROTO:3.1\r\nA test\r\n",
}


class SeedlinkServer(socketserver.ThreadingTCPServer):
    """A server of the records of a stream, in packets of 512 bytes."""

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, stream: Stream) -> None:
        super().__init__(("127.0.0.1", 0), _Conversation)
        self.packets = list(_packets(stream))
        self.said: list[str] = []
        #: what is sent instead of the packets
        self.instead: Callable[[socketserver.StreamRequestHandler], None] | None = None
        #: what is said to every station
        self.answer = b""
        #: how the server greets
        self.greeting = GREETINGS[3]

    @property
    def address(self) -> str:
        return f"127.0.0.1:{self.server_address[1]}"

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignore clients that hung up."""


@contextmanager
def seedlink(stream: Stream) -> Iterator[SeedlinkServer]:
    """Yield a running server."""
    with SeedlinkServer(stream) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


class _Conversation(socketserver.StreamRequestHandler):
    server: SeedlinkServer

    def handle(self) -> None:
        station, patterns, window = ("", ""), list[str](), (UTCDateTime(0), UTCDateTime(2**32))
        self.is_4 = False
        while line := self._command():
            self.server.said.append(line)
            command, *words = line.split()
            if command == "HELLO":
                self.wfile.write(self.server.greeting)
            elif command in ("SLPROTO", "USERAGENT"):
                self.is_4 = True
                self.wfile.write(b"OK\r\n")
            elif command == "STATION":
                station = tuple(words[0].split("_")) if self.is_4 else (words[1], words[0])
                known = any(packet[1][:2] == station for packet in self.server.packets)
                refusal = b"ERROR ARGUMENTS no such station\r\n" if self.is_4 else b"ERROR\r\n"
                self.wfile.write(self.server.answer or (b"OK\r\n" if known else refusal))
            elif command == "SELECT":
                patterns.append(_pattern(words[0].removesuffix(".D")))
                self.wfile.write(b"OK\r\n")
            elif command == "TIME":
                window = tuple(UTCDateTime(*map(int, word.split(","))) for word in words)
                self.wfile.write(b"OK\r\n")
            elif command == "DATA" and words[0] == "ALL":
                window = tuple(map(UTCDateTime, words[1:]))
                self.wfile.write(b"OK\r\n")
            elif command in ("END", "ENDFETCH"):
                self._send(station, patterns, window)
                return
            else:
                self.wfile.write(b"ERROR\r\n")

    def _command(self) -> str:
        """Return the next command, which ends with a carriage return or a new line or both."""
        line = b""
        while letter := self.rfile.read(1):
            if letter in b"\r\n" and line:
                return line.decode()
            line += letter.strip(b"\r\n")
        return ""

    def packet(self, number: int, record: bytes, codes: tuple[str, ...]) -> bytes:
        """Return a packet in the version of the conversation."""
        if not self.is_4:
            return b"SL%06X" % number + record
        name = "_".join(codes[:2]).encode()
        return b"SE2D" + struct.pack("<IQB", len(record), number, len(name)) + name + record

    def _send(self, station: tuple[str, str], patterns: list[str], window: tuple) -> None:
        if self.server.instead is not None:
            self.server.instead(self)
            return
        for number, (record, codes, start, end) in enumerate(self.server.packets):
            place = f"{codes[2]:2}{codes[3]}"
            is_wanted = any(fnmatchcase(place, pattern) for pattern in patterns)
            if codes[:2] == station and is_wanted and start <= window[1] and end >= window[0]:
                self.wfile.write(self.packet(number, record, codes))
        self.wfile.write(b"END")


def _pattern(selector: str) -> str:
    """Return the pattern of location and channel in a selector of either version."""
    if "_" in selector:
        location, *channel = selector.split("_")
        return f"{location:2}{''.join(channel)}"
    return selector.rjust(5, "?").replace("--", "  ")


def _packets(stream: Stream) -> Iterator[tuple[bytes, tuple[str, ...], UTCDateTime, UTCDateTime]]:
    """Yield each MiniSEED record with its codes and times."""
    for trace in stream:
        content, copy = BytesIO(), trace.copy()
        copy.data = np.asarray(copy.data).astype(np.int32)
        copy.write(content, format="MSEED", encoding="STEIM2", reclen=512)
        for start in range(0, len(content.getvalue()), 512):
            record = content.getvalue()[start : start + 512]
            stats = read(BytesIO(record), headonly=True)[0].stats
            codes = (stats.network, stats.station, stats.location, stats.channel)
            yield record, codes, stats.starttime, stats.endtime
