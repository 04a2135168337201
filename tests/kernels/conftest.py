"""The plain exact step, one oscillator and one sample at a time: the reference of all blocks."""

from itertools import pairwise

import numpy as np
import pytest

from per_obspy.kernels.oscillator.exact_step import step_coefficients


def _states(acceleration, phase, damping, start=(0.0, 0.0)):
    """Return the states ``u, z`` at the samples, displacements in ``a / omega²``."""
    a11, a12, a21, a22, b11, b12, b21, b22 = step_coefficients(1.0, damping, phase)
    states = [start]
    for before, after in pairwise(acceleration):
        u, z = states[-1]
        u_after = a11 * u + a12 * z + b11 * before + b12 * after
        z_after = a21 * u + a22 * z + b21 * before + b22 * after
        states.append((u_after, z_after))
    return np.array(states)


@pytest.fixture(scope="session")
def plain_states():
    return _states
