"""
Trend of ln PER over a group of stations, per period, by Bayesian generalised least squares.

The slope in ln distance has a prior, because few stations do not resolve it and all attenuation has
it; mean and the slope in ln Vs30 have none. Prior of slope and variance are conjugate: given the
stations every motion has Student's t distribution, whose deviation the trend keeps.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from per_obspy.checks import FloatArray
from per_obspy.config import Interpolation
from per_obspy.screening.ground_motion.assignment import on_sphere
from per_obspy.screening.ground_motion.sites import Sites
from per_obspy.screening.ground_motion.spatial_correlation import great_circle, residual_correlation

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
    Fit the trend of a group of stations at every period.

    Parameters
    ----------
    stations : Sites
        Places of the stations.
    values : (n_stations, n_periods) ndarray
        ln PER.
    usable : (n_stations, 2) ndarray
        Shortest and longest period that each record supports, s.
    periods : (n_periods,) ndarray
        Grid, s, rising.
    settings : Interpolation
        Assumed deviation and slope, and the case of the spatial correlation.

    Returns
    -------
    Group
        The stations, averaged per place, with their trend.
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


def _supported(limits: FloatArray, periods: FloatArray) -> NDArray[np.bool_]:
    """Return (n_places, n_periods): whether a record holds within a grid step of the period."""
    lower = np.concatenate([periods[:1], periods[:-1]])
    upper = np.concatenate([periods[1:], periods[-1:]])
    return (limits[:, :1] <= upper) & (limits[:, 1:] >= lower)


def _trends(
    distance: FloatArray,
    features: FloatArray,
    values: FloatArray,
    supported: NDArray[np.bool_],
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


def _prior(used: NDArray[np.intp], settings: Interpolation) -> tuple[FloatArray, FloatArray]:
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
    prior: tuple[FloatArray, FloatArray],
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


def _slopes(features: FloatArray) -> NDArray[np.intp]:
    """Return a mask of the features with a slope: known distance, and others with enough spread."""
    # the prior makes up for stations that resolve no slope
    used: list[int] = []
    for index, values in enumerate(features.T):
        enough = values.size >= STATIONS_PER_SLOPE * (1 + len(used))
        resolved = enough and float(values.std()) > SPREAD
        if np.isfinite(values).all() and (resolved or index == DISTANCE):
            used.append(index)
    return np.array(used, dtype=np.intp)
