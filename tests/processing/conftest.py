"""A ground motion that is known exactly, for tests that add the faults of recorders."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

RATE = 100.0  # Hz


@pytest.fixture(scope="session")
def earthquake() -> Callable[..., NDArray[np.float64]]:
    """Return a function that makes acceleration, m/s2: silence, then shaking from 0.1 to 20 Hz."""

    def make(
        seed: int = 1, onset: float = 20.0, shaking: float = 15.0, duration: float = 120.0
    ) -> NDArray[np.float64]:
        # Envelope: silence until the onset, then a rise and an exponential decay
        time = np.arange(round(duration * RATE)) / RATE - onset
        scaled = np.maximum(time, 0) / (0.2 * shaking)
        envelope = np.where(time > 0, scaled**0.5 * np.exp(-scaled / 2), 0.0)
        # Noise of the shape of ground motion
        white = np.random.default_rng(seed).normal(size=time.size)
        frequencies = np.fft.rfftfreq(time.size, 1 / RATE)
        band = frequencies**2 / (frequencies**2 + 0.3**2) / (1 + (frequencies / 20) ** 4)
        motion = 3 * np.fft.irfft(np.fft.rfft(white) * band, time.size) * envelope
        # The ground comes to rest
        return np.asarray(motion - motion.sum() / envelope.sum() * envelope)

    return make
