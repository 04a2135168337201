import numpy as np
import pytest
from numpy.polynomial import Polynomial
from obspy import Stream, Trace

from per_obspy.processing.filter.butterworth import filtered, padded, tapered
from per_obspy.processing.filter.displacement_drift import clean_highpass, displacement_drift
from per_obspy.processing.quality.final_checks import integrated

DT = 0.01


@pytest.mark.parametrize("highpass", [0.03, 0.1])
def test_against_integration_in_time(earthquake, highpass):
    # mutations: pads counted as record; the displacement not starting from rest; thinning before
    # the filter
    record = tapered(Stream([Trace(earthquake() + 0.002, {"delta": DT})]))
    steps = filtered(padded(record, 0.02), highpass, np.inf)
    first = round(steps[0].stats.per_obspy.pad_before / DT)
    displacement = integrated(integrated(steps))[0].data[first : first + 12000]
    place = np.linspace(-1, 1, displacement.size)
    expected = (
        np.abs(Polynomial.fit(place, displacement, 5)(place)).max() / np.abs(displacement).max()
    )
    drift = displacement_drift(record[0].data, DT, 0.02, 5)
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
    assert clean_highpass(lambda f: 0.02 * (0.1 / f) ** 3, 0.001) == pytest.approx(0.1, rel=2e-3)


def test_the_corner_is_clean_from_there_on():
    # mutation: scanning upwards stops in the accidental dip at 0.01 Hz
    def bumpy(frequency):
        return 0.0 if 0.009 < frequency < 0.011 else 0.02 * 0.1 / frequency

    assert clean_highpass(bumpy, 0.009) == pytest.approx(0.1, rel=2e-3)


def test_a_narrow_band_of_drift_is_not_stepped_over():
    assert clean_highpass(lambda f: 0.03 if 0.1 < f < 0.125 else 0.01, 0.001) == pytest.approx(
        0.125, rel=2e-3
    )


def test_limits_of_the_corner():
    assert clean_highpass(lambda _: 0.0, 0.03) == 0.03
    assert clean_highpass(lambda _: 1.0, 0.03) is None


def test_a_recorded_drift_is_cleaned_to_the_target(earthquake):
    time = np.arange(12000) * DT
    record = tapered(
        Stream([Trace(earthquake() + 1e-3 * np.sin(2 * np.pi * time / 60), {"delta": DT})])
    )[0].data
    drift = displacement_drift(record, DT, 1 / 120, 5)
    corner = clean_highpass(drift, 1 / 120)
    assert drift(corner) == pytest.approx(0.02, abs=1e-3)
    assert drift(0.9 * corner) > 0.02
