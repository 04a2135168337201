"""``per-obspy events``, ``fetch``, ``info`` and a run with records of a service on loopback."""

import json
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from pathlib import Path

import pandas as pd
import pytest
from fdsn_server import FdsnServer, serving, status

from per_obspy.config import Scenario
from per_obspy.pipeline.run import run
from per_obspy.records.simulation.earthquake import Simulation, simulate, write_simulation

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
        ('providers = ["{url}"]', 'providers = ["NOWHERE"]', "NOWHERE: is no base URL"),
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


def test_info(simulation, tmp_path, call):
    write_simulation(simulation, tmp_path)
    (tmp_path / "notes.txt").write_text("bring an umbrella")
    code, out, err = call("info", tmp_path)
    assert code == 0
    assert "6 records" in out
    assert "XX.S002..HNE" in out
    assert "rejected file notes.txt: ObsPy cannot read it" in err
    code, out, _ = call("info", tmp_path, "--json")
    told = json.loads(out)
    assert [one["name"] for one in told["rejected"]] == ["notes.txt"]
    for one in told["records"]:
        (trace,) = simulation.stream.select(id=one["record"])
        assert (one["dt"], one["format"], one["level"], one["unit"]) == (
            0.02,
            "MSEED",
            "raw",
            "m/s2",
        )
        assert one["duration"] == pytest.approx(trace.stats.endtime - trace.stats.starttime)
        # 200 000 counts a m/s2, as the simulated StationXML says
        assert one["peak"] == pytest.approx(abs(trace.data - trace.data.mean()).max() / 2e5)
        assert one["file"] == f"{one['record'][:7]}.mseed"


def test_info_shows_earthquakes_and_simulated_records(simulation, tmp_path, call):
    write_simulation(simulation, tmp_path / "main")
    later = Scenario(stations=1, dt=0.02, magnitude=5.5, origin_time="2001-02-03T04:05:06")
    write_simulation(simulate(later), tmp_path / "later")
    # as JSON every record has its mark, as text every earthquake has a line
    records = json.loads(call("info", tmp_path, "--json")[1])["records"]
    assert {record["event"][:2] for record in records} == {"1:", "2:"}
    assert all(record["simulated"] for record in records)
    out = call("info", tmp_path)[1]
    assert "earthquake 1: " in out
    assert "earthquake 2: 2001-02-03T04:04: 1 stations, 3 records" in out
    assert "9 records are SIMULATED." in out


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ({}, "the folder is empty"),
        (
            {"a.txt": "Dear colleague", "b.md": "# Notes"},
            "none of its 2 files is a record; a.txt: ",
        ),
        ({"s.xml": "<FDSNStationXML"}, "none of its 1 files is a record; s.xml: "),
    ],
)
def test_info_of_nothing(tmp_path, call, content, problem):
    (tmp_path / "records").mkdir()
    for name, text in content.items():
        (tmp_path / "records" / name).write_text(text)
    run_file = tmp_path / "run.toml"
    head = 'name = "x"\noutput = "out"\n[records]\nfolder = "records"\n'
    run_file.write_text(f"{head}[pairs.simulated]\ncount = 2\n")
    # The folder is named in one line, whatever reads it
    for command in (
        ("info", tmp_path / "records"),
        ("run", run_file),
        ("process", tmp_path / "records", "-o", tmp_path / "clean"),
        ("spectra", tmp_path / "records", "-o", tmp_path / "spectra.nc"),
    ):
        code, _, err = call(*command)
        assert code == 3
        assert f"records: {problem}" in err.splitlines()[-1]
    assert call("info", tmp_path / "absent")[0] == 2


def test_info_of_records_that_cannot_be_used(simulation, tmp_path, call):
    write_simulation(simulation, tmp_path)
    (tmp_path / "stations.xml").unlink()
    code, out, err = call("info", tmp_path)
    assert code == 3
    assert "0 records" in out
    assert "XX.S001..HNN: there is no StationXML" in err


@pytest.mark.parametrize("command", ["info", "process"])
def test_a_record_without_samples_is_rejected(simulation, tmp_path, call, command):
    write_simulation(simulation, tmp_path / "in")
    for waveforms in (tmp_path / "in").glob("*.mseed"):
        waveforms.unlink()
    head = "TIMESERIES XX_S001__HNN_D, 0 samples, 100 sps, 2000-01-01T00:00:00.000000, "
    head += "SLIST, INTEGER, Counts"
    (tmp_path / "in" / "S001.txt").write_text(f"{head}\n")
    output = ("-o", tmp_path / "out") if command == "process" else ()
    code, out, _ = call(command, tmp_path / "in", *output, "--json")
    assert code == 3
    (rejected,) = json.loads(out)["rejected"]
    assert "no samples" in rejected["reasons"][0]


@pytest.mark.real_data
def test_info_of_a_workspace(real_data, call):
    code, out, _ = call(
        "info", real_data / "records" / "asdf" / "nc72282711_workspace.h5", "--json"
    )
    assert code == 0
    told = json.loads(out)["records"]
    assert sorted(one["level"] for one in told) == ["processed"] * 3 + ["raw"] * 3
    raw, processed = (
        [one["peak"] for one in told if one["level"] == level] for level in ("raw", "processed")
    )
    # the mean instead of a baseline, and no filter: 1 % for pulses of 5 Hz
    assert raw == pytest.approx(processed, rel=0.01)


def test_help_has_an_example(call):
    for command in ("events", "fetch", "info"):
        code, out, _ = call(command, "--help")
        assert code == 0
        assert "Example: per-obspy" in out
