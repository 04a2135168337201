"""
Demand of pairs from one record: estimates, single hit, exact outcome, and the governing one.

All quantities are at contact level: a building's radius times its participation.
"""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import absolute_gap, critical_gap, srss_gap
from per_obspy.pounding.single_hit import single_hit
from per_obspy.screening.by_record.exact import exact_decides, exact_outcome, no_outcome
from per_obspy.screening.by_record.station_motion import PairMotion, StationMotion
from per_obspy.screening.by_record.yielding import (
    governing,
    governing_radii,
    linearized_columns,
)
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.values import BoolArray, Both, Columns, Table, TextArray, both, values


class GapEstimates(NamedTuple):
    """
    Critical gaps of the same pairs by every estimate, m.

    Attributes
    ----------
    correlation : ndarray
        By eq. (16), dimensionless.
    per, record, sd, srss, absolute : ndarray
        PER with eq. (16), PER with the record's correlation, SD with eq. (16), root of the sum of
        squares of the PER, sum of the PER.
    """

    correlation: FloatArray
    per: FloatArray
    record: FloatArray
    sd: FloatArray
    srss: FloatArray
    absolute: FloatArray


class Demand(NamedTuple):
    """
    Governing demand, m, and the name of its rule.

    Attributes
    ----------
    demand : ndarray
        Gap needed, m.
    rule : ndarray of str
        ``per_white_noise`` (eq. 16), ``per_record`` or ``srss``.
    """

    demand: FloatArray
    rule: TextArray


RULES = np.array(["per_white_noise", "per_record", "srss"], dtype=object)


def gap_estimates(
    per: Both,
    sd: Both,
    period: Both,
    damping: Both,
    correlation_record: FloatArray,
) -> GapEstimates:
    """
    Compute every estimate of the critical gap.

    Parameters
    ----------
    per, sd : pairs of ndarray
        Radii of the two buildings at contact level, m.
    period, damping : pairs of ndarray
        s; fraction of critical.
    correlation_record : ndarray
        Correlation of the two responses to the record, dimensionless.
    """
    correlation = ddc_correlation(period[0], damping[0], period[1], damping[1])
    return GapEstimates(
        correlation=np.broadcast_to(correlation, np.shape(correlation_record)),
        per=critical_gap(*per, correlation),
        record=critical_gap(*per, correlation_record),
        sd=critical_gap(*sd, correlation),
        srss=srss_gap(*per),
        absolute=absolute_gap(*per),
    )


def governing_demand(estimates: GapEstimates, period_derived: BoolArray) -> Demand:
    """
    Return the larger PER demand of eq. (16) and of the record; with derived periods at least SRSS.

    Derived periods make equal buildings seem to move as one, with a correlation of 1 and no demand,
    for which there is no evidence.

    Parameters
    ----------
    estimates : GapEstimates
        Of the same pairs.
    period_derived : ndarray of bool
        Whether a period of the pair was derived from its height or storeys.
    """
    candidates = np.stack(
        [estimates.per, estimates.record, np.where(period_derived, estimates.srss, -np.inf)], axis=0
    )
    best = np.argmax(candidates, axis=0)
    return Demand(np.take_along_axis(candidates, best[None], axis=0)[0], RULES[best])


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
    count = len(motion.azimuth)
    # estimates along the worst azimuth, elastic and linearized; the larger one is the estimate
    table: Columns = {**pairs, **_at_worst_azimuth(motion, pairs)}
    table |= linearized_columns(station, table)
    table |= _estimated_demand(table)
    table |= {"demand_estimated": table["demand"], "estimate_rule": table["demand_rule"]}
    # the single hit of the oscillators whose gap governs: if yielding, maybe the equivalent ones
    table |= single_hit_columns(table, governing_radii(table), governing(table, "period"))
    table["azimuth_rule"] = np.full(count, azimuth_rule, dtype=object)
    # the exact demand replaces the estimate where the record supports it
    if exact:
        on_sensor_axis = azimuth_rule == "station"
        azimuth = np.zeros(count) if on_sensor_axis else values(table, "azimuth_used")
        table |= exact_outcome(station, table, azimuth)
        table |= _exact_demand(station, table)
    else:
        table |= no_outcome(count)
    ratio = _estimate_over_exact(table)
    return table | {"demand": _without_round_off(table), "estimate_over_exact": ratio}


def _estimated_demand(table: Table) -> Columns:
    """Return the larger of elastic and linearized demand: yielding may raise the elastic one."""
    elastic, linearized = values(table, "demand"), values(table, "critical_gap_linearized")
    larger = linearized > elastic
    return {
        "demand": np.where(larger, linearized, elastic),
        "demand_rule": np.where(larger, "linearized", table["demand_rule"]),
    }


def _exact_demand(station: StationMotion, table: Table) -> Columns:
    """Return the demand and its rule, replaced by the exact demand where that decides."""
    decides = exact_decides(station, table)
    return {
        "demand": np.where(decides, table["demand_exact"], table["demand"]),
        "demand_rule": np.where(decides, "exact", table["demand_rule"]),
    }


def _estimate_over_exact(table: Table) -> FloatArray:
    """Return estimated / exact demand, NaN where the exact one is unknown, 0 or round-off."""
    exact, estimate = values(table, "demand_exact"), values(table, "demand_estimated")
    known = exact > ROUND_OFF * values(table, "absolute_gap")
    return np.divide(estimate, exact, out=np.full_like(exact, np.nan), where=known)


def _without_round_off(table: Table) -> FloatArray:
    """Return the demand, 0 where it is the round-off of two equal motions."""
    demand = values(table, "demand")
    return np.where(demand > ROUND_OFF * values(table, "absolute_gap"), demand, 0.0)


def _at_worst_azimuth(motion: PairMotion, pairs: Table) -> Columns:
    """Return all estimates at the azimuth where the estimated demand of a pair is largest."""
    estimates = _estimates(motion, pairs)
    demand, rule = governing_demand(estimates, period_is_derived(pairs)[:, None])
    columns: Columns = {
        "azimuth_used": motion.azimuth,
        "per_1": motion.per[0],
        "per_2": motion.per[1],
        "sd_1": motion.sd[0],
        "sd_2": motion.sd[1],
        "correlation": estimates.correlation,
        "correlation_record": motion.correlation,
        "critical_gap_per": estimates.per,
        "critical_gap_record": estimates.record,
        "critical_gap_sd": estimates.sd,
        "srss_gap": estimates.srss,
        "absolute_gap": estimates.absolute,
        "demand": demand,
        "demand_rule": rule,
    }
    # one azimuth of (n_pairs, n_azimuths) per pair
    worst = np.argmax(demand, axis=1)[:, None]
    return {
        name: np.take_along_axis(column, worst, axis=1)[:, 0] for name, column in columns.items()
    }


def _estimates(motion: PairMotion, pairs: Table) -> GapEstimates:
    """Return every estimate of the critical gap along every azimuth, (n_pairs, n_azimuths)."""
    share_1, share_2 = both(pairs, "participation")
    period_1, period_2 = both(pairs, "period")
    damping_1, damping_2 = both(pairs, "damping")
    # radii at contact level; a column of pairs against the row of azimuths
    return gap_estimates(
        (share_1[:, None] * motion.per[0], share_2[:, None] * motion.per[1]),
        (share_1[:, None] * motion.sd[0], share_2[:, None] * motion.sd[1]),
        (period_1[:, None], period_2[:, None]),
        (damping_1[:, None], damping_2[:, None]),
        motion.correlation,
    )


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
