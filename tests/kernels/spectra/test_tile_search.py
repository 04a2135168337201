"""The search of tiles for largest values, against a search of every step without any bounds."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.kernels.oscillator.strides import (
    CHECKPOINT_ROWS,
    MAXIMA_LANES,
    OSCILLATOR_ROWS,
    pack_oscillator,
    run_strides,
)
from per_obspy.kernels.oscillator.within_step import largest_in_step, workspace
from per_obspy.kernels.spectra import response, tile_search
from per_obspy.kernels.spectra.tile_search import LANES, TILE, raise_between_samples

TILES = 3
GROUND = np.random.default_rng(3).normal(size=(2, TILES * TILE + 1)) * [[1.0], [0.5]]
PHASES = np.geomspace(0.02, 2.5, LANES)
DAMPINGS = np.where(np.arange(LANES) % 2 == 0, 0.02, 0.4)
WEIGHTS = np.stack([np.cos(np.arange(LANES)), np.sin(np.arange(LANES))])


@pytest.fixture(scope="module")
def extremes():
    peaks, jumps = np.empty((2, TILES)), np.empty((2, TILES))
    for component in range(2):
        tile_search.tile_extremes(GROUND[component], peaks[component], jumps[component])
    return peaks, jumps


def test_extremes_of_tiles(extremes):
    # mutation: the last sample of a tile, or the change to it, left out
    peaks, jumps = extremes
    for tile in range(TILES):
        samples = GROUND[:, tile * TILE : (tile + 1) * TILE + 1]
        assert_array_equal(peaks[:, tile], np.abs(samples).max(axis=1))
        assert_array_equal(jumps[:, tile], np.abs(np.diff(samples)).max(axis=1))


def test_values_of_tiles():
    checkpoints = np.random.default_rng(4).uniform(size=(4, 5, LANES))
    largest = np.full((3, LANES), 0.5)
    tile_search.raise_to_tiles(checkpoints, 3, largest)
    assert_array_equal(largest, np.maximum(checkpoints[:3, 2:].max(axis=0), 0.5))


def _searched(states, along, phase, damping, window):
    """Return the largest four values of an oscillator from all stationary points of every step."""
    largest, work = np.zeros(4), workspace()
    for i in range(window[0] * TILE, (window[1] + 1) * TILE):
        u, z = states[i]
        values = [u * u + z * z, abs(u), abs(z), abs(u + 2 * damping * z)]
        largest = np.maximum(largest, values)
        largest_in_step(u, z, along[i], along[i + 1], damping, phase, 15, work, largest)
    return largest


def _checkpoints(stride):
    """Return the states and largest values looked at of all tiles, (tiles, rows, lanes)."""
    if stride == 1:
        packed, checkpoints = np.empty((response.ROWS, LANES)), np.empty((TILES, 6, LANES))
        response.pack_response(WEIGHTS, PHASES, DAMPINGS, packed)
        response.run_response_tiles(*GROUND, packed, checkpoints)
        return checkpoints
    table = np.empty((OSCILLATOR_ROWS, MAXIMA_LANES))
    checkpoints = np.empty((TILES, CHECKPOINT_ROWS, MAXIMA_LANES))
    for lane in range(MAXIMA_LANES):
        pack_oscillator(stride, PHASES[lane], DAMPINGS[lane], *WEIGHTS[:, lane], table, lane)
    run_strides(stride, *GROUND, 0, np.zeros(MAXIMA_LANES), table, checkpoints)
    return checkpoints


@pytest.mark.parametrize("window", [(0, TILES - 1), (1, 1)])
@pytest.mark.parametrize(("stride", "quantities"), [(1, 1), (1, 2), (1, 4), (2, 2), (4, 2)])
def test_no_value_between_samples_is_missed(stride, quantities, window, extremes, plain_states):
    # mutations: thresholds from the samples of one tile only, a bound that is too small for strides
    # of several steps, values raised that a tile cannot exceed, a tile outside the window
    checkpoints = np.ascontiguousarray(_checkpoints(stride)[:, : 2 + quantities])
    lanes = checkpoints.shape[2]
    oscillators = np.stack([PHASES, DAMPINGS, *WEIGHTS])[:, :lanes].copy()
    # the last two lanes do not count
    windows = np.array([[window[0]], [window[1]]]) * np.ones((2, lanes))
    windows[1, -2:] = -1.0
    largest = np.zeros((quantities, lanes))
    raise_between_samples(
        stride, *GROUND, np.concatenate(extremes), oscillators, 0, windows, checkpoints, largest
    )
    for lane in range(0, lanes - 2, 7):
        along = WEIGHTS[0, lane] * GROUND[0] + WEIGHTS[1, lane] * GROUND[1]
        motion = plain_states(along, PHASES[lane], DAMPINGS[lane])
        expected = _searched(motion, along, PHASES[lane], DAMPINGS[lane], window)
        # rounding of 192 steps
        assert_allclose(largest[:, lane], expected[:quantities], rtol=1e-11)
    assert not largest[:, -2:].any()
