"""Reliability of critical gap and single hit: estimates against exact histories of a record."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from per_obspy import checks
from per_obspy.checks import ArrayLike, FloatArray
from per_obspy.pounding.correlation import ddc_correlation, record_correlation
from per_obspy.pounding.critical_gap import absolute_gap, critical_gap, srss_gap
from per_obspy.pounding.pair_histories import pounding_histories
from per_obspy.pounding.relative import relative_displacement
from per_obspy.pounding.single_hit import single_hit
from per_obspy.spectra.elastic import response_spectra


class GapComparison(NamedTuple):
    """
    Critical gaps of each pair for either order of the structures, each (n_pairs,), m.

    ``exact`` is the largest ``|u1 - u2|`` of the record. The estimates combine peak displacements
    (``sd``) or radii (``per``) with the correlation (16) (``ddc``) or that of the record
    (``record``); ``larger_per`` is the larger of the two estimates with radii.
    """

    exact: FloatArray
    ddc_sd: FloatArray
    ddc_per: FloatArray
    record_per: FloatArray
    srss_sd: FloatArray
    absolute_sd: FloatArray
    larger_per: FloatArray


class SingleHitComparison(NamedTuple):
    """
    Single hit and exact history of each pair at the same gap.

    ``status`` (n_pairs,) is that of the single hit; ``per`` are the radii without pounding,
    ``predicted`` and ``actual`` the largest radii with pounding, (2, n_pairs), m, predicted NaN
    unless the status is ``ok``; ``impacts`` (n_pairs,) counts those of the history as
    `PoundingMaxima` does.
    """

    status: NDArray[np.str_]
    per: FloatArray
    predicted: FloatArray
    actual: FloatArray
    impacts: NDArray[np.int64]


class EstimateError(NamedTuple):
    """
    Critical gap by eq. (15) and (16) over the exact one of 1 towards 2, of the shape of the pairs.

    ``median`` is dimensionless; ``log_std`` is the standard deviation of the logarithm.
    """

    median: FloatArray
    log_std: FloatArray


class Summary(NamedTuple):
    """
    Predicted over actual.

    Median, standard deviation of the logarithm, shares below each limit, and number of cases.
    """

    median: float
    log_std: float
    below: tuple[float, ...]
    cases: int


def compare_gaps(
    acceleration: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    period_2: ArrayLike,
    damping: float,
) -> GapComparison:
    """
    Compare estimates of the critical gap with the exact one.

    Parameters
    ----------
    acceleration : (n_samples,) array_like
        Ground acceleration, m/s².
    dt : float
        Sampling interval, s.
    period_1, period_2 : (n_pairs,) array_like
        Undamped periods, s.
    damping : float
        Of every structure, fraction of critical, dimensionless.

    Returns
    -------
    GapComparison
        One value per pair.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Examples
    --------
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> gaps = compare_gaps(pulse, 0.01, [0.5], [1.5], 0.05)
    >>> bool(gaps.exact[0] < gaps.absolute_sd[0])
    True
    """
    period_1, period_2 = _pairs(period_1, period_2)
    (per_1, per_2), (sd_1, sd_2) = _spectra(acceleration, dt, period_1, period_2, damping)
    pairs = period_1, damping, period_2, damping

    # Correlation by equation (16), and that of the record
    white, own = ddc_correlation(*pairs), record_correlation(acceleration, dt, *pairs)
    ddc_per, record_per = critical_gap(per_1, per_2, white), critical_gap(per_1, per_2, own)
    return GapComparison(
        exact=relative_displacement(acceleration, dt, *pairs).largest,
        ddc_sd=critical_gap(sd_1, sd_2, white),
        ddc_per=ddc_per,
        record_per=record_per,
        srss_sd=srss_gap(sd_1, sd_2),
        absolute_sd=absolute_gap(sd_1, sd_2),
        larger_per=np.maximum(ddc_per, record_per),
    )


def compare_single_hit(
    acceleration: ArrayLike,
    dt: float,
    period_1: ArrayLike,
    period_2: ArrayLike,
    gap_ratio: ArrayLike,
    mass_ratio: ArrayLike,
    restitution: float,
    damping: float,
) -> SingleHitComparison:
    """
    Compare the single hit at the exact one-sided critical gap with the exact pounding history.

    Parameters
    ----------
    acceleration : (n_samples,) array_like
        Ground acceleration, positive from structure 1 to 2, m/s².
    dt : float
        Sampling interval, s.
    period_1, period_2 : (n_pairs,) array_like
        Undamped periods, s.
    gap_ratio : (n_pairs,) or float array_like
        Gap over the critical gap of the record, dimensionless.
    mass_ratio : (n_pairs,) or float array_like
        Mass of structure 2 over that of structure 1, dimensionless.
    restitution, damping : float
        Of every impact and of every structure, dimensionless.

    Returns
    -------
    SingleHitComparison
        One value per pair.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Examples
    --------
    >>> pulse = np.sin(np.linspace(0.0, 6.0 * np.pi, 301))
    >>> compared = compare_single_hit(pulse, 0.01, [0.5], [1.5], 0.9, 1.0, 0.65, 0.05)
    >>> bool(compared.impacts[0] > 0)
    True
    """
    period_1, period_2 = _pairs(period_1, period_2)
    (per_1, per_2), _ = _spectra(acceleration, dt, period_1, period_2, damping)
    first, second = (period_1, damping), (period_2, damping)
    critical = relative_displacement(acceleration, dt, *first, *second).one_before_two
    gap = critical * checks.not_negative("gap_ratio", gap_ratio)

    # Estimate and history of the same impact: unit mass of structure 1
    hit = single_hit(per_1, per_2, period_1, period_2, 1.0, mass_ratio, restitution, critical, gap)
    exact = pounding_histories(acceleration, dt, *first, 1.0, *second, mass_ratio, gap, restitution)
    return SingleHitComparison(
        status=hit.status,
        per=np.stack([per_1, per_2]),
        predicted=np.stack([per_1 * hit.amplification_1, per_2 * hit.amplification_2]),
        actual=exact.per,
        impacts=exact.impacts,
    )


#: Geometric means of both dampings to which the errors of estimates are fitted; others count as the
#: nearer of them.
FITTED_DAMPING = 0.02, 0.10


def per_error(
    period_1: ArrayLike, damping_1: ArrayLike, period_2: ArrayLike, damping_2: ArrayLike
) -> EstimateError:
    """
    Return the error of the critical gap by PER, eq. (15) and (16).

    It is too large by what forced motion adds to a radius, the more the larger the damping; and of
    nearly equal periods by the time that a record lacks to bring both out of step.

    Parameters
    ----------
    period_1, period_2 : array_like
        Undamped periods, s.
    damping_1, damping_2 : array_like
        Fractions of critical, dimensionless.

    Returns
    -------
    EstimateError
        Of a pair of these structures in a record that is not known.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Notes
    -----
    Fitted to real records of ten earthquakes by ``workflows/estimate_errors.py``, which writes the
    accuracy in other earthquakes than those of the fit into docs/reliability.md. Of unlike dampings
    and periods within 2 % the median is 15 % too high.

    Examples
    --------
    >>> print(per_error(1.0, 0.05, [1.02, 1.4, 3.0], 0.05).median.round(2))
    [1.46 1.23 1.17]
    """
    correlation, damping = _likeness(period_1, damping_1, period_2, damping_2)
    by_damping = damping**0.62
    ln_median = 0.135 * by_damping + 0.25 * np.sqrt(correlation) / by_damping
    return EstimateError(np.exp(ln_median), 0.22 + 0.20 * correlation**0.25)


def sd_error(
    period_1: ArrayLike, damping_1: ArrayLike, period_2: ArrayLike, damping_2: ArrayLike
) -> EstimateError:
    """
    Return the error of the critical gap by SD, eq. (15) and (16), as `per_error` does.

    Examples
    --------
    >>> print(sd_error(1.0, 0.05, [1.02, 1.4, 3.0], 0.05).median.round(2))
    [1.36 1.09 1.03]
    """
    correlation, damping = _likeness(period_1, damping_1, period_2, damping_2)
    ln_median = 0.31 * np.sqrt(correlation) / damping**0.30
    return EstimateError(np.exp(ln_median), 0.05 + 0.31 * correlation**0.25)


def _likeness(
    period_1: ArrayLike, damping_1: ArrayLike, period_2: ArrayLike, damping_2: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Return the correlation by eq. (16), and the mean of both dampings over 0.05."""
    correlation = ddc_correlation(period_1, damping_1, period_2, damping_2)
    damping = np.sqrt(np.multiply(damping_1, damping_2)).clip(*FITTED_DAMPING)
    return np.asarray(correlation), damping / 0.05


def _pairs(period_1: ArrayLike, period_2: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return checked periods of both structures of each pair."""
    first, second = checks.positive("period_1", period_1), checks.positive("period_2", period_2)
    if first.ndim != 1 or first.shape != second.shape:
        raise ValueError(
            "period_1 and period_2 must be one row each, "
            f"got shapes {first.shape} and {second.shape}"
        )
    return first, second


def _spectra(
    acceleration: ArrayLike, dt: float, period_1: FloatArray, period_2: FloatArray, damping: float
) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """Return radii, then peak displacements, of both structures, each (n_pairs,), m."""
    periods, index = np.unique(np.stack([period_1, period_2]), return_inverse=True)
    spectra = response_spectra(acceleration, dt, periods, damping)
    first, second = index.reshape(2, -1)
    return (spectra.per[first], spectra.per[second]), (spectra.sd[first], spectra.sd[second])


def amplifications(compared: SingleHitComparison) -> tuple[FloatArray, FloatArray]:
    """
    Return the predicted and actual amplification of the structure that is amplified most.

    Radius with pounding over radius without, of each pair with a single hit, (n_ok,) each.
    """
    known = compared.status == "ok"
    per = compared.per[:, known]
    predicted = (compared.predicted[:, known] / per).max(axis=0)
    actual = (compared.actual[:, known] / per).max(axis=0)
    return predicted, actual


def summary(ratio: ArrayLike, limits: tuple[float, ...]) -> Summary:
    """
    Compute bias and scatter of predicted over actual.

    Parameters
    ----------
    ratio : (n_cases,) array_like
        Predicted over actual, above 0, dimensionless.
    limits : tuple of float
        Below which a case counts as under-predicted, dimensionless.

    Returns
    -------
    Summary
        Dimensionless.

    Raises
    ------
    ValueError
        If a ratio is not positive, or there is none.

    Examples
    --------
    >>> summary([0.5, 1.0, 2.0], (0.99,)).below
    (0.3333333333333333,)
    """
    ratio = checks.positive("ratio", ratio)
    if ratio.size == 0:
        raise ValueError("ratio must hold at least one case")
    below = tuple(float(np.mean(ratio < limit)) for limit in limits)
    return Summary(float(np.median(ratio)), float(np.std(np.log(ratio))), below, ratio.size)
