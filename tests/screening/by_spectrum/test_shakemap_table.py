"""Pairs judged by a ShakeMap: values by hand, limits, and a Monte Carlo that shares only the map's spectrum."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from scipy.special import ndtr
from screening_samples import make_pairs

import per_obspy
from per_obspy.config import Building, Screening
from per_obspy.errors import Rejection
from per_obspy.inventory.completion import completed_pairs
from per_obspy.pounding.correlation.white_noise import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.records.shakemap import read_shakemap
from per_obspy.screening.by_spectrum.shakemap_motion import damping_factor, motion_on_map
from per_obspy.screening.by_spectrum.shakemap_table import shakemap_fallback, shakemap_rows
from per_obspy.screening.columns import FLAGS, ORDER

PERIODS = np.array([0.3, 1.0, 3.0])


def make_map(longitudes=(19.5, 20.0, 20.5), log_std=None, **attributes):
    """Return a map whose PSA is 4, 2, 0.5 m/s2 in the south and three times that in the north, rising to the east."""
    latitude, longitude = np.array([9.5, 10.5]), np.array(longitudes)
    place = np.array([[1.0], [3.0]]) * (1.0 + np.arange(longitude.size))
    psa = np.array([4.0, 2.0, 0.5])[:, None, None] * place
    grid = xr.Dataset(
        {"psa": (("period", "latitude", "longitude"), psa)},
        coords={"period": PERIODS, "latitude": latitude, "longitude": longitude},
        attrs={"source": "grid.xml", **attributes},
    )
    if log_std is not None:
        grid["psa_log_std"] = (("period", "latitude", "longitude"), np.full(psa.shape, log_std))
    return grid


def _completed(rows):
    return completed_pairs(make_pairs(rows), Building())


def _rows(rows, shakemap=None, screening=None):
    return shakemap_rows(
        make_map() if shakemap is None else shakemap, _completed(rows), screening or Screening()
    )


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
    assert_allclose(row["missing_gap"], max(expected - row["gap"], 0.0), rtol=1e-12)
    assert row["demand_rule"] == "shakemap"
    assert {"shakemap_demand", "shakemap_assumed_deviation"} <= set(row["flags"].split())
    assert set(row["flags"].split()) <= set(FLAGS)
    assert {*ORDER} - {*table} == {"rank"}
    assert np.isnan(row["per_1"])
    assert row["station"] == ""


def test_a_file_gives_what_its_map_gives(tmp_path):
    # from the text of a grid to the demand; would catch a unit or an axis that reader and screening
    # see differently
    shakemap = make_map()
    names = ("LON", "LAT", "PSA03", "PSA10", "PSA30")
    fields = "".join(
        f'<grid_field index="{i}" name="{name}" units="{"dd" if i < 3 else "pctg"}"/>'
        for i, name in enumerate(names, start=1)
    )
    table = "".join(
        f"{east!r} {north!r} {' '.join(repr(value / 0.0980665) for value in node['psa'].values.tolist())}\n"
        for north in shakemap["latitude"].values[::-1].tolist()
        for east in shakemap["longitude"].values.tolist()
        for node in [shakemap.sel(latitude=north, longitude=east)]
    )
    head = '<grid_specification nlat="2" nlon="3"/>'
    text = f"<shakemap_grid>{head}{fields}<grid_data>{table}</grid_data></shakemap_grid>"
    (tmp_path / "grid.xml").write_text(text, encoding="utf-8")
    from_file, _ = _rows([{}, {"period_1": np.nan}], read_shakemap(tmp_path / "grid.xml"))
    from_map, _ = _rows([{}, {"period_1": np.nan}])
    for name in ("sd_1", "sd_2", "demand", "probability"):
        assert_allclose(from_file[name], from_map[name], rtol=1e-9)


def test_rows_have_the_columns_of_those_with_a_record(station):
    # chunks with and without such rows go into one file
    with_record = per_obspy.risk_table(station, make_pairs([{}]))
    table, _ = _rows([{}])
    assert {*table} == {*with_record} - {"rank"}


def test_between_nodes_it_is_bilinear_and_between_periods_a_power():
    # would catch longitude and latitude exchanged, and periods on a linear axis
    shakemap = make_map()
    motion = motion_on_map(shakemap, np.array([19.75, 20.0]), np.array([9.5, 10.0]), 0.6)
    assert_allclose(
        np.exp(motion.ln_sd[:, 1]) * (2 * np.pi) ** 2, [2.0 * 1.5, 2.0 * 2.0 * 2.0], rtol=1e-12
    )
    # SD of 8 m/s2 at 0.3 s and 4 at 1 s: a power of the period between
    power = np.log(4.0 / 8.0 / 0.3**2) / np.log(1 / 0.3)
    table, _ = _rows([{**GIVEN, "period_1": 0.55, "period_2": 1.0}])
    assert_allclose(
        table["sd_1"].iloc[0], 8.0 * (0.3 / 2 / np.pi) ** 2 * (0.55 / 0.3) ** power, rtol=1e-12
    )


def test_damping_is_corrected_by_the_code():
    # EN 1998-1 (3.6): sqrt(10 / 7) at 2 %, 0.55 at least
    assert_allclose(
        damping_factor(np.array([0.05, 0.02, 0.28, 0.6])),
        [1.0, np.sqrt(10 / 7), 0.55, 0.55],
        rtol=1e-2,
    )
    table, _ = _rows([GIVEN, {**GIVEN, "damping_1": 0.02}])
    assert_allclose(table["sd_1"].iloc[1] / table["sd_1"].iloc[0], np.sqrt(10 / 7), rtol=1e-12)


def test_demands_scale_with_the_map_and_the_participation():
    once, _ = _rows([GIVEN])
    shakemap = make_map()
    twice, _ = _rows([GIVEN], shakemap.assign(psa=shakemap["psa"] * 2.0))
    assert_allclose(twice["demand"], 2.0 * once["demand"], rtol=1e-12)
    share, _ = _rows([{**GIVEN, "participation_1": 2.0, "participation_2": 2.0}])
    assert_allclose(share["demand"], 2.0 * once["demand"], rtol=1e-12)
    assert_allclose(share["sd_1"], once["sd_1"], rtol=1e-12)


def test_order_of_the_buildings_does_not_matter():
    one = {**GIVEN, "participation_1": 1.2, "gap": 0.03}
    other = {
        name[:-1] + {"1": "2", "2": "1"}[name[-1]] if name[-2:] in ("_1", "_2") else name: value
        for name, value in one.items()
    }
    other |= {
        "period_1": 0.6,
        "period_2": 1.0,
        "height_1": 18.0,
        "height_2": 30.0,
        "storeys_1": 6.0,
        "storeys_2": 10.0,
    }
    (first, _), (second, _) = _rows([one]), _rows([{**other, "longitude_2": 20.0}])
    # integrals over the ratio and over its inverse, each to 1e-11
    for name in ("demand", "probability", "impact_velocity"):
        assert_allclose(first[name], second[name], rtol=1e-8)
    assert_allclose(first["amplification_1"], second["amplification_2"], rtol=1e-8)


def test_equal_periods_are_certain_only_if_they_are_given():
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
    # of the map and of the estimate, its median that of the estimate over 0.97
    still = {**GIVEN, "participation_2": 1e-4, "period_1": 1.0}
    demand = _rows([still])[0]["demand"].iloc[0]
    gaps = demand / 0.97 * np.array([0.5, 1.0, 1.7])
    for log_std in (0.3, 0.7):
        table, _ = _rows([{**still, "gap": gap} for gap in gaps], make_map(log_std=log_std))
        expected = ndtr(np.log(demand / 0.97 / gaps) / np.hypot(log_std, 0.14))
        # the still building counts 1e-4
        assert_allclose(table["probability"], expected, atol=1e-3)
        assert "assumed" not in table["flags"].iloc[0]
    assumed, _ = _rows([{**still, "gap": gaps[2]}], screening=Screening(shakemap_log_std=0.7))
    assert_allclose(assumed["probability"], expected[2], atol=1e-3)


def test_derived_periods_against_monte_carlo():
    # 0.97, 0.14 and the code's damping by hand; would catch a deviation of the map that is lost or taken twice
    derived = {
        "period_1": np.nan,
        "period_2": np.nan,
        "damping_1": 0.05,
        "damping_2": 0.03,
        "latitude_1": 9.5,
        "latitude_2": 9.5,
    }
    derived |= {
        "height_1": 60.0,
        "height_2": 30.0,
        "longitude_2": 20.0,
        "storeys_1": 20.0,
        "storeys_2": 10.0,
    }
    shakemap = make_map(log_std=0.5)
    gap = 0.8 * _root_of_squares(_rows([derived], shakemap)[0].iloc[0])
    row = _rows([{**derived, "gap": gap}], shakemap)[0].iloc[0]
    random, n = np.random.default_rng(2), 100_000
    sd = np.array([8.0, 4.0, 1.0]) * (PERIODS / 2 / np.pi) ** 2
    motion, radii, periods = random.normal(size=n), [], []
    for i in (1, 2):
        periods.append(
            row[f"period_{i}"] * np.exp(row[f"period_log_std_{i}"] * random.normal(size=n))
        )
        told = np.exp(np.interp(np.log(periods[-1]), np.log(PERIODS), np.log(sd)))
        radii.append(
            row[f"participation_{i}"]
            * told
            * np.sqrt(10.0 / (5.0 + 100.0 * row[f"damping_{i}"]))
            / 0.97
        )
    # periods of these two agree so well that their errors of motion are nearly one
    gaps = critical_gap(*radii, ddc_correlation(periods[0], 0.05, periods[1], 0.03))
    closed = np.log(gaps / gap) + np.hypot(0.14, 0.5) * motion > 0
    # 128 quasi-random nodes (0.01); a deviation of the motion that is 0.9 of 0.5 changes the chance
    # by 0.01
    assert_allclose(row["probability"], closed.mean(), atol=0.02)
    assert 0.2 < row["probability"] < 0.9


def test_more_doubt_is_nearer_to_even():
    far = [{**GIVEN, "gap": gap} for gap in (0.01, 3.0)]
    chances = np.array(
        [_rows(far, make_map(log_std=std))[0]["probability"] for std in (0.1, 0.5, 1.0)]
    )
    assert (np.diff(chances[:, 0]) <= 0).all()
    assert (np.diff(chances[:, 1]) >= 0).all()
    assert (_rows([{**GIVEN, "gap": 0.0}])[0]["probability"] == 1.0).all()


def test_pairs_outside_are_rejected_with_the_value():
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
    assert {one.source for one in rejected} == {"grid.xml"}
    assert all(one.kind == "pair" for one in rejected)


def test_pairs_without_a_station_fall_back_on_the_map():
    # one has a station, one is on the map, one is out of reach of both: it says why in both words
    pairs = _completed([{}, {}, {"latitude_1": 12.0, "latitude_2": 12.0}])
    station = Rejection(
        "pair", "", "", None, ("nearest station XX.ONE is 99999 m away, beyond 20000 m",)
    )
    far = (station._replace(name="P1"), station._replace(name="P2"))
    table, (lost,) = shakemap_fallback(make_map(), pairs, far, Screening())
    assert table["pair_id"].tolist() == ["P1"]
    assert lost.name == "P2"
    assert lost.reasons == (*station.reasons, "latitude = 12 is outside the ShakeMap's 9.5 to 10.5")


def test_a_map_without_motion_judges_nothing():
    shakemap = make_map()
    table, (still,) = _rows([{}], shakemap.assign(psa=shakemap["psa"] * 0.0))
    assert table.empty
    assert {*ORDER} - {*table} == {"rank"}
    assert still.reasons == ("the ShakeMap has no motion there",)


def test_a_map_across_the_date_line_and_a_scenario():
    here = make_map((179.8, 180.0, 180.2), shakemap_event_type="SCENARIO")
    table, rejected = _rows([{**GIVEN, "longitude_1": -179.9, "longitude_2": -179.9}], here)
    plain, _ = _rows([{**GIVEN, "longitude_1": 20.25, "longitude_2": 20.25}])
    assert not rejected
    assert_allclose(table["demand"], plain["demand"], rtol=1e-9)
    assert "simulated" in table["flags"].iloc[0].split()
    assert "simulated" not in plain["flags"].iloc[0].split()


def test_rows_depend_on_no_other_row():
    # to the bit; would catch a matrix product over the rows
    random = np.random.default_rng(4)
    rows = [
        {
            "longitude_1": longitude,
            "longitude_2": longitude,
            "latitude_1": latitude,
            "latitude_2": latitude,
            "period_1": period if period > 0.6 else np.nan,
            "height_1": 60.0,
            "storeys_1": 20.0,
        }
        for longitude, latitude, period in zip(
            *(random.uniform(*s, 40) for s in ((19.5, 20.5), (9.5, 10.5), (0.3, 1.2))), strict=True
        )
    ]
    pairs = _completed(rows)
    together, _ = shakemap_rows(make_map(), pairs, Screening())
    assert len(together) == 40
    for some in (slice(0, 1), slice(7, 30), slice(None, None, -1)):
        apart, _ = shakemap_rows(make_map(), pairs.iloc[some], Screening())
        pd.testing.assert_frame_equal(
            apart, together.iloc[some].reset_index(drop=True), check_exact=True
        )
