"""Filters and baselines as any user of ObsPy calls them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from obspy import Stream, Trace
from scipy.integrate import cumulative_trapezoid

from per_obspy.processing.filter import obspy_plugins
from per_obspy.processing.filter.butterworth import acausal_bandpass

DT, RATE, ONSET, END = 0.01, 100.0, 20.0, 30.0

BASELINES = ("boore_segments", "velocity_residual", "displacement_polynomial")


@pytest.fixture(scope="module")
def shifted(earthquake):
    """Acceleration whose baseline shifts at the onset of the shaking and after it."""
    record = earthquake(shaking=8.0)
    record[2000:3000] -= record[2000:3000].sum() / 1000
    time = np.arange(record.size) * DT
    return record + np.where(time >= END, 0.002, np.where(time >= ONSET, 0.01, 0.0))


def _noise():
    return Trace(np.random.default_rng(2).normal(size=500), {"sampling_rate": RATE})


@pytest.mark.parametrize("names", [("highpass", "lowpass"), ("freqmin", "freqmax")])
def test_the_filter_takes_the_names_of_obspy(names):
    trace = _noise()
    expected = acausal_bandpass(trace.data, RATE, 1.0, 10.0)
    trace.filter("acausal_butterworth", **dict(zip(names, (1.0, 10.0), strict=True)))
    assert_array_equal(trace.data, expected)


@pytest.mark.parametrize(
    ("corner", "both"), [({"freqmin": 1.0}, (1.0, np.inf)), ({"freqmax": 10.0}, (0.0, 10.0))]
)
def test_one_corner_is_a_highpass_or_a_lowpass(corner, both):
    trace = _noise()
    expected = acausal_bandpass(trace.data, RATE, *both)
    assert_array_equal(trace.filter("acausal_butterworth", **corner).data, expected)


@pytest.mark.parametrize(
    ("corners", "message"),
    [
        ({}, "got neither"),
        ({"highpass": 1.0, "freqmin": 2.0}, "are the same corner: give one"),
        ({"freqmin": 10.0, "freqmax": 1.0}, "highpass = 10 Hz must be below lowpass = 1 Hz"),
        ({"freqmin": 1.0, "freqmax": 50.1}, "lowpass = 50.1 Hz is above the Nyquist frequency 50"),
        ({"freqmin": -1.0}, "highpass must be positive, got -1"),
        ({"freqmax": np.nan}, "lowpass must be finite"),
    ],
)
def test_corners_that_make_no_band_are_refused(corners, message):
    with pytest.raises(ValueError, match=message):
        _noise().filter("acausal_butterworth", **corners)


@pytest.mark.parametrize("name", BASELINES)
def test_a_trace_needs_no_arguments(shifted, name):
    # would catch: an interval of another trace, times that are not found
    stream = Stream([Trace(shifted.copy(), {"delta": DT}), Trace(shifted[::2], {"delta": 2 * DT})])
    for trace in stream.detrend(name):
        velocity = cumulative_trapezoid(trace.data, dx=trace.stats.delta, initial=0)
        after = velocity[round(END / trace.stats.delta) :]
        # The shifts leave 0.1 m/s and 0.002 m/s2 for 90 s, 0.28 m/s; a tenth of that may stay
        assert np.abs(np.polyval(np.polyfit(np.arange(after.size), after, 1), 0.0)) < 0.03


@pytest.mark.parametrize("name", BASELINES)
def test_baselines_are_linear(shifted, name):
    traces = [Trace(factor * shifted, {"delta": DT}) for factor in (1.0, -2.0)]
    once, twice = (trace.detrend(name).data for trace in traces)
    assert_allclose(twice, -2 * once, atol=1e-9)  # rounding of fits to 12 000 samples


def test_given_times_and_interval_are_used(shifted):
    trace = Trace(shifted.copy(), {"delta": DT})
    # Other times, another result; the interval is that of the trace
    given = trace.copy().detrend("boore_segments", dt=DT, first=ONSET, second=END)
    other = trace.copy().detrend("boore_segments", dt=DT, first=ONSET + 5.0, second=END)
    assert np.abs(given.data - other.data).max() > 1e-3
    again = trace.copy().detrend("boore_segments", first=ONSET, second=END)
    assert_array_equal(again.data, given.data)


def test_without_a_trace_the_interval_is_required(shifted):
    with pytest.raises(ValueError, match="dt is required"):
        obspy_plugins.displacement_polynomial(shifted)


@pytest.mark.parametrize("name", ["boore_segments", "velocity_residual"])
def test_a_record_without_a_clear_onset_is_refused(name):
    noise = np.random.default_rng(5).normal(size=4000)
    with pytest.raises(ValueError, match="no onset of the shaking can be picked"):
        Trace(noise, {"delta": DT}).detrend(name)
