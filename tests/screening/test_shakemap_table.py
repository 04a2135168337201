"""Pairs screened by a ShakeMap: values by hand, limits, and a Monte Carlo of the map's spectrum."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.special import ndtr
from screening_samples import make_pairs
from shakemap_samples import PERIODS, make_map

import per_obspy
from per_obspy.config import Building, Screening
from per_obspy.errors import Rejection
from per_obspy.inventory.completion import completed_pairs
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.reliability import sd_error
from per_obspy.records.shakemap import read_shakemap
from per_obspy.screening.columns import ORDER
from per_obspy.screening.meanings import FLAGS
from per_obspy.screening.shakemap import shakemap_rows


def _completed(rows):
    return completed_pairs(make_pairs(rows), Building())


def _rows(rows, shakemap=None, screening=None):
    """Return the rows of pairs under a map, and the rejections."""
    shakemap = make_map() if shakemap is None else shakemap
    return shakemap_rows(shakemap, _completed(rows), screening or Screening())


def _root_of_squares(row):
    return np.hypot(row["participation_1"] * row["sd_1"], row["participation_2"] * row["sd_2"])


#: Two oscillators of given damping on a node of the map.
GIVEN = {
    "longitude_2": 20.0,
    "latitude_1": 9.5,
    "latitude_2": 9.5,
    "damping_1": 0.05,
    "damping_2": 0.05,
    "participation_1": 1.0,
    "participation_2": 1.0,
}


def test_the_demand_by_hand():
    # on the middle southern node, PSA is twice 4, 2, 0.5; SD = PSA (T / 2 pi)^2
    table, rejected = _rows([{**GIVEN, "period_1": 0.3, "period_2": 1.0}])
    assert not rejected
    row = table.iloc[0]
    sd = 8.0 * (0.3 / 2 / np.pi) ** 2, 4.0 / (2 * np.pi) ** 2
    assert_allclose([row["sd_1"], row["sd_2"]], sd, rtol=1e-12)
    expected = critical_gap(*sd, ddc_correlation(0.3, 0.05, 1.0, 0.05))
    assert_allclose([row["demand"], row["critical_gap_sd"]], expected, rtol=1e-12)
    # the measure that needs no record
    assert_allclose(row["missing_gap"], max(expected - row["gap"], 0.0), rtol=1e-12)


def test_rows_name_the_map_and_leave_columns_of_records_empty():
    table, _ = _rows([GIVEN])
    row = table.iloc[0]
    flags = set(row["flags"].split())
    # the deviation of this map is assumed
    assert row["demand_rule"] == "shakemap"
    assert {"shakemap_demand", "shakemap_assumed_deviation"} <= flags <= set(FLAGS)
    assert {*ORDER} - {*table} == {"rank"}
    assert np.isnan(row["per_1"])
    assert row["station"] == ""


def _grid_xml(shakemap):
    """Return a map of PSA at 0.3, 1 and 3 s as the text of a ShakeMap grid."""
    fields = []
    for index, name in enumerate(("LON", "LAT", "PSA03", "PSA10", "PSA30"), start=1):
        unit = "dd" if index < 3 else "pctg"
        fields.append(f'<grid_field index="{index}" name="{name}" units="{unit}"/>')
    # nodes from north-west to south-east, PSA in per cent of g
    lines = []
    for north in shakemap["latitude"].values[::-1].tolist():
        for east in shakemap["longitude"].values.tolist():
            psa = shakemap["psa"].sel(latitude=north, longitude=east).to_numpy() / 0.0980665
            lines.append(" ".join(map(repr, [east, north, *psa.tolist()])))
    head = '<grid_specification nlat="2" nlon="3"/>' + "".join(fields)
    data = "\n".join(lines)
    return f"<shakemap_grid>{head}<grid_data>{data}\n</grid_data></shakemap_grid>"


def test_a_file_gives_what_its_map_gives(tmp_path):
    # from the text of a grid to the demand; would catch a unit or an axis that reader and screening
    # see differently
    (tmp_path / "grid.xml").write_text(_grid_xml(make_map()), encoding="utf-8")
    from_file, _ = _rows([{}, {"period_1": np.nan}], read_shakemap(tmp_path / "grid.xml"))
    from_map, _ = _rows([{}, {"period_1": np.nan}])
    for name in ("sd_1", "sd_2", "demand", "probability"):
        assert_allclose(from_file[name], from_map[name], rtol=1e-9)


def test_rows_have_the_columns_of_those_with_a_record(station):
    # chunks with and without such rows go into one file
    with_record = per_obspy.risk_table(station, make_pairs([{}]))
    table, _ = _rows([{}])
    assert {*table} == {*with_record} - {"rank"}


def test_damping_is_corrected_by_the_code():
    table, _ = _rows([GIVEN, {**GIVEN, "damping_1": 0.02}])
    usual, lower = table["sd_1"]
    assert_allclose(lower / usual, np.sqrt(10 / 7), rtol=1e-12)


def test_demands_scale_with_the_map_and_the_participation():
    # would catch: SD at contact height in the columns of the oscillators
    once, _ = _rows([GIVEN])
    shakemap = make_map()
    twice, _ = _rows([GIVEN], shakemap.assign(psa=shakemap["psa"] * 2.0))
    assert_allclose(twice["demand"], 2.0 * once["demand"], rtol=1e-12)
    share, _ = _rows([{**GIVEN, "participation_1": 2.0, "participation_2": 2.0}])
    assert_allclose(share["demand"], 2.0 * once["demand"], rtol=1e-12)
    assert_allclose(share["sd_1"], once["sd_1"], rtol=1e-12)


def test_order_of_the_buildings_does_not_matter():
    pair = {**GIVEN, "participation_1": 1.2, "gap": 0.03}
    exchanged = {
        **pair,
        "participation_1": 1.0,
        "participation_2": 1.2,
        "period_1": 0.6,
        "period_2": 1.0,
        "height_1": 18.0,
        "height_2": 30.0,
        "storeys_1": 6.0,
        "storeys_2": 10.0,
    }
    (first, _), (second, _) = _rows([pair]), _rows([exchanged])
    # integrals over the ratio and over its inverse, each to 1e-11
    for name in ("demand", "probability", "impact_velocity"):
        assert_allclose(first[name], second[name], rtol=1e-8)
    assert_allclose(first["amplification_1"], second["amplification_2"], rtol=1e-8)


def test_equal_periods_are_certain_only_if_they_are_given():
    # would catch: equal heights that make two buildings move as one
    given, _ = _rows([{**GIVEN, "period_2": 1.0, "gap": 0.001}])
    assert given["demand"].iloc[0] == pytest.approx(0.0, abs=1e-9)
    derived = {
        **GIVEN,
        "period_1": np.nan,
        "period_2": np.nan,
        "height_1": 18.0,
        "storeys_1": 6.0,
        "gap": 0.01,
    }
    table, _ = _rows([derived])
    row = table.iloc[0]
    assert_allclose(row["demand"], _root_of_squares(row), rtol=1e-12)
    assert row["demand"] > row["critical_gap_sd"]
    assert row["probability"] > 0.3


def test_the_deviation_of_the_map_makes_the_probability():
    # the larger building beside one that hardly moves: ln of the gap is normal, its deviation that
    # of the map and of the estimate, its median that of the estimate over its error
    still = {**GIVEN, "participation_2": 1e-4, "period_1": 1.0}
    row = _rows([still])[0].iloc[0]
    error = sd_error(1.0, row["damping_1"], row["period_2"], row["damping_2"])
    median = row["demand"] / error.median
    gaps = median * np.array([0.5, 1.0, 1.7])
    for log_std in (0.3, 0.7):
        table, _ = _rows([{**still, "gap": gap} for gap in gaps], make_map(log_std=log_std))
        expected = ndtr(np.log(median / gaps) / np.hypot(log_std, error.log_std))
        # the still building counts 1e-4
        assert_allclose(table["probability"], expected, atol=1e-3)
        assert "assumed" not in table["flags"].iloc[0]
    assumed, _ = _rows([{**still, "gap": gaps[2]}], screening=Screening(shakemap_log_std=0.7))
    assert_allclose(assumed["probability"], expected[2], atol=1e-3)


#: Buildings of 60 and 30 m and unknown periods on the middle southern node.
DERIVED = {
    "longitude_2": 20.0,
    "latitude_1": 9.5,
    "latitude_2": 9.5,
    "height_1": 60.0,
    "height_2": 30.0,
    "storeys_1": 20.0,
    "storeys_2": 10.0,
    "period_1": np.nan,
    "period_2": np.nan,
    "damping_1": 0.05,
    "damping_2": 0.03,
}


def _drawn_radius(row, i, count, random):
    """Return drawn periods of building i, and its radii at contact height by the map's spectrum."""
    deviation = row[f"period_log_std_{i}"] * random.normal(size=count)
    period = row[f"period_{i}"] * np.exp(deviation)
    # PSA of that node is 8, 4, 1 m/s2: SD is a power of the period between
    log_sd = np.log(np.array([8.0, 4.0, 1.0]) * (PERIODS / 2 / np.pi) ** 2)
    sd = np.exp(np.interp(np.log(period), np.log(PERIODS), log_sd))
    damped = sd * np.sqrt(10.0 / (5.0 + 100.0 * row[f"damping_{i}"]))
    return period, row[f"participation_{i}"] * damped


def test_derived_periods_against_monte_carlo():
    # the code's damping by hand; would catch a deviation of the map that is lost or
    # taken twice
    shakemap = make_map(log_std=0.5)
    gap = 0.8 * _root_of_squares(_rows([DERIVED], shakemap)[0].iloc[0])
    row = _rows([{**DERIVED, "gap": gap}], shakemap)[0].iloc[0]
    random, count = np.random.default_rng(2), 100_000
    motion = random.normal(size=count)
    period_1, radius_1 = _drawn_radius(row, 1, count, random)
    period_2, radius_2 = _drawn_radius(row, 2, count, random)
    # periods of these two agree so well that their errors of motion are nearly one
    gaps = critical_gap(radius_1, radius_2, ddc_correlation(period_1, 0.05, period_2, 0.03))
    # the medians and both deviations make the ratio of the periods
    ln_ratio = np.log(row["period_1"] / row["period_2"])
    apart = np.sqrt(ln_ratio**2 + row["period_log_std_1"] ** 2 + row["period_log_std_2"] ** 2)
    error = sd_error(1.0, 0.05, np.exp(apart), 0.03)
    closed = np.log(gaps / error.median / gap) + np.hypot(error.log_std, 0.5) * motion > 0
    # 128 quasi-random nodes (0.01); a deviation of the motion that is 0.9 of 0.5 changes the chance
    # by 0.01
    assert_allclose(row["probability"], closed.mean(), atol=0.02)
    assert 0.2 < row["probability"] < 0.9


def test_more_doubt_is_nearer_to_even():
    # gaps far below and far above the demand
    far = [{**GIVEN, "gap": gap} for gap in (0.01, 3.0)]
    maps = [make_map(log_std=std) for std in (0.1, 0.5, 1.0)]
    chances = np.array([_rows(far, shakemap)[0]["probability"] for shakemap in maps])
    assert (np.diff(chances[:, 0]) <= 0).all()
    assert (np.diff(chances[:, 1]) >= 0).all()
    assert (_rows([{**GIVEN, "gap": 0.0}])[0]["probability"] == 1.0).all()


def test_pairs_outside_are_rejected_with_the_value():
    # would catch: one reason per pair, latitude and longitude exchanged
    rows = [
        {},
        {"period_1": 0.2, "period_2": 3.5},
        {"latitude_1": 11.0, "latitude_2": 11.0},
        {"longitude_1": 30.0, "longitude_2": 30.0},
    ]
    table, rejected = _rows(rows)
    assert table["pair_id"].tolist() == ["P0"]
    periods, north, east = rejected
    assert periods.reasons == (
        "period_1 = 0.2 s is outside the ShakeMap's 0.3 to 3 s",
        "period_2 = 3.5 s is outside the ShakeMap's 0.3 to 3 s",
    )
    assert north.reasons == ("latitude = 11 is outside the ShakeMap's 9.5 to 10.5",)
    assert east.reasons == ("longitude = 30 is outside the ShakeMap's 19.5 to 20.5",)
    assert {(rejection.kind, rejection.source) for rejection in rejected} == {("pair", "grid.xml")}


def test_pairs_without_a_station_fall_back_on_the_map():
    # one is on the map, one is out of reach of both: it has both reasons
    pairs = _completed([{}, {}, {"latitude_1": 12.0, "latitude_2": 12.0}])
    reason = "nearest station XX.ONE is 99999 m away, beyond 20000 m"
    far = tuple(Rejection("pair", name, "", None, (reason,)) for name in ("P1", "P2"))
    table, (rejection,) = shakemap_rows(make_map(), pairs.iloc[1:], Screening(), far)
    assert table["pair_id"].tolist() == ["P1"]
    assert rejection.name == "P2"
    assert rejection.reasons == (reason, "latitude = 12 is outside the ShakeMap's 9.5 to 10.5")


def test_a_map_without_motion_has_no_rows():
    shakemap = make_map()
    table, (rejection,) = _rows([{}], shakemap.assign(psa=shakemap["psa"] * 0.0))
    assert table.empty
    assert {*ORDER} - {*table} == {"rank"}
    assert rejection.reasons == ("the ShakeMap has no motion there",)


def test_a_map_across_the_date_line_and_a_scenario():
    # would catch: a longitude of -179.9 that is outside a map up to 180.2
    pacific = make_map((179.8, 180.0, 180.2), shakemap_event_type="SCENARIO")
    table, rejected = _rows([{**GIVEN, "longitude_1": -179.9, "longitude_2": -179.9}], pacific)
    plain, _ = _rows([{**GIVEN, "longitude_1": 20.25, "longitude_2": 20.25}])
    assert not rejected
    assert_allclose(table["demand"], plain["demand"], rtol=1e-9)
    assert "simulated" in table["flags"].iloc[0].split()
    assert "simulated" not in plain["flags"].iloc[0].split()


def _scattered_rows(count):
    """Return pairs all over the map, with derived periods wherever the drawn one is short."""
    random = np.random.default_rng(4)
    longitudes = random.uniform(19.5, 20.5, count)
    latitudes = random.uniform(9.5, 10.5, count)
    periods = random.uniform(0.3, 1.2, count)
    # the derived period of 60 m is inside the map's
    rows = []
    for longitude, latitude, period in zip(longitudes, latitudes, periods, strict=True):
        row = {"height_1": 60.0, "storeys_1": 20.0}
        row |= {"longitude_1": longitude, "longitude_2": longitude}
        row |= {"latitude_1": latitude, "latitude_2": latitude}
        rows.append(row | {"period_1": period if period > 0.6 else np.nan})
    return rows


def test_rows_depend_on_no_other_row():
    # to the bit; would catch a matrix product over the rows
    pairs = _completed(_scattered_rows(40))
    together, _ = shakemap_rows(make_map(), pairs, Screening())
    assert len(together) == 40
    # alone, in part, and in the reverse order
    for part in (slice(0, 1), slice(7, 30), slice(None, None, -1)):
        rows, _ = shakemap_rows(make_map(), pairs.iloc[part], Screening())
        expected = together.iloc[part].reset_index(drop=True)
        pd.testing.assert_frame_equal(rows, expected, check_exact=True)
