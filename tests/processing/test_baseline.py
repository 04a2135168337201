"""Baselines: means and lines, and those that shift during the shaking."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from obspy import Trace
from scipy.integrate import cumulative_trapezoid

from per_obspy.processing.filter.baseline import (
    boore_segments,
    crossing_time,
    displacement_polynomial,
    velocity_residual,
    without_mean,
)
from per_obspy.processing.series import without_line


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


def test_a_line_vanishes_and_a_parabola_does_not():
    time = np.linspace(0, 1, 5000)
    out = without_line(time)
    assert_allclose(out, 0.0, atol=1e-12)  # rounding of a least-squares fit of numbers near 1
    assert np.abs(without_line(time**2)).max() > 1e-4


def test_the_line_is_that_of_an_orthogonal_decomposition():
    # would catch sums that lose digits
    samples = 1e6 + np.linspace(0, 1e3, 20_000) ** 2 + np.random.default_rng(2).normal(size=20_000)
    place = np.linspace(-1, 1, samples.size)
    expected = np.polynomial.Polynomial.fit(place, samples, 1)(place)
    # both round at 1e-16 of the largest sample
    assert_allclose(samples - without_line(samples), expected, rtol=1e-12)


DT, ONSET, END = 0.01, 20.0, 50.0


@pytest.fixture(scope="module")
def truth(earthquake):
    """Motion that ends at rest, so that the rest after a correction belongs to the correction."""
    record = earthquake(shaking=8.0)
    record[2000:5000] -= record[2000:5000].sum() / 3000
    return record


def final(samples):
    velocity = cumulative_trapezoid(samples, dx=DT, initial=0)
    return velocity, cumulative_trapezoid(velocity, dx=DT, initial=0)


def shifted(truth, during, after):
    time = np.arange(truth.size) * DT
    return truth + np.where(time >= END, after, np.where(time >= ONSET, during, 0.0))


@pytest.mark.parametrize(("during", "after"), [(0.01, 0.002), (-0.02, 0.001), (0.0, 0.003)])
def test_two_shifts_are_taken_out(truth, during, after):
    out = boore_segments(shifted(truth, during, after), DT, ONSET, END)
    # the coda after t2 moves by 1e-5 m/s2: the line cannot separate it from a shift
    assert_allclose(out, truth, atol=2e-4)


def test_a_single_shift_is_found_by_the_crossing_of_its_line(truth):
    time = np.arange(truth.size) * DT
    record = truth + np.where(time >= 30.0, 0.01, 0.0)
    assert crossing_time(record, DT, ONSET, END) == pytest.approx(30.0, abs=0.5)


def test_a_crossing_outside_the_shaking_is_not_used(truth):
    time = np.arange(truth.size) * DT
    assert crossing_time(truth + np.where(time >= 5.0, 0.01, 0.0), DT, ONSET, END) == END


def test_the_velocity_outside_the_shaking_vanishes(truth):
    record = shifted(truth, 0.01, 0.002) + 1e-4
    velocity, _ = final(velocity_residual(record, DT, ONSET, END))
    before, _ = final(record)
    assert np.abs(before[11000:]).max() > 0.3  # m/s: what there was to correct
    assert np.abs(velocity[11000:]).max() < 0.01
    assert np.abs(velocity[:1900]).max() < 1e-3


def test_a_displacement_that_is_such_a_polynomial_vanishes():
    time = np.arange(3001) * DT
    curvature = 2 * 0.1 + 6 * 0.01 * time + 30 * 1e-5 * time**4
    # the trapezoidal rule integrates it with an error of dt^2/12 of its slope: 1e-5 of it
    assert_allclose(displacement_polynomial(curvature, DT), 0.0, atol=1e-4 * curvature.max())


def test_a_higher_polynomial_needs_a_higher_order():
    time = np.arange(3001) * DT / 30
    left = displacement_polynomial(time**9, DT)
    assert np.abs(left).max() > 0.05
    assert np.abs(displacement_polynomial(time**9, DT, order=11)).max() < 1e-3


@pytest.mark.parametrize(("first", "second"), [(-1.0, 5.0), (5.0, 5.0), (5.0, 1e3)])
def test_times_outside_the_record_are_refused(truth, first, second):
    with pytest.raises(ValueError, match="got"):
        boore_segments(truth, DT, first, second)
    with pytest.raises(ValueError, match="got"):
        velocity_residual(truth, DT, first, second)


def test_an_order_below_two_is_refused(truth):
    with pytest.raises(ValueError, match="order must be at least 2, got 1"):
        displacement_polynomial(truth, DT, 1)
