"""The stored spectra of a station on logarithmic axes, and what they say off their grid."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.screening.values import Table, values

#: Dampings are compared on a logarithmic scale; below this one they count as it.
SMALLEST_DAMPING = 1e-3


class LogSpectra(NamedTuple):
    """
    Stored spectra.

    Attributes
    ----------
    periods, dampings : (n_periods,), (n_dampings,) ndarray
        Their logarithms.
    radii : (n_azimuths, n_dampings, n_periods) ndarray
        Logarithms of PER or SD in m.
    """

    periods: FloatArray
    dampings: FloatArray
    radii: FloatArray


def log_spectra(station: xr.Dataset, name: str = "per") -> LogSpectra:
    """Return the stored PER (``per``) or SD (``sd``) by azimuth; the only horizontal serves for all."""
    by_azimuth = f"{name}_azimuthal"
    stored = (
        station[by_azimuth].to_numpy() if by_azimuth in station else station[name].to_numpy()[:1]
    )
    radii = np.log(np.maximum(stored.astype(np.float64), np.finfo(np.float32).tiny))
    dampings = np.log(np.maximum(station["damping"].to_numpy(), SMALLEST_DAMPING))
    return LogSpectra(np.log(station["period"].to_numpy()), dampings, np.ascontiguousarray(radii))


def azimuth_row(station: xr.Dataset, table: Table) -> NDArray[np.intp]:
    """Return the stored azimuth next to that of each pair."""
    count = station.sizes.get("azimuth", 1)
    azimuth = np.nan_to_num(values(table, "azimuth_used")) % 180.0
    row: NDArray[np.intp] = np.rint(azimuth / (180.0 / count)).astype(np.intp) % count
    return row


def log_place(table: Table, i: int) -> tuple[FloatArray, FloatArray]:
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
    Return the stored logarithm at (ln period, ln damping), linear between; beyond the grid its edge.

    Parameters
    ----------
    spectra : LogSpectra
        The grid.
    row : ndarray of int
        Of the azimuth.
    log_period, log_damping : ndarray
        Of the shape of the rows, or broadcast to it.
    """
    periods, dampings, radii = spectra
    column, part = _between(periods, log_period)
    plane, share = _between(dampings, log_damping)
    above, right = (
        np.minimum(plane + 1, dampings.size - 1),
        np.minimum(column + 1, periods.size - 1),
    )
    lower = (1 - part) * radii[row, plane, column] + part * radii[row, plane, right]
    upper = (1 - part) * radii[row, above, column] + part * radii[row, above, right]
    stored: FloatArray = (1 - share) * lower + share * upper
    return stored


def _between(grid: FloatArray, values: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the lower neighbour on the grid and the part of the way to the next, kept on the grid."""
    if grid.size == 1:
        return np.zeros(values.shape, dtype=np.intp), np.zeros(values.shape)
    lower = np.clip(np.searchsorted(grid, values) - 1, 0, grid.size - 2)
    return lower, np.clip((values - grid[lower]) / (grid[lower + 1] - grid[lower]), 0.0, 1.0)
