"""
How likely a pair pounds, given what its record does and what is not known of its buildings.

A period that was derived from a height is resampled, and so is its damping: both buildings independently, at
quasi-random nodes, with radii from the station's stored spectra scaled to the exact radius at the median period. So
two buildings of equal height are never certain to move as one. Where both periods are given the exact integral is
used. An uncertain gap and the error of the estimate widen the comparison.
"""

import numpy as np
import pandas as pd
import xarray as xr
from scipy.special import ndtri
from scipy.stats import qmc

from per_obspy.checks import FloatArray
from per_obspy.kernels.resampling import resampled_probabilities
from per_obspy.pounding.dispersion import lognormal_dispersion
from per_obspy.pounding.probability import demand_probability, pounding_probability
from per_obspy.screening.stored import azimuth_row, log_place, log_spectra, stored_log
from per_obspy.screening.values import at_contact, values

#: Standard normal nodes for period and damping of both buildings: 128 Sobol points, moved to the middle of their
#: strata. No grid: on one, equal buildings would be exactly equal, and in step, at many nodes.
NODES: FloatArray = ndtri(qmc.Sobol(4, scramble=False).random(128) + 0.5 / 128)


def pair_probability(station: xr.Dataset, table: pd.DataFrame, model_dispersion: float) -> FloatArray:
    """
    Return the probability of pounding of every pair of a block.

    Parameters
    ----------
    station : Dataset
        The record, with its stored spectra.
    table : DataFrame
        Rows of the risk table with periods, dampings, their log-standard deviations, radii, correlations and demand.
    model_dispersion : float
        Log-standard deviation of the critical gap from PER about the exact one.

    Returns
    -------
    probability : (n_pairs,) ndarray
        From 0 to 1. Where the exact demand decides it is that of the demand; only gap and dampings are uncertain then.
    """
    exact = (table["demand_rule"] == "exact").to_numpy()
    uncertain = (table[["period_log_std_1", "period_log_std_2"]] > 0).any(axis=1).to_numpy()
    probability = np.empty(len(table))
    for rows, chance in ((exact, _of_demand), (~exact & ~uncertain, _of_radii), (~exact & uncertain, _resampled)):
        if rows.any():
            probability[rows] = chance(station, table[rows], model_dispersion)
    return probability


def _of_demand(station: xr.Dataset, table: pd.DataFrame, model_dispersion: float) -> FloatArray:
    """Return the probability that the exact demand of an uncertain damping exceeds an uncertain gap; no model error."""
    del model_dispersion
    spread = np.maximum(_damping_dispersion(station, table, 1), _damping_dispersion(station, table, 2))
    return demand_probability(table["demand_exact"], _median_gap(table), np.hypot(spread, _gap_dispersion(table)))


def _of_radii(station: xr.Dataset, table: pd.DataFrame, model_dispersion: float) -> FloatArray:
    """Return the exact integral over both radii with the correlation that governs the demand."""
    correlation = np.where(table["demand_rule"] == "per_record", table["correlation_record"], table["correlation"])
    return pounding_probability(
        *at_contact(table, "per"),
        correlation,
        _median_gap(table),
        _damping_dispersion(station, table, 1),
        _damping_dispersion(station, table, 2),
        dispersion_correlation=0.0,
        model_dispersion=model_dispersion,
        gap_dispersion=_gap_dispersion(table),
    )


def _resampled(station: xr.Dataset, table: pd.DataFrame, model_dispersion: float) -> FloatArray:
    """Return the mean over quasi-random periods and dampings of both buildings."""
    columns: list[FloatArray] = [azimuth_row(station, table).astype(np.float64)]
    for i, radius in enumerate(at_contact(table, "per"), start=1):
        columns += [
            *log_place(table, i),
            values(table, f"period_log_std_{i}"),
            values(table, f"damping_log_std_{i}"),
            np.log(np.maximum(radius, np.finfo(np.float64).tiny)),
        ]
    columns += [_median_gap(table), np.hypot(model_dispersion, _gap_dispersion(table))]
    probability = np.empty(len(table))
    resampled_probabilities(tuple(log_spectra(station)), np.stack(columns, axis=1), NODES, probability)
    return probability


def _damping_dispersion(station: xr.Dataset, table: pd.DataFrame, i: int) -> FloatArray:
    """Return the log-standard deviation of the radius that an uncertain damping causes."""
    spectra, (period, damping) = log_spectra(station), log_place(table, i)
    spread, row = values(table, f"damping_log_std_{i}"), azimuth_row(station, table)
    low, high = (stored_log(spectra, row, period, damping + way * spread) for way in (-1.0, 1.0))
    dispersion: FloatArray = np.abs(high - low) / 2.0
    return dispersion


def _gap_dispersion(table: pd.DataFrame) -> FloatArray:
    """Return the log-standard deviation of a gap given by mean and standard deviation; 0 for touching pairs."""
    gap, deviation = values(table, "gap"), values(table, "gap_std")
    apart = gap > 0
    dispersion = np.zeros_like(gap)
    dispersion[apart] = lognormal_dispersion(gap[apart], deviation[apart])
    return dispersion


def _median_gap(table: pd.DataFrame) -> FloatArray:
    """Return the median of a lognormal gap of given mean, m."""
    median: FloatArray = values(table, "gap") * np.exp(-(_gap_dispersion(table) ** 2) / 2.0)
    return median
