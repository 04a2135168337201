"""
Ground motion between stations: an attenuation trend and kriging of the residuals about it.

Within each site class and at each period, ln PER is a trend fitted by generalised least squares
plus a residual whose spatial correlation is that of Jayaram & Baker (2009), published for spectral
acceleration and used here for PER. Median and log-standard deviation are those of universal
kriging: at a station its value and no deviation, far from every station the trend, the whole
deviation and the uncertainty of the trend. The trend uses every station, the residual of a place
its nearest ones. Numbers of a place depend on no other place.
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

#: Number of nearest stations that decide the residual of a place: they screen the others. Of 300
#: stations within 60 km whose motion has the assumed correlation, the nearest 20 give deviations
#: within 0.7 % of those of all of them, and medians within 0.1 deviations at 99 places of 100.
NEIGHBOURS = 20


class MotionField(NamedTuple):
    """
    Fitted trend and residuals of a region, small enough to be sent to every worker.

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
    Motion at places without a station, each at a different period.

    Attributes
    ----------
    ln_median : (n_places,) ndarray
        Of PER in m; NaN at a period that no station supports.
    log_std : (n_places,) ndarray
        Log-standard deviation; NaN as well.
    fallback : (n_places,) ndarray of bool
        Whether the place's site class has no station that supports the period, so that stations of
        other classes were used.
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
) -> MotionField:
    """
    Fit one trend per site class, and one of all stations for places of other classes.

    Parameters
    ----------
    stations : Sites
        Places of the records.
    ln_per : (n_stations, n_periods) array_like
        Natural logarithm of PER in m.
    usable : (n_stations, 2) array_like
        Shortest and longest period that the record supports, s.
    periods : (n_periods,) array_like
        s, rising; at least two.
    settings : Interpolation
        Assumed deviation, and the case of the spatial correlation.

    Raises
    ------
    ValueError
        If shapes differ, a period is not positive, or there is no station.

    Notes
    -----
    The trend is a mean, with a slope in the logarithm of the distance to the source and one in that
    of Vs30 where enough stations differ enough in it; a place whose value is unknown takes the
    mean of stations. The deviation joins those of the stations with the assumed ``s0``, counted
    as ``w`` stations: ``s² = (w s0² + e' C^-1 e) / (w + n - p)``.

    References
    ----------
    Cressie (1993), Statistics for Spatial Data, section 3.4 (universal kriging); Jayaram & Baker
    (2009).
    """
    values, grid = _checked_grid(stations, ln_per, periods)
    limits = checks.numbers("usable", usable)

    # One group per known site class; unknown classes are a group only if all classes are unknown
    names = np.unique(stations.site_class.astype(str)).tolist()
    groups: dict[str | None, Group] = {}
    for name in names:
        if name or len(names) == 1:
            rows = np.flatnonzero(stations.site_class == name)
            groups[name] = fitted_group(
                stations.at(rows), values[rows], limits[rows], grid, settings
            )

    # All stations together serve the places that no group of the same class serves
    if len(names) == 1:
        groups[None] = groups[names[0]]
    else:
        groups[None] = fitted_group(stations, values, limits, grid, settings)
    return MotionField(grid, groups, settings.vs30_clustered)


def _checked_grid(
    stations: Sites, ln_per: ArrayLike, periods: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Return ln PER of every station and the grid of periods."""
    # Shapes first, then a grid that can be interpolated
    values = checks.finite("ln_per", ln_per)
    grid = np.atleast_1d(checks.positive("periods", periods))
    if values.shape != (stations.longitude.size, grid.size) or not values.size:
        raise ValueError(
            f"ln_per must be ({stations.longitude.size}, {grid.size}) and not empty, "
            f"got {values.shape}"
        )
    if grid.size < 2 or (np.diff(grid) <= 0).any():
        raise ValueError(f"periods must be at least two and rising, got {grid}")
    return values, grid


def motion_at(field: MotionField, places: Sites, period: ArrayLike) -> InterpolatedMotion:
    """
    Estimate the motion at places from the stations around them.

    Parameters
    ----------
    field : MotionField
        From :func:`fitted_field`.
    places : Sites
        Places at which the motion is estimated.
    period : (n_places,) array_like
        One for each place, s. Between the grid's periods ln PER is linear in the logarithm of the
        period.

    Notes
    -----
    Stations of a place's site class serve it. Where there is none that supports the period, or
    the class of the place is unknown while that of a station is known, all stations do and
    ``fallback`` is true.
    """
    # Contiguous: functions of NumPy may differ in the last bit between strides
    target = np.ascontiguousarray(
        np.broadcast_to(checks.positive("period", period), places.longitude.shape)
    )

    # Stations of the same site class
    motion = np.full((target.size, 2), np.nan)
    for rows, group in _places_by_class(field, places):
        motion[rows] = _kriged(field, group, places.at(rows), target[rows])

    # All stations where that class has no motion at a period of the grid
    on_the_grid = (target >= field.periods[0]) & (target <= field.periods[-1])
    rest = np.flatnonzero(np.isnan(motion[:, 0]) & on_the_grid)
    motion[rest] = _kriged(field, field.groups[None], places.at(rest), target[rest])
    fallback = np.zeros(target.size, dtype=bool)
    fallback[rest] = ~np.isnan(motion[rest, 0])
    return InterpolatedMotion(motion[:, 0].copy(), motion[:, 1].copy(), fallback)


def _places_by_class(field: MotionField, places: Sites) -> Iterator[tuple[NDArray[np.intp], Group]]:
    """Yield the places of each site class with the stations on it."""
    for name in np.unique(places.site_class.astype(str)).tolist():
        if name in field.groups:
            yield np.flatnonzero(places.site_class == name), field.groups[name]


def _kriged(field: MotionField, group: Group, places: Sites, period: FloatArray) -> FloatArray:
    """Return median and deviation, (n_places, 2), NaN where no station of the group serves."""
    lower, share = on_grid(field.periods, period)
    # Positions on the unit sphere, so that distances are chords times the Earth's radius
    arrays = (
        on_sphere(places.longitude, places.latitude),
        features_of(places),
        period,
        lower,
        share,
        decay_length(period, field.vs30_clustered),
    )
    motion = np.full((period.size, 2), np.nan)
    kriged(*group, arrays, 2.0 * EARTH_RADIUS, NEIGHBOURS, motion)
    motion[(period < field.periods[0]) | (period > field.periods[-1])] = np.nan
    return motion


def on_grid(periods: FloatArray, period: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Return the lower neighbour on a grid of periods, and the fraction of the step in ln T."""
    lower = np.clip(np.searchsorted(periods, period, side="right") - 1, 0, periods.size - 2)
    grid = np.log(periods)
    share = (np.log(period) - grid[lower]) / (grid[lower + 1] - grid[lower])
    return lower.astype(np.int64), np.clip(share, 0.0, 1.0)
