"""Population by estimates: limits, and Monte Carlo estimates that share only the stored spectra."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from screening_samples import make_pairs, make_station

import per_obspy
from per_obspy.config import Screening
from per_obspy.pounding.reliability import per_error
from per_obspy.screening.estimates import linearized_columns
from per_obspy.screening.exact_population import record_population
from per_obspy.screening.station_motion import station_motion, stored_log
from per_obspy.screening.uncertain_motion import period_correlation


def _row(station, **row):
    """Return the row of a pair in the risk table."""
    return per_obspy.risk_table(station, make_pairs([row])).iloc[0]


def _probability(station, table):
    """Return the probabilities of rows of the risk table."""
    return record_population(station_motion(station), table, Screening())["probability"]


def test_given_buildings_and_an_exact_demand_leave_no_doubt(station):
    # at the station itself, where the motion is the record's
    given = {"damping_1": 0.05, "damping_2": 0.05, "longitude_1": 19.9999, "longitude_2": 20.0001}
    demand = _row(station, **given)["demand"]
    assert _row(station, **given, gap=0.99 * demand)["probability"] == 1.0
    assert _row(station, **given, gap=1.01 * demand)["probability"] == 0.0


def test_doubt_about_the_gap_is_even_where_gap_and_demand_are_equal(station):
    given = {"damping_1": 0.05, "damping_2": 0.05}
    demand = _row(station, **given)["demand"]
    probability = _row(station, **given, gap=demand, gap_std=0.2 * demand)["probability"]
    # the gap's median is below its mean by half the variance of its logarithm: slightly more than
    # one half
    assert 0.5 < probability < 0.56


def test_an_estimate_is_even_where_the_gap_is_the_exact_one_of_its_median():
    # would catch: a bias that widens the demand, or none
    station = make_station(channels=("HNN",))  # of one horizontal no demand is exact
    given = {"damping_1": 0.05, "damping_2": 0.05}
    row = _row(station, **given)
    assert row["demand_rule"] != "exact"
    table, even, _ = _with_motion(
        station, [{**given, "gap": row["demand"] / per_error(1.0, 0.05, 0.6, 0.05).median}]
    )
    assert table["demand_rule"][0] == row["demand_rule"]
    assert_allclose(even, 0.5, atol=1e-9)


def test_where_equivalent_buildings_decide_the_elastic_ones_do_not_count():
    # would catch: resampling about elastic radii a pair whose demand is that of equivalent linear
    # buildings
    weak = {
        "period_1": 0.2,
        "period_2": np.nan,
        "height_2": 9.0,
        "storeys_2": 3.0,
        "yield_displacement_1": 2e-4,
    }
    station = make_station(channels=("HNN",))  # one horizontal: the record drives no nodes
    table, plain, _ = _with_motion(station, [{**weak, "gap": 0.05}])
    assert table["demand_rule"][0] == "linearized"
    assert 0.05 < plain[0] < 0.95
    assert _probability(station, table.assign(per_1=9.0, per_2=9.0))[0] == plain[0]
    assert _probability(station, table.assign(equivalent_per_1=9.0))[0] > plain[0]


def test_more_gap_is_less_likely_to_close(station):
    derived = {"period_1": np.nan, "period_2": np.nan}
    gaps = (0.0, 0.02, 0.1, 0.3, 1.0, 5.0)
    chances = [_row(station, **derived, gap=gap)["probability"] for gap in gaps]
    assert chances[0] == 1.0
    assert np.all(np.diff(chances) <= 0)
    assert chances[-1] < 0.01


def test_equal_derived_buildings_that_touch_always_pound(station):
    # would catch: nodes at which both are exactly equal, which move as one (0.984 with the first
    # 128 Sobol points)
    derived = {"period_1": np.nan, "period_2": np.nan, "height_1": 18.0, "storeys_1": 6.0}
    assert _row(station, **derived, gap=0.0)["probability"] == 1.0
    # a gap of a tenth of a millimetre is closed wherever periods differ by more than rounding
    assert _row(station, **derived, gap=1e-4)["probability"] > 0.995


def _drawn_oscillators(station, row, i, deviates, random):
    """Return drawn periods, dampings and radii of building i, by the stored spectra."""
    count = deviates.size
    spectra = station_motion(station).per
    azimuth = np.zeros(count, dtype=int)  # of the only horizontal
    # both are lognormal
    median_period, median_damping = np.log([row[f"period_{i}"]]), np.log([0.05])
    period = median_period + deviates * row[f"period_log_std_{i}"]
    damping = median_damping + random.normal(size=count) * 0.3
    # PER of the row, changed as the stored spectrum is
    median = stored_log(spectra, azimuth[:1], median_period, median_damping)
    change = np.exp(stored_log(spectra, azimuth, period, damping) - median)
    radius = row[f"participation_{i}"] * row[f"per_{i}"] * change
    return np.exp(period), np.exp(damping), radius


@pytest.mark.parametrize("shared", [0.0, 0.655, 0.85])
def test_equal_derived_buildings_against_monte_carlo(shared):
    # would catch: both periods resampled together, which keeps equal buildings in step and the
    # probability at 0
    derived = {"period_1": np.nan, "period_2": np.nan, "height_1": 18.0, "storeys_1": 6.0}
    station = make_station(channels=("HNN",))  # one horizontal: the record drives no nodes
    gap = 0.6 * _row(station, **derived, gap=1.0)["srss_gap"]
    row = _row(station, **derived, gap=gap, period_correlation=shared)
    random, count = np.random.default_rng(11), 40_000
    # a bivariate normal distribution of both ln periods
    covariance = [[1.0, shared], [shared, 1.0]]
    first, second = random.multivariate_normal([0.0, 0.0], covariance, count).T
    period_1, damping_1, radius_1 = _drawn_oscillators(station, row, 1, first, random)
    period_2, damping_2, radius_2 = _drawn_oscillators(station, row, 2, second, random)
    correlation = per_obspy.ddc_correlation(period_1, damping_1, period_2, damping_2)
    # equal medians, whose ratio has the log-standard deviation of the difference of both
    first, second = (row[f"period_log_std_{i}"] * normal for i, normal in ((1, first), (2, second)))
    apart = np.exp(np.std(first - second))
    error = per_error(1.0, 0.05, apart, 0.05)
    exact = per_obspy.critical_gap(radius_1, radius_2, correlation) / error.median
    critical = exact * np.exp(error.log_std * random.normal(size=count))
    # 128 quasi-random nodes in four dimensions against 40 000 samples (standard error 0.0025)
    assert_allclose(row["probability"], np.mean(critical > gap), atol=0.02)


def _with_motion(station, rows, ratios=(0.0, 0.0), stds=(0.0, 0.0)):
    """Return rows of the risk table, and their probabilities without and with motion at a site."""
    table = per_obspy.risk_table(station, make_pairs(rows))
    table = table.drop(columns=[name for name in table if name.startswith("ln_per_")])
    table = table.assign(**linearized_columns(station_motion(station), table))
    # the same motion at the site of every pair
    at_site = table.assign(
        distance=0.0,
        ln_per_ratio_1=ratios[0],
        ln_per_ratio_2=ratios[1],
        ln_per_std_1=stds[0],
        ln_per_std_2=stds[1],
    )
    return table, _probability(station, table), _probability(station, at_site)


#: Every way to a probability: exact demand, radii of a yielding pair outside the usable periods,
#: derived periods.
EVERY_WAY = ({}, {"period_1": 9.5}, {"period_1": np.nan, "period_2": np.nan})


UNKNOWN = (np.nan, np.nan)


def test_a_site_at_the_station_changes_no_probability(station):
    # to the bit: runs without a field of stations give the same
    rows = [{**way, "gap": 0.1, "gap_std": 0.03} for way in EVERY_WAY]
    _, without, at_station = _with_motion(station, rows)
    assert np.array_equal(without, at_station)
    _, without, unknown = _with_motion(station, list(EVERY_WAY), UNKNOWN, UNKNOWN)
    assert np.array_equal(without, unknown)


def test_motion_times_two_is_a_gap_of_half(station):
    # the certain motion at the site against a gap that is narrower by as much, in every way to a
    # probability; would catch a ratio upside down or one that moves a single building
    doubled = np.log(2.0), np.log(2.0)
    for way in EVERY_WAY:
        wide, narrow = {**way, "gap": 0.2, "gap_std": 0.04}, {**way, "gap": 0.1, "gap_std": 0.02}
        _, plain, twice = _with_motion(station, [wide], doubled)
        _, half, _ = _with_motion(station, [narrow])
        assert_allclose(twice, half, rtol=1e-6)
        assert twice[0] > plain[0] or twice[0] == 1.0


def test_a_site_of_unknown_motion_is_even_at_the_demand(station):
    # a gap that equals the exact demand is closed or not with even chances whatever the deviation;
    # wider gaps are less safe and narrower ones less certain the less is known
    given = {"damping_1": 0.05, "damping_2": 0.05}
    demand = _row(station, **given)["demand"]
    rows = [{**given, "gap": share * demand} for share in (0.7, 1.0, 1.3)]
    chances = []
    for std in (0.1, 0.4, 0.8):
        table, _, at_site = _with_motion(station, rows, stds=(std, std))
        chances.append(at_site[np.argsort(table["gap"].to_numpy())])
    narrow, even, wide = np.transpose(chances)
    assert_allclose(even, 0.5, atol=1e-9)
    assert np.all(np.diff(narrow) < 0)
    assert np.all(np.diff(wide) > 0)


def _drawn_radii(row, ratios, stds, count, random):
    """Return drawn radii of both buildings at a site, correlated as periods of 1 and 0.6 s are."""
    shared = float(period_correlation(1.0, 0.6))
    covariance = [[1.0, shared], [shared, 1.0]]
    normal = random.multivariate_normal([0.0, 0.0], covariance, count)
    # motion at the site over that of the record
    factor_1 = np.exp(ratios[0] + stds[0] * normal[:, 0])
    factor_2 = np.exp(ratios[1] + stds[1] * normal[:, 1])
    radius_1 = row["participation_1"] * row["per_1"] * factor_1
    return radius_1, row["participation_2"] * row["per_2"] * factor_2


def test_radii_at_the_site_against_monte_carlo():
    # one motion moves both radii, with the correlation of their periods; would catch deviations
    # taken as independent (0.03 away) or lost; the deviation of their gap is of first order (0.011)
    station = make_station(channels=("HNN",))  # of one horizontal no demand is exact
    given, ratios, stds = {"damping_1": 0.05, "damping_2": 0.05}, (0.3, 0.1), (0.5, 0.6)
    gap = 1.5 * _row(station, **given)["demand"]
    table, _, probability = _with_motion(station, [{**given, "gap": gap}], ratios, stds)
    row = table.iloc[0]
    assert row["demand_rule"] != "exact"
    random, count = np.random.default_rng(5), 200_000
    radii = _drawn_radii(row, ratios, stds, count, random)
    name = "correlation_record" if row["demand_rule"] == "per_record" else "correlation"
    error = per_error(1.0, 0.05, 0.6, 0.05)
    critical = per_obspy.critical_gap(*radii, row[name]) / error.median
    closed = critical * np.exp(error.log_std * random.normal(size=count)) > gap
    # standard error of 200 000 samples: 0.0011
    assert_allclose(probability[0], np.mean(closed), atol=0.015)
