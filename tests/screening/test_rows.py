"""Rows of the risk table: independence of blocks, azimuth rules, stale columns, the map."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from screening_samples import make_pairs, make_station
from shakemap_samples import make_map

import per_obspy
from per_obspy.config import Building, Screening
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.assignment import stations_of
from per_obspy.screening.columns import ORDER, RESULTS
from per_obspy.screening.risk import INTERMEDIATE, risk_rows
from per_obspy.screening.site_motion import RegionalMotion, prepared_field


def _rows(pairs, *stations, shakemap=None):
    """Return unranked rows by pair, and the rejections."""
    screening = Screening()
    located, _ = stations_of(stations)
    ground = RegionalMotion(located, prepared_field(stations, screening.interpolation), shakemap)
    rows, rejected = risk_rows(pairs, ground, Building(), screening)
    return rows.set_index("pair_id"), rejected


def test_rows_have_all_columns_of_the_table_but_its_rank(station):
    rows, rejected = _rows(make_pairs([{"owner": "city"}]), station)
    assert rejected == ()
    columns = rows.reset_index().columns
    assert {*ORDER} - {*columns} == {"rank"}
    assert "owner" in columns
    # columns of the computation do not reach the table
    assert not {*INTERMEDIATE} & {*columns}
    assert not [name for name in columns if name.startswith("raised_")]


def test_the_azimuth_is_found_by_three_rules(station):
    # given; the axis of the exact demand; every azimuth, where a period is derived
    unknown = {"azimuth": np.nan}
    rows = [{}, unknown, {**unknown, "period_1": np.nan}]
    table, _ = _rows(make_pairs(rows), station)
    assert table["azimuth_rule"].tolist() == ["given", "worst", "worst"]
    assert table["demand_rule"].tolist()[:2] == ["exact", "exact"]
    assert table["azimuth_used"].iloc[0] == 30.0
    # a whole degree only where every one was tried
    assert table["azimuth_used"].iloc[1] % 1.0 != 0.0
    assert table["azimuth_used"].iloc[2] % 1.0 == 0.0


@pytest.mark.parametrize("way", [{"period_1": np.nan}, {"yield_displacement_1": 0.3}])
def test_of_an_unknown_azimuth_the_worse_side_counts(station, way):
    # would catch: demand and history of one side only, where the other demands up to twice as much
    rows = [{**way, "period_2": period, "gap": 0.1} for period in np.linspace(0.4, 2.5, 8)]
    unknown, _ = _rows(make_pairs([{**row, "azimuth": np.nan} for row in rows]), station)
    assert set(unknown["azimuth_rule"]) == {"worst"}
    # estimates decide where a period is derived
    assert ("exact" in set(unknown["demand_rule"])) == ("yield_displacement_1" in way)
    # estimates know a half circle, sides the whole one
    assert (unknown["azimuth_used"] >= 180.0).any()
    assert_array_equal(unknown["demand_exact"], unknown["demand_two_sided"])
    # the same azimuth as a given one has the same demand and history
    given = [
        {**row, "azimuth": azimuth}
        for row, azimuth in zip(rows, unknown["azimuth_used"], strict=True)
    ]
    along, _ = _rows(make_pairs(given), station)
    for name in ("demand_exact", "impact_velocity_exact", "amplification_exact_1"):
        # cosines of an angle and of the opposite one differ in the last bit; impacts amplify that
        assert_allclose(unknown[name], along[name], rtol=1e-6, err_msg=name)


def test_a_row_does_not_depend_on_the_others(station, monkeypatch):
    # would catch: lanes or blocks that leak into each other
    azimuths = [np.nan if number % 3 else 40.0 for number in range(9)]
    rows = [
        {"period_1": 0.5 + 0.1 * number, "gap": 0.01 * number, "azimuth": azimuth}
        for number, azimuth in enumerate(azimuths)
    ]
    # of pairs with a derived period every azimuth is tried, block by block
    for row in rows[::2]:
        row["period_2"] = np.nan
    together, _ = _rows(make_pairs(rows), station)
    monkeypatch.setattr("per_obspy.screening.risk.BLOCK", 2)
    blocks, _ = _rows(make_pairs(rows), station)
    pd.testing.assert_frame_equal(blocks, together, check_exact=True)


def test_every_pair_has_the_row_of_its_own_station():
    # would catch: rows joined in the order of the stations
    near, far = make_station("NEAR"), make_station("FAR", latitude=10.1, scale=3.0, seed=5)
    places = [10.0, 10.1, 10.0, 10.1]
    rows = [{"latitude_1": latitude, "latitude_2": latitude} for latitude in places]
    table, _ = _rows(make_pairs(rows), near, far)
    assert table["station"].tolist() == ["XX.NEAR", "XX.FAR"] * 2
    # each station alone
    only_near, _ = _rows(make_pairs(rows[:1]), near)
    only_far, _ = _rows(make_pairs(rows[1:2]), far)
    expected = np.tile([only_near["per_1"].iloc[0], only_far["per_1"].iloc[0]], 2)
    assert_array_equal(table["per_1"], expected)


def test_pairs_without_a_station_fall_back_on_the_map(station):
    rows = [{}, {"latitude_1": 10.4, "latitude_2": 10.4}, {"latitude_1": 13.0, "latitude_2": 13.0}]
    table, (rejection,) = _rows(make_pairs(rows), station, shakemap=make_map())
    assert table.loc["P0", "demand_rule"] == "exact"
    assert table.loc["P1", "demand_rule"] == "shakemap"
    # the third is out of reach of both
    assert rejection.name == "P2"
    assert len(rejection.reasons) == 2


def test_without_a_pair_in_reach_the_table_is_empty(station):
    table, rejected = _rows(make_pairs([{"latitude_1": 13.0, "latitude_2": 13.0}]), station)
    assert table.empty
    assert {*ORDER} - {*table.reset_index()} == {"rank"}
    assert [rejection.name for rejection in rejected] == ["P0"]


def test_results_of_an_earlier_table_are_not_taken_for_new_ones(station):
    # would catch a computed column that gives way to one of the pair table, which is another
    # event's
    pairs = make_pairs([{"period_2": other, "gap": 0.01} for other in (0.7, 1.5)])
    fresh = per_obspy.risk_table(station, pairs)
    results = [name for name in RESULTS if name in fresh and name not in pairs]
    numbers = [name for name in results if pd.api.types.is_numeric_dtype(fresh[name])]
    assert "demand" in numbers
    stale = pairs.assign(**dict.fromkeys(numbers, 7.0), raised_touching=1.0)
    pd.testing.assert_frame_equal(per_obspy.risk_table(station, stale), fresh)


@pytest.mark.parametrize("name", ["period_1", "damping_2", "restitution"])
def test_completed_values_are_in_the_row(station, name):
    pairs = make_pairs([{"period_1": np.nan}])
    table, _ = _rows(pairs, station)
    assert table[name].iloc[0] == completed_pairs(pairs, Building())[name].iloc[0]


@pytest.mark.parametrize("way", [{}, {"period_1": np.nan}])
def test_the_axis_of_an_unknown_azimuth_is_the_worst_for_the_demand_that_decides(station, way):
    # would catch: an axis along which the demand of the row is not the largest
    azimuths = [np.nan, *range(0, 360, 15)]
    rows, _ = _rows(make_pairs([{**way, "azimuth": azimuth} for azimuth in azimuths]), station)
    rows = rows.loc[[f"P{number}" for number in range(len(azimuths))]]
    assert rows["demand_rule"].iloc[0] == ("srss" if way else "exact")
    # estimates try whole degrees, which these are
    assert (rows["demand"].iloc[1:] <= rows["demand"].iloc[0] * (1 + 1e-12)).all()


def test_state_and_probability_rest_on_the_same_motion():
    # certain buildings between two stations, the nearer one with three times the motion: a demand
    # of the record closes gaps that the motion at the site leaves open
    loud, quiet = make_station("TWO", scale=3.0), make_station("ONE", latitude=10.06)
    given = {"damping_1": 0.05, "damping_2": 0.05, "latitude_1": 10.028, "latitude_2": 10.028}
    demand = _rows(make_pairs([given]), loud, quiet)[0]["demand"].item()
    shares = np.linspace(0.2, 1.5, 14)
    pairs = make_pairs([{**given, "gap": share * demand} for share in shares])
    rows, _ = _rows(pairs, loud, quiet)
    assert set(rows["demand_rule"]) == {"exact"}
    # the demand of the record is no certain contact at the site
    states, probability = rows["state"], rows["probability"]
    assert ((states != "yes") & (rows["gap"] < rows["demand"])).any()
    # no pair that is a yes is less likely than one that is none
    assert ((states == "yes") == (probability >= Screening().states.yes)).all()
    assert probability[states == "yes"].min() > probability[states != "yes"].max()
    # a wider gap is less likely to close
    assert (np.diff(rows.sort_values("gap")["probability"]) <= 0.0).all()
