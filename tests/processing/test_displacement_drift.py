import numpy as np
import pytest
from numpy.polynomial import Polynomial
from obspy import Trace
from scipy.integrate import cumulative_trapezoid

from per_obspy.processing.filter.butterworth import bandpass, pad, taper
from per_obspy.processing.filter.corners import clean_highpass, displacement_drift

DT = 0.01
HIGHEST, TARGET = 0.5, 0.02  # Hz; drift of a clean displacement


@pytest.mark.parametrize("highpass", [0.03, 0.1])
def test_against_integration_in_time(earthquake, highpass):
    # mutations: pads counted as record; the displacement not starting from rest; thinning before
    # the filter
    record = taper(Trace(earthquake() + 0.002, {"delta": DT}), 0.05)
    steps = bandpass(pad(record, 0.02, 5), highpass, np.inf, 5)
    first = round(steps.stats.per_obspy.pad_before / DT)
    velocity = cumulative_trapezoid(steps.data, dx=DT, initial=0)
    displacement = cumulative_trapezoid(velocity, dx=DT, initial=0)[first : first + 12000]
    place = np.linspace(-1, 1, displacement.size)
    polynomial = Polynomial.fit(place, displacement, 5)(place)
    expected = np.abs(polynomial).max() / np.abs(displacement).max()
    drift = displacement_drift(record.data, DT, 0.02, 5)
    # content above 10 Hz and peaks between the thinned samples are left out: far below the
    # tolerance of 1e-3 on 2e-2
    assert drift(highpass) == pytest.approx(expected, rel=0.02, abs=1e-4)


def test_the_size_of_the_motion_does_not_matter(earthquake):
    record = earthquake() + 0.002
    once, twice = (displacement_drift(factor * record, DT, 0.02, 5)(0.05) for factor in (1, -7))
    assert once == pytest.approx(twice, rel=1e-9)


def test_a_silent_record_has_no_drift():
    assert displacement_drift(np.zeros(1000), DT, 0.1, 5)(0.2) == 0.0


def test_the_root_is_found_on_a_known_curve():
    corner = clean_highpass(lambda f: 0.02 * (0.1 / f) ** 3, 0.001, HIGHEST, TARGET)
    assert corner == pytest.approx(0.1, rel=2e-3)


def test_the_corner_is_clean_from_there_on():
    # mutation: scanning upwards stops in the accidental dip at 0.01 Hz
    def bumpy(frequency):
        return 0.0 if 0.009 < frequency < 0.011 else 0.02 * 0.1 / frequency

    assert clean_highpass(bumpy, 0.009, HIGHEST, TARGET) == pytest.approx(0.1, rel=2e-3)


def test_a_narrow_band_of_drift_is_not_stepped_over():
    def narrow(frequency):
        return 0.03 if 0.1 < frequency < 0.125 else 0.01

    assert clean_highpass(narrow, 0.001, HIGHEST, TARGET) == pytest.approx(0.125, rel=2e-3)


def test_limits_of_the_corner():
    assert clean_highpass(lambda _: 0.0, 0.03, HIGHEST, TARGET) == 0.03
    assert clean_highpass(lambda _: 1.0, 0.03, HIGHEST, TARGET) is None


def test_a_recorded_drift_is_cleaned_to_the_target(earthquake):
    # a slow wave of 60 s
    wave = 1e-3 * np.sin(2 * np.pi * np.arange(12000) * DT / 60)
    record = taper(Trace(earthquake() + wave, {"delta": DT}), 0.05).data
    drift = displacement_drift(record, DT, 1 / 120, 5)
    corner = clean_highpass(drift, 1 / 120, HIGHEST, TARGET)
    assert drift(corner) == pytest.approx(TARGET, abs=1e-3)
    assert drift(0.9 * corner) > TARGET
