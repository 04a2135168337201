"""Largest responses of single oscillators against closed forms, also uncompiled."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.maxima.oscillator_maxima import largest_responses
from per_obspy.kernels.spectra.tile_search import TILE


def _lengths(north, phase, damping, stride):
    """Return largest radius and displacement of an oscillator under one tile of north motion."""
    limits = np.array([[np.abs(north).max()], [0.0], [np.abs(np.diff(north)).max()], [0.0]])
    largest, oscillator = np.zeros((2, 1)), np.array([[phase], [damping], [1.0], [0.0]])
    east, order = np.zeros(TILE + 1), np.array([0])
    largest_responses(stride, north, east, limits, limits[:2], 1, oscillator, order, largest)
    return np.sqrt(largest[0, 0]), largest[1, 0]


@pytest.mark.parametrize("stride", [1, 2, 4])
def test_a_constant_push_overshoots_to_twice_the_static_displacement(stride):
    # closed form: 1 - cos, whose peak lies between the samples; mutation: samples alone, which miss
    # 0.4 % and more
    north = np.full(TILE + 1, -1.5)
    north[-1] = 0.0
    assert_allclose(_lengths(north, 0.61, 0.0, stride), 3.0, rtol=1e-12)


@pytest.mark.parametrize("stride", [1, 2, 4])
def test_a_late_pulse_is_felt_afterwards(stride):
    # closed form: a triangle's spectrum; mutation: no free vibration, or an oscillator that does
    # not reach its floor is not run again
    north = np.zeros(TILE + 1)
    north[-2] = 1.0
    phase = 0.1
    amplitude = phase * (np.sin(phase / 2) / (phase / 2)) ** 2
    assert_allclose(_lengths(north, phase, 0.0, stride), amplitude, rtol=1e-12)
