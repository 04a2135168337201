"""Names, base URLs and routers of FDSN services."""

import pytest
import urllib3
from obspy.clients.fdsn.header import URL_MAPPINGS

from per_obspy.errors import CatalogError, ServiceError
from per_obspy.records.fdsn import providers
from per_obspy.records.fdsn.providers import ROUTERS, base_url, base_urls

ANSWER = b"""
https://one.example/fdsnws/station/1/query
XX S001 * *
http://two.example:8080/fdsnws/station/1/query
"""


@pytest.fixture
def pool() -> urllib3.PoolManager:
    return urllib3.PoolManager()


def test_names_are_those_of_obspy(pool: urllib3.PoolManager):
    assert base_url("iris") == base_url("IRIS") == URL_MAPPINGS["IRIS"]
    urls, rejected = base_urls(pool, ["GEONET", "http://a.example/", "geonet"], {})
    assert (urls, rejected) == ([URL_MAPPINGS["GEONET"], "http://a.example"], [])


def test_unknown_names_are_refused():
    with pytest.raises(CatalogError, match="nobody: is neither a base URL, nor a router"):
        base_url("nobody")


@pytest.mark.parametrize("router", ROUTERS)
def test_a_router_gives_the_base_urls_of_its_answer(monkeypatch, pool, router: str):
    requests = []

    def answered(_pool: object, url: str, parameters: dict[str, str]) -> bytes:
        requests.append((url, parameters))
        return ANSWER

    monkeypatch.setattr(providers, "answer", answered)
    selection = {"network": "XX", "nonsense": "1"}
    urls, rejected = base_urls(pool, [router, "http://two.example:8080"], selection)
    assert (urls, rejected) == (["https://one.example", "http://two.example:8080"], [])
    # The router gets its fixed parameters, and no others than those it understands
    url, fixed, _ = ROUTERS[router]
    assert requests == [(url, fixed | {"network": "XX"})]


def test_a_router_that_does_not_answer_is_a_rejection(monkeypatch, pool):
    def answered(*_: object) -> bytes:
        raise ServiceError("no answer")

    monkeypatch.setattr(providers, "answer", answered)
    urls, (rejection,) = base_urls(pool, ["eida-routing", "http://a.example"], {})
    assert urls == ["http://a.example"]
    assert (rejection.name, rejection.reasons) == ("eida-routing", ("no answer",))
