"""One tile of two components under a block of oscillators, some at periods dt / k."""

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from per_obspy.kernels.spectra.tile_search import LANES, TILE


class Block(NamedTuple):
    """Components (TILE + 1,), phases and dampings (LANES,)."""

    north: NDArray[np.float64]
    east: NDArray[np.float64]
    phases: NDArray[np.float64]
    dampings: NDArray[np.float64]


@pytest.fixture(scope="session")
def block():
    north = np.append(np.random.default_rng(0).normal(size=TILE), 0.0)
    east = np.append(np.random.default_rng(1).normal(size=TILE), 0.0)
    # the last periods are dt and dt / 2, where the scaled input vanishes, 2 dt, and 2.1 dt
    last = [2 * np.pi, 4 * np.pi, np.pi, 3.0]
    phases = np.concatenate([np.geomspace(1e-3, 1.0, LANES - 4), last])
    dampings = np.where(np.arange(LANES) % 3 == 0, 0.0, 0.05)
    dampings[-4:] = 0.0
    return Block(north, east, phases, dampings)
