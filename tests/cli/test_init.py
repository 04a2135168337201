"""``per-obspy init``: a configuration for the inputs found, which runs."""

import json
import tomllib

from per_obspy.config import Scenario
from per_obspy.simulation.earthquake import simulate, write_simulation

PAIRS = "pair_id,longitude_1,latitude_1,height_1,longitude_2,latitude_2,height_2,gap\n"


def test_from_files_on_a_desk_to_a_table(tmp_path, monkeypatch, call):
    # the walk of a new user: init, run ., and again
    monkeypatch.chdir(tmp_path)
    write_simulation(simulate(Scenario(stations=2, dt=0.02, magnitude=6.5)), tmp_path / "records")
    (tmp_path / "pairs.csv").write_text(f"{PAIRS}a,0.3,0.0,10,0.3001,0.0,12,0.05\n")
    code, out, _ = call("init")
    assert code == 0
    assert out.splitlines() == [
        "records: records (records, found here)",
        "pairs: pairs.csv (pair table, found here)",
        "run.toml is written; next: per-obspy run run.toml",
        "then open, in this order: report.html, risk.csv, rejected.csv in results",
    ]
    small = ["--set", "spectra.count=5", "--set", "screening.exact=false"]
    small += ["--set", "screening.largest_distance=1e5", "--set", "workers=1"]
    code, out, err = call("run", ".", *small, "--json")
    assert code == 0, err
    assert "configuration: run.toml" in err
    assert json.loads(out)["counts"]["pairs"] == 1
    written = tomllib.loads((tmp_path / "results" / "configuration.toml").read_text())
    assert written["spectra"] == {"count": 5}
    code, out, _ = call("run", "results", "--json")
    assert (code, json.loads(out)["did_nothing"]) == (0, True)


def test_a_file_is_never_lost(tmp_path, monkeypatch, call):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.toml").write_text("# hours of work\n")
    code, _, err = call("init")
    assert (code, err.splitlines()[-1][:33]) == (2, "per-obspy: run.toml: exists alrea")
    assert (tmp_path / "run.toml").read_text() == "# hours of work\n"
    assert call("init", "--force")[0] == 0
    assert call("init", "-o", "other.toml")[0] == 0
    assert call("init", "absent")[0] == 2
