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
from per_obspy.screening.uncertainty.estimated import UncertainMotion, UncertainRadius
from per_obspy.screening.uncertainty.site_demand import (
    estimate_log_std,
    motion_at_site,
    pair_at_site,
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
        Its rows are those of the stored PER of the station. Where the exact demand decides the
        radii are those of PER, without the error of an estimate.
    """
    first, second = (_radius(table, i, screening) for i in (1, 2))
    # by the motion of both buildings, and by the error of an estimate
    _, pair_log_std = pair_at_site(table)
    deviations = screening.linearized_dispersion, screening.model_dispersion
    at_record = np.where(_linearized(table), *deviations)
    model_log_std = estimate_log_std(table, at_record, screening.interpolation)
    return UncertainMotion(
        first,
        second,
        correlation=_governing_correlation(table),
        log_std=np.hypot(pair_log_std, np.where(is_exact(table), 0.0, model_log_std)),
        row=nearest_azimuth(station, table),
    )


def is_exact(table: Table) -> NDArray[np.bool_]:
    """Return a mask of the pairs whose demand is the exact one."""
    return np.asarray(table["demand_rule"] == "exact")


def _radius(table: Table, i: int, screening: Screening) -> UncertainRadius:
    """Return the radius of building i at contact height, with its oscillator and uncertainties."""
    # the median of the estimate over the exact demand is taken off the radius
    estimate = np.where(_linearized(table), screening.linearized_median, screening.model_median)
    bias = np.where(is_exact(table), 1.0, estimate)
    ln_ratio, _ = motion_at_site(table, i)
    return UncertainRadius(
        radius=values(table, f"participation_{i}") * _deciding(table, f"per_{i}") / bias,
        ln_ratio=ln_ratio,
        period=_deciding(table, f"period_{i}"),
        damping=_deciding(table, f"damping_{i}"),
    )


def _linearized(table: Table) -> NDArray[np.bool_]:
    """Return a mask of the pairs whose demand is that of equivalent linear buildings."""
    return np.asarray(table["demand_rule"] == "linearized")


def _deciding(table: Table, name: str) -> FloatArray:
    """Return a column, with the values of the equivalent buildings where these decide."""
    return np.where(_linearized(table), values(table, f"equivalent_{name}"), values(table, name))


def _governing_correlation(table: Table) -> FloatArray:
    """Return the correlation that governs the demand."""
    by_record = np.asarray(table["demand_rule"] == "per_record")
    elastic = np.where(by_record, table["correlation_record"], table["correlation"])
    linearized = values(table, "correlation_linearized")
    return np.where(_linearized(table), linearized, elastic)
