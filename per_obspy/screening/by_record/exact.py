"""
What a record does to pairs exactly: the relative displacement without contact, and the history with it.

Both buildings are oscillators at contact height, driven along one azimuth; nothing is estimated but
the oscillators.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.pounding.correlation.by_azimuth import worst_azimuth
from per_obspy.pounding.history.pair_histories import pounding_histories
from per_obspy.pounding.history.relative import directional_relative_displacement
from per_obspy.pounding.history.relative_yielding import (
    YieldingRelativeDisplacement,
    yielding_relative_displacement,
)
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.values import (
    Columns,
    Table,
    at_contact,
    both,
    chosen,
    components,
    number,
    values,
)

#: Periods and dampings of 1 and 2, azimuth, participations.
Oscillators = tuple[
    FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray
]


class _Apart(NamedTuple):
    """Largest relative displacement of 1 towards 2 and in either order, and radii at contact level, m."""

    towards: FloatArray
    either_way: FloatArray
    per_1: FloatArray
    per_2: FloatArray


def furthest_azimuth(station: xr.Dataset, pairs: Table) -> FloatArray:
    """Return, for pairs of unknown azimuth, the axis from 1 to 2 that the record makes worst, degrees."""
    (period_1, period_2), (damping_1, damping_2) = both(pairs, "period"), both(pairs, "damping")
    shares = both(pairs, "participation")
    return worst_azimuth(*components(station), period_1, damping_1, period_2, damping_2, *shares)


def exact_decides(station: xr.Dataset, pairs: Table) -> NDArray[np.bool_]:
    """
    Return for which pairs the exact demand is the demand.

    The record must hold both periods in its usable range and both horizontals; no period may be
    derived. The worst azimuth is known of linear buildings only: where one can yield, the pair's
    azimuth must be given.
    """
    periods = np.stack(both(pairs, "period"))
    shortest, longest = (
        number(station, "shortest_usable_period"),
        number(station, "longest_usable_period"),
    )
    usable = ((periods >= shortest) & (periods <= longest)).all(axis=0)
    directed = ~can_yield(pairs) | np.isfinite(values(pairs, "azimuth"))
    decides: NDArray[np.bool_] = (
        usable & directed & ~period_is_derived(pairs) & (station.sizes["horizontal"] == 2)
    )
    return decides


def can_yield(pairs: Table) -> NDArray[np.bool_]:
    """Return which pairs have a building with a yield displacement."""
    return np.asarray(np.isfinite(np.stack(both(pairs, "yield_displacement"))).any(axis=0))


def exact_outcome(station: xr.Dataset, table: Table, azimuth: FloatArray) -> Columns:
    """
    Return the exact relative displacements and pounding histories of a block, as columns of the risk table.

    Parameters
    ----------
    station : Dataset
        The record.
    table : Table
        Completed pairs with their radii along the azimuth.
    azimuth : (n_pairs,) ndarray
        Of the axis from 1 to 2, degrees; 0 where the station has one horizontal.
    """
    north, east, dt = components(station)
    (period_1, period_2), (damping_1, damping_2) = both(table, "period"), both(table, "damping")
    (share_1, share_2), (mass_1, mass_2) = both(table, "participation"), both(table, "contact_mass")
    (yield_1, yield_2), (hardening_1, hardening_2) = (
        at_contact(table, "yield_displacement"),
        both(table, "hardening"),
    )
    history = pounding_histories(
        np.stack([north, east]),
        dt,
        period_1,
        damping_1,
        mass_1,
        period_2,
        damping_2,
        mass_2,
        values(table, "gap"),
        values(table, "restitution"),
        share_1,
        share_2,
        azimuth,
        yield_1,
        hardening_1,
        yield_2,
        hardening_2,
    )
    apart = _without_contact(station, table, azimuth)
    return {
        "demand_exact": apart.towards,
        "demand_two_sided": apart.either_way,
        "impacts": history.impacts,
        "impact_velocity_exact": history.impact_velocity,
        "amplification_exact_1": _ratio(history.per[0], apart.per_1),
        "amplification_exact_2": _ratio(history.per[1], apart.per_2),
    }


def _without_contact(station: xr.Dataset, table: Table, azimuth: FloatArray) -> _Apart:
    """Return what the record does to pairs that do not touch; those that cannot yield take the shorter way."""
    north, east, dt = components(station)
    apart = _Apart(*np.empty((2, azimuth.size)), *(one.copy() for one in at_contact(table, "per")))
    yields = can_yield(table)
    if not yields.all():
        linear = directional_relative_displacement(
            north, east, dt, *_oscillators(chosen(table, ~yields), azimuth[~yields])
        )
        apart.towards[~yields], apart.either_way[~yields] = linear.one_before_two, linear.largest
    if yields.any():
        bilinear = _bilinear(np.stack([north, east]), dt, chosen(table, yields), azimuth[yields])
        apart.towards[yields], apart.either_way[yields] = bilinear.one_before_two, bilinear.largest
        apart.per_1[yields], apart.per_2[yields] = bilinear.per
    return apart


def _bilinear(
    motion: FloatArray, dt: float, pairs: Table, azimuth: FloatArray
) -> YieldingRelativeDisplacement:
    limits, slopes = at_contact(pairs, "yield_displacement"), both(pairs, "hardening")
    strength = {f"yield_displacement_{i}": limit for i, limit in enumerate(limits, start=1)}
    strength |= {f"hardening_{i}": slope for i, slope in enumerate(slopes, start=1)}
    return yielding_relative_displacement(motion, dt, *_oscillators(pairs, azimuth), **strength)


def _oscillators(pairs: Table, azimuth: FloatArray) -> Oscillators:
    """Return periods and dampings, azimuth and participations in the order of relative displacements."""
    (period_1, period_2), (damping_1, damping_2) = both(pairs, "period"), both(pairs, "damping")
    share_1, share_2 = both(pairs, "participation")
    return period_1, damping_1, period_2, damping_2, azimuth, share_1, share_2


def no_outcome(count: int) -> Columns:
    """Return the columns of :func:`exact_outcome`, all empty, for so many pairs."""
    names = ("demand_exact", "demand_two_sided", "impacts", "impact_velocity_exact", "amplification_exact_1",
             "amplification_exact_2")  # fmt: skip
    return {name: np.full(count, np.nan) for name in names}


def _ratio(after: FloatArray, before: FloatArray) -> FloatArray:
    """Return after / before, 1 where there was no motion."""
    return np.divide(after, before, out=np.ones_like(after), where=before > 0)
