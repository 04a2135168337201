"""Workflows as a user runs them, on real records or made smaller; the others run with the demo and the figures."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from per_obspy.run import run
from per_obspy.scenarios import screen_scenarios
from per_obspy.spectra.storage import read_spectra

CHECKOUT = Path(__file__).parents[1]
WORKFLOWS = CHECKOUT / "workflows"


def _run(name, real_data, folder):
    """Run a workflow with its data where they are here, and its results in a folder of the test."""
    text = (WORKFLOWS / name).read_text(encoding="utf-8").replace("../../shared/data", str(real_data))
    (folder / name).write_text(text, encoding="utf-8")
    return run(folder / name, folder / "output")


@pytest.mark.real_data
def test_ridgecrest_2019(real_data, tmp_path):
    result = _run("ridgecrest2019.toml", real_data, tmp_path)
    assert result.record["state"] == "complete"
    assert result.record["counts"]["stations"] == 11
    table = pd.read_parquet(tmp_path / "output" / "risk.parquet")
    assert len(table) == 500
    exact = table[table["demand_rule"] == "exact"]
    # two codes that share no line: a gap below the exact demand is where the exact history has impacts
    assert ((exact["gap"] < exact["demand"]) == (exact["impacts"] > 0)).all()
    near = table[table["station"] == "CI.CCC"]["per_1"].median()
    assert near > table[table["station"] == "CI.MPM"]["per_1"].median()  # 0.5 g beside the fault, 0.1 g far from it


@pytest.mark.real_data
def test_mexico_1985(real_data, tmp_path):
    _run("mexico1985.toml", real_data, tmp_path)
    shard = read_spectra(tmp_path / "output" / "stations" / "MX.SCT.nc")
    (east,) = np.flatnonzero(shard["channel"] == "HNE")
    at_2_s = shard["per"][east].sel(damping=0.05).interp(period=2.0)
    assert float(at_2_s) == pytest.approx(0.984, rel=0.03)  # published to three digits; read off a grid of 5 %
    table = pd.read_parquet(tmp_path / "output" / "risk.parquet")
    assert not table["flags"].str.contains("simulated").any()


def test_two_scenarios_with_rates(tmp_path):
    smaller = {"stations = 4": "stations = 1", "count = 100": "count = 20"}
    for name in ("workflows/ensemble.toml", "workflows/ensemble_{}.toml", "catalogs/ensemble/{}.toml"):
        for one in (name.format("near"), name.format("far")):
            text = (CHECKOUT / one).read_text(encoding="utf-8")
            for number, fewer in smaller.items():
                text = text.replace(number, fewer)
            (tmp_path / one).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / one).write_text(text, encoding="utf-8")
    result = screen_scenarios(tmp_path / "workflows" / "ensemble.toml")
    assert result.record["counts"] == {"pairs": 20, "rejected_pair": 0}
    table = pd.read_csv(tmp_path / "output" / "ensemble" / "ensemble.csv")
    # one year of 0.014 earthquakes, each of which some pairs do not survive, and pairs that touch always meet in
    assert table["annual_probability"].max() == pytest.approx(1.0 - np.exp(-0.014), rel=1e-9)
    assert (table[table["gap"] == 0.0]["probability"] == 1.0).all()
    assert table["probability"].min() < 0.5
