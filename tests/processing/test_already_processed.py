"""Records processed by others: samples stay, corners and usable periods come from the header."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from obspy import Stream, Trace
from obspy.core import AttribDict

from per_obspy.config import Processing
from per_obspy.processing.chain import process
from per_obspy.processing.instrument import pass_through

RATE = 100.0
SETTINGS = Processing()


def others(samples, **stats):
    header = {
        "sampling_rate": RATE,
        "channel": "HNE",
        "units": "m/s2",
        "processing_level": "processed",
    }
    return Trace(samples, header | stats)


def test_samples_and_corners_pass(earthquake):
    given = others(earthquake(), corners=AttribDict(highpass=0.1, lowpass=30.0))
    out = pass_through(given, SETTINGS)
    assert_array_equal(out.data, earthquake())
    # the corners of the header and the periods that follow from them
    known = out.stats.per_obspy
    assert (known.highpass, known.lowpass) == (0.1, 30.0)
    assert (known.highpass_source, known.lowpass_source) == ("header", "header")
    assert known.longest_period == pytest.approx(8.0)
    assert "per_obspy" not in given.stats


def test_a_low_pass_beyond_the_sampling_is_none(earthquake):
    given = others(earthquake(), corners=AttribDict(highpass=0.1, lowpass=999.0))
    assert pass_through(given, SETTINGS).stats.per_obspy.lowpass == 37.5


@pytest.mark.parametrize(("drift", "longest"), [(0.0, (14.0, 96.0)), (3e-3, (1.0, 14.0))])
def test_silent_headers_are_limited_by_their_drift(earthquake, drift, longest):
    # the drift has 20 s; mutation: taking the duration as the limit calls the record usable to 96 s
    time = np.arange(12000) / RATE
    out = pass_through(others(earthquake() + drift * np.sin(2 * np.pi * time / 20)), SETTINGS)
    known = out.stats.per_obspy
    assert longest[0] < known.longest_period <= longest[1]
    assert "the header is silent" in known.highpass_source
    assert known.lowpass == 37.5
    assert_array_equal(out.data, earthquake() + drift * np.sin(2 * np.pi * time / 20))


def test_a_drift_that_no_corner_cleans_leaves_short_periods(earthquake):
    settings = Processing(highpass_range=(0.001, 0.02), drift=1e-6)
    known = pass_through(others(earthquake()), settings).stats.per_obspy
    assert known.longest_period == pytest.approx(40.0)
    assert "drifts at any corner" in known.highpass_source


@pytest.mark.parametrize(("shift", "seconds"), [(0.05, 15.0), (0.015, 3.0)])
def test_the_limit_of_a_shifted_baseline_stays_when_a_file_is_read_back(earthquake, shift, seconds):
    time = np.arange(12000) / RATE
    baseline = np.where((time > 23) & (time < 23 + seconds), shift, 0.0)
    noise = 1e-5 * np.random.default_rng(1).normal(size=12000)
    header = {"sampling_rate": RATE, "channel": "HNE", "units": "m/s2"}
    first = process(Stream([Trace(earthquake() + noise + baseline, header)]))[0]
    again = process(Stream([first]))[0].stats.per_obspy
    # The period, its flag and its text, once each
    assert first.stats.per_obspy.longest_period == first.stats.per_obspy.certain_period
    for name in ("longest_period", "certain_period", "record_flags", "warnings", "failed_checks"):
        assert again[name] == first.stats.per_obspy[name]


def test_motion_that_does_not_rest_is_a_warning(earthquake):
    moving = others(earthquake() + 0.05, header_peak=99.0)
    known = pass_through(moving, SETTINGS).stats.per_obspy
    assert "final velocity over its peak" in known.warnings
    assert "largest sample off the header's 99" in known.warnings
