"""Blocks of oscillators looked at every 1, 2 or 4 steps, so short that they also run uncompiled."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.oscillator.strides import (
    CHECKPOINT_ROWS,
    MAXIMA_LANES,
    OSCILLATOR_ROWS,
    SQUARE,
    fill_stride_weights,
    pack_oscillator,
    run_strides,
)
from per_obspy.kernels.spectra.tile_search import TILE

NORTH, EAST = np.random.default_rng(5).standard_normal((2, 3 * TILE + 1))
LANES = np.arange(MAXIMA_LANES)
PHASES = np.geomspace(1e-3, 8.0, MAXIMA_LANES)
DAMPINGS = np.where(LANES % 4 == 0, 0.0, np.linspace(0.01, 0.9, MAXIMA_LANES))
WEIGHTS = np.array([np.cos(LANES), np.sin(LANES)])


def _packed(stride):
    table = np.empty((OSCILLATOR_ROWS, MAXIMA_LANES))
    for lane in LANES:
        pack_oscillator(stride, PHASES[lane], DAMPINGS[lane], *WEIGHTS[:, lane], table, lane)
    return table


def _along(lane):
    """Return the acceleration along the azimuth of an oscillator."""
    return WEIGHTS[0, lane] * NORTH + WEIGHTS[1, lane] * EAST


@pytest.mark.parametrize("stride", [1, 2, 4])
def test_strides_are_so_many_steps(stride, plain_states):
    # mutations: a sample's weight belongs to its neighbour, the matrix of one step, values between
    # strides looked at
    table, checkpoints = _packed(stride), np.empty((3, CHECKPOINT_ROWS, MAXIMA_LANES))
    run_strides(stride, NORTH, EAST, 0, np.zeros(MAXIMA_LANES), table, checkpoints)
    for lane in range(0, MAXIMA_LANES, 5):
        states = plain_states(_along(lane), PHASES[lane], DAMPINGS[lane])
        tolerance = 1e-12 * np.abs(states).max()
        assert_allclose(checkpoints[:, :2, lane], states[: 3 * TILE : TILE], atol=tolerance)
        assert_allclose(table[:2, lane], states[-1], atol=tolerance)
        sampled = states[TILE : 2 * TILE + 1 : stride]
        square, displacement = checkpoints[1, SQUARE : SQUARE + 2, lane]
        assert_allclose(square, (sampled**2).sum(axis=1).max(), rtol=1e-10)
        assert_allclose(displacement, np.abs(sampled[:, 0]).max(), rtol=1e-10)


def test_each_oscillator_is_at_rest_before_its_own_start(plain_states):
    # mutation: all oscillators of a block start with the earliest
    table, checkpoints = _packed(2), np.empty((3, CHECKPOINT_ROWS, MAXIMA_LANES))
    starts = np.full(MAXIMA_LANES, 11.0)
    starts[7] = 10.0
    run_strides(2, NORTH, EAST, 10, starts, table, checkpoints)
    for lane, first in ((6, TILE), (7, 0)):
        states = plain_states(_along(lane)[first:], PHASES[lane], DAMPINGS[lane])
        assert_allclose(table[:2, lane], states[-1], atol=1e-12 * np.abs(states).max())


@pytest.mark.parametrize("stride", [1, 2, 4, 8])
def test_a_stride_is_as_many_steps(stride):
    # mutations: a weight that is moved on once too often, a sample that counts once where two
    # steps share it
    phase, damping = 0.4, 0.1
    step = step_coefficients(1.0, damping, phase)
    displaced, moved = np.zeros((2, stride + 1))
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
