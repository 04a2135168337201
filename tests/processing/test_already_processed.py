import numpy as np
import pytest
from numpy.testing import assert_array_equal
from obspy import Stream, Trace
from obspy.core import AttribDict

from per_obspy.config import Processing
from per_obspy.processing.already_processed import passed_through

RATE = 100.0
SETTINGS = Processing()


def others(samples, **stats):
    header = {
        "sampling_rate": RATE,
        "channel": "HNE",
        "units": "m/s2",
        "processing_level": "processed",
    }
    return Stream([Trace(samples, header | stats)])


def test_samples_and_corners_pass(earthquake):
    given = others(earthquake(), corners=AttribDict(highpass=0.1, lowpass=30.0))
    out = passed_through(given, SETTINGS)[0]
    assert_array_equal(out.data, earthquake())
    kept = out.stats.per_obspy
    assert (kept.highpass, kept.lowpass, kept.highpass_source, kept.lowpass_source) == (
        0.1,
        30.0,
        "header",
        "header",
    )
    assert kept.longest_period == pytest.approx(8.0)
    assert "per_obspy" not in given[0].stats


def test_a_low_pass_beyond_the_sampling_is_none(earthquake):
    given = others(earthquake(), corners=AttribDict(highpass=0.1, lowpass=999.0))
    assert passed_through(given, SETTINGS)[0].stats.per_obspy.lowpass == 37.5


@pytest.mark.parametrize(("drift", "longest"), [(0.0, (14.0, 96.0)), (3e-3, (1.0, 14.0))])
def test_silent_headers_are_limited_by_their_drift(earthquake, drift, longest):
    # the drift has 20 s; mutation: taking the duration as the limit calls the record usable to 96 s
    time = np.arange(12000) / RATE
    out = passed_through(others(earthquake() + drift * np.sin(2 * np.pi * time / 20)), SETTINGS)[0]
    kept = out.stats.per_obspy
    assert longest[0] < kept.longest_period <= longest[1]
    assert "the header is silent" in kept.highpass_source
    assert kept.lowpass == 37.5
    assert_array_equal(out.data, earthquake() + drift * np.sin(2 * np.pi * time / 20))


def test_a_drift_that_no_corner_cleans_leaves_short_periods(earthquake):
    settings = Processing(highpass_range=(0.001, 0.02), drift=1e-6)
    kept = passed_through(others(earthquake()), settings)[0].stats.per_obspy
    assert kept.longest_period == pytest.approx(40.0)
    assert "drifts at any corner" in kept.highpass_source


def test_motion_that_does_not_rest_is_a_warning(earthquake):
    kept = passed_through(others(earthquake() + 0.05, header_peak=99.0), SETTINGS)[
        0
    ].stats.per_obspy
    assert "final velocity over its peak" in kept.warnings
    assert "largest sample off the header's 99" in kept.warnings
