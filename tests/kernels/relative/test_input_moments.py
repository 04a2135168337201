"""Moments of response and input without any wrapper, so short that they also run uncompiled."""

from itertools import pairwise

import numpy as np
import pytest

from per_obspy.kernels.oscillator.exact_step import state_after
from per_obspy.kernels.relative.input_moments import LAG_TILE, input_moments

DT, OMEGAS, DAMPINGS = 0.1, np.array([0.5, 4.0, 25.0]), np.array([0.0, 0.05, 0.2])


def record(count):
    """Two components that start in full motion and end at zero."""
    return np.random.default_rng(count).standard_normal((2, count)) * np.append(
        np.ones(count - 1), 0.0
    )


def moments(north, east, omegas=OMEGAS, dampings=DAMPINGS):
    count = north.size
    lagged, firsts = np.zeros((2, 3, -(-count // LAG_TILE) * LAG_TILE + 2))
    for row, (first, second) in enumerate(((north, north), (north, east), (east, east))):
        products = [
            first[: count - lag] @ second[lag:] + second[: count - lag] @ first[lag:]
            for lag in range(count)
        ]
        lagged[row, :count] = products if row == 1 else np.array(products) / 2
        firsts[row, :count] = first[0] * second
        if row == 1:
            firsts[row, :count] += second[0] * first
    found = np.empty((omegas.size, 2, 3))
    input_moments(lagged, firsts, DT, omegas, dampings, np.arange(omegas.size)[::-1].copy(), found)
    return found


def integrals(ground, omega, damping, parts=64):
    """
    Return the integrals of u a and v a by Boole's rule on each step cut into parts.

    Its error falls like (ω dt / parts)⁶.
    """
    weights = np.zeros(parts + 1)
    for first in range(0, parts, 4):
        weights[first : first + 5] += np.array([7, 32, 12, 32, 7]) * 2 / 45 * DT / parts
    u = v = 0.0
    total = np.zeros(2)
    for start, end in pairwise(ground):
        rate = (end - start) / DT
        for part, weight in enumerate(weights):
            state = state_after(part / parts * DT, u, v, omega, damping, start, rate)
            total += weight * np.array(state) * (start + (end - start) * part / parts)
        u, v = state
    return total


@pytest.mark.parametrize("count", [2, 5, 8])
def test_against_a_sum_over_fine_parts(count):
    # mutation: a lag too many or too few; the sample at a step's start taken for that at its end; a
    # first sample that is not zero forgotten in the shifted state
    north, east = record(count)
    found = moments(north, east)
    for index, (omega, damping) in enumerate(zip(OMEGAS, DAMPINGS, strict=True)):
        alone = [integrals(ground, omega, damping) for ground in (north, east, north + east)]
        expected = np.stack([alone[0], alone[2] - alone[0] - alone[1], alone[1]], axis=1)
        # of Boole's rule: (25 * 0.1 / 64)⁶ = 4e-9 at worst
        np.testing.assert_allclose(found[index], expected, atol=1e-8 * abs(expected).max())


def test_work_of_the_ground_is_the_energy_of_an_undamped_oscillator():
    # mutation: weights of the velocity
    north, east = record(9)
    u = v = 0.0
    for start, end in pairwise(north):
        u, v = state_after(DT, u, v, OMEGAS[0], 0.0, start, (end - start) / DT)
    energy = (v**2 + (OMEGAS[0] * u) ** 2) / 2
    assert moments(north, east)[0, 1, 0] == pytest.approx(-energy, rel=1e-12)


def test_forgotten_lags_do_not_count():
    # mutation: lags cut at a larger remainder, or for the fastest oscillator of a block instead of
    # each
    quiet = np.concatenate([np.full(5, 1.0), np.full(250, 0.3), [0.0]])
    north, east = record(256) * quiet
    omegas, dampings = np.array([0.5, 4.0, 10.0, 10.0]), np.array([0.05, 0.2, 0.1, 0.9])
    found = moments(north, east, omegas, dampings)
    for index in (1, 3):
        alone = moments(north, east, omegas[index : index + 1], dampings[index : index + 1])
        np.testing.assert_array_equal(found[index], alone[0])
        # Boole's rule errs by (10 * 0.1 / 64)⁶ = 2e-11 at worst
        expected = integrals(north, omegas[index], dampings[index])
        np.testing.assert_allclose(found[index, :, 0], expected, atol=1e-9 * abs(expected).max())
