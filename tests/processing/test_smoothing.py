import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose
from obspy.signal.konnoohmachismoothing import konno_ohmachi_smoothing

from per_obspy.processing import signal_to_noise
from per_obspy.processing.signal_to_noise import konno_ohmachi

STEP = 0.05
CENTRES = tuple(np.geomspace(0.5, 20.0, 25))


def test_against_the_full_window_of_obspy():
    frequencies = STEP * np.arange(1, 601)
    spectrum = 1 + np.random.default_rng(1).random(600) + frequencies
    places = np.searchsorted(frequencies, CENTRES)
    expected = konno_ohmachi_smoothing(spectrum, frequencies, 20, normalize=True)[places]
    found = konno_ohmachi(np.concatenate(([0.0], spectrum)), STEP, tuple(frequencies[places]), 20.0)
    # the side lobes left out weigh 0.2 % each of the centre, all together 1 % of the window
    assert_allclose(found, expected, rtol=0.01)


def test_a_flat_spectrum_stays_flat_even_where_it_is_coarse():
    # mutation: weights that are not normalised; centres below the first line
    centres = (0.001, 0.06, 1.0, 29.0)
    assert_allclose(konno_ohmachi(np.ones(601), STEP, centres, 20.0), 1.0, rtol=1e-12)


@pytest.mark.parametrize("factor", [1e-6, 3.0])
def test_smoothing_is_linear(factor):
    spectra = np.random.default_rng(2).random((2, 601))
    smooth = konno_ohmachi(spectra, STEP, CENTRES, 20.0)
    scaled = konno_ohmachi(factor * spectra, STEP, CENTRES, 20.0)
    assert_allclose(scaled, factor * smooth, rtol=1e-12)


def test_a_long_spectrum_is_smoothed_as_a_short_one_in_little_memory(monkeypatch):
    # would catch weights of a day of samples that take gigabytes
    lines, centres = 2**15, tuple(np.geomspace(0.05, 90, 200).tolist())
    amplitudes = np.random.default_rng(1).uniform(size=(2, lines))
    stored = konno_ohmachi(amplitudes, 100 / lines, centres, 20.0)
    monkeypatch.setattr(signal_to_noise, "MOST_STORED", 1)
    tracemalloc.start()
    found = konno_ohmachi(amplitudes, 100 / lines, centres, 20.0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # The same products summed in another order: 2**15 positive terms, rounded at 1e-16 each
    assert_allclose(found, stored, rtol=1e-12)
    # A few arrays of one window, rather than 40 weights with their places for each line
    assert peak < 8 * 8 * lines
