"""The stochastic method's parts, each against its closed form."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.records.simulation import stochastic

FREQUENCY = np.geomspace(0.01, 50.0, 40)


def test_moment_of_hanks_and_kanamori():
    # log10 M0 = 1.5 M + 16.05 in dyne cm (1 N m = 1e7 dyne cm)
    assert_allclose(stochastic.seismic_moment(7.0) * 1e7, 10 ** (1.5 * 7 + 16.05), rtol=1e-12)


def test_corner_frequency_in_the_units_of_the_paper():
    # f_c = 4.9e6 beta (stress drop / M0)**(1/3): km/s, bar, dyne cm; M 7, 100 bar, 3.5 km/s
    expected = 4.9e6 * 3.5 * (100 / 10 ** (1.5 * 7 + 16.05)) ** (1 / 3)
    assert_allclose(stochastic.corner_frequency(7.0, 10e6, 3500.0), expected, rtol=1e-12)


def test_source_spectrum_limits():
    low, high = stochastic.source_spectrum(np.array([1e-4, 1e3]), 6.0, 10e6, 3500.0, 2800.0)
    constant = (
        0.55 * 2 / np.sqrt(2) / (4 * np.pi * 2800 * 3500.0**3) * stochastic.seismic_moment(6.0)
    )
    corner = stochastic.corner_frequency(6.0, 10e6, 3500.0)
    # flat in displacement below the corner, flat in acceleration above: (f/fc)**2 = 1e-7 and 1e-7
    # off
    assert_allclose(low, (2 * np.pi * 1e-4) ** 2 * constant, rtol=1e-6)
    assert_allclose(high, (2 * np.pi * corner) ** 2 * constant, rtol=1e-6)


def test_spreading_is_continuous_and_turns():
    crossover = stochastic.CROSSOVER
    assert_allclose(
        stochastic.spreading(crossover * (1 - 1e-12)), stochastic.spreading(crossover), rtol=1e-11
    )
    assert_allclose(stochastic.spreading(1e4) / stochastic.spreading(2e4), 2.0, rtol=1e-12)
    assert_allclose(stochastic.spreading(1e5) / stochastic.spreading(4e5), 2.0, rtol=1e-12)


def test_attenuation_of_constant_quality():
    # exponent 0: exp(-pi f R / (Q beta)), times spreading
    found = stochastic.path_spectrum(FREQUENCY, 1e4, 3500.0, 200.0, 0.0)
    assert_allclose(found, np.exp(-np.pi * FREQUENCY * 1e4 / (200 * 3500)) / 1e4, rtol=1e-12)


def test_rock_amplifies_and_kappa_takes_it_away():
    tabulated = stochastic.rock_response(np.array([0.51, 16.6]), 0.0)
    assert_allclose(tabulated, [1.42, 3.13], rtol=1e-12)
    # Kappa divides by exp(pi kappa f)
    ratio = stochastic.rock_response(FREQUENCY, 0.04) / stochastic.rock_response(FREQUENCY, 0.0)
    assert_allclose(ratio, np.exp(-0.04 * np.pi * FREQUENCY), rtol=1e-12)
    assert np.isfinite(stochastic.rock_response(np.array([0.0]), 0.04)).all()


def test_kanai_tajimi_limits():
    low, resonance, high = np.abs(stochastic.kanai_tajimi(np.array([1e-6, 0.5, 500.0]), 0.5, 0.1))
    assert_allclose(low, 1.0, rtol=1e-9)
    assert_allclose(resonance, np.sqrt(1 + 0.2**2) / 0.2, rtol=1e-12)
    assert_allclose(high, 0.2 / 1000.0, rtol=1e-3)  # 2 xi / r, off by 1/(2 xi r)**2 / 2


def test_kanai_tajimi_does_not_ring_before_it_is_struck():
    # would catch the conjugate, which is as large but runs backwards
    n, dt = 2**14, 0.01
    impulse = np.fft.irfft(stochastic.kanai_tajimi(np.fft.rfftfreq(n, dt), 0.5, 0.1), n)
    # the jump at time zero, cut at the Nyquist frequency, spreads over some samples on either side
    assert np.abs(impulse[n // 2 : -100]).max() < 1e-3 * np.abs(impulse).max()


@pytest.mark.parametrize("shaking", [2.0, 12.0])
def test_window_peaks_where_boore_puts_it(shaking):
    dt = 0.001
    shape = stochastic.saragoni_hart_window(int(6 * shaking / dt), dt, shaking)
    assert_allclose(shape.argmax() * dt, 0.2 * 2 * shaking, atol=2 * dt)
    assert_allclose(shape.max(), 1.0, rtol=1e-5)  # a sample next to the peak
    assert_allclose(shape[round(2 * shaking / dt)], 0.05, rtol=1e-9)
    assert shape[0] == 0.0


def test_shaped_noise_has_the_spectrum_on_average():
    # 400 rows: the mean square of a frequency scatters by 1/sqrt(400) = 5 %, and 20 frequencies are
    # averaged: 1.1 %
    n, dt = 1024, 0.01
    noise = np.random.default_rng(1).standard_normal((400, n))
    spectrum = 1.0 + np.fft.rfftfreq(n, dt).astype(complex)
    found = np.fft.rfft(stochastic.shaped_noise(noise, np.ones(n), spectrum, dt)) * dt
    mean = np.sqrt(np.mean(np.abs(found) ** 2, axis=0) / np.abs(spectrum) ** 2)
    assert_allclose(mean[1:-1].reshape(-1, 7).mean(axis=1), 1.0, atol=0.06)


def test_larger_events_and_distances_shake_longer():
    shaking = stochastic.duration(6.0, 1e4, 10e6, 3500.0)
    path = 5e-5 * 1e4
    # Two magnitudes lower the corner frequency by ten; 100 km of path add 5 s
    larger = stochastic.duration(8.0, 1e4, 10e6, 3500.0)
    assert_allclose(larger - path, 10 * (shaking - path), rtol=1e-12)
    farther = stochastic.duration(6.0, 1.1e5, 10e6, 3500.0)
    assert_allclose(farther - shaking, 5.0, rtol=1e-12)


def test_large_faults_are_never_near():
    # Yenier & Atkinson (2015): h = 10**(-0.405 + 0.235 M) km, 17.4 km for M 7
    assert_allclose(stochastic.effective_distance(0.0, 7.0), 17.4e3, rtol=0.005)
    assert_allclose(stochastic.effective_distance(1e6, 7.0), 1e6, rtol=2e-4)
