"""Fetching alone: the cache of a configuration is filled, without any other file."""

import numpy as np
import pytest
from fdsn_server import serving, status
from obspy import read
from seedlink_server import seedlink
from test_shakemap import FIELDS, grid_xml, make_rows

from per_obspy.config import Scenario
from per_obspy.errors import CatalogError
from per_obspy.records.fdsn.cache import fetch, known_shakemap
from per_obspy.records.sources import find_sources
from per_obspy.runs.fetch import fetch_configured, fetch_event
from per_obspy.simulation.earthquake import simulate

CONFIGURATION = """\
name = "x"
output = "out"
[pairs]
file = "pairs.csv"
[records.fdsn]
providers = ["{url}"]
cache = "cache"
event_id = "xx1"
event_provider = "{url}"
wait = 0.01
"""


@pytest.fixture
def server():
    with serving(simulate(Scenario(stations=2, dt=0.02, magnitude=5.0))) as running:
        yield running


@pytest.fixture
def configuration(server, tmp_path):
    (tmp_path / "run.toml").write_text(CONFIGURATION.format(url=server.url))
    return tmp_path / "run.toml"


def test_the_cache_is_filled_once(server, configuration, tmp_path):
    steps = []
    result = fetch_configured(configuration, progress=lambda *step: steps.append(step))
    assert result.stations == ["XX.S001", "XX.S002"]
    assert result.rejected == ()
    assert steps[-1] == ("fetching", 2, 2)
    # neither results nor further requests
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cache", "run.toml"]
    asked = len(server.requests)
    assert fetch_configured(configuration) == result
    assert len(server.requests) == asked


def test_stations_without_data_are_asked_for_again_on_demand(server, configuration):
    server.fail("dataselect", "S002", status(204))
    result = fetch_configured(configuration)
    assert result.stations == ["XX.S001"]
    assert [row.name for row in result.rejected] == ["XX.S002"]
    assert fetch_configured(configuration, again=True).stations == ["XX.S001", "XX.S002"]


def test_a_configuration_without_services_is_refused(tmp_path):
    text = 'name = "x"\noutput = "out"\n[records]\nfolder = "records"\n[pairs]\nfile = "p.csv"\n'
    (tmp_path / "run.toml").write_text(text)
    with pytest.raises(CatalogError, match=r"run\.toml: has no section \[records\.fdsn\]"):
        fetch_configured(tmp_path / "run.toml")


def test_a_named_earthquake_is_fetched_whole_and_once(server, tmp_path):
    settings = {"event_provider": server.url, "providers": [server.url], "wait": 0.01}
    found = fetch_event("xx1", tmp_path / "records", settings)
    assert found.stations == ["XX.S001", "XX.S002"]
    assert (found.event.parent, found.folder.parent) == (tmp_path / "records",) * 2
    # the channels of accelerometers of all networks
    listed = next(request for request in server.requests if request.service == "station")
    assert listed.parameters["channel"] == "HN?,HL?,BN?,BL?,CN?,EN?"
    event = next(request for request in server.requests if request.service == "event")
    assert event.parameters["eventid"] == "xx1"
    # A run with this section needs no network
    asked = len(server.requests)
    server.shutdown()
    sources = find_sources(found.records, fetch(found.records.fdsn, found.records.event))
    assert list(sources.stations) == found.stations
    assert sources.event.path == found.event
    assert len(server.requests) == asked


def test_a_map_outlives_a_service_that_fails_but_not_its_withdrawal(server, tmp_path):
    settings = {"event_provider": server.url, "providers": [server.url], "retries": 0}
    settings |= {"shakemap": True}
    server.add_map("1", grid_xml=grid_xml(FIELDS, make_rows(), (2, 3)).encode())
    assert fetch_event("xx1", tmp_path, settings).shakemap.version == "1"
    server.fail("event", "*", status(503))
    found = fetch_event("xx1", tmp_path, settings, again=True)
    assert (found.shakemap.version, found.stations) == ("1", ["XX.S001", "XX.S002"])
    assert ["HTTP 503" in row.reasons[0] for row in found.rejected] == [True]
    server.maps.clear()
    found = fetch_event("xx1", tmp_path, settings, again=True)
    assert found.shakemap is known_shakemap(found.records.fdsn) is None
    assert [row.reasons[0][:22] for row in found.rejected] == ["no ShakeMap of xx1 yet"]


@pytest.mark.parametrize(
    ("identifier", "host"),
    [
        ("us7000kufc", "earthquake.usgs.gov"),
        ("geonet:2016p858000", "service.geonet.org.nz"),
        ("emsc:20230206_0000008", "www.seismicportal.eu"),
        ("ingv:7073641", "webservices.ingv.it"),
    ],
)
def test_each_service_is_asked_by_its_own_identifier(identifier, host, tmp_path, monkeypatch):
    asked = []

    def answer(_pool, url, parameters):
        asked.append((url, dict(parameters)))
        return b""

    monkeypatch.setattr("per_obspy.records.earthquakes.services.answer", answer)
    with pytest.raises(CatalogError, match="has no event"):
        fetch_event(identifier, tmp_path)
    name = identifier.rpartition(":")[2]
    url = f"https://{host}/fdsnws/event/1/query"
    assert [(url.replace("http://", "https://"), given) for url, given in asked] == [
        (url, {"eventid": name, "format": "xml"})
    ]


def test_a_wrong_setting_is_named(tmp_path):
    with pytest.raises(CatalogError, match=r"us7000kufc: radius"):
        fetch_event("us7000kufc", tmp_path, {"radius": -1.0})


def test_records_that_no_service_has_come_from_a_seedlink_server(server, tmp_path):
    # networks of low-cost stations have no such service
    server.fail("dataselect", "S001", status(404))
    server.fail("dataselect", "S002", status(404))
    live = server.stream.select(station="S001")
    with seedlink(live) as real_time:
        settings = {"event_provider": server.url, "providers": [server.url], "wait": 0.01}
        found = fetch_event("xx1", tmp_path, settings | {"seedlink": [real_time.address]})
    assert found.stations == ["XX.S001"]
    (row,) = found.rejected
    assert row.name == "XX.S002"
    assert row.reasons == (
        f"{server.url}/fdsnws/dataselect/1/query: not found (HTTP 404): it lists stations, but "
        "their records are perhaps on SeedLink only (records.fdsn.seedlink)",
        f"{real_time.address} has no data of the window",
    )
    stream = read(str(found.folder / "XX.S001.mseed")).merge()
    for trace in stream:
        (sent,) = live.select(id=trace.id)
        common = sent.slice(trace.stats.starttime, trace.stats.endtime)
        np.testing.assert_array_equal(trace.data, common.data.astype(np.int32))


def test_a_seedlink_server_that_is_down_leaves_the_request_incomplete(server, tmp_path):
    with seedlink(server.stream) as real_time:
        address = real_time.address
    server.fail("dataselect", "S001", status(204))
    settings = {"event_provider": server.url, "providers": [server.url], "seedlink": [address]}
    found = fetch_event("xx1", tmp_path, settings)
    assert found.stations == ["XX.S002"]
    assert f"seedlink://{address}: no answer" in found.rejected[0].reasons[1]
    # The next attempt asks again
    assert fetch_event("xx1", tmp_path, settings).stations == ["XX.S001", "XX.S002"]
