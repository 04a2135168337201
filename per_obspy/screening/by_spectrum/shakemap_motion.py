"""The motion of a ShakeMap at places and periods: spectral displacement between nodes, periods and dampings."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.screening.ground_motion.kriging import on_grid


class MapMotion(NamedTuple):
    """
    A ShakeMap at places, (n_places, n_periods).

    Attributes
    ----------
    periods : (n_periods,) ndarray
        s, rising.
    ln_sd : ndarray
        Logarithm of SD in m at 5 % damping; minus infinity where the map has no motion.
    log_std : ndarray
        Log-standard deviation.
    """

    periods: FloatArray
    ln_sd: FloatArray
    log_std: FloatArray


def seen_from(shakemap: xr.Dataset, longitude: FloatArray) -> FloatArray:
    """Return longitudes as a map that crosses the date line counts them."""
    first, last = shakemap["longitude"].values[[0, -1]]
    middle = (first + last) / 2.0
    seen: FloatArray = (longitude - middle + 180.0) % 360.0 - 180.0 + middle
    return seen


def motion_on_map(
    shakemap: xr.Dataset, longitude: FloatArray, latitude: FloatArray, assumed_log_std: float
) -> MapMotion:
    """
    Return the motion of a ShakeMap at places inside it, bilinear between its nodes.

    Parameters
    ----------
    shakemap : Dataset
        From :func:`per_obspy.records.shakemap.read_shakemap`.
    longitude, latitude : (n_places,) ndarray
        Degrees.
    assumed_log_std : float
        Of a map that tells none, dimensionless.
    """
    column, east = _between(shakemap["longitude"].values, seen_from(shakemap, longitude))
    row, north = _between(shakemap["latitude"].values, latitude)

    def at_places(values: FloatArray) -> FloatArray:
        south = (1.0 - east) * values[:, row, column] + east * values[:, row, column + 1]
        further = (1.0 - east) * values[:, row + 1, column] + east * values[:, row + 1, column + 1]
        return np.ascontiguousarray(((1.0 - north) * south + north * further).T)

    periods = shakemap["period"].values
    with np.errstate(divide="ignore"):
        ln_sd = np.log(at_places(shakemap["psa"].values) * (periods / (2.0 * np.pi)) ** 2)
    if "psa_log_std" in shakemap:
        return MapMotion(periods, ln_sd, at_places(shakemap["psa_log_std"].values))
    return MapMotion(periods, ln_sd, np.full(ln_sd.shape, assumed_log_std))


def _between(axis: FloatArray, where: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the lower neighbour on an axis and the part of the way to the next."""
    lower = np.clip(np.searchsorted(axis, where, side="right") - 1, 0, axis.size - 2)
    return lower, np.clip((where - axis[lower]) / (axis[lower + 1] - axis[lower]), 0.0, 1.0)


def displacement_on_map(motion: MapMotion, period: FloatArray, damping: FloatArray) -> FloatArray:
    """Return SD of one oscillator a place, m: linear between logarithms of the periods, times the damping's factor."""
    displacement: FloatArray = np.exp(
        at_period(motion.periods, motion.ln_sd, period)
    ) * damping_factor(damping)
    return displacement


def at_period(periods: FloatArray, told: FloatArray, period: FloatArray) -> FloatArray:
    """Return values (n_places, n_periods) at one period a place, linear in its logarithm; beyond the ends kept."""
    lower, share = on_grid(periods, period)
    place = np.arange(period.size)
    result: FloatArray = (1.0 - share) * told[place, lower] + share * told[place, lower + 1]
    return result


def damping_factor(damping: FloatArray) -> FloatArray:
    """
    Return SD at a damping over that at 5 %.

    Parameters
    ----------
    damping : ndarray
        Fraction of critical.

    References
    ----------
    EN 1998-1:2004, 3.2.2.2 (3), equation (3.6): ``sqrt(10 / (5 + ξ)) >= 0.55``, ξ in per cent.

    Examples
    --------
    >>> print(damping_factor(np.array([0.05, 0.02, 0.5])).round(3))
    [1.    1.195 0.55 ]
    """
    factor: FloatArray = np.maximum(
        np.sqrt(10.0 / (5.0 + 100.0 * checks.fraction_of_critical("damping", damping))), 0.55
    )
    return factor
