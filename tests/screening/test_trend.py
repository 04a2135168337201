"""The trend over stations: slopes that stations resolve, places with several instruments."""

import numpy as np
from motion_samples import SETTINGS, interpolated_motion
from numpy.testing import assert_allclose

from per_obspy.config import Interpolation
from per_obspy.screening.assignment import sites
from per_obspy.screening.motion_field import features_of, fitted_group


def test_two_instruments_at_one_place_count_as_one():
    # their rows of the covariance are equal, so that it has no inverse
    twice = sites([0.0, 0.0, 0.1], [0.0, 0.0, 0.0])
    once = sites([0.0, 0.1], [0.0, 0.0])
    places = sites([0.0, 0.03], [0.0, 0.02])
    got = interpolated_motion(twice, [[-2.0], [-2.2], [-4.0]], [1.0], places, SETTINGS)
    expected = interpolated_motion(once, [[-2.1], [-4.0]], [1.0], places, SETTINGS)
    assert_allclose(got.ln_median, expected.ln_median, rtol=1e-12)
    assert_allclose(got.log_std, expected.log_std, rtol=1e-12, atol=1e-9)


def test_the_trend_follows_distance_and_vs30_where_stations_tell():
    # motion that is exactly a trend is found everywhere, with a place of unknown Vs30 at the
    # stations' mean
    random = np.random.default_rng(5)
    longitude, latitude = random.uniform(-2, 2, (2, 20))
    distance, vs30 = random.uniform(20e3, 200e3, 20), random.uniform(200, 800, 20)
    values = (1.0 - 1.3 * np.log(distance) - 0.6 * np.log(vs30))[:, None]
    places = sites([50.0, 50.0], [0.0, 0.0], "", 90e3, [400.0, np.nan])
    motion = interpolated_motion(
        sites(longitude, latitude, "", distance, vs30), values, [1.0], places, SETTINGS
    )
    at_mean = 1.0 - 1.3 * np.log(90e3) - 0.6 * np.log(vs30).mean()
    # exact up to the conditions of the equations
    assert_allclose(
        motion.ln_median[:, 0], [1.0 - 1.3 * np.log(90e3) - 0.6 * np.log(400.0), at_mean], rtol=1e-9
    )


def test_few_stations_have_the_expected_slope_and_correct_it_as_bayes_does():
    # two stations so far apart that nothing correlates; slope of the data -4 / ln 50
    stations = sites([0.0, 5.0], [0.0, 0.0], "", [10e3, 500e3])
    values, far = np.array([[-2.0], [-6.0]]), 5000e3
    motion = interpolated_motion(stations, values, [1.0], sites([90.0], [0.0], "", far), SETTINGS)
    # normal equation of the slope about the mean distance, with the precision of the prior
    about = np.array([-0.5, 0.5]) * np.log(50.0)
    precision = (SETTINGS.log_std / SETTINGS.distance_slope_std) ** 2
    moments = about @ values[:, 0] + precision * SETTINGS.distance_slope
    slope = moments / (about @ about + precision)
    expected = -4.0 + slope * (np.log(far) - np.log([10e3, 500e3]).mean())
    assert_allclose(motion.ln_median, expected, rtol=1e-9)


def test_few_stations_do_not_tell_a_slope_in_vs30():
    # would catch a slope drawn through two points
    stations = sites([0.0, 5.0], [0.0, 0.0], "", np.nan, [200.0, 800.0])
    place = sites([90.0], [0.0], "", np.nan, 1500.0)
    motion = interpolated_motion(stations, [[-2.0], [-6.0]], [1.0], place, SETTINGS)
    assert_allclose(motion.ln_median, -4.0, rtol=1e-9)


def test_the_deviation_is_that_of_the_error_where_few_stations_share_the_prior():
    # known truth: slopes and variances drawn from their priors, four stations, a hidden place; this
    # is about the arithmetic, not about earthquakes
    random, count = np.random.default_rng(8), 4000
    distance = np.array([20e3, 35e3, 60e3, 90e3, 200e3])
    places = sites(10.0 * np.arange(5), np.zeros(5), "", distance)
    # scale of the prior of the variance: inverse gamma with five degrees of freedom
    scale = 0.6 * np.sqrt(5.0 / random.chisquare(5.0, count))
    slope = -1.3 + 0.5 * scale / 0.6 * random.normal(size=count)
    values = slope * np.log(distance / 50e3)[:, None] + scale * random.normal(size=(5, count))
    known = np.arange(4)
    motion = interpolated_motion(
        places.at(known), values[known], np.ones(count), places.at(np.array([4]))
    )
    score = (motion.ln_median - values[4:]) / motion.log_std
    # unbiased: the mean of 4000 scores within four standard errors, 0.063; their mean square, of
    # Student's distribution of 8 degrees of freedom with kurtosis 4.5, within four of 0.03
    assert abs(score.mean()) < 0.063
    assert_allclose((score**2).mean(), 1.0, atol=0.12)


def _fitted(count, log_std=0.6, log_std_weight=5.0, usable=(0.0, np.inf), scatter=1.0):
    """Fit stations so far from each other that they are uncorrelated, at two periods."""
    values = -3.0 + scatter * np.random.default_rng(1).normal(size=(count, 2))
    settings = Interpolation(log_std=log_std, log_std_weight=log_std_weight)
    # a thousand kilometres from each other
    places = sites(10.0 * np.arange(count), np.zeros(count))
    limits = np.tile(usable, (count, 1))
    return values, fitted_group(places, values, limits, np.array([0.5, 2.0]), settings)


def test_uncorrelated_stations_have_their_mean_and_joined_deviation():
    # would catch a deviation of the residuals alone, and degrees of freedom without the mean
    values, group = _fitted(4)
    coefficients, covariance, _, deviation = group.trend
    assert_allclose(coefficients[:, 0], values.mean(axis=0), rtol=1e-12)
    assert_allclose(covariance[:, 0, 0], 1 / 4, rtol=1e-12)
    squares = ((values - values.mean(axis=0)) ** 2).sum(axis=0)
    # eight degrees of freedom, of Student's distribution
    variance = (5 * 0.6**2 + squares) / (5 + 4 - 1) * 8 / (8 - 2)
    assert_allclose(deviation**2, variance, rtol=1e-12)
    assert_allclose(group.stations[4], values - values.mean(axis=0), atol=1e-12)


def test_the_assumed_deviation_counts_as_so_many_stations():
    # with residuals of none the deviation is between 0 and the assumed one, and near it if weighty
    _, light = _fitted(10, log_std_weight=3.0, scatter=0.0)
    _, heavy = _fitted(10, log_std_weight=1e6, scatter=0.0)
    # variance 3 s0^2 / 12, times 12 / (12 - 2) of Student's distribution
    assert_allclose(light.trend[3], 0.6 * np.sqrt(3 / 10), rtol=1e-12)
    assert_allclose(heavy.trend[3], 0.6, rtol=1e-5)


def test_a_period_that_no_record_supports_has_no_trend():
    # up to 0.4 s neither the step before nor that after 2 s is reached
    _, group = _fitted(4, usable=(0.0, 0.4))
    assert np.isnan(group.trend[3]).tolist() == [True, True]
    _, group = _fitted(4, usable=(0.0, 0.6))
    assert np.isnan(group.trend[3]).tolist() == [False, False]


def test_features_are_logarithms_and_unknown_ones_are_missing():
    places = sites([0.0, 1.0], [0.0, 0.0], "", [1.0, np.nan], [np.e, 1.0])
    np.testing.assert_array_equal(features_of(places), [[0.0, 1.0], [np.nan, 0.0]])


def test_an_unknown_feature_of_a_station_leaves_the_slope_out():
    # would catch a slope through NaN
    count = 20
    vs30 = np.linspace(200.0, 800.0, count)
    values = np.log(vs30)[:, None] * [1.0, 1.0]
    limits = np.tile([0.0, np.inf], (count, 1))
    grid = np.array([0.5, 2.0])
    places = sites(10.0 * np.arange(count) - 90.0, np.zeros(count), "", np.nan, vs30)
    known = fitted_group(places, values, limits, grid, SETTINGS)
    assert_allclose(known.trend[0][:, 2], 1.0, rtol=1e-9)
    # one station of twenty without Vs30
    missing = places._replace(vs30=np.where(np.arange(count) == 3, np.nan, vs30))
    unknown = fitted_group(missing, values, limits, grid, SETTINGS)
    assert (unknown.trend[0][:, 2] == 0.0).all()
