"""Workflows as a user runs them, on real records or on smaller inputs."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from per_obspy.inventory.files.writing import write_pairs
from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints
from per_obspy.results.table_files import rounded
from per_obspy.runs.ensemble import screen_scenarios
from per_obspy.runs.run import run
from per_obspy.screening.totals import hexagons
from per_obspy.spectra.storage import read_spectra

from ..runs.small_run import InProcess, plain_reports

pytestmark = pytest.mark.long

CHECKOUT = Path(__file__).parents[2]
WORKFLOWS = CHECKOUT / "workflows"


def _run(name, real_data, folder, smaller=("", "")):
    """Run a workflow with its data where they are here, and its results in a folder of the test."""
    text = (WORKFLOWS / name).read_text(encoding="utf-8").replace(*smaller)
    configuration = folder / "workflows" / name
    configuration.parent.mkdir(exist_ok=True)
    configuration.write_text(text.replace("../../shared/data", str(real_data)), encoding="utf-8")
    return run(configuration, folder / "output" / configuration.stem, executor=InProcess())


@pytest.mark.real_data
def test_ridgecrest_2019(real_data, tmp_path):
    # figures and page as well, of fewer pairs
    result = _run("ridgecrest2019.toml", real_data, tmp_path, ("count = 500", "count = 150"))
    assert result.record["state"] == "complete"
    assert result.record["faults"] == []
    assert result.record["counts"]["stations"] == 11
    table = pd.read_parquet(tmp_path / "output" / "ridgecrest2019" / "risk.parquet")
    assert len(table) == 150
    exact = table[table["demand_rule"] == "exact"]
    # two codes that share no line: a gap below the exact demand is where the exact history has
    # impacts
    assert ((exact["gap"] < exact["demand"]) == (exact["impact_velocity_exact"] > 0)).all()
    near = table[table["station"] == "CI.CCC"]["per_1"].median()
    assert (
        near > table[table["station"] == "CI.MPM"]["per_1"].median()
    )  # 0.5 g beside the fault, 0.1 g far from it


@pytest.mark.real_data
def test_mexico_1985(real_data, tmp_path):
    with plain_reports():
        _run("mexico1985.toml", real_data, tmp_path)
    shard = read_spectra(tmp_path / "output" / "mexico1985" / "stations" / "MX.SCT.nc")
    (east,) = np.flatnonzero(shard["channel"] == "HNE")
    at_2_s = shard["per"][east].sel(damping=0.05).interp(period=2.0)
    assert float(at_2_s) == pytest.approx(
        0.984, rel=0.03
    )  # published to three digits; read off a grid of 5 %
    table = pd.read_parquet(tmp_path / "output" / "mexico1985" / "risk.parquet")
    assert not table["flags"].str.contains("simulated").any()


def test_two_scenarios_with_rates(tmp_path):
    smaller = {"stations = 4": "stations = 1", "count = 100": "count = 20"}
    for name in (
        "workflows/ensemble.toml",
        "workflows/ensemble_{}.toml",
        "catalogs/ensemble/{}.toml",
    ):
        for one in (name.format("near"), name.format("far")):
            text = (CHECKOUT / one).read_text(encoding="utf-8")
            for number, fewer in smaller.items():
                text = text.replace(number, fewer)
            (tmp_path / one).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / one).write_text(text, encoding="utf-8")
    with plain_reports():
        result = screen_scenarios(tmp_path / "workflows" / "ensemble.toml", executor=InProcess())
    assert result.record["counts"] == {
        "pairs": 20, "rejected_pair": 0, "unknown_gap": 0, "missing_scenario": 0
    }  # fmt: skip
    table = pd.read_parquet(tmp_path / "output" / "ensemble" / "ensemble.parquet")
    # one year of 0.014 earthquakes, each of which some pairs do not survive, and pairs that touch
    # always meet in: only the digits of floating point are between both
    assert table["annual_probability"].max() == pytest.approx(1.0 - np.exp(-0.014), rel=1e-9)
    assert (table[table["gap"] == 0.0]["probability"] == 1.0).all()
    assert table["probability"].min() < 0.5


def _pairs_of(city, real_data, folder):
    """Make the pairs of a city and leave a third of them where its workflows look for them."""
    path = real_data / "inventories" / "footprints" / f"{city}_pilot_region_all_fields.gpkg"
    (folder / "output").mkdir()
    pairs = pairs_from_footprints(path)
    # The tallest buildings are among them
    kept = np.arange(len(pairs)) % 3 == 0
    kept[np.fmax(pairs["height_1"], pairs["height_2"]).to_numpy().argmax()] = True
    write_pairs(pairs[kept], folder / "output" / f"{city}_pairs.parquet")
    return pairs[kept]


def _run_city(city, workflow, real_data, folder):
    """Run a city's workflow, simulated ones with two stations; return its table and totals."""
    (folder / "catalogs" / city).mkdir(parents=True, exist_ok=True)
    scenario = (CHECKOUT / "catalogs" / city / "scenario.toml").read_text(encoding="utf-8")
    assert "stations = 8" in scenario
    smaller = scenario.replace("stations = 8", "stations = 2\ndt = 0.02")
    (folder / "catalogs" / city / "scenario.toml").write_text(smaller, encoding="utf-8")
    with plain_reports():
        _run(workflow, real_data, folder)
    output = folder / "output" / Path(workflow).stem
    return pd.read_parquet(output / "risk.parquet"), pd.read_csv(output / "totals.csv")


@pytest.mark.real_data
@pytest.mark.parametrize("city", ["san_jose", "guatemala"])
def test_cities_in_a_simulated_earthquake_and_in_that_of_mexico(city, real_data, tmp_path):
    pairs = _pairs_of(city, real_data, tmp_path)
    simulated, totals = _run_city(city, f"{city}.toml", real_data, tmp_path)
    mexico, _ = _run_city(city, f"{city}_sct1985.toml", real_data, tmp_path)
    for table in (simulated, mexico):
        assert len(table) == len(pairs)
        # outlines that touch are drawn with an error that is assumed: no certain contact, and no
        # `no`; gaps of more than a metre between low houses do not close
        touching = table[table["gap"] == 0.0]
        assert "no" not in set(touching["state"])
        assert (touching["probability"] < 1.0).all()
        assert touching["derived"].str.contains("gap_std").all()
        low = np.fmax(table["height_1"], table["height_2"]) < 12.0
        assert (table[(table["gap"] > 1.0) & low]["probability"] < 1e-6).all()
    # every H3 cell of resolution 10 has the sum of its pairs, to the five digits of the table
    cells = hexagons(simulated["longitude"], simulated["latitude"], 10)
    expected = simulated["probability"].groupby(cells).sum()
    assert totals["area"].str.startswith("8a").all()
    found = totals.set_index("area")["expected_pounding"].loc[expected.index]
    assert found.tolist() == rounded(expected.to_numpy()).tolist()
    assert len(totals) == len(expected)
    assert simulated["flags"].str.contains("simulated").all()
    assert not mexico["flags"].str.contains("simulated").any()
    # beside a near earthquake on rock the lakebed moves tall buildings more and low ones less:
    # Guatemala's tallest, of seven storeys, are far below 2 s; would catch the record of one taken
    # for the other. Simulated places vary between periods, so that the ratio may be small
    ratio = (mexico.set_index("pair_id")["per_1"] / simulated.set_index("pair_id")["per_1"]).rename(
        "ratio"
    )
    by_period = (
        simulated.set_index("pair_id")["period_1"]
        .to_frame()
        .join(ratio)
        .sort_values("period_1")["ratio"]
    )
    assert by_period.iloc[-1] > by_period.iloc[: len(by_period) // 10].median()
