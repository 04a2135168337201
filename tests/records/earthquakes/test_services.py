"""Identifiers and lists of earthquakes from files, feeds and services."""

import json
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import pytest
from fdsn_server import FdsnServer, content, serving, status
from obspy import UTCDateTime
from obspy.core.event import Catalog, Event, Origin

from per_obspy.config import Scenario
from per_obspy.errors import CatalogError, ServiceError
from per_obspy.records.earthquakes.earthquake import Earthquake
from per_obspy.records.earthquakes.services import (
    OTHERS,
    RECORDS_OF,
    event_of,
    fetched_event,
    find_events,
    is_event_id,
)
from per_obspy.records.fdsn.providers import ROUTERS, base_url
from per_obspy.records.fdsn.web import WebPool
from per_obspy.simulation.earthquake import Simulation, simulate


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    return simulate(Scenario(stations=1, dt=0.05, magnitude=6.5, latitude=-1.5, depth=12_000.0))


@pytest.fixture
def server(simulation: Simulation) -> Iterator[FdsnServer]:
    with serving(simulation) as running:
        yield running


def feature(**changes: object) -> dict[str, object]:
    """Return an event as the USGS feeds write it."""
    known = {
        "mag": 7.1,
        "place": "18km W of Searles Valley, CA",
        "time": 1562383193040,
        "magType": "mw",
    }
    return {
        "type": "Feature",
        "id": "ci38457511",
        "properties": known | changes,
        "geometry": {"type": "Point", "coordinates": [-117.599, 35.77, 8.0]},
    }


def feed(*features: object) -> bytes:
    return json.dumps({"type": "FeatureCollection", "features": features}).encode()


SEARLES = Earthquake(
    "ci38457511",
    "2019-07-06T03:19:53.040",
    35.77,
    -117.599,
    8000.0,
    7.1,
    "mw",
    "18km W of Searles Valley, CA",
)


def test_a_feed_from_the_web_and_from_a_file(server: FdsnServer, tmp_path: Path):
    server.extra["/all_day.geojson"] = feed(feature())
    assert find_events(f"{server.url}/all_day.geojson", {}) == [SEARLES]
    (tmp_path / "feed.json").write_bytes(feed(feature()))
    assert find_events(str(tmp_path / "feed.json"), {}) == [SEARLES]


def test_the_latest_comes_first_and_gaps_stay_gaps(tmp_path: Path):
    # magnitude, place and depth may be unknown
    later = feature(time=1562383193041, mag=None, place=None, magType=None)
    later["geometry"] = {"coordinates": [1, 2, None]}
    (tmp_path / "feed.json").write_bytes(feed(feature(), later))
    rows = find_events(str(tmp_path / "feed.json"), {})
    assert rows[1] == SEARLES
    assert rows[0][2:] == (2.0, 1.0, None, None, "", "")


def test_a_service_is_asked_what_was_asked(server: FdsnServer, simulation: Simulation):
    (row,) = find_events(server.url, {"minmagnitude": "6"})
    origin = simulation.event.origins[0]
    assert row[:1] + row[2:] == (
        "xx1",
        origin.latitude,
        origin.longitude,
        origin.depth,
        6.5,
        "Mw",
        "Nowhere",
    )
    assert UTCDateTime(row.time) == origin.time
    assert server.requests[0].parameters == {"minmagnitude": "6", "format": "text"}


def test_no_event_is_an_empty_list(server: FdsnServer):
    server.fail("event", "*", status(204))
    assert find_events(server.url, {}) == []


@pytest.mark.parametrize("wrong", [b"{", b"{}", feed({"id": 1}), b"<html>", b"", b"\xff\xfe"])
def test_files_that_are_no_list_are_wrong_input(tmp_path: Path, wrong: bytes):
    (tmp_path / "file").write_bytes(wrong)
    with pytest.raises(CatalogError, match="file: is no list of events"):
        find_events(str(tmp_path / "file"), {})


@pytest.mark.parametrize(
    "wrong", [b"<html>", b"EventID\nxx", b"\xff\xfe", b"#EventID|Time\nxx|yesterday"]
)
def test_answers_that_are_no_list_are_the_services_fault(server: FdsnServer, wrong: bytes):
    server.fail("event", "*", content(wrong))
    with pytest.raises(ServiceError, match="data other than a list of events"):
        find_events(server.url, {})


HEAD = "#EventID|Time|Latitude|Longitude|Depth/km|Author|Catalog|Contributor|ContributorID|MagType"
GOOD = "good|2019-07-06T03:19:53.04|35.77|-117.599|8.0|ci|ci|ci|x|mw|7.1|ci|Ridgecrest"


@pytest.mark.parametrize(
    "bad",
    [
        "bad|2019-07-06T03:19:53|nan|-117.6|8.0|ci|ci|ci|x|mw|7.1|ci|X",
        "bad|2019-07-06T03:19:53|35.7|-1176|8.0|ci|ci|ci|x|mw|7.1|ci|X",
        "bad|x|35.7|-117.6|8.0|ci|ci|ci|x|mw|7.1|ci|X",
        "bad|2019-07-06T03:19:53|35.7|-117.6|8.0|ci|ci|ci|x|mw|inf|ci|X",
        "bad|2019-07-06T03:19:53|35.7",
        "bad|2019-07-06T03:19:53|\ufffd5.7|-117.6|8.0|ci|ci|ci|x|mw|7.1|ci|X",
    ],
)
def test_one_wrong_line_of_a_list_costs_no_other(server: FdsnServer, caplog, bad: str):
    lines = [f"{HEAD}|Magnitude|MagAuthor|EventLocationName", bad, GOOD]
    server.fail("event", "*", content("\n".join(lines).encode().replace(b"\xef\xbf\xbd", b"\xff")))
    assert [row.event_id for row in find_events(server.url, {})] == ["good"]
    assert "left out: bad|" in caplog.text


def test_a_line_end_of_unicode_in_a_place_divides_no_line(server: FdsnServer):
    lines = [f"{HEAD}|Magnitude|MagAuthor|EventLocationName", GOOD.replace("crest", "\x85\u2028")]
    server.fail("event", "*", content("\r\n".join(lines).encode()))
    assert [row.magnitude for row in find_events(server.url, {})] == [7.1]


@pytest.mark.parametrize(
    "wrong",
    [
        feature(time=None) | {"id": "bad"},
        feature() | {"id": "bad", "geometry": None},
        feature() | {"id": "bad", "geometry": {"coordinates": [None, 35.0]}},
        feature(mag=71.0) | {"id": "bad"},
        {"id": "bad"},
        17,
    ],
)
def test_one_wrong_feature_of_a_feed_costs_no_other(tmp_path: Path, wrong):
    (tmp_path / "feed.json").write_bytes(feed(wrong, feature()))
    assert [row.event_id for row in find_events(str(tmp_path / "feed.json"), {})] == ["ci38457511"]


def test_one_earthquake_without_longitude_costs_no_other(simulation, tmp_path: Path):
    placeless = Event(origins=[Origin(time=UTCDateTime(2000, 1, 1), latitude=1.0)])
    file = str(tmp_path / "events.xml")
    Catalog([placeless, simulation.event]).write(file, format="QUAKEML")
    assert [row.magnitude for row in find_events(file, {})] == [6.5]


def test_earthquakes_of_another_time_than_asked_for_are_left_out(server: FdsnServer, caplog):
    lines = [
        f"{HEAD}|Magnitude|MagAuthor|EventLocationName",
        GOOD,
        GOOD.replace("good|2019", "x|2018"),
    ]
    server.fail("event", "*", content("\n".join(lines).encode()))
    query = {"starttime": "2019-07-01", "endtime": "2019-08-01"}
    assert [row.event_id for row in find_events(server.url, query)] == ["good"]
    assert "1 earthquakes of another time left out" in caplog.text


def test_unknown_sources_are_wrong_input():
    with pytest.raises(CatalogError, match="absent: is neither a base URL"):
        find_events("absent", {})


def write_two(folder: Path) -> Path:
    """Write a feed of an earthquake of 7.1 and of one of unknown magnitude a day later."""
    later = feature(time=1562383193040 + 86_400_000, mag=None) | {"id": "later"}
    later["geometry"] = {"coordinates": [-116.599, 35.77, 8.0]}
    (folder / "feed.json").write_bytes(feed(feature(), later))
    return folder / "feed.json"


@pytest.mark.parametrize(
    ("query", "expected"),
    [
        ({}, ["later", "ci38457511"]),
        ({"starttime": "2019-07-06T12:00"}, ["later"]),
        ({"endtime": "2019-07-06T12:00"}, ["ci38457511"]),
        # limits count as inside
        (
            {"starttime": "2019-07-06T03:19:53.040", "endtime": "2019-07-06T03:19:53.040"},
            ["ci38457511"],
        ),
        ({"minmagnitude": "7.1"}, ["ci38457511"]),
        ({"minmagnitude": "7.2"}, []),
        # one degree of longitude at 35.77 degrees north is 0.81 degrees of arc
        ({"latitude": "35.77", "longitude": "-117.599", "maxradius": "0.8"}, ["ci38457511"]),
        (
            {"latitude": "35.77", "longitude": "-117.599", "maxradius": "0.82"},
            ["later", "ci38457511"],
        ),
    ],
)
def test_files_and_feeds_are_filtered_like_a_service(
    server: FdsnServer, tmp_path: Path, query: dict[str, str], expected: list[str]
):
    path = write_two(tmp_path)
    server.extra["/all_day.geojson"] = path.read_bytes()
    for source in (str(path), f"{server.url}/all_day.geojson"):
        assert [row.event_id for row in find_events(source, query)] == expected


@pytest.mark.parametrize(
    ("query", "message"),
    [
        ({"starttime": "yesterday"}, "starttime: 'yesterday' is no time"),
        ({"latitude": "35.77", "maxradius": "1"}, "radius: give all three or none"),
        ({"eventtype": "earthquake"}, "eventtype: only a service can select by it"),
    ],
)
def test_filters_that_cannot_be_applied_are_refused(
    tmp_path: Path, query: dict[str, str], message: str
):
    with pytest.raises(CatalogError, match=message):
        find_events(str(write_two(tmp_path)), query)


@pytest.mark.parametrize("wanted", ["../../xx", "a/b", "a b", "é", "x" * 300])
def test_events_have_files_of_their_own_in_the_cache(
    server: FdsnServer, simulation: Simulation, tmp_path: Path, wanted: str
):
    xml = BytesIO()
    Catalog([simulation.event]).write(xml, format="QUAKEML")
    server.fail("event", "*", *[content(xml.getvalue())] * 2)
    cache, pool = tmp_path / "cache", WebPool(10.0, 0, 0.01)
    first = fetched_event(pool, server.url, wanted, cache)
    # an identifier that differs in a letter that no file has is another event
    second = fetched_event(pool, server.url, wanted + "+", cache)
    assert sorted(cache.glob("*.xml")) == sorted([first, second])


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


def test_quakeml(simulation: Simulation, tmp_path: Path):
    Catalog([simulation.event]).write(str(tmp_path / "event.xml"), format="QUAKEML")
    (row,) = find_events(str(tmp_path / "event.xml"), {})
    assert (row.latitude, row.depth, row.magnitude) == (-1.5, 12_000.0, 6.5)


@pytest.mark.parametrize(
    ("origins", "reason"),
    [
        ([], "has no origin"),
        ([Origin(latitude=1.0, longitude=2.0)], "an origin without time"),
    ],
)
def test_an_event_without_origin_or_time_is_refused(tmp_path: Path, origins, reason: str):
    Catalog([Event(origins=origins)]).write(str(tmp_path / "event.xml"), format="QUAKEML")
    with pytest.raises(CatalogError, match=reason):
        find_events(str(tmp_path / "event.xml"), {})
