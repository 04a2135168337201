"""Addresses of SeedLink servers."""

import re
from typing import NamedTuple

from per_obspy.errors import CatalogError, shortened

#: Port of SeedLink where an address names none.
PORT = 18_000

_ADDRESS = re.compile(r"(?:seedlink://)?([A-Za-z0-9.-]{1,253})(?::(\d{1,5}))?/?")


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
