"""Probability of pounding: Monte Carlo, integration over the plane, limits, monotony."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from per_obspy.pounding.critical_gap import critical_gap
from per_obspy.pounding.probability import pounding_probability

CASES = [
    (0.2, 0.1, 0.0, 0.25, 0.4, 0.4, 0.5, 0.1, 0.1), (0.2, 0.2, 0.99, 0.02, 0.4, 0.4, 0.8, 0.0, 0.0),
    (0.2, 0.2, 1.0, 0.02, 0.4, 0.4, 0.8, 0.0, 0.0), (0.2, 0.15, -0.5, 0.3, 0.3, 0.4, 1.0, 0.0, 0.0),
    (0.2, 0.15, 0.5, 0.1, 0.0, 0.4, 0.8, 0.0, 0.0), (0.3, 0.1, 0.3, 0.3, 0.5, 0.2, -0.4, 0.14, 0.0),
]  # fmt: skip


def simulated_probability(case, count, seed=0):
    """Return the Monte Carlo estimate of the probability; its error is about 0.5/sqrt(count)."""
    r1, r2, rho, gap, beta_1, beta_2, shared, model, gap_dispersion = case
    normal = np.random.default_rng(seed).standard_normal((3, count))

    # Correlated logarithms of the radii, independent errors of model and gap
    second = shared * normal[0] + np.sqrt(1.0 - shared**2) * normal[1]
    radii = r1 * np.exp(beta_1 * normal[0]), r2 * np.exp(beta_2 * second)
    rest = np.exp(np.hypot(model, gap_dispersion) * normal[2])
    return np.mean(critical_gap(*radii, rho) * rest > gap)


def first_order_probability(case):
    """Return the estimate by the elasticities s1, s2 of the critical gap, whose sum is 1."""
    r1, r2, rho, gap, beta_1, beta_2, shared, model, gap_dispersion = case
    # each elasticity times the dispersion of its radius
    demand = critical_gap(r1, r2, rho)
    part_1 = r1 * (r1 - rho * r2) / demand**2 * beta_1
    part_2 = r2 * (r2 - rho * r1) / demand**2 * beta_2
    variance = part_1**2 + part_2**2 + 2.0 * shared * part_1 * part_2
    spread = np.sqrt(variance + model**2 + gap_dispersion**2)
    return norm.cdf(np.log(demand / gap) / spread)


@pytest.mark.parametrize("case", CASES)
def test_against_monte_carlo(case):
    # mutation: variance of the difference with the wrong sign, conditional mean without its slope,
    # e^d for e^2d. 400 000 samples: a standard error of 8e-4, four of them
    simulated = simulated_probability(case, count=400_000)
    assert pounding_probability(*case) == pytest.approx(simulated, abs=3.2e-3)


@pytest.mark.parametrize("case", [CASES[0], CASES[5]])
def test_against_integration_over_both_radii(case):
    # mutation: anything in the reduction to one dimension. The trapezoidal rule over the plane of
    # ln r1 and ln r2 converges exponentially, because the integrand is smooth and ends at zero
    r1, r2, rho, gap, b1, b2, shared, model, spread = case
    line = np.linspace(-7.5, 7.5, 1501)  # beyond 7.5: 1e-13
    x, y = np.meshgrid(line, line, sparse=True)

    # x moves both radii, y only what structure 2 does not share
    first = r1 * np.exp(b1 * x)
    second = r2 * np.exp(b2 * (shared * x + np.sqrt(1 - shared**2) * y))
    demand = np.sqrt(first**2 + second**2 - 2 * rho * first * second)
    chance = norm.cdf(np.log(demand / gap) / np.hypot(model, spread))
    expected = np.sum(norm.pdf(x) * norm.pdf(y) * chance) * 0.01**2
    assert pounding_probability(*case) == pytest.approx(expected, abs=1e-7)


@given(
    st.floats(0.01, 1.0),
    st.floats(0.01, 1.0),
    st.floats(-1.0, 1.0),
    st.floats(0.01, 1.0),
    st.floats(0.05, 0.6),
)
@settings(max_examples=40)
def test_radii_that_move_together_have_a_closed_form(r1, r2, correlation, gap, dispersion):
    # mutation: dispersion of the ratio not vanishing. Then ln g_cr is normal around its median
    demand = np.sqrt((r1 - r2) ** 2 + 2 * (1 - correlation) * r1 * r2)
    expected = norm.cdf(np.log(demand / gap) / np.hypot(dispersion, 0.2)) if demand > 0 else 0.0
    found = pounding_probability(r1, r2, correlation, gap, dispersion, dispersion, 1.0, 0.2)
    assert found == pytest.approx(expected, abs=1e-12)


@given(st.floats(0.05, 0.5), st.floats(0.05, 0.5), st.floats(-0.99, 0.99), st.floats(-0.9, 0.9))
@settings(max_examples=25)
def test_symmetry_scale_and_monotony(r1, r2, correlation, shared):
    # mutation: structure 1 favoured; a length in metres where a ratio should stand; gap and demand
    # exchanged
    gaps = np.array([0.05, 0.1, 0.2, 0.4])
    here = pounding_probability(r1, r2, correlation, gaps, 0.3, 0.5, shared, 0.1)
    there = pounding_probability(r2, r1, correlation, gaps, 0.5, 0.3, shared, 0.1)
    np.testing.assert_allclose(here, there, atol=1e-10)
    larger = pounding_probability(7 * r1, 7 * r2, correlation, 7 * gaps, 0.3, 0.5, shared, 0.1)
    np.testing.assert_allclose(here, larger, atol=1e-10)
    assert np.all(np.diff(here) <= 1e-12)  # nearly certain ones differ by rounding only
    assert here[0] > here[-1]


@given(
    st.floats(0.05, 0.6),
    st.floats(-0.9, 1.0),
    st.floats(1.05, 20.0),
    st.sampled_from([0.0, 1e-9, 3e-5, 1e-4]),
)
@settings(max_examples=40)
def test_radii_that_grow_as_the_other_shrinks_have_a_closed_form(
    dispersion, correlation, cosine, model
):
    # mutation: a jump of the chance inside a panel, which no rule of points sees (7e-5 of the
    # probability). Equal radii, correlation -1: g_cr² / r² = 2 cosh(2 b x) - 2 rho, x standard
    # normal. A model error blurs the crossing x by its own size over the slope, which counts by its
    # square
    gap = 0.2 * np.sqrt(2.0 * (cosine - correlation))
    crossing = np.arccosh(cosine) / (2.0 * dispersion)
    blur = model * (cosine - correlation) / (np.sqrt(cosine**2 - 1.0) * dispersion)
    found = pounding_probability(0.2, 0.2, correlation, gap, dispersion, dispersion, -1.0, model)
    assert found == pytest.approx(2.0 * norm.sf(crossing), abs=1e-13 + 3.0 * blur**2)


def test_certainty_walls_and_touching_pairs():
    # mutation: log of zero, NaN in place of an answer
    assert pounding_probability(0.1, 0.1, 0.0, [0.1, 0.2], 0.0, 0.0, 0.0).tolist() == [1.0, 0.0]
    assert pounding_probability(0.1, 0.1, 0.5, 0.0, 0.3, 0.3, 0.5) == 1.0
    assert pounding_probability(0.0, 0.0, 0.5, 0.0, 0.3, 0.3, 0.5) == 0.0
    wall = pounding_probability([0.1, 0.0], [0.0, 0.1], 0.3, 0.1, 0.3, 0.3, 0.5)
    np.testing.assert_allclose(wall, 0.5, atol=1e-12)
    # no model error and only structure 2 uncertain: r2 must exceed a root of the quadratic, 3-4-5
    expected = norm.cdf(np.log(0.4 / 0.5) / 0.3)
    assert pounding_probability(0.3, 0.4, 0.0, np.hypot(0.3, 0.5), 0.0, 0.3, 0.0) == pytest.approx(
        expected, abs=1e-9
    )


def test_first_order_is_close_only_for_unlike_radii():
    # why it is not offered: equal radii with correlated responses give 0.49 for 0.88
    unlike, alike = CASES[0], (0.2, 0.2, 0.99, 0.0285, 0.4, 0.4, 0.5, 0.0, 0.0)
    assert first_order_probability(unlike) == pytest.approx(pounding_probability(*unlike), abs=0.05)
    assert first_order_probability(alike) < pounding_probability(*alike) - 0.3
