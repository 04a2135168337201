"""
Exact demand and history of pairs with a record, and the damping that keeps them apart.

Both buildings are oscillators at contact height, driven along one azimuth; only the oscillators
are estimates.

Supplemental damping is added to both buildings in steps, and refined before the first step that is
enough: more damping does not always help. The demand is the one that decides of such pairs: along
the pair's azimuth, or along the worst one where that is unknown.
"""

from typing import NamedTuple

import numpy as np

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation import worst_azimuth
from per_obspy.pounding.pair_histories import PoundingMaxima, pounding_histories
from per_obspy.pounding.relative import (
    Approach,
    YieldingRelativeDisplacement,
    approach,
    directional_relative_displacement,
    yielding_relative_displacement,
)
from per_obspy.screening.by_record.station_motion import StationMotion
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.values import (
    BoolArray,
    Both,
    Columns,
    Table,
    at_contact,
    both,
    chosen,
    only,
    values,
)

#: Columns of :func:`exact_outcome`.
EXACT_COLUMNS = (
    "demand_exact",
    "demand_two_sided",
    "impacts",
    "impact_velocity_exact",
    "amplification_exact_1",
    "amplification_exact_2",
)

#: Share of the gap below which a demand without contact, known to 1e-9, leaves the pair apart.
CERTAINLY_APART = 1.0 - 1e-6

#: Periods and dampings of 1 and 2, azimuth, participations.
Oscillators = tuple[
    FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray
]


class _WithoutContact(NamedTuple):
    """
    Response of pairs that do not touch, at contact level, each (n_pairs,), m.

    Attributes
    ----------
    towards, away : ndarray
        Largest relative displacement of 1 towards 2, and with the buildings in the other order.
    per_1, per_2 : ndarray
        Pseudo energy radii.
    """

    towards: FloatArray
    away: FloatArray
    per_1: FloatArray
    per_2: FloatArray


def furthest_azimuth(station: StationMotion, pairs: Table) -> FloatArray:
    """Return the axis from 1 to 2 along which the record demands the largest gap, degrees."""
    period_1, period_2 = both(pairs, "period")
    damping_1, damping_2 = both(pairs, "damping")
    motion = station.north, station.east, station.dt
    shares = both(pairs, "participation")
    return worst_azimuth(*motion, period_1, damping_1, period_2, damping_2, *shares)


def exact_decides(station: StationMotion, pairs: Table) -> BoolArray:
    """
    Return a mask of the pairs whose demand is the exact one.

    The record must support the pair, and no period may be derived: the exact demand of two equal
    derived periods is 0.

    Parameters
    ----------
    station : StationMotion
        The record.
    pairs : Table
        Completed pairs.
    """
    return np.asarray(record_supports(station, pairs) & ~period_is_derived(pairs))


def record_supports(station: StationMotion, pairs: Table) -> BoolArray:
    """
    Return a mask of the pairs for which the record gives an exact demand.

    It must hold both periods in its usable range and both horizontals. The worst azimuth is known
    of linear buildings only: where one can yield, the pair's azimuth must be given.

    Parameters
    ----------
    station : StationMotion
        The record.
    pairs : Table
        Completed pairs.
    """
    periods = np.stack(both(pairs, "period"))
    shortest, longest = station.usable_periods
    usable = ((periods >= shortest) & (periods <= longest)).all(axis=0)
    # the worst azimuth of a bilinear pair is unknown
    directed = ~can_yield(pairs) | np.isfinite(values(pairs, "azimuth"))
    two_horizontals = station.horizontals == 2
    supports: BoolArray = usable & directed & two_horizontals
    return supports


def can_yield(pairs: Table) -> BoolArray:
    """Return a mask of the pairs in which a building has a yield displacement."""
    return np.asarray(np.isfinite(np.stack(both(pairs, "yield_displacement"))).any(axis=0))


def exact_outcome(station: StationMotion, table: Table, azimuth: FloatArray) -> Columns:
    """
    Compute exact relative displacements and pounding histories of a block of pairs.

    Parameters
    ----------
    station : StationMotion
        The record.
    table : Table
        Completed pairs with their radii along the azimuth, and ``azimuth_used``.
    azimuth : (n_pairs,) ndarray
        Of the axis from 1 to 2, degrees; 0 where the station has one horizontal. Pairs without
        azimuth is unknown are turned by 180 degrees where the demand is larger there.

    Returns
    -------
    dict of (n_pairs,) ndarray
        ``EXACT_COLUMNS`` and ``azimuth_used``, see ``columns.RESULTS``.
    """
    free = _without_contact(station, table, azimuth)
    # building 2 may be on either side of 1 where the pair's azimuth is unknown: the worse one
    turned = np.isnan(values(table, "azimuth")) & (free.away > free.towards)
    demand = np.where(turned, free.away, free.towards)
    axis = values(table, "azimuth_used")
    return {
        "azimuth_used": np.where(turned, (axis + 180.0) % 360.0, axis),
        "demand_exact": demand,
        "demand_two_sided": np.maximum(free.towards, free.away),
    } | _pounding_columns(
        station, table, np.where(turned, azimuth + 180.0, azimuth), demand, (free.per_1, free.per_2)
    )


def _pounding_columns(
    station: StationMotion,
    table: Table,
    azimuth: FloatArray,
    demand: FloatArray,
    radii: Both,
) -> Columns:
    """
    Return the columns of the pounding histories; ``radii`` are those of the pairs without contact.

    Pairs whose demand without contact stays below their gap have no impact, and their radii are
    those without contact: they need no history.
    """
    meets = ~(demand < CERTAINLY_APART * values(table, "gap"))
    impacts, velocity = np.zeros(demand.size, dtype=np.int64), np.zeros(demand.size)
    amplification = np.ones((2, demand.size))
    if meets.any():
        history = _pounding_maxima(station, chosen(table, meets), azimuth[meets])
        impacts[meets], velocity[meets] = history.impacts, history.impact_velocity
        # impacts amplify the radius that the same oscillator has without contact
        amplification[:, meets] = _ratio(history.per, np.stack(radii)[:, meets])
    return {
        "impacts": impacts,
        "impact_velocity_exact": velocity,
        "amplification_exact_1": amplification[0],
        "amplification_exact_2": amplification[1],
    }


def exact_demand(station: StationMotion, table: Table, azimuth: FloatArray) -> FloatArray:
    """Return the largest relative displacement of 1 towards 2, as in :func:`exact_outcome`, m."""
    return _without_contact(station, table, azimuth).towards


def exact_approach(station: StationMotion, table: Table, azimuth: FloatArray) -> Approach:
    """Return the largest relative motion of linear buildings without contact, 1 towards 2."""
    motion = station.north, station.east, station.dt
    return approach(*motion, *_oscillators(table, azimuth))


def no_outcome(count: int) -> Columns:
    """Return empty ``EXACT_COLUMNS`` for a number of pairs."""
    return {name: np.full(count, np.nan) for name in EXACT_COLUMNS}


def _pounding_maxima(station: StationMotion, table: Table, azimuth: FloatArray) -> PoundingMaxima:
    """Return the maxima of the pounding histories, at contact level."""
    period_1, period_2 = both(table, "period")
    damping_1, damping_2 = both(table, "damping")
    mass_1, mass_2 = both(table, "contact_mass")
    share_1, share_2 = both(table, "participation")
    yield_1, yield_2 = at_contact(table, "yield_displacement")
    hardening_1, hardening_2 = both(table, "hardening")
    # bilinear oscillators in order 1, 2; an infinite yield displacement is a linear one
    return pounding_histories(
        np.stack([station.north, station.east]),
        station.dt,
        period_1,
        damping_1,
        mass_1,
        period_2,
        damping_2,
        mass_2,
        gap=values(table, "gap"),
        restitution=values(table, "restitution"),
        participation_1=share_1,
        participation_2=share_2,
        azimuth=azimuth,
        yield_displacement_1=yield_1,
        hardening_1=hardening_1,
        yield_displacement_2=yield_2,
        hardening_2=hardening_2,
    )


def _without_contact(station: StationMotion, table: Table, azimuth: FloatArray) -> _WithoutContact:
    """Return the response without contact; linear pairs take the shorter computation."""
    towards, away = np.empty((2, azimuth.size))
    per_1, per_2 = at_contact(table, "per")
    free = _WithoutContact(towards, away, per_1.copy(), per_2.copy())
    yields = can_yield(table)
    if not yields.all():
        # linear: the radii are those of the table
        oscillators = _oscillators(chosen(table, ~yields), azimuth[~yields])
        motion = station.north, station.east, station.dt
        linear = directional_relative_displacement(*motion, *oscillators)
        free.towards[~yields] = linear.one_before_two
        free.away[~yields] = linear.two_before_one
    if yields.any():
        # bilinear: the radii are those of the yielding oscillators
        bilinear = _bilinear(station, chosen(table, yields), azimuth[yields])
        free.towards[yields] = bilinear.one_before_two
        free.away[yields] = bilinear.two_before_one
        free.per_1[yields], free.per_2[yields] = bilinear.per
    return free


def _bilinear(
    station: StationMotion, pairs: Table, azimuth: FloatArray
) -> YieldingRelativeDisplacement:
    """Return the relative displacement of pairs in which a building can yield."""
    yield_1, yield_2 = at_contact(pairs, "yield_displacement")
    hardening_1, hardening_2 = both(pairs, "hardening")
    return yielding_relative_displacement(
        np.stack([station.north, station.east]),
        station.dt,
        *_oscillators(pairs, azimuth),
        yield_displacement_1=yield_1,
        hardening_1=hardening_1,
        yield_displacement_2=yield_2,
        hardening_2=hardening_2,
    )


def _oscillators(pairs: Table, azimuth: FloatArray) -> Oscillators:
    """Return the arguments of relative displacements: oscillators, azimuth and participations."""
    period_1, period_2 = both(pairs, "period")
    damping_1, damping_2 = both(pairs, "damping")
    share_1, share_2 = both(pairs, "participation")
    return period_1, damping_1, period_2, damping_2, azimuth, share_1, share_2


def _ratio(after: FloatArray, before: FloatArray) -> FloatArray:
    """Return after / before, 1 where the motion before is 0."""
    return np.divide(after, before, out=np.ones_like(after), where=before > 0)


#: Step of the scan over the added damping, fraction of critical.
SCAN_STEP = 0.04

#: The step before the first damping that is enough is halved so many times: to 4e-5.
HALVINGS = 10

#: Columns from which the exact demand follows.
NEEDED = (
    *("azimuth", "gap"),
    *(
        f"{name}_{i}"
        for name in ("period", "damping", "participation", "per", "yield_displacement", "hardening")
        for i in (1, 2)
    ),
)

#: Largest damping of a building that still vibrates, fraction of critical.
NEARLY_CRITICAL = 0.99


def least_exact_damping(station: StationMotion, table: Table, largest: float) -> FloatArray:
    """
    Find the least added damping of both buildings with which the exact demand fits into the gap.

    Parameters
    ----------
    station : StationMotion
        The record.
    table : Table
        Completed pairs whose exact demand decides and exceeds the gap.
    largest : float
        Largest damping to add, fraction of critical.

    Returns
    -------
    (n_pairs,) ndarray
        Fraction of critical, enough itself; NaN where none up to the largest is enough.
    """
    table = only(table, NEEDED)
    # As far as both buildings still vibrate
    limit = NEARLY_CRITICAL - np.maximum(*both(table, "damping"))
    most = np.minimum(largest, limit)
    enough, low = np.full((2, most.size), np.nan)
    # Scan: pairs that are helped or at their limit leave it
    waiting = np.arange(most.size)
    for step in range(1, int(np.ceil(largest / SCAN_STEP - 1e-9)) + 1):
        added = np.minimum(step * SCAN_STEP, most[waiting])
        fits = _fits(station, chosen(table, waiting), added)
        enough[waiting[fits]] = added[fits]
        low[waiting[fits]] = (step - 1) * SCAN_STEP
        waiting = waiting[~fits & (added < most[waiting])]
        if not waiting.size:
            break
    return _refined(station, table, low, enough)


def _refined(
    station: StationMotion, table: Table, low: FloatArray, enough: FloatArray
) -> FloatArray:
    """Refine the least damping by bisection; NaN stays."""
    found = np.flatnonzero(np.isfinite(enough))
    if not found.size:
        return enough
    # The upper end is always enough
    pairs = chosen(table, found)
    below, above = low[found], enough[found]
    for _ in range(HALVINGS):
        middle = 0.5 * (below + above)
        fits = _fits(station, pairs, middle)
        below, above = np.where(fits, below, middle), np.where(fits, middle, above)
    refined = enough.copy()
    refined[found] = above
    return refined


def _fits(station: StationMotion, table: Table, added: FloatArray) -> BoolArray:
    """Return a mask of the pairs whose exact demand with the added damping is at most the gap."""
    damping_1, damping_2 = both(table, "damping")
    damped = {name: table[name] for name in table}
    damped |= {"damping_1": damping_1 + added, "damping_2": damping_2 + added}
    # The worst azimuth turns as damping is added
    azimuth = values(table, "azimuth").copy()
    unknown = np.isnan(azimuth)
    if unknown.any():
        azimuth[unknown] = furthest_azimuth(station, chosen(damped, unknown))
    return exact_demand(station, damped, azimuth) <= values(table, "gap")
