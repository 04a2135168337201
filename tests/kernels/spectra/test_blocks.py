"""Blocks of oscillators against the plain step, one oscillator and one sample at a time."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.oscillator.exact_step import step
from per_obspy.kernels.spectra import azimuths, blocks, radius, response

RECORD = np.append(np.random.default_rng(0).normal(size=blocks.TILE), 0.0)
OTHER = np.append(np.random.default_rng(1).normal(size=blocks.TILE), 0.0)
PHASES = np.concatenate(
    [np.geomspace(1e-3, 1.0, blocks.LANES - 4), [2 * np.pi, 4 * np.pi, np.pi, 3.0]]
)
DAMPINGS = np.where(np.arange(blocks.LANES) % 3 == 0, 0.0, 0.05)
DAMPINGS[-4:] = (
    0.0  # the first two of these periods are dt and dt / 2, where the scaled input vanishes
)


def _states(acceleration, lane):
    """States at the samples by the plain step."""
    a11, a12, a21, a22, b11, b12, b21, b22 = step(1.0, DAMPINGS[lane], PHASES[lane])
    states = [(0.0, 0.0)]
    for start, end in itertools.pairwise(acceleration):
        u, z = states[-1]
        states.append(
            (
                a11 * u + a12 * z + b11 * start + b12 * end,
                a21 * u + a22 * z + b21 * start + b22 * end,
            )
        )
    return np.array(states)


LANES = [0, 20, 41, 60, 61, 62, 63]


@pytest.fixture(scope="module")
def radii():
    packed, state = np.empty((radius.ROWS, blocks.LANES)), np.empty((2, blocks.LANES))
    kept = np.empty((1, 3, blocks.LANES))
    radius.pack(PHASES, DAMPINGS, packed)
    radius.start_at_rest(RECORD[0], packed, state)
    radius.run_tiles(RECORD, packed, state, kept)
    return packed, state, kept


@pytest.mark.parametrize("lane", LANES)
def test_rotated_step_keeps_the_radius(radii, lane):
    # catches a rotation the wrong way, a lost shift, and division by the input that vanishes
    _, _, kept = radii
    assert_allclose(kept[0, 2, lane], (_states(RECORD, lane) ** 2).sum(axis=1).max(), rtol=1e-11)


@pytest.mark.parametrize("lane", LANES)
def test_states_are_turned_back(radii, lane):
    packed, state, _ = radii
    chosen, states = np.array([[0, lane]]), np.empty((1, 2))
    kept = state.reshape(1, 2, blocks.LANES)
    radius.states_before(RECORD[-1:], packed, kept, chosen, states)
    expected = _states(RECORD, lane)[-1]
    assert_allclose(states[0], expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("lane", LANES)
def test_four_quantities_along_an_azimuth(lane):
    packed, kept = np.empty((response.ROWS, blocks.LANES)), np.empty((1, 6, blocks.LANES))
    angles = np.linspace(0, 3, blocks.LANES)
    weights = np.stack([np.cos(angles), np.sin(angles)])
    response.pack_response(weights, PHASES, DAMPINGS, packed)
    response.run_response_tiles(RECORD, OTHER, packed, kept)
    u, z = _states(weights[0, lane] * RECORD + weights[1, lane] * OTHER, lane).T
    felt = u + 2 * DAMPINGS[lane] * z
    expected = [(u * u + z * z).max(), *(np.abs(values).max() for values in (u, z, felt))]
    assert_allclose(kept[0, 2:, lane], expected, rtol=1e-11)
    assert_allclose(packed[:2, lane], [u[-1], z[-1]], rtol=1e-9, atol=1e-12 * np.abs(u).max())


@pytest.mark.parametrize("lane", LANES)
def test_bounds_over_all_azimuths(lane):
    # catches a bound below the larger eigenvalue, or one that is uselessly large
    packed, state = np.empty((8, blocks.LANES)), np.zeros((4, blocks.LANES))
    kept = np.empty((1, 6, blocks.LANES))
    azimuths.pack_steps(PHASES, DAMPINGS, packed)
    azimuths.run_azimuth_tiles(RECORD, OTHER, packed, state, kept)
    north, east = _states(RECORD, lane), _states(OTHER, lane)
    largest = max(
        np.linalg.norm([[n[0], e[0]], [n[1], e[1]]], ord=2) ** 2
        for n, e in zip(north, east, strict=True)
    )
    assert largest * (1 - 1e-12) <= kept[0, 4, lane] <= 1.1 * largest
    assert_allclose(kept[0, 5, lane], (north[:, 0] ** 2 + east[:, 0] ** 2).max(), rtol=1e-11)


def test_free_vibration_is_followed_to_its_extremes():
    # dense free vibration over one period and a half
    packed, largest = np.zeros((response.ROWS, blocks.LANES)), np.zeros((4, blocks.LANES))
    random = np.random.default_rng(2)
    packed[0], packed[1] = random.normal(size=(2, blocks.LANES))
    dampings = np.linspace(0, 0.95, blocks.LANES)
    response.free_vibration(packed, dampings, largest)
    for lane in (0, 10, 30, 63):
        a11, a12, a21, a22, *_ = step(1.0, dampings[lane], 0.002)
        state, states = packed[:2, lane], []
        for _ in range(4700):
            state = np.array([a11 * state[0] + a12 * state[1], a21 * state[0] + a22 * state[1]])
            states.append(state)
        u, z = np.array(states).T
        expected = [np.abs(values).max() for values in (u, z, u + 2 * dampings[lane] * z)]
        found = np.maximum(largest[1:, lane], expected)
        assert_allclose(found, np.maximum(expected, 0), rtol=2e-6)  # 0.002² / 8 of a peak
        # the extremes themselves, where they are not at the start
        inner = np.array(expected) > np.abs([u[0], z[0], u[0] + 2 * dampings[lane] * z[0]])
        assert np.all(largest[1:, lane][inner] >= np.array(expected)[inner] * (1 - 1e-12))
