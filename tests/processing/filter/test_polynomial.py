import numpy as np
import pytest
from numpy.testing import assert_allclose
from obspy import Stream, Trace

from per_obspy.processing.filter.polynomial import mean_removed, trend, trend_removed


def stream(samples, dt=0.01):
    return Stream([Trace(np.asarray(samples, dtype=float), {"delta": dt, "channel": "HNE"})])


def test_the_mean_of_the_quiet_beginning_goes():
    # mutation: the mean of the whole record leaves -5 in the quiet beginning
    samples = np.r_[np.full(200, 3.0), np.full(200, 13.0)]
    out = mean_removed(stream(samples), pre_event=2.0)[0]
    assert_allclose(out.data, samples - 3.0)
    assert out.stats.per_obspy.mean == 3.0


def test_without_a_quiet_beginning_the_mean_of_the_record_goes():
    assert_allclose(mean_removed(stream([1.0, 2.0, 6.0]))[0].data, [-2.0, -1.0, 3.0])


@pytest.mark.parametrize("order", [1, 2, 5])
def test_a_polynomial_of_the_order_vanishes_and_one_above_does_not(order):
    time = np.linspace(0, 1, 5000)
    out = trend_removed(stream(time**order), order)[0]
    assert_allclose(out.data, 0.0, atol=1e-12)  # rounding of a least-squares fit of numbers near 1
    assert np.abs(trend_removed(stream(time ** (order + 1)), order)[0].data).max() > 1e-4


def test_inputs_stay_unchanged():
    given = stream(np.arange(10.0))
    before = given.copy()
    mean_removed(given)
    trend_removed(given)
    assert given == before


@pytest.mark.parametrize("order", [1, 2, 5])
def test_the_trend_is_that_of_an_orthogonal_decomposition(order):
    # would catch normal equations that lose digits
    samples = 1e6 + np.linspace(0, 1e3, 20_000) ** 2 + np.random.default_rng(2).normal(size=20_000)
    place = np.linspace(-1, 1, samples.size)
    expected = np.polynomial.Polynomial.fit(place, samples, order)(place)
    # both round at 1e-16 of the largest sample; the equations are conditioned below 100
    assert_allclose(trend(samples, order), expected, rtol=1e-12)
