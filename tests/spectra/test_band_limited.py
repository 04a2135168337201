"""Band-limited interpolation against motions whose response is known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.spectra.band_limited import band_limited
from per_obspy.spectra.elastic import per_spectrum

DT = 0.02


def _burst(time):
    """Band limited to 18 Hz (below the 25 Hz of DT) to within exp(-18)."""
    return np.exp(-(((time - 2.0) / 0.3) ** 2)) * np.sin(2 * np.pi * 12.0 * time)


def test_samples_of_a_band_limited_motion_are_found():
    # without the division by sinc², values would be the motion itself; with factor 64 it changes
    # them by 1e-4
    record = _burst(np.arange(200) * DT)
    dense = band_limited(record, DT, 64)
    exact = _burst(np.arange(dense.acceleration.size) * DT / 64)
    assert dense.acceleration.size == 199 * 64 + 1
    assert_allclose(dense.acceleration, exact, atol=2e-4)


def test_spectra_come_close_to_those_of_the_motion():
    # catches a missing or inverted sinc²: coarse straight lines are wrong by 15 %
    periods = np.array([0.04, 0.06, 0.0833, 0.12, 0.3])
    truth = per_spectrum(_burst(np.arange(200 * 64) * DT / 64), DT / 64, periods)
    record = _burst(np.arange(200) * DT)
    coarse = per_spectrum(record, DT, periods)
    fine = per_spectrum(*band_limited(record, DT, 8), periods)
    assert np.abs(coarse / truth - 1).max() > 0.1
    assert_allclose(fine, truth, rtol=2e-3)


def test_the_record_stays_unchanged_and_zero_stays_zero():
    record = np.ones(50)
    band_limited(record, DT)
    assert_array_equal(record, np.ones(50))
    assert_array_equal(band_limited(np.zeros(9), DT, 3).acceleration, np.zeros(25))


@pytest.mark.parametrize("factor", [1, 2.5, -3])
def test_wrong_factors_are_named(factor):
    with pytest.raises(
        ValueError, match=rf"factor must be a whole number of at least 2, got {factor}"
    ):
        band_limited([1.0, 2.0], DT, factor)
