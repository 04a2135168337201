"""Simple kriging about a trend, site by site, against SciPy; and the choice of nearest stations."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from per_obspy.kernels.kriging import kriged

#: A sphere of this diameter (m) is flat over the sites below.
DIAMETER = 2.0e6


def _stations(count, seed=1, known=(0.0, 9.0)):
    random = np.random.default_rng(seed)
    vectors = np.array([1.0, 0.0, 0.0]) + random.normal(scale=0.01, size=(count, 3))
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    return (
        vectors,
        DIAMETER * np.arcsin(cdist(vectors, vectors) / 2.0),
        np.tile(known, (count, 1)),
        random.normal(size=(count, 2)),
        random.normal(size=(count, 3)),
    )


#: A mean and one slope at each of three periods; the second feature is not used.
TREND = (
    np.array([[-3.0, 0.5, 0.0], [-2.0, 0.4, 0.0], [-1.0, 0.3, 0.0]]),
    np.einsum("k,ij->kij", [1.0, 2.0, 3.0], [[0.2, 0.05, 0.0], [0.05, 0.1, 0.0], [0.0, 0.0, 0.0]]),
    np.array([[0.1, np.nan], [0.2, np.nan], [0.3, np.nan]]),
    np.array([0.6, 0.5, 0.4]),
)


def _sites(count, seed=2, period=1.5, column=0, share=0.0, length=8000.0):
    vectors = _stations(count, seed)[0]
    features = np.random.default_rng(seed).normal(size=(count, 2))
    columns = (np.full(count, value) for value in (period, column, share, length))
    period, column, share, length = columns
    return (
        vectors,
        features,
        period.astype(float),
        column.astype(np.int64),
        share.astype(float),
        length,
    )


def _kriged(stations, sites, neighbours=20):
    out = np.full((len(sites[0]), 2), np.nan)
    kriged(stations, TREND, sites, DIAMETER, neighbours, out)
    return out


def _alone(sites, row):
    """Return one site."""
    return tuple(np.ascontiguousarray(values[row : row + 1]) for values in sites)


def _expected(stations, sites, column):
    """Return median and deviation from the inverse of the matrix, for every site at once."""
    position, separations, _, features, residuals = stations
    vectors, site_features, _, _, _, length = sites
    across = np.exp(-DIAMETER * np.arcsin(cdist(position, vectors) / 2.0) / length[0])
    weights = np.linalg.inv(np.exp(-separations / length[0])) @ across
    middle = TREND[2][column, 0]
    at_stations, at_sites = (
        np.stack([np.ones(len(values)), values[:, 0] - middle])
        for values in (features, site_features)
    )
    unmatched = at_sites - at_stations @ weights
    covariance = TREND[1][column, :2, :2]
    median = TREND[0][column, :2] @ at_sites + residuals[:, column] @ weights
    variance = (
        1.0
        - np.sum(across * weights, axis=0)
        + np.sum(unmatched * (covariance @ unmatched), axis=0)
    )
    return np.stack([median, TREND[3][column] * np.sqrt(variance)], axis=1)


def test_an_inverse_gives_the_same():
    # would catch a triangle of the factor that is read on the wrong side, a lost term, a feature
    # that is not used
    stations, sites = _stations(12), _sites(30)
    for column in (0, 1):
        chosen = (*sites[:3], np.full(30, column), *sites[4:])
        # the matrix has a condition of 1e3
        assert_allclose(_kriged(stations, chosen), _expected(stations, chosen, column), rtol=1e-10)


def test_between_periods_medians_and_variances_are_linear():
    stations = _stations(9)
    low, high = _kriged(stations, _sites(5, column=0)), _kriged(stations, _sites(5, column=1))
    middle = _kriged(stations, _sites(5, share=0.25))
    assert_allclose(middle[:, 0], 0.75 * low[:, 0] + 0.25 * high[:, 0], rtol=1e-12)
    assert_allclose(middle[:, 1] ** 2, 0.75 * low[:, 1] ** 2 + 0.25 * high[:, 1] ** 2, rtol=1e-12)
    # at the end of the grid there is no further period to read
    assert_allclose(_kriged(stations, _sites(5, share=1.0, column=0)), high, rtol=1e-12)


@pytest.mark.parametrize("neighbours", [1, 3, 7])
def test_the_nearest_serve_and_only_those_that_know(neighbours):
    # stations picked by a tree, alone, must give the same as all of them with so many neighbours
    stations, sites = _stations(25), _sites(10)
    stations[2][::3] = 2.0, 9.0  # every third knows from 2 s on, too late for the sites' 1.5 s
    knowing = np.flatnonzero(np.arange(25) % 3)
    _, found = cKDTree(stations[0][knowing]).query(sites[0], k=neighbours)
    got = _kriged(stations, sites, neighbours)
    for row, picked in enumerate(knowing[found.reshape(10, neighbours)]):
        near = [np.ascontiguousarray(values[picked]) for values in stations]
        near[1] = np.ascontiguousarray(stations[1][np.ix_(picked, picked)])
        # the order of the stations rounds differently
        assert_allclose(got[row], _kriged(tuple(near), _alone(sites, row))[0], rtol=1e-10)


def test_other_sites_change_no_bit():
    # mutation: sites of a block that have fewer stations than others are served by a station that
    # is not theirs
    stations, sites = _stations(9), _sites(70)
    stations[2][::3] = 2.0, 9.0
    sites[2][::2] = 2.5
    got = _kriged(stations, sites)
    for row in (0, 1, 30, 63, 64, 69):
        assert_array_equal(got[row : row + 1], _kriged(stations, _alone(sites, row)))


def test_deviation_is_zero_at_a_station_and_nan_without_one():
    stations, sites = _stations(12), _sites(12)
    at_stations = (stations[0], stations[3], *sites[2:])
    got = _kriged(stations, at_stations)
    trend = TREND[0][0, 0] + TREND[0][0, 1] * (stations[3][:, 0] - TREND[2][0, 0])
    assert_allclose(got[:, 0], trend + stations[4][:, 0], rtol=1e-12)
    # the root of a difference of ones that is exact to 1e-13
    assert_allclose(got[:, 1], 0.0, atol=1e-6)
    late = (*sites[:2], np.full(12, 9.5), *sites[3:])
    assert np.isnan(_kriged(stations, late)).all()


def test_an_unknown_feature_is_that_of_the_stations():
    # catches: residuals of near stations, which lack the effect of their own feature, added to the
    # trend at the middle feature
    stations, sites = _stations(6), _sites(4)
    unknown = np.full((6, 2), np.nan)
    # at a station the motion is that of the station
    at_stations = (stations[0], unknown, *_sites(6)[2:])
    trend = TREND[0][0, 0] + TREND[0][0, 1] * (stations[3][:, 0] - TREND[2][0, 0])
    got = _kriged(stations, at_stations)
    assert_allclose(got[:, 0], trend + stations[4][:, 0], rtol=1e-12)
    # far from all stations the trend at the middle is left, with the same deviation
    far = (-stations[0][:1], unknown[:1], *_alone(sites, 0)[2:])
    middle = (far[0], np.full((1, 2), TREND[2][0, 0]), *far[2:])
    assert_allclose(_kriged(stations, far), _kriged(stations, middle), rtol=1e-12)
