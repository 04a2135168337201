"""Windows of the record that can hold a largest response, against responses step by step."""

import numpy as np

from per_obspy.kernels.maxima.window import FORGOTTEN, find_windows
from per_obspy.kernels.oscillator.strides import (
    MAXIMA_LANES,
    OSCILLATOR_ROWS,
    pack_oscillator,
)

LANES = np.arange(MAXIMA_LANES)
PHASES = np.geomspace(1e-3, 8.0, MAXIMA_LANES)
DAMPINGS = np.where(LANES % 4 == 0, 0.0, np.linspace(0.01, 0.9, MAXIMA_LANES))
WEIGHTS = np.array([np.cos(LANES), np.sin(LANES)])
FLOOR = 0.05


def _pulse():
    """Return two components of 101 groups of four samples: one strong group, long weak pads."""
    random = np.random.default_rng(6)
    envelope = np.concatenate([np.full(40, 1e-7), [1.0], np.full(60, 1e-6)])
    return [np.repeat(envelope, 4) * random.choice([-1.0, 1.0], 404) for _ in range(2)]


def test_radii_keep_below_their_bounds_and_windows(plain_states):
    # mutations: bounds that decay too fast, the norm taken for the radius, a window one group too
    # short; motion before the start may leave no more than the promised part of the floor
    north, east = _pulse()
    groups = np.stack([np.abs(component).reshape(-1, 4).max(axis=1) for component in (north, east)])
    # steps end in the next group
    following = np.append(groups[:, 1:], np.zeros((2, 1)), axis=1)
    groups = np.maximum(groups, following)
    table = np.empty((OSCILLATOR_ROWS, MAXIMA_LANES))
    for lane in LANES:
        pack_oscillator(1, PHASES[lane], DAMPINGS[lane], *WEIGHTS[:, lane], table, lane)
    bounds, windows = np.empty((groups.shape[1], MAXIMA_LANES)), np.empty((3, MAXIMA_LANES))
    find_windows(groups, 4, table, np.full(MAXIMA_LANES, FLOOR), bounds, windows)
    left_out = 0
    for lane in LANES:
        phase, damping = PHASES[lane], DAMPINGS[lane]
        acceleration = np.append(WEIGHTS[0, lane] * north + WEIGHTS[1, lane] * east, 0.0)
        states = plain_states(acceleration, phase, damping)[:-1]
        u, z = states.T
        start, first, last = windows[:, lane].astype(int)
        assert np.all(
            np.sqrt(u**2 + 2 * damping * u * z + z**2)[::4] <= bounds[:, lane] * (1 + 1e-12)
        )
        outside = (np.arange(404) < 4 * first) | (np.arange(404) >= 4 * (last + 1))
        assert np.all(np.hypot(u, z)[outside] < FLOOR)
        if last >= 0:
            rest = np.zeros(4 * (first - start) + 1)
            remainder = plain_states(rest, phase, damping, tuple(states[4 * start]))[-1]
            assert np.hypot(*remainder) <= FORGOTTEN * FLOOR
        left_out += outside.sum()
    assert left_out > 4000  # the windows are of use
