"""Dispersions of radii and gaps: how independent sources of uncertainty combine."""

import numpy as np

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray


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
