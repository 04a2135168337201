"""
How likely a pair pounds, given what its record does and what is not known of its buildings.

A period that was derived from a height is resampled, and so is its damping: both buildings
independently, at quasi-random nodes, with radii from the station's stored spectra scaled to the
exact radius at the median period. So two buildings of equal height are never certain to move as
one. Where both periods are given the exact integral is used. An uncertain gap and the error of the
estimate widen the comparison.

Where the table tells the motion at the site relative to the record (``ln_per_ratio_i``,
``ln_per_std_i``), the radii are those at the site and as uncertain as their motion; an exact demand
is scaled with the pair's (``pair_motion.py``).
"""

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import qmc

from per_obspy.checks import FloatArray
from per_obspy.config import Screening
from per_obspy.kernels.pairs.resampling import resampled_probabilities
from per_obspy.pounding.dispersion import (
    combined_dispersion,
    combined_dispersion_correlation,
    lognormal_dispersion,
)
from per_obspy.pounding.probability import demand_probability, pounding_probability
from per_obspy.screening.by_record.stored_spectra import (
    azimuth_row,
    log_period_and_damping,
    log_place,
    log_spectra,
    stored_log,
)
from per_obspy.screening.uncertainty.pair_motion import pair_motion, period_correlation
from per_obspy.screening.values import Table, at_contact, both, chosen, values

#: Standard normal nodes for period and damping of both buildings: the second 128 Sobol points,
#: which lie in the middle of their strata. On a grid, or at the first 128, equal buildings would be
#: exactly equal, and in step, at some nodes.
NODES: FloatArray = ndtri(qmc.Sobol(4, scramble=False).fast_forward(128).random(128))

#: Of building 1 and building 2.
Both = tuple[FloatArray, FloatArray]


def pair_probability(station: xr.Dataset, table: Table, screening: Screening) -> FloatArray:
    """
    Return the probability of pounding of every pair of a block.

    Parameters
    ----------
    station : Dataset
        The record, with its stored spectra.
    table : Table
        Rows of the risk table with periods, dampings, their log-standard deviations, radii,
        correlations and demand; the motion at the site, where the table has it, of
        :func:`~per_obspy.screening.ground_motion.site_motion.motion_at_pairs`.
    screening : Screening
        Medians and log-standard deviations of the critical gap from PER, and of the linearized one,
        over the exact one.

    Returns
    -------
    probability : (n_pairs,) ndarray
        From 0 to 1. Where the exact demand decides it is that of the demand; only the motion at the
        site, gap and dampings are uncertain then.
    """
    exact = np.asarray(table["demand_rule"] == "exact")
    uncertain = np.maximum(*both(table, "period_log_std")) > 0
    probability = np.empty(exact.size)
    for rows, chance in (
        (exact, _of_demand),
        (~exact & ~uncertain, _of_radii),
        (~exact & uncertain, _resampled),
    ):
        if rows.any():
            probability[rows] = chance(station, chosen(table, rows), screening)
    return probability


def _of_demand(station: xr.Dataset, table: Table, screening: Screening) -> FloatArray:
    """Return the probability that the exact demand of an uncertain damping exceeds an uncertain gap; no model error."""
    del screening
    spread = np.maximum(
        _damping_dispersion(station, table, 1), _damping_dispersion(station, table, 2)
    )
    ratio, unknown = _pair_motion(table)
    dispersion = np.hypot(np.hypot(spread, gap_dispersion(table)), unknown)
    return demand_probability(
        values(table, "demand_exact") * np.exp(ratio), median_gap(table), dispersion
    )


def _of_radii(station: xr.Dataset, table: Table, screening: Screening) -> FloatArray:
    """Return the exact integral over both radii with the correlation that governs the demand."""
    correlation = np.where(
        table["demand_rule"] == "per_record", table["correlation_record"], table["correlation"]
    )
    correlation = np.where(_linearized(table), table["correlation_linearized"], correlation)
    radius_1, radius_2 = _median_radii(table, screening)
    (ratio_1, ratio_2), unknown = _site_motion(table)
    source_1, source_2 = (
        np.stack([doubt, _damping_dispersion(station, table, i)], axis=-1)
        for i, doubt in enumerate(unknown, start=1)
    )
    # one motion moves both radii, each has a damping of its own
    shared = np.stack(
        [period_correlation(*both(table, "period")), np.zeros_like(correlation)], axis=-1
    )
    return pounding_probability(
        radius_1 * np.exp(ratio_1),
        radius_2 * np.exp(ratio_2),
        correlation,
        median_gap(table),
        combined_dispersion(source_1),
        combined_dispersion(source_2),
        dispersion_correlation=combined_dispersion_correlation(source_1, source_2, shared),
        model_dispersion=_model_dispersion(table, screening),
        gap_dispersion=gap_dispersion(table),
    )


def _resampled(station: xr.Dataset, table: Table, screening: Screening) -> FloatArray:
    """Return the mean over quasi-random periods and dampings of both buildings."""
    columns: list[FloatArray] = [azimuth_row(station, table).astype(np.float64)]
    ratios, _ = _site_motion(table)
    _, unknown = _pair_motion(table)
    for i, radius in enumerate(_median_radii(table, screening), start=1):
        columns += [
            *log_period_and_damping(
                _deciding(table, f"period_{i}"), _deciding(table, f"damping_{i}")
            ),
            values(table, f"period_log_std_{i}"),
            values(table, f"damping_log_std_{i}"),
            np.log(np.maximum(radius, np.finfo(np.float64).tiny)) + ratios[i - 1],
        ]
    estimate = _model_dispersion(table, screening)
    columns += [median_gap(table), np.hypot(np.hypot(estimate, gap_dispersion(table)), unknown)]
    pairs = np.stack(columns, axis=1)
    probability = np.empty(len(pairs))
    resampled_probabilities(tuple(log_spectra(station)), pairs, NODES, probability)
    return probability


def _linearized(table: Table) -> NDArray[np.bool_]:
    """Return where the gap of equivalent linear buildings decides."""
    return np.asarray(table["demand_rule"] == "linearized")


def _deciding(table: Table, name: str) -> FloatArray:
    """Return a column, that of the equivalent building where this decides."""
    return np.where(_linearized(table), values(table, f"equivalent_{name}"), values(table, name))


def _median_radii(table: Table, screening: Screening) -> Both:
    """Return both radii at contact height, of which the critical gap is right in the median."""
    bias = np.where(_linearized(table), screening.linearized_median, screening.model_median)
    share_1, share_2 = both(table, "participation")
    return share_1 * _deciding(table, "per_1") / bias, share_2 * _deciding(table, "per_2") / bias


def _model_dispersion(table: Table, screening: Screening) -> FloatArray:
    """Return how far the estimate that decides may be from the exact demand."""
    return np.where(_linearized(table), screening.linearized_dispersion, screening.model_dispersion)


def _site_motion(table: Table) -> tuple[Both, Both]:
    """Return ln of the radii at the site over those of the record, and their deviations; 0 where nothing is told."""
    if "ln_per_ratio_1" not in table:
        nothing = np.zeros_like(values(table, "gap"))
        return (nothing, nothing), (nothing, nothing)
    ratio_1, ratio_2 = map(np.nan_to_num, both(table, "ln_per_ratio"))
    std_1, std_2 = map(np.nan_to_num, both(table, "ln_per_std"))
    return (ratio_1, ratio_2), (std_1, std_2)


def _pair_motion(table: Table) -> Both:
    """Return ln of the pair's demand at the site over that of the record, and its deviation."""
    return pair_motion(at_contact(table, "per"), *_site_motion(table), both(table, "period"))


def _damping_dispersion(station: xr.Dataset, table: Table, i: int) -> FloatArray:
    """Return the log-standard deviation of the radius that an uncertain damping causes."""
    spectra, (period, damping) = log_spectra(station), log_place(table, i)
    spread, row = values(table, f"damping_log_std_{i}"), azimuth_row(station, table)
    low, high = (stored_log(spectra, row, period, damping + way * spread) for way in (-1.0, 1.0))
    dispersion: FloatArray = np.abs(high - low) / 2.0
    return dispersion


def gap_dispersion(table: Table) -> FloatArray:
    """Return the log-standard deviation of a gap given by mean and standard deviation; 0 for touching pairs."""
    gap, deviation = values(table, "gap"), values(table, "gap_std")
    apart = gap > 0
    dispersion = np.zeros_like(gap)
    dispersion[apart] = lognormal_dispersion(gap[apart], deviation[apart])
    return dispersion


def median_gap(table: Table) -> FloatArray:
    """Return the median of a lognormal gap of given mean, m."""
    median: FloatArray = values(table, "gap") * np.exp(-(gap_dispersion(table) ** 2) / 2.0)
    return median
