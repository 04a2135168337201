"""Four quantities of a block of oscillators, at the samples and in the free vibration."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.oscillator.exact_step import step_coefficients
from per_obspy.kernels.spectra import response
from per_obspy.kernels.spectra.tile_search import LANES


@pytest.mark.parametrize("lane", [0, 20, 41, 60, 61, 62, 63])
def test_four_quantities_along_an_azimuth(lane, block, plain_states):
    packed, checkpoints = np.empty((response.ROWS, LANES)), np.empty((1, 6, LANES))
    angles = np.linspace(0, 3, LANES)
    weights = np.stack([np.cos(angles), np.sin(angles)])
    response.pack_response(weights, block.phases, block.dampings, packed)
    response.run_response_tiles(block.north, block.east, packed, checkpoints)
    along = weights[0, lane] * block.north + weights[1, lane] * block.east
    u, z = plain_states(along, block.phases[lane], block.dampings[lane]).T
    absolute = u + 2 * block.dampings[lane] * z
    expected = [(u * u + z * z).max(), *(np.abs(values).max() for values in (u, z, absolute))]
    assert_allclose(checkpoints[0, 2:, lane], expected, rtol=1e-11)
    assert_allclose(packed[:2, lane], [u[-1], z[-1]], rtol=1e-9, atol=1e-12 * np.abs(u).max())


def test_free_vibration_is_followed_to_its_extremes():
    # dense free vibration over one period and a half
    packed, largest = np.zeros((response.ROWS, LANES)), np.zeros((4, LANES))
    random = np.random.default_rng(2)
    packed[0], packed[1] = random.normal(size=(2, LANES))
    dampings = np.linspace(0, 0.95, LANES)
    response.free_vibration(packed, dampings, largest)
    for lane in (0, 10, 30, 63):
        a11, a12, a21, a22, *_ = step_coefficients(1.0, dampings[lane], 0.002)
        state, states = packed[:2, lane], []
        for _ in range(4700):
            state = np.array([a11 * state[0] + a12 * state[1], a21 * state[0] + a22 * state[1]])
            states.append(state)
        u, z = np.array(states).T
        quantities = (u, z, u + 2 * dampings[lane] * z)
        expected = np.array([np.abs(values).max() for values in quantities])
        found = np.maximum(largest[1:, lane], expected)
        assert_allclose(found, expected, rtol=2e-6)  # 0.002² / 8 of a peak
        # the extremes themselves, where they are not at the start
        inner = expected > np.abs([values[0] for values in quantities])
        assert np.all(largest[1:, lane][inner] >= expected[inner] * (1 - 1e-12))


@pytest.mark.parametrize("damping", [0.0, 0.3, 0.95])
@pytest.mark.parametrize(("start", "change"), [(1.0, 0.5), (1.0, -2.0), (-0.3, 1.0)])
def test_first_root_of_a_free_vibration(start, change, damping):
    # closed form: exp(-xi p) (start cos + (change + xi start) / root sin); mutation: a quadrant
    phase = response.first_root(start, change, damping)
    root = np.sqrt(1 - damping**2)
    phases = np.linspace(0.0, phase, 1001)
    sine = (change + damping * start) / root
    values = start * np.cos(root * phases) + sine * np.sin(root * phases)
    assert values[-1] == pytest.approx(0.0, abs=1e-14)
    assert np.all(values[1:-1] * np.sign(values[1]) > 0.0)
