"""Probability of pounding by lognormal radii, and how the dispersions of radii and gaps combine."""

from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.kernels.pairs.probability import probabilities
from per_obspy.pounding.critical_gap import critical_gap


def combined_dispersion(dispersions: ArrayLike) -> FloatArray:
    """
    Combine the dispersions of a radius from independent sources.

    Sources are the ground motion, the period (slope of the spectrum times its dispersion) and the
    damping.

    Parameters
    ----------
    dispersions : (..., n_sources) array_like
        Standard deviation of ln r that each source alone causes, dimensionless.

    Returns
    -------
    dispersion : (...) ndarray
        Root of the sum of squares over the last axis, dimensionless.

    Raises
    ------
    ValueError
        If a dispersion is negative.

    References
    ----------
    Benjamin & Cornell (1970), Probability, statistics, and decision for civil engineers.

    Examples
    --------
    >>> print(combined_dispersion([0.3, 0.4]).round(6))
    0.5
    """
    squares = checks.not_negative("dispersions", dispersions) ** 2
    total: FloatArray = np.sqrt(np.sum(squares, axis=-1))
    return total


def combined_dispersion_correlation(
    dispersions_1: ArrayLike, dispersions_2: ArrayLike, correlations: ArrayLike
) -> FloatArray:
    """
    Compute the correlation of the logarithms of two radii from independent sources.

    Parameters
    ----------
    dispersions_1, dispersions_2 : (..., n_sources) array_like
        Dispersion of each radius that each source alone causes, dimensionless.
    correlations : (..., n_sources) array_like
        Of each source between the two structures: shared ground motion near 1 (the correlation of
        spectral ordinates at two periods), periods and dampings of the buildings 0; dimensionless.

    Returns
    -------
    correlation : (...) ndarray
        ``sum(rho_k b_1k b_2k)/(b_1 b_2)``, dimensionless; 0 where a radius is certain.

    Raises
    ------
    ValueError
        If a dispersion is negative or a correlation outside [-1, 1].

    See Also
    --------
    per_obspy.pounding_probability : Takes it as ``dispersion_correlation``.

    References
    ----------
    Baker & Jayaram (2008), Correlation of spectral acceleration values from NGA ground motion
    models, Earthquake Spectra 24(1), for the correlation of the ground motion at two periods.

    Examples
    --------
    Shared ground motion, dispersions 0.3 and 0.4, and an uncertain period of each structure:

    >>> rho = combined_dispersion_correlation([0.3, 0.4], [0.4, 0.3], [0.9, 0.0])
    >>> print(rho.round(6))
    0.432
    """
    first = checks.not_negative("dispersions_1", dispersions_1)
    second = checks.not_negative("dispersions_2", dispersions_2)
    shared = checks.between("correlations", correlations, -1.0, 1.0)
    covariance = np.sum(shared * first * second, axis=-1)

    # sum(rho_k b_1k b_2k)/(b_1 b_2), 0 where a radius is certain
    product = combined_dispersion(first) * combined_dispersion(second)
    ratio = covariance / np.where(product > 0, product, 1.0)
    correlation: FloatArray = np.where(product > 0, ratio, 0.0)
    return np.minimum(np.maximum(correlation, -1.0), 1.0)


def lognormal_dispersion(mean: ArrayLike, standard_deviation: ArrayLike) -> FloatArray:
    """
    Compute the dispersion of a lognormal length from its mean and standard deviation.

    Parameters
    ----------
    mean : array_like
        Mean length, for example of a surveyed gap, m, positive.
    standard_deviation : array_like
        Standard deviation of the length, m.

    Returns
    -------
    dispersion : ndarray
        Broadcast shape, ``sqrt(ln(1 + (s/mean)²))``, dimensionless; the median is
        ``mean exp(-dispersion²/2)``.

    Raises
    ------
    ValueError
        If the mean is not positive or the standard deviation negative.

    References
    ----------
    Benjamin & Cornell (1970), Probability, statistics, and decision for civil engineers.

    Examples
    --------
    A gap of 10 cm with a standard deviation of 5 cm:

    >>> print(lognormal_dispersion(0.1, 0.05).round(4))
    0.4724
    """
    deviation = checks.not_negative("standard_deviation", standard_deviation)
    ratio = deviation / checks.positive("mean", mean)
    dispersion: FloatArray = np.sqrt(np.log1p(ratio**2))
    return dispersion


def period_dispersion(
    periods: ArrayLike, per: ArrayLike, period: ArrayLike, dispersion: ArrayLike
) -> FloatArray:
    """
    Compute the dispersion of a radius that an uncertain period causes.

    It is half the change of the logarithm of the spectrum from one dispersion below the period to
    one above.

    Parameters
    ----------
    periods, per : (n_periods,) array_like
        A spectrum: increasing periods, s, and radii, m.
    period : array_like
        Median period, s.
    dispersion : array_like
        Standard deviation of the logarithm of the period, dimensionless.

    Returns
    -------
    dispersion : ndarray
        Broadcast shape, ``|ln r(T e^b) - ln r(T e^-b)|/2``, dimensionless.

    Raises
    ------
    ValueError
        If an argument is not positive, the dispersion is negative, or the spectrum does not cover
        the periods.

    See Also
    --------
    per_obspy.combined_dispersion : Combination with other sources.

    Notes
    -----
    The slope over a span, not that of a point: between two peaks of a spectrum the slope at a point
    can be zero, although a change of the period changes the radius.

    References
    ----------
    Benjamin & Cornell (1970), Probability, statistics, and decision for civil engineers, for first
    order propagation.

    Examples
    --------
    A radius in proportion to the period is as uncertain as the period:

    >>> print(period_dispersion([0.1, 1.0, 10.0], [0.02, 0.2, 2.0], 0.5, 0.3).round(6))
    0.3
    """
    grid = np.log(checks.positive("periods", periods))
    radii = np.log(checks.positive("per", per))
    median = np.log(checks.positive("period", period))
    spread = checks.not_negative("dispersion", dispersion)
    shorter, longer = median - spread, median + spread
    if np.any(shorter < grid[0]) or np.any(longer > grid[-1]):
        raise ValueError(
            f"periods from {np.exp(grid[0]):.3g} to {np.exp(grid[-1]):.3g} s "
            "do not cover the uncertain one"
        )

    # Slope of the spectrum between both periods, on logarithmic axes
    change = np.interp(longer, grid, radii) - np.interp(shorter, grid, radii)
    caused: FloatArray = np.abs(change) / 2.0
    return caused


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
    Compute the probability that the critical gap of equation (15) exceeds the gap.

    Exact for lognormal radii, gap and model error.

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
        :mod:`per_obspy.pounding.probability`.
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
    # Medians, dispersions of the radii, and the dispersion of all else
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
    probability = _probabilities(_Pairs(*(array.ravel() for array in broadcast)))
    shaped: FloatArray = probability.reshape(broadcast[0].shape)
    return shaped


class _Pairs(NamedTuple):
    """
    Median radii and gap (m), correlation and dispersions of pairs, (n_pairs,) each.

    ``beta_1`` and ``beta_2`` are the dispersions of the radii, ``shared`` their correlation, and
    ``rest`` the dispersion of model and gap.
    """

    per_1: FloatArray
    per_2: FloatArray
    correlation: FloatArray
    gap: FloatArray
    beta_1: FloatArray
    beta_2: FloatArray
    shared: FloatArray
    rest: FloatArray

    def ratio_dispersion(self) -> FloatArray:
        """Return the standard deviation of ln(r2/r1), without cancellation."""
        independent = np.sqrt(2.0 * (1.0 - self.shared) * self.beta_1 * self.beta_2)
        spread: FloatArray = np.hypot(self.beta_1 - self.beta_2, independent)
        return spread


def _probabilities(pairs: _Pairs) -> FloatArray:
    """Return the probability of each pair, by the integral only where it is needed."""
    # Without uncertainty pounding is certain or impossible
    demand = critical_gap(pairs.per_1, pairs.per_2, pairs.correlation)
    probability = (demand > pairs.gap).astype(np.float64)
    _replace_lognormal(probability, pairs, demand)

    # Uncertain ratio of the radii: the integral of the notes
    moving = (pairs.per_1 > 0) & (pairs.per_2 > 0)
    uncertain = moving & (pairs.gap > 0) & (pairs.ratio_dispersion() > 0)
    if uncertain.any():
        probability[uncertain] = _integrals(_Pairs(*(values[uncertain] for values in pairs)))
    return probability


def _replace_lognormal(probability: FloatArray, pairs: _Pairs, demand: FloatArray) -> None:
    """Fill in the pairs whose ratio of radii is certain: then the critical gap is lognormal."""
    alone = (pairs.per_1 == 0) | (pairs.per_2 == 0)
    beta_alone = np.where(pairs.per_2 == 0, 0.0, pairs.beta_2)
    beta = np.where(pairs.per_1 == 0, beta_alone, pairs.beta_1)
    spread = np.hypot(beta, pairs.rest)

    # Φ(ln(demand/gap)/spread), where all three are known
    certain_ratio = alone | (pairs.ratio_dispersion() == 0)
    lognormal = certain_ratio & (spread > 0) & (demand > 0) & (pairs.gap > 0)
    margin = np.log(demand[lognormal] / pairs.gap[lognormal])
    probability[lognormal] = ndtr(margin / spread[lognormal])


def _integrals(pairs: _Pairs) -> FloatArray:
    """Return the integral of :func:`pounding_probability` for uncertain ratios of the radii."""
    spread = pairs.ratio_dispersion()
    beta_1, beta_2, shared = pairs.beta_1, pairs.beta_2, pairs.shared

    # Mean of ln r1 given D falls or rises with this slope; its deviation given D
    slope = beta_1 * (shared * beta_2 - beta_1) / spread**2
    left = beta_1 * beta_2 * np.sqrt((1.0 - shared) * (1.0 + shared)) / spread
    median_ratio = np.log(pairs.per_2 / pairs.per_1)
    margin = np.log(pairs.per_1 / pairs.gap)
    deviation = np.hypot(left, pairs.rest)
    parameters = np.stack([median_ratio, spread, margin, slope, deviation, pairs.correlation])
    out = np.empty(pairs.per_1.size)
    probabilities(parameters, out)
    return out


def demand_probability(demand: ArrayLike, gap: ArrayLike, dispersion: ArrayLike) -> FloatArray:
    """
    Compute the probability that a lognormal demand exceeds the gap.

    The demand is for example the exact relative displacement of a record.

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
    spread = checks.not_negative("dispersion", dispersion)
    demand, gap, spread = np.broadcast_arrays(demand, gap, spread)

    # Φ(ln(demand/gap)/dispersion), where all three are above 0
    known = (demand > 0) & (gap > 0) & (spread > 0)
    ratio = np.where(known, demand, 1.0) / np.where(known, gap, 1.0)
    margin = np.log(ratio) / np.where(known, spread, 1.0)
    probability: FloatArray = np.where(known, ndtr(margin), demand > gap)
    return probability
