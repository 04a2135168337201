"""Interpolation of stored spectra: grid points, laws between them, and the edge beyond."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from per_obspy.screening.station_motion import (
    SMALLEST_DAMPING,
    LogSpectra,
    log_oscillator,
    stored_log,
)

PERIODS, DAMPINGS = np.log([0.1, 0.5, 2.0, 4.0]), np.log([0.02, 0.05, 0.2])
#: A power of period and damping, by azimuth: what bilinear interpolation reproduces exactly.
POWER = LogSpectra(
    PERIODS,
    DAMPINGS,
    np.array([1.0, 3.0])[:, None, None] + 1.5 * PERIODS - 0.4 * DAMPINGS[:, None],
)
ROW = np.array([0, 1, 1])


def test_stored_spectra_are_met_at_their_grid_points(station, record):
    periods = np.log(station["period"].to_numpy()[[3, 20, 59]])
    stored = stored_log(record.per, np.full(3, 4), periods, np.full(3, np.log(0.05)))
    spectrum = station["per_azimuthal"].sel(azimuth=40.0, damping=0.05).to_numpy()
    assert_allclose(stored, np.log(spectrum[[3, 20, 59]]), rtol=1e-6)  # float32


def test_powers_of_period_and_damping_are_met_between_grid_points():
    # would catch: axes exchanged, a share counted from the upper neighbour, another azimuth
    period, damping = np.log([0.11, 1.0, 3.9]), np.log([0.021, 0.05, 0.19])
    expected = np.array([1.0, 3.0, 3.0]) + 1.5 * period - 0.4 * damping
    assert_allclose(stored_log(POWER, ROW, period, damping), expected, rtol=1e-12)


def test_beyond_the_grid_its_edge_counts():
    inside = stored_log(POWER, ROW, PERIODS[[0, 3, 3]], DAMPINGS[[0, 2, 0]])
    outside = stored_log(POWER, ROW, np.log([0.01, 9.0, 5.0]), np.log([0.001, 0.9, 0.01]))
    assert_array_equal(outside, inside)


def test_a_single_damping_serves_every_oscillator():
    single = LogSpectra(PERIODS, DAMPINGS[1:2], POWER.radii[:, 1:2])
    period = np.log([0.2, 1.0, 3.0])
    found = stored_log(single, ROW, period, np.log([0.01, 0.05, 0.5]))
    assert_allclose(found, stored_log(POWER, ROW, period, np.full(3, DAMPINGS[1])), rtol=1e-12)


def test_damping_of_zero_counts_as_the_smallest():
    table = {"period_2": np.array([1.0, 2.0]), "damping_2": np.array([0.0, 0.05])}
    period, damping = log_oscillator(table, 2)
    assert_array_equal(period, np.log([1.0, 2.0]))
    assert_array_equal(damping, np.log([SMALLEST_DAMPING, 0.05]))
