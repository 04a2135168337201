"""The stochastic method's parts against their closed forms; the field with its correlation."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.simulation import earthquake as stochastic

FREQUENCY = np.geomspace(0.01, 50.0, 40)


def test_moment_of_hanks_and_kanamori():
    # log10 M0 = 1.5 M + 16.05 in dyne cm (1 N m = 1e7 dyne cm)
    assert_allclose(stochastic.seismic_moment(7.0) * 1e7, 10 ** (1.5 * 7 + 16.05), rtol=1e-12)


def test_corners_of_atkinson_and_silva():
    # log fa = 2.181 - 0.496 M, log fb = 2.410 - 0.408 M, log eps = 0.605 - 0.255 M at M 5 and 7
    for magnitude, corners in ((5.0, (0.5023, 2.344, 0.2138)), (7.0, (0.05117, 0.3581, 0.06607))):
        assert_allclose(stochastic.source_of(magnitude), corners, rtol=5e-4)  # four digits by hand


def test_source_spectrum_limits():
    low, high = stochastic.source_spectrum(np.array([1e-5, 1e4]), 6.0, 3500.0, 2800.0)
    constant = (
        0.55 * 2 / np.sqrt(2) / (4 * np.pi * 2800 * 3500.0**3) * stochastic.seismic_moment(6.0)
    )
    source = stochastic.source_of(6.0)
    # flat in displacement below both corners, flat in acceleration above: (f/f_a)**2 = 4e-9 and
    # (f_b/f)**2 = 1e-8 off
    assert_allclose(low, (2 * np.pi * 1e-5) ** 2 * constant, rtol=1e-6)
    corners = np.array([source.low_corner, source.high_corner])
    shares = np.array([1.0 - source.high_share, source.high_share])
    assert_allclose(high, (shares * (2 * np.pi * corners) ** 2).sum() * constant, rtol=1e-6)


def test_two_corners_give_less_long_period_motion_than_one():
    # same moment and same level above the corners, as Brune's source of one stress drop; between
    # the corners, at 2 to 5 s of magnitude 7, less
    frequency = np.array([1e-4, 0.2, 0.5, 1e3])
    two = stochastic.source_spectrum(frequency, 7.0, 3500.0, 2800.0)
    source = stochastic.source_of(7.0)
    squares = np.array([source.low_corner, source.high_corner]) ** 2
    corner = np.sqrt(np.dot([1.0 - source.high_share, source.high_share], squares))
    one = two[0] / (1e-8) * frequency**2 / (1.0 + (frequency / corner) ** 2)
    assert_allclose(two[[0, 3]] / one[[0, 3]], 1.0, rtol=1e-4)  # (1e-4 / f_a)**2 = 4e-6
    assert (two[1:3] < 0.9 * one[1:3]).all()


def test_spreading_is_continuous_and_turns():
    def spreading(distance: float) -> float:
        # no attenuation
        return stochastic.path_spectrum(np.array([1.0]), distance, 3500.0, np.inf, 0.0)[0]

    crossover = stochastic.CROSSOVER
    assert_allclose(spreading(crossover * (1 - 1e-12)), spreading(crossover), rtol=1e-11)
    assert_allclose(spreading(1e4) / spreading(2e4), 2.0, rtol=1e-12)
    assert_allclose(spreading(1e5) / spreading(4e5), 2.0, rtol=1e-12)


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
    path = 5e-5 * 1e4
    shaking = stochastic.duration(6.0, 1e4)
    # Two magnitudes lower the corner by 10**(0.496 * 2); 100 km of path add 5 s
    larger = stochastic.duration(8.0, 1e4)
    assert_allclose(larger - path, 10**0.992 * (shaking - path), rtol=1e-12)
    assert_allclose(stochastic.duration(6.0, 1.1e5) - shaking, 5.0, rtol=1e-12)


def test_large_faults_are_never_near():
    # Atkinson & Silva (2000): h = 10**(-0.05 + 0.15 M) km, 10 km for M 7
    assert_allclose(stochastic.effective_distance(0.0, 7.0), 1e4, rtol=1e-12)
    assert_allclose(stochastic.effective_distance(1e6, 7.0), 1e6, rtol=2e-4)


REACH = 20_000.0
FIELD_FREQUENCIES = np.array([0.2, 1.0, 1.0 * np.exp(stochastic.FREQUENCY_LENGTH), 20.0])

#: Fields of a test.
FIELDS = 500

#: Standard error of a standard deviation, and of a correlation near 0, from so many fields is
#: 0.032 and 0.045: four times the larger.
TOLERANCE = 0.18


def fields(east: float, north: float = 0.0) -> np.ndarray:
    values = [
        stochastic.log_variation(
            np.random.default_rng(seed), (east, north), REACH, FIELD_FREQUENCIES
        )
        for seed in range(FIELDS)
    ]
    return np.array(values)


def test_mean_and_deviation_are_those_of_a_standard_normal_variable():
    values = fields(3e6)  # far from the origin of the field, which is no special place
    assert_allclose(values.mean(axis=0), 0.0, atol=TOLERANCE)
    assert_allclose(values.std(axis=0), 1.0, atol=TOLERANCE)
    # a share of 0.954 lies within two deviations; standard error 0.009 for each frequency
    assert_allclose((np.abs(values) < 2.0).mean(axis=0), 0.954, atol=0.04)


def test_correlation_decays_with_distance_in_every_direction():
    origin = fields(0.0)
    for east, north in ((5e3, 0.0), (0.0, 5e3), (-3e3, 4e3)):
        products = (origin * fields(east, north)).mean(axis=0)
        assert_allclose(products, np.exp(-3.0 * 5e3 / REACH), atol=TOLERANCE)
    # exp(-15) at five times the reach
    assert_allclose((origin * fields(1e5)).mean(axis=0), 0.0, atol=TOLERANCE)


def test_correlation_decays_with_the_ratio_of_frequencies():
    values = fields(0.0)
    expected = np.exp(
        -np.abs(np.subtract.outer(*[np.log(FIELD_FREQUENCIES)] * 2)) / stochastic.FREQUENCY_LENGTH
    )
    assert_allclose(values.T @ values / FIELDS, expected, atol=TOLERANCE)


def test_a_place_knows_its_own_value_only_by_its_coordinates():
    alone = stochastic.log_variation(
        np.random.default_rng(7), (10.0, 20.0), REACH, FIELD_FREQUENCIES[:2]
    )
    among = stochastic.log_variation(
        np.random.default_rng(7), (10.0, 20.0), REACH, FIELD_FREQUENCIES
    )
    assert_allclose(alone, among[:2], rtol=1e-15)


def test_the_field_is_constant_beyond_its_frequencies():
    low = stochastic.log_variation(
        np.random.default_rng(7), (0.0, 0.0), REACH, np.array([0.0, 1e-3, 1e-2])
    )
    assert_allclose(low, low[-1], rtol=1e-15)
