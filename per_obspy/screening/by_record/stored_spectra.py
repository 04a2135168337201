"""Interpolation of a station's stored spectra in log period and log damping."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.screening.values import Table, values

#: Dampings are compared on a logarithmic scale; below this one they count as it.
SMALLEST_DAMPING = 1e-3


class LogSpectra(NamedTuple):
    """
    Stored spectra on logarithmic axes.

    Attributes
    ----------
    periods, dampings : (n_periods,), (n_dampings,) ndarray
        Logarithms of periods in s and of dampings as fractions of critical.
    radii : (n_azimuths, n_dampings, n_periods) ndarray
        Logarithms of PER or SD in m.
    """

    periods: FloatArray
    dampings: FloatArray
    radii: FloatArray


def log_oscillator(table: Table, i: int) -> tuple[FloatArray, FloatArray]:
    """Return ln period and ln damping of building i."""
    return log_period_and_damping(values(table, f"period_{i}"), values(table, f"damping_{i}"))


def log_period_and_damping(
    period: FloatArray, damping: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return ln period and ln damping, in s and fractions of critical."""
    return np.log(period), np.log(np.maximum(damping, SMALLEST_DAMPING))


def stored_log(
    spectra: LogSpectra, row: NDArray[np.intp], log_period: FloatArray, log_damping: FloatArray
) -> FloatArray:
    """
    Interpolate stored logarithms at (ln period, ln damping); constant beyond the grid.

    Parameters
    ----------
    spectra : LogSpectra
        The grid.
    row : ndarray of int
        Of the azimuth.
    log_period, log_damping : ndarray
        Of the shape of the rows, or broadcast to it.

    Returns
    -------
    stored : ndarray
        ln PER or ln SD in m, bilinear on the logarithmic axes.
    """
    periods, dampings, radii = spectra
    # cell of the grid and position in it, along either axis
    column, period_share = _lower_neighbour(periods, log_period)
    plane, damping_share = _lower_neighbour(dampings, log_damping)
    next_plane = np.minimum(plane + 1, dampings.size - 1)
    next_column = np.minimum(column + 1, periods.size - 1)
    # along the period at the damping below and at that above, then from one to the other
    left, right = radii[row, plane, column], radii[row, plane, next_column]
    lower = (1 - period_share) * left + period_share * right
    left, right = radii[row, next_plane, column], radii[row, next_plane, next_column]
    upper = (1 - period_share) * left + period_share * right
    stored: FloatArray = (1 - damping_share) * lower + damping_share * upper
    return stored


def _lower_neighbour(grid: FloatArray, points: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the lower neighbour on a grid, and the fraction towards the next one, 0 to 1."""
    if grid.size == 1:
        return np.zeros(points.shape, dtype=np.intp), np.zeros(points.shape)
    lower = np.clip(np.searchsorted(grid, points) - 1, 0, grid.size - 2)
    return lower, np.clip((points - grid[lower]) / (grid[lower + 1] - grid[lower]), 0.0, 1.0)
