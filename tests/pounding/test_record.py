"""Correlation of a record: the time integral by SciPy, Parseval's theorem, limits."""

import numpy as np
import pytest

from per_obspy.pounding.correlation import ddc_correlation, record_correlation

DT = 0.02


def record(seed=4, count=400):
    rng = np.random.default_rng(seed)
    motion = rng.standard_normal(count) * np.sin(np.linspace(0, np.pi, count)) ** 2
    motion[0] = motion[-1] = 0.0
    return motion


@pytest.mark.parametrize(
    "pair", [(0.5, 0.05, 0.8, 0.05), (0.2, 0.02, 2.0, 0.1), (1.0, 0.05, 1.01, 0.04)]
)
def test_parseval(pair):
    # mutation: the tail of free vibration left out; u1 u2 at samples instead of the integral
    motion = record()
    frequency, power = power_spectrum(motion)
    first, second = transfer(frequency, *pair[:2]), transfer(frequency, *pair[2:])
    covariance = np.sum((first * second.conj()).real * power)
    variances = np.sum(abs(first) ** 2 * power) * np.sum(abs(second) ** 2 * power)
    # 1e-9: the response has died out by exp(-0.02 w 1300 s) at the period of the transform
    expected = covariance / np.sqrt(variances)
    assert record_correlation(motion, DT, *pair) == pytest.approx(expected, abs=1e-9)


def power_spectrum(motion, count=2**16):
    """
    Return circular frequencies from 0 and the power of a piecewise-linear record at each.

    Its transform is the periodic sum times dt sinc²; H falls like 1/w², 16 repeats do.
    """
    numbers = np.arange(8 * count)
    spectrum = np.fft.fft(motion, count)[numbers % count] * np.sinc(numbers / count) ** 2
    power = np.abs(spectrum) ** 2
    power[0] /= 2  # half a strip at the static end
    return 2 * np.pi * numbers / (count * DT), power


def transfer(frequency, period, damping):
    omega = 2 * np.pi / period
    return 1 / (omega**2 - frequency**2 + 2j * damping * omega * frequency)


def test_a_short_pulse_is_white():
    # mutation: anything that colours the input. A pulse of 1e-4 s against periods of 1 s
    found = record_correlation([0.0, 1.0, 0.0], 1e-4, 1.0, [0.02, 0.05], 1.3, 0.1)
    np.testing.assert_allclose(found, ddc_correlation(1.0, [0.02, 0.05], 1.3, 0.1), atol=1e-6)


def test_twins_symmetry_and_broadcasting():
    # mutation: an axis of the table exchanged
    motion = record()
    periods_1, periods_2 = np.array([[0.5], [1.0]]), np.array([0.5, 1.0, 2.0])
    table = record_correlation(motion, DT, periods_1, 0.05, periods_2, 0.05)
    assert table.shape == (2, 3)
    assert table[0, 0] == pytest.approx(1.0, abs=1e-12)
    assert table[0, 1] == pytest.approx(table[1, 0], abs=1e-12)
    assert np.all(abs(table) <= 1)
    np.testing.assert_allclose(
        record_correlation(-3 * motion, DT, 0.5, 0.05, 2.0, 0.05), table[0, 2], atol=1e-12
    )
