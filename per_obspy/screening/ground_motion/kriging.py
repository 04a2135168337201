"""
Ground motion between stations: an attenuation trend, and how far the motion around a place departs from it.

Within each site class and at each period, ln PER is a trend fitted by generalised least squares
plus a residual whose spatial correlation is that of Jayaram & Baker (2009), published for spectral
acceleration and used here for PER. Median and log-standard deviation are those of universal
kriging: at a station its own value and no deviation, far from every station the trend, the whole
deviation and what is unknown of the trend. The trend knows every station; the residual of a place
is told by its nearest ones. Numbers of a place depend on no other place.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config import Interpolation
from per_obspy.constants import EARTH_RADIUS
from per_obspy.kernels.kriging import kriged
from per_obspy.screening.ground_motion.assignment import on_sphere
from per_obspy.screening.ground_motion.sites import Sites
from per_obspy.screening.ground_motion.spatial_correlation import decay_length
from per_obspy.screening.ground_motion.trend import Group, features_of, fitted_group

#: Stations that tell the residual of a place, the nearest ones: they screen the others. Of 300
#: stations within 60 km whose motion has the assumed correlation, the nearest 20 give deviations
#: within 0.7 % of those of all of them, and medians within 0.1 deviations at 99 places of 100.
NEIGHBOURS = 20


class Field(NamedTuple):
    """
    Everything that the motion at any place is told from; small, and the same for every worker.

    Attributes
    ----------
    periods : (n_periods,) ndarray
        Grid, s, rising.
    groups : dict
        Site class to the stations on it with their trend; under ``None`` all stations.
    vs30_clustered : bool
        The case of the correlation.
    """

    periods: FloatArray
    groups: dict[str | None, Group]
    vs30_clustered: bool


class InterpolatedMotion(NamedTuple):
    """
    Motion at places without a station, each at its own period.

    Attributes
    ----------
    ln_median : (n_places,) ndarray
        Of PER in m; NaN at a period that no station supports.
    log_std : (n_places,) ndarray
        Log-standard deviation; NaN as well.
    fallback : (n_places,) ndarray of bool
        Whether no station stands on the place's site class, so that stations of other classes were
        used.
    """

    ln_median: FloatArray
    log_std: FloatArray
    fallback: NDArray[np.bool_]


def fitted_field(
    stations: Sites,
    ln_per: ArrayLike,
    usable: ArrayLike,
    periods: ArrayLike,
    settings: Interpolation,
) -> Field:
    """
    Fit the trend of each site class, and of all stations for places that no class of its own serves.

    Parameters
    ----------
    stations : Sites
        Where there are records.
    ln_per : (n_stations, n_periods) array_like
        Natural logarithm of PER in m.
    usable : (n_stations, 2) array_like
        Shortest and longest period that the record supports, s.
    periods : (n_periods,) array_like
        s, rising; at least two.
    settings : Interpolation
        What is assumed of the deviation, and the case of the correlation.

    Raises
    ------
    ValueError
        If shapes differ, a period is not positive, or there is no station.

    Notes
    -----
    The trend is a mean, with a slope in the logarithm of the distance to the source and one in that
    of Vs30 where enough stations differ enough in it; a place whose value is unknown is given the
    stations' mean. The deviation joins the stations' own with the assumed one ``s0``, which counts
    as ``w`` stations: ``s² = (w s0² + e' C^-1 e) / (w + n - p)``.

    References
    ----------
    Cressie (1993), Statistics for Spatial Data, section 3.4 (universal kriging); Jayaram & Baker
    (2009).
    """
    values, grid = (
        checks.finite("ln_per", ln_per),
        np.atleast_1d(checks.positive("periods", periods)),
    )
    if values.shape != (stations.longitude.size, grid.size) or not values.size:
        raise ValueError(
            f"ln_per must be ({stations.longitude.size}, {grid.size}) and not empty, got {values.shape}"
        )
    if grid.size < 2 or (np.diff(grid) <= 0).any():
        raise ValueError(f"periods must be at least two and rising, got {grid}")
    limits = checks.numbers("usable", usable)
    names = np.unique(stations.site_class.astype(str)).tolist()
    chosen = {
        name: np.flatnonzero(stations.site_class == name)
        for name in names
        if name or len(names) == 1
    }
    groups: dict[str | None, Group] = {
        name: fitted_group(stations.at(some), values[some], limits[some], grid, settings)
        for name, some in chosen.items()
    }
    groups[None] = (
        groups[names[0]]
        if len(names) == 1
        else fitted_group(stations, values, limits, grid, settings)
    )
    return Field(grid, groups, settings.vs30_clustered)


def motion_at(field: Field, places: Sites, period: ArrayLike) -> InterpolatedMotion:
    """
    Estimate the motion at places from the stations around them.

    Parameters
    ----------
    field : Field
        From :func:`fitted_field`.
    places : Sites
        Where the motion is wanted.
    period : (n_places,) array_like
        One for each place, s. Between the grid's periods ln PER is linear in the logarithm of the
        period.

    Notes
    -----
    Stations of a place's own site class serve it. Where there is none that supports the period, or
    the class of the place is unknown while that of a station is known, all stations do and
    ``fallback`` says so.
    """
    # functions of NumPy may differ in the last bit between strides
    wanted = np.ascontiguousarray(
        np.broadcast_to(checks.positive("period", period), places.longitude.shape)
    )
    out, fallback = np.full((wanted.size, 2), np.nan), np.zeros(wanted.size, dtype=bool)
    for rows, group in _served(field, places):
        out[rows] = _kriged(field, group, places.at(rows), wanted[rows])
    inside = (wanted >= field.periods[0]) & (wanted <= field.periods[-1])
    left = np.flatnonzero(np.isnan(out[:, 0]) & inside)
    out[left] = _kriged(field, field.groups[None], places.at(left), wanted[left])
    fallback[left] = ~np.isnan(out[left, 0])
    return InterpolatedMotion(out[:, 0].copy(), out[:, 1].copy(), fallback)


def _served(field: Field, places: Sites) -> Iterator[tuple[NDArray[np.intp], Group]]:
    """Give places with the stations on their site class."""
    for name in np.unique(places.site_class.astype(str)).tolist():
        if name in field.groups:
            yield np.flatnonzero(places.site_class == name), field.groups[name]


def _kriged(field: Field, group: Group, places: Sites, period: FloatArray) -> FloatArray:
    """Return median and deviation, (n_places, 2), NaN where no station of the group knows."""
    out = np.full((period.size, 2), np.nan)
    lower, share = on_grid(field.periods, period)
    arrays = (
        on_sphere(places.longitude, places.latitude),
        features_of(places),
        period,
        lower,
        share,
        decay_length(period, field.vs30_clustered),
    )
    kriged(*group, arrays, 2.0 * EARTH_RADIUS, NEIGHBOURS, out)
    out[(period < field.periods[0]) | (period > field.periods[-1])] = np.nan
    return out


def on_grid(periods: FloatArray, period: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Return the lower neighbour on a grid of periods, and the part of the way to the next in ln period; kept on it."""
    lower = np.clip(np.searchsorted(periods, period, side="right") - 1, 0, periods.size - 2)
    grid = np.log(periods)
    share = (np.log(period) - grid[lower]) / (grid[lower + 1] - grid[lower])
    return lower.astype(np.int64), np.clip(share, 0.0, 1.0)
