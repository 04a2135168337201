"""The probability of a pair: limits, and a plain Monte Carlo that shares only the stored spectra."""

import numpy as np
from numpy.testing import assert_allclose
from screening_samples import make_pairs, make_station

import per_obspy
from per_obspy.config import Screening
from per_obspy.screening.by_record.stored_spectra import log_spectra, stored_log
from per_obspy.screening.by_record.yielding import linearized_columns
from per_obspy.screening.uncertainty.pair_motion import period_correlation
from per_obspy.screening.uncertainty.probability import NODES, pair_probability

#: Of the critical gap by PER over the exact one.
MEDIAN = Screening().model_median


def _one(station, **row):
    return per_obspy.risk_table(station, make_pairs([row])).iloc[0]


def test_nodes_are_those_of_independent_standard_normal_variables():
    # 128 quasi-random nodes: mean, variance and covariance within a few hundredths
    assert_allclose(NODES.mean(axis=0), 0, atol=0.03)
    assert_allclose(np.cov(NODES.T), np.eye(4), atol=0.08)


def test_stored_spectra_are_met_at_their_grid_points(station):
    periods = np.log(station["period"].to_numpy()[[3, 20, 59]])
    stored = stored_log(log_spectra(station), np.full(3, 4), periods, np.full(3, np.log(0.05)))
    expected = np.log(
        station["per_azimuthal"].sel(azimuth=40.0, damping=0.05).to_numpy()[[3, 20, 59]]
    )
    assert_allclose(stored, expected, rtol=1e-6)  # float32


def test_given_buildings_and_an_exact_demand_leave_no_doubt(station):
    # at the station itself, where the motion is the record's
    given = {"damping_1": 0.05, "damping_2": 0.05, "longitude_1": 19.9999, "longitude_2": 20.0001}
    demand = _one(station, **given)["demand"]
    assert _one(station, **given, gap=0.99 * demand)["probability"] == 1.0
    assert _one(station, **given, gap=1.01 * demand)["probability"] == 0.0


def test_doubt_about_the_gap_is_even_where_gap_and_demand_are_equal(station):
    given = {"damping_1": 0.05, "damping_2": 0.05}
    demand = _one(station, **given)["demand"]
    probability = _one(station, **given, gap=demand, gap_std=0.2 * demand)["probability"]
    # the gap's median is below its mean by half the variance of its logarithm: slightly more than
    # one half
    assert 0.5 < probability < 0.56


def test_an_estimate_is_even_where_the_gap_is_the_exact_one_of_its_median():
    # would catch: a bias that widens the demand, or none
    station = make_station(channels=("HNN",))  # of one horizontal no demand is exact
    given = {"damping_1": 0.05, "damping_2": 0.05}
    found = _one(station, **given)
    assert found["demand_rule"] != "exact"
    table, even, _ = _with_motion(station, [{**given, "gap": found["demand"] / MEDIAN}])
    assert table["demand_rule"][0] == found["demand_rule"]
    assert_allclose(even, 0.5, atol=1e-9)


def test_where_equivalent_buildings_decide_the_elastic_ones_do_not_count(station):
    # would catch: resampling about elastic radii a pair whose demand is that of equivalent linear
    # buildings
    weak = {
        "period_1": 0.2,
        "period_2": np.nan,
        "height_2": 9.0,
        "storeys_2": 3.0,
        "yield_displacement_1": 2e-4,
    }
    table, plain, _ = _with_motion(station, [{**weak, "gap": 0.05}])
    assert table["demand_rule"][0] == "linearized"
    assert 0.05 < plain[0] < 0.95
    assert pair_probability(station, table.assign(per_1=9.0, per_2=9.0), Screening())[0] == plain[0]
    assert pair_probability(station, table.assign(equivalent_per_1=9.0), Screening())[0] > plain[0]


def test_more_gap_is_less_likely_to_close(station):
    derived = {"period_1": np.nan, "period_2": np.nan}
    chances = [
        _one(station, **derived, gap=gap)["probability"] for gap in (0.0, 0.02, 0.1, 0.3, 1.0, 5.0)
    ]
    assert chances[0] == 1.0
    assert np.all(np.diff(chances) <= 0)
    assert chances[-1] < 0.01


def test_equal_derived_buildings_that_touch_always_pound(station):
    # would catch: nodes at which both are exactly equal, which move as one (0.984 with the first
    # 128 Sobol points)
    derived = {"period_1": np.nan, "period_2": np.nan, "height_1": 18.0, "storeys_1": 6.0}
    assert _one(station, **derived, gap=0.0)["probability"] == 1.0
    # a gap of a tenth of a millimetre is closed wherever periods differ by more than rounding
    assert _one(station, **derived, gap=1e-4)["probability"] > 0.995


def test_equal_derived_buildings_against_monte_carlo(station):
    # would catch: both periods resampled together, which keeps equal buildings in step and the
    # probability at 0
    derived = {"period_1": np.nan, "period_2": np.nan, "height_1": 18.0, "storeys_1": 6.0}
    probe = _one(station, **derived, gap=1.0)
    gap = 0.6 * probe["srss_gap"]
    row = _one(station, **derived, gap=gap)
    random = np.random.default_rng(11)
    n = 40_000
    radii, periods, dampings = [], [], []
    azimuth = np.full(n, round(row["azimuth_used"] / 10.0), dtype=int)
    for i in (1, 2):
        period = np.log(row[f"period_{i}"]) + random.normal(size=n) * row[f"period_log_std_{i}"]
        damping = np.log(0.05) + random.normal(size=n) * 0.3
        median = stored_log(
            log_spectra(station), azimuth[:1], np.log([row[f"period_{i}"]]), np.log([0.05])
        )
        change = stored_log(log_spectra(station), azimuth, period, damping) - median
        radii.append(row[f"participation_{i}"] * row[f"per_{i}"] * np.exp(change))
        periods.append(np.exp(period))
        dampings.append(np.exp(damping))
    rho = per_obspy.ddc_correlation(periods[0], dampings[0], periods[1], dampings[1])
    critical = per_obspy.critical_gap(*radii, rho) / MEDIAN * np.exp(0.35 * random.normal(size=n))
    # 128 quasi-random nodes in four dimensions against 40 000 samples (standard error 0.0025)
    assert_allclose(row["probability"], np.mean(critical > gap), atol=0.02)


def _with_motion(station, rows, ratio_1=0.0, ratio_2=0.0, std_1=0.0, std_2=0.0):
    """Return the probabilities of rows without and with a motion at the site."""
    table = per_obspy.risk_table(station, make_pairs(rows))
    table = table.drop(columns=[name for name in table if name.startswith("ln_per_")])
    columns = {
        "ln_per_ratio_1": ratio_1,
        "ln_per_ratio_2": ratio_2,
        "ln_per_std_1": std_1,
        "ln_per_std_2": std_2,
    }
    table = table.assign(**linearized_columns(station, table))
    return table, *(
        pair_probability(station, one, Screening()) for one in (table, table.assign(**columns))
    )


#: Every way to a probability: exact demand, radii of a yielding pair outside the usable periods,
#: derived periods.
EVERY_WAY = ({}, {"period_1": 9.5}, {"period_1": np.nan, "period_2": np.nan})


def test_a_site_at_the_station_changes_nothing(station):
    # to the bit: runs without a field of stations give the same
    _, without, at_station = _with_motion(
        station, [{**way, "gap": 0.1, "gap_std": 0.03} for way in EVERY_WAY]
    )
    assert np.array_equal(without, at_station)
    _, without, unknown = _with_motion(station, list(EVERY_WAY), np.nan, np.nan, np.nan, np.nan)
    assert np.array_equal(without, unknown)


def test_motion_times_two_is_a_gap_of_half(station):
    # the certain motion at the site against a gap that is narrower by as much, in every way to a
    # probability; would catch a ratio upside down or one that moves a single building
    for way in EVERY_WAY:
        _, plain, twice = _with_motion(
            station, [{**way, "gap": 0.2, "gap_std": 0.04}], np.log(2.0), np.log(2.0)
        )
        _, narrow, _ = _with_motion(station, [{**way, "gap": 0.1, "gap_std": 0.02}])
        assert_allclose(twice, narrow, rtol=1e-6)
        assert twice[0] > plain[0] or twice[0] == 1.0


def test_a_site_whose_motion_nobody_knows_is_even_at_the_demand(station):
    # a gap that equals the exact demand is closed or not with even chances whatever the deviation;
    # wider gaps are less safe and narrower ones less certain the less is known
    given = {"damping_1": 0.05, "damping_2": 0.05}
    demand = _one(station, **given)["demand"]
    rows = [{**given, "gap": share * demand} for share in (0.7, 1.0, 1.3)]
    chances = np.array(
        [_with_motion(station, rows, 0.0, 0.0, std, std)[2] for std in (0.1, 0.4, 0.8)]
    )
    table = per_obspy.risk_table(station, make_pairs(rows))
    order = np.argsort(table["gap"].to_numpy())
    narrow, even, wide = chances[:, order].T
    assert_allclose(even, 0.5, atol=1e-9)
    assert np.all(np.diff(narrow) < 0)
    assert np.all(np.diff(wide) > 0)


def test_radii_at_the_site_against_monte_carlo():
    # one motion moves both radii, with the correlation of their periods; would catch deviations
    # taken as independent (0.03 away) or lost of one horizontal no demand is exact
    station = make_station(channels=("HNN",))
    row = {"damping_1": 0.05, "damping_2": 0.05}
    gap = 1.5 * _one(station, **row)["demand"]
    table, _, got = _with_motion(station, [{**row, "gap": gap}], 0.3, 0.1, 0.5, 0.6)
    one = table.iloc[0]
    assert one["demand_rule"] != "exact"
    random = np.random.default_rng(5)
    shared = float(period_correlation(1.0, 0.6))
    normal = random.multivariate_normal([0.0, 0.0], [[1.0, shared], [shared, 1.0]], 200_000)
    radii = [
        one[f"participation_{i}"] * one[f"per_{i}"] * np.exp(ratio + std * normal[:, i - 1])
        for i, ratio, std in ((1, 0.3, 0.5), (2, 0.1, 0.6))
    ]
    name = "correlation_record" if one["demand_rule"] == "per_record" else "correlation"
    critical = (
        per_obspy.critical_gap(*radii, one[name])
        / MEDIAN
        * np.exp(0.35 * random.normal(size=200_000))
    )
    # standard error of 200 000 samples: 0.0011
    assert_allclose(got[0], np.mean(critical > gap), atol=0.005)
