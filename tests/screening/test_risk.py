"""Risk table: no pair missing, every number at contact height, the ladder of demands, ranking."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from screening_samples import make_pairs, make_station

import per_obspy
from per_obspy.config import Screening
from per_obspy.errors import CatalogError
from per_obspy.screening.columns import ORDER


def _table(station, *rows, **settings):
    table = per_obspy.risk_table(station, make_pairs(rows), screening=Screening(**settings))
    return table.set_index("pair_id")


def test_columns_come_in_their_order_and_others_are_carried_through(station):
    table = per_obspy.risk_table(station, make_pairs([{"owner": "city"}]))
    assert tuple(table.columns[: len(ORDER)]) == ORDER
    assert table["owner"].tolist() == ["city"]


def test_a_given_pair_is_answered_by_the_exact_demand(station):
    table = _table(station, {"gap": 0.0001}, {"gap": 9.0})
    assert table["demand_rule"].tolist() == ["exact", "exact"]
    # the gap does not change what is needed
    assert table.loc["P0", "demand"] == table.loc["P1", "demand"]
    assert table.loc["P0", "state"] == "yes"
    assert table.loc["P1", "state"] == "no"


def test_the_exact_demand_is_the_gap_at_which_impacts_begin(station):
    # would catch: a participation, azimuth or side that differs between relative displacement and
    # history
    (demand,) = _table(station, {})["demand"]
    table = _table(station, {"gap": demand * (1 + 1e-6)}, {"gap": demand * (1 - 1e-6)})
    assert table.loc["P0", "impact_velocity_exact"] == 0.0
    # however slow it is; impacts counts those above 1 mm/s
    assert 0.0 < table.loc["P1", "impact_velocity_exact"] < 0.05
    assert table.loc["P1", "probability"] >= Screening().states.likely
    assert (table["impacts"] == (table["impact_velocity_exact"] > 0.001)).all()


def test_the_estimate_beside_the_exact_demand_is_the_largest(station):
    # Mutations: the ratio upside down; the exact demand in the place of the estimate; SRSS for
    # given periods.
    equal = {"period_2": 1.0, "height_2": 30.0, "storeys_2": 10.0}
    table = _table(station, equal, {"period_2": 0.7}, {"period_2": 1.5}).sort_index()
    largest = np.maximum(table["critical_gap_per"], table["critical_gap_record"])
    assert_allclose(table["demand_estimated"], largest)
    assert set(table["estimate_rule"]) <= {"per_white_noise", "per_record"}
    assert np.isnan(table["estimate_over_exact"].iloc[0])  # equal buildings need no gap
    estimate = table["estimate_over_exact"] * table["demand_exact"]
    assert_allclose(estimate[1:], table["demand_estimated"][1:])


def test_radii_are_computed_at_the_pairs_own_period_damping_and_azimuth(station):
    # would catch: values read off the stored grid, buildings exchanged
    oscillators = {"period_1": 0.777, "damping_1": 0.031, "period_2": 1.234, "damping_2": 0.07}
    table = _table(station, oscillators)
    north, east = station["acceleration"].to_numpy()
    along = north * np.cos(np.radians(30.0)) + east * np.sin(np.radians(30.0))
    for i, (period, damping) in enumerate(((0.777, 0.031), (1.234, 0.07)), start=1):
        expected = per_obspy.response_spectra(along, 0.01, [period], damping)
        assert_allclose(table[f"per_{i}"], expected.per, rtol=1e-9)  # the contract of the spectra
        assert_allclose(table[f"sd_{i}"], expected.sd, rtol=1e-9)


def test_every_gap_grows_with_participation(station):
    # would catch: an estimate that forgets the contact level
    names = [
        "critical_gap_per",
        "critical_gap_record",
        "critical_gap_sd",
        "srss_gap",
        "absolute_gap",
        "demand_exact",
    ]
    once = _table(station, {"participation_1": 1.0, "participation_2": 1.0})[names]
    twice = _table(station, {"participation_1": 2.0, "participation_2": 2.0})[names]
    # homogeneous of degree one; peaks located to 1e-9
    assert_allclose(twice, 2 * once, rtol=1e-8)


def test_twice_the_motion_is_twice_the_demand(station):
    once = _table(station, {})["demand"]
    assert_allclose(_table(make_station(scale=2.0), {})["demand"], 2 * once, rtol=1e-8)


def test_derived_periods_are_never_a_plain_no(station):
    # would catch: equal heights give equal periods, a correlation of 1 and a demand of 0
    unknown = {
        "period_1": np.nan,
        "period_2": np.nan,
        "height_1": 18.0,
        "storeys_1": 6.0,
        "gap": 0.5,
    }
    table = _table(station, unknown)
    assert table.loc["P0", "demand_rule"] == "srss"
    assert table.loc["P0", "demand"] == table.loc["P0", "srss_gap"] > 0
    assert table.loc["P0", "state"] in {"yes", "likely", "possible", "unlikely"}
    assert "derived_period" in table.loc["P0", "flags"].split()


def test_outside_the_usable_periods_the_estimates_decide_and_a_flag_says_so():
    table = _table(make_station(longest=0.8), {})
    assert table.loc["P0", "demand_rule"] in {"per_white_noise", "per_record"}
    estimates = table[["critical_gap_per", "critical_gap_record"]].loc["P0"]
    assert table.loc["P0", "demand"] == estimates.max()
    assert "outside_usable_periods" in table.loc["P0", "flags"]


def test_touching_pairs_are_always_answered(station):
    table = _table(station, {"gap": 0.0})
    assert table.loc["P0", "state"] == "yes"
    assert table.loc["P0", "demand_ratio"] == 0.0
    assert table.loc["P0", "probability"] == 1.0
    assert "touching" in table.loc["P0", "flags"].split()


def test_equal_given_buildings_need_no_gap_and_have_no_ratio(station):
    same = {"period_2": 1.0, "height_2": 30.0, "storeys_2": 10.0}
    # dampings are given: assumed ones would be sampled
    table = _table(station, {**same, "damping_1": 0.05, "damping_2": 0.05})
    assert table.loc["P0", "demand"] == 0.0
    assert np.isnan(table.loc["P0", "demand_ratio"])
    assert table.loc["P0", "state"] == "no"
    assert "no_demand" in table.loc["P0", "flags"]


def test_an_unknown_azimuth_is_the_worst_one(station):
    # would catch: an azimuth per building, a half circle where the sides differ
    worst = _table(station, {"azimuth": np.nan})["demand"].iloc[0]
    every = _table(station, *({"azimuth": float(a)} for a in range(0, 360, 5)))["demand"]
    # samples choose the direction: up to (omega dt)² / 8 = 0.2 % at 0.6 s below the exact maximum
    assert worst >= every.max() * (1 - 2e-3)


def test_turning_a_pair_round_exchanges_its_buildings(station):
    names = ["period", "height", "storeys", "longitude", "latitude"]
    plain = make_pairs([{}]).iloc[0]
    turned = {f"{n}_{i}": plain[f"{n}_{3 - i}"] for n in names for i in (1, 2)} | {"azimuth": 210.0}
    table = _table(station, {}, turned)
    assert_allclose(*table["demand"], rtol=1e-9)
    # dampings are assumed: nodes of the one building become those of the other, and 128 of them
    # are within 0.021
    assert_allclose(*table["probability"], atol=0.01)
    given = {"damping_1": 0.05, "damping_2": 0.05}
    assert_allclose(*_table(station, given, turned | given)["probability"], rtol=1e-9)
    # building 1 of one is building 2 of the other
    first = table.loc["P0", "amplification_exact_1"]
    assert_allclose(first, table.loc["P1", "amplification_exact_2"], rtol=1e-6)


def test_one_horizontal_serves_with_a_flag_and_without_the_exact_rung():
    table = _table(make_station(channels=("HNE",)), {}, {"azimuth": np.nan})
    assert table["azimuth_rule"].tolist() == ["station", "station"]
    # of an unknown azimuth the worse side of the sensor's axis
    assert (table["azimuth_used"] % 180.0).tolist() == [90.0, 90.0]
    assert table.loc["P0", "azimuth_used"] == 90.0
    assert table.loc["P1", "demand_exact"] == table.loc["P1", "demand_two_sided"]
    assert not (table["demand_rule"] == "exact").any()
    assert table["flags"].str.contains("one_horizontal").all()


def test_sensors_of_unknown_azimuth_serve_with_the_largest_demand_whatever_the_pair():
    # mutation: the azimuth of the pair, counted from the first sensor, gives a smaller demand
    station = make_station()
    unknown = station.assign(horizontal_azimuth=("horizontal", [np.nan, np.nan]))
    table, worst = (
        _table(unknown, {}, {"azimuth": 30.0}),
        _table(station, *[{"azimuth": np.nan}] * 2),
    )
    for name in ("demand", "probability", "demand_exact"):
        assert_allclose(table[name], worst[name], rtol=1e-12)  # the same computation
    assert table.loc["P1", "azimuth"] == 30.0
    assert set(table["azimuth_rule"]) == {"worst"}
    assert table["flags"].str.contains("unknown_azimuths").all()
    assert not worst["flags"].str.contains("unknown_azimuths").any()


def test_the_nearest_station_is_used_and_far_pairs_are_rejected():
    stations = [make_station("NEAR", latitude=10.01), make_station("FAR", latitude=11.0, seed=9)]
    pairs = make_pairs([{}, {"latitude_1": 13.0, "latitude_2": 13.0}])
    table = per_obspy.risk_table(stations, pairs)
    assert table["station"].tolist() == ["XX.NEAR"]
    (rejection,) = table.attrs["rejected"]
    assert rejection.name == "P1"
    assert (
        "XX.FAR is 2223" in rejection.reasons[0]
    )  # 2 degrees of latitude: 222.39 km on the sphere


@pytest.mark.parametrize("exact", [True, False])
def test_a_pair_does_not_depend_on_stations_computed_with_its_own(monkeypatch, exact):
    # would catch a pair driven by the record, spectrum or limits of another station, bit by bit
    stations = [
        make_station("A", seed=1),
        make_station("B", latitude=10.1, longest=0.9, seed=2),
        make_station("ONE", channels=("HNN",), latitude=10.2, seed=3),
        make_station("D", scale=3.0, latitude=10.3, seed=4),
        make_station("E", scale=0.3, latitude=10.4, seed=5),
    ]
    weak = {"yield_displacement_1": 0.02, "hardening_1": 0.05}
    kinds = [{}, {"azimuth": np.nan}, {"gap": 0.0}, weak, weak | {"azimuth": np.nan, "gap": 0.01}]
    kinds += [{"period_1": np.nan, "period_2": np.nan}, {"period_log_std_1": 0.3}, {"gap": 0.3}]
    rows = [
        kind | {f"latitude_{i}": 10.0 + 0.1 * place for i in (1, 2)}
        for kind in kinds
        for place in range(5)
    ]
    settings = Screening(exact=exact)
    together = per_obspy.risk_table(stations, make_pairs(rows), screening=settings)
    monkeypatch.setattr("per_obspy.screening.risk.STATIONS_TOGETHER", 1)
    alone = per_obspy.risk_table(stations, make_pairs(rows), screening=settings)
    assert together["station"].nunique() == 5
    pd.testing.assert_frame_equal(together, alone, check_exact=True)


def test_a_station_without_coordinates_serves_no_pair():
    table = per_obspy.risk_table([make_station(latitude=np.nan)], make_pairs([{}]))
    assert len(table) == 0
    assert [rejection.kind for rejection in table.attrs["rejected"]] == ["station", "pair"]


def test_rejections_of_the_reader_are_kept(station):
    pairs = make_pairs([{}, {"gap": -1.0}])
    table = per_obspy.risk_table(station, pairs)
    assert [rejection.name for rejection in table.attrs["rejected"]] == ["P1"]


def test_worst_first(station):
    table = per_obspy.risk_table(station, make_pairs([{"gap": g} for g in (9.0, 0.0, 0.01, 5.0)]))
    assert table["state"].tolist() == ["yes", "yes", "no", "no"]
    assert table["rank"].tolist() == [1, 2, 3, 4]
    # by the expected velocity: that of the record's own history is one outcome of it
    assert table["expected_impact_velocity"].is_monotonic_decreasing
    assert (table["impact_velocity_exact"] > 0).tolist() == [True, True, False, False]


def test_ties_go_to_importance_then_occupants_then_name(station):
    rows = [{}, {"occupants_1": 10.0}, {"importance_2": 1.5}, {}]
    table = per_obspy.risk_table(station, make_pairs(rows))
    assert table["pair_id"].tolist() == ["P2", "P1", "P0", "P3"]


def test_risk_classes_follow_the_weighted_impact_velocity(station):
    velocity = _table(station, {})["weighted_velocity"].iloc[0]
    assert velocity > 0.0
    for share, name in ((0.9, "hard"), (1.1, "soft")):
        screening = Screening(classes={"hard": share * velocity, "soft": 0.0})
        table = per_obspy.risk_table(station, make_pairs([{}]), screening=screening)
        assert table["risk_class"].tolist() == [name]


def test_a_radius_far_above_the_displacement_is_flagged():
    # a velocity step: the long oscillator keeps its velocity, radius v T / 2 pi, and returns
    # through damping
    pulse = np.zeros(4000)
    pulse[100:110] = 10.0
    pulse[110:120] = -9.0
    station = make_station(longest=99.0)
    station["acceleration"][:] = np.stack([pulse, 0 * pulse])
    table = _table(station, {"period_1": 15.0, "damping_1": 0.9, "azimuth": 0.0})
    assert table.loc["P0", "per_1"] > 1.5 * table.loc["P0", "sd_1"]
    assert "per_far_above_sd" in table.loc["P0", "flags"].split()


@pytest.mark.parametrize(
    ("argument", "value", "message"),
    [
        ("pairs", None, "pairs must be a DataFrame from read_pairs, got NoneType"),
        ("pairs", [{}], "pairs must be a DataFrame from read_pairs, got list"),
        ("spectra", None, "spectra must be a Dataset from station_spectra, or a sequence"),
        ("spectra", "spectra.nc", "or a sequence of such, got str"),
        ("spectra", [None], r"spectra\[0\] must be a Dataset from station_spectra, got NoneType"),
        ("building", Screening(), "building must be a Building, got Screening"),
        ("screening", {}, "screening must be a Screening, got dict"),
    ],
)
def test_an_argument_of_another_type_is_named(station, argument, value, message):
    arguments = {"spectra": station, "pairs": make_pairs([{}])} | {argument: value}
    with pytest.raises(TypeError, match=message):
        per_obspy.risk_table(**arguments)


def test_pairs_without_columns_are_refused_by_their_names(station):
    # would catch an IndexError far behind the argument
    with pytest.raises(CatalogError, match="pairs: missing column gap, longitude_1"):
        per_obspy.risk_table(station, pd.DataFrame())
    with pytest.raises(CatalogError, match="pairs: missing column pair_id"):
        per_obspy.risk_table(station, make_pairs([{}]).drop(columns="pair_id"))
    with pytest.raises(CatalogError, match="table: the table has no rows"):
        per_obspy.read_pairs(pd.DataFrame())
    # A table whose rows were all rejected has no rows, and that is its result
    assert per_obspy.risk_table(station, make_pairs([{}]).iloc[:0]).empty
