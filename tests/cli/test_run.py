"""Arguments of ``per-obspy run``, and its lines on earthquakes and simulated motion."""

import json

import pytest

from per_obspy.cli.run import _earthquake_lines, _simulated_line
from per_obspy.config import Scenario
from per_obspy.simulation.earthquake import simulate, write_simulation

PAIRS = "pair_id,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,gap\n"
SMALL = ("spectra.count=5", "screening.exact=false", "screening.largest_distance=1e5", "workers=1")
OPTIONS = [word for change in SMALL for word in ("--set", change)]


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    folder = tmp_path_factory.mktemp("records")
    write_simulation(simulate(Scenario(stations=2, dt=0.02, magnitude=6.5)), folder)
    return folder


def test_records_and_pairs_are_a_run(records, tmp_path, monkeypatch, call):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "town.csv").write_text(f"{PAIRS}a,0.3,0.0,10,0.3001,0.0,12,0.05\n")
    code, out, err = call("run", records, "town.csv", *OPTIONS)
    assert code == 0, err
    folder = tmp_path / "results" / f"{records.name}-town"
    line = f"records: {records} (folder); pairs: town.csv (pair table); results: {folder}"
    assert err.splitlines()[0] == line.replace(f"{tmp_path}/", "")
    assert "2 stations, 1 pair:" in out
    assert f"per-obspy run {folder / 'configuration.toml'} does it again." in out
    # The last lines are the files to open, which are there
    assert "Open in this order:" in out.splitlines()[-4]
    to_open = [line.strip().partition(": ")[0] for line in out.splitlines()[-3:]]
    assert to_open == [str(folder / name) for name in ("report.html", "risk.csv", "rejected.csv")]
    assert all((folder / name).is_file() for name in to_open)
    code, described, _ = call("info", folder)
    assert "report.html, then risk.csv, then rejected.csv" in described.splitlines()[1]
    # a second run does nothing, also in the other order; another value is another run
    code, out, _ = call("run", "town.csv", records, *OPTIONS, "--json")
    assert (code, json.loads(out)["did_nothing"]) == (0, True)
    code, out, _ = call("run", folder, "--set", "screening.target_amplification=1.5", "--json")
    assert (code, json.loads(out)["did_nothing"]) == (0, False)
    # Report and screening take the folder of the results too
    for command in ("report", "screen"):
        code, out, err = call(command, folder)
        assert code == 0, err
        assert "All rows of the pair table are screened: 1." in out
    code, _, err = call("report", records)
    assert code == 2
    assert "holds no configuration of a run: name a TOML file, or a folder of one" in err
    (folder / "other.toml").write_bytes((folder / "configuration.toml").read_bytes())
    code, _, err = call("screen", folder)
    assert code == 2
    assert "holds several configurations, name one: configuration.toml, other.toml" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["RECORDS"], "records without pairs: name a pair table or footprints too"),
        (["RECORDS", "absent.csv"], "absent.csv: no such folder or file"),
        (["RECORDS", "town.csv", "--set", "highpas=1"], "did you mean processing.highpass?"),
        (["RECORDS", "town.csv", "--set", "spectra.count=1"], "spectra.count: "),
        (["absent"], "absent: no such folder or file"),
        (["absent.toml"], "absent.toml: cannot be read: No such file or directory"),
    ],
)
def test_wrong_arguments_are_one_line(records, tmp_path, monkeypatch, call, arguments, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "town.csv").write_text(PAIRS)
    given = [records if one == "RECORDS" else one for one in arguments]
    code, out, err = call("run", *given)
    assert (code, out) == (2, "")
    (line,) = err.splitlines()
    assert message in line
    assert [path.name for path in tmp_path.iterdir()] == ["town.csv"]


@pytest.mark.parametrize(
    "command", [["run", ""], ["run", "RECORDS", ""], ["info", ""], ["init", ""]]
)
def test_an_empty_argument_is_not_the_folder_of_the_shell(
    records, tmp_path, monkeypatch, call, command
):
    # would catch a run of whatever lies here, from a variable that was never set
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.toml").write_text('name = "x"\noutput = "out"\nsimulation = "s.toml"\n')
    code, _, err = call(*(records if one == "RECORDS" else one for one in command))
    assert code == 2
    assert "the path is empty" in " ".join(err.replace("│", " ").split())
    assert [path.name for path in tmp_path.iterdir()] == ["run.toml"]


def test_help_says_how_arguments_are_told_apart(call):
    code, out, _ = call("run", "--help")
    assert code == 0
    assert "Two are records and pairs, in either order: content decides." in out


def test_the_screened_earthquake_is_printed():
    first = {"start": "2019-07-04T17:33", "stations": 2, "records": 6, "undated": 0}
    second = {"start": "2019-07-06T03:19", "stations": 11, "records": 34, "undated": 1}
    groups = [first | {"screened": False}, second | {"screened": True}]
    assert _earthquake_lines(groups) == [
        "Records of 2 earthquakes: 2019-07-06T03:19, 11 stations; others, left out: "
        "2019-07-04T17:33",
        "1 records have no date and are taken for this one.",
    ]
    assert _earthquake_lines([first | {"screened": True}]) == []


def test_simulated_stations_are_counted_if_others_are_real():
    counts = {"stations": 5, "stations_simulated": 2}
    line = "The ground motion of 2 of 5 stations is SIMULATED."
    assert _simulated_line(counts) == line
    assert _simulated_line(counts | {"stations": 2}) == "The ground motion is SIMULATED."
