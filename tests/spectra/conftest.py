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
    """Largest radius, displacement, velocity and absolute acceleration of one oscillator, by matrix exponentials."""
    return largest_responses


def largest_responses(
    acceleration: np.ndarray, dt: float, period: float, damping: float
) -> np.ndarray:
    """Dense evaluation, then Brent's method around the highest values; one period of free vibration included."""
    phase = 2.0 * np.pi * dt / period
    # u, u' dt, a dt², change of a dt² over a step; time in steps
    system = np.array(
        [[0, 1, 0, 0], [-(phase**2), -2 * damping * phase, -1, 0], [0, 0, 0, 1], [0, 0, 0, 0.0]]
    )
    free = int(np.ceil(period / dt)) + 1
    ground = np.concatenate([acceleration, np.zeros(1 + free)]) * dt**2
    states = np.zeros((ground.size, 4))
    states[:, 2], states[:-1, 3] = ground, np.diff(ground)
    whole = expm(system)
    for i in range(1, ground.size):
        states[i, :2] = (whole @ states[i - 1])[:2]
    parts = max(4, int(np.ceil(60 * dt / period)))
    times = np.arange(parts) / parts
    dense = np.stack([states @ expm(system * time).T for time in times], axis=1).reshape(-1, 4)

    def quantities(state: np.ndarray) -> np.ndarray:
        u, v = state[..., 0], state[..., 1]
        felt = phase**2 * u + 2 * damping * phase * v
        return np.stack([np.hypot(u, v / phase), np.abs(u), np.abs(v) / dt, np.abs(felt) / dt**2])

    values = quantities(dense)
    for row in range(4):
        for place in np.argsort(values[row])[-3:]:
            step, part = divmod(place, parts)
            for begin in {(step, part), divmod(max(place - 1, 0), parts)}:
                start = states[begin[0]]

                def lower(time: float, start: np.ndarray = start, row: int = row) -> float:
                    return -float(quantities(expm(system * time) @ start)[row])

                bounds = (begin[1] / parts, (begin[1] + 1) / parts)
                peak = minimize_scalar(
                    lower, bounds=bounds, method="bounded", options={"xatol": 1e-7}
                )
                values[row, place] = max(values[row, place], -peak.fun)
    return values.max(axis=1)
