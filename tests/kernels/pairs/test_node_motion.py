"""Estimated motion at nodes against its definition in NumPy: eq. (15), (16) and stored spectra."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from per_obspy.kernels.pairs.node_motion import CORRELATION, DEMAND, MOTION_ROWS, estimate_motion
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.screening.station_motion import (
    LogSpectra,
    log_period_and_damping,
    stored_log,
)

RANDOM = np.random.default_rng(5)
NODES, PAIRS = 40, 6
#: An uneven grid of periods, and three rows of spectra.
SPECTRA = LogSpectra(
    np.log([0.1, 0.13, 0.3, 0.31, 1.0, 2.5]),
    np.log([0.02, 0.05, 0.2]),
    RANDOM.normal(-3.0, 1.0, (3, 3, 6)),
)
DEVIATES = RANDOM.normal(size=(4, NODES))
#: Correlation of both ln periods of each pair.
SHARED = np.array([0.0, 0.2, 0.85, 1.0, 0.5, 0.0])


def _pairs():
    """Return oscillators of pairs in the rows of the kernel."""
    building = [
        RANDOM.uniform(0.05, 3.0, PAIRS),
        np.array([0.0, 0.2, 0.4, 0.2, 1.0, 0.0]),
        RANDOM.uniform(0.01, 0.3, PAIRS),
        np.array([0.0, 0.3, 0.0, 0.3, 3.0, 0.3]),
        np.full(PAIRS, 0.99),
        RANDOM.uniform(0.5, 2.0, PAIRS),
    ]
    other = [np.array(row) for row in building]
    other[0], other[5] = 0.7 * other[0], RANDOM.uniform(0.5, 2.0, PAIRS)
    return np.stack([*building, *other])


def _difference(first, second, correlation):
    square = (first - second) ** 2 + 2.0 * (1.0 - correlation) * first * second
    return np.where(np.sqrt(square) > 1e-7 * (first + second), np.sqrt(square), 0.0)


def _definition(rows, oscillators, shifts, spectra):
    """Return the motion at all nodes, (5, n_pairs, n_nodes)."""
    buildings = []
    for i in range(2):
        period, period_std, damping, damping_std, largest, radius = oscillators[6 * i : 6 * i + 6]
        deviate = DEVIATES[0] + np.zeros((PAIRS, 1))
        if i == 1:
            own = np.sqrt(1.0 - SHARED**2)
            deviate = np.outer(SHARED, DEVIATES[0]) + np.outer(own, DEVIATES[2])
        periods = period[:, None] * np.exp(period_std[:, None] * deviate)
        dampings = damping[:, None] * np.exp(np.outer(damping_std, DEVIATES[2 * i + 1]))
        dampings = np.minimum(dampings, largest[:, None])
        stored = stored_log(spectra, rows[:, None], *log_period_and_damping(periods, dampings))
        buildings.append((periods, dampings, radius[:, None] * np.exp(stored)))
    (period_1, damping_1, radius_1), (period_2, damping_2, radius_2) = buildings
    by_noise = ddc_correlation(period_1, damping_1, period_2, damping_2)
    correlation = np.clip(by_noise + shifts[:, None], -1.0, 1.0)
    speed_1, speed_2 = 2 * np.pi / period_1 * radius_1, 2 * np.pi / period_2 * radius_2
    demand = _difference(radius_1, radius_2, correlation)
    velocity = _difference(speed_1, speed_2, correlation)
    return np.stack([demand, velocity, speed_1, speed_2, by_noise])


def _found(rows, oscillators, shifts, spectra=SPECTRA):
    motion = np.empty((MOTION_ROWS, rows.size, NODES))
    correlations = np.stack([shifts, SHARED])
    estimate_motion(*spectra, rows, oscillators, correlations, DEVIATES, motion)
    return motion


@pytest.mark.parametrize("dampings", [slice(0, 3), slice(0, 2), slice(1, 2)])
def test_against_the_definition(dampings):
    # also on one stored damping; mutations: nodes of building 2 for 1, damping above the largest,
    # the neighbour of a cell beyond the grid, shift added to the correlation of the loss
    spectra = SPECTRA._replace(
        dampings=SPECTRA.dampings[dampings],
        radii=np.ascontiguousarray(SPECTRA.radii[:, dampings]),
    )
    rows = np.array([0, 1, 2, 0, 1, 2])
    oscillators, shifts = _pairs(), np.array([0.0, 0.2, -0.3, 2.0, 0.0, -2.0])
    expected = _definition(rows, oscillators, shifts, spectra)
    # rounding of logarithms and exponentials, which a difference of radii enlarges
    assert_allclose(_found(rows, oscillators, shifts, spectra), expected, rtol=1e-9, atol=1e-12)


def test_equal_buildings_move_as_one():
    # would catch the rounding of a correlation of 1 taken for a demand
    oscillators = _pairs()
    oscillators[6:] = oscillators[:6]
    oscillators[[1, 3, 7, 9]] = 0.0
    motion = _found(np.zeros(PAIRS, dtype=int), oscillators, np.zeros(PAIRS))
    assert np.all(motion[DEMAND] == 0.0)
    assert_allclose(motion[CORRELATION], 1.0, rtol=1e-14)


def test_undamped_buildings_are_correlated_only_if_equal():
    oscillators = _pairs()
    oscillators[[2, 8]] = 0.0
    oscillators[[1, 7]] = 0.0
    oscillators[6, 0] = oscillators[0, 0]
    motion = _found(np.zeros(PAIRS, dtype=int), oscillators, np.zeros(PAIRS))
    assert np.isfinite(motion).all()
    assert np.all(motion[CORRELATION, 0] == 1.0)
    assert np.all(motion[CORRELATION, 1:] == 0.0)
