"""The trend of ln PER over the stations that serve places together, period by period, by generalised least squares."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from per_obspy.checks import FloatArray
from per_obspy.config import Interpolation
from per_obspy.screening.ground_motion.assignment import on_sphere
from per_obspy.screening.ground_motion.sites import Sites
from per_obspy.screening.ground_motion.spatial_correlation import great_circle, residual_correlation

#: A slope of the trend (of ln distance, of ln Vs30) is fitted where so many stations differ by so
#: much; our choice.
STATIONS_PER_SLOPE, SPREAD = 6, 0.1

#: Stations whose coordinates agree to so many decimals of a degree (1 m) are one place: their mean
#: ln PER counts.
DECIMALS = 5


class Group(NamedTuple):
    """Stations that serve places together, and their trend: what the kernel takes (see ``kernels/kriging.py``)."""

    stations: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
    trend: tuple[FloatArray, FloatArray, FloatArray, FloatArray]


def features_of(places: Sites) -> FloatArray:
    """Return what the trend depends on, NaN where it is not known."""
    return np.log(np.stack([places.source_distance, places.vs30], axis=1))


def fitted_group(
    stations: Sites,
    values: FloatArray,
    usable: FloatArray,
    periods: FloatArray,
    settings: Interpolation,
) -> Group:
    """Return stations with their trend at every period."""
    near, mean, limits = _one_a_place(stations, values, usable)
    between = great_circle(
        near.longitude[:, None],
        near.latitude[:, None],
        near.longitude[None, :],
        near.latitude[None, :],
    )
    features = features_of(near)
    reach = np.concatenate([periods[:1], periods, periods[-1:]])
    fits = [
        _fitted(
            between,
            features,
            mean[:, k],
            (limits[:, 0] <= reach[k + 2]) & (limits[:, 1] >= reach[k]),
            period,
            settings,
        )
        for k, period in enumerate(periods.tolist())
    ]
    coefficients, covariance, middles, deviation = (
        np.array(part) for part in zip(*fits, strict=True)
    )
    about = np.nan_to_num(features[None, :, :] - middles[:, None, :])
    trend = coefficients[:, :1] + np.einsum("kf,knf->kn", coefficients[:, 1:], about)
    position = on_sphere(near.longitude, near.latitude)
    arrays = (position, between, limits, features, np.ascontiguousarray(mean - trend.T))
    return Group(arrays, (coefficients, covariance, middles, deviation))


def _one_a_place(
    stations: Sites, values: FloatArray, usable: FloatArray
) -> tuple[Sites, FloatArray, FloatArray]:
    """Return one row for each place that has stations: their mean, and the periods that all of them support."""
    position = np.round(np.stack([stations.longitude, stations.latitude], axis=1), DECIMALS)
    _, first, place = np.unique(position, axis=0, return_index=True, return_inverse=True)
    total, limits = np.zeros((first.size, values.shape[1])), usable[first].copy()
    np.add.at(total, place, values)
    np.maximum.at(limits[:, 0], place, usable[:, 0])
    np.minimum.at(limits[:, 1], place, usable[:, 1])
    return stations.at(first), total / np.bincount(place)[:, None], limits


def _fitted(
    between: FloatArray,
    features: FloatArray,
    values: FloatArray,
    known: NDArray[np.bool_],
    period: float,
    settings: Interpolation,
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return coefficients, their covariance for a deviation of 1, middles of the features, and the deviation."""
    size = 1 + features.shape[1]
    coefficients, covariance, middles = (
        np.zeros(size),
        np.zeros((size, size)),
        np.full(size - 1, np.nan),
    )
    if not known.any():
        return coefficients, covariance, middles, np.nan
    used = _slopes(features[known])
    middles[used] = features[known][:, used].mean(axis=0)
    columns = np.concatenate([[0], 1 + used])
    trend = np.column_stack([np.ones(known.sum()), features[known][:, used] - middles[used]])
    factor = cho_factor(
        residual_correlation(between[np.ix_(known, known)], period, settings.vs30_clustered),
        lower=True,
    )
    normal = cho_factor(trend.T @ cho_solve(factor, trend), lower=True)
    coefficients[columns] = cho_solve(normal, trend.T @ cho_solve(factor, values[known]))
    covariance[np.ix_(columns, columns)] = cho_solve(normal, np.eye(columns.size))
    residual = values[known] - trend @ coefficients[columns]
    freedom = settings.log_std_weight + residual.size - columns.size
    variance = (
        settings.log_std_weight * settings.log_std**2 + residual @ cho_solve(factor, residual)
    ) / freedom
    return coefficients, covariance, middles, float(np.sqrt(variance))


def _slopes(features: FloatArray) -> NDArray[np.intp]:
    """Return the features whose slope these stations can tell."""
    used: list[int] = []
    for one, values in enumerate(features.T):
        enough = values.size >= STATIONS_PER_SLOPE * (1 + len(used)) and bool(
            np.isfinite(values).all()
        )
        if enough and float(values.std()) > SPREAD:
            used.append(one)
    return np.array(used, dtype=np.intp)
