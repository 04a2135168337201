"""Identifiers of earthquakes and their services."""

from pathlib import Path

import pytest

from per_obspy.errors import CatalogError
from per_obspy.records.fdsn.event_ids import OTHERS, RECORDS_OF, event_of, is_event_id
from per_obspy.records.fdsn.providers import ROUTERS, base_url

#: identifiers of real earthquakes as their services name them
FORMS = {
    "us7000kufc": ("USGS", "us7000kufc"),
    "ci38457511": ("USGS", "ci38457511"),
    "nc72282711": ("USGS", "nc72282711"),
    "usp000hvnu": ("USGS", "usp000hvnu"),
    "official20110311054624120_30": ("USGS", "official20110311054624120_30"),
    "2016p858000": ("GEONET", "2016p858000"),
    "20230206_0000008": ("EMSC", "20230206_0000008"),
    "usgs:us7000kufc": ("USGS", "us7000kufc"),
    "geonet:2016p858000": ("GEONET", "2016p858000"),
    "EMSC:20230206_0000008": ("EMSC", "20230206_0000008"),
    "Ingv:7073641": ("INGV", "7073641"),
    " us7000kufc ": ("USGS", "us7000kufc"),
}


@pytest.mark.parametrize("identifier", FORMS)
def test_an_identifier_names_its_service(identifier: str):
    assert event_of(identifier) == FORMS[identifier]


@pytest.mark.parametrize(
    "identifier",
    [
        "",
        "7073641",
        "records",
        "mexico1985",
        "US7000KUFC",
        "run.toml",
        "../../x",
        "http://host/x",
        "C:\\x",
        "a" * 99,
    ],
)
def test_an_unknown_form_is_refused_with_the_mend(identifier: str):
    with pytest.raises(CatalogError, match=r"expected us7000abcd, geonet:2016p858000"):
        event_of(identifier)


@pytest.mark.parametrize(
    ("identifier", "reason"),
    [("nowhere:1", "'nowhere' before the colon"), ("usgs:", "''"), ("usgs:a b", "'a b'")],
)
def test_a_wrong_part_is_named(identifier: str, reason: str):
    with pytest.raises(CatalogError, match=reason):
        event_of(identifier)


def test_a_file_is_no_identifier(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    assert is_event_id("us7000kufc")
    Path("us7000kufc").mkdir()
    assert not is_event_id("us7000kufc")


def test_every_provider_of_records_is_known():
    for provider in {*OTHERS, *sum(RECORDS_OF.values(), ())}:
        assert provider in ROUTERS or base_url(provider).startswith("https://")
