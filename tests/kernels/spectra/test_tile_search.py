"""The search of tiles for largest values, against a search of every step without any bounds."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.kernels.oscillator.within_step import largest_in_step, workspace
from per_obspy.kernels.spectra import response, tile_search
from per_obspy.kernels.spectra.tile_search import LANES, TILE

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


def _searched(states, along, phase, damping):
    """Return the largest four values of an oscillator from all stationary points of every step."""
    largest, selected, work = np.zeros(4), np.ones(4, dtype=bool), workspace()
    for i in range(TILES * TILE):
        u, z = states[i]
        values = [u * u + z * z, abs(u), abs(z), abs(u + 2 * damping * z)]
        largest = np.maximum(largest, values)
        largest_in_step(u, z, along[i], along[i + 1], damping, phase, selected, work, largest)
    return largest


@pytest.mark.parametrize("quantities", [1, 4])
def test_no_value_between_samples_is_missed(quantities, extremes, plain_states):
    # mutations: thresholds from the samples of one tile only, a bound that is too small, values
    # raised that a tile cannot exceed
    packed, checkpoints = np.empty((response.ROWS, LANES)), np.empty((TILES, 6, LANES))
    response.pack_response(WEIGHTS, PHASES, DAMPINGS, packed)
    response.run_response_tiles(*GROUND, packed, checkpoints)
    checkpoints = np.ascontiguousarray(checkpoints[:, : 2 + quantities])
    largest, chosen = np.zeros((quantities, LANES)), np.empty((TILES * LANES, 2), dtype=np.int64)
    parameters = (*extremes, PHASES, DAMPINGS, WEIGHTS)
    count = tile_search.choose_tiles(checkpoints, *parameters, LANES - 2, largest, chosen)
    chosen = chosen[:count]
    assert chosen[:, 1].max() < LANES - 2
    states = np.ascontiguousarray(checkpoints[chosen[:, 0], :2, chosen[:, 1]])
    tile_search.search_tiles(*GROUND, *parameters, checkpoints, states, chosen, largest)
    for lane in (0, 21, 40, 55, 61):
        along = WEIGHTS[0, lane] * GROUND[0] + WEIGHTS[1, lane] * GROUND[1]
        motion = plain_states(along, PHASES[lane], DAMPINGS[lane])
        expected = _searched(motion, along, PHASES[lane], DAMPINGS[lane])
        # rounding of 192 steps
        assert_allclose(largest[:, lane], expected[:quantities], rtol=1e-11)
