"""Simple kriging about a trend, one place at a time: against SciPy, and what the nearest stations are."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from per_obspy.kernels.kriging import kriged

#: A sphere of this diameter (m) is flat over the places below.
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


def _places(count, seed=2, period=1.5, column=0, share=0.0, length=8000.0):
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


def _kriged(stations, places, neighbours=20):
    out = np.full((len(places[0]), 2), np.nan)
    kriged(stations, TREND, places, DIAMETER, neighbours, out)
    return out


def _expected(stations, places, column):
    """Return the same from the inverse of the matrix, for every place at once."""
    position, between, _, features, residuals = stations
    vectors, wanted, _, _, _, length = places
    across = np.exp(-DIAMETER * np.arcsin(cdist(position, vectors) / 2.0) / length[0])
    weights = np.linalg.inv(np.exp(-between / length[0])) @ across
    middle = TREND[2][column, 0]
    here, there = (np.stack([np.ones(len(f)), f[:, 0] - middle]) for f in (features, wanted))
    unmatched = there - here @ weights
    covariance = TREND[1][column, :2, :2]
    median = TREND[0][column, :2] @ there + residuals[:, column] @ weights
    left = (
        1.0
        - np.sum(across * weights, axis=0)
        + np.sum(unmatched * (covariance @ unmatched), axis=0)
    )
    return np.stack([median, TREND[3][column] * np.sqrt(left)], axis=1)


def test_an_inverse_gives_the_same():
    # would catch a triangle of the factor that is read on the wrong side, a lost term, a feature
    # that is not used
    stations, places = _stations(12), _places(30)
    for column in (0, 1):
        some = (*places[:3], np.full(30, column), *places[4:])
        # the matrix has a condition of 1e3
        assert_allclose(_kriged(stations, some), _expected(stations, some, column), rtol=1e-10)


def test_between_periods_medians_and_variances_are_linear():
    stations = _stations(9)
    low, high = _kriged(stations, _places(5, column=0)), _kriged(stations, _places(5, column=1))
    between = _kriged(stations, _places(5, share=0.25))
    assert_allclose(between[:, 0], 0.75 * low[:, 0] + 0.25 * high[:, 0], rtol=1e-12)
    assert_allclose(between[:, 1] ** 2, 0.75 * low[:, 1] ** 2 + 0.25 * high[:, 1] ** 2, rtol=1e-12)
    # at the end of the grid there is no further period to read
    assert_allclose(_kriged(stations, _places(5, share=1.0, column=0)), high, rtol=1e-12)


@pytest.mark.parametrize("neighbours", [1, 3, 7])
def test_the_nearest_serve_and_only_those_that_know(neighbours):
    # stations picked by a tree, alone, must give the same as all of them with so many neighbours
    stations, places = _stations(25), _places(10)
    stations[2][::3] = 2.0, 9.0  # every third knows from 2 s on, too late for the places' 1.5 s
    knowing = np.flatnonzero(np.arange(25) % 3)
    _, found = cKDTree(stations[0][knowing]).query(places[0], k=neighbours)
    got = _kriged(stations, places, neighbours)
    for row, picked in enumerate(knowing[found.reshape(10, neighbours)]):
        some = tuple(np.ascontiguousarray(one[picked]) for one in stations)
        alone = (some[0], np.ascontiguousarray(stations[1][np.ix_(picked, picked)]), *some[2:])
        one = tuple(np.ascontiguousarray(values[row : row + 1]) for values in places)
        # the order of the stations rounds differently
        assert_allclose(got[row], _kriged(alone, one)[0], rtol=1e-10)


def test_company_changes_no_bit():
    # mutation: places of a block that have fewer stations than others are told by a station that is
    # not theirs
    stations, places = _stations(9), _places(70)
    stations[2][::3] = 2.0, 9.0
    places[2][::2] = 2.5
    got = _kriged(stations, places)
    for row in (0, 1, 30, 63, 64, 69):
        one = tuple(np.ascontiguousarray(values[row : row + 1]) for values in places)
        assert_array_equal(got[row : row + 1], _kriged(stations, one))


def test_at_a_station_nothing_is_uncertain_and_without_one_nothing_is_said():
    stations, places = _stations(12), _places(12)
    there = (stations[0], stations[3], *places[2:])
    got = _kriged(stations, there)
    trend = TREND[0][0, 0] + TREND[0][0, 1] * (stations[3][:, 0] - TREND[2][0, 0])
    assert_allclose(got[:, 0], trend + stations[4][:, 0], rtol=1e-12)
    # the root of a difference of ones that is exact to 1e-13
    assert_allclose(got[:, 1], 0.0, atol=1e-6)
    late = (*places[:2], np.full(12, 9.5), *places[3:])
    assert np.isnan(_kriged(stations, late)).all()


def test_an_unknown_feature_is_the_middle_one():
    stations, places = _stations(6), _places(4)
    unknown, middle = places[1].copy(), places[1].copy()
    unknown[:, 0], middle[:, 0] = np.nan, TREND[2][0, 0]
    first, second = (
        _kriged(stations, (places[0], features, *places[2:])) for features in (unknown, middle)
    )
    assert_allclose(first, second, rtol=1e-14)
