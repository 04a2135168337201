"""Addresses of SeedLink servers."""

import pytest

from per_obspy.errors import CatalogError
from per_obspy.records.seedlink.server_address import server_address


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
def test_anything_else_is_refused(text: str):
    with pytest.raises(CatalogError, match=r"expected host or host:port"):
        server_address(text)
