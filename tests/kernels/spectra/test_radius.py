"""Strides of a block of oscillators against plain steps, and the tiles that are run again."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.kernels.spectra import radius
from per_obspy.kernels.spectra.tile_search import LANES, TILE, tile_extremes

CHECKED = [0, 20, 41, 60, 61, 62, 63]
TILES = 24


def swept(acceleration, phases, dampings):
    """Return the advanced table, and the checkpoints (tiles, 3, LANES) of its strides."""
    table = np.empty((radius.ROWS, LANES))
    checkpoints = np.empty(((acceleration.size - 1) // TILE, 3, LANES))
    radius.pack(phases, dampings, table)
    radius.run_strides(acceleration, table, checkpoints)
    return table, checkpoints


def looked_at(acceleration, phases, dampings, largest):
    """Return the checkpoints after the radii of all samples, and raise the largest."""
    table, checkpoints = swept(acceleration, phases, dampings)
    peaks, jumps = np.empty((2, len(checkpoints)))
    tile_extremes(acceleration, peaks, jumps)
    extremes = peaks, jumps
    radius.raise_to_samples(acceleration, *extremes, phases, dampings, table, checkpoints, largest)
    return checkpoints


@pytest.fixture(scope="module")
def shaking():
    """Noise under an envelope, with a quiet end, and periods from 2 to 2000 samples."""
    time = np.linspace(0.0, 1.0, TILES * TILE + 1)
    noise = np.random.default_rng(5).normal(size=time.size)
    phases = np.geomspace(np.pi, np.pi / 1000.0, LANES)
    dampings = np.resize([0.0, 0.02, 0.05, 0.3], LANES)
    return noise * np.exp(-(((time - 0.3) / 0.15) ** 2)), phases, dampings


@pytest.mark.parametrize("lane", CHECKED)
def test_strides_follow_plain_steps(lane, block, plain_states):
    # catches a weight of a sample that is moved on too often or not at all
    table, checkpoints = swept(block.north, block.phases, block.dampings)
    states = plain_states(block.north, block.phases[lane], block.dampings[lane])
    after = states[:: radius.STRIDE]
    assert_allclose(checkpoints[0, 2, lane], (after**2).sum(axis=1).max(), rtol=1e-11)
    scale = np.abs(states).max()  # of components that pass zero
    assert_allclose(table[:2, lane], states[-1], rtol=1e-9, atol=1e-12 * scale)


@pytest.mark.parametrize("seed", [1, 2])
def test_no_sample_of_a_tile_left_out_exceeds_the_largest_radius(seed, plain_states):
    # catches a bound that is too small, and a tile that is run wrongly: in steady noise many tiles
    # compete, and fast oscillators have their largest radius between the strides
    acceleration = np.random.default_rng(seed).normal(size=TILES * TILE + 1)
    phases, dampings = np.geomspace(np.pi, 0.05, LANES), np.resize([0.02, 0.05, 0.3], LANES)
    largest = np.zeros((1, LANES))
    checkpoints = looked_at(acceleration, phases, dampings, largest)
    for lane in range(LANES):
        states = plain_states(acceleration, phases[lane], dampings[lane])
        squares = (states**2).sum(axis=1)
        assert_allclose(largest[0, lane], squares.max(), rtol=1e-11)
        # Tiles that were run again hold their own largest sample
        again = np.flatnonzero(checkpoints[:, 2, lane])
        of_tile = np.array([squares[tile * TILE : (tile + 1) * TILE + 1].max() for tile in again])
        assert_allclose(checkpoints[again, 2, lane], of_tile, rtol=1e-9)


def test_most_tiles_are_left_out(shaking):
    # catches bounds that rule no tile out: the strong motion is a quarter of the record
    acceleration, phases, dampings = shaking
    checkpoints = looked_at(acceleration, phases, dampings, np.zeros((1, LANES)))
    slow = phases < 0.5
    assert 0.0 < (checkpoints[:, 2, slow] > 0.0).mean() < 0.2
    assert (checkpoints[:, 2, ~slow] > 0.0).mean() < 0.7


def test_an_oscillator_does_not_depend_on_its_neighbours(shaking):
    # catches a lane that is raised because its neighbour's tile is run again
    acceleration, phases, dampings = shaking
    alone, together = np.zeros((1, LANES)), np.zeros((1, LANES))
    expected = looked_at(acceleration, phases, dampings, together)
    turned = np.random.default_rng(0).permutation(LANES)
    found = looked_at(acceleration, phases[turned].copy(), dampings[turned].copy(), alone)
    assert_array_equal(alone[0], together[0, turned])
    assert_array_equal(found, expected[:, :, turned])


def test_tiles_after_a_stronger_stretch_are_left_out(shaking):
    # catches largest values of earlier stretches that are forgotten
    acceleration, phases, dampings = shaking
    largest = np.full((1, LANES), 1e9)
    checkpoints = looked_at(acceleration, phases, dampings, largest)
    assert not checkpoints[:, 2].any()
    assert_array_equal(largest, 1e9)
