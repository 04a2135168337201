"""Weights of the samples of a stride: per_obspy.kernels.oscillator.exact_stride."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.oscillator.exact_stride import fill_stride_weights


@pytest.mark.parametrize("stride", [1, 2, 4, 8])
def test_a_stride_is_as_many_steps(stride):
    # mutations: a weight that is moved on once too often, a sample that counts once where two
    # steps share it
    phase, damping = 0.4, 0.1
    step = step_coefficients(1.0, damping, phase)
    displaced, moved = np.full((2, stride + 1), np.nan)
    fill_stride_weights(step, stride, displaced, moved)
    samples = np.random.default_rng(stride).normal(size=stride + 1)
    u, z = state = 0.3, -0.7
    a11, a12, a21, a22, b11, b12, b21, b22 = step
    for start, end in pairwise(samples):
        u, z = (
            a11 * u + a12 * z + b11 * start + b12 * end,
            a21 * u + a22 * z + b21 * start + b22 * end,
        )
    matrix = np.reshape(step_coefficients(1.0, damping, stride * phase)[:4], (2, 2))
    assert_allclose(matrix @ state + [displaced @ samples, moved @ samples], [u, z], rtol=1e-13)
