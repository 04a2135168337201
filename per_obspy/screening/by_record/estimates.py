"""What a record says of pairs: every estimate, the single hit, the exact outcome, and which demand decides."""

import numpy as np
import xarray as xr

from per_obspy.checks import FloatArray
from per_obspy.pounding.single_hit import single_hit
from per_obspy.screening.by_record.demand import gap_estimates, governing_demand
from per_obspy.screening.by_record.exact import exact_decides, exact_outcome, no_outcome
from per_obspy.screening.by_record.pair_radii import PairMotion
from per_obspy.screening.by_record.yielding import linearized_columns
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.values import Columns, Table, at_contact, both, values

#: Demand / sum of the radii below which two oscillators move as one: the difference of equal
#: numbers.
ROUND_OFF = 1e-12


def judged(
    station: xr.Dataset, pairs: Table, motion: PairMotion, rule: str, exact: bool
) -> Columns:
    """
    Return the pairs with estimates, single hit, exact outcome and the demand that decides.

    Parameters
    ----------
    station : Dataset
        The record.
    pairs : Table
        Completed pairs.
    motion : PairMotion
        What the record does to them, along one azimuth or many.
    rule : str
        How the azimuth was found: ``given``, ``worst`` or ``station``.
    exact : bool
        Whether the exact demand and the history of every pair are computed; they are empty
        otherwise.
    """
    table: Columns = {**pairs, **_at_worst(motion, pairs)}
    table |= linearized_columns(station, table)
    table |= _estimated_demand(table)
    table |= {"demand_estimated": table["demand"], "estimate_rule": table["demand_rule"]}
    table |= _single_hits(table)
    table["azimuth_rule"] = np.full(len(motion.azimuth), rule, dtype=object)
    if exact:
        azimuth = (
            np.zeros(len(motion.azimuth)) if rule == "station" else values(table, "azimuth_used")
        )
        table |= exact_outcome(station, table, azimuth)
        decides = exact_decides(station, table)
        table["demand"] = np.where(decides, table["demand_exact"], table["demand"])
        table["demand_rule"] = np.where(decides, "exact", table["demand_rule"])
    else:
        table |= no_outcome(len(motion.azimuth))
    return table | {
        "demand": _without_round_off(table),
        "estimate_over_exact": _estimate_over_exact(table),
    }


def _estimated_demand(table: Table) -> Columns:
    """Return the larger of the elastic and the linearized demand: elastic alone is too small for yielding pairs."""
    elastic, linearized = values(table, "demand"), values(table, "critical_gap_linearized")
    larger = linearized > elastic
    return {
        "demand": np.where(larger, linearized, elastic),
        "demand_rule": np.where(larger, "linearized", table["demand_rule"]),
    }


def _estimate_over_exact(table: Table) -> FloatArray:
    """Return the governing estimate over the exact demand, NaN where that is not known, 0, or round-off."""
    exact, estimate = values(table, "demand_exact"), values(table, "demand_estimated")
    known = exact > ROUND_OFF * values(table, "absolute_gap")
    return np.divide(estimate, exact, out=np.full_like(exact, np.nan), where=known)


def _without_round_off(table: Table) -> FloatArray:
    demand = values(table, "demand")
    return np.where(demand > ROUND_OFF * values(table, "absolute_gap"), demand, 0.0)


def _at_worst(motion: PairMotion, pairs: Table) -> Columns:
    """Return all estimates at the azimuth where the estimated demand of a pair is largest."""
    share = [one[:, None] for one in both(pairs, "participation")]
    period_1, period_2 = (one[:, None] for one in both(pairs, "period"))
    damping_1, damping_2 = (one[:, None] for one in both(pairs, "damping"))
    estimates = gap_estimates(
        (share[0] * motion.per[0], share[1] * motion.per[1]),
        (share[0] * motion.sd[0], share[1] * motion.sd[1]),
        (period_1, period_2),
        (damping_1, damping_2),
        motion.correlation,
    )
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
    worst = np.argmax(demand, axis=1)[:, None]
    return {
        name: np.take_along_axis(column, worst, axis=1)[:, 0] for name, column in columns.items()
    }


def _single_hits(table: Table) -> Columns:
    """Return the single hit of every pair; its critical gap is the estimated demand."""
    per_1, per_2 = at_contact(table, "equivalent_per")
    period_1, period_2 = both(table, "equivalent_period")
    mass_1, mass_2 = both(table, "contact_mass")
    restitution, demand, gap = (values(table, name) for name in ("restitution", "demand", "gap"))
    hit = single_hit(per_1, per_2, period_1, period_2, mass_1, mass_2, restitution, demand, gap)
    return {
        "single_hit_status": hit.status,
        "amplification_1": hit.amplification_1,
        "amplification_2": hit.amplification_2,
        "impact_velocity": hit.impact_velocity,
    }


def impact_velocity_that_counts(table: Table) -> FloatArray:
    """Return that of the exact history where it decides, else the larger of it and of the single hit, m/s."""
    estimated = np.where(
        table["demand_rule"] == "exact", 0.0, np.nan_to_num(values(table, "impact_velocity"))
    )
    larger: FloatArray = np.fmax(values(table, "impact_velocity_exact"), estimated)
    return larger
