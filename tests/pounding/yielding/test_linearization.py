"""Ground motions, correlation under them, and statistical linearization: quadrature, limits, Monte Carlo integrals."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import multivariate_normal

from per_obspy.pounding.correlation.covariance import (
    ground_correlation,
    linear_oscillator,
    stationary_covariance,
)
from per_obspy.pounding.correlation.ground_spectrum import psd_correlation
from per_obspy.pounding.correlation.stochastic_ground import CloughPenzien, KanaiTajimi, WhiteNoise
from per_obspy.pounding.correlation.white_noise import ddc_correlation
from per_obspy.pounding.structure import Structure
from per_obspy.pounding.yielding.gauss import slip
from per_obspy.pounding.yielding.krylov import equivalent_stiffness, equivalent_viscosity
from per_obspy.pounding.yielding.linearization import (
    bandwidth,
    davenport_peak_factor,
    ductility_correlation,
    linearized_correlation,
    record_bandwidth,
)

WHITE = WhiteNoise(0.01)
FIRM = CloughPenzien(15.6, 0.6, 1.0, 0.6, 0.01)
LAKEBED = CloughPenzien(np.pi, 0.1, 0.5, 0.6, 0.01)
PAIRS = [(1.0, 0.05, 1.2, 0.05), (0.3, 0.02, 2.0, 0.1), (1.5, 0.05, 2.5, 0.05)]


def transfer(frequency, period, damping):
    omega = 2 * np.pi / period
    return 1 / (omega**2 - frequency**2 + 2j * damping * omega * frequency)


def quadrature(density, one, two, end=np.inf, points=()):
    def integrand(frequency):
        product = transfer(frequency, *one) * np.conj(transfer(frequency, *two))
        return product.real * float(density(frequency))

    middle = min(end, 400.0)
    peaks = sorted({p for p in (*points, 2 * np.pi / one[0], 2 * np.pi / two[0]) if 0 < p < middle})
    near = quad(integrand, 0, middle, points=peaks, limit=4000, epsabs=0, epsrel=1e-11)[0]
    # beyond 400 rad/s the integrand is smooth and below 1e-7 of the whole; w = 1/t makes it finite
    far = (
        quad(lambda t: integrand(1 / t) / t**2, 0, 1 / middle, epsabs=0, epsrel=1e-4)[0]
        if end > middle
        else 0.0
    )
    return near + far


@pytest.mark.parametrize("ground", [WHITE, KanaiTajimi(15.6, 0.6, 0.01), FIRM, LAKEBED])
@pytest.mark.parametrize("pair", PAIRS)
def test_lyapunov_and_quadrature_agree(ground, pair):
    # mutation: a sign or a factor in a filter, the intensity 2 pi S0, the density of a filter
    one, two = pair[:2], pair[2:]
    both, first, second = (
        quadrature(ground.psd, a, b, points=(np.pi, 15.6))
        for a, b in ((one, two), (one, one), (two, two))
    )
    # 1e-9 is required; quad reaches 1e-10 at its far end
    assert ground_correlation(ground, *pair) == pytest.approx(
        both / np.sqrt(first * second), abs=1e-9
    )
    covariance = stationary_covariance(ground, linear_oscillator(*one), linear_oscillator(*two))
    assert covariance[0, 0] == pytest.approx(2 * first, rel=1e-9)


@pytest.mark.parametrize("pair", [*PAIRS, (1.0, 0.005, 1.001, 0.005)])
def test_tabulated_density(pair):
    # mutation: a residue, a pole's half plane; a table that misses a resonance between its points
    rng = np.random.default_rng(7)
    frequencies, density = np.linspace(0.2, 30.0, 40), rng.uniform(0.1, 1.0, 40)
    one, two = pair[:2], pair[2:]

    def exact(a, b, accuracy):
        peaks = [*frequencies[1:-1], 2 * np.pi / a[0], 2 * np.pi / b[0]]

        def integrand(w):
            return (transfer(w, *a) * np.conj(transfer(w, *b))).real * np.interp(
                w, frequencies, density
            )

        return quad(integrand, 0.2, 30.0, points=peaks, limit=4000, epsabs=accuracy, epsrel=1e-11)[
            0
        ]

    own = np.sqrt(exact(one, one, 0.0) * exact(two, two, 0.0))
    expected = exact(one, two, 1e-11 * own) / own
    assert psd_correlation(density, frequencies, *pair) == pytest.approx(expected, abs=1e-10)


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


def test_bandwidth_tells_lakebed_from_firm_ground():
    assert bandwidth(LAKEBED) < 0.35 < bandwidth(WHITE) < bandwidth(FIRM)
    # a constant density from 0 to the end: moments 1, 1/2, 1/3
    assert bandwidth(WHITE) == pytest.approx(0.5, abs=1e-4)  # sum over 20 001 frequencies


@pytest.mark.parametrize("level", [0.3, 1.0, 2.0, 4.0])
def test_krylov_bogoliubov_coefficients(level):
    # mutation: a factor of Caughey's integrals. Here: his averages over amplitude and phase by
    # brute force
    def in_phase(amplitude):
        if amplitude <= level:
            return amplitude**2
        turn = np.arccos(1 - 2 * level / amplitude)
        return amplitude**2 / np.pi * (turn - 0.5 * np.sin(2 * turn))

    def average(function):
        return quad(
            lambda a: function(a) * a * np.exp(-(a**2) / 2), 0, 14, points=[level], limit=400
        )[0]

    assert equivalent_stiffness(level) == pytest.approx(average(in_phase) / 2, abs=1e-9)
    # energy of an elastoplastic loop 4 uy (A - uy) against that of a dashpot, pi A² per unit of I_S
    dissipated = average(lambda a: 4 * level * max(a - level, 0.0) / np.pi) / 2
    assert equivalent_viscosity(level) == pytest.approx(dissipated, abs=1e-9)


@pytest.mark.parametrize(("limit", "coherence"), [(0.5, 0.6), (1.5, 0.3), (1.0, -0.2), (0.2, 0.9)])
def test_gauss_3_coefficients(limit, coherence):
    # mutation: a sign of the coherence, Owen's T, a factor 2. Least squares of y' - v
    # = -p v - q y with jointly normal v, y
    density = multivariate_normal(cov=[[1.0, coherence], [coherence, 1.0]])
    p, q = slip(limit, 1.0, 1.0, coherence)
    grid = np.linspace(-8.0, 8.0, 801)
    beyond = np.linspace(limit, limit + 8.0, 401)
    v, y = np.meshgrid(grid[grid >= 0], beyond, indexing="ij")
    weight = density.pdf(np.stack([v, y], axis=-1))
    trapezoid = [
        np.gradient(axis) * np.where((axis == axis[0]) | (axis == axis[-1]), 0.5, 1.0)
        for axis in (grid[grid >= 0], beyond)
    ]
    weight = weight * trapezoid[0][:, None] * trapezoid[1][None, :]
    # both directions of slip contribute alike: E[slip v], E[slip y] with slip = v where v > 0 and y
    # > limit
    moments = 2 * np.array([np.sum(weight * v * v), np.sum(weight * v * y)])
    fitted = np.linalg.solve([[1.0, coherence], [coherence, 1.0]], moments)
    np.testing.assert_allclose([p, q], fitted, atol=2e-4)  # trapezoid of 0.02


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
    return Structure(1.0, 0.05, 1.0, sigma[0] / level, hardening), Structure(
        3.0, 0.05, 1.0, sigma[1] / level, hardening
    )


def test_against_simulations_of_yielding_pairs():
    # Monte Carlo of both structures (4 x 200 000 steps, white noise, hardening 0.1): 0.42 at 1.5;
    # the method's own accuracy is 0.07, and Krylov-Bogoliubov is known to give 0.12
    found = linearized_correlation(*yielding_pair(1.5), WHITE)
    assert found.gauss_3.correlation == pytest.approx(0.42, abs=0.07)
    assert found.krylov_bogoliubov.correlation == pytest.approx(0.12, abs=0.01)
    assert found.recommended == found.gauss_3.correlation


def test_stronger_shaking_lengthens_periods_and_scaling_strength_with_it_changes_nothing():
    # mutation: an absolute length; the square of the level
    weak, strong = (linearized_correlation(*yielding_pair(level), WHITE) for level in (0.7, 1.5))
    for before, after in (
        (weak.krylov_bogoliubov, strong.krylov_bogoliubov),
        (weak.gauss_3, strong.gauss_3),
    ):
        assert np.all(after.period > before.period)
        assert np.all(after.damping > before.damping)
    one, two = yielding_pair(1.0)
    half = [
        Structure(s.period, s.damping, s.mass, s.yield_displacement / 2, s.hardening)
        for s in (one, two)
    ]
    there, here = (
        linearized_correlation(one, two, WHITE),
        linearized_correlation(*half, WhiteNoise(0.0025)),
    )
    assert here.gauss_3.correlation == pytest.approx(there.gauss_3.correlation, abs=1e-9)
    assert here.krylov_bogoliubov.correlation == pytest.approx(
        there.krylov_bogoliubov.correlation, abs=1e-9
    )
    np.testing.assert_allclose(here.gauss_3.sigma, there.gauss_3.sigma / 2, rtol=1e-8)


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


def test_prescribed_ductility_needs_no_intensity():
    pair = Structure(1.0, 0.05, 1.0, hardening=0.05), Structure(1.5, 0.05, 1.0, hardening=0.05)
    weak, strong = (ductility_correlation(*pair, 4.0, 2.0, WhiteNoise(s), 3.0) for s in (1e-4, 1.0))
    assert weak.correlation == pytest.approx(strong.correlation, abs=1e-10)
    linear = ductility_correlation(*pair, 1.0, 1.0, FIRM)
    assert linear.correlation == pytest.approx(
        ground_correlation(FIRM, 1.0, 0.05, 1.5, 0.05), abs=1e-12
    )
    # the amplitude iteration at the yield displacements that it implies gives the same
    limits = [
        3.0 * sigma / ductility for sigma, ductility in zip(strong.sigma, (4.0, 2.0), strict=True)
    ]
    same = [
        Structure(s.period, s.damping, 1.0, limit, 0.05)
        for s, limit in zip(pair, limits, strict=True)
    ]
    found = linearized_correlation(*same, WhiteNoise(1.0)).krylov_bogoliubov
    assert found.correlation == pytest.approx(strong.correlation, abs=1e-9)


def test_davenport_peak_factor():
    # 100 crossings: sqrt(2 ln 100) + 0.5772/sqrt(2 ln 100)
    assert davenport_peak_factor(2 * np.pi, 100.0) == pytest.approx(3.0349 + 0.1902, abs=1e-4)
    with pytest.raises(ValueError, match="more than one crossing"):
        davenport_peak_factor(2 * np.pi, 0.5)


@pytest.mark.parametrize(("name", "call"), [
    ("intensity", lambda: WhiteNoise(0.0)), ("damping", lambda: KanaiTajimi(1.0, -0.1, 1.0)),
    ("low_frequency", lambda: CloughPenzien(1.0, 0.1, 0.0, 0.6, 1.0)),
    ("damping", lambda: linearized_correlation(Structure(1.0, 0.0, 1.0), Structure(1.0, 0.1, 1.0), WHITE)),
    ("ductility_2", lambda: ductility_correlation(Structure(1, 0.1, 1), Structure(1, 0.1, 1), 2.0, 0.0, WHITE)),
    ("frequencies must increase", lambda: psd_correlation([1, 1], [1, 1], 1, 0.1, 1, 0.1)),
    ("psd is 0", lambda: psd_correlation([0, 0], [0, 1], 1, 0.1, 1, 0.1)),
    ("equal length", lambda: psd_correlation([1, 1, 1], [0, 1], 1, 0.1, 1, 0.1)),
    ("damping_1", lambda: psd_correlation([1, 1], [0, 1], 1, 0.0, 1, 0.1)),
    ("damping_2", lambda: ground_correlation(WHITE, 1, 0.1, 1, 0.0)),
])  # fmt: skip
def test_bad_arguments_are_named(name, call):
    with pytest.raises(ValueError, match=name):
        call()


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
