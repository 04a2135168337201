"""Equation (16): symmetry, limits, and the white-noise integral that it solves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_lyapunov

from per_obspy.pounding.correlation import ddc_correlation

periods = st.floats(0.02, 20.0)
dampings = st.floats(0.0, 0.99)
ROUNDING = 1e-13  # a dozen operations on doubles


@given(periods, dampings, periods, dampings)
def test_exchanging_the_structures_changes_nothing(period_1, damping_1, period_2, damping_2):
    # mutation: xi1 and xi2 swapped in the numerator
    there = ddc_correlation(period_1, damping_1, period_2, damping_2)
    back = ddc_correlation(period_2, damping_2, period_1, damping_1)
    assert there == pytest.approx(back, rel=ROUNDING)
    assert 0 <= there <= 1


@given(periods, st.floats(1e-300, 0.99))
def test_twins_are_fully_correlated(period, damping):
    # mutation: any coefficient of (16); and squares of small dampings that underflow to 0/0
    assert ddc_correlation(period, damping, period, damping) == pytest.approx(1.0, abs=ROUNDING)


@given(periods, dampings, periods, dampings, st.sampled_from([2.0**-7, 0.5, 8.0]))
def test_only_the_period_ratio_matters(period_1, damping_1, period_2, damping_2, factor):
    # mutation: a period where a ratio should stand. A power of two keeps every digit of the periods
    once = ddc_correlation(period_1, damping_1, period_2, damping_2)
    scaled = ddc_correlation(factor * period_1, damping_1, factor * period_2, damping_2)
    assert scaled == pytest.approx(once, rel=ROUNDING)


def test_undamped_oscillators():
    # 0/0 of (16): two undamped oscillators keep their phase only if their periods agree
    assert ddc_correlation(1.0, 0.0, 1.0, 0.0) == 1.0
    assert ddc_correlation(1.0, 0.0, 1.1, 0.0) == 0.0
    assert ddc_correlation(1.0, 0.0, 1.0, 0.05) == 0.0


@pytest.mark.parametrize(("period_1", "damping_1", "period_2", "damping_2"), [
    (1.0, 0.05, 1.2, 0.05), (0.5, 0.02, 0.7, 0.2), (2.0, 0.3, 0.4, 0.9), (1.0, 0.01, 1.001, 0.011),
    (3.0, 0.02, 0.3, 0.2),
])  # fmt: skip
def test_it_is_the_covariance_under_white_noise(period_1, damping_1, period_2, damping_2):
    # mutation: xi1 + xi2 T2/T1 for xi2 + xi1 T2/T1 (43 % at 0.02/0.2). SciPy's Lyapunov solver
    # knows nothing of (16)
    state, force = np.zeros((4, 4)), np.array([0.0, 1.0, 0.0, 1.0])
    for first, period, damping in ((0, period_1, damping_1), (2, period_2, damping_2)):
        omega = 2 * np.pi / period
        state[first, first + 1] = 1.0
        state[first + 1, first : first + 2] = -(omega**2), -2 * damping * omega
    covariance = solve_continuous_lyapunov(state, -np.outer(force, force))
    expected = covariance[0, 2] / np.sqrt(covariance[0, 0] * covariance[2, 2])
    # 1e-10: the solver's own conditioning with dampings near 0.01
    assert ddc_correlation(period_1, damping_1, period_2, damping_2) == pytest.approx(
        expected, rel=1e-10
    )


def test_broadcasting():
    table = ddc_correlation(np.array([[1.0], [2.0]]), 0.05, np.array([1.0, 1.5, 2.0]), 0.05)
    assert table.shape == (2, 3)
    assert table[0, 0] == pytest.approx(1.0)
    assert table[1, 2] == pytest.approx(1.0)
