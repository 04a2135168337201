"""The bilinear oscillator: its linear limits, exactness under cut steps, and its rest."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.oscillator.bilinear import bilinear_history

RECORD = np.append(np.random.default_rng(13).normal(size=60), 0.0)


def _run(acceleration, phase, damping, yielding, hardening):
    history, state, largest = np.empty((3, acceleration.size - 1)), np.zeros(4), np.zeros(4)
    bilinear_history(acceleration, phase, damping, yielding, hardening, history, state, largest)
    return history, state, largest


@pytest.mark.parametrize(("yielding", "hardening"), [(1e3, 0.1), (0.05, 1.0)])
def test_an_oscillator_that_cannot_yield_is_linear(yielding, hardening, plain_states):
    # mutations: branches of the same stiffness not joined, the plastic displacement's force left
    phase, damping = 0.4, 0.05
    history, _, largest = _run(RECORD, phase, damping, yielding, hardening)
    states = plain_states(RECORD, phase, damping)
    assert_allclose(history[:2].T, states[:-1], atol=1e-11)
    assert np.all(largest[:2] >= [np.abs(states[:, 0]).max(), (states**2).sum(axis=1).max()])


@pytest.mark.parametrize("hardening", [0.0, 0.1])
def test_cut_steps_change_nothing(hardening):
    # mutation: an event that is located at the end of a step or span
    phase, damping, yielding = 0.6, 0.05, 0.2
    whole, state, largest = _run(RECORD, phase, damping, yielding, hardening)
    times = np.arange(3 * (RECORD.size - 1) + 1) / 3
    cut = np.interp(times, np.arange(RECORD.size), RECORD)
    fine, fine_state, fine_largest = _run(cut, phase / 3, damping, yielding, hardening)
    assert largest[3] > 1.0  # it yields
    # yielding begins and ends to 1e-8 of a span, at rest or within the elastic limit
    assert_allclose(fine[:, ::3], whole, atol=1e-8)
    assert_allclose(fine_largest, largest, rtol=1e-7)
    assert_allclose(fine_state[2], state[2], atol=1e-8)


def test_rest_after_the_record():
    # mutations: a restoring force above the yield displacement, free vibration that stops early
    history, state, largest = _run(RECORD, 0.6, 0.05, 0.2, 0.1)
    assert np.abs(history[0] - history[2]).max() <= 0.2 * (1 + 1e-9)
    assert state[3] == 0.0
    # the path of the plastic displacement is at least its change between samples
    path = np.abs(np.diff(history[2])).sum()
    assert largest[3] >= path * (1 - 1e-12)
    # free oscillation around the offset cannot yield any more
    reach = np.hypot(state[0] - 0.9 * state[2], state[1]) + 0.1 * abs(state[2])
    assert reach <= 0.2 * (1 + 1e-9)
