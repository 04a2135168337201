"""
Ground motion between stations: an attenuation trend, and how far the motion around a place departs from it.

Within each site class and at each period, ln PER is a trend fitted by generalised least squares plus a residual whose
spatial correlation is that of Jayaram & Baker (2009), published for spectral acceleration and used here for PER.
Median and log-standard deviation are those of universal kriging: at a station its own value and no deviation, far from
every station the trend, the whole deviation and what is unknown of the trend.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config import Interpolation
from per_obspy.screening.spatial import great_circle, residual_correlation

#: A slope of the trend (of ln distance, of ln Vs30) is fitted where so many stations differ by so much; our choice.
STATIONS_PER_SLOPE, SPREAD = 6, 0.1

#: Stations whose coordinates agree to so many decimals of a degree (1 m) are one place: their mean ln PER counts.
DECIMALS = 5


class Sites(NamedTuple):
    """
    Places, (n_places,).

    Attributes
    ----------
    longitude, latitude : ndarray
        Degrees east and north.
    site_class : ndarray of str
        Any words; ``""`` where it is unknown.
    source_distance : ndarray
        To the source of the earthquake, m; NaN where it is unknown.
    vs30 : ndarray
        m/s; NaN where it is unknown.
    """

    longitude: FloatArray
    latitude: FloatArray
    site_class: NDArray[np.object_]
    source_distance: FloatArray
    vs30: FloatArray

    def at(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> "Sites":
        """Return some of the places."""
        return Sites(
            self.longitude[rows],
            self.latitude[rows],
            self.site_class[rows],
            self.source_distance[rows],
            self.vs30[rows],
        )


class InterpolatedMotion(NamedTuple):
    """
    Motion at places without a station.

    Attributes
    ----------
    ln_median : (n_places, n_periods) ndarray
        Of PER in m; NaN at a period that no station supports.
    log_std : (n_places, n_periods) ndarray
        Log-standard deviation; NaN as well.
    fallback : (n_places,) ndarray of bool
        Whether no station stands on the place's site class, so that stations of other classes were used.
    """

    ln_median: FloatArray
    log_std: FloatArray
    fallback: NDArray[np.bool_]


def sites(
    longitude: ArrayLike,
    latitude: ArrayLike,
    site_class: ArrayLike = "",
    source_distance: ArrayLike = np.nan,
    vs30: ArrayLike = np.nan,
) -> Sites:
    """Return places with what is known of them; one value may stand for all (see :class:`Sites`)."""
    east = np.atleast_1d(checks.between("longitude", longitude, -180.0, 180.0))
    north = np.atleast_1d(checks.between("latitude", latitude, -90.0, 90.0))
    numbers = (np.broadcast_to(np.asarray(values, dtype=np.float64), east.shape) for values in (source_distance, vs30))
    return Sites(east, north, np.broadcast_to(np.asarray(site_class, dtype=object), east.shape), *numbers)


def interpolated_motion(
    stations: Sites, ln_per: ArrayLike, periods: ArrayLike, places: Sites, settings: Interpolation
) -> InterpolatedMotion:
    """
    Estimate the motion at places from the stations around them.

    Parameters
    ----------
    stations : Sites
        Where there are records.
    ln_per : (n_stations, n_periods) array_like
        Natural logarithm of PER in m; NaN at periods that a record does not support.
    periods : (n_periods,) array_like
        s.
    places : Sites
        Where the motion is wanted.
    settings : Interpolation
        What is assumed of the deviation, and the case of the correlation.

    Returns
    -------
    InterpolatedMotion

    Raises
    ------
    ValueError
        If shapes differ, a period is not positive, or there is no station.

    Notes
    -----
    Stations of a place's own site class serve it; where there is none, or the class of the place is unknown while that
    of a station is known, all stations do and ``fallback`` says so. The trend is a mean, with a slope in the logarithm
    of the distance to the source and one in that of Vs30 where enough stations differ enough in it; a place whose
    value is unknown is given the stations' mean. The deviation joins the stations' own with the assumed one
    ``s0``, which counts as ``w`` stations: ``s² = (w s0² + e' C^-1 e) / (w + n - p)``.

    References
    ----------
    Cressie (1993), Statistics for Spatial Data, section 3.4 (universal kriging); Jayaram & Baker (2009).
    """
    values = checks.numbers("ln_per", ln_per)
    grid = np.atleast_1d(checks.positive("periods", periods))
    if values.shape != (stations.longitude.size, grid.size) or not values.size:
        raise ValueError(f"ln_per must be ({stations.longitude.size}, {grid.size}) and not empty, got {values.shape}")
    median, deviation = np.full((2, places.longitude.size, grid.size), np.nan)
    fallback = np.zeros(places.longitude.size, dtype=bool)
    for rows, serving, is_fallback in _served(stations, places):
        fallback[rows] = is_fallback
        near, mean = _one_a_place(stations.at(serving), values[serving])
        field = _Field(near, places.at(rows), _distances(near, near), _distances(near, places.at(rows)))
        for column in np.flatnonzero(np.isfinite(mean).any(axis=0)):
            known = np.isfinite(mean[:, column])
            one = _kriged(field.knowing(known), mean[known, column], float(grid[column]), settings)
            median[rows, column], deviation[rows, column] = one
    return InterpolatedMotion(median, deviation, fallback)


def at_period(motion: InterpolatedMotion, periods: ArrayLike, period: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """
    Return the logarithm of the median (PER in m) and the log-standard deviation at each place's own period.

    Parameters
    ----------
    motion : InterpolatedMotion
        At the places, on a grid of periods.
    periods : (n_periods,) array_like
        The grid, s, rising; at least two.
    period : (n_places,) array_like
        One for each place, s. Between the grid's periods both are linear in the logarithm of the period.

    Returns
    -------
    ln_median, log_std : (n_places,) ndarray
        NaN outside the grid, and beside a period that no station supports.
    """
    grid, wanted = np.log(checks.positive("periods", periods)), np.log(checks.positive("period", period))
    lower = np.clip(np.searchsorted(grid, wanted, side="right") - 1, 0, grid.size - 2)
    share = (wanted - grid[lower]) / (grid[lower + 1] - grid[lower])
    share = np.where((wanted < grid[0]) | (wanted > grid[-1]), np.nan, share)
    row = np.arange(wanted.size)
    median, deviation = (
        (1.0 - share) * values[row, lower] + share * values[row, lower + 1]
        for values in (motion.ln_median, motion.log_std)
    )
    return median, deviation


def _served(stations: Sites, places: Sites) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp], bool]]:
    """Give places with the stations that serve them, and whether these are of other site classes."""
    nobody_knows = bool((stations.site_class == "").all())
    for name in np.unique(places.site_class.astype(str)):
        rows = np.flatnonzero(places.site_class == name)
        same = np.flatnonzero(stations.site_class == name) if name or nobody_knows else np.array([], dtype=np.intp)
        yield rows, (same if same.size else np.arange(stations.longitude.size)), not same.size


def _one_a_place(stations: Sites, values: FloatArray) -> tuple[Sites, FloatArray]:
    """Return one row for each place that has stations, with the mean of what they know."""
    position = np.round(np.stack([stations.longitude, stations.latitude], axis=1), DECIMALS)
    _, first, place = np.unique(position, axis=0, return_index=True, return_inverse=True)
    known = np.isfinite(values)
    total, count = np.zeros((2, first.size, values.shape[1]))
    np.add.at(total, place, np.where(known, values, 0.0))
    np.add.at(count, place, known)
    mean = np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0)
    return stations.at(first), mean


class _Field(NamedTuple):
    """Stations, places that they serve, and the distances between them, m."""

    stations: Sites
    places: Sites
    between: FloatArray
    across: FloatArray

    def knowing(self, known: NDArray[np.bool_]) -> "_Field":
        """Return the field with some of the stations."""
        if known.all():
            return self
        return _Field(self.stations.at(known), self.places, self.between[np.ix_(known, known)], self.across[known])


def _distances(some: Sites, others: Sites) -> FloatArray:
    return great_circle(
        some.longitude[:, None], some.latitude[:, None], others.longitude[None, :], others.latitude[None, :]
    )


def _kriged(field: _Field, values: FloatArray, period: float, settings: Interpolation) -> tuple[FloatArray, FloatArray]:
    """Return median and deviation at the places, of one period and from stations that all know it."""
    trend, trend_there = _trends(field.stations, field.places)
    between, across = (residual_correlation(d, period, settings.vs30_clustered) for d in (field.between, field.across))
    factor = cho_factor(between, lower=True)
    weighted = cho_solve(factor, trend)
    normal = cho_factor(trend.T @ weighted, lower=True)
    coefficients = cho_solve(normal, weighted.T @ values)
    residual = values - trend @ coefficients
    told = cho_solve(factor, residual)
    freedom = settings.log_std_weight + values.size - trend.shape[1]
    variance = (settings.log_std_weight * settings.log_std**2 + residual @ told) / freedom
    unknown = trend_there.T - weighted.T @ across
    left = 1.0 - np.einsum("ij,ij->j", across, cho_solve(factor, across))
    of_trend = np.einsum("ij,ij->j", unknown, cho_solve(normal, unknown))
    deviation = np.sqrt(variance * np.maximum(left + of_trend, 0.0))
    return trend_there @ coefficients + told @ across, deviation


def _trends(stations: Sites, places: Sites) -> tuple[FloatArray, FloatArray]:
    """Return what the trend depends on, at the stations and at the places: a mean, and slopes that can be told."""
    here, there = [np.ones(stations.longitude.size)], [np.ones(places.longitude.size)]
    for known, wanted in ((stations.source_distance, places.source_distance), (stations.vs30, places.vs30)):
        enough = known.size >= STATIONS_PER_SLOPE * len(here) and bool(np.isfinite(known).all())
        if enough and float(np.log(known).std()) > SPREAD:
            middle = np.log(known).mean()
            here.append(np.log(known) - middle)
            there.append(np.nan_to_num(np.log(wanted) - middle))
    return np.stack(here, axis=1), np.stack(there, axis=1)
