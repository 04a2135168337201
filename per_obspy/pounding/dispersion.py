"""Dispersions of radii and gaps: how independent sources of uncertainty combine."""

import numpy as np
from numpy.typing import ArrayLike

from per_obspy import checks
from per_obspy.checks import FloatArray


def combined_dispersion(dispersions: ArrayLike) -> FloatArray:
    """
    Dispersion of a radius from independent sources: ground motion, own period (slope times dispersion), damping.

    Parameters
    ----------
    dispersions : (..., n_sources) array_like
        Standard deviation of ln r that each source alone causes, dimensionless.

    Returns
    -------
    dispersion : ndarray
        Root of the sum of squares over the last axis.

    Raises
    ------
    ValueError
        If a dispersion is negative.
    """
    total: FloatArray = np.sqrt(
        np.sum(checks.not_negative("dispersions", dispersions) ** 2, axis=-1)
    )
    return total


def combined_dispersion_correlation(
    dispersions_1: ArrayLike, dispersions_2: ArrayLike, correlations: ArrayLike
) -> FloatArray:
    """
    Correlation of the logarithms of two radii from independent sources.

    Parameters
    ----------
    dispersions_1, dispersions_2 : (..., n_sources) array_like
        Dispersion of each radius that each source alone causes, dimensionless.
    correlations : (..., n_sources) array_like
        Of each source between the two structures: shared ground motion near 1 (the correlation of
        spectral ordinates at two periods), own periods and dampings 0; dimensionless.

    Returns
    -------
    correlation : ndarray
        ``sum(rho_k b_1k b_2k)/(b_1 b_2)``, dimensionless; 0 where a radius is certain.

    Raises
    ------
    ValueError
        If a dispersion is negative or a correlation outside [-1, 1].
    """
    first = checks.not_negative("dispersions_1", dispersions_1)
    second = checks.not_negative("dispersions_2", dispersions_2)
    covariance = np.sum(
        checks.between("correlations", correlations, -1.0, 1.0) * first * second, axis=-1
    )
    product = combined_dispersion(first) * combined_dispersion(second)
    correlation: FloatArray = np.where(
        product > 0, covariance / np.where(product > 0, product, 1.0), 0.0
    )
    return np.minimum(np.maximum(correlation, -1.0), 1.0)


def lognormal_dispersion(mean: ArrayLike, standard_deviation: ArrayLike) -> FloatArray:
    """
    Dispersion of a lognormal length that is known by its mean and standard deviation.

    Parameters
    ----------
    mean : array_like
        For example a surveyed gap, m, positive.
    standard_deviation : array_like
        In m.

    Returns
    -------
    dispersion : ndarray
        ``sqrt(ln(1 + (s/mean)²))``, dimensionless; the median is ``mean exp(-dispersion²/2)``.

    Raises
    ------
    ValueError
        If the mean is not positive or the standard deviation negative.
    """
    ratio = checks.not_negative("standard_deviation", standard_deviation) / checks.positive(
        "mean", mean
    )
    dispersion: FloatArray = np.sqrt(np.log1p(ratio**2))
    return dispersion


def period_dispersion(
    periods: ArrayLike, per: ArrayLike, period: ArrayLike, dispersion: ArrayLike
) -> FloatArray:
    """
    Dispersion of a radius from an uncertain period: the slope of the spectrum over plus and minus one dispersion.

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
        ``|ln r(T e^b) - ln r(T e^-b)|/2``, dimensionless.

    Raises
    ------
    ValueError
        If an argument is not positive or the spectrum does not cover the periods.
    """
    grid, radii = np.log(checks.positive("periods", periods)), np.log(checks.positive("per", per))
    middle, spread = (
        np.log(checks.positive("period", period)),
        checks.not_negative("dispersion", dispersion),
    )
    if np.any(middle - spread < grid[0]) or np.any(middle + spread > grid[-1]):
        raise ValueError(
            f"periods from {np.exp(grid[0]):.3g} to {np.exp(grid[-1]):.3g} s do not cover the uncertain one"
        )
    change = np.interp(middle + spread, grid, radii) - np.interp(middle - spread, grid, radii)
    caused: FloatArray = np.abs(change) / 2.0
    return caused
