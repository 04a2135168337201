"""First root of a polynomial in a stretch of a table's line."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.polynomial_roots import first_fall


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
