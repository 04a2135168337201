"""Population of a pair: degenerate ones, order, scale, symmetry, and exact histories as a check."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ndtri
from screening_samples import make_pairs, make_station

import per_obspy
from per_obspy.screening import population
from per_obspy.screening.columns import DEMAND_SHARES
from per_obspy.screening.population import (
    COLUMNS,
    ONE_WALL,
    chance_of_contact,
    demand_quantiles,
)

#: Two buildings at the station itself, where the motion is the record's.
AT_STATION = {"longitude_1": 19.9999, "longitude_2": 20.0001}
GIVEN = {"damping_1": 0.05, "damping_2": 0.05, "restitution": 0.65, **AT_STATION}
EQUAL = {
    "period_1": 1.0, "period_2": 1.0, "participation_1": 1.0, "participation_2": 1.0, "mass_1": 1e6,
    "mass_2": 1e6,
}  # fmt: skip
DERIVED = {"period_1": np.nan, "period_2": np.nan, "height_1": 18.0, "storeys_1": 6.0, **AT_STATION}
DOUBT = {"period_log_std_1": 0.2, "period_log_std_2": 0.2}


def _table(station, rows):
    """Return the risk table in the order of the rows."""
    table = per_obspy.risk_table(station, make_pairs(rows))
    position = table["pair_id"].str[1:].astype(int)
    return table.assign(position=position).set_index("position").sort_index()


def test_without_doubt_the_population_is_the_exact_history(station):
    gaps = (0.0, 0.02, 0.1, 9.0)
    table = _table(station, [{**GIVEN, "gap": gap} for gap in gaps])
    assert table["demand_rule"].eq("exact").all()
    assert table["probability"].tolist() == [1.0, 1.0, 1.0, 0.0]
    exact = table["impact_velocity_exact"]
    assert exact.iloc[0] > 0.0
    for name in ("expected_impact_velocity", "impact_velocity_84"):
        assert_allclose(table[name], exact, rtol=0)
    amplified = table[["amplification_exact_1", "amplification_exact_2"]].max(axis=1).clip(lower=1)
    assert_allclose(table["expected_amplification"], amplified, rtol=0)


@pytest.mark.parametrize("doubt", [{}, DOUBT, {"gap_std": 0.01}])
def test_a_doubt_about_the_contact_moves_only_the_upper_velocity(station, doubt):
    # a restitution that the table does not give: the mean velocity, and with it the rank, stays
    pairs = [{**GIVEN, **doubt, "gap": 0.02, "restitution": e} for e in (0.65, np.nan)]
    given, assumed = (row for _, row in _table(station, pairs).iterrows())
    assert (given["contact_log_std"], assumed["contact_log_std"]) == (0.0, 0.1)
    for name in ("probability", "expected_impact_velocity", "expected_amplification"):
        assert given[name] == assumed[name]
    # exp(0.1) of a normal variable at one deviation, less of one that is doubtful besides
    ratio = assumed["impact_velocity_84"] / given["impact_velocity_84"]
    if doubt:
        assert 0.98 < ratio < 1.12
    else:
        assert_allclose(ratio, np.exp(0.1 * 0.9945 - 0.005), rtol=1e-4)


@pytest.mark.parametrize("pair", [GIVEN, {**GIVEN, **DOUBT}, DERIVED])
def test_the_kernel_gets_one_kind_of_arrays(pair, station, monkeypatch):
    # catches read-only arrays, for which Numba compiles once more, after the warm-up
    kernel, writable = population.fill_outcomes, []

    def noted(*arrays):
        writable.extend(array.flags.writeable for array in arrays)
        return kernel(*arrays)

    monkeypatch.setattr(population, "fill_outcomes", noted)
    _table(station, [{**pair, "gap": 0.02}])
    assert writable
    assert all(writable)


def test_a_little_doubt_changes_the_population_a_little(station):
    # towards the exact history as the doubt about the gap goes to 0
    certain, doubt = _table(
        station, [{**GIVEN, "gap": 0.05}, {**GIVEN, "gap": 0.05, "gap_std": 1e-5}]
    )["expected_impact_velocity"]
    assert_allclose(doubt, certain, rtol=1e-3)


@pytest.mark.parametrize("pair", [{**GIVEN, **DOUBT}, DERIVED])
def test_a_wider_gap_is_less_likely_to_close(station, pair):
    gaps = (0.0, 0.02, 0.1, 0.3, 1.0, 5.0)
    table = _table(station, [{**pair, "gap": gap} for gap in gaps])
    assert np.all(np.diff(table["probability"]) <= 0)
    assert table["expected_impact_velocity"].iloc[0] > 0.0
    # beyond every demand there is no impact
    last = table[[*COLUMNS]].iloc[-1]
    assert last["probability"] < 0.01
    assert last["expected_impact_velocity"] < 1e-3
    assert last["expected_amplification"] < 1.001
    assert np.isfinite(table[[*COLUMNS]]).all(axis=None)


@pytest.mark.parametrize("pair", [GIVEN, {**GIVEN, **DOUBT}, {**GIVEN, "gap_std": 0.02}])
def test_velocity_grows_with_the_ground_when_the_gap_does(pair):
    # twice the ground and the gap: round-off of the stored record is single precision
    once, twice = (
        _table(make_station(scale=scale), [{**pair, "gap": 0.05 * scale, "gap_std": 0.01 * scale}])
        for scale in (1.0, 2.0)
    )
    assert_allclose(twice["probability"], once["probability"], atol=1e-6)
    assert_allclose(
        twice["expected_impact_velocity"], 2.0 * once["expected_impact_velocity"], rtol=1e-4
    )
    assert_allclose(twice["expected_amplification"], once["expected_amplification"], rtol=1e-4)


def test_buildings_1_and_2_are_alike(station):
    # exchanged, seen from the other side: the nodes of both buildings change places
    pair = {"period_1": 1.1, "period_2": 0.7, "mass_1": 1e6, "mass_2": 3e6, "participation_1": 1.0,
            "participation_2": 1.3, **DOUBT, **AT_STATION, "damping_1": 0.05, "damping_2": 0.05,
            "gap": 0.1, "azimuth": 30.0}  # fmt: skip
    turned = {**pair, "azimuth": 210.0}
    for name in ("period", "mass", "participation"):
        turned[f"{name}_1"], turned[f"{name}_2"] = pair[f"{name}_2"], pair[f"{name}_1"]
    first, second = _table(station, [pair, turned])[[*COLUMNS]].to_numpy()
    # 128 nodes are not symmetric to the last digit: their own error
    assert_allclose(first[0], second[0], atol=0.02)
    assert_allclose(first[[1, 3]], second[[1, 3]], rtol=0.05)
    # a quantile of 128 nodes whose velocities spread by a third errs by 4 %; both err
    assert_allclose(first[2], second[2], rtol=0.12)


def test_equal_touching_buildings_rank_by_what_their_doubt_gives(station):
    other = {**GIVEN, "period_2": 0.4}
    rows = [{**EQUAL, **GIVEN}, {**EQUAL, **GIVEN, **DOUBT}, other]
    table = _table(station, [{**row, "gap": 0.0} for row in rows])
    in_step, doubtful, apart = table.to_dict("records")
    assert (in_step["expected_impact_velocity"], in_step["state"]) == (0.0, "no")
    assert in_step["rank"] == 3
    assert doubtful["state"] == "yes"
    assert doubtful["expected_impact_velocity"] > 0.05 * apart["expected_impact_velocity"]


def test_derived_periods_and_a_wide_gap_are_a_no():
    # a demand of millimetres and a gap of 2.56 m; was possible, for the periods were derived
    station = make_station(scale=0.005)
    row = _table(station, [{**DERIVED, "height_2": 12.0, "storeys_2": 4.0, "gap": 2.56}]).iloc[0]
    assert row["demand"] < 0.05
    assert (row["state"], row["risk_class"]) == ("no", "low")
    assert row["probability"] < 1e-6


def test_a_yes_does_not_outrank_a_harder_hit(station):
    # stiff touching buildings certainly hit, softly; flexible ones perhaps, but hard
    soft = {**GIVEN, **DOUBT, "period_1": 0.12, "period_2": 0.1, "gap": 0.0}
    demand = _table(station, [{**GIVEN, **DOUBT, "gap": 0.0}])["demand"].iloc[0]
    hard = {**GIVEN, **DOUBT, "gap": demand}
    table = _table(station, [soft, hard])
    assert table["state"].iloc[0] == "yes"
    assert table["state"].iloc[1] != "yes"
    assert table["rank"].tolist() == [2, 1]


def test_draws_of_exact_histories(station, record):
    # uncertain periods and dampings: 128 nodes and the fit against 3000 exact histories
    pair = {**EQUAL, **GIVEN, "period_2": 0.8, **DOUBT, "gap": 0.3}
    row = _table(station, [pair]).iloc[0]
    random, count = np.random.default_rng(3), 3000
    period_1, period_2 = np.exp(0.2 * random.normal(size=(2, count))) * [[1.0], [0.8]]
    hit = per_obspy.pounding_histories(
        record.records[0].horizontal, record.records[0].dt,
        period_1, 0.05, 1e6, period_2, 0.05, 1e6,
        gap=np.full(count, 0.3), restitution=0.65, azimuth=np.full(count, 30.0),
    )  # fmt: skip
    # P of 128 nodes is within 0.021 of 4096 at 95 of 100 pairs; the velocity fit within 25 % a node
    assert_allclose(row["probability"], np.mean(hit.impact_velocity > 0), atol=0.03)
    assert_allclose(row["expected_impact_velocity"], hit.impact_velocity.mean(), rtol=0.25)


@pytest.mark.parametrize("way", [{}, DERIVED, {"azimuth": np.nan}])
def test_most_of_the_touching_outlines_are_one_wall(way):
    # weak motion, a hundredth of the error of the outlines: a wall that is one is still hit
    station = make_station(scale=0.001)
    row = {**GIVEN, **way, "gap": 0.0, "gap_std": 0.1}
    table = _table(station, [row, {**row, "gap": 0.4}])
    assert (table["demand"] < 1e-3).all()
    # the error of the outlines alone adds 0.4 % of the others
    assert table["probability"].iloc[0] == pytest.approx(ONE_WALL, abs=0.01)
    # as the surveys of touching outlines have it
    assert 0.7 <= ONE_WALL <= 0.99
    assert table["state"].tolist() == ["likely", "no"]


def test_quantiles_of_the_demand_have_their_chance_of_contact():
    # nodes of two groups of buildings, which no lognormal demand is; would catch quantiles of the
    # nodes alone, which leave out that each is uncertain
    nodes, shares = population.NODES, np.array([*DEMAND_SHARES.values()])
    demands = np.where(nodes[:, 0] > 0.5, 0.2, 0.05) * np.exp(0.2 * nodes[:, 2])
    demands, log_std = np.stack([demands, 3.0 * demands]), np.full(2, 0.3)
    quantiles = demand_quantiles(demands, log_std, nodes)
    certain = {"gap_std": np.zeros(2), "assumed_gap": np.zeros(2)}
    for gap, share in zip(quantiles, shares, strict=True):
        chance = chance_of_contact(demands, log_std, {"gap": gap, **certain})
        # one step of linear interpolation between outcomes of 128 nodes
        assert_allclose(chance, 1.0 - share, atol=0.02)
    assert_allclose(quantiles[:, 1], 3.0 * quantiles[:, 0], rtol=1e-9)
    # one node is lognormal; a certain demand is each of its quantiles
    one = demand_quantiles(np.full((2, 1), 0.1), np.array([0.3, 0.0]), nodes)
    assert_allclose(one[:, 0], 0.1 * np.exp(0.3 * ndtri(shares)), rtol=1e-6)
    assert_allclose(one[:, 1], 0.1, rtol=1e-8)
