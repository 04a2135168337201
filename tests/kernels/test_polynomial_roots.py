"""The first root of a polynomial that falls, which no search may pass."""

import math

import numpy as np
import pytest
from numpy.polynomial import polynomial
from numpy.testing import assert_allclose

from per_obspy.kernels.polynomial_roots import (
    first_fall,
    is_last_root,
    safe_step,
    size_and_curvature,
    value_and_slope,
)


def _table(coefficients):
    """Return a table whose line 1 holds the coefficients from column 2 on."""
    table = np.full((2, len(coefficients) + 3), np.nan)
    table[1, 2:-1] = coefficients
    return table


def _first_fall(coefficients, end, sign=1.0, start=0.0):
    table = _table(coefficients)
    return first_fall(table, 1, 2, len(coefficients), sign, start, end, 0.0)


def test_value_and_slope():
    coefficients = [3.0, -1.0, 0.5, 2.0]
    expected = (
        polynomial.polyval(0.7, coefficients),
        polynomial.polyval(0.7, polynomial.polyder(coefficients)),
    )
    assert value_and_slope(_table(coefficients), 1, 2, 4, 0.7) == pytest.approx(expected, rel=1e-14)


def test_bounds_are_never_exceeded():
    random = np.random.default_rng(1)
    for _ in range(20):
        coefficients = random.normal(size=6)
        size, curvature = size_and_curvature(_table(coefficients), 1, 2, 6, 0.8)
        times = np.linspace(0.0, 0.8, 200)
        values = polynomial.polyval(times, coefficients) - coefficients[0]
        bends = polynomial.polyval(times, polynomial.polyder(coefficients, 2))
        assert np.abs(values).max() <= size * (1 + 1e-14)
        assert np.abs(bends).max() <= curvature * (1 + 1e-14)


@pytest.mark.parametrize("roots", [(0.3, 0.31, 0.9), (0.3, 0.3 + 1e-6, 0.9), (0.05,), (-0.2, 0.6)])
def test_the_first_fall_is_found(roots):
    # mutation: a step that is too long passes two close roots
    coefficients = polynomial.polyfromroots(roots)
    falling = [root for root in roots if root >= 0.0]
    sign = np.sign(coefficients[0])
    found = _first_fall(coefficients, 1.0, sign)
    # two roots 1e-6 from each other: 1e-15 of the terms is 1e-9 of the way to the first one
    assert found == pytest.approx(falling[0], abs=2e-8)


def test_a_rise_is_no_fall():
    # 0 at the start, up, and down to zero at 0.5
    assert _first_fall([0.0, 0.5, -1.0], 1.0) == pytest.approx(0.5, abs=1e-12)
    # up for ever
    assert _first_fall([0.0, 0.5, 1.0], 1.0) == -1.0
    # no root in the interval
    assert _first_fall([1.0, -0.5], 1.0) == -1.0
    assert _first_fall([-1.0, 2.0], 1.0, sign=-1.0) == pytest.approx(0.5, abs=1e-12)


def test_no_root_is_invented():
    assert _first_fall([1e-9, 0.0, 0.0, 1.0], 1.0) == -1.0
    # least 1e-7 above zero
    assert _first_fall([0.0400001, -0.4, 1.0], 1.0) == -1.0


@pytest.mark.parametrize("coefficients", [[0.0, 0.0, 0.0], [0.0, 1.0], [1.0]])
def test_polynomials_without_a_fall(coefficients):
    assert _first_fall(coefficients, 1.0) == -1.0
    assert _first_fall(coefficients, 0.0) == -1.0


def test_a_start_between_two_roots():
    coefficients = polynomial.polyfromroots((0.2, 0.5, 0.7))
    # the polynomial is positive from 0.2 to 0.5
    assert _first_fall(coefficients, 1.0, start=0.25) == pytest.approx(0.5, abs=1e-12)


def test_safe_steps_of_parabolas_are_their_roots():
    # value - closing t - curvature t² / 2 is the worst case, whose root is the step
    for value, closing, curvature in ((1.0, 2.0, 0.5), (1.0, -2.0, 0.5), (0.3, 0.0, 4.0)):
        step = safe_step(value, closing, curvature)
        rest = value - closing * step - 0.5 * curvature * step**2
        assert rest == pytest.approx(0.0, abs=1e-14)
    # convex and opening: never
    assert safe_step(1.0, -1.0, 0.0) == math.inf
    assert safe_step(1.0, 0.5, -2.0) == math.inf


def test_last_roots():
    coefficients = polynomial.polyfromroots((0.2, 0.9))
    table = _table(coefficients)
    assert not is_last_root(table, 1, 2, 3, 0.2, 1.0)
    # slope 0.7 at the root, curvature 2: it cannot turn within 0.3
    assert is_last_root(table, 1, 2, 3, 0.2, 0.5)


def fall(coefficients, end, sign=1.0, start=0.0):
    table = np.array([coefficients], dtype=float)
    return first_fall(table, 0, 0, len(coefficients), sign, start, end, 0.0)


class TestFirstFall:
    def test_takes_the_first_of_several_roots(self):
        # catches: a Newton step from the start, which lands on the last root
        polynomial = -np.poly([0.3, 0.31, 0.9])[::-1]  # positive at 0, roots 0.3, 0.31, 0.9
        # a slope of 0.006: rounding counts 200 times
        assert_allclose(fall(polynomial, 1.0), 0.3, rtol=1e-10)

    def test_does_not_invent_a_root(self):
        assert fall([1e-9, 0.0, 0.0, 1.0], 1.0) == -1.0
        assert fall([0.0400001, -0.4, 1.0], 1.0) == -1.0  # least 1e-7 above zero

    def test_leaves_a_rising_zero(self):
        # catches: a structure that has just been hit, hit again at once
        assert_allclose(fall([0.0, 1.0, -2.0], 1.0), 0.5, rtol=1e-12)

    @pytest.mark.parametrize("coefficients", [[0.0, 0.0, 0.0], [0.0, 1.0], [1.0]])
    def test_polynomial_without_a_fall(self, coefficients):
        assert fall(coefficients, 1.0) == -1.0
        assert fall(coefficients, 0.0) == -1.0
