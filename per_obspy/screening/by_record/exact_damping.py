"""
Least added damping that keeps the buildings of a pair apart, by exact displacements.

Damping is added to both buildings in steps, and refined before the first step that is enough: more
damping does not always help. The demand is the one that decides of such pairs: along the pair's
azimuth, or along the worst one where that is unknown.
"""

import numpy as np
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.screening.by_record.exact import exact_demand, furthest_azimuth
from per_obspy.screening.by_record.station_motion import StationMotion
from per_obspy.screening.values import Table, both, chosen, only, values

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


def _fits(station: StationMotion, table: Table, added: FloatArray) -> NDArray[np.bool_]:
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
