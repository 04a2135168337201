import numpy as np
import pytest
from numpy.testing import assert_allclose
from obspy import Trace

from per_obspy.processing.filter.baseline import without_mean, without_trend
from per_obspy.processing.series import trend


def component(samples, dt=0.01):
    return Trace(np.asarray(samples, dtype=float), {"delta": dt, "channel": "HNE"})


def test_the_mean_of_the_quiet_beginning_goes():
    # mutation: the mean of the whole record leaves -5 in the quiet beginning
    samples = np.r_[np.full(200, 3.0), np.full(200, 13.0)]
    out = without_mean(component(samples), pre_event=2.0)
    assert_allclose(out.data, samples - 3.0)
    assert out.stats.per_obspy.mean == 3.0


def test_without_a_quiet_beginning_the_mean_of_the_record_goes():
    assert_allclose(without_mean(component([1.0, 2.0, 6.0])).data, [-2.0, -1.0, 3.0])


@pytest.mark.parametrize("order", [1, 2, 5])
def test_a_polynomial_of_the_order_vanishes_and_one_above_does_not(order):
    time = np.linspace(0, 1, 5000)
    out = without_trend(component(time**order), order)
    assert_allclose(out.data, 0.0, atol=1e-12)  # rounding of a least-squares fit of numbers near 1
    assert np.abs(without_trend(component(time ** (order + 1)), order).data).max() > 1e-4


def test_inputs_stay_unchanged():
    given = component(np.arange(10.0))
    before = given.copy()
    without_mean(given)
    without_trend(given)
    assert given == before


@pytest.mark.parametrize("order", [1, 2, 5])
def test_the_trend_is_that_of_an_orthogonal_decomposition(order):
    # would catch normal equations that lose digits
    samples = 1e6 + np.linspace(0, 1e3, 20_000) ** 2 + np.random.default_rng(2).normal(size=20_000)
    place = np.linspace(-1, 1, samples.size)
    expected = np.polynomial.Polynomial.fit(place, samples, order)(place)
    # both round at 1e-16 of the largest sample; the equations are conditioned below 100
    assert_allclose(trend(samples, order), expected, rtol=1e-12)
