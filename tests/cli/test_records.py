"""``per-obspy events``, ``fetch`` and a run with records of a service on loopback."""

import json
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fdsn_server import FdsnServer, serving, status
from test_shakemap import FIELDS, grid_xml, make_rows

from per_obspy.config import Scenario
from per_obspy.inventory.files.writing import write_pairs
from per_obspy.runs.run import run
from per_obspy.simulation.buildings import simulated_pairs
from per_obspy.simulation.earthquake import Simulation, simulate

CONFIGURATION = """
name = "fetched"
output = "out"
workers = 1
[records.fdsn]
providers = ["{url}"]
event_id = "xx1"
event_provider = "{url}"
cache = "cache"
retries = 1
wait = 0.01
timeout = 10.0
[pairs.simulated]
count = 10
[screening]
largest_distance = 1e5
[spectra]
count = 5
dampings = [0.05]
azimuth_step = 30
"""


class Here(Executor):
    """Do the work at once in this process."""

    def submit(self, function, /, *arguments):
        future = Future()
        future.set_result(function(*arguments))
        return future


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    return simulate(Scenario(stations=2, dt=0.02, magnitude=6.5))


@pytest.fixture
def server(simulation: Simulation) -> Iterator[FdsnServer]:
    with serving(simulation) as running:
        yield running


@pytest.fixture
def configuration(server: FdsnServer, tmp_path: Path) -> Path:
    file = tmp_path / "run.toml"
    file.write_text(CONFIGURATION.format(url=server.url))
    return file


def test_a_run_fetches_its_records_once_and_works_without_the_network_after(
    server, configuration, call
):
    code, out, err = call("run", configuration, "--json")
    assert code == 0, err
    record = json.loads(out)
    assert (record["counts"]["stations"], record["counts"]["pairs"], record["partial"]) == (
        2,
        10,
        False,
    )
    assert any(
        path.startswith("cache") and path.endswith("XX.S001.mseed") for path in record["inputs"]
    )
    assert str(configuration.parent) not in json.dumps(record["inputs"])
    asked = len(server.requests)
    server.shutdown()
    code, out, _ = call("run", configuration, "--json")
    assert (code, json.loads(out)["did_nothing"]) == (0, True)
    assert len(server.requests) == asked


def test_a_station_that_cannot_be_fetched_is_a_row_and_comes_with_the_next_run(
    server, configuration
):
    server.fail("dataselect", "S002", *[status(503)] * 2)
    first = run(configuration, executor=Here()).record
    assert (first["state"], first["partial"], first["counts"]["stations"]) == ("complete", True, 1)
    rejected = pd.read_csv(configuration.parent / "out" / "rejected.csv")
    (row,) = rejected[rejected["kind"] == "station"].to_dict("records")
    assert row["name"] == "XX.S002"
    assert "HTTP 503" in row["reasons"]
    second = run(configuration, executor=Here()).record["counts"]
    assert (second["stations"], second["stations_resumed"]) == (2, 1)


def test_a_service_that_is_down_exits_with_75(server, configuration, call):
    server.fail("station", "*", *[status(503)] * 4)
    for command in ("fetch", "run"):
        code, out, err = call(command, configuration)
        assert (code, out) == (75, "")
        assert "HTTP 503" in err.splitlines()[-1]


def test_the_identifier_of_an_earthquake_is_enough_for_records(server, tmp_path, call):
    # would catch an identifier taken for a path, or a cache that is filled again
    changes = [f"records.fdsn.providers=['{server.url}']", "records.fdsn.wait=0.01"]
    changes += [f"records.fdsn.event_provider='{server.url}'", "pairs.simulated.count=10"]
    changes += ["screening.largest_distance=1e5", "screening.exact=false", "spectra.count=5"]
    options = [word for change in changes for word in ("--set", change)]
    add_map(server, "1")
    code, out, err = call("run", "USGS:xx1", *options, "-o", tmp_path / "out", "--json")
    assert code == 0, err
    record = json.loads(out)
    assert record["counts"]["stations"] == 2
    known = record["configuration"]["records"]
    assert known["shakemap"] == "fetched/shakemap-1/grid.xml"
    assert known["stationlist"] == "fetched/shakemap-1/stationlist.json"
    assert "records: USGS:xx1 (identifier of an earthquake)" in err
    assert (tmp_path / "out" / "fetched").is_dir()
    # its configuration runs without the network
    asked = len(server.requests)
    server.shutdown()
    code, out, _ = call("run", tmp_path / "out", "--json")
    assert (code, json.loads(out)["did_nothing"]) == (0, True)
    assert len(server.requests) == asked


def add_map(server: FdsnServer, version: str, factor: float = 1.0) -> None:
    """Add a ShakeMap around the stations: twice the factor, twice the acceleration."""
    places = [(station.longitude, station.latitude) for station in server.inventory[0]]
    east, north = zip(*places, strict=True)
    box = [(min(one) - 1.0, (min(one) + max(one)) / 2, max(one) + 1.0) for one in (east, north)]
    rows = [(*r[:5], *(factor * x for x in r[5:8]), r[8]) for r in make_rows(box[0], box[1][::-1])]
    files = {"grid_xml": grid_xml(FIELDS, rows, (3, 3)).encode()}
    server.add_map(version, **files, stationlist_json=b'{"features": []}')


def test_a_map_serves_until_records_come_and_each_version_is_named(server, tmp_path, call):
    longitude, latitude = np.array([(one.longitude, one.latitude) for one in server.inventory[0]]).T
    pairs = simulated_pairs(longitude, latitude, count=10, seed=1, radius=2000.0, touching=0.0)
    write_pairs(pairs, tmp_path / "pairs.csv")
    changes = [f"records.fdsn.providers=['{server.url}']", "records.fdsn.wait=0.01"]
    changes += [f"records.fdsn.event_provider='{server.url}'", "records.fdsn.end='2100-01-01'"]
    changes += ["screening.exact=false", "rows.enabled=false"]
    options = [word for change in changes for word in ("--set", change)]
    command = ("run", "USGS:xx1", tmp_path / "pairs.csv", *options, "-o", tmp_path / "out")
    # The window of the records is not over, and there is no map: nothing to screen by, try later
    code, _, err = call(*command)
    assert (code, "still to come: fetch after it" in err) == (75, True)

    def demands(*further: str) -> pd.Series:
        code, _, err = call(*command, *further)
        assert code == 0, err
        assert "still to come" in err
        risk = pd.read_parquet(tmp_path / "out" / "risk.parquet").set_index("pair_id")
        assert set(risk["demand_rule"]) == {"shakemap"}
        return risk["demand"].sort_index()

    add_map(server, "1")
    first = demands()
    # A map that is there is asked for again on demand only, and the same version is not sent again
    add_map(server, "2", factor=2.0)
    fetch = ("fetch", "xx1", "--event-service", server.url, "--provider", server.url, "--again")
    for _ in range(2):
        call(*fetch, "--shakemap", "-o", tmp_path / "out" / "fetched")
    sent = server.asked("/archive/product/shakemap/xx1/1/grid.xml")
    # Demand of a linear pair is proportional to the acceleration; rounding of its logarithm
    np.testing.assert_allclose(demands(), 2.0 * first, rtol=1e-12)
    assert server.asked("/archive/product/shakemap/xx1/1/grid.xml") == sent == 1
    np.testing.assert_array_equal(demands("--set", "records.fdsn.shakemap_version=1"), first)
    rejected = pd.read_csv(tmp_path / "out" / "rejected.csv")
    assert "service" in set(rejected["kind"])


def test_fetch_fills_the_cache_alone(server, configuration, call):
    code, out, err = call("fetch", configuration)
    assert code == 0
    assert "2 stations are in" in out
    assert "fetching: 2 of 2" in err
    assert not (configuration.parent / "out").exists()
    asked = len(server.requests)
    code, out, _ = call("fetch", configuration, "--json")
    assert (code, json.loads(out)["stations"]) == (0, ["XX.S001", "XX.S002"])
    assert len(server.requests) == asked


def test_fetch_takes_a_named_earthquake(server, tmp_path, call):
    options = ("--event-service", server.url, "--provider", server.url, "-o", tmp_path / "quake")
    code, out, err = call("fetch", "xx1", *options)
    assert code == 0, err
    assert "2 stations are in" in out
    assert (tmp_path / "quake" / "event-xx1.xml").is_file()


def test_fetch_takes_the_shakemap_and_says_how_a_run_takes_it(server, tmp_path, call):
    options = ("--provider", server.url, "--event-service", server.url, "-o", tmp_path / "x")
    assert "no ShakeMap of xx1 yet" in call("fetch", "xx1", *options, "--shakemap")[2]
    server.add_map("1", grid_xml=grid_xml(FIELDS, make_rows(), (2, 3)).encode())
    code, _, err = call("fetch", "xx1", *options, "--shakemap")
    assert (code, "version 1: per-obspy run ... --set records.shakemap=" in err) == (0, True)
    code, _, err = call("fetch", "xx1", *options, "--map-version", "9")
    assert (code, "no version 9 of the ShakeMap, only 1" in err) == (2, True)


def test_fetch_refuses_what_is_neither_configuration_nor_earthquake(configuration, call):
    code, out, err = call("fetch", "somewhere")
    assert (code, out) == (2, "")
    assert "somewhere: its form is not that of an earthquake" in err
    code, _, err = call("fetch", configuration, "--seedlink", "host")
    assert code == 2
    assert "whose section [records.fdsn] holds these options" in err


def test_fetch_says_what_had_no_data_and_asks_again_when_told(server, configuration, call):
    server.fail("dataselect", "S001", status(204))
    server.fail("dataselect", "S002", status(204))
    code, out, err = call("fetch", configuration)
    assert code == 3
    assert "0 stations" in out
    assert "rejected station XX.S001: 127.0.0.1" in err
    assert call("run", configuration)[0] == 3
    assert call("fetch", configuration, "--again")[0] == 0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('providers = ["{url}"]', 'providers = ["NOWHERE"]', "NOWHERE: is neither a base URL"),
        ('providers = ["{url}"]', "providers = []", "records.fdsn.providers"),
        ('event_id = "xx1"', 'event_id = "yy9"', "has no event yy9"),
        ('event_id = "xx1"', "", "fdsn needs event_id, or event, or latitude"),
        ('event_id = "xx1"', 'event_id = "xx1"\nstart = "yesterday"', "records.fdsn.start"),
        ("timeout = 10.0", "timeout = 0", "records.fdsn.timeout"),
    ],
)
def test_wrong_input_exits_with_2(server, tmp_path, call, old, new, message):
    file = tmp_path / "wrong.toml"
    file.write_text(CONFIGURATION.replace(old, new).replace("{url}", server.url))
    code, _, err = call("fetch", file)
    assert code == 2
    assert message in err.splitlines()[-1]


def test_fetch_needs_a_service(tmp_path, call):
    file = tmp_path / "folder.toml"
    file.write_text('name = "x"\noutput = "o"\n[records]\nfolder = "r"\n[pairs]\nfile = "p.csv"\n')
    code, _, err = call("fetch", file)
    assert code == 2
    assert "has no section [records.fdsn]" in err


def test_events(server, call):
    code, out, _ = call("events", server.url, "--magnitude", "6", "--start", "1999-12-31")
    assert code == 0
    assert "1 events" in out
    assert "xx1" in out
    assert server.requests[-1].parameters == {
        "minmagnitude": "6.0",
        "starttime": "1999-12-31",
        "format": "text",
    }
    code, out, _ = call("events", server.url, "--json")
    assert json.loads(out)[0]["magnitude"] == 6.5
    server.fail("event", "*", status(204))
    assert call("events", server.url)[0] == 3
    server.fail("event", "*", status(400))
    assert call("events", server.url)[0] == 75
    assert call("events", "absent")[0] == 2


def test_help_has_an_example(call):
    for command in ("events", "fetch"):
        code, out, _ = call(command, "--help")
        assert code == 0
        assert "Example: per-obspy" in out
