"""Risk tables of scenarios joined on disk: by name, whatever their order and size."""

import json
from functools import partial

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from pyarrow import parquet

from per_obspy.runs import ensemble
from per_obspy.runs.ensemble import Scenarios, write_ensemble
from per_obspy.screening.columns import BY_CONTACT

COUNT = 500


@pytest.fixture
def tables():
    """Two risk tables of the same inventory in different orders; two pairs are in one of them."""
    random = np.random.default_rng(3)
    pairs = pd.DataFrame(
        {
            "pair_id": [f"p{i:03d}" for i in range(COUNT)],
            "gap": random.uniform(0, 0.1, COUNT),
            "longitude": random.uniform(20, 21, COUNT),
            "latitude": random.uniform(10, 11, COUNT),
        }
    )
    pairs = pairs.assign(
        expected_impact_velocity=random.uniform(0, 1, COUNT),
        expected_amplification=1.2,
        configuration="tall_beside_low",
        demand=0.1,
        period_1=0.4,
        period_2=0.8,
    )
    pairs["weighted_velocity"] = 1.5 * pairs["expected_impact_velocity"]
    # Each lacks a pair of the other
    near = pairs.assign(probability=random.uniform(0, 1, COUNT))
    far = pairs.assign(probability=random.uniform(0, 0.2, COUNT))
    return {
        "near": near.drop(index=7),
        "Far, far away": far.drop(index=9).sample(frac=1.0, random_state=1),
    }


def _written(tables, folder, csv_rows=1000, yearly=True):
    for number, table in enumerate(tables.values()):
        table.to_parquet(folder / f"{number}.parquet", index=False)
    files = {name: [folder / f"{number}.parquet"] for number, name in enumerate(tables)}
    # Rates, of which that of the first is twice the other
    scenarios = Scenarios(files, dict.fromkeys(tables, 0.01) | {"near": 0.02}, yearly)
    (folder / "out").mkdir()
    return write_ensemble(scenarios, folder / "out", {"simulated": "true"}, csv_rows)


def _counts(pairs=COUNT, unknown_gap=0, missing_scenario=0):
    """Return the counts of an ensemble without a rejection."""
    lacking = {"unknown_gap": unknown_gap, "missing_scenario": missing_scenario}
    return {"pairs": pairs, "rejected_pair": 0} | lacking


def test_pairs_are_joined_by_name_and_the_worst_comes_first(tables, tmp_path):
    _, counts = _written(tables, tmp_path)
    assert counts == _counts(missing_scenario=2)
    table = pd.read_parquet(tmp_path / "out" / "ensemble.parquet")
    assert table["rank"].tolist() == list(range(1, COUNT + 1))
    known = table[table["probability"].notna()]
    assert known["weighted_velocity"].is_monotonic_decreasing
    # the other two stand where the one scenario that has them puts them
    for name, risk in (("p007", tables["Far, far away"]), ("p009", tables["near"])):
        (rank,) = table.loc[table["pair_id"] == name, "rank"]
        velocity = risk.set_index("pair_id").loc[name, "weighted_velocity"]
        assert rank - 2 <= (known["weighted_velocity"] > velocity).sum() < rank
    assert set(table["configuration"]) == {"tall_beside_low"}
    # joined by pandas instead: would catch rows joined by position, or scenarios that changed
    # places
    near, far = (
        risk.set_index("pair_id")["probability"].reindex(table["pair_id"])
        for risk in tables.values()
    )
    assert_allclose(table["probability_near"], near)
    assert_allclose(table["probability_Far, far away"], far)
    assert_allclose(
        table["annual_probability"], 1 - np.exp(-0.02 * near.to_numpy() - 0.01 * far.to_numpy())
    )
    gaps = tables["near"].combine_first(tables["Far, far away"])
    gaps = gaps.set_index("pair_id")["gap"].reindex(table["pair_id"])
    assert_allclose(table["gap"], gaps, rtol=0)


def test_ties_go_to_the_amplification_the_probability_and_then_to_the_name(tables, tmp_path):
    # would catch: likely pairs before hard ones
    for table in tables.values():
        table["probability"], table["weighted_velocity"] = 0.5, 0.5
    near = tables["near"].set_index("pair_id", drop=False)
    near.loc["p100", ["weighted_velocity", "probability"]] = [3.0, 0.1]
    near.loc["p200", "expected_amplification"] = 4.0
    near.loc["p300", "probability"] = 0.9
    near.loc["p450", "weighted_velocity"] = np.nan
    # as if touching at 3 s and .2 m: 0.5 m/s times .42, below the others but for p450
    gap = {"gap": np.nan, "probability": np.nan, "weighted_velocity": np.nan}
    for table in (near, far := tables["Far, far away"].set_index("pair_id", drop=False)):
        table.loc["p460", [*gap, "period_1", "period_2", "demand"]] = [*gap.values(), 3.0, 3.0, 0.4]
    _, counts = _written({"near": near, "Far, far away": far}, tmp_path)
    assert counts == _counts(missing_scenario=2, unknown_gap=1)
    table = pd.read_parquet(tmp_path / "out" / "ensemble.parquet")
    assert table["pair_id"].tolist()[:5] == ["p100", "p200", "p300", "p000", "p001"]
    assert table["pair_id"].tolist()[-2:] == ["p460", "p450"]
    # two thirds of the weight are near's
    assert_allclose(table["weighted_velocity"][0], (2 * 3.0 + 0.5) / 3)
    assert_allclose(table["expected_amplification"][1], (2 * 4.0 + 1.2) / 3)


def test_every_file_is_written_and_every_column_described(tables, tmp_path):
    files, _ = _written(tables, tmp_path, csv_rows=5)
    assert set((tmp_path / "out").iterdir()) == set(files)
    table = pd.read_parquet(tmp_path / "out" / "ensemble.parquet")
    worst = pd.read_csv(tmp_path / "out" / "ensemble.csv")
    # text is of another type
    # the text has five digits
    # two digits where the contact law decides
    impacts = worst.columns.intersection(list(BY_CONTACT))
    others = worst.columns.drop(impacts)
    same = partial(pd.testing.assert_frame_equal, check_dtype=False, atol=0)
    same(worst[others], table.head(5)[others], rtol=5.1e-5)
    same(worst[impacts], table.head(5)[impacts], rtol=5.1e-2)
    columns = pd.read_csv(tmp_path / "out" / "ensemble.columns.csv")
    assert columns["name"].tolist() == list(table)
    assert columns["meaning"].str.len().min() > 5
    metadata = parquet.read_schema(tmp_path / "out" / "ensemble.parquet").metadata
    assert json.loads(metadata[b"per_obspy"])["simulated"] == "true"


def test_pieces_do_not_change_a_bit(tables, tmp_path, monkeypatch):
    for size in (7, 1000):
        folder = tmp_path / str(size)
        folder.mkdir()
        monkeypatch.setattr(ensemble, "ROWS", size)
        _written(tables, folder)
    for name in ("ensemble.csv", "ensemble.parquet", "rejected.csv"):
        assert (tmp_path / "7" / "out" / name).read_bytes() == (
            tmp_path / "1000" / "out" / name
        ).read_bytes()


def test_a_scenario_without_a_result_leaves_no_probability(tables, tmp_path):
    tables["near"].to_parquet(tmp_path / "near.parquet")
    scenarios = Scenarios(
        {"near": [tmp_path / "near.parquet"], "far": []}, {"near": 1.0, "far": 1.0}, yearly=False
    )
    counts = write_ensemble(scenarios, tmp_path, {}, 10)[1]
    assert counts == _counts(pairs=COUNT - 1, missing_scenario=COUNT - 1)
    table = pd.read_parquet(tmp_path / "ensemble.parquet")
    assert table["probability"].isna().all()
    # no scenario has a result
    nothing = Scenarios({"near": [], "far": []}, {"near": 1.0, "far": 1.0}, yearly=False)
    assert write_ensemble(nothing, tmp_path, {}, 10)[1] == _counts(pairs=0)
