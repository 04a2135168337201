"""Peaks of the relative displacement between samples, against the exact solution in fine parts."""

from itertools import pairwise

import numpy as np
import pytest

from per_obspy.kernels.oscillator.exact_step import state_after
from per_obspy.kernels.relative.relative_peaks import search_pair_tile
from per_obspy.kernels.spectra.tile_search import TILE

DT = 0.02
NORTH, EAST = np.random.default_rng(4).standard_normal((2, TILE + 1))


def _dense(pair, state, parts):
    """Return the relative displacement in equal parts of every step of the tile."""
    states = [list(state[:2]), list(state[2:])]
    states[0][1] *= pair[0]
    states[1][1] *= pair[3]
    distances = []
    for start, end in pairwise(pair[6] * NORTH + pair[7] * EAST):
        rate = (end - start) / DT
        for part in range(1, parts + 1):
            after = [
                state_after(part / parts * DT, u, v, omega, damping, start, rate)
                for (u, v), omega, damping in zip(states, pair[0:4:3], pair[1:5:3], strict=True)
            ]
            distances.append(pair[2] * after[0][0] - pair[5] * after[1][0])
        states = after
    return np.array(distances)


@pytest.mark.parametrize("omega", [5.0, 60.0, 300.0])
@pytest.mark.parametrize("alike", [1.3, 1.01])
def test_peaks_between_samples_are_found(omega, alike):
    # mutations: one of the two directions, the sign of structure 2
    pair = np.array([omega, 0.05, 1.1, omega * alike, 0.02, 1.0, 0.6, 0.8])
    state = np.array([1e-4, -2e-4, 2e-4, 3e-4]) * (60.0 / omega) ** 2
    largest = np.zeros(2)
    # an infinite margin searches every step
    search_pair_tile(pair, DT, NORTH, EAST, state, np.inf, largest)
    parts = 40
    dense = _dense(pair, state, parts)
    expected = np.array([dense.max(), -dense.min()])
    # parts miss a peak by (omega dt / parts)² / 8 of it, with twice its curvature to spare
    missed = (omega * alike * DT / parts) ** 2 / 4
    assert np.all(largest >= expected * (1 - 1e-12))
    np.testing.assert_allclose(largest, expected, rtol=missed + 1e-12)


@pytest.mark.parametrize("phase", [0.5, 3.0, 9.0])
def test_peaks_of_a_free_vibration_in_the_first_step(phase):
    # closed form of an oscillator that starts with a velocity (structure 2 hardly takes part);
    # mutation: one cubic for a step of several peaks
    damping, omega = 0.05, phase / DT
    pair = np.array([omega, damping, 1.0, 0.9 * omega, 0.5, 1e-15, 1.0, 0.0])
    state, largest, rest = np.array([0.0, 1.0, 0.0, 0.0]), np.zeros(2), np.zeros(TILE + 1)
    search_pair_tile(pair, DT, rest, rest, state, np.inf, largest)
    root = np.sqrt(1.0 - damping**2)
    peaks = (np.arccos(damping) + np.array([0.0, np.pi])) / root
    np.testing.assert_allclose(largest, np.exp(-damping * peaks), rtol=1e-12)
