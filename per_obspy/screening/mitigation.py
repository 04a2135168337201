"""
Measures that would have prevented pounding or its harm: gap, damping, softer contact.

Where the exact demand decides, exact displacements with the added damping do so too. Elsewhere
added damping is an estimate: the critical gap, eq. (15) and (16), follows it on the station's
stored spectra, scaled to the radii of the pair, and above the stored dampings on their last slope;
it is scaled to the demand that decides, so that a pair whose gap is enough needs no measure. A
bumper is always an estimate, by the single hit. Where the gap of equivalent linear buildings
governs, these take the place of the elastic ones; their periods and dampings are not followed as
damping is added.
"""

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.kernels.pairs.added_damping import least_dampings
from per_obspy.pounding.bumpers import required_restitution
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import critical_gap, srss_gap
from per_obspy.screening.estimates import governing, governing_radii
from per_obspy.screening.exact import NEEDED, least_exact_damping
from per_obspy.screening.station_motion import StationMotion, nearest_azimuth, stored_log
from per_obspy.screening.values import (
    BoolArray,
    Columns,
    IndexArray,
    Table,
    both,
    chosen,
    only,
    values,
)

#: Largest damping that is added, fraction of critical.
LARGEST_DAMPING = 0.4
#: Critical gap / sum of the radii below which it is the difference of equal numbers: then they
#: count as uncorrelated.
ROUND_OFF = 1e-12


def mitigation_columns(
    station: StationMotion, table: Table, target_amplification: float
) -> Columns:
    """
    Compute the measures that would have prevented pounding or its harm.

    Parameters
    ----------
    station : StationMotion
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
    separated = pounds & (gap > 0)
    damping, restitution = np.zeros_like(gap), np.ones_like(gap)
    # no damping keeps a pair that touches from pounding
    damping[pounds] = np.nan
    # by exact displacements where these are the demand
    exact = separated & np.asarray(table["demand_rule"] == "exact")
    estimated = separated & ~exact
    if exact.any():
        needed = only(table, NEEDED)
        damping[exact] = least_exact_damping(station, chosen(needed, exact), LARGEST_DAMPING)
    if estimated.any():
        damping[estimated] = _supplemental_damping(station, chosen(table, estimated))
    if pounds.any():
        restitution[pounds] = _bumper_restitution(chosen(table, pounds), target_amplification)
    return {
        "missing_gap": np.where(pounds, demand - gap, 0.0),
        "supplemental_damping": damping,
        "bumper_restitution": restitution,
    }


def _supplemental_damping(station: StationMotion, table: Table) -> FloatArray:
    """Return the estimated least added damping of both buildings; NaN if none is enough."""
    period_1, period_2 = governing(table, "period")
    damping_1, damping_2 = governing(table, "damping")
    radius_1, radius_2 = governing_radii(table)
    uncorrelated, estimate = _estimated_gap(table)
    log_ratio = np.where(uncorrelated, np.nan, np.log(period_1 / period_2))
    # one row per pair, in the order of the kernel; the gap is that of the estimate in proportion
    tiny = np.finfo(np.float64).tiny
    columns = [
        log_ratio,
        damping_1,
        damping_2,
        np.log(np.maximum(radius_1, tiny)),
        np.log(np.maximum(radius_2, tiny)),
        values(table, "gap") * (estimate / values(table, "demand")),
    ]
    pairs = np.stack(columns, axis=1)
    # stored PER of either building at every stored damping
    row = nearest_azimuth(station, table)[:, None]
    stored = np.stack(
        [_stored_by_damping(station, row, period) for period in (period_1, period_2)], axis=1
    )
    added = np.empty(len(pairs))
    least_dampings(station.per.dampings, stored, pairs, LARGEST_DAMPING, added)
    return added


def _estimated_gap(table: Table) -> tuple[BoolArray, FloatArray]:
    """Return a mask of uncorrelated pairs, and the critical gap by eq. (15) or SRSS, m."""
    period_1, period_2 = governing(table, "period")
    damping_1, damping_2 = governing(table, "damping")
    radii = governing_radii(table)
    # eq. (16) of the oscillators whose gap governs
    correlation = ddc_correlation(period_1, damping_1, period_2, damping_2)
    correlated = critical_gap(*radii, correlation)
    in_step = correlated <= ROUND_OFF * np.add(*radii)
    uncorrelated = np.asarray(table["demand_rule"] == "srss") | in_step
    return uncorrelated, np.where(uncorrelated, srss_gap(*radii), correlated)


def _stored_by_damping(station: StationMotion, row: IndexArray, period: FloatArray) -> FloatArray:
    """Return the stored ln PER at the period of each pair and every stored damping."""
    return stored_log(station.per, row, np.log(period)[:, None], station.per.dampings)


def _bumper_restitution(table: Table, target_amplification: float) -> FloatArray:
    """
    Return the largest restitution with which pairs that pound stay within the target amplification.

    The critical gap of the single hit is the larger of the estimated demand and the one that
    decides; the oscillators are those of the estimate.
    """
    critical = np.maximum(values(table, "demand_estimated"), values(table, "demand"))
    return required_restitution(
        *governing_radii(table),
        *governing(table, "period"),
        *both(table, "contact_mass"),
        critical,
        values(table, "gap"),
        target_amplification,
    )
