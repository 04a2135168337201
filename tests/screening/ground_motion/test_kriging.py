"""Motion between stations: exact at them, the trend far away, and a textbook's matrix in between."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from per_obspy.config import Interpolation
from per_obspy.screening.ground_motion.assignment import nearest_station
from per_obspy.screening.ground_motion.kriging import (
    NEIGHBOURS,
    InterpolatedMotion,
    fitted_field,
    motion_at,
)
from per_obspy.screening.ground_motion.sites import sites
from per_obspy.screening.ground_motion.spatial_correlation import great_circle, spatial_correlation

SETTINGS = Interpolation()
PERIODS = [0.3, 1.0, 3.0]
EVERY_PERIOD = (0.0, np.inf)


def interpolated_motion(stations, ln_per, periods, places, settings=SETTINGS):
    """Return the motion of every place at every period of the stations, columns a period."""
    ln_per, usable = np.asarray(ln_per), np.tile(EVERY_PERIOD, (stations.longitude.size, 1))
    columns = []
    for period, values in zip(periods, ln_per.T, strict=True):
        # a grid whose other end is far away and has other values: the period itself must count
        # alone
        field = fitted_field(
            stations, np.stack([values, values + 9.0], axis=1), usable, [period, 50.0], settings
        )
        columns.append(motion_at(field, places, np.full(places.longitude.size, period)))
    median, deviation = (
        np.stack([getattr(one, name) for one in columns], axis=1)
        for name in ("ln_median", "log_std")
    )
    return InterpolatedMotion(median, deviation, columns[0].fallback)


@pytest.fixture
def city():
    """Twelve stations around a city with distances to a source, and their ln PER."""
    random = np.random.default_rng(7)
    longitude, latitude = random.uniform(-0.2, 0.2, (2, 12))
    distance = 1000.0 * np.hypot(111.2 * (longitude + 0.6), 111.2 * latitude)
    values = -3.0 - 1.2 * np.log(distance / 50e3)[:, None] + random.normal(0.0, 0.5, (12, 3))
    return sites(longitude, latitude, "", distance), values


def test_a_station_gives_its_own_record(city):
    stations, values = city
    motion = interpolated_motion(stations, values, PERIODS, stations, SETTINGS)
    # the equations are solved with a condition number of 1e4 at most
    assert_allclose(motion.ln_median, values, atol=1e-11)
    # a deviation is the root of a difference of two ones: sqrt of a few 1e-16 times that condition
    assert_allclose(motion.log_std, 0.0, atol=1e-6)
    assert not motion.fallback.any()


def test_a_textbooks_matrix_gives_the_same(city):
    # ordinary Lagrange form of universal kriging (Cressie 1993, 3.4.2), one place at a time,
    # without Cholesky factors; would catch a lost term of the trend's own uncertainty
    stations, values = city
    places = sites([0.01, -0.1, 0.3], [0.02, 0.15, -0.4], "", [52e3, 61e3, 110e3])
    motion = interpolated_motion(stations, values, PERIODS, places, SETTINGS)
    logs = np.log(stations.source_distance)
    trend = np.stack([np.ones(12), logs], axis=1)
    for column, period in enumerate(PERIODS):
        range_ = 1000 * {0.3: 8.5 + 17.2 * 0.3, 1.0: 25.7, 3.0: 22.0 + 11.1}[period]

        def covariance(a, b, range_=range_):
            apart = nearest_station(*(np.array([x]) for x in a), *(np.array([x]) for x in b))[1]
            return float(np.exp(-3 * apart / range_)[0])

        points = list(zip(stations.longitude, stations.latitude, strict=True))
        between = np.array([[covariance(a, b) for b in points] for a in points])
        inverse = np.linalg.inv(between)
        hat = trend @ np.linalg.inv(trend.T @ inverse @ trend) @ trend.T @ inverse
        residual = values[:, column] - hat @ values[:, column]
        variance = (5 * 0.6**2 + residual @ inverse @ residual) / (5 + 12 - 2)
        system = np.block([[between, trend], [trend.T, np.zeros((2, 2))]])
        for row in range(3):
            place = (places.longitude[row], places.latitude[row])
            right = [
                *(covariance(a, place) for a in points),
                1.0,
                np.log(places.source_distance[row]),
            ]
            solution = np.linalg.solve(system, right)
            # chord and haversine distances differ by 1e-8 m, the conditions are as above
            assert_allclose(
                motion.ln_median[row, column], solution[:12] @ values[:, column], rtol=1e-8
            )
            assert_allclose(
                motion.log_std[row, column] ** 2, variance * (1 - solution @ right), rtol=1e-7
            )


def test_the_deviation_is_that_of_the_error():
    # fields drawn with the published correlation about an attenuation, one a column; would catch a
    # deviation that is right at stations and far away but not in between
    random = np.random.default_rng(12)
    longitude, latitude = random.uniform(-0.15, 0.15, (2, 18))
    distance = 1000.0 * np.hypot(111.2 * (longitude + 0.5), 111.2 * latitude)
    apart = great_circle(longitude[:, None], latitude[:, None], longitude, latitude)
    fields = 1000
    root = np.linalg.cholesky(np.exp(-3.0 * apart / 25_700.0))
    values = -3.0 - 1.5 * np.log(distance)[:, None] + 0.6 * root @ random.normal(size=(18, fields))
    known, hidden = np.arange(15), np.arange(15, 18)
    all_sites = sites(longitude, latitude, "", distance)
    motion = interpolated_motion(
        all_sites.at(known), values[known], np.ones(fields), all_sites.at(hidden)
    )
    error = motion.ln_median - values[hidden]
    # a mean square of 1000 normal errors is within 18 % of its expectation (four standard errors)
    assert_allclose((error**2).mean(axis=1), (motion.log_std**2).mean(axis=1), rtol=0.18)
    assert_allclose(error.mean(axis=1), 0.0, atol=4 * 0.6 / np.sqrt(fields))


def test_far_away_the_trend_and_the_whole_deviation_are_left():
    # stations so far apart that nothing correlates: ordinary least squares and its prediction
    # error, from a textbook
    values = np.array([[-2.0], [-3.0], [-2.5]])
    stations = sites([0.0, 10.0, 20.0], [0.0, 0.0, 0.0])
    motion = interpolated_motion(stations, values, [1.0], sites([100.0], [50.0]), SETTINGS)
    assert_allclose(motion.ln_median, -2.5, rtol=1e-12)
    variance = (5 * 0.6**2 + 0.5) / (5 + 3 - 1)
    assert_allclose(motion.log_std, np.sqrt(variance * (1 + 1 / 3)), rtol=1e-12)


def test_one_station_serves_and_its_assumed_deviation_grows_with_distance():
    # would catch a division by the degrees of freedom of the data alone, which are none
    motion = interpolated_motion(
        sites([0.0], [0.0]), [[-2.0]], [1.0], sites([0.0, 0.05, 90.0], [0.0] * 3), SETTINGS
    )
    assert_allclose(motion.ln_median[:, 0], -2.0, rtol=1e-12)
    near = spatial_correlation(great_circle(0.0, 0.0, 0.05, 0.0), 1.0)
    assert_allclose(
        motion.log_std[:, 0], 0.6 * np.sqrt([0.0, 2 * (1 - near), 2.0]), rtol=1e-9, atol=1e-9
    )


def test_a_place_between_two_stations_is_between_them():
    stations, places = sites([0.0, 0.1], [0.0, 0.0]), sites([0.05, 0.02, 0.08], [0.0] * 3)
    motion = interpolated_motion(stations, [[-2.0], [-4.0]], [1.0], places, SETTINGS)
    assert_allclose(motion.ln_median[0], -3.0, rtol=1e-12)
    # mirrored places are mirrored in value and equal in deviation
    assert_allclose(motion.ln_median[1] + motion.ln_median[2], -6.0, rtol=1e-12)
    assert_allclose(motion.log_std[1], motion.log_std[2], rtol=1e-12)
    assert motion.ln_median[1] > -3.0


@given(st.permutations(range(12)))
def test_the_order_of_stations_does_not_matter(order):
    random = np.random.default_rng(3)
    longitude, latitude = random.uniform(-0.2, 0.2, (2, 12))
    values = random.normal(-3.0, 0.5, (12, 1))
    places = sites([0.0, 0.1], [0.0, 0.1])
    one = interpolated_motion(sites(longitude, latitude), values, [1.0], places, SETTINGS)
    other = interpolated_motion(
        sites(longitude[order], latitude[order]), values[order], [1.0], places, SETTINGS
    )
    assert_allclose(other.ln_median, one.ln_median, rtol=1e-10)
    assert_allclose(other.log_std, one.log_std, rtol=1e-10)


def test_more_motion_is_more_motion_everywhere(city):
    # PER times 3 adds ln 3 and changes no deviation; would catch a trend forced through something
    stations, values = city
    places = sites([0.01, 0.3], [0.02, -0.4], "", [52e3, 110e3])
    once = interpolated_motion(stations, values, PERIODS, places, SETTINGS)
    thrice = interpolated_motion(stations, values + np.log(3.0), PERIODS, places, SETTINGS)
    assert_allclose(thrice.ln_median, once.ln_median + np.log(3.0), rtol=1e-10)
    assert_allclose(thrice.log_std, once.log_std, rtol=1e-10)


def test_two_instruments_at_one_place_count_as_one():
    # their rows of the covariance are equal, so that it has no inverse
    twice = sites([0.0, 0.0, 0.1], [0.0, 0.0, 0.0])
    once = sites([0.0, 0.1], [0.0, 0.0])
    places = sites([0.0, 0.03], [0.0, 0.02])
    got = interpolated_motion(twice, [[-2.0], [-2.2], [-4.0]], [1.0], places, SETTINGS)
    expected = interpolated_motion(once, [[-2.1], [-4.0]], [1.0], places, SETTINGS)
    assert_allclose(got.ln_median, expected.ln_median, rtol=1e-12)
    assert_allclose(got.log_std, expected.log_std, rtol=1e-12, atol=1e-9)


def test_site_classes_are_not_crossed():
    # would catch a lakebed's motion reaching rock
    stations = sites([0.0, 0.001, 0.1], [0.0, 0.0, 0.0], ["lakebed", "rock", "rock"])
    values = [[0.0], [-4.0], [-4.0]]
    places = sites([0.0, 0.0, 0.0, 0.0], [0.0] * 4, ["rock", "lakebed", "hill", ""])
    motion = interpolated_motion(stations, values, [1.0], places, SETTINGS)
    assert_allclose(motion.ln_median[:2, 0], [-4.0, 0.0], atol=1e-12)
    assert motion.fallback.tolist() == [False, False, True, True]
    alone = interpolated_motion(
        stations.at(np.array([1, 2])), values[1:], [1.0], places.at(np.array([0])), SETTINGS
    )
    assert_allclose(motion.log_std[0], alone.log_std[0], rtol=1e-12)
    # a fallback uses every station
    assert_allclose(motion.ln_median[2], 0.0, atol=1e-12)


def test_unknown_classes_everywhere_are_no_fallback():
    stations = sites([0.0], [0.0])
    motion = interpolated_motion(
        stations, [[-2.0]], [1.0], sites([0.0, 0.0], [0.0, 0.0], ["", "rock"]), SETTINGS
    )
    assert motion.fallback.tolist() == [False, True]


def test_periods_that_a_record_does_not_support_are_left_to_the_others():
    # the first station holds up to 0.5 s, inside a step of the grid: up to there it is met, then it
    # is as if it were not; would catch a record that is cut at the grid's periods, and one that
    # goes on beyond its own
    stations, place = sites([0.0, 0.1], [0.0, 0.0]), sites([0.0], [0.0])
    grid = [0.3, 0.48, 0.52, 1.0, 3.0]
    values = np.array([[-2.0, -2.0, -2.0, -9.0, -9.0], [-4.0, -4.1, -4.2, -4.5, -5.0]])
    field = fitted_field(stations, values, [[0.0, 0.5], [0.0, 2.0]], grid, SETTINGS)
    alone = fitted_field(stations.at(np.array([1])), values[1:], [[0.0, 2.0]], grid, SETTINGS)
    for period in (0.3, 0.4, 0.5):
        motion = motion_at(field, place, period)
        assert_allclose([motion.ln_median[0], motion.log_std[0]], [-2.0, 0.0], atol=1e-7)
    for period in (1.01, 1.5, 2.0):
        motion, other = motion_at(field, place, period), motion_at(alone, place, period)
        assert_allclose(
            [motion.ln_median, motion.log_std], [other.ln_median, other.log_std], rtol=1e-12
        )
    for period in (0.29, 2.01, 3.0, 3.1):
        motion = motion_at(field, place, period)
        assert np.isnan([motion.ln_median[0], motion.log_std[0]]).all()
        assert not motion.fallback[0]


def test_a_class_that_lacks_a_period_is_served_by_the_others_and_says_so():
    stations = sites([0.0, 0.1], [0.0, 0.0], ["lakebed", "rock"])
    grid = [0.3, 0.48, 0.52, 1.0, 3.0]
    field = fitted_field(
        stations, [[-2.0] * 5, [-4.0] * 5], [[0.0, 0.5], [0.0, 9.0]], grid, SETTINGS
    )
    motion = motion_at(field, sites([0.0, 0.0], [0.0, 0.0], "lakebed"), [0.4, 2.0])
    assert motion.fallback.tolist() == [False, True]
    assert_allclose(motion.ln_median, [-2.0, -4.0], atol=1e-7)


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


def test_few_stations_do_not_tell_a_slope():
    # would catch an attenuation drawn through two points
    stations = sites([0.0, 5.0], [0.0, 0.0], "", [10e3, 500e3])
    motion = interpolated_motion(
        stations, [[-2.0], [-6.0]], [1.0], sites([90.0], [0.0], "", 5000e3), SETTINGS
    )
    assert_allclose(motion.ln_median, -4.0, rtol=1e-9)


def test_every_place_has_its_own_period():
    # at a station a straight line in the logarithm of the period is met everywhere, and nothing
    # outside the grid
    grid = np.array([0.1, 0.5, 2.0])
    stations = sites([0.0, 0.1, 0.3], [0.0, 0.1, 0.0])
    slopes = np.array([[2.0], [-1.0], [3.0]])
    field = fitted_field(
        stations, slopes * np.log(grid), np.tile(EVERY_PERIOD, (3, 1)), grid, SETTINGS
    )
    period = np.array([0.1, 0.3, 2.0, 0.09, 2.1])
    motion = motion_at(field, stations.at(np.array([0, 1, 2, 1, 1])), period)
    expected = [2.0 * np.log(0.1), -np.log(0.3), 3.0 * np.log(2.0), np.nan, np.nan]
    assert_allclose(motion.ln_median, expected, rtol=1e-12)
    assert np.isnan(motion.log_std).tolist() == [False, False, False, True, True]


def test_the_numbers_of_a_place_depend_on_no_other_place(city):
    # to the bit, because results must not depend on how pairs are cut into blocks; would catch a
    # product of matrices over several places, which BLAS cuts by their number
    stations, values = city
    named = stations._replace(site_class=np.array(["rock", "lakebed"] * 6, dtype=object))
    field = fitted_field(named, values, np.tile(EVERY_PERIOD, (12, 1)), PERIODS, SETTINGS)
    random = np.random.default_rng(8)
    classes = random.choice(["rock", "lakebed", "hill"], 257).astype(object)
    places = sites(
        *random.uniform(-0.3, 0.3, (2, 257)), classes, random.uniform(30e3, 90e3, 257), np.nan
    )
    period = random.uniform(0.3, 3.0, 257)
    together = motion_at(field, places, period)
    order = random.permutation(257)
    for rows in (order, order[:1], order[3:120], np.arange(1, 257, 5)):
        some = motion_at(field, places.at(rows), period[rows])
        assert np.array_equal(some.ln_median, together.ln_median[rows])
        assert np.array_equal(some.log_std, together.log_std[rows])
        assert np.array_equal(some.fallback, together.fallback[rows])


def test_the_nearest_stations_tell_nearly_what_all_tell(monkeypatch):
    # 120 stations whose motion has the assumed correlation; their nearest ones against all of them.
    # Would catch far stations in place of near ones
    random = np.random.default_rng(2)
    longitude, latitude = random.uniform(-0.3, 0.3, (2, 120))
    apart = great_circle(longitude[:, None], latitude[:, None], longitude, latitude)
    values = -3.0 + 0.6 * np.linalg.cholesky(np.exp(-3.0 * apart / 25_700.0)) @ random.normal(
        size=(120, 2)
    )
    field = fitted_field(
        sites(longitude, latitude), values, np.tile(EVERY_PERIOD, (120, 1)), [1.0, 2.0], SETTINGS
    )
    places = sites(*random.uniform(-0.3, 0.3, (2, 300)))
    near = motion_at(field, places, np.ones(300))
    monkeypatch.setattr("per_obspy.screening.ground_motion.kriging.NEIGHBOURS", 120)
    every = motion_at(field, places, np.ones(300))
    # screening: 0.2 % and 0.07 deviations were found over several seeds; eight neighbours give 3 %
    # and 0.4
    assert_allclose(near.log_std, every.log_std, rtol=0.005)
    assert np.max(np.abs(near.ln_median - every.ln_median) / every.log_std) < 0.15
    assert NEIGHBOURS < 120


def test_inputs_that_cannot_be_used_are_named():
    one, usable = sites([0.0], [0.0]), [EVERY_PERIOD]
    with pytest.raises(ValueError, match=r"ln_per must be \(1, 2\)"):
        fitted_field(one, [[-2.0]], usable, [1.0, 2.0], SETTINGS)
    with pytest.raises(ValueError, match="latitude must be between -90 and 90, got 95"):
        sites([0.0], [95.0])
    with pytest.raises(ValueError, match="periods must be positive, got 0"):
        fitted_field(one, [[-2.0]], usable, [0.0], SETTINGS)
    with pytest.raises(ValueError, match="periods must be at least two and rising"):
        fitted_field(one, [[-2.0, -2.0]], usable, [2.0, 1.0], SETTINGS)
    with pytest.raises(ValueError, match="period must be positive, got -1"):
        motion_at(fitted_field(one, [[-2.0, -2.0]], usable, [1.0, 2.0], SETTINGS), one, -1.0)
