"""``per-obspy info``: one screen for every input and result."""

import json
import re

import pytest

from per_obspy.cli.info import HEIGHT, WIDTH
from per_obspy.config import Scenario
from per_obspy.simulation.earthquake import Simulation, simulate, write_simulation

PAIRS = "pair_id,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,gap\n"


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    return simulate(Scenario(stations=2, dt=0.02, magnitude=6.5))


def _fits_on_a_screen(out, err):
    lines = [*out.splitlines(), *err.splitlines()]
    return len(lines) <= HEIGHT and max(map(len, lines)) <= WIDTH


def test_everything_fits_on_one_screen_and_says_what_it_is(simulation, tmp_path, call):
    write_simulation(simulation, tmp_path / "records")
    for number in range(40):
        (tmp_path / "records" / f"letter_{number}_{'x' * 90}.txt").write_text("Dear colleague")
    east = [0.3 + number / 1e3 for number in range(30)]
    rows = [f"p{x:.3f},{x},0.1,10,{x + 1e-4},0.1,12,{-1 + x % 0.002 * 1e3:.0f},1,2" for x in east]
    (tmp_path / "pairs.csv").write_text(PAIRS.replace("\n", ",a,b\n") + "\n".join(rows))
    (tmp_path / "run.toml").write_text(
        'name = "x"\noutput = "out"\n[records]\nfolder = "records"\n[pairs]\nfile = "pairs.csv"\n'
    )
    for name, kind in {
        "records": "records",
        "records/stations.xml": "description of stations",
        "pairs.csv": "pair table",
        "run.toml": "configuration of a run",
    }.items():
        code, out, err = call("info", tmp_path / name)
        assert code == 0
        assert f": {kind}" in out.splitlines()[0]
        assert _fits_on_a_screen(out, err), name
    # rejections that have no room are counted
    code, _, err = call("info", tmp_path / "records")
    assert err.splitlines()[-1] == "and 37 more rejected: --all"
    assert len(call("info", tmp_path / "records", "--all")[2].splitlines()) == 40


def test_places_are_on_the_map(simulation, tmp_path, call):
    write_simulation(simulation, tmp_path)
    out = call("info", tmp_path)[1]
    assert out.count("^") == 2
    # latitudes and longitudes of its edges hold those of the stations
    edges = [float(one) for one in re.findall(r"^ +(-?\d+\.\d{4}) \|", out, re.MULTILINE)]
    latitudes = [station.latitude for network in simulation.inventory for station in network]
    assert min(edges) - 0.01 <= min(latitudes) <= max(latitudes) <= max(edges) + 0.01
    assert re.search(r"1 column [\d.]+ k?m", out)


def test_json_names_the_kind(tmp_path, call):
    (tmp_path / "pairs.csv").write_text(PAIRS + "a,0.3,0.1,10,0.3001,0.1,12,0.1\n")
    code, out, _ = call("info", tmp_path / "pairs.csv", "--json")
    found = json.loads(out)
    assert (code, found["kind"], found["rows"]) == (0, "pair table", 1)


def test_control_characters_of_a_file_do_not_reach_the_screen(tmp_path, call):
    (tmp_path / "run.toml").write_text(
        'name = "a\\u001b[31mred\\nline"\noutput = "out"\nsimulation = "s.toml"\n'
    )
    out = call("info", tmp_path / "run.toml")[1]
    assert "\x1b" not in out
    assert "red line" in out


def test_help_has_an_example(call):
    code, out, _ = call("info", "--help")
    assert code == 0
    assert "Example: per-obspy" in out


def test_info(simulation, tmp_path, call):
    write_simulation(simulation, tmp_path)
    (tmp_path / "notes.txt").write_text("bring an umbrella")
    code, out, err = call("info", tmp_path, "--all")
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
    assert re.search(r"earthquake 1 +\S+T\d\d:\d\d: 2 stations, 6 records", out)
    assert re.search(r"earthquake 2 +2001-02-03T04:04: 1 station, 3 records", out)
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
