"""
Statistical linearization of pairs: limits, simulation, scaling, and bandwidths of ground motions.

Covers ``per_obspy.pounding.linearization`` and ``per_obspy.pounding.linearization``.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from per_obspy.pounding.linearization import (
    bandwidth,
    davenport_peak_factor,
    ductility_correlation,
    linearized_correlation,
    record_bandwidth,
)
from per_obspy.pounding.stationary_ground import (
    CloughPenzien,
    WhiteNoise,
    ground_correlation,
    linear_oscillator,
    stationary_covariance,
)
from per_obspy.pounding.structure import Structure

WHITE = WhiteNoise(0.01)
FIRM = CloughPenzien(15.6, 0.6, 1.0, 0.6, 0.01)
DAMPED = Structure(1.0, 0.1, 1.0)
LAKEBED = CloughPenzien(np.pi, 0.1, 0.5, 0.6, 0.01)


def test_bandwidth_tells_lakebed_from_firm_ground():
    assert bandwidth(LAKEBED) < 0.35 < bandwidth(WHITE) < bandwidth(FIRM)
    # a constant density from 0 to the end: moments 1, 1/2, 1/3
    assert bandwidth(WHITE) == pytest.approx(0.5, abs=1e-4)  # sum over 20 001 frequencies


@given(st.floats(0.3, 3.0), st.floats(0.3, 3.0), st.floats(0.02, 0.2))
@settings(max_examples=10)
def test_linear_structures_keep_their_correlation(period_1, period_2, damping):
    # mutation: a stiffness that does not return to the elastic one
    pair = Structure(period_1, damping, 1.0), Structure(period_2, damping, 1.0)
    found = linearized_correlation(*pair, FIRM)
    expected = ground_correlation(FIRM, period_1, damping, period_2, damping)
    for estimate in (found.krylov_bogoliubov, found.gauss_3):
        assert estimate.converged
        assert estimate.correlation == pytest.approx(expected, abs=1e-9)
        np.testing.assert_allclose(estimate.period, [period_1, period_2], rtol=1e-9)
        np.testing.assert_allclose(estimate.damping, damping, rtol=1e-9)
    assert found.recommended == pytest.approx(expected, abs=1e-9)


def yielding_pair(level, hardening=0.1):
    covariance = stationary_covariance(
        WHITE, linear_oscillator(1.0, 0.05), linear_oscillator(3.0, 0.05)
    )
    sigma = np.sqrt(covariance[[0, 2], [0, 2]])
    first = Structure(1.0, 0.05, 1.0, sigma[0] / level, hardening)
    return first, Structure(3.0, 0.05, 1.0, sigma[1] / level, hardening)


def test_against_simulations_of_yielding_pairs():
    # Monte Carlo of both structures (4 x 200 000 steps, white noise, hardening 0.1): 0.42 at 1.5;
    # the method's own accuracy is 0.07, and Krylov-Bogoliubov is known to give 0.12
    found = linearized_correlation(*yielding_pair(1.5), WHITE)
    assert found.gauss_3.correlation == pytest.approx(0.42, abs=0.07)
    assert found.krylov_bogoliubov.correlation == pytest.approx(0.12, abs=0.01)
    assert found.recommended == found.gauss_3.correlation


def test_stronger_shaking_lengthens_periods():
    # catches: periods that do not follow the response
    weak = linearized_correlation(*yielding_pair(0.7), WHITE)
    strong = linearized_correlation(*yielding_pair(1.5), WHITE)
    for method in ("krylov_bogoliubov", "gauss_3"):
        before, after = getattr(weak, method), getattr(strong, method)
        assert np.all(after.period > before.period)
        assert np.all(after.damping > before.damping)


def test_scaling_strength_with_the_motion_changes_nothing():
    # mutation: an absolute length; the square of the level. A quarter of the intensity is half the
    # motion
    pair = yielding_pair(1.0)
    weaker = [replace(s, yield_displacement=s.yield_displacement / 2) for s in pair]
    full = linearized_correlation(*pair, WHITE)
    half = linearized_correlation(*weaker, WhiteNoise(0.0025))
    for method in ("krylov_bogoliubov", "gauss_3"):
        before, after = getattr(full, method), getattr(half, method)
        assert after.correlation == pytest.approx(before.correlation, abs=1e-9)
    np.testing.assert_allclose(half.gauss_3.sigma, full.gauss_3.sigma / 2, rtol=1e-8)


def test_no_hardening_leaves_krylov_bogoliubov_only():
    found = linearized_correlation(*yielding_pair(1.5, hardening=0.0), WHITE)
    assert not found.gauss_3.converged
    assert np.isnan(found.gauss_3.correlation)
    assert found.krylov_bogoliubov.converged
    assert found.recommended == found.krylov_bogoliubov.correlation


def test_narrow_ground_takes_the_smaller():
    pair = Structure(1.5, 0.05, 1.0, 0.05, 0.1), Structure(2.5, 0.05, 1.0, 0.05, 0.1)
    found = linearized_correlation(*pair, LAKEBED)
    assert found.recommended == min(found.krylov_bogoliubov.correlation, found.gauss_3.correlation)
    assert (
        linearized_correlation(*pair, LAKEBED, narrow=0.1).recommended == found.gauss_3.correlation
    )


HARDENED = (
    Structure(1.0, 0.05, 1.0, hardening=0.05),
    Structure(1.5, 0.05, 1.0, hardening=0.05),
)


def test_prescribed_ductility_needs_no_intensity():
    # mutation: a level that depends on the response
    weak = ductility_correlation(*HARDENED, 4.0, 2.0, WhiteNoise(1e-4), 3.0)
    strong = ductility_correlation(*HARDENED, 4.0, 2.0, WhiteNoise(1.0), 3.0)
    assert weak.correlation == pytest.approx(strong.correlation, abs=1e-10)


def test_a_ductility_of_one_is_linear():
    linear = ductility_correlation(*HARDENED, 1.0, 1.0, FIRM)
    expected = ground_correlation(FIRM, 1.0, 0.05, 1.5, 0.05)
    assert linear.correlation == pytest.approx(expected, abs=1e-12)


def test_prescribed_ductility_is_the_amplitude_iteration_at_its_yield_displacements():
    # mutation: peak factor and ductility exchanged
    prescribed = ductility_correlation(*HARDENED, 4.0, 2.0, WhiteNoise(1.0), 3.0)
    first = replace(HARDENED[0], yield_displacement=3.0 * prescribed.sigma[0] / 4.0)
    second = replace(HARDENED[1], yield_displacement=3.0 * prescribed.sigma[1] / 2.0)
    found = linearized_correlation(first, second, WhiteNoise(1.0)).krylov_bogoliubov
    assert found.correlation == pytest.approx(prescribed.correlation, abs=1e-9)


def test_davenport_peak_factor():
    # 100 crossings: sqrt(2 ln 100) + 0.5772/sqrt(2 ln 100)
    assert davenport_peak_factor(2 * np.pi, 100.0) == pytest.approx(3.0349 + 0.1902, abs=1e-4)
    with pytest.raises(ValueError, match="more than one crossing"):
        davenport_peak_factor(2 * np.pi, 0.5)


class TestBandwidthOfARecord:
    def test_white_noise_has_that_of_a_flat_spectrum(self):
        # moments of a flat spectrum from 0 on: sqrt(1 - (1/2)² / (1/3)) = 1/2; 20 000 samples
        # scatter by a hundredth
        north, east = np.random.default_rng(1).normal(size=(2, 20_000))
        assert record_bandwidth(north, east, 0.02) == pytest.approx(0.5, abs=0.01)

    def test_a_sine_has_none_along_any_azimuth(self):
        # catches: one component alone; leakage of 200 cycles stays below a few hundredths
        sine = np.sin(2 * np.pi * np.arange(20_000) * 0.01)
        for angle in (0.0, 1.0):
            assert record_bandwidth(np.cos(angle) * sine, np.sin(angle) * sine, 0.01) < 0.05

    def test_size_does_not_matter_and_no_motion_is_broad(self):
        north, east = np.random.default_rng(1).normal(size=(2, 500))
        assert record_bandwidth(7 * north, 7 * east, 0.02) == pytest.approx(
            record_bandwidth(north, east, 0.02), rel=1e-9
        )
        assert record_bandwidth(np.zeros(9), np.zeros(9), 0.02) == 1.0
