"""
Records of the last hours from SeedLink servers, which archives may not have yet.

The library ``seedlink-client`` speaks versions 3 and 4 of the protocol, and TLS on port 18500. It
bounds neither time nor bytes in all: here a server is bounded as every service is
(:mod:`per_obspy.records.fdsn.web`).
"""

import asyncio
import re
import time
from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from obspy import UTCDateTime

from per_obspy.errors import CatalogError, ServiceError, require_extra, shortened
from per_obspy.records.fdsn.web import WebPool

if TYPE_CHECKING:
    from seedlink_client import AsyncSeedLink

#: Port of SeedLink where an address names none.
PORT = 18_000

_ADDRESS = re.compile(r"(?:seedlink://)?([A-Za-z0-9.-]{1,253})(?::(\d{1,5}))?/?")

#: Formats of packets with records: MiniSEED 2 and 3.
_RECORDS = ("2", "3")

_HUNG_UP = "hangs up before the end of its records"

#: Error of the library where a server of version 3 refuses a station.
_REFUSED = "No stations accepted"


class ServerAddress(NamedTuple):
    """
    Host and port of a server.

    Attributes
    ----------
    host : str
    port : int
    """

    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


def server_address(text: str) -> ServerAddress:
    """
    Return the address in a text such as ``rtserve.example:18000`` or ``seedlink://host``.

    >>> server_address("rtserve.example"), str(server_address("seedlink://10.0.0.1:18001"))
    (ServerAddress(host='rtserve.example', port=18000), '10.0.0.1:18001')

    Raises
    ------
    CatalogError
        If it is none.
    """
    found = _ADDRESS.fullmatch(text)
    port = int(found[2] or PORT) if found else 0
    if found is None or not 0 < port < 2**16:
        problem = "is no address of a SeedLink server: expected host or host:port"
        raise CatalogError(shortened(text), problem)
    return ServerAddress(found[1], port)


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
        Of the server; TLS on port 18500.
    station : str
        ``"NET.STA"``.
    channels : iterable of (str, str)
        Location and channel codes.
    window : (UTCDateTime, UTCDateTime)
        Start and end.

    Raises
    ------
    MissingExtra
        If ``seedlink-client`` is not installed.
    ServiceError
        If there is no connection, the server answers without SeedLink, hangs up before its end, or
        is beyond a limit.
    """
    require_extra("seedlink", "seedlink_client")
    from seedlink_client import AsyncSeedLink, SeedLinkError, SeedLinkTimeout

    client = AsyncSeedLink(
        *server,
        timeout=pool.timeout,
        idle_timeout=pool.timeout,
        dialup=True,
        clientname="per_obspy",
    )
    # A location of two blanks is written as dashes; D are data records
    selectors = [f"{location or '--':-<2}{channel}.D" for location, channel in channels]
    client.add_stream(station.replace(".", "_", 1), selectors)
    client.set_timewindow(*(moment.datetime for moment in window))
    # Each error of the library is one line
    shown = f"seedlink://{server}"
    try:
        return asyncio.run(_collect(client, shown, pool))
    except SeedLinkTimeout as error:
        raise ServiceError(f"{shown}: no answer: {error}") from error
    except TimeoutError as error:
        raise ServiceError(f"{shown}: no whole answer within {pool.longest:g} s") from error
    except (SeedLinkError, ValueError) as error:
        problem = "no answer" if client.protocol is None else "answers without SeedLink"
        reason = shortened(str(error), 200)
        raise ServiceError(f"{shown}: {problem}: {reason}") from error


async def _collect(client: "AsyncSeedLink", shown: str, pool: WebPool) -> bytes:
    """Return the records that a server sends up to its end, within the limits of a pool."""
    from seedlink_client import SeedLinkError

    content, began = bytearray(), time.time_ns()
    try:
        async with asyncio.timeout(pool.longest):
            await client.connect()
            greeting = client.server_id or ""
            if not greeting.upper().startswith("SEEDLINK"):
                problem = f"not a SeedLink server, it answers {shortened(greeting, 40)!r}"
                raise ServiceError(f"{shown}: {problem}")
            if not await _has_station(client):
                return b""
            async for packet in client.collect(reconnect=False):
                if packet.payload_format not in _RECORDS:
                    continue
                # A server that refuses the window goes on with whatever comes
                record = packet.record()  # type: ignore[no-untyped-call]
                if record.starttime > began:
                    raise ServiceError(f"{shown}: sends records of now instead of the window")
                content += packet.payload
                if len(content) > pool.largest:
                    raise ServiceError(f"{shown}: sends more than {pool.largest} bytes")
            # What comes before a server hangs up may be cut; only END leaves the connection open
            if not client.is_connected:
                raise ServiceError(f"{shown}: {_HUNG_UP}")
    except SeedLinkError as error:
        if client.protocol is not None and str(error) == "Connection closed":
            raise ServiceError(f"{shown}: {_HUNG_UP}") from error
        raise
    finally:
        await client.close()
    return bytes(content)


async def _has_station(client: "AsyncSeedLink") -> bool:
    """Ask for the records; return whether the server has the station."""
    from seedlink_client import SeedLinkError

    try:
        await client.negotiate()
    except SeedLinkError as error:
        # Version 4 has a code for it; others mean that the server is busy or closed
        if error.code == "ARGUMENTS" or str(error) == _REFUSED:
            return False
        raise
    return True
