"""Functions of rows of numbers against SciPy and NumPy."""

import numpy as np
from scipy.special import ndtr

from per_obspy.kernels.vector_functions import (
    exponentials,
    exponentials_less_one,
    logarithms,
    normal_tails,
)

SCRATCH = np.empty(200, np.int64)


def test_exponentials():
    # mutation: a coefficient, the sign of the exponent, one of the parts of ln 2
    x = np.concatenate(
        [np.linspace(-700.0, 700.0, 100), np.linspace(-1.0, 1.0, 97), [0.0, -1e3, -np.inf]]
    )
    found = x.copy()
    exponentials(found, SCRATCH)
    np.testing.assert_allclose(
        found[:-2], np.exp(x[:-2]), rtol=1e-15
    )  # a few units of the last place
    assert found[-3] == 1.0
    assert np.all(found[-2:] < 1e-307)


def test_exponentials_less_one():
    # mutation: one taken from the exponential, which leaves nothing of a small number
    x = np.concatenate(
        [
            np.linspace(-3.0, 3.0, 100),
            np.geomspace(1e-300, 1.0, 49),
            -np.geomspace(1e-300, 1.0, 49),
            [0.0, 700.0],
        ]
    )
    found = x.copy()
    exponentials_less_one(found, SCRATCH)
    np.testing.assert_allclose(found, np.expm1(x), rtol=1e-15)


def test_logarithms():
    # mutation: mantissa from 1 to 2, whose series is too short; the exponent's sign
    x = np.concatenate([np.geomspace(1e-300, 1e300, 100), np.linspace(0.5, 2.0, 99), [1.0]])
    found = x.copy()
    logarithms(found, SCRATCH)
    np.testing.assert_allclose(found, np.log(x), rtol=1e-15, atol=1e-16)
    assert found[-1] == 0.0


def test_normal_tails():
    # mutation: the lower tail; an error near 0 or far out. Rounding of x² counts x² times: 3e-13
    # at 36
    x = np.concatenate([np.linspace(-6.0, 6.0, 150), np.linspace(6.0, 36.0, 47), [0.0, 1e3, -1e3]])
    found = x.copy()
    normal_tails(found, np.empty(200), SCRATCH)
    np.testing.assert_allclose(found[:-2], ndtr(-x[:-2]), rtol=5e-13)
    np.testing.assert_allclose(found, ndtr(-x), atol=5e-15)
    assert found[-1] == 1.0
