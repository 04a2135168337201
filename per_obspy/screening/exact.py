"""
What a record does to pairs exactly: the relative displacement without contact, and the history with it.

Both buildings are oscillators at contact height, driven along one azimuth; nothing is estimated but the oscillators.
"""

from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.pounding.directional import worst_azimuth
from per_obspy.pounding.histories import pounding_histories
from per_obspy.pounding.relative import directional_relative_displacement
from per_obspy.screening.flags import period_is_derived
from per_obspy.screening.values import at_contact, both, components, number, values


def furthest_azimuth(station: xr.Dataset, pairs: pd.DataFrame) -> FloatArray:
    """Return, for pairs of unknown azimuth, the axis from 1 to 2 that the record makes worst, degrees."""
    (period_1, period_2), (damping_1, damping_2) = both(pairs, "period"), both(pairs, "damping")
    shares = both(pairs, "participation")
    return worst_azimuth(*components(station), period_1, damping_1, period_2, damping_2, *shares)


def exact_decides(station: xr.Dataset, pairs: pd.DataFrame) -> NDArray[np.bool_]:
    """
    Return for which pairs the exact demand is the demand.

    The record must hold both periods in its usable range and both horizontals; no period may be derived; both
    buildings must stay linear, because the relative displacement is that of linear ones.
    """
    periods = np.stack(both(pairs, "period"))
    shortest, longest = number(station, "shortest_usable_period"), number(station, "longest_usable_period")
    usable = ((periods >= shortest) & (periods <= longest)).all(axis=0)
    linear = np.isinf(np.stack(both(pairs, "yield_displacement"))).all(axis=0)
    decides: NDArray[np.bool_] = usable & linear & ~period_is_derived(pairs) & (station.sizes["horizontal"] == 2)
    return decides


def exact_outcome(station: xr.Dataset, table: pd.DataFrame, azimuth: FloatArray) -> dict[str, NDArray[Any]]:
    """
    Return the exact relative displacements and pounding histories of a block, as columns of the risk table.

    Parameters
    ----------
    station : Dataset
        The record.
    table : DataFrame
        Completed pairs with their radii along the azimuth.
    azimuth : (n_pairs,) ndarray
        Of the axis from 1 to 2, degrees; 0 where the station has one horizontal.
    """
    north, east, dt = components(station)
    (period_1, period_2), (damping_1, damping_2) = both(table, "period"), both(table, "damping")
    (share_1, share_2), (mass_1, mass_2) = both(table, "participation"), both(table, "contact_mass")
    (yield_1, yield_2), (hardening_1, hardening_2) = at_contact(table, "yield_displacement"), both(table, "hardening")
    apart = directional_relative_displacement(
        north, east, dt, period_1, damping_1, period_2, damping_2, azimuth, share_1, share_2
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
    per_1, per_2 = at_contact(table, "per")
    return {
        "demand_exact": apart.one_before_two,
        "demand_two_sided": apart.largest,
        "impacts": history.impacts,
        "impact_velocity_exact": history.impact_velocity,
        "amplification_exact_1": _ratio(history.per[0], per_1),
        "amplification_exact_2": _ratio(history.per[1], per_2),
    }


def _ratio(after: FloatArray, before: FloatArray) -> FloatArray:
    """Return after / before, 1 where there was no motion."""
    return np.divide(after, before, out=np.ones_like(after), where=before > 0)
