"""
What would have kept a pair from pounding, or from harm: more gap, more damping, or a softer contact.

Added damping and bumpers are estimates. The critical gap, eq. (15) and (16), follows the added
damping on the station's stored spectra, scaled to the pair's own radii, and above the stored
dampings on their last slope; it is scaled to the demand that decides, so that a pair whose gap is
enough needs nothing. A bumper is judged by the single hit. A building that yields is its equivalent
linear one, whose period and damping are not followed as damping is added.
"""

import numpy as np
import xarray as xr

from per_obspy.checks import FloatArray
from per_obspy.kernels.pairs.added_damping import least_dampings
from per_obspy.pounding.correlation.white_noise import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap, srss_gap
from per_obspy.pounding.mitigation.bumpers import required_restitution
from per_obspy.screening.by_record.stored_spectra import azimuth_row, log_spectra, stored_log
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.values import Columns, Table, at_contact, both, chosen, values

#: Largest damping that is added, fraction of critical.
LARGEST_DAMPING = 0.4
#: Critical gap / sum of the radii below which it is the difference of equal numbers: then they
#: count as uncorrelated.
ROUND_OFF = 1e-12


def mitigation_columns(station: xr.Dataset, table: Table, target_amplification: float) -> Columns:
    """
    Return what would have prevented pounding or its harm, as columns of the risk table.

    Parameters
    ----------
    station : Dataset
        The record, with its stored spectra.
    table : Table
        Rows of the risk table with demand, radii and the columns of
        :func:`~.yielding.linearized_columns`.
    target_amplification : float
        Largest admissible PER after a single hit / before, at least 1, dimensionless.

    Returns
    -------
    dict of (n_pairs,) ndarray
        ``missing_gap``, ``supplemental_damping``, ``bumper_restitution``, see ``columns.RESULTS``.

    Raises
    ------
    ValueError
        If the target is below 1.

    References
    ----------
    Valles-Mattox & Reinhorn (1996), 11WCEE, figures 7 and 8.
    """
    gap, demand = values(table, "gap"), values(table, "demand")
    pounds = demand > gap
    damping, restitution = np.zeros_like(gap), np.ones_like(gap)
    damping[pounds] = np.nan
    if (apart := pounds & (gap > 0)).any():
        damping[apart] = _supplemental_damping(station, chosen(table, apart))
    if pounds.any():
        restitution[pounds] = _bumper_restitution(chosen(table, pounds), target_amplification)
    return {
        "missing_gap": np.where(pounds, demand - gap, 0.0),
        "supplemental_damping": damping,
        "bumper_restitution": restitution,
    }


def _supplemental_damping(station: xr.Dataset, table: Table) -> FloatArray:
    """Return the least equal damping to add to pairs that pound and do not touch; NaN where none is enough."""
    (period_1, period_2), (damping_1, damping_2) = (
        both(table, "equivalent_period"),
        both(table, "equivalent_damping"),
    )
    radii = at_contact(table, "equivalent_per")
    correlated = critical_gap(*radii, ddc_correlation(period_1, damping_1, period_2, damping_2))
    alone = np.asarray(table["demand_rule"] == "srss") | (correlated <= ROUND_OFF * np.add(*radii))
    estimate = np.where(alone, srss_gap(*radii), correlated)
    pairs = np.stack(
        [
            np.where(alone, np.nan, np.log(period_1 / period_2)),
            damping_1,
            damping_2,
            *(np.log(np.maximum(radius, np.finfo(np.float64).tiny)) for radius in radii),
            values(table, "gap") * (estimate / values(table, "demand")),
        ],
        axis=1,
    )
    spectra, row = log_spectra(station), azimuth_row(station, table)[:, None]
    stored = [
        stored_log(spectra, row, np.log(period)[:, None], spectra.dampings)
        for period in (period_1, period_2)
    ]
    added = np.empty(len(pairs))
    least_dampings(spectra.dampings, np.stack(stored, axis=1), pairs, LARGEST_DAMPING, added)
    return added


def _bumper_restitution(table: Table, target_amplification: float) -> FloatArray:
    """
    Return the largest restitution that keeps the amplifications of pairs that pound within the target.

    The critical gap of the single hit is the larger of the estimated demand and the one that
    decides.
    """
    names = ["demand", "critical_gap_per", "critical_gap_record", "critical_gap_linearized"]
    critical = np.max([*(values(table, name) for name in names)], axis=0)
    critical = np.where(
        period_is_derived(table), np.maximum(critical, values(table, "srss_gap")), critical
    )
    return required_restitution(
        *at_contact(table, "equivalent_per"),
        *both(table, "equivalent_period"),
        *both(table, "contact_mass"),
        critical,
        values(table, "gap"),
        target_amplification,
    )
