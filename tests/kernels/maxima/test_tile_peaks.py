"""Maxima between the samples of tiles, against a search of every step without any bounds."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.maxima.strided_samples import (
    CHECKPOINT_ROWS,
    MAXIMA_LANES,
    OSCILLATOR_ROWS,
    pack_oscillator,
    run_strides,
)
from per_obspy.kernels.maxima.tile_peaks import raise_to_tile_peaks
from per_obspy.kernels.oscillator.within_step import largest_in_step, workspace
from per_obspy.kernels.spectra.tile_search import TILE

DAMPING, PHASES = 0.05, (0.05, 0.2, 0.4)
NORTH = (
    np.random.default_rng(9).normal(size=3 * TILE + 1)
    * np.repeat([1.0, 0.7, 1.2, 0.0], TILE)[: 3 * TILE + 1]
)
EAST = np.zeros(3 * TILE + 1)


def _largest(stride, first, last):
    """Return largest squared radii and displacements in a window of tiles, (2, lanes)."""
    table = np.empty((OSCILLATOR_ROWS, MAXIMA_LANES))
    for lane in range(MAXIMA_LANES):
        pack_oscillator(stride, PHASES[lane % 3], DAMPING, 1.0, 0.0, table, lane)
    checkpoints = np.empty((3, CHECKPOINT_ROWS, MAXIMA_LANES))
    run_strides(stride, NORTH, EAST, 0, np.zeros(MAXIMA_LANES), table, checkpoints)
    limits = np.zeros((4, 3))
    for tile in range(3):
        samples = NORTH[tile * TILE : (tile + 1) * TILE + 1]
        limits[0, tile] = np.abs(samples).max()
        limits[2, tile] = np.abs(np.diff(samples)).max()
    windows = np.array([[first], [last]]) * np.ones((2, MAXIMA_LANES))
    largest = np.zeros((2, MAXIMA_LANES))
    raise_to_tile_peaks(stride, NORTH, EAST, limits, 0, windows, table, checkpoints, largest)
    return largest


def _searched(states, phase, first, last):
    """Return the same for one oscillator, from all stationary points of every step."""
    largest, selected = np.zeros(4), np.array([True, True, False, False])
    for i in range(first * TILE, (last + 1) * TILE):
        u, z = states[i]
        largest[:2] = np.maximum(largest[:2], [u * u + z * z, abs(u)])
        largest_in_step(
            u, z, NORTH[i], NORTH[i + 1], DAMPING, phase, selected, workspace(), largest
        )
    return largest[:2]


@pytest.mark.parametrize("stride", [1, 2, 4])
@pytest.mark.parametrize(("first", "last"), [(0, 2), (1, 1)])
def test_no_peak_between_samples_is_missed(stride, first, last, plain_states):
    # mutations: a bound too small for strides of several steps, a tile outside the window searched
    largest = _largest(stride, first, last)
    for lane, phase in enumerate(PHASES):
        states = plain_states(NORTH, phase, DAMPING)
        expected = _searched(states, phase, first, last)
        # rounding of 192 steps
        assert_allclose(largest[:, lane], expected, rtol=1e-12)
        assert_allclose(largest[:, lane + 3], largest[:, lane], rtol=0.0)
