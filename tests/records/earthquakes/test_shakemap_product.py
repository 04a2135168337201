"""ShakeMaps by the identifier of an earthquake, from a service on loopback shaped like the USGS."""

import json

import pytest
from fdsn_server import content, serving, status
from test_shakemap import FIELDS, grid_xml, make_rows

from per_obspy.config import Scenario
from per_obspy.errors import CatalogError, ServiceError
from per_obspy.records.earthquakes.shakemap_product import fetch_shakemap
from per_obspy.records.fdsn.web import WebPool
from per_obspy.records.shakemap import read_shakemap
from per_obspy.simulation.earthquake import simulate

GRID = grid_xml(FIELDS, make_rows(), (2, 3)).encode()
#: The same map after a larger magnitude: every PSA doubled.
LATER = grid_xml(
    FIELDS, [(*row[:5], *(2 * x for x in row[5:8]), row[8]) for row in make_rows()], (2, 3)
)
POOL = WebPool(timeout=10.0, retries=0, wait=0.0)


@pytest.fixture
def service():
    with serving(simulate(Scenario(stations=1, dt=0.05))) as server:
        yield server


def test_the_latest_version_comes_with_its_stations(service, tmp_path):
    service.add_map("1", grid_xml=GRID)
    service.add_map("2", grid_xml=LATER.encode(), stationlist_json=b'{"features": []}')
    files = fetch_shakemap(POOL, service.url, "xx1", tmp_path)
    assert (files.version, files.uncertainty) == ("2", None)
    assert files.stations.read_bytes() == b'{"features": []}'
    # A list that is none costs the map nothing
    service.add_map("3", grid_xml=GRID, stationlist_json=b"<html>")
    assert fetch_shakemap(POOL, service.url, "xx1", tmp_path / "other").stations is None
    first = fetch_shakemap(POOL, service.url, "xx1", tmp_path, "1")
    assert first.version == "1"
    # twice the acceleration, exactly: doubling loses no digit
    ratio = read_shakemap(files.grid)["psa"] / read_shakemap(first.grid)["psa"]
    assert (ratio == 2.0).all()


def test_no_map_yet_is_no_fault(service, tmp_path):
    assert fetch_shakemap(POOL, service.url, "xx1", tmp_path) is None
    assert fetch_shakemap(POOL, service.url, "unheard", tmp_path) is None
    service.add_map("1", grid_xml=GRID)
    service.maps[0]["status"] = "DELETE"
    assert fetch_shakemap(POOL, service.url, "xx1", tmp_path) is None
    assert list(tmp_path.iterdir()) == []


def test_a_version_that_does_not_exist_names_those_that_do(service, tmp_path):
    service.add_map("3", grid_xml=GRID)
    service.add_map("10", grid_xml=GRID)
    with pytest.raises(CatalogError, match="no version 7 of the ShakeMap, only 3, 10"):
        fetch_shakemap(POOL, service.url, "xx1", tmp_path, "7")


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (b"<html>maintenance</html>", "data other than the event"),
        (b"[1, 2]", "data other than the event"),
        (json.dumps({"properties": {"products": {"shakemap": [{}]}}}).encode(), "data other than"),
    ],
    ids=["page", "list", "product"],
)
def test_another_answer_is_a_fault_of_the_service(service, tmp_path, body, reason):
    service.fail("event", "*", content(body))
    with pytest.raises(ServiceError, match=reason):
        fetch_shakemap(POOL, service.url, "xx1", tmp_path)


def test_damaged_and_missing_grids_are_not_kept(service, tmp_path):
    service.add_map("1", grid_xml=GRID[:-400])
    with pytest.raises(ServiceError, match="its ShakeMap is damaged"):
        fetch_shakemap(POOL, service.url, "xx1", tmp_path)
    assert list(tmp_path.rglob("*.xml")) == []
    service.add_map("2", uncertainty_xml=GRID)
    with pytest.raises(ServiceError, match="version 2 of the ShakeMap has no grid"):
        fetch_shakemap(POOL, service.url, "xx1", tmp_path)


def test_files_of_other_hosts_and_folders_are_refused(service, tmp_path):
    service.add_map("1", grid_xml=GRID)
    service.maps[0]["contents"]["download/grid.xml"]["url"] = "http://169.254.1.1/grid.xml"
    with pytest.raises(ServiceError, match="names a file of another host"):
        fetch_shakemap(POOL, service.url, "xx1", tmp_path)
    # a version that is no number never becomes a path
    service.add_map("../../x", grid_xml=GRID)
    files = fetch_shakemap(POOL, service.url, "xx1", tmp_path / "cache")
    assert files.grid.parent == tmp_path / "cache" / "shakemap-0"


def test_a_service_without_an_answer_is_a_passing_fault(service, tmp_path):
    service.fail("event", "*", status(503))
    with pytest.raises(ServiceError, match="503"):
        fetch_shakemap(POOL, service.url, "xx1", tmp_path)
