"""Ground motion that several tests of pounding share."""

import numpy as np


def shaking(seconds, seed=0, dt=0.02):
    """Smoothed noise under an envelope, about 3 m/s²."""
    count = round(seconds / dt)
    noise = np.convolve(np.random.default_rng(seed).normal(size=count), np.ones(5) / 5, mode="same")
    return 6.0 * noise * np.sin(np.pi * np.arange(count) / count) ** 0.5
