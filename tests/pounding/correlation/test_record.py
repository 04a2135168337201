"""Correlation of a record: the time integral by SciPy, Parseval's theorem, limits."""

import numpy as np
import pytest

from per_obspy.pounding.correlation.record import record_correlation
from per_obspy.pounding.correlation.white_noise import ddc_correlation

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
    # mutation: the tail of free vibration left out; u1 u2 at samples instead of the integral. The
    # transform of a piecewise-linear record is its periodic sum times dt sinc²; H falls like 1/w²,
    # 16 repeats do
    motion, count = record(), 2**16
    places = np.arange(1, 8 * count)
    frequency = 2 * np.pi * places / (count * DT)
    power = np.abs(np.fft.fft(motion, count)[places % count] * np.sinc(places / count) ** 2) ** 2
    first, second = (
        1
        / ((2 * np.pi / period) ** 2 - frequency**2 + 2j * damping * 2 * np.pi / period * frequency)
        for period, damping in (pair[:2], pair[2:])
    )
    zero = (
        abs(np.sum(motion)) ** 2 / 2 * (pair[0] * pair[2] / (4 * np.pi**2)) ** 2
    )  # the static end, half a strip
    both = np.sum((first * second.conj()).real * power) + zero
    own = [
        np.sum(abs(h) ** 2 * power) + zero * (p / q) ** 2
        for h, p, q in ((first, pair[0], pair[2]), (second, pair[2], pair[0]))
    ]
    expected = both / np.sqrt(own[0] * own[1])
    # 1e-9: the response has died out by exp(-0.02 w 1300 s) at the period of the transform
    assert record_correlation(motion, DT, *pair) == pytest.approx(expected, abs=1e-9)


def test_a_short_pulse_is_white():
    # mutation: anything that colours the input. A pulse of 1e-4 s against periods of 1 s
    found = record_correlation([0.0, 1.0, 0.0], 1e-4, 1.0, [0.02, 0.05], 1.3, 0.1)
    np.testing.assert_allclose(found, ddc_correlation(1.0, [0.02, 0.05], 1.3, 0.1), atol=1e-6)


def test_twins_symmetry_and_broadcasting():
    motion = record()
    table = record_correlation(
        motion, DT, np.array([[0.5], [1.0]]), 0.05, np.array([0.5, 1.0, 2.0]), 0.05
    )
    assert table.shape == (2, 3)
    assert table[0, 0] == pytest.approx(1.0, abs=1e-12)
    assert table[0, 1] == pytest.approx(table[1, 0], abs=1e-12)
    assert np.all(abs(table) <= 1)
    np.testing.assert_allclose(
        record_correlation(-3 * motion, DT, 0.5, 0.05, 2.0, 0.05), table[0, 2], atol=1e-12
    )


@pytest.mark.parametrize(("name", "arguments"), [
    ("acceleration is 0", ([0.0, 0.0], 0.01, 1.0, 0.05, 1.0, 0.05)), ("dt", ([1.0], 0.0, 1.0, 0.05, 1.0, 0.05)),
    ("period_2", ([1.0], 0.01, 1.0, 0.05, -1.0, 0.05)), ("damping_1", ([1.0], 0.01, 1.0, 1.0, 1.0, 0.05)),
])  # fmt: skip
def test_bad_arguments_are_named(name, arguments):
    with pytest.raises(ValueError, match=name):
        record_correlation(*arguments)
