"""Probability that a pair pounds, when its radii, its gap and the model are uncertain."""

import warnings

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from per_obspy import checks
from per_obspy.checks import FloatArray
from per_obspy.kernels.pairs.probability import probabilities
from per_obspy.pounding.critical_gap import critical_gap


def pounding_probability(
    per_1: ArrayLike,
    per_2: ArrayLike,
    correlation: ArrayLike,
    gap: ArrayLike,
    dispersion_1: ArrayLike,
    dispersion_2: ArrayLike,
    dispersion_correlation: ArrayLike,
    model_dispersion: ArrayLike = 0.0,
    gap_dispersion: ArrayLike = 0.0,
) -> FloatArray:
    """
    Probability that the critical gap of equation (15) exceeds the gap, exact for lognormal radii, gap and model.

    Parameters
    ----------
    per_1, per_2 : array_like
        Median radii at contact level, m.
    correlation : array_like
        Correlation of the two responses, from -1 to 1, dimensionless.
    gap : array_like
        Median gap, m.
    dispersion_1, dispersion_2 : array_like
        Standard deviations of the logarithms of the radii; see
        :mod:`per_obspy.pounding.dispersion`.
    dispersion_correlation : array_like
        Correlation of the logarithms of the two radii, from -1 to 1, dimensionless. It has no
        default: the ground motion is shared, the periods are not; see the same module.
    model_dispersion, gap_dispersion : array_like, optional
        Standard deviations of the logarithms of the critical gap's model error and of the gap
        (see ``lognormal_dispersion`` there), dimensionless.

    Returns
    -------
    probability : ndarray
        Broadcast shape, from 0 to 1; 1 for a gap of 0 wherever the median critical gap is above 0.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Notes
    -----
    With ``D = ln(r2/r1)``, normal, the logarithm of the critical gap given D is ``ln r1 + ½ ln(1 +
    e^2D - 2 rho e^D)``, normal: ``P = ∫ φ(d) Φ((E[ln r1|d] + ψ(d) - ln g)/sqrt(Var[ln r1|D] + βm² +
    βg²)) dd``.

    Examples
    --------
    >>> print(pounding_probability(0.2, 0.1, 0.0, 0.05**0.5, 0.4, 0.4, 1.0).round(9))
    0.5
    """
    per_1, per_2 = checks.not_negative("per_1", per_1), checks.not_negative("per_2", per_2)
    correlation = checks.between("correlation", correlation, -1.0, 1.0)
    gap = checks.not_negative("gap", gap)
    beta_1 = checks.not_negative("dispersion_1", dispersion_1)
    beta_2 = checks.not_negative("dispersion_2", dispersion_2)
    shared = checks.between("dispersion_correlation", dispersion_correlation, -1.0, 1.0)
    rest = np.hypot(
        checks.not_negative("model_dispersion", model_dispersion),
        checks.not_negative("gap_dispersion", gap_dispersion),
    )
    broadcast = np.broadcast_arrays(per_1, per_2, correlation, gap, beta_1, beta_2, shared, rest)
    flat = [array.ravel() for array in broadcast]
    probability = _certain(*flat[:4])
    _replace_simple(probability, flat)
    uncertain = (flat[0] > 0) & (flat[1] > 0) & (flat[3] > 0) & (_ratio_dispersion(*flat[4:7]) > 0)
    if uncertain.any():
        probability[uncertain] = _integrals(*(array[uncertain] for array in flat))
    shaped: FloatArray = probability.reshape(broadcast[0].shape)
    return shaped


def _certain(
    per_1: FloatArray, per_2: FloatArray, correlation: FloatArray, gap: FloatArray
) -> FloatArray:
    """Return 1 where the median critical gap exceeds the gap."""
    return (critical_gap(per_1, per_2, correlation) > gap).astype(np.float64)


def _ratio_dispersion(beta_1: FloatArray, beta_2: FloatArray, shared: FloatArray) -> FloatArray:
    """Return the standard deviation of ln(r2/r1), without cancellation."""
    spread: FloatArray = np.hypot(beta_1 - beta_2, np.sqrt(2.0 * (1.0 - shared) * beta_1 * beta_2))
    return spread


def _replace_simple(probability: FloatArray, flat: list[FloatArray]) -> None:
    """Fill in the pairs whose ratio of radii is certain: then the critical gap is lognormal."""
    per_1, per_2, correlation, gap, beta_1, beta_2, shared, rest = flat
    alone = (per_1 == 0) | (per_2 == 0)
    beta = np.where(per_1 == 0, np.where(per_2 == 0, 0.0, beta_2), beta_1)
    spread = np.hypot(beta, rest)
    demand = critical_gap(per_1, per_2, correlation)
    simple = (
        (alone | (_ratio_dispersion(beta_1, beta_2, shared) == 0))
        & (spread > 0)
        & (demand > 0)
        & (gap > 0)
    )
    probability[simple] = ndtr(np.log(demand[simple] / gap[simple]) / spread[simple])


def _integrals(
    per_1: FloatArray,
    per_2: FloatArray,
    correlation: FloatArray,
    gap: FloatArray,
    beta_1: FloatArray,
    beta_2: FloatArray,
    shared: FloatArray,
    rest: FloatArray,
) -> FloatArray:
    """Return the integral of :func:`pounding_probability` for pairs whose ratio of radii is uncertain."""
    spread = _ratio_dispersion(beta_1, beta_2, shared)
    slope = beta_1 * (shared * beta_2 - beta_1) / spread**2
    left = beta_1 * beta_2 * np.sqrt((1.0 - shared) * (1.0 + shared)) / spread
    parameters = np.stack(
        [
            np.log(per_2 / per_1),
            spread,
            np.log(per_1 / gap),
            slope,
            np.hypot(left, rest),
            correlation,
        ]
    )
    out = np.empty(per_1.size)
    probabilities(parameters, out)
    return out


def demand_probability(demand: ArrayLike, gap: ArrayLike, dispersion: ArrayLike) -> FloatArray:
    """
    Probability that a lognormal demand exceeds the gap, for example the exact relative displacement of a record.

    Parameters
    ----------
    demand : array_like
        Median demand, m.
    gap : array_like
        Median gap, m.
    dispersion : array_like
        Standard deviation of the logarithm of demand over gap (all sources together),
        dimensionless.

    Returns
    -------
    probability : ndarray
        Broadcast shape, from 0 to 1; without dispersion 1 where the demand exceeds the gap, else 0.

    Raises
    ------
    ValueError
        If an argument is negative.

    Examples
    --------
    >>> print(demand_probability(0.1, [0.1, 0.0], 0.3))
    [0.5 1. ]
    """
    demand, gap = checks.not_negative("demand", demand), checks.not_negative("gap", gap)
    demand, gap, spread = np.broadcast_arrays(
        demand, gap, checks.not_negative("dispersion", dispersion)
    )
    known = (demand > 0) & (gap > 0) & (spread > 0)
    margin = np.log(np.where(known, demand, 1.0) / np.where(known, gap, 1.0)) / np.where(
        known, spread, 1.0
    )
    probability: FloatArray = np.where(known, ndtr(margin), demand > gap)
    return probability


def simulated_probability(
    per_1: float,
    per_2: float,
    correlation: float,
    gap: float,
    dispersion_1: float,
    dispersion_2: float,
    dispersion_correlation: float,
    model_dispersion: float = 0.0,
    gap_dispersion: float = 0.0,
    count: int = 1_000_000,
    seed: int = 0,
) -> float:
    """
    Monte Carlo estimate of :func:`pounding_probability`, for checks; its error is about ``0.5/sqrt(count)``.

    Parameters
    ----------
    per_1, per_2, correlation, gap, dispersion_1, dispersion_2 : float
        As in :func:`pounding_probability`.
    dispersion_correlation, model_dispersion, gap_dispersion : float
        As in :func:`pounding_probability`.
    count : int, optional
        Samples.
    seed : int, optional
        Of the random numbers.

    Returns
    -------
    probability : float
        From 0 to 1.

    Raises
    ------
    ValueError
        If a radius, the correlation or the gap is out of range.
    """
    normal = np.random.default_rng(seed).standard_normal((3, count))
    normal[1] = (
        dispersion_correlation * normal[0] + np.sqrt(1.0 - dispersion_correlation**2) * normal[1]
    )
    radii = per_1 * np.exp(dispersion_1 * normal[0]), per_2 * np.exp(dispersion_2 * normal[1])
    rest = np.exp(np.hypot(model_dispersion, gap_dispersion) * normal[2])
    return float(
        np.mean(
            critical_gap(*radii, correlation) * rest
            > checks.number("gap", gap, checks.not_negative)
        )
    )


def first_order_probability(
    per_1: ArrayLike,
    per_2: ArrayLike,
    correlation: ArrayLike,
    gap: ArrayLike,
    dispersion_1: ArrayLike,
    dispersion_2: ArrayLike,
    dispersion_correlation: ArrayLike,
    model_dispersion: ArrayLike = 0.0,
    gap_dispersion: ArrayLike = 0.0,
) -> FloatArray:
    """
    First-order estimate of :func:`pounding_probability` by the elasticities of the critical gap; it always warns.

    Parameters
    ----------
    per_1, per_2, correlation, gap, dispersion_1, dispersion_2 : array_like
        As in :func:`pounding_probability`.
    dispersion_correlation, model_dispersion, gap_dispersion : array_like
        As in :func:`pounding_probability`.

    Returns
    -------
    probability : ndarray
        Broadcast shape, from 0 to 1. Typically wrong by 0.03; for nearly equal radii and a
        correlation near 1 useless (0.49 in place of 0.88).

    Raises
    ------
    ValueError
        If an argument is out of range.

    Warns
    -----
    UserWarning
        Always: the exact integral costs microseconds.
    """
    warnings.warn("first-order probability fails for like radii and correlation near 1; use pounding_probability",
                  stacklevel=2)  # fmt: skip
    demand = critical_gap(per_1, per_2, correlation)
    square = np.where(demand > 0, demand, 1.0) ** 2
    r1, r2, rho = (np.asarray(value, dtype=np.float64) for value in (per_1, per_2, correlation))
    parts = (
        r1 * (r1 - rho * r2) / square * dispersion_1,
        r2 * (r2 - rho * r1) / square * dispersion_2,
    )
    variance = (
        parts[0] ** 2
        + parts[1] ** 2
        + 2.0 * np.asarray(dispersion_correlation) * parts[0] * parts[1]
    )
    rest = np.hypot(model_dispersion, gap_dispersion)
    return demand_probability(demand, gap, np.hypot(np.sqrt(np.maximum(variance, 0.0)), rest))
