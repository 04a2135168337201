import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.processing.signal_to_noise import (
    NoiseSpectra,
    clear_band,
    noise_spectra,
    significant_samples,
    sustained_ratio,
    weakest_ratio,
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


def test_the_weakest_ratio_is_that_inside_the_band():
    assert weakest_ratio(spectra([0.5, 3, 2.5, 4, 0.5]), (0.2, 5.0)) == 2.5


def test_a_single_line_above_the_noise_is_no_signal():
    ratio = np.ones(81)
    ratio[40] = 100
    assert sustained_ratio(spectra(ratio)) == 1.0
    ratio[40:54] = 5  # an octave is 12 of the 40 lines of a decade
    assert sustained_ratio(spectra(ratio)) == 5.0
