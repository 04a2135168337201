"""Smallest value and place of the largest one: per_obspy.kernels.extremes."""

import numpy as np
import pytest

from per_obspy.kernels.extremes import place_of_largest, smallest


@pytest.mark.parametrize("size", [1, 2, 65, 1000])
def test_extremes_are_those_of_plain_comparisons(size):
    # mutations: a first value that is not looked at, and bits of the number lost for its place
    random = np.random.default_rng(size)
    for scale in (1e-300, 1e-20, 1.0, 1e300):
        values = scale * random.exponential(size=size)
        assert smallest(values) == values.min()
        assert place_of_largest(values) == values.argmax()


def test_zeros_and_nearly_equal_values():
    assert smallest(np.array([2.0, 0.0, 1.0])) == 0.0
    assert place_of_largest(np.array([1.0, 1.0 + 1e-9, 1.0])) == 1
    assert place_of_largest(np.zeros(4096)) < 4096
    assert place_of_largest(np.r_[np.zeros(4095), 1e-300]) == 4095
