"""The rotated, shifted and scaled step of a block against the plain step."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.spectra import radius
from per_obspy.kernels.spectra.tile_search import LANES

CHECKED = [0, 20, 41, 60, 61, 62, 63]


@pytest.fixture(scope="module")
def radii(block):
    packed, state = np.empty((radius.ROWS, LANES)), np.empty((2, LANES))
    checkpoints = np.empty((1, 3, LANES))
    radius.pack(block.phases, block.dampings, packed)
    radius.start_at_rest(block.north[0], packed, state)
    radius.run_tiles(block.north, packed, state, checkpoints)
    return packed, state, checkpoints


@pytest.mark.parametrize("lane", CHECKED)
def test_rotated_step_keeps_the_radius(radii, lane, block, plain_states):
    # catches a rotation the wrong way, a lost shift, and division by the input that vanishes
    _, _, checkpoints = radii
    states = plain_states(block.north, block.phases[lane], block.dampings[lane])
    assert_allclose(checkpoints[0, 2, lane], (states**2).sum(axis=1).max(), rtol=1e-11)


@pytest.mark.parametrize("lane", CHECKED)
def test_states_are_turned_back(radii, lane, block, plain_states):
    packed, state, _ = radii
    chosen, states = np.array([[0, lane]]), np.empty((1, 2))
    checkpoints = state.reshape(1, 2, LANES)
    radius.states_before(block.north[-1:], packed, checkpoints, chosen, states)
    expected = plain_states(block.north, block.phases[lane], block.dampings[lane])[-1]
    assert_allclose(states[0], expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
