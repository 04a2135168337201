"""
Demand of pairs from one record: estimates, single hit, exact outcome, and the governing one.

All quantities are at contact level: a building's radius times its participation.
"""

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import absolute_gap, critical_gap, srss_gap
from per_obspy.pounding.single_hit import single_hit
from per_obspy.screening.exact import exact_decides, exact_outcome, no_outcome
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.station_motion import PairMotion, StationMotion
from per_obspy.screening.values import BoolArray, Both, Columns, Table, both, oscillators, values
from per_obspy.screening.yielding import (
    governing,
    governing_radii,
    linearized_columns,
)

#: Rules of the elastic estimates.
RULES = np.array(["per_white_noise", "per_record", "srss"], dtype=object)

#: Demand / sum of the radii below which two oscillators move as one: the difference of equal
#: numbers.
ROUND_OFF = 1e-12


def demand_columns(
    station: StationMotion, pairs: Table, motion: PairMotion, azimuth_rule: str, exact: bool
) -> Columns:
    """
    Compute estimates, single hit, exact outcome and governing demand of pairs at one station.

    Parameters
    ----------
    station : StationMotion
        The record.
    pairs : Table
        Completed pairs.
    motion : PairMotion
        Response of the pairs to the record, along one azimuth or many.
    azimuth_rule : str
        Origin of the azimuth: ``given``, ``worst`` or ``station``.
    exact : bool
        Whether the exact demand and the history of every pair are computed; they are empty
        otherwise.

    Returns
    -------
    dict of (n_pairs,) ndarray
        The columns of the pairs and those of the demand, see ``columns.RESULTS``.
    """
    # estimates at the azimuth where the demand is largest, elastic and linearized
    table: Columns = {**pairs, **_at_worst_azimuth(elastic_estimates(motion, pairs))}
    table |= linearized_columns(station, table)
    # yielding may raise the elastic demand
    larger = values(table, "critical_gap_linearized") > values(table, "demand")
    estimate = np.where(larger, table["critical_gap_linearized"], table["demand"])
    rule = np.where(larger, "linearized", table["demand_rule"])
    table |= {"demand": estimate, "demand_estimated": estimate, "estimate_rule": rule}
    # the single hit of the oscillators whose gap governs: if yielding, maybe the equivalent ones
    table |= single_hit_columns(table, governing_radii(table), governing(table, "period"))
    table["azimuth_rule"] = np.full(rule.size, azimuth_rule, dtype=object)
    # the exact demand replaces the estimate where the record supports it
    if exact:
        azimuth = np.where(azimuth_rule == "station", 0.0, table["azimuth_used"])
        table |= exact_outcome(station, table, azimuth)
        decides = exact_decides(station, table)
    else:
        table |= no_outcome(rule.size)
        decides = np.zeros(rule.size, dtype=bool)
    table["demand_rule"] = np.where(decides, "exact", rule)
    return table | _without_round_off(table, np.where(decides, table["demand_exact"], estimate))


def _without_round_off(table: Table, demand: FloatArray) -> Columns:
    """Return the demand, 0 where it is round-off, and estimated / exact demand, NaN there."""
    tiny, exact = ROUND_OFF * values(table, "absolute_gap"), values(table, "demand_exact")
    unknown, estimate = np.full_like(exact, np.nan), values(table, "demand_estimated")
    return {
        "demand": np.where(demand > tiny, demand, 0.0),
        "estimate_over_exact": np.divide(estimate, exact, out=unknown, where=exact > tiny),
    }


def elastic_estimates(motion: PairMotion, pairs: Table) -> Columns:
    """Return every elastic estimate of the critical gap, and the largest, by azimuth."""
    share_1, share_2 = (share[:, None] for share in both(pairs, "participation"))
    # radii at contact level; a column of pairs against the row of azimuths
    per, sd = ((share_1 * one, share_2 * two) for one, two in (motion.per, motion.sd))
    correlation = ddc_correlation(*(column[:, None] for column in oscillators(pairs)))
    estimates: Columns = {
        "azimuth_used": motion.azimuth,
        "per_1": motion.per[0],
        "per_2": motion.per[1],
        "sd_1": motion.sd[0],
        "sd_2": motion.sd[1],
        "correlation": np.broadcast_to(correlation, motion.correlation.shape),
        "correlation_record": motion.correlation,
        "critical_gap_per": critical_gap(*per, correlation),
        "critical_gap_record": critical_gap(*per, motion.correlation),
        "critical_gap_sd": critical_gap(*sd, correlation),
        "srss_gap": srss_gap(*per),
        "absolute_gap": absolute_gap(*per),
    }
    # by eq. (15), with several correlations
    return estimates | _governing(estimates, period_is_derived(pairs))


def _governing(estimates: Columns, period_derived: BoolArray) -> Columns:
    """
    Return the largest estimate, m, and its rule, (n_pairs, n_azimuths).

    It is that of PER with eq. (16) or with the correlation of the record; with derived periods at
    least SRSS: these make equal buildings seem to move as one, with a correlation of 1 and no
    demand, for which there is no evidence.
    """
    squares = np.where(period_derived[:, None], estimates["srss_gap"], -np.inf)
    gaps = np.stack([estimates["critical_gap_per"], estimates["critical_gap_record"], squares])
    best = np.argmax(gaps, axis=0)
    return {"demand": np.take_along_axis(gaps, best[None], axis=0)[0], "demand_rule": RULES[best]}


def _at_worst_azimuth(columns: Columns) -> Columns:
    """Return the columns, (n_pairs,), at the azimuth where the demand of a pair is largest."""
    worst = np.argmax(columns["demand"], axis=1)[:, None]
    return {
        name: np.take_along_axis(column, worst, axis=1)[:, 0] for name, column in columns.items()
    }


def single_hit_columns(table: Table, radii: Both, periods: Both) -> Columns:
    """Return the single hit of every pair, with its ``demand`` as the critical gap."""
    masses, restitution = both(table, "contact_mass"), values(table, "restitution")
    demand, gap = values(table, "demand"), values(table, "gap")
    hit = single_hit(*radii, *periods, *masses, restitution, demand, gap)
    return {
        "single_hit_status": hit.status,
        "amplification_1": hit.amplification_1,
        "amplification_2": hit.amplification_2,
        "impact_velocity": hit.impact_velocity,
    }
