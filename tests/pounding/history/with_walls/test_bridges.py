"""Bridges: joints open as far as the decks move apart, and too far is unseated."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.pounding.history.with_walls.bridges import bridge_history
from per_obspy.pounding.structure import Structure

DT = 0.02
ABUTMENT = Structure(1.0, 0.0, np.inf, participation=0.0)
DECKS = [ABUTMENT, Structure(1.5, 0.05, 4.0), Structure(0.7, 0.05, 2.0), ABUTMENT]


@pytest.fixture(scope="module")
def shaking():
    """Smoothed noise under an envelope, about 3 m/s²."""
    noise = np.convolve(np.random.default_rng(0).normal(size=300), np.ones(5) / 5, mode="same")
    return 6.0 * noise * np.sin(np.pi * np.arange(300) / 300) ** 0.5


def test_unseating(shaking):
    # catches: closing taken for opening
    fine = np.interp(np.arange(0, 299, 1 / 32), np.arange(300), shaking)
    bridge = bridge_history(fine, DT / 32, DECKS, 0.02, 0.5, [0.03, 10.0, 0.05])
    opening = np.diff(bridge.history.displacement, axis=0).max(axis=1)
    assert (bridge.opening >= opening).all()
    # between samples a little more, where impacts end it
    assert_allclose(bridge.opening, opening, rtol=0.01)
    assert_array_equal(bridge.unseated, [True, False, False])


@pytest.mark.parametrize("seats", [-1.0, [0.1, 0.1]])
def test_bad_seats_are_named(shaking, seats):
    with pytest.raises(ValueError, match="seat_lengths"):
        bridge_history(shaking, DT, DECKS, 0.1, 0.5, seats)
