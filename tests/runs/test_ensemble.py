"""``per-obspy screen`` of an ensemble: two small simulated earthquakes and one inventory."""

import json
import shutil
import sys

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from per_obspy.cli import application

from .small_run import SPECTRA, page_content, real_reports

pytestmark = pytest.mark.usefixtures("plain_reports")

PAIRS = """\
pair_id,longitude_1,latitude_1,height_1,period_1,longitude_2,latitude_2,height_2,period_2,gap
a,0.3,0.0,12,0.5,0.3001,0.0,12,1.0,0.05
b,0.3,0.0,12,0.3,0.3001,0.0,12,0.9,0.10
c,0.3,0.0,12,0.3,0.3001,0.0,12,0.9,0.0
"""

ENSEMBLE = """\
name = "two"
output = "both"
[[scenario]]
name = "large"
run = "large.toml"
rate = 0.01
[[scenario]]
name = "small"
run = "small.toml"
rate = 0.03
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Both runs, done; the ensemble is not."""
    folder = tmp_path_factory.mktemp("ensemble")
    (folder / "pairs.csv").write_text(PAIRS)
    for name, magnitude in (("large", 7.0), ("small", 5.5)):
        # One station each
        scenario = f"[scenario]\nstations = 1\nmagnitude = {magnitude}\ndt = 0.02\n"
        (folder / f"{name}_event.toml").write_text(scenario)
        (folder / f"{name}.toml").write_text(
            f'name = "{name}"\noutput = "{name}"\nworkers = 1\nsimulation = "{name}_event.toml"\n'
            f'[pairs]\nfile = "pairs.csv"\n{SPECTRA}'
        )
    (folder / "ensemble.toml").write_text(ENSEMBLE)
    _call(folder)
    shutil.rmtree(folder / "both")
    return folder


def _call(folder, *arguments):
    """Return exit code of ``per-obspy screen`` on the ensemble."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            sys, "argv", ["per-obspy", "screen", str(folder / "ensemble.toml"), *arguments]
        )
        with pytest.raises(SystemExit) as stop:
            application.main()
    return stop.value.code or 0


@pytest.fixture
def copied(done, tmp_path):
    shutil.copytree(done, tmp_path, dirs_exist_ok=True)
    return tmp_path


def test_every_scenario_is_run_and_the_probabilities_are_joined(copied, capsys):
    shutil.rmtree(copied / "small")
    assert _call(copied) == 0
    out, err = capsys.readouterr()
    assert "SIMULATED" in out
    assert "2 scenarios, 3 pairs; 0 rejected; without a probability: 0 of unknown gap, 0 " in out
    assert "small: stations: 1 of 1" in err
    assert "large: stations" not in err  # it was done
    table = pd.read_parquet(copied / "both" / "ensemble.parquet").set_index("pair_id")
    # joined by pandas instead
    large, small = (
        pd.read_parquet(copied / name / "risk.parquet")
        .set_index("pair_id")["probability"]
        .reindex(table.index)
        for name in ("large", "small")
    )
    assert_allclose(table["annual_probability"], 1 - np.exp(-0.01 * large - 0.03 * small))
    assert_allclose(table["probability"], 0.25 * large + 0.75 * small)
    assert table.loc["c", "probability"] == 1.0  # touching buildings meet in any earthquake
    # the gap for the target lies between those that both scenarios together do not exceed: at the
    # demand of 98 % in both contact is rarer than a fiftieth of the rates, at that of 2 % hardly
    assert 0.02 * 0.04 < 1 / 475 < 0.98 * 0.04
    names = ("large", "small")
    runs = [pd.read_parquet(copied / n / "risk.parquet").set_index("pair_id") for n in names]
    lowest = np.minimum(*(run["demand_02"].reindex(table.index) for run in runs))
    highest = np.maximum(*(run["demand_98"].reindex(table.index) for run in runs))
    assert table["gap_for_target"].between(lowest, highest).all()
    missing = (table["gap_for_target"] - table["gap"]).clip(lower=0.0)
    assert_allclose(table["missing_gap_for_target"], missing)
    assert (copied / "both" / "figures" / "gap_for_target.png").is_file()


def test_the_same_again_does_nothing_and_a_new_rate_runs_nothing(copied, capsys):
    _call(copied)
    capsys.readouterr()
    assert _call(copied, "--json") == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["did_nothing"]
    assert err == ""
    # another rate joins the same runs
    (copied / "ensemble.toml").write_text(ENSEMBLE.replace("0.03", "0.06"))
    assert _call(copied, "--json") == 0
    out, err = capsys.readouterr()
    record = json.loads(out)
    assert not record["did_nothing"]
    assert "stations" not in err
    assert [scenario["rate"] for scenario in record["scenarios"]] == [0.01, 0.06]


def test_the_record_of_an_ensemble_names_its_runs(copied, capsys):
    _call(copied, "-o", str(copied / "elsewhere"))
    record = json.loads((copied / "elsewhere" / "ensemble.json").read_text())
    # by their keys, and without the folders of this machine
    files = [copied / name / "run.json" for name in ("large", "small")]
    keys = [json.loads(file.read_text())["key"] for file in files]
    assert [scenario["key"] for scenario in record["scenarios"]] == keys
    assert str(copied) not in json.dumps(record)
    capsys.readouterr()


def test_pairs_of_unknown_gap_or_of_one_scenario_are_ranked_and_shown(copied, capsys):
    """One pair is in the first inventory, one in the second, one has no gap, one two of them."""
    pairs = PAIRS.replace("c,0.3,", "u,0.3,").replace("12,0.9,0.0", "12,0.9,")
    (copied / "pairs.csv").write_text(pairs)
    (copied / "fewer.csv").write_text(pairs.replace("a,0.3,", "d,0.3,").replace("0.10", "0.20"))
    text = (copied / "small.toml").read_text()
    (copied / "small.toml").write_text(text.replace("pairs.csv", "fewer.csv"))
    # the page of the ensemble itself is read below
    with real_reports():
        assert _call(copied) == 0
    out = capsys.readouterr().out
    counts = "3 pairs; 1 rejected; without a probability: 1 of unknown gap, 2 that a scenario lacks"
    assert counts in out
    rejected = pd.read_csv(copied / "both" / "rejected.csv").set_index("name")["reasons"]
    assert rejected.to_dict() == {"b": "gap = 0.1 m in one scenario and 0.2 m in another"}
    table = pd.read_parquet(copied / "both" / "ensemble.parquet").set_index("pair_id")
    # by the scenario that has them, and by the gaps that both ask for
    large, small = (
        pd.read_parquet(copied / name / "risk.parquet").set_index("pair_id")
        for name in ("large", "small")
    )
    need = 0.25 * large.loc["u", "demand"] + 0.75 * small.loc["u", "demand"]
    velocity = {
        "u": 0.5 * np.pi * (1 / 0.3 + 1 / 0.9) * need,
        "a": large.loc["a", "weighted_velocity"], "d": small.loc["d", "weighted_velocity"],
    }  # fmt: skip
    assert table.index.tolist() == sorted(velocity, key=velocity.get, reverse=True)
    record = json.loads((copied / "both" / "ensemble.json").read_text())
    assert record["partial"]
    assert record["coverage"]["left_out"] == {"scenarios disagree": 1}
    # the page says why none of them has a verdict, and knows the buildings of each
    content = page_content(copied / "both" / "report.html")
    assert [part[:2] for part in content["coverage_bar"]] == [
        ["screened", 0], ["no verdict", 3], ["left out", 1],
    ]  # fmt: skip
    assert content["alert"]["sentence"].startswith("No pair has a probability in every scenario")
    columns = {column["name"]: column for column in content["tables"][0]["columns"]}
    assert columns["state"]["texts"] == ["unknown"]
    assert {"unknown_gap", "missing_scenario"} <= set(" ".join(columns["flags"]["texts"]).split())
    assert "longitude_2" in columns
    # of the two that a scenario lacks the gap is known
    assert set(columns["risk_class"]["texts"]) == {"gap unknown", "no verdict"}
    totals = pd.read_csv(copied / "both" / "totals.csv")
    assert totals[["class_gap unknown", "class_no verdict"]].sum().tolist() == [1, 2]


def test_nothing_usable_in_a_scenario_exits_with_3(copied, capsys):
    text = (copied / "small.toml").read_text()
    (copied / "small.toml").write_text(text + "[screening]\nlargest_distance = 1.0\n")
    assert _call(copied) == 3
    assert "no usable record or pair: see" in capsys.readouterr().err


WRONG = {
    "mixed": (("rate = 0.03", "weight = 0.03"), "'small' has a weight, others have the other one"),
    "both": (("rate = 0.03", "rate = 0.03\nweight = 1"), "'small' needs either a weight or a rate"),
    "neither": (("rate = 0.03\n", ""), "'small' needs either a weight or a rate"),
    "negative": (
        ("rate = 0.03", "rate = -0.03"),
        "scenario.1.rate: Input should be greater than or equal to 0",
    ),
    "infinite": (("rate = 0.03", "rate = inf"), "scenario.1.rate: Input should be a finite number"),
    "all 0": (("rate = 0.03", "rate = 0.0"), "weights or rates must have a positive sum"),
    "no rarer target": (
        ('output = "both"', 'output = "both"\ntarget_rate = 0.04'),
        "target_rate = 0.04 is not below the sum of the rates, 0.04 1/year",
    ),
    "same name": (('name = "small"', 'name = "Large"'), "name: 'Large' occurs twice"),
    "same run": (
        ("small.toml", "large.toml"),
        "scenario 'small' has the output folder of scenario 'large'",
    ),
    "a run's folder": (
        ('"both"', '"small"'),
        "scenario 'small' has the output folder of the ensemble",
    ),
    "no such run": (("small.toml", "absent.toml"), "absent.toml: cannot be read"),
    "no run": (("small.toml", "ensemble.toml"), "ensemble.toml: scenario: unknown key"),
    "misspelt": (("rate = 0.03", "rates = 0.03"), "scenario.1.rates: unknown key"),
}


@pytest.mark.parametrize("fault", WRONG)
def test_a_wrong_ensemble_stops_with_one_line(copied, capsys, fault):
    change, message = WRONG[fault]
    text = ENSEMBLE.replace("0.01", "0.0") if fault == "all 0" else ENSEMBLE
    (copied / "ensemble.toml").write_text(text.replace(*change))
    assert _call(copied) == 2
    _, err = capsys.readouterr()
    assert err.count("\n") == 1
    assert message in err
