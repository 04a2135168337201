"""Spectra of signal and noise, and their smoothing."""

import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from obspy.signal.konnoohmachismoothing import konno_ohmachi_smoothing

from per_obspy.processing import signal_to_noise
from per_obspy.processing.signal_to_noise import (
    NoiseSpectra,
    clear_band,
    konno_ohmachi,
    noise_spectra,
    significant_samples,
    sustained_ratio,
)

DT = 0.01
BANDWIDTH = 20.0  # of the Konno-Ohmachi window


@pytest.mark.parametrize("quiet", [2000, 8000])
def test_the_ratio_of_two_white_noises_is_the_ratio_of_their_sizes(quiet):
    # mutation: without the scaling of the noise to the signal's length the ratio depends on the
    # windows
    samples = np.random.default_rng(3).normal(size=quiet + 4000)
    samples[quiet:] *= 10
    spectra = noise_spectra(samples, DT, quiet * DT, BANDWIDTH)
    inside = (spectra.frequencies > 1) & (spectra.frequencies < 40)
    # the smoothing averages some hundred independent lines: a few percent
    assert np.median(spectra.ratio[inside]) == pytest.approx(10.0, rel=0.05)


def test_noise_below_one_cycle_of_its_window_is_not_taken_for_silence():
    samples = np.random.default_rng(4).normal(size=5000)
    spectra = noise_spectra(samples, DT, 5.0, BANDWIDTH)
    unknown = spectra.frequencies < 0.19
    assert_array_equal(spectra.noise[unknown] >= 0.999 * spectra.noise[unknown][-1], True)


def test_the_spectra_are_proportional_to_the_motion():
    samples = np.random.default_rng(5).normal(size=4000)
    once = noise_spectra(samples, DT, 10.0, BANDWIDTH)
    twice = noise_spectra(-2 * samples, DT, 10.0, BANDWIDTH)
    assert_allclose(twice.signal, 2 * once.signal, rtol=1e-10)
    assert_allclose(twice.ratio, once.ratio, rtol=1e-10)


def test_the_amplitude_of_a_pulse_is_its_integral():
    # a short pulse of area 1 m/s has the Fourier amplitude 1 m/s where its wavelength is long;
    # shaking at 20 Hz, which does not reach there, keeps the window open after it
    time = np.arange(4000) * DT
    samples = np.where(time >= 25, 5 * np.sin(40 * np.pi * time), 0.0)
    samples[2100:2120] += 1 / (20 * DT)
    spectra = noise_spectra(samples, DT, 18.0, BANDWIDTH)
    # the tone begins abruptly, which leaks 3 % of the pulse's amplitude to low frequency
    assert_allclose(
        spectra.signal[(spectra.frequencies > 0.1) & (spectra.frequencies < 0.5)], 1.0, rtol=0.05
    )


def test_tapers_cover_a_twentieth_of_the_window_at_each_end():
    # one impulse halfway up the first taper, the other at the end, where the last one is zero
    samples = np.zeros(2000 + 4001)
    samples[[2100, -1]] = 1.0
    spectra = noise_spectra(samples, DT, 20.0, BANDWIDTH)
    assert_allclose(spectra.signal, 0.5 * DT, rtol=1e-9)


def test_the_signal_ends_with_95_percent_of_its_energy():
    assert significant_samples(np.ones(1000)) == 950


def spectra(ratio):
    return NoiseSpectra(
        np.geomspace(0.1, 10, len(ratio)), np.asarray(ratio, dtype=float), np.ones(len(ratio))
    )


def test_the_widest_clear_band_is_found():
    found = spectra([3, 1, 3, 3, 3, 1, 3])
    assert clear_band(found, 2.0) == (found.frequencies[2], found.frequencies[4])
    assert clear_band(spectra([1, 1]), 2.0) is None
    assert clear_band(spectra([3, 3, 3]), 2.0) == (0.1, 10.0)


def test_spectra_inside_a_band():
    assert spectra([0.5, 3, 2.5, 4, 0.5]).within(0.2, 5.0).ratio.min() == 2.5


def test_a_single_line_above_the_noise_is_no_signal():
    ratio = np.ones(81)
    ratio[40] = 100
    assert sustained_ratio(spectra(ratio)) == 1.0
    ratio[40:54] = 5  # an octave is 12 of the 40 lines of a decade
    assert sustained_ratio(spectra(ratio)) == 5.0


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


@pytest.mark.parametrize("factor", [1e-6, 3.0])
def test_smoothing_is_linear(factor):
    spectra = np.random.default_rng(2).random((2, 601))
    smooth = konno_ohmachi(spectra, STEP, CENTRES, 20.0)
    scaled = konno_ohmachi(factor * spectra, STEP, CENTRES, 20.0)
    assert_allclose(scaled, factor * smooth, rtol=1e-12)
