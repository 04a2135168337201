"""A record, and a reference for linear oscillators that shares no code with the package."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import minimize_scalar

Reference = Callable[[np.ndarray, float, float, float], np.ndarray]


@pytest.fixture(scope="session")
def noise() -> np.ndarray:
    """60 samples of noise that neither start nor end at zero, m/s²."""
    return np.random.default_rng(1).normal(size=60)


@pytest.fixture(scope="session")
def reference() -> Reference:
    """Return the reference, by matrix exponentials, as a function."""
    return largest_responses


def largest_responses(
    acceleration: np.ndarray, dt: float, period: float, damping: float
) -> np.ndarray:
    """
    Return largest radius, displacement, velocity and absolute acceleration of one oscillator.

    Dense evaluation, then Brent's method around the highest values; one period of free vibration is
    included.
    """
    phase = 2.0 * np.pi * dt / period
    system = _system(phase, damping)
    states = _states_at_samples(acceleration * dt**2, system, free=int(np.ceil(period / dt)) + 1)

    # Sixty times per period at least, and four times a step
    parts = max(4, int(np.ceil(60 * dt / period)))
    times = np.arange(parts) / parts
    dense = np.stack([states @ expm(system * time).T for time in times], axis=1).reshape(-1, 4)
    values = _responses(dense, phase, damping)

    # At any time within a step
    def response(step: int, time: float) -> np.ndarray:
        return _responses(expm(system * time) @ states[step], phase, damping)

    largest = [_largest(values, row, parts, response) for row in range(4)]
    return np.array(largest) * [1.0, 1.0, 1.0 / dt, 1.0 / dt**2]


def _largest(
    values: np.ndarray, row: int, parts: int, response: Callable[[int, float], np.ndarray]
) -> float:
    """Return the largest value of a row, by Brent's method around its three highest."""
    largest = float(values[row].max())
    for highest in np.argsort(values[row])[-3:]:
        # The maximum lies in the interval before or after
        for begin in {highest, max(highest - 1, 0)}:
            step, part = divmod(begin, parts)
            peak = minimize_scalar(
                lambda time, step=step: -float(response(step, time)[row]),
                bounds=(part / parts, (part + 1) / parts),
                method="bounded",
                options={"xatol": 1e-7},
            )
            largest = max(largest, -peak.fun)
    return largest


def _system(phase: float, damping: float) -> np.ndarray:
    """Return the matrix of u, u' dt, a dt² and the change of a dt² over a step; time in steps."""
    return np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-(phase**2), -2.0 * damping * phase, -1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0, 0.0],
        ]
    )


def _responses(state: np.ndarray, phase: float, damping: float) -> np.ndarray:
    """Return radius, displacement, velocity times dt and absolute acceleration times dt²."""
    u, v = state[..., 0], state[..., 1]
    felt = phase**2 * u + 2.0 * damping * phase * v
    return np.stack([np.hypot(u, v / phase), np.abs(u), np.abs(v), np.abs(felt)])


def _states_at_samples(ground: np.ndarray, system: np.ndarray, free: int) -> np.ndarray:
    """Return the state at every sample, a ramp to zero and ``free`` steps after it included."""
    closed = np.concatenate([ground, np.zeros(1 + free)])
    states = np.zeros((closed.size, 4))
    states[:, 2], states[:-1, 3] = closed, np.diff(closed)
    # Exact for straight lines between samples
    step = expm(system)
    for i in range(1, closed.size):
        states[i, :2] = (step @ states[i - 1])[:2]
    return states
