"""
Ground motion between stations: an attenuation trend and kriging of the residuals about it.

Within each site class and at each period, ln PER is a trend fitted by generalised least squares
plus a residual whose spatial correlation is that of Jayaram & Baker (2009), published for spectral
acceleration and used here for PER. Median and log-standard deviation are those of universal
kriging: at a station its value and no deviation, far from every station the trend, the whole
deviation and the uncertainty of the trend. The trend uses every station, the residual of a place
its nearest ones. Numbers of a place depend on no other place.

The slope in ln distance has a prior, because few stations do not resolve it and all attenuation has
it; mean and the slope in ln Vs30 have none. Prior of slope and variance are conjugate: given the
stations every motion has Student's t distribution, whose deviation the trend keeps.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.config import Interpolation
from per_obspy.constants import EARTH_RADIUS
from per_obspy.kernels.kriging import kriged
from per_obspy.screening.assignment import Sites, on_sphere
from per_obspy.screening.values import BoolArray, Both, IndexArray

#: The longest period for which the correlation was published, s; longer ones take its value.
LONGEST = 10.0


def great_circle(
    longitude_1: ArrayLike, latitude_1: ArrayLike, longitude_2: ArrayLike, latitude_2: ArrayLike
) -> FloatArray:
    """Compute distances on the sphere, m, of places in degrees; 0 between a place and itself."""
    east_1, north_1 = np.radians(longitude_1), np.radians(latitude_1)
    east_2, north_2 = np.radians(longitude_2), np.radians(latitude_2)
    # The haversine formula keeps its digits at small distances
    across = np.cos(north_1) * np.cos(north_2) * np.sin((east_2 - east_1) / 2.0) ** 2
    half_chord = np.sqrt(np.sin((north_2 - north_1) / 2.0) ** 2 + across)
    distance: FloatArray = 2.0 * EARTH_RADIUS * np.arcsin(np.minimum(half_chord, 1.0))
    return distance


def spatial_correlation(
    distance: ArrayLike, period: float, vs30_clustered: bool = False
) -> FloatArray:
    """
    Compute the correlation of within-event residuals of ln SA at two places.

    Parameters
    ----------
    distance : array_like
        Between the places, m.
    period : float
        s; above 10 s that of 10 s.
    vs30_clustered : bool
        Whether Vs30 varies smoothly over the region (case 2), which makes short periods agree over
        longer distances.

    Returns
    -------
    correlation : ndarray
        Dimensionless, 1 at distance 0.

    References
    ----------
    Jayaram & Baker (2009), Earthquake Engineering and Structural Dynamics 38, 1687-1708, equations
    (17) to (20).

    Examples
    --------
    >>> print(spatial_correlation([0.0, 25_700.0], 1.0).round(4))
    [1.     0.0498]
    """
    period = checks.number("period", period, checks.not_negative)
    return residual_correlation(checks.not_negative("distance", distance), period, vs30_clustered)


def residual_correlation(distance: FloatArray, period: float, vs30_clustered: bool) -> FloatArray:
    """Return :func:`spatial_correlation` of arguments that need no check."""
    correlation: FloatArray = np.exp(-distance / decay_length(np.asarray(period), vs30_clustered))
    return correlation


def decay_length(period: FloatArray, vs30_clustered: bool) -> FloatArray:
    """Return the distance at which the correlation is 1/e, m: a third of the published range."""
    # Jayaram & Baker (2009), equations (17) and (18) below 1 s, (19) above
    short = 40.7 - 15.0 * period if vs30_clustered else 8.5 + 17.2 * period
    kilometres = np.where(period >= 1.0, 22.0 + 3.7 * np.minimum(period, LONGEST), short)
    length: FloatArray = 1000.0 / 3.0 * kilometres
    return length


#: Stations per coefficient that a slope without a prior (of ln Vs30) needs, and the standard
#: deviation that the feature must exceed over them; our choice.
STATIONS_PER_SLOPE, SPREAD = 6, 0.1

#: Index of the feature ln distance, the first one, whose slope has a prior.
DISTANCE = 0

#: Stations whose coordinates agree to this number of decimals of a degree (1 m) are one place:
#: their mean ln PER counts.
DECIMALS = 5


#: Per period: coefficients (n_periods, 3), their covariance for a deviation of 1 (n_periods, 3, 3),
#: means of the features (n_periods, 2), deviation of Student's t distribution (n_periods,).
Trend = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


class Group(NamedTuple):
    """
    Stations that serve places together, and their trend, as ``kernels/kriging.py`` takes them.

    Attributes
    ----------
    stations : tuple of ndarray
        Positions on the unit sphere (n, 3), distances between stations (n, n), usable periods
        (n, 2), features (n, 2), residuals of ln PER (n, n_periods).
    trend : tuple of ndarray
        Fit of every period, see ``Trend``.
    """

    stations: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
    trend: Trend


def features_of(places: Sites) -> FloatArray:
    """Return ln source distance and ln Vs30 of places, (n_places, 2), NaN where unknown."""
    return np.log(np.stack([places.source_distance, places.vs30], axis=1))


def fitted_group(
    stations: Sites,
    values: FloatArray,
    usable: FloatArray,
    periods: FloatArray,
    settings: Interpolation,
) -> Group:
    """
    Fit the trend of a group of stations, averaged per place, at every period of a rising grid, s.

    ``values`` are ln PER, (n_stations, n_periods); ``usable`` the shortest and longest period that
    each record supports, s, (n_stations, 2).
    """
    places, mean, limits = _averaged_by_place(stations, values, usable)
    # Distances from each place to each
    distance = great_circle(
        places.longitude[:, None],
        places.latitude[:, None],
        places.longitude[None, :],
        places.latitude[None, :],
    )
    features = features_of(places)
    supported = _supported(limits, periods)
    trend = _trends(distance, features, mean, supported, periods, settings)
    residual = np.ascontiguousarray(mean - _trend_at(trend, features))
    position = on_sphere(places.longitude, places.latitude)
    return Group((position, distance, limits, features, residual), trend)


def _averaged_by_place(
    stations: Sites, values: FloatArray, usable: FloatArray
) -> tuple[Sites, FloatArray, FloatArray]:
    """Average the stations at equal places; keep periods that all of them support."""
    position = np.round(np.stack([stations.longitude, stations.latitude], axis=1), DECIMALS)
    _, first, place = np.unique(position, axis=0, return_index=True, return_inverse=True)

    # Sum ln PER and narrow the usable periods, station by station
    total = np.zeros((first.size, values.shape[1]))
    limits = usable[first].copy()
    np.add.at(total, place, values)
    np.maximum.at(limits[:, 0], place, usable[:, 0])
    np.minimum.at(limits[:, 1], place, usable[:, 1])
    return stations.at(first), total / np.bincount(place)[:, None], limits


def _supported(limits: FloatArray, periods: FloatArray) -> BoolArray:
    """Return (n_places, n_periods): whether a record holds within a grid step of the period."""
    lower = np.concatenate([periods[:1], periods[:-1]])
    upper = np.concatenate([periods[1:], periods[-1:]])
    return (limits[:, :1] <= upper) & (limits[:, 1:] >= lower)


def _trends(
    distance: FloatArray,
    features: FloatArray,
    values: FloatArray,
    supported: BoolArray,
    periods: FloatArray,
    settings: Interpolation,
) -> Trend:
    """Fit the trend of every period to the places whose records support it."""
    fits = []
    for k, period in enumerate(periods.tolist()):
        # Correlation between the places that serve this period
        known = supported[:, k]
        between = distance[np.ix_(known, known)]
        correlation = residual_correlation(between, period, settings.vs30_clustered)
        fits.append(_fitted(correlation, features[known], values[known, k], settings))
    coefficients, covariance, means, deviation = zip(*fits, strict=True)
    return np.array(coefficients), np.array(covariance), np.array(means), np.array(deviation)


def _trend_at(trend: Trend, features: FloatArray) -> FloatArray:
    """Return the trend at places, (n_places, n_periods); an unknown feature counts as its mean."""
    coefficients, _, means, _ = trend
    about = np.nan_to_num(features[None, :, :] - means[:, None, :])
    slopes = np.einsum("kf,knf->kn", coefficients[:, 1:], about)
    values: FloatArray = (coefficients[:, :1] + slopes).T
    return values


def _fitted(
    correlation: FloatArray, features: FloatArray, values: FloatArray, settings: Interpolation
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Fit mean and slopes at one period: coefficients, covariance, means of features, deviation."""
    size = 1 + features.shape[1]
    coefficients, covariance = np.zeros(size), np.zeros((size, size))
    means = np.full(size - 1, np.nan)
    if not values.size:
        return coefficients, covariance, means, np.nan

    # Design matrix X: a mean, and the slopes that these stations can have, about their means
    used = _slopes(features)
    means[used] = features[:, used].mean(axis=0)
    design = np.column_stack([np.ones(values.size), features[:, used] - means[used]])
    prior = _prior(used, settings)
    fit, uncertainty, deviation = _posterior(design, correlation, values, prior, settings)

    # Other slopes are 0, and so is their covariance
    columns = np.concatenate([[0], 1 + used])
    coefficients[columns] = fit
    covariance[np.ix_(columns, columns)] = uncertainty

    return coefficients, covariance, means, deviation


def _prior(used: IndexArray, settings: Interpolation) -> Both:
    """Return expected coefficients and their precision for a deviation of 1; 0 where unknown."""
    expected, precision = np.zeros((2, 1 + used.size))
    if DISTANCE in used:
        expected[1 + DISTANCE] = settings.distance_slope
        precision[1 + DISTANCE] = (settings.log_std / settings.distance_slope_std) ** 2
    return expected, precision


def _posterior(
    design: FloatArray,
    correlation: FloatArray,
    values: FloatArray,
    prior: Both,
    settings: Interpolation,
) -> tuple[FloatArray, FloatArray, float]:
    """Solve (X' C^-1 X + P) b = X' C^-1 y + P b0: b, its covariance, and Student's deviation."""
    expected, precision = prior
    factor = cho_factor(correlation, lower=True)
    normal = cho_factor(design.T @ cho_solve(factor, design) + np.diag(precision), lower=True)
    moments = design.T @ cho_solve(factor, values) + precision * expected
    coefficients: FloatArray = cho_solve(normal, moments)
    covariance: FloatArray = cho_solve(normal, np.eye(design.shape[1]))

    # The deviation of the residuals e joins the assumed one s0, which counts as w stations:
    # s^2 = (w s0^2 + e' C^-1 e + (b - b0)' P (b - b0)) / nu; a prior costs no degree of freedom
    residual = values - design @ coefficients
    squares = residual @ cho_solve(factor, residual)
    squares += (precision * (coefficients - expected) ** 2).sum()
    weight = settings.log_std_weight
    freedom = weight + residual.size - np.sum(precision == 0)
    variance = (weight * settings.log_std**2 + squares) / freedom

    # Student's t distribution of scale s and nu degrees of freedom: s^2 nu / (nu - 2)
    return coefficients, covariance, float(np.sqrt(variance * freedom / (freedom - 2.0)))


def _slopes(features: FloatArray) -> IndexArray:
    """Return a mask of the features with a slope: known distance, and others with enough spread."""
    # the prior makes up for stations that resolve no slope
    used: list[int] = []
    for index, values in enumerate(features.T):
        enough = values.size >= STATIONS_PER_SLOPE * (1 + len(used))
        resolved = enough and float(values.std()) > SPREAD
        if np.isfinite(values).all() and (resolved or index == DISTANCE):
            used.append(index)
    return np.array(used, dtype=np.intp)


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
    fallback: BoolArray


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


def _checked_grid(stations: Sites, ln_per: ArrayLike, periods: ArrayLike) -> Both:
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
    Estimate the motion at places, each at one period, s, from the stations around them.

    Between the grid's periods ln PER is linear in the logarithm of the period. Stations of a
    place's site class serve it. Where there is none that supports the period, or the class of the
    place is unknown while that of a station is known, all stations do and ``fallback`` is true.
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


def _places_by_class(field: MotionField, places: Sites) -> Iterator[tuple[IndexArray, Group]]:
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
