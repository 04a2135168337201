"""
Uncertain motion of pairs at one station, from its record and its stored spectra.

Where the table holds the motion at the site relative to the record (``ln_per_ratio_i``,
``ln_per_std_i``), the radii are those at the site and as uncertain as their motion; an exact demand
is carried to the site by ``site_demand.py``.
"""

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.config import Screening
from per_obspy.screening.by_record.station_motion import StationMotion, nearest_azimuth
from per_obspy.screening.by_record.stored_spectra import log_oscillator, stored_log
from per_obspy.screening.uncertainty.probability import (
    UncertainMotion,
    UncertainRadius,
    period_is_uncertain,
)
from per_obspy.screening.uncertainty.site_demand import (
    estimate_log_std,
    median_at_site,
    motion_at_site,
    site_demand,
)
from per_obspy.screening.values import Table, values


def record_motion(station: StationMotion, table: Table, screening: Screening) -> UncertainMotion:
    """
    Return the uncertain motion of every pair of a block.

    Parameters
    ----------
    station : StationMotion
        The record, with its stored spectra.
    table : Table
        Rows of the risk table with periods, dampings, their log-standard deviations, radii,
        correlations and demand; ``distance`` and the motion at the site, where the table has it,
        of :func:`~per_obspy.screening.ground_motion.site_motion.motion_at_pairs`.
    screening : Screening
        Medians and log-standard deviations of the critical gap from PER, and of the linearized one,
        over the exact one.

    Returns
    -------
    UncertainMotion
        Its rows are those of the stored PER of the station. The exact demand is that of certain
        buildings; :mod:`.exact_demand` samples it where they are uncertain.
    """
    first, second = (_radius(station, table, i, screening) for i in (1, 2))
    # the exact demand at the site, and the error of an estimate there
    site, exact = site_demand(station, table, screening), is_exact(table)
    demand = np.where(exact, values(table, "demand_exact"), 0.0)
    at_site = median_at_site(demand, site.weight, site.ln_ratio, site.ln_field)
    deviations = screening.linearized_dispersion, screening.model_dispersion
    model_log_std = np.where(_linearized(table), *deviations)
    return UncertainMotion(
        first,
        second,
        correlation=_governing_correlation(table),
        pair_log_std=np.where(exact, site.log_std, site.field_log_std),
        model_log_std=estimate_log_std(table, model_log_std, screening.interpolation),
        exact_demand=np.where(exact, at_site, np.nan),
        row=nearest_azimuth(station, table),
    )


def demand_at_site(station: StationMotion, table: Table, screening: Screening) -> FloatArray:
    """
    Return the governing demand of pairs at their sites, m: what their probability rests on.

    Parameters
    ----------
    station : StationMotion
        The record.
    table : Table
        As of :func:`record_motion`.
    screening : Screening
        As of :func:`record_motion`.
    """
    site, demand = site_demand(station, table, screening), values(table, "demand")
    exact = median_at_site(demand, site.weight, site.ln_ratio, site.ln_field)
    return np.where(is_exact(table), exact, demand * np.exp(site.ln_ratio))


def is_exact(table: Table) -> NDArray[np.bool_]:
    """Return where the exact demand decides."""
    return np.asarray(table["demand_rule"] == "exact")


def _radius(station: StationMotion, table: Table, i: int, screening: Screening) -> UncertainRadius:
    """Return the radius of building i at contact height, with its oscillator and uncertainties."""
    # the median of the estimate over the exact demand is taken off the radius
    bias = np.where(_linearized(table), screening.linearized_median, screening.model_median)
    ln_ratio, motion_log_std = motion_at_site(table, i)
    return UncertainRadius(
        radius=values(table, f"participation_{i}") * _deciding(table, f"per_{i}") / bias,
        ln_ratio=ln_ratio,
        motion_log_std=motion_log_std,
        damping_log_std=_damping_dispersion(station, table, i),
        period=_deciding(table, f"period_{i}"),
        damping=_deciding(table, f"damping_{i}"),
    )


def _linearized(table: Table) -> NDArray[np.bool_]:
    """Return where the gap of equivalent linear buildings decides."""
    return np.asarray(table["demand_rule"] == "linearized")


def _deciding(table: Table, name: str) -> FloatArray:
    """Return a column, that of the equivalent building where this decides."""
    return np.where(_linearized(table), values(table, f"equivalent_{name}"), values(table, name))


def _governing_correlation(table: Table) -> FloatArray:
    """Return the correlation that governs the demand."""
    by_record = np.asarray(table["demand_rule"] == "per_record")
    elastic = np.where(by_record, table["correlation_record"], table["correlation"])
    linearized = values(table, "correlation_linearized")
    return np.where(_linearized(table), linearized, elastic)


def _damping_dispersion(station: StationMotion, table: Table, i: int) -> FloatArray:
    """Return the deviation of ln radius i by an uncertain damping; 0 where that is resampled."""
    single = ~is_exact(table) & ~period_is_uncertain(table)
    row = nearest_azimuth(station, table)[single]
    period, damping = log_oscillator(table, i)
    period, damping = period[single], damping[single]
    deviation = values(table, f"damping_log_std_{i}")[single]
    # half the difference between one deviation below and above
    low = stored_log(station.per, row, period, damping - deviation)
    high = stored_log(station.per, row, period, damping + deviation)
    dispersion = np.zeros(single.size)
    dispersion[single] = np.abs(high - low) / 2.0
    return dispersion
