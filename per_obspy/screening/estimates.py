"""
Demand of pairs from one record: estimates, single hit, exact outcome, and the governing one.

All quantities are at contact level: a building's radius times its participation.

A building whose displacement exceeds its yield displacement is replaced by an equivalent linear one
(Iwan 1980) at its ductility. This is the largest ductility up to 40 at which the equivalent
building's displacement is that many yield displacements: on a lakebed a stiff, weak building has
several, and the first one is far too small where yielding takes its period into the resonance of
the ground. It is found on the station's stored spectra, scaled to the SD of the building,
interpolated in period and damping. PER at the equivalent period and damping, from the stored
spectra too, and eq. (16) at the equivalent properties give the critical gap. Yielding raises the
correlation under broad ground motion; under narrow one eq. (16) then overestimates it, so that the
smaller of the elastic and the equivalent correlation is used.
"""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.kernels.pairs.last_ductility import last_intervals
from per_obspy.pounding.correlation import ddc_correlation
from per_obspy.pounding.critical_gap import absolute_gap, critical_gap, srss_gap
from per_obspy.pounding.equivalent_linear import iwan
from per_obspy.pounding.single_hit import single_hit
from per_obspy.screening.exact import exact_decides, exact_outcome, no_outcome
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.population import LARGEST_DAMPING
from per_obspy.screening.station_motion import (
    LogSpectra,
    PairMotion,
    StationMotion,
    log_period_and_damping,
    nearest_azimuth,
    record_number,
    stored_log,
)
from per_obspy.screening.values import (
    BoolArray,
    Both,
    Columns,
    IndexArray,
    Table,
    TextArray,
    both,
    chosen,
    oscillators,
    values,
)

#: Rules of the elastic estimates.
RULES = np.array(["per_white_noise", "per_record", "srss"], dtype=object)

#: Demand / sum of the radii below which two oscillators move as one: the difference of equal
#: numbers.
ROUND_OFF = 1e-12


def demand_columns(
    station: StationMotion,
    pairs: Table,
    motion: PairMotion,
    azimuth_rule: str | TextArray,
    exact: bool,
    histories: bool = True,
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
    azimuth_rule : str or (n_pairs,) ndarray
        Origin of the azimuth: ``given``, ``worst`` or ``station``.
    exact, histories : bool
        Whether the exact demand of every pair, and with it its history, are computed; they are
        empty otherwise.

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
        table |= exact_outcome(station, table, azimuth, histories)
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


#: Ductilities of the coarse scan, and the parts into which one of its intervals is divided.
DUCTILITIES: FloatArray = np.geomspace(1.0, 40.0, 97)
PARTS: FloatArray = np.linspace(0.0, 1.0, 33)
#: Their logarithms, and what they change: logarithms of period factors, and dampings to add.
SCAN: FloatArray = np.stack([np.log(DUCTILITIES), *iwan(DUCTILITIES, 0.0)])
SCAN[1] = np.log(SCAN[1])

#: Properties that the equivalent linear building does not share with the given one.
EQUIVALENT = ("period", "damping", "per")


#: Buildings of one side, each (n_pairs, 1): row of the stored azimuth, period (s), damping.
_Building = tuple[IndexArray, FloatArray, FloatArray]


class Equivalent(NamedTuple):
    """
    Equivalent linear buildings, each (n_pairs,).

    Attributes
    ----------
    ductility : ndarray
        Displacement over yield displacement, dimensionless; 0 for a building that cannot yield.
    period, damping, per : ndarray
        s; fraction of critical; pseudo energy radius of the oscillator, m.
    converged : ndarray of bool
        Whether a ductility was found.
    """

    ductility: FloatArray
    period: FloatArray
    damping: FloatArray
    per: FloatArray
    converged: BoolArray


def linearized_columns(station: StationMotion, table: Table) -> Columns:
    """
    Compute the estimated demand of equivalent linear buildings, as columns of the risk table.

    Parameters
    ----------
    station : StationMotion
        The record, with its stored spectra.
    table : Table
        Completed pairs with ``azimuth_used``, radii and correlation along it, and
        ``critical_gap_per``.

    Returns
    -------
    dict of (n_pairs,) ndarray
        ``critical_gap_linearized, correlation_linearized, ductility_i`` (see ``columns.RESULTS``),
        period, damping and PER of the equivalent oscillators, ``equivalent_..._i``, and
        ``linearized_converged``. Where no building is taken beyond its yield displacement they
        equal the elastic ones.

    References
    ----------
    Iwan (1980), Earthquake Engineering and Structural Dynamics 8; Valles-Mattox & Reinhorn (1996),
    11WCEE, eq. (15), (16).
    """
    columns = _elastic_columns(table)
    # pairs of which a building is taken beyond its yield displacement, and that move at all
    ductility = np.maximum(columns["ductility_1"], columns["ductility_2"])
    yields = (ductility > 1.0) & (values(table, "absolute_gap") > 0)
    if yields.any():
        for name, column in _yielding_columns(station, chosen(table, yields)).items():
            columns[name][yields] = column
    return columns


def governing(table: Table, name: str) -> Both:
    """
    Return a property (one of ``EQUIVALENT``) of the oscillators that govern the estimated demand.

    They are the equivalent linear buildings where their gap governs (``estimate_rule``), else the
    elastic ones.
    """
    linearized = np.asarray(table["estimate_rule"] == "linearized")
    equivalent_1, equivalent_2 = both(table, f"equivalent_{name}")
    elastic_1, elastic_2 = both(table, name)
    first = np.where(linearized, equivalent_1, elastic_1)
    return first, np.where(linearized, equivalent_2, elastic_2)


def governing_radii(table: Table) -> Both:
    """Return the PER of the oscillators of :func:`governing` at contact height, m."""
    radius_1, radius_2 = governing(table, "per")
    share_1, share_2 = both(table, "participation")
    return share_1 * radius_1, share_2 * radius_2


def _elastic_columns(table: Table) -> Columns:
    """Return the columns of pairs that stay elastic: equivalent buildings are the elastic ones."""
    columns: Columns = {
        "critical_gap_linearized": values(table, "critical_gap_per").copy(),
        "correlation_linearized": values(table, "correlation").copy(),
    }
    for i in (1, 2):
        columns[f"ductility_{i}"] = _elastic_ductility(table, i)
        # period, damping and PER
        for name in EQUIVALENT:
            columns[f"equivalent_{name}_{i}"] = values(table, f"{name}_{i}").copy()
    columns["linearized_converged"] = np.ones(len(columns["ductility_1"]), dtype=bool)
    return columns


def _elastic_ductility(table: Table, i: int) -> FloatArray:
    return values(table, f"sd_{i}") / values(table, f"yield_displacement_{i}")


def _yielding_columns(station: StationMotion, table: Table) -> Columns:
    row = nearest_azimuth(station, table)
    first, second = (_equivalent(station, row, table, i) for i in (1, 2))
    # eq. (16) of the equivalent buildings; in narrow motion at most the elastic one
    correlation = ddc_correlation(first.period, first.damping, second.period, second.damping)
    of_record = record_number(station, table)
    narrow = np.array([record.is_narrow for record in station.records])[of_record]
    smaller = np.minimum(correlation, values(table, "correlation"))
    correlation = np.where(narrow, smaller, correlation)
    # eq. (15) with the PER of the equivalent buildings at contact level
    share_1, share_2 = both(table, "participation")
    columns: Columns = {
        "critical_gap_linearized": critical_gap(
            share_1 * first.per, share_2 * second.per, correlation
        ),
        "correlation_linearized": correlation,
        "linearized_converged": first.converged & second.converged,
    }
    for i, building in enumerate((first, second), start=1):
        columns[f"ductility_{i}"] = building.ductility
        for name in EQUIVALENT:
            columns[f"equivalent_{name}_{i}"] = getattr(building, name)
    return columns


def _equivalent(station: StationMotion, row: IndexArray, table: Table, i: int) -> Equivalent:
    """Return the equivalent linear buildings i; elastic ones stay unchanged."""
    elastic = _elastic_ductility(table, i)
    period, damping = values(table, f"period_{i}"), values(table, f"damping_{i}")
    yields = elastic > 1.0
    # rows of the stored azimuths, and oscillators that yield
    yielding = row[yields, None], period[yields, None], damping[yields, None]
    ductility, converged = elastic.copy(), np.ones(elastic.size, dtype=bool)
    ductility[yields], converged[yields] = _largest_ductility(station.sd, yielding, elastic[yields])
    # longer period and added damping of Iwan (1980) at that ductility
    longer, added = iwan(np.maximum(ductility, 1.0), 0.0)
    damped = np.maximum(damping, np.minimum(damping + added, LARGEST_DAMPING))
    # PER changes as the stored spectrum does
    radius = values(table, f"per_{i}").copy()
    radius[yields] *= _change(station.per, yielding, ductility[yields, None])[:, 0]
    return Equivalent(ductility, period * longer, damped, radius, converged)


def _change(spectra: LogSpectra, building: _Building, ductility: FloatArray) -> FloatArray:
    """Return the equivalent over the elastic radius at ductilities (n_pairs, n)."""
    row, period, damping = building
    longer, added = iwan(ductility, 0.0)
    at_ductility = log_period_and_damping(period * longer, damping + added)
    elastic = stored_log(spectra, row, *log_period_and_damping(period, damping))
    return np.asarray(np.exp(stored_log(spectra, row, *at_ductility) - elastic))


def _largest_ductility(
    sd: LogSpectra, building: _Building, elastic: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return the largest ductility that the displacement reaches, and whether it was found."""

    def excess(ductility: FloatArray) -> FloatArray:
        return np.asarray(elastic[:, None] * _change(sd, building, ductility) - ductility)

    # coarse scan, then a finer one of its last interval with a change of sign
    last = _last_interval(sd, building, elastic)
    low, high = DUCTILITIES[last, None], DUCTILITIES[last + 1, None]
    finer = low + PARTS * (high - low)
    low, high, excess_low, excess_high = _last_bracket(finer, excess(finer))
    # linear interpolation between the two ends
    crosses = excess_low > np.maximum(excess_high, 0.0)
    part = np.zeros_like(excess_low)
    np.divide(excess_low, excess_low - excess_high, out=part, where=crosses)
    ductility = (low + part * (high - low))[:, 0]
    converged = np.asarray(excess(np.full_like(low, DUCTILITIES[-1]))[:, 0] <= 0.0)
    return np.where(converged, ductility, DUCTILITIES[-1]), converged


def _last_interval(sd: LogSpectra, building: _Building, elastic: FloatArray) -> IndexArray:
    """Return the number of the last of ``DUCTILITIES`` that the displacement exceeds, or 0."""
    row, period, damping = building
    log_period, log_damping = log_period_and_damping(period, damping)
    # the stored spectrum is scaled to the displacement of the building
    level = np.log(elastic) - stored_log(sd, row, log_period, log_damping)[:, 0]
    buildings = np.stack([log_period[:, 0], damping[:, 0], level])
    last = np.empty(elastic.size, dtype=np.intp)
    last_intervals(*sd, row[:, 0], buildings, SCAN, last)
    return last


def _last_bracket(ductility: FloatArray, excess: FloatArray) -> tuple[FloatArray, ...]:
    """
    Return two ductilities (n_pairs, 1) around the last zero of the excess, and the excess there.

    At the ends of the grid these are the nearest ones: an interval exists whatever the signs.
    """
    positive = excess > 0.0
    positive[:, 0], positive[:, -1] = True, False
    last = (excess.shape[1] - 1 - positive[:, ::-1].argmax(axis=1))[:, None]
    # both ends of the interval
    return tuple(
        np.take_along_axis(column, last + step, 1)
        for column in (ductility, excess)
        for step in (0, 1)
    )
