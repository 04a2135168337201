"""
Correlation under stationary ground motion: Lyapunov equation, quadrature and white noise agree.

Covers ``per_obspy.pounding.stationary_ground``,
``per_obspy.pounding.stationary_ground`` and
``per_obspy.pounding.stationary_ground``.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.stationary_ground import (
    CloughPenzien,
    KanaiTajimi,
    WhiteNoise,
    ground_correlation,
    linear_oscillator,
    psd_correlation,
    stationary_covariance,
)

WHITE = WhiteNoise(0.01)
FIRM = CloughPenzien(15.6, 0.6, 1.0, 0.6, 0.01)
LAKEBED = CloughPenzien(np.pi, 0.1, 0.5, 0.6, 0.01)
PAIRS = [(1.0, 0.05, 1.2, 0.05), (0.3, 0.02, 2.0, 0.1), (1.5, 0.05, 2.5, 0.05)]


def transfer(frequency, period, damping):
    omega = 2 * np.pi / period
    return 1 / (omega**2 - frequency**2 + 2j * damping * omega * frequency)


def quadrature(density, one, two, points):
    """Return the integral of Re(H1 H2*) times the density over all frequencies."""

    def integrand(frequency):
        product = transfer(frequency, *one) * np.conj(transfer(frequency, *two))
        return product.real * float(density(frequency))

    peaks = sorted({*points, 2 * np.pi / one[0], 2 * np.pi / two[0]})
    near = quad(integrand, 0, 400, points=peaks, limit=4000, epsabs=0, epsrel=1e-11)[0]
    # beyond 400 rad/s the integrand is smooth and below 1e-7 of the whole; w = 1/t makes it finite
    far = quad(lambda t: integrand(1 / t) / t**2, 0, 1 / 400, epsabs=0, epsrel=1e-4)[0]
    return near + far


@pytest.mark.parametrize("ground", [WHITE, KanaiTajimi(15.6, 0.6, 0.01), FIRM, LAKEBED])
@pytest.mark.parametrize("pair", PAIRS)
def test_lyapunov_and_quadrature_agree(ground, pair):
    # mutation: a sign or a factor in a filter, the intensity 2 pi S0, the density of a filter
    one, two = pair[:2], pair[2:]
    variance_1 = quadrature(ground.psd, one, one, points=(np.pi, 15.6))
    variance_2 = quadrature(ground.psd, two, two, points=(np.pi, 15.6))
    expected = quadrature(ground.psd, one, two, points=(np.pi, 15.6))
    expected /= np.sqrt(variance_1 * variance_2)
    # 1e-9 is required; quad reaches 1e-10 at its far end
    assert ground_correlation(ground, *pair) == pytest.approx(expected, abs=1e-9)
    covariance = stationary_covariance(ground, linear_oscillator(*one), linear_oscillator(*two))
    assert covariance[0, 0] == pytest.approx(2 * variance_1, rel=1e-9)


FREQUENCIES = np.linspace(0.2, 30.0, 40)
DENSITY = np.random.default_rng(7).uniform(0.1, 1.0, 40)


def tabulated_quadrature(one, two, accuracy):
    """Return the integral of Re(H1 H2*) times the table, with a break at each of its points."""

    def integrand(w):
        product = transfer(w, *one) * np.conj(transfer(w, *two))
        return product.real * np.interp(w, FREQUENCIES, DENSITY)

    # resonances between the points of the table too
    peaks = [*FREQUENCIES[1:-1], 2 * np.pi / one[0], 2 * np.pi / two[0]]
    return quad(integrand, 0.2, 30, points=peaks, limit=4000, epsabs=accuracy, epsrel=1e-11)[0]


@pytest.mark.parametrize("pair", [*PAIRS, (1.0, 0.005, 1.001, 0.005)])
def test_tabulated_density(pair):
    # mutation: a residue, a pole's half plane; a table that misses a resonance between its points
    one, two = pair[:2], pair[2:]
    own = np.sqrt(tabulated_quadrature(one, one, 0.0) * tabulated_quadrature(two, two, 0.0))
    expected = tabulated_quadrature(one, two, 1e-11 * own) / own
    assert psd_correlation(DENSITY, FREQUENCIES, *pair) == pytest.approx(expected, abs=1e-10)


@given(st.floats(0.1, 4.0), st.floats(0.01, 0.5), st.floats(0.1, 4.0), st.floats(0.01, 0.5))
@settings(max_examples=30)
def test_white_noise_is_equation_16(period_1, damping_1, period_2, damping_2):
    # mutation: a force that reaches only one structure; real part of H1 H2 instead of H1 H2*
    pair = period_1, damping_1, period_2, damping_2
    expected = float(ddc_correlation(*pair))
    assert ground_correlation(WHITE, *pair) == pytest.approx(expected, abs=1e-9)
    # a band of 1e6 rad/s leaves out the share (w T)^-3 of the response
    assert psd_correlation([2.0, 2.0], [0.0, 1e6], *pair) == pytest.approx(expected, abs=1e-9)


def test_a_fine_table_of_a_ground_is_that_ground():
    frequencies = np.linspace(0.0, 300.0, 60001)
    for pair in PAIRS:
        found = psd_correlation(LAKEBED.psd(frequencies), frequencies, *pair)
        assert found == pytest.approx(
            ground_correlation(LAKEBED, *pair), abs=1e-5
        )  # (5e-3 rad/s over the peak's 0.3)²/12
