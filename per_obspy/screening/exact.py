"""
What a record does to pairs exactly: the relative displacement without contact, and the history with it.

Both buildings are oscillators at contact height, driven along one azimuth; nothing is estimated but the oscillators.
"""

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.pounding.directional import worst_azimuth
from per_obspy.pounding.histories import pounding_histories
from per_obspy.pounding.relative import directional_relative_displacement
from per_obspy.screening.flags import period_is_derived


def components(station: xr.Dataset) -> tuple[FloatArray, FloatArray, float]:
    """Return north, east (m/s²) and interval (s); a single horizontal counts as north, to be used at azimuth 0."""
    motion = station["acceleration"].to_numpy()
    east = motion[1] if len(motion) == 2 else np.zeros_like(motion[0])
    return np.ascontiguousarray(motion[0]), np.ascontiguousarray(east), float(station["sampling_interval"])


def furthest_azimuth(station: xr.Dataset, pairs: pd.DataFrame) -> FloatArray:
    """Return, for pairs of unknown azimuth, the axis from 1 to 2 that the record makes worst, degrees."""
    arguments = [pairs[f"{name}_{i}"].to_numpy(np.float64) for i in (1, 2) for name in ("period", "damping")]
    participation = [pairs[f"participation_{i}"].to_numpy(np.float64) for i in (1, 2)]
    return worst_azimuth(*components(station), *arguments, *participation)


def exact_decides(station: xr.Dataset, pairs: pd.DataFrame) -> NDArray[np.bool_]:
    """
    Return for which pairs the exact demand is the demand.

    The record must hold both periods in its usable range and both horizontals; no period may be derived; both
    buildings must stay linear, because the relative displacement is that of linear ones.
    """
    periods = pairs[["period_1", "period_2"]].to_numpy(np.float64)
    shortest, longest = float(station["shortest_usable_period"]), float(station["longest_usable_period"])
    usable = ((periods >= shortest) & (periods <= longest)).all(axis=1)
    linear = np.isinf(pairs[["yield_displacement_1", "yield_displacement_2"]].to_numpy(np.float64)).all(axis=1)
    decides: NDArray[np.bool_] = usable & linear & ~period_is_derived(pairs) & (station.sizes["horizontal"] == 2)
    return decides


def exact_outcome(
    station: xr.Dataset, pairs: pd.DataFrame, azimuth: FloatArray, per: tuple[FloatArray, FloatArray]
) -> dict[str, NDArray[np.generic]]:
    """
    Return the exact relative displacements and pounding histories of a block, as columns of the risk table.

    Parameters
    ----------
    station : Dataset
        The record.
    pairs : DataFrame
        Completed pairs.
    azimuth : (n_pairs,) ndarray
        Of the axis from 1 to 2, degrees; 0 where the station has one horizontal.
    per : pair of (n_pairs,) ndarray
        Radii without pounding along that azimuth at contact height, m.
    """
    north, east, dt = components(station)
    both = {
        f"{name}_{i}": pairs[f"{name}_{i}"].to_numpy(np.float64)
        for name in ("period", "damping", "participation")
        for i in (1, 2)
    }
    apart = directional_relative_displacement(north, east, dt, azimuth=azimuth, **both)
    yielding = {
        f"yield_displacement_{i}": pairs[f"yield_displacement_{i}"].to_numpy(np.float64) * both[f"participation_{i}"]
        for i in (1, 2)
    }
    history = pounding_histories(
        np.stack([north, east]),
        dt,
        gap=pairs["gap"].to_numpy(np.float64),
        restitution=pairs["restitution"].to_numpy(np.float64),
        azimuth=azimuth,
        **{f"mass_{i}": pairs[f"contact_mass_{i}"].to_numpy(np.float64) for i in (1, 2)},
        **{f"hardening_{i}": pairs[f"hardening_{i}"].to_numpy(np.float64) for i in (1, 2)},
        **both,
        **yielding,
    )
    return {
        "demand_exact": apart.one_before_two,
        "demand_two_sided": apart.largest,
        "impacts": history.impacts,
        "impact_velocity_exact": history.impact_velocity,
        "amplification_exact_1": _ratio(history.per[0], per[0]),
        "amplification_exact_2": _ratio(history.per[1], per[1]),
    }


def _ratio(after: FloatArray, before: FloatArray) -> FloatArray:
    return np.divide(after, before, out=np.ones_like(after), where=before > 0)
