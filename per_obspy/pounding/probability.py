"""Probability of pounding by lognormal radii, and how the dispersions of radii and gaps combine."""

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
    ratio = np.where(product > 0, covariance, 0.0) / np.where(product > 0, product, 1.0)
    return np.clip(ratio, -1.0, 1.0)


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
    # All that is known of each pair, and the dispersion of model and gap together
    values = (
        checks.not_negative("per_1", per_1),
        checks.not_negative("per_2", per_2),
        checks.between("correlation", correlation, -1.0, 1.0),
        checks.not_negative("gap", gap),
        checks.not_negative("dispersion_1", dispersion_1),
        checks.not_negative("dispersion_2", dispersion_2),
        checks.between("dispersion_correlation", dispersion_correlation, -1.0, 1.0),
        np.hypot(
            checks.not_negative("model_dispersion", model_dispersion),
            checks.not_negative("gap_dispersion", gap_dispersion),
        ),
    )
    broadcast = np.broadcast_arrays(*values)
    flat = (array.ravel() for array in broadcast)
    return _probabilities(*flat).reshape(broadcast[0].shape)


def _probabilities(
    per_1: FloatArray,
    per_2: FloatArray,
    correlation: FloatArray,
    gap: FloatArray,
    beta_1: FloatArray,
    beta_2: FloatArray,
    shared: FloatArray,
    rest: FloatArray,
) -> FloatArray:
    """Return the probability of each pair; ``rest`` is the dispersion of model and gap."""
    # Dispersion of ln(r2/r1), without cancellation; of one radius alone there is no ratio
    spread = np.hypot(beta_1 - beta_2, np.sqrt(2.0 * (1.0 - shared) * beta_1 * beta_2))
    spread = np.where((per_1 > 0) & (per_2 > 0), spread, 0.0)

    # A certain ratio of the radii: the critical gap is lognormal, or certain as well
    demand = critical_gap(per_1, per_2, correlation)
    beta = np.hypot(np.where(per_1 > 0, beta_1, np.where(per_2 > 0, beta_2, 0.0)), rest)
    probability = (demand > gap).astype(np.float64)
    some = np.flatnonzero((beta > 0) & (demand > 0) & (gap > 0))
    probability[some] = ndtr(np.log(demand[some] / gap[some]) / beta[some])

    # An uncertain ratio: the integral of the notes
    some = np.flatnonzero((spread > 0) & (gap > 0))
    if some.size:
        numbers = per_1, per_2, correlation, gap, beta_1, beta_2, shared, rest, spread
        probability[some] = _integrals(*(values[some] for values in numbers))
    return probability


def _integrals(
    per_1: FloatArray,
    per_2: FloatArray,
    correlation: FloatArray,
    gap: FloatArray,
    beta_1: FloatArray,
    beta_2: FloatArray,
    shared: FloatArray,
    rest: FloatArray,
    spread: FloatArray,
) -> FloatArray:
    """Return the integral of :func:`pounding_probability` for uncertain ratios of the radii."""
    # Mean of ln r1 given D falls or rises with this slope; its deviation given D
    slope = beta_1 * (shared * beta_2 - beta_1) / spread**2
    left = beta_1 * beta_2 * np.sqrt((1.0 - shared) * (1.0 + shared)) / spread
    margin, deviation = np.log(per_1 / gap), np.hypot(left, rest)
    terms = np.log(per_2 / per_1), spread, margin, slope, deviation, correlation
    out = np.empty(gap.size)
    probabilities(np.stack(terms), out)
    return out
