"""The single-hit kernel without any wrapper, so short that it also runs uncompiled."""

import math

import numpy as np
import pytest

from per_obspy.kernels.pairs.single_hit import OK, _sine_products, estimate


def test_sine_products():
    # mutation: a coefficient of a series, the reduction by whole turns
    for phase in (0.0, 1e-9, 0.3, math.pi / 2, math.pi, 5.0, 40.0, 1000.0):
        square, product = _sine_products(phase)
        expected = math.sin(phase / 2) ** 2, math.sin(phase / 2) * math.cos(phase / 2)
        # rounding of the phase itself
        assert (square, product) == pytest.approx(expected, rel=1e-14, abs=1e-16 * max(phase, 1.0))


def test_equal_pair():
    # twins at rho = 0: x = g/2; contact at zero gap a quarter period earlier with the relative
    # speed w g
    arguments = np.array([[1.0], [1.0], [2.0], [2.0], [1.0], [1.0], [1.0], [math.sqrt(2.0)], [0.0]])
    status, branches, bounds = np.empty(1, np.int8), np.empty((2, 13, 1)), np.empty((2, 1))
    estimate(arguments, 0, status.size, status, branches, bounds)
    assert status[0] == OK
    assert branches[:, 0, 0] == pytest.approx(math.pi / 4)
    assert branches[:, 2, 0] - branches[:, 8, 0] == pytest.approx(2.0 * math.sqrt(2.0))
    # elastic twins exchange their states: neither gains
    assert branches[:, 5, 0] == pytest.approx(1.0)
    # the bound: both at full opposite speed, exchanged at zero gap, or any exchange between them
    assert bounds[:, 0] == pytest.approx(1.0)
