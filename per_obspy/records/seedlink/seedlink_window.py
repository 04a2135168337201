"""
A time window of one station from a SeedLink server, in version 3 of the protocol.

The client of ObsPy writes faults into a log, waits without a limit of time in all, and takes any
number of bytes; here a server is bounded as every service is (:mod:`per_obspy.records.fdsn.web`).

References
----------
SeedLink 3.1: GFZ Potsdam and ISTI, "SeedLink protocol", in the documentation of SeisComP; the
packets are 8 bytes ``SL`` and a sequence number in six hexadecimal digits, then 512 bytes MiniSEED.
"""

import re
import socket
import time
from collections.abc import Iterable, Iterator
from contextlib import closing

from obspy import UTCDateTime

from per_obspy.errors import ServiceError
from per_obspy.records.fdsn.web import WebPool
from per_obspy.records.seedlink.server_address import ServerAddress

#: Bytes of the header of a packet, and of the MiniSEED in it.
_HEADER, _RECORD = 8, 512

#: Longest line of an answer, bytes.
_LINE = 512

_PACKET = re.compile(rb"SL[0-9A-Fa-f]{6}")

#: Packet of information about the server, which is no record.
_INFORMATION = b"SLINFO"

_END, _REFUSED = b"END", b"ERROR"


def seedlink_window(
    pool: WebPool,
    server: ServerAddress,
    station: str,
    channels: Iterable[tuple[str, str]],
    window: tuple[UTCDateTime, UTCDateTime],
) -> bytes:
    """
    Return the records of a station in a time window as MiniSEED; empty if the server has none.

    Parameters
    ----------
    pool : WebPool
        Its time-out, longest and largest answer count here too; a server is asked once.
    server : ServerAddress
        Of the server.
    station : str
        ``"NET.STA"``.
    channels : iterable of (str, str)
        Location and channel codes.
    window : (UTCDateTime, UTCDateTime)
        Start and end.

    Raises
    ------
    ServiceError
        If there is no connection, the server refuses a command, answers without SeedLink, or is
        beyond a limit.
    """
    shown = f"seedlink://{server}"
    # The connection is closed whatever happens on it
    try:
        timeout = pool.connections.connection_pool_kw["timeout"]
        connection = socket.create_connection(server, timeout=timeout)
        with closing(connection):
            conversation = Conversation(connection, shown, pool)
            if not conversation.selected(station, channels, window):
                return b""
            return b"".join(conversation.records())
    except (OSError, UnicodeError) as error:
        raise ServiceError(f"{shown}: no answer: {error or type(error).__name__}") from error


class Conversation:
    """
    Commands and answers on a connection, within the limits of a pool.

    Parameters
    ----------
    connection : socket
        With a time-out.
    shown : str
        The server, for messages.
    pool : WebPool
        Longest and largest answer.
    """

    def __init__(self, connection: socket.socket, shown: str, pool: WebPool) -> None:
        self.connection, self.shown, self.pool = connection, shown, pool
        self.until = time.monotonic() + pool.longest
        self.waiting = b""

    def selected(
        self,
        station: str,
        channels: Iterable[tuple[str, str]],
        window: tuple[UTCDateTime, UTCDateTime],
    ) -> bool:
        """Ask for a station; return whether the server has it and any of its channels."""
        network, code = station.split(".", 1)
        self._send("HELLO")
        hello, _ = self._line(), self._line()
        if not hello.upper().startswith(b"SEEDLINK"):
            raise ServiceError(f"{self.shown}: not a SeedLink server, it answers {_shown(hello)}")
        if not self._accepts(f"STATION {code} {network}"):
            return False
        # A location of two blanks is written as dashes; D are data records
        accepted = [
            self._accepts(f"SELECT {(location or '--'):-<2}{channel}.D")
            for location, channel in channels
        ]
        times = " ".join(moment.strftime("%Y,%m,%d,%H,%M,%S") for moment in window)
        if not any(accepted) or not self._accepts(f"TIME {times}"):
            return False
        self._send("END")
        return True

    def records(self) -> Iterator[bytes]:
        """Yield the MiniSEED of every packet until the server ends or a limit is reached."""
        total = 0
        while True:
            if self._next_is(_END) or self._next_is(_REFUSED):
                return
            head = self._exactly(_HEADER)
            if not head:
                return
            if not _PACKET.fullmatch(head) and not head.startswith(_INFORMATION):
                raise ServiceError(f"{self.shown}: answers without a SeedLink head, {_shown(head)}")
            # A packet that is cut is no record
            record = self._exactly(_RECORD)
            if len(record) < _RECORD:
                raise ServiceError(f"{self.shown}: hangs up inside a packet")
            total += _RECORD
            if total > self.pool.largest:
                problem = f"sends more than {self.pool.largest} bytes"
                raise ServiceError(f"{self.shown}: {problem}")
            if not head.startswith(_INFORMATION):
                yield record

    def _accepts(self, command: str) -> bool:
        """Send a command and return whether the server accepts it."""
        self._send(command)
        answer = self._line()
        if answer.upper() == b"OK":
            return True
        if answer.upper().startswith(_REFUSED):
            return False
        raise ServiceError(f"{self.shown}: answers {_shown(answer)} instead of OK")

    def _send(self, command: str) -> None:
        """Send a command."""
        self.connection.sendall(f"{command}\r\n".encode("ascii"))

    def _line(self) -> bytes:
        """Return the next line without its end."""
        while b"\n" not in self.waiting:
            if len(self.waiting) > _LINE or not self._more():
                raise ServiceError(f"{self.shown}: answers no line, {_shown(self.waiting)}")
        line, _, self.waiting = self.waiting.partition(b"\n")
        return line.strip()

    def _next_is(self, word: bytes) -> bool:
        """Return whether the next bytes are a word of the end."""
        while len(self.waiting) < len(word) and word.startswith(self.waiting):
            if not self._more():
                break
        return self.waiting.startswith(word)

    def _exactly(self, size: int) -> bytes:
        """Return the next bytes, fewer where the server hangs up."""
        while len(self.waiting) < size and self._more():
            pass
        found, self.waiting = self.waiting[:size], self.waiting[size:]
        return found

    def _more(self) -> bool:
        """Wait for more bytes; return whether there are any."""
        left = self.until - time.monotonic()
        if left <= 0:
            raise ServiceError(f"{self.shown}: no whole answer within {self.pool.longest:g} s")
        piece = self.connection.recv(2**16)
        self.waiting += piece
        return bool(piece)


def _shown(answer: bytes) -> str:
    """Return the beginning of an answer as printable text."""
    return repr(answer[:40].decode("ascii", "replace"))
